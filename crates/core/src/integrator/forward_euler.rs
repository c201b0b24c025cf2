//! Forward Euler (lecture 4), for comparison.
//!
//! `x+ = x + h v`, `v+ = v + h M^-1 f(x)`. On the oscillator `|R(iz)|^2 = 1 + z^2`: it gains energy at
//! every step size.
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "forward-euler",
        summary: "Forward Euler: fast, gains energy at every step; to compare against",
        order: 1,
        force_evaluations: 1,
        solves: 0,
        stability_limit: 0.0,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, section I.7",
    },
    scheme: Scheme::RungeKutta(Tableau { a: &[&[]], b: &[1.0], companion: None }),
};
