//! Gauss method with two stages: order 4, symplectic, no damping.
use super::collocation::CollocationTableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "gauss2",
        summary: "Fourth order, symplectic, no damping; one coupled solve of two stages",
        order: 4,
        force_evaluations: 0,
        solves: 1,
        stability_limit: f64::INFINITY,
        symplectic: true,
        conserves: "angular momentum, quadratic invariants",
        source: "Hairer, Lubich, Wanner 2006, Geometric Numerical Integration, section II.1.3",
    },
    scheme: Scheme::Collocation(CollocationTableau {
        a: &[&[0.25, -0.038_675_134_594_812_88], &[0.538_675_134_594_812_9, 0.25]],
        b: &[0.5, 0.5],
    }),
};
