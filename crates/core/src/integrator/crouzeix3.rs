//! Crouzeix's A-stable singly diagonally implicit Runge-Kutta method of two stages and order 3,
//! `gamma = (3 + sqrt 3)/6`.
//!
//! High-frequency damping is mild: a factor of at least `sqrt 3 - 1` per step.
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "crouzeix3",
        summary: "Third order, two solves, damps high frequencies only mildly: for comparison",
        order: 3,
        force_evaluations: 0,
        solves: 2,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Wanner 1996, Solving Ordinary Differential Equations II, table IV.6.3 for s = 2",
    },
    scheme: Scheme::Dirk(Tableau {
        a: &[&[0.788_675_134_594_812_9], &[-0.577_350_269_189_625_7, 0.788_675_134_594_812_9]],
        b: &[0.5, 0.5],
        companion: None,
    }),
};
