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

/// Basis of energies linear in the Lame parameters: materials with `mu = 1` and `lambda` 0 and 1, which
/// nodal integration splits in proportion.
pub(super) fn unit_materials(material: &MaterialSpec) -> Option<[MaterialSpec; 2]> {
    let [shear, both] = [(2.0, 0.0), (2.5, 0.25)]
        .map(|(young, poisson)| with(material, Isotropic { young, poisson, preset: None }));
    Some([shear?, both?])
}

/// Derivatives of `mu` and `lambda` by Poisson's ratio, for the shares that nodal integration assigns to
/// the nodes and to the elements; `part` is the elements' fraction of the shear modulus.
pub(super) fn split_by_poisson(material: &MaterialSpec, part: f64) -> Option<[(f64, f64); 2]> {
    let (solid, plane) = isotropic(material)?;
    let [_, in_elements] = material.split(part)?;
    let (mu, lambda) = rates_by_poisson(&solid, false);
    let of_elements = isotropic(&in_elements)?.0;
    // If the solid is less compressible than the elements' share, the share depends on its shear modulus only.
    let in_elements = match of_elements.poisson < solid.poisson {
        true => (part * mu, part * mu * 2.0 * of_elements.poisson / (1.0 - 2.0 * of_elements.poisson)),
        false => (part * mu, part * lambda),
    };
    let at_nodes = (mu - in_elements.0, lambda - in_elements.1);
    (plane != Some(Plane::Stress)).then_some([at_nodes, in_elements])
}

/// Derivatives of `mu` and `lambda` (for plane stress its reduced value) by Poisson's ratio.
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
