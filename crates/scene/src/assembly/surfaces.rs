//! Warnings about bodies that differ from the files that they were made from.

use super::report::BodyReport;
use pliant::quantity::Rounded;

/// Distance of the skin from the solid, in edges of cells, from which on it is told.
const FAR: f64 = 0.5;

/// One for each body whose skin lies far from its fitted solid, or whose file says more than is read.
pub(super) fn warnings(bodies: &[BodyReport]) -> Vec<String> {
    bodies.iter().flat_map(|body| [far(body), passed_over(body)]).flatten().collect()
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
    // A cube of the lattice is filled by twelve tetrahedra.
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
