//! Where probes are: places become mixtures of vertices.

use super::body::Parts;
use crate::algebra::Mat;
use crate::element::simplex_rest;
use crate::energy::elastic::{flattened, points_of};
use crate::mesh::Mesh;
use crate::probe::Probe;
use crate::scene::{KeyPath, ProbeSpec, Problem, Scene};

/// A point outside of a cell by this fraction of its height is in it.
const TOLERANCE: f64 = 1e-9;

/// The probes of a scene.
pub(super) fn probes<const D: usize, const N: usize>(
    scene: &Scene,
    bodies: &[Parts],
) -> Result<Vec<Probe>, Vec<Problem>> {
    let path = KeyPath::root().key("probe");
    let found = scene.probe.iter().enumerate().map(|(i, spec)| one::<D, N>(spec, &path.index(i), bodies));
    let (mut probes, mut problems) = (vec![], vec![]);
    for probe in found {
        match probe {
            Ok(probe) => probes.push(probe),
            Err(problem) => problems.push(*problem),
        }
    }
    if problems.is_empty() { Ok(probes) } else { Err(problems) }
}

fn one<const D: usize, const N: usize>(
    spec: &ProbeSpec,
    path: &KeyPath,
    bodies: &[Parts],
) -> Result<Probe, Box<Problem>> {
    let eligible = || bodies.iter().filter(|b| spec.body.as_ref().is_none_or(|name| *name == b.name));
    let place = match (&spec.at, spec.vertex) {
        (Some(at), _) => {
            let inside = eligible().find_map(|body| {
                let found = match body.thickness {
                    Some(thickness) => in_sheet(&body.mesh, thickness, at),
                    None => containing::<D, N>(&body.mesh, at),
                };
                Some((body, found?))
            });
            let Some((body, (cell, vertices, weights))) = inside else {
                return Err(Box::new(outside(spec, at, path, eligible())));
            };
            // Elements of the bodies before this one come first.
            let earlier = bodies.iter().take_while(|b| b.first_vertex < body.first_vertex);
            let before: usize = earlier.map(Parts::element_count).sum();
            (body, vertices, weights, body.elastic.then_some(before + cell))
        }
        (None, vertex) => {
            let vertex = vertex.unwrap_or_default();
            let mut bodies = eligible();
            let Some(body) = bodies.next().filter(|body| (vertex as usize) < body.mesh.vertex_count()) else {
                let most = eligible().next().map_or(0, |body| body.mesh.vertex_count());
                let message = format!("`vertex` is {vertex}, but the body has {most} vertices");
                let problem = Problem::semantic(path.key("vertex"), message);
                let help = format!("0 to {} can be named", most.saturating_sub(1));
                return Err(Box::new(problem.with_help(help)));
            };
            (body, vec![vertex], vec![1.0], None)
        }
    };
    let (body, vertices, weights, element) = place;
    let mut rest = [0.0; 3];
    for (&vertex, weight) in vertices.iter().zip(&weights) {
        let point = body.mesh.point(vertex as usize);
        rest.iter_mut().zip(point).for_each(|(sum, x)| *sum += weight * x);
    }
    let vertices = vertices.iter().map(|vertex| body.first_vertex + vertex).collect();
    Ok(Probe { name: spec.name.clone(), body: body.name.clone(), vertices, weights, rest, element })
}

/// The cells of full dimension.
fn cells<const N: usize>(mesh: &Mesh) -> impl Iterator<Item = [u32; N]> {
    let flat =
        if mesh.dimension == 2 { mesh.triangles.as_flattened() } else { mesh.tetrahedra.as_flattened() };
    flat.as_chunks::<N>().0.iter().copied()
}

/// The cell in which a place at rest is deepest, its vertices and their weights; `None` outside of all.
fn containing<const D: usize, const N: usize>(
    mesh: &Mesh,
    at: &[f64],
) -> Option<(usize, Vec<u32>, Vec<f64>)> {
    let mut best: Option<(f64, usize, [u32; N], [f64; N])> = None;
    for (number, cell) in cells::<N>(mesh).enumerate() {
        let weights = weights::<D, N>(mesh, &cell, at);
        let depth = weights.iter().copied().fold(f64::INFINITY, f64::min);
        if depth >= -TOLERANCE && best.as_ref().is_none_or(|(deepest, ..)| depth > *deepest) {
            best = Some((depth, number, cell, weights));
        }
    }
    best.map(|(_, number, cell, weights)| (number, cell.to_vec(), weights.to_vec()))
}

/// The triangle of a sheet in which a place is deepest, of those that are as near as half the thickness.
fn in_sheet(mesh: &Mesh, thickness: f64, at: &[f64]) -> Option<(usize, Vec<u32>, Vec<f64>)> {
    let mut best: Option<(f64, usize, [u32; 3], [f64; 3])> = None;
    let reach = 0.5 * thickness + TOLERANCE * mesh.diagonal();
    for (number, cell) in mesh.triangles.iter().enumerate() {
        let corners: [[f64; 3]; 3] = points_of(&mesh.points, cell);
        let (shape, axes) = flattened(&corners);
        let from_first = [0, 1, 2].map(|c| at[c] - corners[0][c]);
        let along = [0, 1].map(|a| (0..3).map(|c| axes[c][a] * from_first[c]).sum::<f64>());
        let above: f64 = (0..3)
            .map(|c| from_first[c] - axes[c][0] * along[0] - axes[c][1] * along[1])
            .map(|d| d * d)
            .sum();
        let local = simplex_rest(&shape).0.mul_vec(&along);
        let weights = [1.0 - local[0] - local[1], local[0], local[1]];
        let depth = weights.iter().copied().fold(f64::INFINITY, f64::min);
        let inside = depth >= -TOLERANCE && above.sqrt() <= reach;
        if inside && best.as_ref().is_none_or(|(deepest, ..)| depth > *deepest) {
            best = Some((depth, number, *cell, weights));
        }
    }
    best.map(|(_, number, cell, weights)| (number, cell.to_vec(), weights.to_vec()))
}

/// Barycentric coordinates: `X = sum_a w_a X_a`, `sum_a w_a = 1`.
fn weights<const D: usize, const N: usize>(mesh: &Mesh, cell: &[u32; N], at: &[f64]) -> [f64; N] {
    let mut points = [[0.0; D]; N];
    for (point, &vertex) in points.iter_mut().zip(cell) {
        point.copy_from_slice(mesh.point(vertex as usize));
    }
    let (inverse, _): (Mat<f64, D>, f64) = simplex_rest(&points);
    let mut from_first = [0.0; D];
    for c in 0..D {
        from_first[c] = at[c] - points[0][c];
    }
    let local = inverse.mul_vec(&from_first);
    let mut weights = [0.0; N];
    weights[0] = 1.0 - local.iter().sum::<f64>();
    weights[1..].copy_from_slice(&local);
    weights
}

/// The place is in no cell: where the nearest vertex is.
fn outside<'a>(
    spec: &ProbeSpec,
    at: &[f64],
    path: &KeyPath,
    bodies: impl Iterator<Item = &'a Parts>,
) -> Problem {
    let mut nearest: Option<(f64, &str, usize, &[f64])> = None;
    for body in bodies {
        for vertex in 0..body.mesh.vertex_count() {
            let point = body.mesh.point(vertex);
            let distance = point.iter().zip(at).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            if nearest.is_none_or(|(least, ..)| distance < least) {
                nearest = Some((distance, &body.name, vertex, point));
            }
        }
    }
    let what = if at.len() == 2 { "triangle" } else { "tetrahedron and no membrane" };
    let where_to = spec.body.as_ref().map_or_else(|| "any body".to_owned(), |body| format!("`{body}`"));
    let message = format!("{at:?} [m] is in no {what} of {where_to} at rest");
    let problem = Problem::semantic(path.key("at"), message);
    match nearest {
        Some((distance, body, vertex, point)) => problem.with_help(format!(
            "the nearest vertex is {distance:.3e} m away: `body = \"{body}\"`, `vertex = {vertex}`, at {point:?}"
        )),
        None => problem,
    }
}
