//! Bogacki and Shampine's Runge-Kutta pair of orders 3 and 2. The last stage is the first stage of the
//! next step.
//!
//! On the oscillator `|R(iz)|^2 = 1 - z^4/12 + z^6/36`: the method loses energy below `z = sqrt 3` and
//! gains energy above.
use super::estimate::Companion;
use super::tableau::Tableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "bogacki-shampine3",
        summary: "Runge-Kutta pair of orders 3 and 2: adaptive steps at modest accuracy",
        order: 3,
        force_evaluations: 3,
        solves: 0,
        stability_limit: 1.732_050_807_568_877_2,
        symplectic: false,
        conserves: "nothing else",
        source: "Bogacki, Shampine 1989, A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2, 321",
    },
    scheme: Scheme::RungeKutta(Tableau {
        a: &[&[], &[0.5], &[0.0, 0.75], &[2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0]],
        b: &[2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0, 0.0],
        // Companion weights 7/24, 1/4, 1/3, 1/8.
        companion: Some(Companion { difference: &[-5.0 / 72.0, 1.0 / 12.0, 1.0 / 9.0, -0.125], order: 2 }),
    }),
};
