//! Dormand and Prince's Runge-Kutta pair of orders 5 and 4. The last stage is the first stage of the next
//! step.
//!
//! On the oscillator `|R(iz)|^2 = 1 - z^6/1800 + ...`: the method loses energy below `z = 0.997` and
//! gains energy above, slowly at first.
use super::estimate::Companion;
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "dormand-prince5",
        summary: "Runge-Kutta pair of orders 5 and 4: the usual choice for adaptive steps on smooth problems",
        order: 5,
        force_evaluations: 6,
        solves: 0,
        stability_limit: 0.997_189_008_632_53,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, table II.5.2",
    },
    scheme: Scheme::RungeKutta(Tableau {
        a: &[
            &[],
            &[1.0 / 5.0],
            &[3.0 / 40.0, 9.0 / 40.0],
            &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
            &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
            &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
            &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
        ],
        b: &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0],
        // The companion has the weights 5179/57600, 0, 7571/16695, 393/640, -92097/339200, 187/2100, 1/40.
        companion: Some(Companion {
            difference: &[
                71.0 / 57600.0,
                0.0,
                -71.0 / 16695.0,
                71.0 / 1920.0,
                -17253.0 / 339_200.0,
                22.0 / 525.0,
                -1.0 / 40.0,
            ],
            order: 4,
        }),
    }),
};
