//! Velocity Verlet: half a kick, a drift, half a kick.
//!
//! On the oscillator it conserves `(1 - z^2/4) x^2 + v^2` exactly. The last force of a step is reused as
//! the first force of the next.
use super::splitting::Stage::{Drift, Kick};
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "velocity-verlet",
        summary: "Velocity Verlet: second order at one force a step, no energy drift",
        order: 2,
        force_evaluations: 1,
        solves: 0,
        stability_limit: 2.0,
        symplectic: true,
        conserves: "angular momentum; energy up to a bounded oscillation of order h^2",
        source: "Hairer, Lubich, Wanner 2006, Geometric Numerical Integration, section I.1.4",
    },
    scheme: Scheme::Splitting(&[Kick(0.5), Drift(1.0), Kick(0.5)]),
};
