//! Classical Runge-Kutta method of order 4.
//!
//! On the oscillator `|R(iz)|^2 = 1 - z^6/72 + z^8/576`: the method loses energy below `z = 2 sqrt 2` and
//! gains energy above.
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "rk4",
        summary: "Classical Runge-Kutta: fourth order, loses energy slowly",
        order: 4,
        force_evaluations: 4,
        solves: 0,
        stability_limit: 2.828_427_124_746_19,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, section II.1",
    },
    scheme: Scheme::RungeKutta(Tableau {
        a: &[&[], &[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]],
        b: &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
        companion: None,
    }),
};
