//! Warnings of locking: nearly incompressible linear elements, too few elements through a bending
//! thickness, and few cells with non-parallelogram shape in bending.

use std::collections::HashMap;

use super::body::BodyAssembly;
use crate::Body;
use crate::Scene;
use pliant::algebra::cross;
use pliant::element::{CellBlock, CellVisitor, Isoparametric, TETRAHEDRON_EDGES};
use pliant::energy::elastic::bending_excess;
use pliant::material::{Lame, MaterialSpec, Plane};
use pliant::quantity::Rounded;
use pliant_mesh::{Chord, Mesh};

/// Poisson's ratio from which on linear elements are reported to lock. In plane strain the deflection of
/// a cantilever, ten times longer than thick, of two square cells is 0.52 of theory at 0.3, 0.31 at 0.45,
/// 0.11 at 0.49 and 0.02 at 0.4999; of four cells 0.81, 0.62, 0.29, 0.02.
const NEARLY_INCOMPRESSIBLE: f64 = 0.45;
/// Rounding error of a ratio computed from moduli and of sums over a chord.
const ROUNDING: f64 = 1e-9;
/// Number of cells through the thickness below which bending is noticeably too stiff: by
/// `STIFFENING / n^2`, a quarter for four.
const FEW: f64 = 4.0;
/// Linear elements in cells as long as thick, `n` through the thickness, are about `1 + STIFFENING / n^2`
/// times too stiff in bending, in 2D and in 3D. Measured against Timoshenko's beam at `nu = 0.3`: 3.6 to
/// 4.4 for 1 to 6 cells; 6.3 to 7.7 for cells twice as long.
const STIFFENING: f64 = 4.0;
/// Ratio of length to thickness from which a body bends rather than shears.
const SLENDER: f64 = 4.0;
/// Fraction of the surface with thin parts from which on they dominate the bending of a body.
const MUCH: f64 = 0.5;
/// Maximum number of chords, and of cells whose shape is examined.
const PLACES: usize = 1000;
/// Largest distance of a mid-edge node from the middle of its straight edge, as a fraction of the length.
const STRAIGHT: f64 = 1e-6;
/// Smallest angle between two faces that counts as an edge of the body: 45 degrees.
const FOLD: f64 = std::f64::consts::FRAC_PI_4;
/// Stiffness ratio from which on facets are reported. MacNeal and Harder's hemisphere of 4, 8 and 16
/// cells of one layer a side is 36, 4.4 and 1.3 times too stiff; the estimates are 26, 2.5 and 1.1.
const FACETED: f64 = 1.25;
/// Poisson's ratio above which fully integrated second-order cells are reported to lock.
const NEARLY_FULL: f64 = 0.499;
/// Stiffness ratio from which on cells are reported as too stiff in bending.
const EXCESS: f64 = 1.5;

/// Advice: elements without locking.
const REMEDY: &str = "use `order = 2` in the body, or quadrilaterals (in 3D hexahedra)";

/// Warnings of bodies that lock, with a remedy.
pub(super) fn warnings(scene: &Scene, bodies: &[BodyAssembly]) -> Vec<String> {
    scene.body.iter().zip(bodies).flat_map(|(spec, body)| of_body(spec, body)).collect()
}

fn of_body(spec: &Body, body: &BodyAssembly) -> Vec<String> {
    let Some(material) = &spec.elastic else { return vec![] };
    if let Some(block) = body.mesh.block() {
        return match block.kind.order() {
            1 => trapezoids(body, block).into_iter().collect(),
            _ => nearly_locked(body, block, material).into_iter().collect(),
        };
    }
    if body.mesh.order() > 1 {
        return facets(body).into_iter().collect();
    }
    if body.thickness.is_some() {
        return vec![];
    }
    let name = &body.name;
    let mut warnings = vec![];
    if let Some(poisson) = poisson(material, &body.mesh).filter(|nu| *nu >= NEARLY_INCOMPRESSIBLE - ROUNDING)
    {
        warnings.push(format!(
            "volumetric locking of `{name}`: at a Poisson's ratio of {poisson:.4} linear elements are too \
             stiff (from {NEARLY_INCOMPRESSIBLE} on, and more so towards 0.5); {REMEDY}"
        ));
    }
    if let Some(SlenderBody { thickness, length, cells }) = thin(&body.mesh) {
        warnings.push(format!(
            "`{name}` is about {stiffer} % too stiff in bending (shear locking), or more: {cells:.1} linear \
             elements through its thickness of {thickness} m, and it is {:.1} times longer than thick; \
             {REMEDY}",
            length / thickness,
            stiffer = Rounded::<2>(100.0 * STIFFENING / (cells * cells)),
            thickness = Rounded::<4>(thickness)
        ));
    }
    warnings
}

/// Warns of cells of second order that are nearly incompressible and fully integrated.
fn nearly_locked(body: &BodyAssembly, block: &CellBlock, material: &MaterialSpec) -> Option<String> {
    // Full integration constrains the volume at every point if there are face and cell nodes.
    let serendipity = block.kind.of_first_order()?.of_second_order(true)?;
    let poisson = poisson(material, &body.mesh).filter(|nu| *nu > NEARLY_FULL)?;
    (block.kind != serendipity).then(|| {
        format!(
            "mild volumetric locking of `{}`: at a Poisson's ratio of {poisson:.5} (above {NEARLY_FULL}) its \
             {} are too stiff, by 2 % at 0.499 and 12 % at 0.4999 in a thick cylinder of five cells; use \
             `serendipity = true`, whose {} do not lock, or finer cells",
            body.name, block.kind.plural, serendipity.plural
        )
    })
}

/// Warns of a slender body of few cells, most of which are too stiff in bending because of their shape.
fn trapezoids(body: &BodyAssembly, block: &CellBlock) -> Option<String> {
    let SlenderBody { thickness, cells, .. } = thin(&body.mesh)?;
    let mut found = block.kind.visit_first(BendingExcess { mesh: &body.mesh, block });
    found.sort_by(f64::total_cmp);
    let middle = *found.get(found.len() / 2)?;
    (middle > EXCESS).then(|| {
        format!(
            "`{}` is too stiff in bending: at least half of its {} are not parallelograms, and resist \
             bending at least {middle:.1} times as much as the solid, with {cells} through its thickness of \
             {} m; make opposite sides of cells parallel, or use `order = 2`",
            body.name,
            block.kind.plural,
            Rounded::<4>(thickness)
        )
    })
}

/// Computes how much stiffer in bending than the solid each cell is.
struct BendingExcess<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
}

impl CellVisitor for BendingExcess<'_> {
    type Output = Vec<f64>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Vec<f64> {
        let cells = self.block.of::<N>();
        let some = cells.iter().step_by(cells.len().div_ceil(PLACES).max(1));
        some.map(|vertices| bending_excess(cell, &self.mesh.nodes::<D, N>(vertices))).collect()
    }
}

/// Warns of a thin second-order body in space with straight sides and a curved surface: its facets act as
/// a corrugated sheet.
///
/// An arc that rises by `s` above the chord between two folds has the second moment `4/45 s^2` about its
/// mean, compared with `t^2/12` of the thickness `t`: across the folds a corrugated sheet is
/// `1 + 16/15 (s/t)^2` times as stiff as a flat one.
fn facets(body: &BodyAssembly) -> Option<String> {
    if body.mesh.dimension < 3 || body.thickness.is_some() || is_curved(&body.mesh) {
        return None;
    }
    let SlenderBody { thickness, .. } = thin(&body.mesh)?;
    let mut rises = rises(&body.mesh);
    rises.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = 0.5 * rises.iter().map(|(_, area)| area).sum::<f64>();
    let (rise, _) = rises.iter().find(|(_, area)| {
        left -= area;
        left <= 0.0
    })?;
    let excess = 1.0 + 16.0 / 15.0 * (rise / thickness).powi(2);
    (excess > FACETED).then(|| {
        format!(
            "`{}` is too stiff in bending: its surface is curved, its second-order elements have straight \
             sides, and at least half of its faces are {} m or more off the curve, with {} m of thickness; \
             such facets are about {excess:.1} times as stiff in bending, or more; use more elements along \
             the curve, or curved sides",
            body.name,
            Rounded::<2>(*rise),
            Rounded::<4>(thickness)
        )
    })
}

/// True if a mid-edge node is off the middle of its straight edge.
fn is_curved(mesh: &Mesh) -> bool {
    let is_off = |(cell, middles): (&[u32; 4], &[u32; 6])| {
        TETRAHEDRON_EDGES.iter().zip(middles).any(|([a, b], middle)| {
            let [a, b, m] = [cell[*a], cell[*b], *middle].map(|v| mesh.point(v as usize));
            let size: f64 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
            (0..3).any(|c| (m[c] - 0.5 * (a[c] + b[c])).abs() > STRAIGHT * size)
        })
    };
    mesh.tetrahedra.iter().zip(&mesh.tetrahedron_middles).any(is_off)
}

/// For each surface triangle its distance from a curve through its neighbours [m] and its area [m^2].
/// Neighbours across an edge of the body do not count.
fn rises(mesh: &Mesh) -> Vec<(f64, f64)> {
    let faces = mesh.surface_triangles();
    let edge = |a: usize, b: usize| -> [f64; 3] {
        let (a, b) = (mesh.point(a), mesh.point(b));
        std::array::from_fn(|c| b[c] - a[c])
    };
    let norm = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let normals: Vec<[f64; 3]> = faces
        .iter()
        .map(|face| {
            let [a, b, c] = face.map(|vertex| vertex as usize);
            cross(&edge(a, b), &edge(a, c))
        })
        .collect();
    let sides =
        || faces.iter().enumerate().flat_map(|(i, [a, b, c])| [(i, *a, *b), (i, *b, *c), (i, *c, *a)]);
    let across: HashMap<(u32, u32), usize> = sides().map(|(i, a, b)| ((a, b), i)).collect();
    let mut rises: Vec<(f64, f64)> = normals.iter().map(|normal| (0.0, 0.5 * norm(*normal))).collect();
    for (i, a, b) in sides() {
        let Some(other) = across.get(&(b, a)) else { continue };
        let (own, other) = (normals[i], normals[*other]);
        let cosine: f64 = own.iter().zip(other).map(|(a, b)| a * b).sum();
        let turn = norm(cross(&own, &other)).atan2(cosine);
        let height = norm(own) / norm(edge(a as usize, b as usize));
        if turn < FOLD {
            rises[i].0 = rises[i].0.max(height * turn / 8.0);
        }
    }
    rises
}

/// Poisson's ratio of the solid at small strains; `None` for a model without one, and in plane stress,
/// where the thickness is free.
fn poisson(material: &MaterialSpec, mesh: &Mesh) -> Option<f64> {
    if mesh.dimension == 2 && material.plane() == Some(Plane::Stress) {
        return None;
    }
    let Lame { lambda, mu } = material.lame()?;
    Some(lambda / (2.0 * (lambda + mu)))
}

struct SlenderBody {
    /// Thickness [m].
    thickness: f64,
    /// Length [m].
    length: f64,
    /// Number of cells through the thickness.
    cells: f64,
}

/// Detects a slender body with few cells through its thickness. Chords count that are short compared with
/// the body's largest extent. If they cover most of the surface, the result is their median by number of
/// cells, weighted by surface.
fn thin(mesh: &Mesh) -> Option<SlenderBody> {
    let (lower, upper) = mesh.bounding_box();
    let length = lower.iter().zip(&upper).map(|(a, b)| b - a).fold(0.0, f64::max);
    let chords = mesh.chords(PLACES);
    let all: f64 = chords.iter().map(|chord| chord.face).sum();
    let mut short: Vec<Chord> =
        chords.into_iter().filter(|chord| SLENDER * chord.length <= length * (1.0 + ROUNDING)).collect();
    let surface: f64 = short.iter().map(|chord| chord.face).sum();
    if surface < MUCH * all {
        return None;
    }
    short.sort_by(|a, b| a.cells.total_cmp(&b.cells));
    let mut left = 0.5 * surface;
    let middle = short.iter().find(|chord| {
        left -= chord.face;
        left <= 0.0
    })?;
    let Chord { length: thickness, cells, .. } = *middle;
    (cells < FEW * (1.0 - ROUNDING)).then_some(SlenderBody { thickness, length, cells })
}
