//! Warnings about bodies that differ from their files, or consist of several pieces.

use super::report::BodyReport;
use crate::{Body, MeshSpec, Scene};
use pliant::quantity::{Rounded, counted};

/// Distance of the skin from the solid, in cell edges, above which it is reported.
const FAR: f64 = 0.5;

/// Warnings of disconnected meshes, of skins far from their fitted solid, and of unread contents of
/// files.
pub(super) fn warnings(scene: &Scene, bodies: &[BodyReport]) -> Vec<String> {
    let all = scene.body.iter().zip(bodies);
    all.flat_map(|(spec, body)| [parted(spec, body), far(body), passed_over(body)]).flatten().collect()
}

/// Warns of an elastic body whose mesh is disconnected: coincident vertices that are not joined, or
/// several pieces. Generated shapes of several pieces are intended.
fn parted(spec: &Body, body: &BodyReport) -> Option<String> {
    let is_given = matches!(spec.mesh, MeshSpec::File(_) | MeshSpec::Surface(_) | MeshSpec::Inline(_));
    if !is_given || spec.elastic.is_none() || spec.repeat.is_some() {
        return None;
    }
    let name = &body.name;
    match (body.contents.coincident_vertices as u64, body.contents.pieces as u64) {
        (0, 0 | 1) => None,
        (0, pieces) => Some(format!(
            "`{name}` is of {} that nothing connects: they move apart; give each a body of its own, or join \
             them",
            counted(pieces, "piece", "pieces")
        )),
        (vertices, _) => Some(format!(
            "{} at the position of another and {} not joined to it: `{name}` is open there; `merge` joins \
             them in a file",
            counted(vertices, "vertex lies", "vertices lie"),
            if vertices == 1 { "is" } else { "are" }
        )),
    }
}

fn passed_over(body: &BodyReport) -> Option<String> {
    let names = &body.contents.passed_over;
    (!names.is_empty()).then(|| {
        format!(
            "the file of `{}` holds {}, which are not read: materials, supports and loads stand in the \
             scene, on the sets of the file by their names",
            body.name,
            names.join(", ")
        )
    })
}

fn far(body: &BodyReport) -> Option<String> {
    let surface = body.surface.as_ref().filter(|surface| surface.fitted)?;
    // Twelve tetrahedra fill a cube of the lattice.
    let cell = (12.0 * surface.solid_volume / body.contents.tetrahedra as f64).cbrt();
    let cells = surface.distance / cell;
    (cells > FAR).then(|| {
        format!(
            "the surface of `{}` lies up to {} m from its solid, {cells:.2} of a cell: sharp edges are \
             cut off, or gaps narrower than cells are filled, and what they part is grown together; give \
             more `cells`",
            body.name,
            Rounded::<4>(surface.distance)
        )
    })
}
