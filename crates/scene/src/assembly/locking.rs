//! Bodies that lock: linear elements that are nearly incompressible, or few through a thickness that bends.

use super::body::BodyAssembly;
use crate::Body;
use crate::Scene;
use pliant::material::{Lame, MaterialSpec, Plane};
use pliant::quantity::Rounded;
use pliant_mesh::{Chord, Mesh};

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
/// Places of the surface where the thickness is measured.
const PLACES: usize = 1000;

/// Bodies that lock, and what would not.
pub(super) fn warnings(scene: &Scene, bodies: &[BodyAssembly]) -> Vec<String> {
    scene.body.iter().zip(bodies).flat_map(|(spec, body)| of_body(spec, body)).collect()
}

fn of_body(spec: &Body, body: &BodyAssembly) -> Vec<String> {
    let Some(material) = &spec.elastic else { return vec![] };
    if body.mesh.block().is_some() {
        return vec![];
    }
    if body.thickness.is_some() || body.mesh.order() > 1 || spec.nodal_integration.is_some() {
        return vec![];
    }
    let (name, remedy) = (&body.name, remedy(material));
    let mut warnings = vec![];
    if let Some(poisson) = poisson(material, &body.mesh).filter(|nu| *nu >= NEARLY_INCOMPRESSIBLE - ROUNDING)
    {
        warnings.push(format!(
            "`{name}` locks: with a Poisson's ratio of {poisson:.4} (from {NEARLY_INCOMPRESSIBLE} on) \
             linear elements can hardly deform without changing their volume, and are too stiff, the more \
             the closer it is to 0.5; {remedy}"
        ));
    }
    if let Some(SlenderBody { thickness, length, cells }) = thin(&body.mesh) {
        warnings.push(format!(
            "`{name}` bends too stiffly: {cells:.1} linear elements through its thickness of {thickness} m \
             (from its surface along the normal to the other side, over half of it or more), {:.1} times \
             longer than thick; with n of them, as long as thick, bending is about 1 + {STIFFENING}/n^2 \
             times too stiff, here {:.1} times or more; {remedy}",
            length / thickness,
            1.0 + STIFFENING / (cells * cells),
            thickness = Rounded::<4>(thickness)
        ));
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
