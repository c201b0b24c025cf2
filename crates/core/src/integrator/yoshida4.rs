//! Yoshida's method of order 4: three steps of velocity Verlet, of sizes `w1 h`, `w0 h`, `w1 h`.
//!
//! `w1 = 1 / (2 - 2^(1/3))`, `w0 = 1 - 2 w1 = -2^(1/3) w1`: the middle step goes backwards.
use super::splitting::Stage::{self, Drift, Kick};
use super::{Documentation, Method, Scheme};

/// `w1 = 1 / (2 - 2^(1/3))`.
const W1: f64 = 1.351_207_191_959_657_6;
/// `w0 = 1 - 2 w1`.
const W0: f64 = 1.0 - 2.0 * W1;

const STAGES: [Stage; 7] = [
    Kick(0.5 * W1),
    Drift(W1),
    Kick(0.5 * (W1 + W0)),
    Drift(W0),
    Kick(0.5 * (W0 + W1)),
    Drift(W1),
    Kick(0.5 * W1),
];

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "yoshida4",
        summary: "Yoshida's triple jump: fourth order, no energy drift, three forces a step",
        order: 4,
        force_evaluations: 3,
        solves: 0,
        stability_limit: 1.573_401_947_435_6,
        symplectic: true,
        conserves: "angular momentum; energy up to a bounded oscillation of order h^4",
        source: "Yoshida 1990, Physics Letters A 150, 262-268",
    },
    scheme: Scheme::Splitting(&STAGES),
};
