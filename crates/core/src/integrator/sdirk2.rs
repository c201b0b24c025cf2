//! The L-stable singly diagonally implicit Runge-Kutta method of two stages and order 2, `gamma = 1 - 1/sqrt 2`.
//!
//! Of stage order 1: on stiff problems its order falls to 1 (verification.md A7).
use std::f64::consts::FRAC_1_SQRT_2;

use super::estimate::Companion;
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The scheme and what is known of it.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "sdirk2",
        summary: "Second order, two solves, damps fast motion out; loses order on stiff problems: for comparison",
        order: 2,
        force_evaluations: 0,
        solves: 2,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Alexander 1977, Diagonally implicit Runge-Kutta methods for stiff ODEs, theorem 3",
    },
    scheme: Scheme::Dirk(Tableau {
        a: &[&[0.292_893_218_813_452_5], &[FRAC_1_SQRT_2, 0.292_893_218_813_452_5]],
        b: &[FRAC_1_SQRT_2, 0.292_893_218_813_452_5],
        // Less 1, 0: of order 1 on the first stage alone.
        companion: Some(Companion {
            difference: &[-0.292_893_218_813_452_5, 0.292_893_218_813_452_5],
            order: 1,
        }),
    }),
};
