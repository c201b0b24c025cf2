//! Springs, and what resists bending, by the number of dimensions.

use pliant::dissipation::{DashpotFormula, DissipativeTerm, MeasuredRate};
use pliant::energy::EnergyTerm;
use pliant::energy::measure::{Curvature, HingeAngle, Length, ScalarStrainEnergy, StencilConstants};
use pliant::energy::spring::{SpringFormula, Springs};

/// Springs of `body` along `edges` (vertices of the system) with these stiffnesses [N/m] and rest lengths
/// [m], as [`Springs::new`] has them; the system has `vertex_count` vertices.
///
/// # Panics
/// As there.
pub fn springs(
    dimension: usize,
    body: &str,
    edges: &[[u32; 2]],
    (stiffness, rest_length): (&[f64], &[f64]),
    vertex_count: usize,
) -> Box<dyn EnergyTerm> {
    match dimension {
        2 => Box::new(Springs::<2>::new(body, edges, stiffness, rest_length, vertex_count)),
        _ => Box::new(Springs::<3>::new(body, edges, stiffness, rest_length, vertex_count)),
    }
}

/// Constants of formulas of lengths.
fn of_lengths(rest_length: &[f64]) -> Vec<StencilConstants> {
    let constants = |length: &f64| StencilConstants { stiffness: 1.0, rest: [*length, 0.0] };
    rest_length.iter().map(constants).collect()
}

/// Springs whose energy is a formula of their length, as [`ScalarStrainEnergy::with_law`] has them.
///
/// # Panics
/// As there.
pub fn expressed_springs(
    dimension: usize,
    body: &str,
    formula: SpringFormula,
    edges: &[[u32; 2]],
    rest_length: &[f64],
    rest: &[f64],
) -> Box<dyn EnergyTerm> {
    type Stretch<const D: usize> = ScalarStrainEnergy<Length, D, 2, SpringFormula>;
    let constants = of_lengths(rest_length);
    match dimension {
        2 => Box::new(Stretch::<2>::with_law(body, formula, edges, &constants, rest)),
        _ => Box::new(Stretch::<3>::with_law(body, formula, edges, &constants, rest)),
    }
}

/// Energies of joints between two edges of a strand, as [`ScalarStrainEnergy::new`] has them.
pub fn joints(
    dimension: usize,
    body: &str,
    joints: &[[u32; 3]],
    constants: &[StencilConstants],
    rest: &[f64],
) -> Box<dyn EnergyTerm> {
    match dimension {
        2 => Box::new(ScalarStrainEnergy::<Curvature, 2, 3>::new(body, joints, constants, rest)),
        _ => Box::new(ScalarStrainEnergy::<Curvature, 3, 3>::new(body, joints, constants, rest)),
    }
}

/// Energies of hinges between two triangles in space, as [`ScalarStrainEnergy::new`] has them.
pub fn hinges(
    body: &str,
    hinges: &[[u32; 4]],
    constants: &[StencilConstants],
    rest: &[f64],
) -> Box<dyn EnergyTerm> {
    Box::new(ScalarStrainEnergy::<HingeAngle, 3, 4>::new(body, hinges, constants, rest))
}

/// Dashpots along edges whose dissipation is a formula, as [`MeasuredRate::with_law`] has them.
///
/// # Panics
/// As there.
pub fn expressed_dashpots(
    dimension: usize,
    body: &str,
    formula: DashpotFormula,
    edges: &[[u32; 2]],
    rest_length: &[f64],
    rest: &[f64],
) -> Box<dyn DissipativeTerm> {
    type Rate<const D: usize> = MeasuredRate<Length, D, 2, DashpotFormula>;
    let constants = of_lengths(rest_length);
    match dimension {
        2 => Box::new(Rate::<2>::with_law(body, formula, edges, &constants, rest)),
        _ => Box::new(Rate::<3>::with_law(body, formula, edges, &constants, rest)),
    }
}

/// Dashpots along edges, as [`MeasuredRate::new`] has them.
pub fn dashpots(
    dimension: usize,
    body: &str,
    edges: &[[u32; 2]],
    constants: &[StencilConstants],
    rest: &[f64],
) -> Box<dyn DissipativeTerm> {
    match dimension {
        2 => Box::new(MeasuredRate::<Length, 2, 2>::new(body, edges, constants, rest)),
        _ => Box::new(MeasuredRate::<Length, 3, 2>::new(body, edges, constants, rest)),
    }
}

/// Damping of joints between two edges of a strand, as [`MeasuredRate::new`] has it.
pub fn joint_dashpots(
    dimension: usize,
    body: &str,
    joints: &[[u32; 3]],
    constants: &[StencilConstants],
    rest: &[f64],
) -> Box<dyn DissipativeTerm> {
    match dimension {
        2 => Box::new(MeasuredRate::<Curvature, 2, 3>::new(body, joints, constants, rest)),
        _ => Box::new(MeasuredRate::<Curvature, 3, 3>::new(body, joints, constants, rest)),
    }
}

/// Damping of hinges between two triangles in space, as [`MeasuredRate::new`] has it.
pub fn hinge_dashpots(
    body: &str,
    hinges: &[[u32; 4]],
    constants: &[StencilConstants],
    rest: &[f64],
) -> Box<dyn DissipativeTerm> {
    Box::new(MeasuredRate::<HingeAngle, 3, 4>::new(body, hinges, constants, rest))
}
