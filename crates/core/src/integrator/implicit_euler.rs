//! Implicit Euler: `x+ = x + h v+`, `v+ = v + h M^-1 f(x+)` (lecture 6).
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

pub(super) const TABLEAU: Tableau = Tableau { a: &[&[1.0]], b: &[1.0], companion: None };

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "implicit-euler",
        summary: "First order, damps strongly, stable at any step: each step minimises an incremental \
                  potential",
        order: 1,
        force_evaluations: 0,
        solves: 1,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Wanner 1996, Solving Ordinary Differential Equations II, section IV.3",
    },
    scheme: Scheme::Dirk(TABLEAU),
};
