//! TR-BDF2: a trapezoidal stage, then BDF2 to the end of the step; two solves with the same matrix.
//!
//! On linear problems the amplification is that of SDIRK2. The stage order is 2, so that the order is
//! kept on stiff nonlinear problems.
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
    // Difference of weights (sqrt 2 - 1)/3, -1/3, (2 - sqrt 2)/3: the estimate of Bank et al., of order
    // 3.
    companion: Some(Companion {
        difference: &[0.138_071_187_457_698_36, -1.0 / 3.0, 0.195_262_145_875_634_98],
        order: 3,
    }),
};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "tr-bdf2",
        summary: "Second order, L-stable, keeps its order on stiff problems: the robust choice",
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
