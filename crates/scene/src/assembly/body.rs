//! Assembly of one body: mesh, masses, pins, initial velocities, springs.

use std::path::Path;

use super::bending::BendingPlan;
use super::loads::{self, LoadPlan};
use super::muscles::{self, MusclePlan};
use super::pins::{self, PinPlan};
use super::{axes, initial, mass};
use crate::{Body, KeyPath, ObstacleShape, OneOrMany, Problem};
use pliant::algebra::Mat;
use pliant::element::{CellBlock, CellVisitor, Isoparametric};
use pliant::numbering::{Numbering, is_local};
use pliant::quantity::counted;
use pliant::system::System;
use pliant::topology::{BodyKind, BodyTopology, Skin};
use pliant_mesh::spec::MeshSpec;
use pliant_mesh::{Mesh, build_body};

/// Contribution of a body to a simulation.
pub(super) struct BodyAssembly {
    pub(super) name: String,
    /// Index of the first vertex in the simulation.
    pub(super) first_vertex: u32,
    pub(super) mesh: Mesh,
    /// True if the surface that the mesh was made from is embedded in it.
    has_skin: bool,
    /// True if the cells are finite elements.
    pub(super) elastic: bool,
    /// Factor of the energy density of each element; empty without `elastic_factor`.
    pub(super) factors: Vec<f64>,
    /// Rotation from the material axes to the space axes for each element; empty without `axes`.
    pub(super) axes: Vec<Mat<f64, 3>>,
    /// True if the body represents an obstacle.
    pub(super) is_obstacle: bool,
    /// Thickness of a membrane [m].
    pub(super) thickness: Option<f64>,
    /// Springs, with vertices numbered from 0.
    pub(super) springs: Vec<[u32; 2]>,
    /// Hinges and joints.
    pub(super) bends: BendingPlan,
    /// Lumped mass of every vertex [kg].
    pub(super) mass: Vec<f64>,
    pub(super) held: Vec<PinPlan>,
    pub(super) loads: Vec<LoadPlan>,
    pub(super) muscles: Vec<MusclePlan>,
    /// Consistent shares in a force per volume: for each vertex its neighbours with `integral of N_a N_b`
    /// [m^d]. Present if a load needs them.
    pub(super) shares: Vec<Vec<(u32, f64)>>,
    /// Initial positions, flat [m].
    pub(super) position: Vec<f64>,
    /// Initial velocities, flat [m/s].
    pub(super) velocity: Vec<f64>,
    /// Spring constants [N/m].
    pub(super) stiffness: Vec<f64>,
    /// Rest lengths of the springs [m].
    pub(super) rest_length: Vec<f64>,
}

impl BodyAssembly {
    pub(super) fn new(
        spec: &Body,
        path: &KeyPath,
        index: usize,
        dimension: usize,
        base: &Path,
        first_vertex: u32,
    ) -> Result<Self, Vec<Problem>> {
        let one = |field: &str, message: String| vec![Problem::semantic(path.key(field), message)];
        let mut mesh =
            build_body(&spec.body_mesh(), dimension, base).map_err(|e| one("mesh", e.to_string()))?;
        // Contact uses the centre or the axis; the mesh around it is only drawn.
        match &spec.obstacle {
            Some(ObstacleShape::Ball(ball)) if dimension == 3 => {
                mesh.points.extend_from_slice(&ball.centre);
            }
            Some(ObstacleShape::Capsule(capsule)) if dimension == 3 => {
                mesh.points.extend(capsule.axis.iter().flatten());
            }
            _ => {}
        }
        let mut problems = vec![];
        // Elements, with their factors and axes.
        let thickness = spec.membrane.as_ref().map(|membrane| membrane.thickness);
        if thickness.is_some() && mesh.element_dimension() != 2 {
            let message =
                "a membrane is made of triangles: the mesh has none, or they are sides of tetrahedra";
            problems.extend(one("membrane", message.into()));
        } else if spec.elastic.is_some() && thickness.is_none() && mesh.element_dimension() != dimension {
            problems.push(no_elements(&mesh, path.key("elastic")));
        }
        let factors = factors(spec, &mesh, path, &mut problems);
        let axes = axes::axes(spec, &mesh, path, &mut problems);
        // Springs and bending.
        let springs = if spec.springs.is_some() { mesh.spring_edges() } else { vec![] };
        if spec.springs.is_some() && springs.is_empty() {
            problems.extend(one("springs", "the mesh has no edges for springs".into()));
        }
        let (stiffness, rest_length) = spec.springs.as_ref().map_or_else(
            || (vec![], vec![]),
            |s| spring_constants(s, &mesh, &springs, &path.key("springs"), &mut problems),
        );
        if let Some(formula) = spec.damping.as_ref().and_then(|damping| damping.expression.as_ref()) {
            let path = path.key("damping").key("expression");
            problems.extend(crate::validate::dashpot_problem(&path, formula, &rest_length));
        }
        let bends = spec.bending.as_ref().map_or_else(BendingPlan::default, |bending| {
            BendingPlan::new(bending, &mesh, &springs, &path.key("bending"), &mut problems)
        });
        // Masses, supports, loads and muscles.
        let mass = mass::masses(&spec.mass, &mesh, thickness, &springs, &path.key("mass"), &mut problems);
        let held = pins::held(spec, &mesh, path, &mut problems);
        let name = spec.name_or_default(index);
        let loads = loads::placed(spec, &name, &mesh, path, &mut problems);
        let muscles = muscles::placed(spec, &mesh, path, &mut problems);
        let by_volume = spec.load.iter().any(|load| load.body_force.is_some());
        let mut shares = if by_volume { mesh.consistent_measure() } else { vec![] };
        shares.iter_mut().flatten().for_each(|(_, share)| *share *= thickness.unwrap_or(1.0));
        // Initial state.
        let position =
            initial::positions(spec.position.as_ref(), &mesh, &path.key("position"), &mut problems);
        let velocity =
            initial::velocities(spec.velocity.as_ref(), &mesh, &mass, &path.key("velocity"), &mut problems);
        if !problems.is_empty() {
            return Err(problems);
        }
        Ok(BodyAssembly {
            name,
            first_vertex,
            mesh,
            has_skin: matches!(&spec.mesh, MeshSpec::Surface(surface) if surface.skin),
            elastic: spec.elastic.is_some(),
            factors,
            axes,
            is_obstacle: spec.obstacle.is_some(),
            thickness,
            springs,
            bends,
            mass,
            held,
            loads,
            muscles,
            shares,
            position,
            velocity,
            stiffness,
            rest_length,
        })
    }

    /// Range of the body's vertices in the simulation.
    pub(super) fn vertices(&self) -> std::ops::Range<u32> {
        self.first_vertex..self.first_vertex + self.mass.len() as u32
    }

    /// Vertices with a constrained coordinate, numbered from 0 in the body, ascending.
    pub(super) fn pinned(&self) -> Vec<u32> {
        let mut pinned: Vec<u32> = self.held.iter().flat_map(|held| held.vertices.iter().copied()).collect();
        pinned.sort_unstable();
        pinned.dedup();
        pinned
    }

    /// Vertices that never move, numbered from 0 in the body, ascending.
    pub(super) fn fixed(&self) -> Vec<u32> {
        let for_ever = |held: &&PinPlan| {
            held.spec.motion.is_none() && held.spec.until.is_none() && held.spec.axes.is_none()
        };
        let mut fixed: Vec<u32> =
            self.held.iter().filter(for_ever).flat_map(|held| held.vertices.iter().copied()).collect();
        fixed.sort_unstable();
        fixed.dedup();
        fixed
    }

    /// Adds the loads on the body to `system`; `rest` holds the reference positions of the whole system,
    /// in its `numbering`.
    pub(super) fn add_loads(&self, rest: &[f64], numbering: &Numbering, system: &mut System) {
        let fixed = if self.loads.is_empty() { vec![] } else { self.fixed() };
        for load in &self.loads {
            system.add_term(load.term(self, &fixed, rest, numbering));
        }
    }

    /// Adds the constraints of the body to `system`; `start` and `rest` hold the initial and reference
    /// positions of the whole system, in its `numbering`.
    pub(super) fn add_holds(&self, start: &[f64], rest: &[f64], numbering: &Numbering, system: &mut System) {
        for held in &self.held {
            let vertices = held.vertices.iter().map(|v| numbering.internal(self.first_vertex + v)).collect();
            system.hold(held.hold(&self.name, vertices, start, rest, self.mesh.dimension));
        }
    }

    /// True for a cloud of particles: no elements and no springs.
    pub(super) fn is_particles(&self) -> bool {
        !self.elastic && self.springs.is_empty() && !self.is_obstacle
    }

    /// True if the vertices of each cell are close in memory.
    pub(super) fn is_numbered_locally(&self) -> bool {
        let (n, d) = (self.mass.len(), self.mesh.element_dimension());
        if let Some(block) = self.mesh.block() {
            return block.kind.visit(LocalityVisitor { block, vertices: n });
        }
        match d {
            3 if self.mesh.order() == 2 => is_local(&self.mesh.elements::<10>(), n, d),
            2 if self.mesh.order() == 2 => is_local(&self.mesh.elements::<6>(), n, d),
            3 => is_local(&self.mesh.tetrahedra, n, d),
            2 => is_local(&self.mesh.triangles, n, d),
            _ => is_local(&self.springs, n, 2),
        }
    }

    /// Topology of the body for readers of the output.
    pub(super) fn topology(&self) -> BodyTopology {
        let kind = match self.mesh.element_dimension() {
            _ if self.is_obstacle => BodyKind::Obstacle,
            _ if self.thickness.is_some() => BodyKind::Membrane,
            d if self.elastic && d == self.mesh.dimension => BodyKind::Solid,
            _ if self.springs.is_empty() => BodyKind::Particles,
            2 => BodyKind::Cloth,
            1 => BodyKind::Strand,
            _ => BodyKind::Springs,
        };
        let triangles =
            || self.mesh.triangles.iter().map(|t| globalised(t, self.first_vertex)).collect::<Vec<_>>();
        let solid = self.mesh.element_dimension() == 3;
        let triangle_middles = if solid { &[] } else { &self.mesh.triangle_middles[..] };
        BodyTopology {
            name: self.name.clone(),
            kind,
            vertices: self.vertices(),
            edges: self.springs.iter().map(|e| globalised(e, self.first_vertex)).collect(),
            // Triangles of a solid only carry its named groups.
            triangles: if solid { vec![] } else { triangles() },
            tetrahedra: self.mesh.tetrahedra.iter().map(|t| globalised(t, self.first_vertex)).collect(),
            triangle_middles: triangle_middles.iter().map(|m| globalised(m, self.first_vertex)).collect(),
            tetrahedron_middles: self
                .mesh
                .tetrahedron_middles
                .iter()
                .map(|m| globalised(m, self.first_vertex))
                .collect(),
            blocks: self.blocks(),
            surface: self.mesh.drawn_triangles().iter().map(|t| globalised(t, self.first_vertex)).collect(),
            skin: self.skin(),
        }
    }

    /// Embedded surface, by vertices of the simulation; `None` if there is none.
    fn skin(&self) -> Option<Skin> {
        let skin = self.mesh.skin.clone().filter(|_| self.has_skin)?;
        Some(Skin { nodes: skin.nodes.iter().map(|node| self.first_vertex + node).collect(), ..skin })
    }

    /// Number of finite elements.
    pub(super) fn element_count(&self) -> usize {
        match (self.elastic, self.mesh.dimension, self.thickness) {
            (false, ..) => 0,
            (true, ..) if self.mesh.block().is_some() => self.mesh.element_count(),
            (true, 3, None) => self.mesh.tetrahedra.len(),
            _ => self.mesh.triangles.len(),
        }
    }

    /// Elements other than simplices, by their vertices in the simulation.
    fn blocks(&self) -> Vec<CellBlock> {
        let global = |block: &CellBlock| CellBlock {
            kind: block.kind,
            vertices: block.vertices.iter().map(|v| self.first_vertex + v).collect(),
        };
        self.mesh.block().map(global).into_iter().collect()
    }

    /// Triangles (3 nodes, second order 6) or tetrahedra (4, 10), by their vertices in the simulation.
    pub(super) fn elements<const N: usize>(&self, numbering: &Numbering) -> Vec<[u32; N]> {
        let cells = self.mesh.elements::<N>();
        cells.iter().map(|cell| renumbered(cell, self.first_vertex, numbering)).collect()
    }
}

/// Checks whether the vertices of each cell are close in memory.
struct LocalityVisitor<'a> {
    block: &'a CellBlock,
    vertices: usize,
}

impl CellVisitor for LocalityVisitor<'_> {
    type Output = bool;

    fn visit<const D: usize, const N: usize>(self, _: &'static Isoparametric<D, N>) -> bool {
        is_local(self.block.of::<N>(), self.vertices, D)
    }
}

/// Problem of a material on a mesh without cells to fill.
fn no_elements(mesh: &Mesh, path: KeyPath) -> Problem {
    let (needs, what) =
        if mesh.dimension == 2 { ("triangles", "a plane") } else { ("tetrahedra", "a solid") };
    if mesh.dimension == 2 || mesh.triangles.is_empty() {
        let message = format!("the mesh has no {needs}; finite elements need {what} mesh");
        return Problem::semantic(path, message);
    }
    let triangles = counted(mesh.triangles.len() as u64, "triangle", "triangles");
    let message = format!(
        "the mesh has no tetrahedra, it is a surface of {triangles}; finite elements need a solid mesh"
    );
    let is_flat = mesh.points.chunks_exact(3).all(|x| x[2] == 0.0);
    let plane = if is_flat { ", as all z here are 0" } else { ", with a mesh whose z are all 0" };
    Problem::semantic(path, message)
        .with_help("for a sheet of finite elements add `membrane = { thickness = \"1 mm\" }` to the body")
        .with_help(format!("or, for a plane scene, `dimension = 2`{plane}"))
        .with_help("or, if it is closed, fill it: `mesh = { surface = { path = .., cells = 24 } }`")
}

fn globalised<const N: usize, const M: usize>(cell: &[u32; M], first: u32) -> [u32; N] {
    let mut global = [0; N];
    for (g, v) in global.iter_mut().zip(cell) {
        *g = first + v;
    }
    global
}

/// Vertices of a cell in the simulation.
pub(super) fn renumbered<const N: usize, const M: usize>(
    cell: &[u32; M],
    first: u32,
    numbering: &Numbering,
) -> [u32; N] {
    globalised(cell, first).map(|v| numbering.internal(v))
}

/// Expands to one value per item; a list must have the right length.
pub(super) fn spread(
    value: &OneOrMany,
    count: usize,
    [one, many]: [&str; 2],
    path: KeyPath,
    problems: &mut Vec<Problem>,
) -> Vec<f64> {
    match value {
        OneOrMany::One(v) => vec![*v; count],
        OneOrMany::Many(values) if values.len() == count => values.clone(),
        OneOrMany::Many(values) => {
            let listed = counted(values.len() as u64, "number", "numbers");
            let message = format!("the list has {listed}, the body has {}", counted(count as u64, one, many));
            problems.push(Problem::semantic(path, message));
            vec![1.0; count]
        }
    }
}

/// Factor of the energy density of each element; empty without `elastic_factor`.
fn factors(spec: &Body, mesh: &Mesh, path: &KeyPath, problems: &mut Vec<Problem>) -> Vec<f64> {
    let Some(factor) = &spec.elastic_factor else { return vec![] };
    let path = path.key("elastic_factor");
    if let Some(block) = mesh.block().filter(|block| block.kind.order() == 1) {
        let message = format!(
            "`elastic_factor` is for triangles, tetrahedra and cells of `order = 2`, and these are {}",
            block.kind.plural
        );
        problems.push(
            Problem::semantic(path, message).with_help("make a body of each stiffness, or add `order = 2`"),
        );
        return vec![];
    }
    spread(factor, mesh.element_count(), ["element", "elements"], path, problems)
}

/// Stiffness `k` [N/m] and rest length [m] of every spring.
fn spring_constants(
    spec: &crate::SpringsSpec,
    mesh: &Mesh,
    springs: &[[u32; 2]],
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> (Vec<f64>, Vec<f64>) {
    let rest = match &spec.rest_length {
        Some(length) => {
            spread(length, springs.len(), ["spring", "springs"], path.key("rest_length"), problems)
        }
        None => {
            springs.iter().map(|&[a, b]| distance(mesh.point(a as usize), mesh.point(b as usize))).collect()
        }
    };
    if let (Some(Ok(formula)), Some(text)) = (spec.formula(), &spec.expression) {
        // Rest lengths of the mesh are first known here.
        if let Some(error) = rest.iter().find_map(|length| formula.check_at_rest(*length).err()) {
            problems.push(crate::validate::spring_problem(path, text, &error));
        }
        let stiffness = rest.iter().map(|length| formula.stiffness_at_rest(*length)).collect();
        return (stiffness, rest);
    }
    let stiffness = match (&spec.stiffness, spec.young) {
        (Some(k), _) => spread(k, springs.len(), ["spring", "springs"], path.key("stiffness"), problems),
        // k = Y l0, as in the lecture's program (lecture 9).
        (None, young) => rest.iter().map(|l0| young.unwrap_or(0.0) * l0).collect(),
    };
    (stiffness, rest)
}

pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
