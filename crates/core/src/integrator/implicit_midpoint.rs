//! Implicit midpoint rule, the Gauss method with one stage.
//!
//! Symplectic and A-stable on linear systems, but not unconditionally stable: on stiff nonlinear systems
//! it gains energy without bound at large steps (verification.md A6: a stiff pendulum at `h omega` of
//! 50).
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "implicit-midpoint",
        summary: "Second order, symplectic, no damping; can gain energy on stiff nonlinear problems at \
                  large steps",
        order: 2,
        force_evaluations: 0,
        solves: 1,
        stability_limit: f64::INFINITY,
        symplectic: true,
        conserves: "angular momentum, quadratic invariants",
        source: "Hairer, Lubich, Wanner 2006, Geometric Numerical Integration, section II.1.1",
    },
    scheme: Scheme::Dirk(Tableau { a: &[&[0.5]], b: &[1.0], companion: None }),
};
