//! Radau IIA with two stages: order 3, L-stable.
use super::collocation::CollocationTableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "radau-iia2",
        summary: "Third order, L-stable, keeps its order on stiff problems; one coupled solve of \
                  two stages",
        order: 3,
        force_evaluations: 0,
        solves: 1,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Wanner 1996, Solving Ordinary Differential Equations II, table IV.5.5",
    },
    scheme: Scheme::Collocation(CollocationTableau {
        a: &[&[5.0 / 12.0, -1.0 / 12.0], &[0.75, 0.25]],
        b: &[0.75, 0.25],
    }),
};
