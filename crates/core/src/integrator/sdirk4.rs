//! L-stable singly diagonally implicit Runge-Kutta method of five stages and order 4, `gamma = 1/4`.
//!
//! The stage order is 1. Despite L-stability the method gains energy on a stiff pendulum (verification.md
//! A6).
use super::estimate::Companion;
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "sdirk4",
        summary: "Fourth order, five solves; accurate where motion is resolved, can gain energy on stiff \
                  nonlinear problems",
        order: 4,
        force_evaluations: 0,
        solves: 5,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Wanner 1996, Solving Ordinary Differential Equations II, table IV.6.5",
    },
    scheme: Scheme::Dirk(Tableau {
        a: &[
            &[0.25],
            &[0.5, 0.25],
            &[17.0 / 50.0, -1.0 / 25.0, 0.25],
            &[371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0, 0.25],
            &[25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0, 0.25],
        ],
        b: &[25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0, 0.25],
        // Companion weights 59/48, -17/96, 225/32, -85/12, 0; same table.
        companion: Some(Companion {
            difference: &[-3.0 / 16.0, -27.0 / 32.0, 25.0 / 32.0, 0.0, 0.25],
            order: 3,
        }),
    }),
};
