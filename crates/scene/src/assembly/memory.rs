//! How much memory a scene takes, about: whether it fits, before any of it is allocated.
//!
//! What dominates is counted, each kind by one number: vectors by coordinates, elements by their nodes and
//! quadrature points, springs, particles that attract each other, and what solvers make of the matrix. The
//! sum is within a factor of 1.5 of the peak of usual scenes: `tests/memory.rs`, `tests/cli/memory.rs`.

use crate::Body;
use crate::KeyPath;
use crate::Problem;
use crate::Scene;
use crate::assembly::body::BodyAssembly;
use pliant::available_memory;
use pliant::energy::patch::Workspace;
use pliant::simulation::Simulation;
use pliant_mesh::{MeshSize, predicted_body_size};

/// Bytes per coordinate: state, vectors of the scheme, gradients, masses, shape at rest.
const PER_COORDINATE: u64 = 110;
/// Bytes per node of an element: its number in the mesh and in the patch, and its row of sums.
const PER_NODE: u64 = 16;
/// Bytes per spring or hinge: ends and constants as lists, then as seen from both ends.
const PER_SPRING: u64 = 50;
/// Bytes per coordinate of a particle of mutual gravity: a tree or arrays of partial sums, and the vectors of
/// the search of the largest frequency. They are 30 to 300: beyond 100 a run takes more than is said.
const PER_COORDINATE_OF_PARTICLE: u64 = 1000;
/// Damping by strain rate takes so many times what elasticity of the same elements does, measured.
const DAMPING: u64 = 3;
/// Contact holds so much on top of the rest: candidates, and matrices that are made anew as contacts come and
/// go.
const PART_OF_CONTACT: f64 = 0.33;
/// Bytes per vertex, element and quadrature point of stresses recovered at vertices, measured: samples,
/// patches, their polynomials.
const RECOVERY_PER_VERTEX: u64 = 900;
const RECOVERY_PER_CELL: u64 = 200;
const RECOVERY_PER_POINT: u64 = 100;
/// Prediction from which on the amount is unknown [bytes]: the structure of the matrices itself does not
/// fit in memory, and solvers then predict a half or a quarter of the address space.
const UNCOUNTED: u64 = 1 << 61;

/// Counts of a body that decide its memory.
struct BodySize {
    vertices: u64,
    /// Elements, with their nodes and quadrature points.
    cells: u64,
    nodes: u64,
    points: u64,
    /// Springs and hinges.
    springs: u64,
}

impl BodySize {
    /// Size of a mesh that is not made yet: springs along the edges that it names.
    fn of_mesh(size: &MeshSize, dimension: usize) -> BodySize {
        let d = dimension as u64;
        let simplices = if size.tetrahedra > 0 { size.tetrahedra } else { size.triangles };
        let (cells, nodes, points) = match (size.blocks, size.quadratic) {
            (0, false) => (simplices, d + 1, 1),
            (0, true) => (simplices, (d + 1) * (d + 2) / 2, d + 1),
            // Hexahedra of first order have 135 numbers each: slopes, and the stiffness of hourglass modes.
            (blocks, false) if size.block_nodes == 8 => (blocks, 8, 14),
            // Other cells have the slopes of all nodes.
            (blocks, _) => (blocks, size.block_nodes, size.block_nodes),
        };
        BodySize { vertices: size.vertices, cells, nodes, points, springs: size.edges }
    }

    /// Size of a body that is made.
    fn of_body(body: &BodyAssembly, dimension: usize) -> BodySize {
        let (mesh, block) = (&body.mesh, body.mesh.block());
        let size = MeshSize {
            vertices: mesh.vertex_count() as u64,
            triangles: mesh.triangles.len() as u64,
            tetrahedra: mesh.tetrahedra.len() as u64,
            blocks: block.map_or(0, |block| block.cells().len() as u64),
            block_nodes: block.map_or(0, |block| block.kind.nodes as u64),
            quadratic: mesh.order() > 1,
            edges: (body.springs.len() + body.bends.count()) as u64,
            ..MeshSize::default()
        };
        BodySize::of_mesh(&size, dimension)
    }

    /// Bytes, about, of the body and of all terms that `spec` names of it.
    fn bytes(&self, spec: &Body, dimension: usize) -> u64 {
        let d = dimension as u64;
        let damped = spec
            .damping
            .as_ref()
            .is_some_and(|damping| damping.strain_rate.is_some() || damping.stiffness_proportional.is_some());
        let terms =
            u64::from(spec.elastic.is_some()) + DAMPING * u64::from(damped) + spec.muscle.len() as u64;
        let each = self.nodes * PER_NODE + self.points * 8 * (d * d + 1);
        let springs = if spec.springs.is_some() { self.springs } else { 0 };
        // Cells without a term are numbers of the mesh.
        let each = if terms > 0 { each * terms } else { 4 * self.nodes };
        let of_cells = self.cells.saturating_mul(each);
        self.vertices
            .saturating_mul(d * PER_COORDINATE)
            .saturating_add(of_cells)
            .saturating_add(springs.saturating_mul(PER_SPRING))
    }

    /// Bytes, about, of stresses recovered at the vertices of the body.
    fn recovery_bytes(&self, spec: &Body, scene: &Scene) -> u64 {
        if spec.elastic.is_none() || scene.recovery().is_none() {
            return 0;
        }
        let of_cell = self.points.saturating_mul(RECOVERY_PER_POINT) + RECOVERY_PER_CELL;
        let of_cells = self.cells.saturating_mul(of_cell);
        self.vertices.saturating_mul(RECOVERY_PER_VERTEX).saturating_add(of_cells)
    }
}

/// Bytes of the mutual gravity of this many particles.
fn gravity_bytes(scene: &Scene, particles: u64) -> u64 {
    if scene.world.nbody.is_some() {
        particles.saturating_mul(scene.dimension as u64 * PER_COORDINATE_OF_PARTICLE)
    } else {
        0
    }
}

/// True if the vertices of `body` are particles.
fn has_particles(body: &Body) -> bool {
    body.elastic.is_none() && body.springs.is_none()
}

/// Refuses a scene that asks for more memory than there is.
pub(super) fn check(scene: &Scene) -> Result<(), Vec<Problem>> {
    let (mut total, mut reserved, mut problems) = (0u64, 0u64, vec![]);
    let (mut vertices, mut particles) = (0u64, 0u64);
    for (i, body) in scene.body.iter().enumerate() {
        let path = KeyPath::root().key("body").index(i).key("mesh");
        match predicted_body_size(&body.body_mesh(), scene.dimension, &scene.directory) {
            Ok(size) => {
                let of_body = BodySize::of_mesh(&size, scene.dimension).bytes(body, scene.dimension);
                let recovered = BodySize::of_mesh(&size, scene.dimension).recovery_bytes(body, scene);
                total = total.saturating_add(size.bytes).saturating_add(of_body).saturating_add(recovered);
                reserved = reserved.saturating_add(reserved_bytes(body, &size, scene.dimension));
                vertices = vertices.saturating_add(size.vertices);
                if has_particles(body) {
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

/// Bytes, about, that a run of `scene` takes: its `bodies`, and solvers once steps are taken.
///
/// # Errors
/// Implicit steps would take more memory than there is.
pub(super) fn check_steps(
    scene: &Scene,
    bodies: &[BodyAssembly],
    simulation: &mut Simulation,
) -> Result<usize, Vec<Problem>> {
    let mut held = 0u64;
    for (spec, body) in scene.body.iter().zip(bodies) {
        let size = BodySize::of_body(body, scene.dimension);
        held = held.saturating_add(size.bytes(spec, scene.dimension));
        held = held.saturating_add(size.recovery_bytes(spec, scene));
        if has_particles(spec) {
            held = held.saturating_add(gravity_bytes(scene, body.mass.len() as u64));
        }
    }
    let further = simulation.solver_bytes() as u64;
    let part = if scene.contact.is_some() { PART_OF_CONTACT } else { 0.0 };
    let of_contact = (part * held.saturating_add(further) as f64) as u64;
    let further = further.saturating_add(of_contact);
    match available_memory::available() {
        Some(available) if further > available => Err(vec![too_large(scene, simulation, further, available)]),
        _ => Ok(held.saturating_add(further) as usize),
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
            "use `solver = { linear = \"multigrid\" }`, which takes less than a factorisation, or \
                    \"matrix-free\", which takes almost none",
        )
        .with_help("or fewer cells, an explicit integrator, or a machine with more memory")
}

/// Amount in words: `about 460 MB`, or what there is where it could not be counted.
fn need(further: u64, available: u64) -> String {
    if further < UNCOUNTED {
        format!("about {}", human(further))
    } else {
        format!("more than {}", human(available))
    }
}

/// Bytes of address space that the elements of a body of this size reserve for their forces, and for those of
/// their damping and their muscles.
fn reserved_bytes(body: &Body, size: &MeshSize, dimension: usize) -> u64 {
    let cells = size.triangles.max(size.tetrahedra).max(size.blocks);
    let further = u64::from(body.damping.is_some()) + body.muscle.len() as u64;
    let workspace = match dimension {
        2 => Workspace::<2>::reserved_bytes(cells),
        _ => Workspace::<3>::reserved_bytes(cells),
    };
    if body.elastic.is_some() { workspace * (1 + further) } else { 0 }
}

/// `3.2 GB`, to two digits.
fn human(bytes: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = bytes as f64;
    let mut unit = 0;
    while value >= 995.0 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    match value {
        0.0..9.95 => format!("{value:.1} {}", units[unit]),
        9.95..99.5 => format!("{value:.0} {}", units[unit]),
        _ => format!("{:.0} {}", 10.0 * (value / 10.0).round(), units[unit]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solvers predict half of what can be addressed, or a quarter, where they cannot count.
    #[test]
    fn what_could_not_be_counted_is_more_than_there_is() {
        assert_eq!(need(462_447_000, 151_994_000), "about 460 MB");
        assert_eq!(need(1_249_000_000, 151_994_000), "about 1.2 GB");
        assert_eq!(need(51_994_000, 1), "about 52 MB");
        for uncounted in [usize::MAX / 2 - (1 << 40), usize::MAX / 4 - (1 << 40)] {
            assert_eq!(need(uncounted as u64, 73_261_000), "more than 73 MB");
        }
    }
}
