//! TR-BDF2: a trapezoidal stage, then BDF2 to the end, as one method with two solves of the same matrix.
//!
//! The same amplification as SDIRK2 on linear problems, but of stage order 2: on stiff nonlinear ones it
//! keeps its order.
use super::estimate::Companion;
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

pub(super) const TABLEAU: Tableau = Tableau {
    a: &[
        &[0.0],
        &[0.292_893_218_813_452_5, 0.292_893_218_813_452_5],
        &[0.353_553_390_593_273_8, 0.353_553_390_593_273_8, 0.292_893_218_813_452_5],
    ],
    b: &[0.353_553_390_593_273_8, 0.353_553_390_593_273_8, 0.292_893_218_813_452_5],
    // (sqrt 2 - 1)/3, -1/3, (2 - sqrt 2)/3: the estimate of Bank et al. as weights, of order 3.
    companion: Some(Companion {
        difference: &[0.138_071_187_457_698_36, -1.0 / 3.0, 0.195_262_145_875_634_98],
        order: 3,
    }),
};

/// The scheme and what is known of it.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "tr-bdf2",
        summary: "Second order, damps fast motion out, keeps its order on stiff problems: the robust choice",
        order: 2,
        force_evaluations: 0,
        solves: 2,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Hosea, Shampine 1996, Analysis and implementation of TR-BDF2",
    },
    scheme: Scheme::Dirk(TABLEAU),
};
