//! Radau IIA with three stages: order 5, L-stable.
use super::collocation::CollocationTableau;
use super::{Documentation, Method, Scheme};

/// The method and its documentation.
pub const METHOD: Method = Method {
    documentation: Documentation {
        name: "radau-iia3",
        summary: "Fifth order, L-stable: for accurate solutions of stiff problems; one coupled \
                  solve of three stages",
        order: 5,
        force_evaluations: 0,
        solves: 1,
        stability_limit: f64::INFINITY,
        symplectic: false,
        conserves: "nothing else",
        source: "Hairer, Wanner 1996, Solving Ordinary Differential Equations II, table IV.5.6",
    },
    scheme: Scheme::Collocation(CollocationTableau {
        a: &[
            &[0.196_815_477_223_660_4, -0.065_535_425_850_198_39, 0.023_770_974_348_220_15],
            &[0.394_424_314_739_087_3, 0.292_073_411_665_228_5, -0.041_548_752_125_997_93],
            &[0.376_403_062_700_467_25, 0.512_485_826_188_421_6, 0.111_111_111_111_111_1],
        ],
        b: &[0.376_403_062_700_467_25, 0.512_485_826_188_421_6, 0.111_111_111_111_111_1],
    }),
};
