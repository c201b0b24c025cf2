//! Assembly of attachments: ties between vertices.

use super::body::{BodyAssembly, distance};
use super::places::TiedPoints;
use crate::AttachmentSpec;
use crate::AttachmentTarget;
use crate::KeyPath;
use crate::Problem;
use crate::Scene;
use crate::Selection;
use pliant::energy::attachment::{Attachment, AttachmentDashpots, Tie};
use pliant::numbering::Numbering;
use pliant::quantity::{Rounded, counted};
use pliant::system::System;
use pliant_mesh::{Mesh, select};

/// Rounding tolerance, as a fraction of the size of a body.
const TOLERANCE: f64 = 1e-9;
/// Rounding error of a sum of a few coordinates, relative to them.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// An attachment with resolved ends.
pub(super) struct AttachmentPlan {
    name: String,
    ties: Vec<Tie>,
    /// Spring constant of each tie [N/m].
    stiffness: f64,
    rest_length: f64,
    dashpot: f64,
    /// Description of the target, in words.
    to: String,
}

/// Resolves the attachments of a scene; vertices are numbered by `numbering`, `start` holds their initial
/// positions, flat [m].
pub(super) fn attachments(
    scene: &Scene,
    bodies: &[BodyAssembly],
    numbering: &Numbering,
    start: &[f64],
) -> Result<Vec<AttachmentPlan>, Vec<Problem>> {
    let path = KeyPath::root().key("attachment");
    let (mut found, mut problems) = (vec![], vec![]);
    for (i, spec) in scene.attachment.iter().enumerate() {
        match one(spec, &path.index(i), i, bodies, numbering, start) {
            Ok(tied) => found.push(tied),
            Err(problem) => problems.push(*problem),
        }
    }
    if problems.is_empty() { Ok(found) } else { Err(problems) }
}

fn one(
    spec: &AttachmentSpec,
    path: &KeyPath,
    index: usize,
    bodies: &[BodyAssembly],
    numbering: &Numbering,
    start: &[f64],
) -> Result<AttachmentPlan, Box<Problem>> {
    // Validation has checked that these exist.
    let named = |name: &Option<String>| {
        bodies.iter().find(|body| name.as_ref().is_none_or(|name| *name == body.name)).unwrap_or(&bodies[0])
    };
    let body = named(&spec.body);
    let fail = |path: KeyPath, message: String| Box::new(Problem::semantic(path, message));
    let vertices = chosen(spec, &body.mesh).map_err(|message| fail(path.clone(), message))?;
    let global = |body: &BodyAssembly, v: u32| numbering.internal(body.first_vertex + v);
    let d = body.mesh.dimension;
    // Ties to given positions, to the initial positions, or to another body.
    let (ties, to): (Vec<Tie>, String) = match (&spec.points, &spec.target) {
        (Some(points), _) => {
            if points.len() != vertices.len() {
                let (given, needed) = (points.len(), vertices.len());
                let message = format!(
                    "`points` lists {} for {}",
                    counted(given as u64, "point", "points"),
                    counted(needed as u64, "vertex", "vertices")
                );
                return Err(fail(path.key("points"), message));
            }
            let tie = |(v, point): (&u32, &Vec<f64>)| to_place(global(body, *v), point);
            (vertices.iter().zip(points).map(tie).collect(), "to given points".into())
        }
        (None, None) => {
            let tie = |v: &u32| to_place(global(body, *v), &body.position[*v as usize * d..][..d]);
            (vertices.iter().map(tie).collect(), "to their initial positions".into())
        }
        (None, Some(target)) => {
            let other = named(&Some(target.body.clone()));
            let ends = ends(body, &vertices, other, target)
                .map_err(|(key, message)| fail(path.key("target").key(key), message))?;
            let mut ties = vec![];
            for (&v, shares) in vertices.iter().zip(ends) {
                let shares = shares.iter().map(|&(w, weight)| (global(other, w), -weight));
                let shares = std::iter::once((global(body, v), 1.0)).chain(shares).collect();
                ties.push(Tie { shares, place: [0.0; 3] });
            }
            (ties, format!("to `{}`", other.name))
        }
    };
    // A tie with a rest length needs a direction.
    let rest_length = spec.rest_length;
    if rest_length > 0.0
        && let Some(i) = ties.iter().position(|tie| starts_at_zero(tie, rest_length, start, d))
    {
        let message = format!(
            "the tie of vertex {} of `{}` starts at length 0: one of rest length {rest_length:?} m has no \
             direction there",
            vertices[i], body.name
        );
        let problem = Problem::semantic(path.key("rest_length"), message);
        return Err(Box::new(
            problem.with_help("leave out `rest_length`, and the tie pulls its ends together"),
        ));
    }
    let each = spec.stiffness.or(spec.total_stiffness.map(|total| total / ties.len() as f64));
    Ok(AttachmentPlan {
        name: spec.name_or_default(index),
        ties,
        stiffness: each.unwrap_or_default(),
        rest_length: spec.rest_length,
        dashpot: spec.dashpot.unwrap_or(0.0),
        to: format!("of `{}` {to}", body.name),
    })
}

impl AttachmentPlan {
    pub(super) fn add_to(&self, system: &mut System) {
        let AttachmentPlan { name, ties, stiffness, rest_length, dashpot, .. } = self;
        let dimension = system.dimension();
        let springs = Attachment::new(name.clone(), dimension, ties, *stiffness, *rest_length);
        system.add_term(Box::new(springs));
        if *dashpot > 0.0 {
            let dashpots = AttachmentDashpots::new(name.clone(), dimension, ties, *dashpot);
            system.add_dissipation(Box::new(dashpots));
        }
    }

    /// Ties of the attachment, and their constants.
    pub(super) fn into_points(self) -> TiedPoints {
        let AttachmentPlan { ties, stiffness, rest_length, dashpot, .. } = self;
        TiedPoints { ties, stiffness, rest_length, dashpot }
    }

    /// Description in words.
    pub(super) fn described(&self) -> String {
        let AttachmentPlan { name, ties, stiffness, to, .. } = self;
        let vertices = counted(ties.len() as u64, "vertex", "vertices");
        format!("`{name}`: {vertices} {to}, {stiffness} N/m each")
    }
}

/// True if the ends of a tie coincide at the positions `start`, flat [m], up to rounding.
fn starts_at_zero(tie: &Tie, rest_length: f64, start: &[f64], dimension: usize) -> bool {
    let (mut square, mut scale) = (0.0, 0.0f64);
    for c in 0..dimension {
        let shares = tie.shares.iter().map(|(v, weight)| weight * start[*v as usize * dimension + c]);
        let difference = shares.fold(-tie.place[c], |sum, share| {
            scale = scale.max(share.abs());
            sum + share
        });
        square += difference * difference;
    }
    square.sqrt() <= TOLERANCE * rest_length + ROUNDING * scale
}

fn to_place(vertex: u32, point: &[f64]) -> Tie {
    let mut place = [0.0; 3];
    place[..point.len()].copy_from_slice(point);
    Tie { shares: vec![(vertex, 1.0)], place }
}

/// Selected vertices: in the order of a list, ascending for other selections.
fn chosen(spec: &AttachmentSpec, mesh: &Mesh) -> Result<Vec<u32>, String> {
    // Validation has checked that there is exactly one.
    let selection = spec.selections().pop().unwrap_or(Selection::Vertices(vec![]));
    let vertices = select(mesh, &selection).map_err(|error| error.to_string())?;
    match selection {
        Selection::Vertices(listed) if listed.len() == vertices.len() => Ok(listed),
        Selection::Vertices(_) => Err("`vertices` lists a vertex twice".to_owned()),
        _ => Ok(vertices),
    }
}

/// Vertices of a body and their weights.
type Shares = Vec<(u32, f64)>;

/// Resolves the target of each vertex of `body` in `other`; the error has the wrong key and the reason.
fn ends(
    body: &BodyAssembly,
    vertices: &[u32],
    other: &BodyAssembly,
    target: &AttachmentTarget,
) -> Result<Vec<Shares>, (&'static str, String)> {
    if let Some(listed) = &target.vertices {
        let (count, most) = (vertices.len(), other.mesh.vertex_count());
        let message = if listed.len() != count {
            format!("`vertices` of the target lists {} for {count} that are tied", listed.len())
        } else if let Some(v) = listed.iter().find(|v| **v as usize >= most) {
            format!("`{}` has no vertex {v}: it has {most}, from 0", other.name)
        } else if let Some(v) = same(body, vertices, other, listed) {
            format!("vertex {v} of `{}` is tied to itself", body.name)
        } else {
            return Ok(listed.iter().map(|&v| vec![(v, 1.0)]).collect());
        };
        return Err(("vertices", message));
    }
    let (key, within) = match (target.nearest_vertex, target.nearest_point) {
        (Some(within), _) => ("nearest_vertex", within),
        (None, within) => ("nearest_point", within.unwrap_or_default()),
    };
    let cells = match key {
        "nearest_vertex" => (0..other.mesh.vertex_count() as u32).map(|v| vec![v]).collect(),
        _ if other.mesh.order() == 2 => {
            let message = format!("`{}` is of second order; use `nearest_vertex`", other.name);
            return Err((key, message));
        }
        _ if other.mesh.block().is_some() => {
            let message = format!("`{}` has cells that are no simplices; use `nearest_vertex`", other.name);
            return Err((key, message));
        }
        _ => cells(other),
    };
    let search = CellSearch::new(&other.mesh, cells);
    let reach = within + TOLERANCE * (body.mesh.diagonal() + other.mesh.diagonal());
    let mut ends = vec![];
    for &v in vertices {
        let at = padded(body.mesh.point(v as usize));
        match search.nearest(&at, reach) {
            Some((_, shares)) => ends.push(shares),
            None => {
                let what = if key == "nearest_vertex" { "vertex" } else { "point" };
                let nearest = search.nearest(&at, f64::INFINITY);
                let distance = nearest.map_or(f64::INFINITY, |(distance, _)| distance);
                let message = format!(
                    "vertex {v} of `{}`, at {:?} at rest, is {distance} m away from the nearest {what} of \
                     `{}`, more than {within:?} m",
                    body.name,
                    body.mesh.point(v as usize),
                    other.name,
                    distance = Rounded::<7>(distance)
                );
                return Err((key, message));
            }
        }
    }
    Ok(ends)
}

/// First vertex that would be tied to itself.
fn same(body: &BodyAssembly, vertices: &[u32], other: &BodyAssembly, listed: &[u32]) -> Option<u32> {
    let pairs = vertices.iter().zip(listed);
    pairs.filter(|(v, w)| body.first_vertex == other.first_vertex && v == w).map(|(v, _)| *v).next()
}

/// Parts of a body: its highest-dimensional cells, springs, or single vertices.
fn cells(body: &BodyAssembly) -> Vec<Vec<u32>> {
    let mesh = &body.mesh;
    match mesh.element_dimension() {
        3 => mesh.tetrahedra.iter().map(|cell| cell.to_vec()).collect(),
        2 => mesh.triangles.iter().map(|cell| cell.to_vec()).collect(),
        _ if !body.springs.is_empty() => body.springs.iter().map(|cell| cell.to_vec()).collect(),
        _ => (0..mesh.vertex_count() as u32).map(|v| vec![v]).collect(),
    }
}

fn padded(point: &[f64]) -> [f64; 3] {
    let mut padded = [0.0; 3];
    padded[..point.len()].copy_from_slice(point);
    padded
}

/// Nearest-cell search: cells sorted along the first axis, so that distant ones are skipped.
struct CellSearch<'a> {
    mesh: &'a Mesh,
    cells: Vec<Vec<u32>>,
    /// Smallest and largest first coordinate and index of each cell, by ascending smallest.
    extents: Vec<(f64, f64, usize)>,
    /// Length of the longest of these intervals.
    longest: f64,
}

impl<'a> CellSearch<'a> {
    fn new(mesh: &'a Mesh, cells: Vec<Vec<u32>>) -> Self {
        let first = |v: &u32| mesh.point(*v as usize)[0];
        let extent = |(i, cell): (usize, &Vec<u32>)| {
            let least = cell.iter().map(first).fold(f64::INFINITY, f64::min);
            (least, cell.iter().map(first).fold(f64::NEG_INFINITY, f64::max), i)
        };
        let mut extents: Vec<(f64, f64, usize)> = cells.iter().enumerate().map(extent).collect();
        extents.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        let longest = extents.iter().fold(0.0, |longest: f64, e| longest.max(e.1 - e.0));
        CellSearch { mesh, cells, extents, longest }
    }

    /// Point of a cell nearest to `at`, within `reach`: its distance, and its vertices with weights. Of
    /// equally near points, the one in the first cell.
    fn nearest(&self, at: &[f64; 3], reach: f64) -> Option<(f64, Shares)> {
        let from = self.extents.partition_point(|e| e.0 < at[0] - reach - self.longest);
        let mut best: Option<(f64, usize, [f64; 4])> = None;
        for &(low, high, number) in &self.extents[from..] {
            let limit = best.as_ref().map_or(reach, |best| best.0);
            if low > at[0] + limit {
                break;
            }
            if high < at[0] - limit {
                continue;
            }
            let mut corners = [[0.0; 3]; 4];
            let cell = &self.cells[number];
            for (corner, v) in corners.iter_mut().zip(cell) {
                *corner = padded(self.mesh.point(*v as usize));
            }
            let (distance, weights) = closest(&corners[..cell.len()], at);
            let better = best.as_ref().is_none_or(|b| (distance, number) < (b.0, b.1));
            if distance <= reach && better {
                best = Some((distance, number, weights));
            }
        }
        let (distance, number, weights) = best?;
        let shares = self.cells[number].iter().copied().zip(weights).filter(|(_, weight)| *weight != 0.0);
        Some((distance, shares.collect()))
    }
}

/// Point of a simplex of 1 to 4 vertices nearest to `at`: its distance and barycentric coordinates. If
/// the foot of the perpendicular is outside, the nearest point is on a face opposite to a vertex with a
/// negative coordinate.
fn closest(corners: &[[f64; 3]], at: &[f64; 3]) -> (f64, [f64; 4]) {
    let n = corners.len();
    if let Some(weights) = foot(corners, at)
        && weights[..n].iter().all(|weight| *weight >= 0.0)
    {
        let mut point = [0.0; 3];
        for (corner, weight) in corners.iter().zip(&weights) {
            (0..3).for_each(|c| point[c] += weight * corner[c]);
        }
        // A tetrahedron contains the point.
        return (if n == 4 { 0.0 } else { distance(&point, at) }, weights);
    }
    let outside = foot(corners, at);
    let mut best = (f64::INFINITY, [0.0; 4]);
    for left_out in 0..n {
        if outside.is_some_and(|weights| weights[left_out] >= 0.0) {
            continue;
        }
        let mut face = [[0.0; 3]; 4];
        let kept = (0..n).filter(|i| *i != left_out);
        kept.clone().enumerate().for_each(|(place, i)| face[place] = corners[i]);
        let (distance, of_face) = closest(&face[..n - 1], at);
        if distance < best.0 {
            best.0 = distance;
            best.1 = [0.0; 4];
            kept.enumerate().for_each(|(place, i)| best.1[i] = of_face[place]);
        }
    }
    best
}

/// Barycentric coordinates of the foot of the perpendicular in the plane of a simplex; `None` for a
/// degenerate simplex.
fn foot(corners: &[[f64; 3]], at: &[f64; 3]) -> Option<[f64; 4]> {
    let n = corners.len() - 1;
    let from = |p: &[f64; 3]| [0, 1, 2].map(|c| p[c] - corners[0][c]);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // Normal equations, eliminated in place; the last column is the right-hand side.
    let mut m = [[0.0; 4]; 3];
    for i in 0..n {
        for j in 0..n {
            m[i][j] = dot(from(&corners[i + 1]), from(&corners[j + 1]));
        }
        m[i][3] = dot(from(&corners[i + 1]), from(at));
    }
    for k in 0..n {
        let scale = dot(from(&corners[k + 1]), from(&corners[k + 1]));
        if m[k][k] <= 1e-24 * scale || scale == 0.0 {
            return None;
        }
        for i in 0..n {
            if i != k {
                let factor = m[i][k] / m[k][k];
                (0..4).for_each(|j| m[i][j] -= factor * m[k][j]);
            }
        }
    }
    let mut weights = [0.0; 4];
    weights[0] = 1.0;
    for k in 0..n {
        weights[k + 1] = m[k][3] / m[k][k];
        weights[0] -= weights[k + 1];
    }
    Some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_simplex_is_nearer_than_all_others() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, -0.1], [0.2, 0.3, 0.8]];
        let number = |i: usize| ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract();
        for count in 1..=4 {
            for trial in 0..50 {
                let at = [0, 1, 2].map(|c| 3.0 * number(3 * trial + c) - 1.0);
                let (found, weights) = closest(&corners[..count], &at);
                let point = |weights: &[f64]| {
                    let sum = |c: usize| (0..count).map(|i| weights[i] * corners[i][c]).sum::<f64>();
                    [0, 1, 2].map(sum)
                };
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
                assert!(weights.iter().all(|w| *w >= 0.0));
                assert!((distance(&point(&weights), &at) - found).abs() < 1e-13, "{count} {trial}");
                for other in 0..200 {
                    let raw = [0, 1, 2, 3].map(|i| number(7 * other + 11 * i + 5));
                    let sum: f64 = raw[..count].iter().sum();
                    let there = point(&raw.map(|w| w / sum));
                    assert!(distance(&there, &at) >= found - 1e-13, "{count} {trial}");
                }
            }
        }
    }
}
