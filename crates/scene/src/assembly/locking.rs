//! Bodies that lock: linear elements that are nearly incompressible, or few through a thickness that bends;
//! and those that are too soft: whole cells that are narrow along what bends.

use super::body::BodyAssembly;
use crate::Body;
use crate::Scene;
use pliant::material::{Lame, MaterialSpec, Plane};
use pliant::quantity::Rounded;
use pliant_mesh::{CellRun, CellStack, Chord, Mesh};

/// From this Poisson's ratio on linear elements are said to lock. In plane strain the deflection of a
/// cantilever, ten times longer than thick, of two square cells is 0.52 of theory at 0.3, 0.31 at 0.45, 0.11
/// at 0.49 and 0.02 at 0.4999; of four 0.81, 0.62, 0.29, 0.02.
const NEARLY_INCOMPRESSIBLE: f64 = 0.45;
/// Of a ratio that comes from moduli, of sums over a chord.
const ROUNDING: f64 = 1e-9;
/// Below so many cells through a thickness bending is noticeably too stiff: by `STIFFENING / n^2`, a quarter
/// for four.
const FEW: f64 = 4.0;
/// Linear elements of cells as long as thick, `n` through the thickness, are about `1 + STIFFENING / n^2`
/// times too stiff in bending, in 2D and in 3D: deflections at `nu = 0.3` against Timoshenko's beam, 3.6 to
/// 4.4 for 1 to 6 of them; of cells twice as long, 6.3 to 7.7.
const STIFFENING: f64 = 4.0;
/// Ratio of length to thickness from which a body bends rather than shears.
const SLENDER: f64 = 4.0;
/// Thin places are what a body bends by if so much of its surface lies on them.
const MUCH: f64 = 0.5;
/// Part of its stiffness in bending below which a body of whole cells is said to be too soft.
const SOFT: f64 = 0.9;
/// Soft places are told of if so much of the surface lies on them: a beam is as soft as its thin places, and
/// bends across one of two thicknesses.
const SOME: f64 = 0.1;
/// Places of the surface where the thickness is measured.
const PLACES: usize = 1000;

/// Bodies that lock, and what would not.
pub(super) fn warnings(scene: &Scene, bodies: &[BodyAssembly]) -> Vec<String> {
    scene.body.iter().zip(bodies).flat_map(|(spec, body)| of_body(spec, body)).collect()
}

fn of_body(spec: &Body, body: &BodyAssembly) -> Vec<String> {
    let Some(material) = &spec.elastic else { return vec![] };
    if let Some(block) = body.mesh.block() {
        let (own, remedy) = (own_bending(material, &body.mesh), whole_remedy(&body.mesh));
        let warning = |soft: SoftBody| {
            let SoftBody { thickness, height, width, cells, lost } = soft;
            format!(
                "`{}` bends too softly, about {:.2} times: {cells} {} of {} through its thickness of {} m, \
                 {} m wide along it and {} m high; where they are narrower than high (w < h), n rows carry \
                 1 - (1 - {own:.2} (w/h)^2)/n^2 of the bending; {remedy}",
                body.name,
                1.0 / (1.0 - lost.of_own(own)),
                if cells == 1 { "row" } else { "rows" },
                block.kind.plural,
                Rounded::<4>(thickness),
                Rounded::<4>(width),
                Rounded::<4>(height),
            )
        };
        return soft(&body.mesh).map(warning).into_iter().collect();
    }
    if body.thickness.is_some() || body.mesh.order() > 1 || spec.nodal_integration.is_some() {
        return vec![];
    }
    let (name, remedy) = (&body.name, remedy(material));
    let mut warnings = vec![];
    if let Some(poisson) = poisson(material, &body.mesh).filter(|nu| *nu >= NEARLY_INCOMPRESSIBLE - ROUNDING)
    {
        warnings.push(format!(
            "`{name}` locks: with a Poisson's ratio of {poisson:.4} (from {NEARLY_INCOMPRESSIBLE} on) linear elements can hardly deform \
             without changing their volume, and are too stiff, the more the closer it is to 0.5; {remedy}"
        ));
    }
    if let Some(SlenderBody { thickness, length, cells }) = thin(&body.mesh) {
        warnings.push(format!(
            "`{name}` bends too stiffly: {cells:.1} linear elements through its thickness of {thickness} m (from its surface along the \
             normal to the other side, over half of it or more), {:.1} times longer than thick; with n of them, as long as thick, \
             bending is about 1 + {STIFFENING}/n^2 times too stiff, here {:.1} times or more; {remedy}",
            length / thickness,
            1.0 + STIFFENING / (cells * cells),
        thickness = Rounded::<4>(thickness)));
    }
    warnings
}

/// Poisson's ratio of the solid at small strains; `None` where the model has none, and in plane stress, where
/// the thickness gives way.
fn poisson(material: &MaterialSpec, mesh: &Mesh) -> Option<f64> {
    if mesh.dimension == 2 && material.plane() == Some(Plane::Stress) {
        return None;
    }
    let Lame { lambda, mu } = material.lame()?;
    Some(lambda / (2.0 * (lambda + mu)))
}

/// Keys to write in place.
fn remedy(material: &MaterialSpec) -> &'static str {
    // Where it is not, the scene is refused.
    let is_split = material.split(0.5).is_some();
    if is_split && material.lame().is_some_and(|lame| lame.lambda + lame.mu < 1e7 * lame.mu) {
        "`order = 2` or `nodal_integration = {}` in the body does not lock"
    } else {
        "`order = 2` in the body does not lock"
    }
}

/// Part of its own bending that a cube carries. With one volume for each cell it is sheared at `mu` instead:
/// in the plane by `2 mu` of `E / (1 - nu^2)`, or of `E` in plane stress; in 3D, where a cell narrows on the
/// side that is stretched, by `2 / 7` of it, `15 / 7 mu` of `E`.
fn own_bending(material: &MaterialSpec, mesh: &Mesh) -> f64 {
    let poisson = material.lame().map_or(0.0, |Lame { lambda, mu }| lambda / (2.0 * (lambda + mu)));
    match (mesh.dimension, material.plane()) {
        (2, Some(Plane::Stress)) => 1.0 / (1.0 + poisson),
        (2, _) => 1.0 - poisson,
        _ => 15.0 / 14.0 / (1.0 + poisson),
    }
}

/// Advice for cells that bend too softly.
fn whole_remedy(mesh: &Mesh) -> &'static str {
    if mesh.dimension == 2 {
        "make cells at least as wide as high along what bends, take more rows, or triangles of `order = 2`"
    } else {
        "make cells at least as wide as high along what bends, take more rows, or tetrahedra of `order = 2`"
    }
}

/// A body of whole cells that bends too softly.
struct SoftBody {
    /// [m]
    thickness: f64,
    /// Mean height of the cells [m].
    height: f64,
    /// Mean width along what bends [m].
    width: f64,
    /// Number of rows.
    cells: usize,
    lost: LostBending,
}

/// Sums over the rows of a thickness `H`, by their `h^3 / H^3`: the part of its bending that is the cells'
/// own, and of it the parts that cells `min(1, w/h)` wide keep, squared: slopes are drawn to the middle.
#[derive(Clone, Copy)]
struct LostBending {
    own: f64,
    kept: f64,
}

impl LostBending {
    /// Through a stack along one direction across it.
    fn new(heights: &[f64], widths: &[f64]) -> Self {
        let thickness: f64 = heights.iter().sum();
        let mut lost = LostBending { own: 0.0, kept: 0.0 };
        for (h, w) in heights.iter().zip(widths) {
            let own = (h / thickness).powi(3);
            lost.own += own;
            lost.kept += own * (w / h).min(1.0).powi(2);
        }
        lost
    }

    /// Lost part of the stiffness where a cube carries the part `own` of its bending.
    fn of_own(self, own: f64) -> f64 {
        self.own - own * self.kept
    }
}

/// A stack along the direction across it in which what it is part of is slender and bends most softly.
fn softest(stack: &CellStack, extent: f64) -> Option<SoftBody> {
    let (thickness, cells) = (stack.heights.iter().sum::<f64>(), stack.heights.len());
    let is_long = |run: &&CellRun| SLENDER * thickness <= run.length.min(extent) * (1.0 + ROUNDING);
    let soft = stack.across.iter().filter(is_long).map(|run| SoftBody {
        thickness,
        height: thickness / cells as f64,
        width: run.widths.iter().sum::<f64>() / cells as f64,
        cells,
        lost: LostBending::new(&stack.heights, &run.widths),
    });
    soft.max_by(|a, b| a.lost.of_own(1.0).total_cmp(&b.lost.of_own(1.0)))
}

/// The stack in the middle of the order by softness of those that bend too softly for their shape, if they
/// start from some of the surface. Poisson's ratio does not count here: cubes are not told of.
fn soft(mesh: &Mesh) -> Option<SoftBody> {
    let extent = extent(mesh);
    let stacks = mesh.stacks(PLACES);
    let all: f64 = stacks.iter().map(|stack| stack.face).sum();
    let of_stack = |stack: &CellStack| Some((stack.face, softest(stack, extent)?));
    let mut soft: Vec<(f64, SoftBody)> = stacks.iter().filter_map(of_stack).collect();
    soft.retain(|(_, soft)| 1.0 - soft.lost.of_own(1.0) < SOFT * (1.0 - ROUNDING));
    let surface: f64 = soft.iter().map(|(face, _)| face).sum();
    if surface < SOME * all {
        return None;
    }
    soft.sort_by(|(_, a), (_, b)| a.lost.of_own(1.0).total_cmp(&b.lost.of_own(1.0)));
    let mut left = 0.5 * surface;
    let middle = soft.into_iter().find(|(face, _)| {
        left -= face;
        left <= 0.0
    })?;
    Some(middle.1)
}

/// Largest extent of a mesh [m].
fn extent(mesh: &Mesh) -> f64 {
    let (lower, upper) = mesh.bounding_box();
    lower.iter().zip(&upper).map(|(a, b)| b - a).fold(0.0, f64::max)
}

/// A slender body of few cells.
struct SlenderBody {
    /// [m]
    thickness: f64,
    /// [m]
    length: f64,
    /// Through the thickness.
    cells: f64,
}

/// The thickness of a slender body with few cells through it: of the chords that are short beside the largest
/// extent of the body, if they start from most of its surface, those in the middle of the order by cells.
fn thin(mesh: &Mesh) -> Option<SlenderBody> {
    let length = extent(mesh);
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
