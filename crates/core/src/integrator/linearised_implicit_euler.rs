//! Implicit Euler with one Newton step from the old positions instead of a full solve: `(M + h^2 K(x_n))
//! dv = h (f(x_n) - h K(x_n) v_n)` (lecture 22).
//!
//! One linear solve per step. It is exact for linear systems; otherwise its error grows with the step
//! size.
use super::{Documentation, Method, Scheme, implicit_euler};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "linearised-implicit-euler",
        summary: "Implicit Euler with one linear solve a step instead of a nonlinear one, as in the \
                  lecture's cloth",
        order: 1,
        force_evaluations: 0,
        solves: 1,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Baraff, Witkin 1998, Large steps in cloth simulation, eq. 6",
    },
    scheme: Scheme::Linearised(implicit_euler::TABLEAU),
};
