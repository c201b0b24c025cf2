//! Implicit Euler with one Newton step from the old positions in place of a solution:
//! `(M + h^2 K(x_n)) dv = h (f(x_n) - h K(x_n) v_n)` (lecture 22).
//!
//! One linear solve a step, whatever happens; exact for linear systems, elsewhere the larger the step the
//! further off.
use super::{Documentation, Method, Scheme, implicit_euler};

/// The scheme and what is known of it.
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
