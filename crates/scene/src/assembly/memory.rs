//! Check that a scene fits into memory, before any of it is allocated.

use crate::Body;
use crate::KeyPath;
use crate::Problem;
use crate::Scene;
use pliant::available_memory;
use pliant::energy::nbody::TreeGravity;
use pliant::energy::patch::Workspace;
use pliant::simulation::Simulation;
use pliant_mesh::{MeshSize, predicted_body_size};

/// Memory per element while a scene is assembled and run [bytes]: reference data, indices, patch rows,
/// and the mesh.
const BYTES_PER_ELEMENT: u64 = 250;
/// Memory per second-order element, with reference data at 3 or 4 points [bytes].
const BYTES_PER_QUADRATIC_ELEMENT: u64 = 700;
/// Memory per quadrilateral and per hexahedron, with reference data at 4 and 8 points [bytes].
const BYTES_PER_CELL: [u64; 2] = [700, 2400];
/// Memory per second-order cell [bytes]: 9 and 27 points of ten numbers, and the map from faces to their
/// nodes during mesh generation.
const BYTES_PER_QUADRATIC_CELL: [u64; 2] = [2200, 7000];
/// Memory per element of a muscle [bytes]: fibres at its points, their positions, indices, patch rows,
/// directions.
const BYTES_PER_MUSCLE_ELEMENT: u64 = 250;
/// Memory per second-order element of a muscle [bytes].
const BYTES_PER_QUADRATIC_MUSCLE_ELEMENT: u64 = 1000;
/// Memory per quadrilateral and per hexahedron of a muscle [bytes].
const BYTES_PER_MUSCLE_CELL: [u64; 2] = [500, 1300];
/// Memory per spring [bytes]: ends and constants as lists, by both ends, and in slots.
const BYTES_PER_SPRING: u64 = 100;
/// Memory per coordinate [bytes]: state, the integrator's scratch states, gradients, masses.
const BYTES_PER_COORDINATE: u64 = 120;
/// Additional memory of a simulation with contact, as a fraction: candidate pairs along the trajectories
/// of a step, lists and matrices rebuilt as contacts change, and what the allocator retains. Measured,
/// not counted: 0.28 to 0.40 in collisions of 3,700 to 17,000 vertices.
const PART_OF_CONTACT: f64 = 0.33;
/// Prediction from which on the amount is unknown [bytes]: the structure of the matrices itself does not
/// fit in memory, and solvers then predict a half or a quarter of the address space.
const UNCOUNTED: u64 = 1 << 61;

/// Rejects a scene that needs more memory than is available.
pub(super) fn check(scene: &Scene) -> Result<(), Vec<Problem>> {
    let (mut total, mut reserved, mut problems) = (0u64, 0u64, vec![]);
    let (mut vertices, mut particles) = (0u64, 0u64);
    for (i, body) in scene.body.iter().enumerate() {
        let path = KeyPath::root().key("body").index(i).key("mesh");
        match predicted_body_size(&body.body_mesh(), scene.dimension, &scene.directory) {
            Ok(size) => {
                total = total.saturating_add(predicted_bytes(&size, scene.dimension));
                let muscles = predicted_muscle_bytes(&size, scene.dimension);
                total = total.saturating_add(muscles.saturating_mul(body.muscle.len() as u64));
                reserved = reserved.saturating_add(reserved_bytes(body, &size, scene.dimension));
                vertices = vertices.saturating_add(size.vertices);
                if body.elastic.is_none() && body.springs.is_none() {
                    particles = particles.saturating_add(size.vertices);
                }
            }
            Err(error) => problems.push(Problem::semantic(path, error.to_string())),
        }
    }
    total = total.saturating_add(gravity_bytes(scene, particles));
    if vertices > u64::from(u32::MAX) {
        let message =
            format!("the bodies together have {vertices} vertices; at most {} can be numbered", u32::MAX);
        problems.push(Problem::semantic(KeyPath::root().key("body"), message));
    }
    if let Some(available) = available_memory::available_beside(reserved)
        && total > available
        && problems.is_empty()
    {
        let message = format!("the scene needs about {}, {} are available", human(total), human(available));
        let help = "fewer cells, or a machine with more memory";
        problems.push(Problem::semantic(KeyPath::root().key("body"), message).with_help(help));
    }
    if problems.is_empty() { Ok(()) } else { Err(problems) }
}

/// Memory of `simulation` while stepping [bytes].
///
/// # Errors
/// Implicit steps would need more memory than is available.
pub(super) fn check_steps(scene: &Scene, simulation: &mut Simulation) -> Result<usize, Vec<Problem>> {
    let (held, predicted) = (simulation.bytes(), simulation.predicted_bytes());
    let of_contact = if scene.contact.is_some() { PART_OF_CONTACT * predicted as f64 } else { 0.0 };
    let predicted = predicted.saturating_add(of_contact as usize);
    let further = predicted.saturating_sub(held) as u64;
    match available_memory::available() {
        Some(available) if further > available => Err(vec![too_large(scene, simulation, further, available)]),
        _ => Ok(predicted),
    }
}

fn too_large(scene: &Scene, simulation: &Simulation, further: u64, available: u64) -> Problem {
    let message = format!(
        "implicit steps of this scene need {} for their matrices ({}), {} are available",
        need(further, available),
        simulation.linear_solver(),
        human(available)
    );
    let path = KeyPath::root().key("time");
    let path = if scene.time.solver.is_some() { path.key("solver") } else { path.key("integrator") };
    Problem::semantic(path, message)
        .with_help(
            "`solver = { linear = \"multigrid\" }` takes less than a factorisation, \"matrix-free\" \
                    next to nothing",
        )
        .with_help("or fewer cells, an explicit scheme, or a machine with more memory")
}

/// Amount in words: `about 462.447 MB`, or more than the available memory if it is unknown.
fn need(further: u64, available: u64) -> String {
    if further < UNCOUNTED {
        format!("about {}", human(further))
    } else {
        format!("more than {}", human(available))
    }
}

/// Approximate memory for the mutual gravity of these particles [bytes]. The sum over all pairs has an
/// array for each of 16 groups of particles, and uses a tree to find the highest frequency.
fn gravity_bytes(scene: &Scene, particles: u64) -> u64 {
    let Some(nbody) = &scene.world.nbody else { return 0 };
    // Indices have 32 bits.
    let n = particles.min(u64::from(u32::MAX));
    let tree = |angle: f64| match scene.dimension {
        2 => TreeGravity::<2>::predicted_bytes(n, angle),
        _ => TreeGravity::<3>::predicted_bytes(n, angle),
    };
    match &nbody.tree {
        Some(by_tree) => tree(by_tree.opening_angle),
        None => n * 8 * 18 * scene.dimension as u64 + tree(0.5),
    }
}

/// Address space that the elements of a body of this size reserve for their elastic, damping and muscle
/// forces [bytes].
fn reserved_bytes(body: &Body, size: &MeshSize, dimension: usize) -> u64 {
    let cells = size.triangles.max(size.tetrahedra).max(size.blocks);
    let further = u64::from(body.damping.is_some()) + body.muscle.len() as u64;
    let workspace = match dimension {
        2 => Workspace::<2>::reserved_bytes(cells),
        _ => Workspace::<3>::reserved_bytes(cells),
    };
    if body.elastic.is_some() { workspace * (1 + further) } else { 0 }
}

/// Approximate peak memory of assembling a body of this size [bytes].
fn predicted_bytes(size: &MeshSize, dimension: usize) -> u64 {
    if size.blocks > 0 {
        let each = if size.quadratic { BYTES_PER_QUADRATIC_CELL } else { BYTES_PER_CELL };
        let of_cells = size.blocks.saturating_mul(each[usize::from(dimension == 3)]);
        let of_vertices = size.vertices.saturating_mul(dimension as u64 * BYTES_PER_COORDINATE);
        return size.bytes.saturating_add(of_cells).saturating_add(of_vertices);
    }
    let cells = if dimension == 3 && size.tetrahedra > 0 { size.tetrahedra } else { size.triangles };
    let per_element = if size.quadratic { BYTES_PER_QUADRATIC_ELEMENT } else { BYTES_PER_ELEMENT };
    size.bytes
        .saturating_add(cells.saturating_mul(per_element))
        .saturating_add(size.edges.saturating_mul(BYTES_PER_SPRING))
        .saturating_add(size.vertices.saturating_mul(dimension as u64 * BYTES_PER_COORDINATE))
}

/// Approximate memory of a muscle in a body of this size [bytes].
fn predicted_muscle_bytes(size: &MeshSize, dimension: usize) -> u64 {
    let (count, each) = match (size.blocks, size.quadratic, dimension) {
        (0, true, 2) => (size.triangles, BYTES_PER_QUADRATIC_MUSCLE_ELEMENT),
        (0, true, _) => (size.tetrahedra, BYTES_PER_QUADRATIC_MUSCLE_ELEMENT),
        (0, false, 2) => (size.triangles, BYTES_PER_MUSCLE_ELEMENT),
        (0, false, _) => (size.tetrahedra, BYTES_PER_MUSCLE_ELEMENT),
        (blocks, ..) => (blocks, BYTES_PER_MUSCLE_CELL[usize::from(dimension == 3)]),
    };
    count.saturating_mul(each)
}

/// Amount with a unit: `3.2 GB`.
pub(crate) fn human(bytes: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = bytes as f64;
    let mut unit = 0;
    while value >= 1000.0 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    if unit == 0 { format!("{bytes} B") } else { format!("{value:.3} {}", units[unit]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::UnstableStep;

    /// Solvers that cannot count predict a half or a quarter of the address space, minus the memory in
    /// use.
    #[test]
    fn what_could_not_be_counted_is_more_than_there_is() {
        assert_eq!(need(462_447_000, 151_994_000), "about 462.447 MB");
        for uncounted in [usize::MAX / 2 - (1 << 40), usize::MAX / 4 - (1 << 40)] {
            assert_eq!(need(uncounted as u64, 73_261_000), "more than 73.261 MB");
        }
    }

    /// A muscle uses less memory than predicted (without the lists of assembly), and more than a fifth of
    /// it.
    #[test]
    fn muscles_take_no_more_memory_than_predicted() {
        for (dimension, cells) in [(2, vec![60, 60]), (3, vec![12, 12, 12])] {
            let whole = if dimension == 2 { "quadrilateral" } else { "hexahedron" };
            for (order, element) in [(1, None), (2, None), (1, Some(whole))] {
                let along = vec![1.0; dimension];
                let muscle =
                    serde_json::json!([{ "fibre": { "direction": along }, "tension": "1e3 * (1 + X)" }]);
                let scene = |muscle: serde_json::Value| -> Scene {
                    serde_json::from_value(serde_json::json!({
                        "dimension": dimension,
                        "time": { "integrator": "symplectic-euler", "step": 1e-9, "duration": 1.0 },
                        "body": [{
                            "mesh": { "grid": { "cells": cells, "spacing": 0.1, "element": element } },
                            "order": order,
                            "elastic": { "linear": { "young": 1e5, "poisson": 0.4 } },
                            "mass": { "density": 1000.0 },
                            "muscle": muscle,
                        }],
                    }))
                    .unwrap()
                };
                let held =
                    |muscle| scene(muscle).assemble(UnstableStep::Refuse).unwrap().simulation.bytes() as u64;
                let spec = scene(muscle.clone());
                let size = predicted_body_size(&spec.body[0].body_mesh(), dimension, ".".as_ref()).unwrap();
                let predicted = predicted_muscle_bytes(&size, dimension);
                let more = held(muscle) - held(serde_json::json!([]));
                let is_right = more < predicted && 5 * more > predicted;
                assert!(is_right, "{dimension}D, order {order}, {element:?}: {more} of {predicted}");
            }
        }
    }

    /// Explicit steps use less memory than predicted (without the mesh and the lists of assembly), and
    /// more than a fifth of it.
    #[test]
    fn elements_take_no_more_memory_than_predicted() {
        for (dimension, cells) in [(2, vec![60, 60]), (3, vec![12, 12, 12])] {
            let whole = if dimension == 2 { "quadrilateral" } else { "hexahedron" };
            for element in [None, Some(whole)] {
                let scene: Scene = serde_json::from_value(serde_json::json!({
                    "dimension": dimension,
                    "time": { "integrator": "symplectic-euler", "step": 1e-9, "duration": 1.0 },
                    "body": [{
                        "mesh": { "grid": { "cells": cells, "spacing": 0.1, "element": element } },
                        "elastic": { "linear": { "young": 1e5, "poisson": 0.4 } },
                        "mass": { "density": 1000.0 },
                    }],
                }))
                .unwrap();
                let size = predicted_body_size(&scene.body[0].body_mesh(), dimension, ".".as_ref()).unwrap();
                let predicted = predicted_bytes(&size, dimension);
                let held = scene.assemble(UnstableStep::Refuse).unwrap().simulation.bytes() as u64;
                assert!(
                    held < predicted && 5 * held > predicted,
                    "{dimension}D, {element:?}: {held} of {predicted}"
                );
            }
        }
    }
}
