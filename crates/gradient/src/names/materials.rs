//! Parameters of materials whose energies are linear in the Lame parameters.

use pliant::material::{Isotropic, Lame, MaterialSpec, Plane};

/// Young's modulus of a material whose energy is proportional to it.
pub(super) fn young(material: &MaterialSpec) -> Option<f64> {
    match material {
        MaterialSpec::Arap(parameters) => Some(parameters.young),
        _ => isotropic(material).map(|(solid, _)| solid.young),
    }
}

/// Stiffness of a material that has only this constant and is proportional to it [Pa].
pub(super) fn stiffness(material: &MaterialSpec) -> Option<f64> {
    match material {
        MaterialSpec::Dirichlet(parameters) | MaterialSpec::DisplacementGradient(parameters) => {
            Some(parameters.stiffness)
        }
        _ => None,
    }
}

/// Factors and materials whose energies add up to the derivative of the energy by Poisson's ratio.
pub(super) fn by_poisson(material: &MaterialSpec, dimension: usize) -> Option<[(f64, MaterialSpec); 2]> {
    let (solid, plane) = isotropic(material)?;
    let in_plane_stress = dimension == 2 && plane == Some(Plane::Stress);
    let (mu_rate, lambda_rate) = rates_by_poisson(&solid, in_plane_stress);
    // Both have mu = 1; the first has lambda = 0.
    let [shear, both] = [(2.0, 0.0), (2.5, 0.25)];
    let lambda = if in_plane_stress { both.0 * both.1 / (1.0 - both.1 * both.1) } else { lame_lambda(both) };
    let of_both = lambda_rate / lambda;
    let filled = |(young, poisson)| with(material, Isotropic { young, poisson, preset: None });
    Some([(mu_rate - of_both, filled(shear)?), (of_both, filled(both)?)])
}

/// Derivatives of `mu` and of `lambda`, or of that of plane stress, by Poisson's ratio.
pub(super) fn rates_by_poisson(solid: &Isotropic, in_plane_stress: bool) -> (f64, f64) {
    let (young, nu) = (solid.young, solid.poisson);
    let mu = -0.5 * young / ((1.0 + nu) * (1.0 + nu));
    if in_plane_stress {
        return (mu, young * (1.0 + nu * nu) / ((1.0 - nu * nu) * (1.0 - nu * nu)));
    }
    (mu, young * (1.0 + 2.0 * nu * nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)).powi(2))
}

fn lame_lambda((young, poisson): (f64, f64)) -> f64 {
    Lame::new(young, poisson).lambda
}

/// Defines functions for the materials that are isotropic and linear in the Lame parameters.
macro_rules! isotropic_models {
    ($($model:ident),+) => {
        /// Constants of a material whose energy is linear in the Lame parameters, and the plane state it
        /// names.
        pub(super) fn isotropic(material: &MaterialSpec) -> Option<(Isotropic, Option<Plane>)> {
            match material {
                MaterialSpec::Linear(parameters) => Some((parameters.solid, parameters.plane)),
                $(MaterialSpec::$model(parameters) => Some((*parameters, None)),)+
                _ => None,
            }
        }

        /// Copy of the material with other constants.
        fn with(material: &MaterialSpec, solid: Isotropic) -> Option<MaterialSpec> {
            match material {
                MaterialSpec::Linear(parameters) => {
                    let mut parameters = *parameters;
                    parameters.solid = solid;
                    Some(MaterialSpec::Linear(parameters))
                }
                $(MaterialSpec::$model(_) => Some(MaterialSpec::$model(solid)),)+
                _ => None,
            }
        }
    };
}

isotropic_models!(
    Stvk,
    Corotated,
    FixedCorotated,
    NeoHookean,
    StableNeoHookean,
    StableNeoHookeanLog,
    NeoHookeanJ,
    IsochoricNeoHookean,
    Hencky
);
