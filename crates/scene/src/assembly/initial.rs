//! Initial positions and velocities of a body.

use crate::AffinePosition;
use crate::KeyPath;
use crate::OneOrMany;
use crate::PositionSpec;
use crate::Problem;
use crate::VelocitySpec;
use pliant::lanes::hypot;
use pliant::quantity::counted;
use pliant_mesh::Mesh;

/// Initial positions, flat.
pub(super) fn positions(
    spec: Option<&PositionSpec>,
    mesh: &Mesh,
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> Vec<f64> {
    match spec {
        None => mesh.points.clone(),
        Some(PositionSpec::PerVertex(rows)) => {
            flat(rows, mesh, path.key("per_vertex"), "positions", problems)
        }
        Some(PositionSpec::Displacement(rows)) => {
            let displacement = flat(rows, mesh, path.key("displacement"), "displacements", problems);
            mesh.points.iter().zip(displacement).map(|(x, u)| x + u).collect()
        }
        Some(PositionSpec::Affine(affine)) => {
            (0..mesh.vertex_count()).flat_map(|i| affine_image(affine, mesh.point(i))).collect()
        }
    }
}

/// `centre + matrix (x - centre) + translation`.
fn affine_image(affine: &AffinePosition, x: &[f64]) -> Vec<f64> {
    let component = |v: &Option<Vec<f64>>, c: usize| v.as_ref().map_or(0.0, |v| v[c]);
    let offset: Vec<f64> = (0..x.len()).map(|c| x[c] - component(&affine.centre, c)).collect();
    let image = |c: usize| match &affine.matrix {
        Some(matrix) => matrix[c].iter().zip(&offset).map(|(m, o)| m * o).sum::<f64>(),
        None => offset[c],
    };
    (0..x.len())
        .map(|c| component(&affine.centre, c) + image(c) + component(&affine.translation, c))
        .collect()
}

/// Flattens a list of one vector per vertex; zeros if the list does not fit.
fn flat(rows: &[Vec<f64>], mesh: &Mesh, path: KeyPath, what: &str, problems: &mut Vec<Problem>) -> Vec<f64> {
    let n = mesh.vertex_count();
    if rows.len() == n {
        return rows.iter().flatten().copied().collect();
    }
    let message = format!(
        "the list has {} {what}, the body has {}",
        rows.len(),
        counted(n as u64, "vertex", "vertices")
    );
    problems.push(Problem::semantic(path, message));
    vec![0.0; n * mesh.dimension]
}

/// Initial velocities, flat.
pub(super) fn velocities(
    spec: Option<&VelocitySpec>,
    mesh: &Mesh,
    mass: &[f64],
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> Vec<f64> {
    let (d, n) = (mesh.dimension, mesh.vertex_count());
    match spec {
        None => vec![0.0; n * d],
        Some(VelocitySpec::PerVertex(rows)) => {
            flat(rows, mesh, path.key("per_vertex"), "velocities", problems)
        }
        Some(VelocitySpec::Rigid(rigid)) => {
            let centre = centre_of_mass(mesh, mass);
            let linear = rigid.linear.clone().unwrap_or_else(|| vec![0.0; d]);
            let spin = match rigid.angular.as_ref().map(OneOrMany::as_slice) {
                Some(&[z]) => [0.0, 0.0, z],
                Some(&[x, y, z]) => [x, y, z],
                _ => [0.0; 3],
            };
            (0..n).flat_map(|i| rigid_velocity(mesh.point(i), &centre, &linear, spin)).collect()
        }
        Some(VelocitySpec::Tangential(tangential)) => {
            let centre = tangential.centre.clone().unwrap_or_else(|| vec![0.0; d]);
            let mut v = vec![0.0; n * d];
            for i in 0..n {
                let (x, y) = (mesh.point(i)[0] - centre[0], mesh.point(i)[1] - centre[1]);
                let r = hypot(x, y);
                if r > 0.0 {
                    v[i * d] = -tangential.speed * y / r;
                    v[i * d + 1] = tangential.speed * x / r;
                }
            }
            v
        }
    }
}

fn centre_of_mass(mesh: &Mesh, mass: &[f64]) -> Vec<f64> {
    let total: f64 = mass.iter().sum();
    (0..mesh.dimension)
        .map(|c| mass.iter().enumerate().map(|(i, m)| m * mesh.point(i)[c]).sum::<f64>() / total)
        .collect()
}

/// Velocity of a rigid motion, `linear + spin x (x - centre)`, with as many components as `x`.
fn rigid_velocity(x: &[f64], centre: &[f64], linear: &[f64], spin: [f64; 3]) -> Vec<f64> {
    let mut r = [0.0; 3];
    for c in 0..x.len() {
        r[c] = x[c] - centre[c];
    }
    let turn = |c: usize| spin[(c + 1) % 3] * r[(c + 2) % 3] - spin[(c + 2) % 3] * r[(c + 1) % 3];
    (0..x.len()).map(|c| linear[c] + turn(c)).collect()
}
