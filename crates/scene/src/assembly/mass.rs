//! Lumped mass of a body.

use super::body::{distance, spread};
use crate::KeyPath;
use crate::MassSpec;
use crate::Problem;
use pliant::quantity::{Kind, Quantity};
use pliant_mesh::Mesh;

/// Lumped mass of every vertex.
pub(super) fn masses(
    spec: &MassSpec,
    mesh: &Mesh,
    thickness: Option<f64>,
    springs: &[[u32; 2]],
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> Vec<f64> {
    let n = mesh.vertex_count();
    match spec {
        MassSpec::PerVertex(mass) => {
            spread(mass, n, ["vertex", "vertices"], path.key("per_vertex"), problems)
        }
        MassSpec::Total(total) => vec![total / n as f64; n],
        MassSpec::Density(density) => {
            filled(*density, mesh, thickness, springs, &path.key("density"), problems)
        }
        MassSpec::Preset(preset) => {
            let dimension = Some(Kind::DENSITY.dimension);
            let density = Quantity { value: preset.about().density, dimension };
            filled(density, mesh, thickness, springs, &path.key("preset"), problems)
        }
    }
}

/// Masses on which gravity acts in statics [kg]: `density integral of N_a` for second-order elements with
/// a density, because their lumped masses would not do the same work (see [`super::gravity`]); otherwise
/// the lumped masses.
pub(super) fn weights(spec: &MassSpec, mesh: &Mesh, mass: &[f64]) -> Vec<f64> {
    let density = match spec {
        MassSpec::Density(density) => density.value,
        MassSpec::Preset(preset) => preset.about().density,
        MassSpec::PerVertex(_) | MassSpec::Total(_) => return mass.to_vec(),
    };
    if mesh.order() == 1 {
        return mass.to_vec();
    }
    let sum = |row: &Vec<(u32, f64)>| density * row.iter().map(|(_, share)| share).sum::<f64>();
    mesh.consistent_measure().iter().map(sum).collect()
}

/// Lumped mass of each vertex of a body with this density, specified at `path`.
fn filled(
    density: Quantity,
    mesh: &Mesh,
    thickness: Option<f64>,
    springs: &[[u32; 2]],
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> Vec<f64> {
    let n = mesh.vertex_count();
    let mut mass = mesh.lumped_measure();
    if mesh.element_dimension() < 2 {
        // Mass per length of the springs.
        mass = vec![0.0; n];
        for &[a, b] in springs {
            let half = 0.5 * distance(mesh.point(a as usize), mesh.point(b as usize));
            mass[a as usize] += half;
            mass[b as usize] += half;
        }
    }
    // A membrane may have a mass per area, which its unit tells.
    let by_area = density.dimension == Some(Kind::AREA_DENSITY.dimension);
    let thick = thickness.filter(|_| !by_area).unwrap_or(1.0);
    mass.iter_mut().for_each(|m| *m *= thick * density.value);
    problems.extend(wrong_density(density, mesh, thickness.is_some(), path));
    if let Some(vertex) = mass.iter().position(|m| *m == 0.0) {
        let message =
            format!("vertex {vertex} belongs to no element and no spring: a density gives it no mass");
        let help = "give `per_vertex` or `total` instead";
        problems.push(Problem::semantic(path.clone(), message).with_help(help));
    }
    mass
}

/// Rejects a density by length, area or volume that does not fit the cells of the mesh. In two dimensions
/// the thickness is one metre, and a mass per volume is equivalent to one per area.
fn wrong_density(density: Quantity, mesh: &Mesh, membrane: bool, path: &KeyPath) -> Option<Problem> {
    let of_block = mesh.block().map(|block| block.kind.plural);
    let (what, kinds): (&str, &[Kind]) = match (mesh.element_dimension(), mesh.dimension) {
        (3, _) => (of_block.unwrap_or("tetrahedra"), &[Kind::DENSITY]),
        (2, 3) if membrane => ("a membrane", &[Kind::DENSITY, Kind::AREA_DENSITY]),
        (2, 2) => (of_block.unwrap_or("triangles in 2D"), &[Kind::AREA_DENSITY, Kind::DENSITY]),
        (2, _) => ("triangles in 3D", &[Kind::AREA_DENSITY]),
        _ => ("springs", &[Kind::LINEAR_DENSITY]),
    };
    let said = density.dimension?;
    if kinds.iter().any(|kind| kind.dimension == said) {
        return None;
    }
    let right: Vec<String> = kinds.iter().map(Kind::described).collect();
    let message =
        format!("`density` is in [{said}], but this body is made of {what}: it takes {}", right.join(" or "));
    Some(Problem::semantic(path.clone(), message).with_help(format!("for example \"{}\"", kinds[0].example)))
}
