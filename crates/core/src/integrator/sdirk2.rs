//! L-stable singly diagonally implicit Runge-Kutta method of two stages and order 2,
//! `gamma = 1 - 1/sqrt 2`.
//!
//! The stage order is 1: on stiff problems the order falls to 1 (verification.md A7).
//!
//! Two stages only admit a companion of order 1. Its estimate, that of implicit Euler, is orders of
//! magnitude above the error of a small step. The known derivative at the start of the step therefore
//! serves as a third stage, with zero weight in the method.
use std::f64::consts::FRAC_1_SQRT_2;

use super::estimate::Companion;
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "sdirk2",
        summary: "Second order, two solves, L-stable; loses order on stiff problems: for \
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
        // Difference of weights sqrt 2/3, -2/3, (2 - sqrt 2)/3: the only companion of order 2 whose
        // estimate for `y' = lambda y` is `C (h lambda)^3`, with `C` the error constant of the method,
        // `R(w) - exp(w) = C w^3 + ..`, `C = 3 gamma^2 - 2 gamma^3 - 1/6`.
        companion: Some(Companion {
            difference: &[0.471_404_520_791_031_7, -2.0 / 3.0, 0.195_262_145_875_634_98],
            order: 2,
        }),
    }),
};
