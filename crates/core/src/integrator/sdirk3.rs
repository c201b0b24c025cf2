//! Alexander's L-stable singly diagonally implicit Runge-Kutta method of three stages and order 3.
//!
//! The stage order is 1: on stiff problems the order falls to 1 (verification.md A7).
use super::estimate::Companion;
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "sdirk3",
        summary: "Third order, three solves, L-stable; loses order on stiff problems: for \
                  comparison",
        order: 3,
        force_evaluations: 0,
        solves: 3,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Alexander 1977, Diagonally implicit Runge-Kutta methods for stiff ODEs, theorem 5",
    },
    scheme: Scheme::Dirk(Tableau {
        a: &[
            &[0.435_866_521_508_459],
            &[0.282_066_739_245_770_5, 0.435_866_521_508_459],
            &[1.208_496_649_176_01, -0.644_363_170_684_469, 0.435_866_521_508_459],
        ],
        b: &[1.208_496_649_176_01, -0.644_363_170_684_469, 0.435_866_521_508_459],
        // Companion weights 0.7726, 0.2274, 0: order 2 on the first two stages.
        companion: Some(Companion {
            difference: &[0.435_866_521_508_459, -0.871_733_043_016_918, 0.435_866_521_508_459],
            order: 2,
        }),
    }),
};
