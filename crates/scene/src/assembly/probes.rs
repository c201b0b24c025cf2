//! Assembly of probes: positions become weighted sums of vertices.

use super::body::BodyAssembly;
use crate::KeyPath;
use crate::ProbeSpec;
use crate::Problem;
use crate::Scene;
use pliant::algebra::Mat;
use pliant::element::{
    Barycentric, CellBlock, CellVisitor, Isoparametric, jacobian, order, shape_functions, simplex_rest,
};
use pliant::energy::elastic::{flattened, points_of};
use pliant::probe::Probe;
use pliant::quantity::Rounded;
use pliant_mesh::Mesh;

/// Tolerance for points outside of a cell, as a fraction of its height.
const TOLERANCE: f64 = 1e-9;
/// Maximum number of Newton steps to locate a point in a curved cell; a few suffice if it is inside.
const MOST_STEPS: usize = 50;

/// A point of an element: the element's number in the scene, and its coordinates there.
type Point = (usize, Barycentric);

/// Builds the probes of a scene, and the points of elements that they name.
pub(super) fn probes<const D: usize, const N: usize>(
    scene: &Scene,
    bodies: &[BodyAssembly],
) -> Result<(Vec<Probe>, Vec<Point>), Vec<Problem>> {
    let path = KeyPath::root().key("probe");
    let specs = scene
        .probe
        .iter()
        .enumerate()
        .flat_map(|(i, spec)| spec.each().into_iter().map(move |spec| (i, spec)));
    let found = specs.map(|(i, spec)| one::<D, N>(&spec, &path.index(i), bodies));
    let (mut probes, mut points, mut problems) = (vec![], vec![], vec![]);
    for probe in found {
        match probe {
            Ok((mut probe, point)) => {
                probe.point = point.map(|_| points.len());
                points.extend(point);
                probes.push(probe);
            }
            Err(problem) => problems.push(*problem),
        }
    }
    if problems.is_empty() { Ok((probes, points)) } else { Err(problems) }
}

fn one<const D: usize, const N: usize>(
    spec: &ProbeSpec,
    path: &KeyPath,
    bodies: &[BodyAssembly],
) -> Result<(Probe, Option<Point>), Box<Problem>> {
    let eligible = || bodies.iter().filter(|b| spec.body.as_ref().is_none_or(|name| *name == b.name));
    // A position in a cell, or a vertex.
    let place = match (&spec.at, spec.vertex) {
        (Some(at), _) => {
            let inside = eligible().find_map(|body| {
                let found = match body.thickness {
                    Some(thickness) => in_sheet(&body.mesh, thickness, at),
                    None => containing::<D, N>(&body.mesh, at),
                };
                Some((body, found?))
            });
            let Some((body, CellLocation { cell, at, vertices, weights })) = inside else {
                return Err(Box::new(outside(spec, at, path, eligible())));
            };
            // Elements of earlier bodies come first.
            let earlier = bodies.iter().take_while(|b| b.first_vertex < body.first_vertex);
            let before: usize = earlier.map(BodyAssembly::element_count).sum();
            (body, vertices, weights, body.elastic.then_some((before + cell, at)))
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
    let (body, vertices, weights, point) = place;
    if spec.nodal_stress && !body.elastic {
        let message = format!("`nodal_stress` is about finite elements, and `{}` has none", body.name);
        let problem = Problem::semantic(path.key("nodal_stress"), message);
        return Err(Box::new(problem.with_help("leave it out, or give the body `elastic`")));
    }
    // Reference position.
    let mut rest = [0.0; 3];
    for (&vertex, weight) in vertices.iter().zip(&weights) {
        let point = body.mesh.point(vertex as usize);
        rest.iter_mut().zip(point).for_each(|(sum, x)| *sum += weight * x);
    }
    let vertices = vertices.iter().map(|vertex| body.first_vertex + vertex).collect();
    let (name, body, reads_nodal_stress) = (spec.name.clone(), body.name.clone(), spec.nodal_stress);
    let probe = Probe { name, body, vertices, weights, rest, point: None, reads_nodal_stress };
    Ok((probe, point))
}

/// Position of a point in a cell.
struct CellLocation {
    cell: usize,
    at: Barycentric,
    /// Nodes of the cell, and the values of their shape functions at the point.
    vertices: Vec<u32>,
    weights: Vec<f64>,
}

/// Cell in which a reference position lies deepest; `None` outside of all cells. `N` is the number of
/// corners of a cell.
fn containing<const D: usize, const N: usize>(mesh: &Mesh, at: &[f64]) -> Option<CellLocation> {
    if let Some(block) = mesh.block() {
        return block.kind.visit(DeepestCell { mesh, block, at });
    }
    match (D, mesh.order()) {
        (_, 1) => deepest::<D, N>(mesh, at),
        (2, _) => deepest::<2, 6>(mesh, at),
        _ => deepest::<3, 10>(mesh, at),
    }
}

/// Deepest simplex of `N` nodes.
fn deepest<const D: usize, const N: usize>(mesh: &Mesh, at: &[f64]) -> Option<CellLocation> {
    let mut best: Option<(f64, usize, [u32; N], Barycentric)> = None;
    for (number, cell) in mesh.elements::<N>().into_iter().enumerate() {
        let Some(lambda) = coordinates::<D, N>(mesh, &cell, at) else { continue };
        let depth = lambda[..=D].iter().copied().fold(f64::INFINITY, f64::min);
        if depth >= -TOLERANCE && best.as_ref().is_none_or(|(deepest, ..)| depth > *deepest) {
            best = Some((depth, number, cell, lambda));
        }
    }
    best.map(|(_, cell, nodes, at)| {
        let weights = shape_functions::<D, N>(&at).to_vec();
        CellLocation { cell, at, vertices: nodes.to_vec(), weights }
    })
}

/// Deepest cell of a kind other than simplices; `at` of the result are the coordinates in the reference
/// cell.
struct DeepestCell<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
    at: &'a [f64],
}

impl CellVisitor for DeepestCell<'_> {
    type Output = Option<CellLocation>;

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) -> Self::Output {
        let mut best: Option<(f64, usize, [f64; D])> = None;
        for (number, cell) in self.block.of::<N>().iter().enumerate() {
            let Some(xi) = kind.locate(&self.mesh.nodes::<D, N>(cell), self.at) else { continue };
            // Depth: distance to the nearest side, in half widths of the cell.
            let depth = xi.iter().map(|x| 1.0 - x.abs()).fold(f64::INFINITY, f64::min);
            if depth >= -TOLERANCE && best.as_ref().is_none_or(|(deepest, ..)| depth > *deepest) {
                best = Some((depth, number, xi));
            }
        }
        best.map(|(_, cell, xi)| {
            let mut at = [0.0; 4];
            at[..D].copy_from_slice(&xi);
            let vertices = self.block.of::<N>()[cell].to_vec();
            CellLocation { cell, at, vertices, weights: (kind.shape)(&xi).to_vec() }
        })
    }
}

/// Triangle of a sheet in which a position lies deepest, among those within half the thickness.
fn in_sheet(mesh: &Mesh, thickness: f64, at: &[f64]) -> Option<CellLocation> {
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
    best.map(|(_, cell, vertices, weights)| {
        let at = [weights[0], weights[1], weights[2], 0.0];
        CellLocation { cell, at, vertices: vertices.to_vec(), weights: weights.to_vec() }
    })
}

/// Barycentric coordinates of a position: `X = sum_a N_a(lambda) X_a`; `None` if the position is far from
/// the cell, or has no coordinates.
fn coordinates<const D: usize, const N: usize>(
    mesh: &Mesh,
    cell: &[u32; N],
    at: &[f64],
) -> Option<Barycentric> {
    let mut points = [[0.0; D]; N];
    for (point, &vertex) in points.iter_mut().zip(cell) {
        point.copy_from_slice(mesh.point(vertex as usize));
    }
    if order::<D, N>() == 1 {
        let (inverse, _): (Mat<f64, D>, f64) = simplex_rest(&points);
        let mut from_first = [0.0; D];
        (0..D).for_each(|c| from_first[c] = at[c] - points[0][c]);
        return Some(barycentric(&inverse.mul_vec(&from_first)));
    }
    // A shape function is at most 1 in magnitude, and the sum of magnitudes at most 2: no point of the
    // cell is farther out.
    let size = |c: usize| points.iter().map(|p| (p[c] - points[0][c]).abs()).fold(0.0, f64::max);
    if (0..D).any(|c| (at[c] - points[0][c]).abs() > 2.0 * size(c)) {
        return None;
    }
    // Newton's method from the centroid.
    let mut local = [1.0 / (D + 1) as f64; D];
    for _ in 0..MOST_STEPS {
        let lambda = barycentric(&local);
        let shape = shape_functions::<D, N>(&lambda);
        let mut off = [0.0; D];
        for c in 0..D {
            let found: f64 = shape.iter().zip(&points).map(|(n, x)| n * (x[c] - points[0][c])).sum();
            off[c] = at[c] - points[0][c] - found;
        }
        let change = jacobian(&points, &lambda).inverse().mul_vec(&off);
        (0..D).for_each(|c| local[c] += change[c]);
        // The remaining error is of the order of the square of this change.
        if change.iter().all(|c| c.abs() <= 1e-10) {
            return Some(barycentric(&local));
        }
        if local.iter().any(|c| !c.is_finite() || c.abs() > 1e3) {
            return None;
        }
    }
    None
}

/// Barycentric coordinates from the independent ones.
fn barycentric<const D: usize>(local: &[f64; D]) -> Barycentric {
    let mut lambda = [0.0; 4];
    lambda[0] = 1.0 - local.iter().sum::<f64>();
    lambda[1..=D].copy_from_slice(local);
    lambda
}

/// Problem of a position outside of all cells, with the nearest vertex.
fn outside<'a>(
    spec: &ProbeSpec,
    at: &[f64],
    path: &KeyPath,
    bodies: impl Iterator<Item = &'a BodyAssembly>,
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
            "the nearest vertex is {distance} m away: `body = \"{body}\"`, `vertex = {vertex}`, at {point:?}",
            distance = Rounded::<4>(distance)
        )),
        None => problem,
    }
}
