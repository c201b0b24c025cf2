//! Assembly of muscles: tension along the fibres of elements.

use super::body::BodyAssembly;
use crate::{Body, FibreSpec, KeyPath, MuscleSpec, OverTime, Problem};
use pliant::algebra::{self, unit};
use pliant::energy::muscle::TensionField;
use pliant::numbering::Numbering;
use pliant::quantity::{Rounded, counted};
use pliant::system::System;
use pliant_mesh::Mesh;
use pliant_terms::FibreSet;

/// A muscle with resolved fibres.
pub(super) struct MusclePlan {
    /// Unit vector along the fibres of each element in the reference configuration, third component 0 in
    /// 2D.
    directions: Vec<[f64; 3]>,
    tension: OverTime,
}

/// Resolves the muscles of a body with this mesh.
pub(super) fn placed(
    spec: &Body,
    mesh: &Mesh,
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> Vec<MusclePlan> {
    let mut placed = vec![];
    for (i, muscle) in spec.muscle.iter().enumerate() {
        let path = path.key("muscle").index(i).key("fibre");
        let tension = muscle.tension.clone();
        let found = directions((&muscle.fibre, "fibres"), mesh, &path, problems);
        placed.extend(found.map(|directions| MusclePlan { directions, tension }));
    }
    placed
}

/// Unit direction of fibres (or of another directed feature) for each element of `mesh`; `None`, with a
/// problem, if a direction is missing.
pub(super) fn directions(
    (fibre, what): (&FibreSpec, &str),
    mesh: &Mesh,
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> Option<Vec<[f64; 3]>> {
    let centres = centres(mesh);
    let (key, vectors) = (fibre.key(), fibre.vectors(&centres));
    let path = path.key(key);
    if vectors.len() != centres.len() {
        let counts = (vectors.len() as u64, centres.len() as u64);
        let message = format!(
            "the list has {}, the body has {}",
            counted(counts.0, "direction", "directions"),
            counted(counts.1, "element", "elements")
        );
        problems.push(Problem::semantic(path, message));
        return None;
    }
    let units: Vec<[f64; 3]> = vectors.iter().map(|vector| unit(vector).0).collect();
    let is_none = |v: &[f64; 3]| !v.iter().all(|c| c.is_finite());
    if let Some(element) = units.iter().position(is_none) {
        let d = mesh.dimension;
        let message = format!(
            "{what} of element {element}, whose centre is at {} m at rest, have the direction {}",
            rounded(&centres[element][..d]),
            rounded(&vectors[element][..d]),
        );
        let help = "a direction is a vector of finite numbers that are not all zero";
        problems.push(Problem::semantic(path, message).with_help(help));
        return None;
    }
    Some(units)
}

/// A vector with rounded components, for messages.
pub(super) fn rounded(vector: &[f64]) -> String {
    let components: Vec<String> = vector.iter().map(|c| Rounded::<6>(*c).to_string()).collect();
    format!("[{}]", components.join(", "))
}

/// Mean of the corners of each element [m].
pub(super) fn centres(mesh: &Mesh) -> Vec<[f64; 3]> {
    let centre = |corners: &[u32]| algebra::centre(&mesh.points, mesh.dimension, corners);
    match (mesh.block(), mesh.dimension) {
        (Some(block), _) => block.cells().map(centre).collect(),
        (None, 2) => mesh.triangles.iter().map(|cell| centre(cell)).collect(),
        _ => mesh.tetrahedra.iter().map(|cell| centre(cell)).collect(),
    }
}

impl BodyAssembly {
    /// Adds the muscles to `system`; `rest` holds the reference positions of the whole system, in its
    /// `numbering`; `duration` is that of the run [s].
    pub(super) fn add_muscles<const D: usize, const N: usize>(
        &self,
        duration: f64,
        rest: &[f64],
        numbering: &Numbering,
        system: &mut System,
    ) {
        for (index, MusclePlan { directions, tension }) in self.muscles.iter().enumerate() {
            let cells = self.element_vertices::<D, N>(numbering);
            let fibres = FibreSet {
                name: MuscleSpec::term_name(index, &self.name),
                dimension: D,
                kind: self.mesh.block().map(|block| block.kind),
                nodes: cells.len() / directions.len().max(1),
                cells: &cells,
                rest,
                directions,
            };
            let formula = tension.clone();
            let tension = TensionField {
                changes: tension.depends_on_time(),
                varies: tension.depends_on_place(),
                field: Box::new(move |x, t| formula.value(x, t)),
                until: duration,
            };
            system.add_term(pliant_terms::muscle(fibres, tension));
        }
    }

    /// Descriptions of the muscles in words.
    pub(super) fn described_muscles(&self) -> impl Iterator<Item = String> {
        self.muscles.iter().enumerate().map(|(i, muscle)| {
            let changes =
                if muscle.tension.depends_on_time() { ", changes with time: it does work" } else { "" };
            let elements = counted(muscle.directions.len() as u64, "element", "elements");
            format!("muscle {i} of `{}`: {elements}{changes}", self.name)
        })
    }
}
