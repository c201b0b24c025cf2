//! Trapezoidal rule; equivalent to Newmark's method with `beta = 1/4`, `gamma = 1/2`.
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "trapezoid",
        summary: "Second order, no damping; can gain energy on stiff nonlinear problems at large steps",
        order: 2,
        force_evaluations: 0,
        solves: 1,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else; conjugate to the implicit midpoint rule",
        source: "Hairer, Wanner 1996, Solving Ordinary Differential Equations II, section IV.3",
    },
    scheme: Scheme::Dirk(Tableau { a: &[&[0.0], &[0.5, 0.5]], b: &[0.5, 0.5], companion: None }),
};
