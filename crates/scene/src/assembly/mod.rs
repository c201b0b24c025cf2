//! Assembly of a simulation from a scene: meshes, lumped masses, energy terms, the check of the step.
//!
//! The dimension of a scene becomes a type here only; boxed terms hide it again.

mod attachments;
mod axes;
mod bending;
mod body;
mod contact;
mod damping;
mod driven;
mod duration;
mod features;
mod formulas;
mod gravity;
mod initial;
mod left_out;
mod loads;
mod locking;
mod mass;
mod meeting;
mod memory;
mod millimetres;
mod muscles;
mod obstacles;
mod pins;
mod places;
mod probes;
mod report;
mod rounding;
mod step_control;
mod surfaces;
mod terms;
mod warnings;

use pliant::quantity::{Rounded, Seconds};
use std::path::Path;

use crate::Body;
use crate::KeyPath;
use crate::Problem;
use crate::Scene;
use crate::Tree;
use pliant::constraint::Wall;
use pliant::diagnostics::StabilityLimit;
use pliant::numbering::Numbering;
use pliant::probe::Probe;
use pliant::run::Plan;
use pliant::simulation::Simulation;
use pliant::solver::{LinearSolver, SolverOptions};
use pliant::state::State;
use pliant::system::System;
use pliant::topology::Topology;
use pliant_terms::{direct_gravity, tree_gravity};

pub use contact::{CONTACT_PART_OF_BODY, CONTACT_PART_OF_EDGE, ContactSummary, advice_on_gain};
pub use meeting::{first_meeting, passes_through};
pub use places::{LoadedVertices, PinnedVertices, ScenePlaces, TiedPoints};
pub use report::{BodyReport, Report};

/// A simulation ready to run, with its topology, probes and report.
pub struct Assembly {
    /// The simulation.
    pub simulation: Simulation,
    /// Bodies and their cells.
    pub topology: Topology,
    /// Probes of the scene.
    pub probes: Vec<Probe>,
    /// Report: counts, sizes, the stability limit, inactive features.
    pub report: Report,
}

/// Treatment of a scene whose step exceeds the stability limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnstableStep {
    /// Reject it, unless the scene says `allow_unstable`: for running.
    Refuse,
    /// Accept it: for inspection.
    Accept,
}

impl Scene {
    /// Builds the simulation of this scene.
    ///
    /// # Errors
    /// Every problem with a mesh, a selection or a mass; without any, a time step above the stability
    /// limit.
    pub fn assemble(&self, unstable: UnstableStep) -> Result<Assembly, Vec<Problem>> {
        let scene = self.with_obstacles();
        match self.dimension {
            2 => assemble::<2, 3>(&scene, unstable),
            3 => assemble::<3, 4>(&scene, unstable),
            d => Err(vec![Problem::semantic(
                KeyPath::root().key("dimension"),
                format!("dimension is {d}; it is 2 or 3"),
            )]),
        }
    }

    /// Problem of a time step above this limit; `None` if the step is stable or the scene allows it.
    pub fn unstable_step(&self, stability: &StabilityLimit) -> Option<Problem> {
        // Adaptive step sizes correct a step that is too large.
        let step = self.time.step.filter(|step| !self.time.allow_unstable && *step > stability.step)?;
        Some(unstable_step(self, step, stability))
    }

    /// Duration and frame rate of this scene.
    pub fn plan(&self) -> Plan {
        Plan { duration: self.time.duration, rate: self.output.rate }
    }
}

fn assemble<const D: usize, const N: usize>(
    scene: &Scene,
    unstable: UnstableStep,
) -> Result<Assembly, Vec<Problem>> {
    memory::check(scene)?;
    let bodies = build_bodies(scene, &scene.directory)?;
    left_out::check(scene, &bodies)?;
    let jumps = pins::jumps_at_start(&bodies, D);
    if !jumps.is_empty() {
        return Err(jumps);
    }
    let (probes, points) = probes::probes::<D, N>(scene, &bodies)?;
    let numbering = numbering::<D>(&bodies);
    let gathered = |rows: fn(&body::BodyAssembly) -> &[f64], width| {
        let rows: Vec<f64> = bodies.iter().flat_map(rows).copied().collect();
        numbering.to_internal(&rows, width).into_owned()
    };
    let rest = gathered(|b| &b.mesh.points, D);
    let (position, velocity) = (gathered(|b| &b.position, D), gathered(|b| &b.velocity, D));
    let attachments = attachments::attachments(scene, &bodies, &numbering, &position)?;

    let mut system = System::new(D, gathered(|b| &b.mass, 1));
    let weights = || {
        let of_body =
            |(body, spec): (&body::BodyAssembly, &Body)| mass::weights(&spec.mass, &body.mesh, &body.mass);
        let weights: Vec<f64> = bodies.iter().zip(&scene.body).flat_map(of_body).collect();
        numbering.to_internal(&weights, 1).into_owned()
    };
    if let Some(gravity) = gravity::term(scene, system.mass(), weights) {
        system.add_term(gravity);
    }
    for (body, spec) in bodies.iter().zip(&scene.body) {
        body.add_terms::<D, N>(spec, &rest, &numbering, &mut system);
        body.add_damping::<D, N>(spec, &rest, &numbering, &mut system);
        body.add_holds(&position, &rest, &numbering, &mut system);
        body.add_loads(&rest, &numbering, &mut system);
        body.add_muscles::<D, N>(scene.time.duration, &rest, &numbering, &mut system);
    }
    attachments.iter().for_each(|attachment| attachment.add_to(&mut system));
    let mut force_error = None;
    if let Some(nbody) = &scene.world.nbody {
        let particles = bodies.iter().filter(|b| b.is_particles());
        // Bodies without cells are not renumbered.
        let vertices: Vec<u32> = particles.flat_map(|b| b.vertices()).collect();
        let mass = vertices.iter().map(|&v| system.mass()[v as usize]).collect();
        let (particles, constants) = ((vertices, mass), (nbody.constant, nbody.softening));
        if let Some(Tree { opening_angle }) = nbody.tree {
            let (tree, error) = tree_gravity(D, particles, constants, opening_angle, &position);
            force_error = Some(error);
            system.add_term(tree);
        } else {
            system.add_term(direct_gravity(D, particles, constants));
        }
    }
    for wall in &scene.world.walls {
        system.add_wall(Wall::new(&wall.normal, wall.offset));
    }
    let contact = contact::add::<D>(
        scene,
        &bodies,
        &numbering,
        (&rest, &position, &velocity),
        &mut system,
        // Running a scene does not need the summary of contact at the start.
        unstable == UnstableStep::Accept,
    )?;
    system.set_ether_drag(scene.world.ether_drag.unwrap_or(0.0));

    let method = scene.time.integrator.method();
    let size = contact.as_ref().map(|contact| contact.size);
    let options = SolverOptions { size, ..scene.time.solver_options() };
    // Multigrid lattices and the elimination order of a factorisation use the reference positions.
    if method.documentation.solves > 0 && options.linear.choose(&system) != LinearSolver::MatrixFree {
        system.set_rest_positions(rest);
    }

    let state = State::new(position, velocity);
    let mut simulation = Simulation::new(system, state, method, step_control::step(scene));
    simulation.set_numbering(numbering);
    simulation.set_points(points);
    simulation.set_solver(options);
    if let Some(problem) = loose_tolerance(scene, simulation.length_scale()) {
        return Err(vec![problem]);
    }
    step_control::add(scene, &mut simulation);
    // For an integrator that is stable at any step the limit is computed only on inspection.
    let limited = scene.time.step.is_some() && simulation.method().documentation.stability_limit.is_finite();
    let stability = (limited || unstable == UnstableStep::Accept)
        .then(|| simulation.stability_limit(scene.time.duration))
        // A simulation under construction is never interrupted.
        .and_then(Result::ok);
    if unstable == UnstableStep::Refuse
        && let Some(stability) = &stability
        && let Some(problem) = scene.unstable_step(stability)
    {
        return Err(vec![problem]);
    }
    let bytes = memory::check_steps(scene, &bodies, &mut simulation)?;
    let mut report = Report::new(scene, &simulation, &bodies, &attachments, stability, force_error, bytes);
    report.add_contact(contact);
    let topology = Topology {
        dimension: D,
        vertex_count: simulation.system().mass().len(),
        masses: bodies.iter().flat_map(|b| b.mass.iter().copied()).collect(),
        bodies: bodies.iter().map(body::BodyAssembly::topology).collect(),
        rest_positions: bodies.into_iter().flat_map(|b| b.mesh.points).collect(),
    };
    if let Some(recovery) = scene.recovery() {
        simulation.set_recovery(recovery, topology.rest_positions.clone());
    }
    Ok(Assembly { simulation, topology, probes, report })
}

/// Largest useful tolerance of Newton's method, as a fraction of the size of the scene: above it the
/// iteration ends while the bodies still move.
const LARGEST_TOLERANCE: f64 = 1e-2;
/// Suggested tolerance, as a fraction of that size.
const GOOD_TOLERANCE: f64 = 1e-6;

/// Problem of a tolerance that is too large for a scene of this `size` [m]; `None` if it is not.
fn loose_tolerance(scene: &Scene, size: f64) -> Option<Problem> {
    let tolerance = scene.time.solver.as_ref()?.tolerance.filter(|t| *t > LARGEST_TOLERANCE * size)?;
    let path = KeyPath::root().key("time").key("solver").key("tolerance");
    let message = format!(
        "`tolerance` is too large: Newton's method would stop at updates of {tolerance} m, in a scene of \
         {size} m",
        tolerance = Rounded::<17>(tolerance),
        size = Rounded::<4>(size)
    );
    let advice = format!("give {} or less, or remove it", Rounded::<1>(GOOD_TOLERANCE * size));
    Some(Problem::semantic(path, message).with_help(advice))
}

/// Renumbers the bodies whose neighbouring vertices have distant numbers.
fn numbering<const D: usize>(bodies: &[body::BodyAssembly]) -> Numbering {
    let count = bodies.iter().map(|b| b.mass.len()).sum();
    let mut numbering = Numbering::identity();
    for body in bodies.iter().filter(|b| !b.is_numbered_locally()) {
        numbering.renumber::<D>(body.vertices(), count, &body.mesh.points);
    }
    numbering
}

fn build_bodies(scene: &Scene, base: &Path) -> Result<Vec<body::BodyAssembly>, Vec<Problem>> {
    let (mut bodies, mut problems, mut first_vertex) = (vec![], vec![], 0u32);
    for (i, spec) in scene.body.iter().enumerate() {
        let path = KeyPath::root().key("body").index(i);
        match body::BodyAssembly::new(spec, &path, i, scene.dimension, base, first_vertex) {
            Ok(body) => {
                first_vertex += body.mass.len() as u32;
                bodies.push(body);
            }
            Err(found) => problems.extend(found),
        }
    }
    if problems.is_empty() { Ok(bodies) } else { Err(problems) }
}

/// Text for the effect of damping on the limit.
fn strongest_damping(stability: &StabilityLimit) -> String {
    if stability.damping > 0.0 {
        format!(", damped at up to {} 1/s", Rounded::<5>(stability.damping))
    } else {
        String::new()
    }
}

fn unstable_step(scene: &Scene, step: f64, stability: &StabilityLimit) -> Problem {
    let name = scene.time.integrator.method().documentation.name;
    let limit = stability.step;
    let path = KeyPath::root().key("time").key("step");
    let message = if stability.grows_at_any_step {
        format!(
            "{name} gains energy at any step; at {} its highest mode, {} rad/s, more than doubles in {} s",
            Seconds(step),
            Rounded::<4>(stability.frequency),
            scene.time.duration
        )
    } else {
        format!(
            "a step of {} is unstable for {name}: the highest natural frequency, {} rad/s{}, allows at \
             most {}",
            Seconds(step),
            Rounded::<4>(stability.frequency),
            strongest_damping(stability),
            Seconds(limit)
        )
    };
    // A step slightly below the limit, rounded down to two digits.
    let digits = 10f64.powf((0.98 * limit).log10().floor() - 1.0);
    let advice = format!("use `step = {}`", Rounded::<2>(((0.98 * limit) / digits).floor() * digits));
    let other = "or set `allow_unstable = true` in [time] to watch it blow up".to_string();
    let mut problem = Problem::semantic(path, message).with_help(advice);
    if stability.grows_at_any_step {
        problem = problem.with_help("or an integrator that does not: symplectic-euler costs the same");
    }
    problem.with_help(other)
}
