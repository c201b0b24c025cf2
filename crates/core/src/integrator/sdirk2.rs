//! The L-stable singly diagonally implicit Runge-Kutta method of two stages and order 2, `gamma = 1 - 1/sqrt
//! 2`.
//!
//! Of stage order 1: on stiff problems its order falls to 1 (verification.md A7).
//!
//! Two stages have no companion but of order 1, whose estimate is that of implicit Euler: orders of
//! magnitude above the error of a small step. The derivative at the beginning of the step, which is known,
//! is a third stage of no weight in the method.
use std::f64::consts::FRAC_1_SQRT_2;

use super::estimate::Companion;
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The scheme and what is known of it.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "sdirk2",
        summary: "Second order, two solves, damps fast motion out; loses order on stiff problems: for \
                  comparison",
        order: 2,
        force_evaluations: 0,
        solves: 2,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Alexander 1977, Diagonally implicit Runge-Kutta methods for stiff ODEs, theorem 3",
    },
    scheme: Scheme::Dirk(Tableau {
        a: &[&[0.0], &[0.0, 0.292_893_218_813_452_5], &[0.0, FRAC_1_SQRT_2, 0.292_893_218_813_452_5]],
        b: &[0.0, FRAC_1_SQRT_2, 0.292_893_218_813_452_5],
        // sqrt 2/3, -2/3, (2 - sqrt 2)/3: the one companion of order 2 for which `y' = lambda y` has the
        // estimate `C (h lambda)^3`, `C` of the error of the method, `R(w) - exp(w) = C w^3 + ..`, `C = 3
        // gamma^2 - 2 gamma^3 - 1/6`.
        companion: Some(Companion {
            difference: &[0.471_404_520_791_031_7, -2.0 / 3.0, 0.195_262_145_875_634_98],
            order: 2,
        }),
    }),
};
