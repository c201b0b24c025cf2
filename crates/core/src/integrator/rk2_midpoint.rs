//! Explicit midpoint rule, a Runge-Kutta method of order 2.
//!
//! On the oscillator `|R(iz)|^2 = 1 + z^4/4`: it gains energy at every step, slowly.
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "rk2-midpoint",
        summary: "Explicit midpoint rule: second order, gains energy slowly at every step",
        order: 2,
        force_evaluations: 2,
        solves: 0,
        stability_limit: 0.0,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, section II.1",
    },
    scheme: Scheme::RungeKutta(Tableau { a: &[&[], &[0.5]], b: &[0.0, 1.0], companion: None }),
};
