//! Symplectic Euler: kick, then drift (lecture 5).
//!
//! `v+ = v + h M^-1 f(x)`, `x+ = x + h v+`. On the oscillator it conserves `x^2 + v^2 - z x v` exactly.
use super::splitting::Stage::{Drift, Kick};
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "symplectic-euler",
        summary: "Symplectic Euler, kick then drift: one force a step, no energy drift; the default \
                  explicit method",
        order: 1,
        force_evaluations: 1,
        solves: 0,
        stability_limit: 2.0,
        symplectic: true,
        conserves: "angular momentum; energy up to a bounded oscillation of order h",
        source: "Hairer, Lubich, Wanner 2006, Geometric Numerical Integration, section I.1.2",
    },
    scheme: Scheme::Splitting(&[Kick(1.0), Drift(1.0)]),
};
