//! Report of `pliant check`: the assembled problem in numbers.

use serde::Serialize;

use super::attachments::AttachmentPlan;
use super::body::BodyAssembly;
use super::contact::ContactSummary;
use super::features::{self, AssembledScene, FeatureSentences};
use crate::Scene;
use pliant::control::StepControl;
use pliant::diagnostics::StabilityLimit;
use pliant::energy::nbody::ForceError;
use pliant::lanes;
use pliant::simulation::Simulation;
use pliant_mesh::{Contents, Quality, SurfaceReport};

/// The assembled problem in numbers.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// Title of the scene.
    pub title: Option<String>,
    /// Dimension of the scene, 2 or 3.
    pub dimension: usize,
    /// Number of vertices of all bodies.
    pub vertices: usize,
    /// Number of free coordinates.
    pub free_coordinates: usize,
    /// Total mass [kg].
    pub mass: f64,
    /// Extent of all bodies along each axis [m].
    pub size: Vec<f64>,
    /// The bodies.
    pub bodies: Vec<BodyReport>,
    /// Memory while running, about [bytes], including the solvers of implicit steps.
    pub bytes: usize,
    /// Name of the integrator.
    pub integrator: &'static str,
    /// Time step [s]; with adaptive step sizes the first one.
    pub step: f64,
    /// Number of steps of the run; `None` with adaptive step sizes.
    pub steps: Option<u64>,
    /// Step size control; `None` for a fixed step size.
    pub step_control: Option<StepControl>,
    /// Number of frames to be written.
    pub frames: u64,
    /// Number of walls, which the largest stable step does not include.
    pub walls: usize,
    /// True if steps are implicit.
    pub is_implicit: bool,
    /// True for statics.
    #[serde(skip)]
    pub is_static: bool,
    /// Largest stable step and the frequency that limits it; `None` if the integrator is stable at any
    /// step and the limit was not requested.
    pub stability: Option<StabilityLimit>,
    /// Force error of the gravity tree at the start, relative to the sum over all pairs; `None` without a
    /// tree.
    pub tree_force_error: Option<ForceError>,
    /// Instruction set of the kernels.
    pub instruction_set: &'static str,
    /// Contact; `None` without `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactSummary>,
    /// Active features: each entry is computed, held in memory or written.
    pub uses: Vec<String>,
    /// Inactive features, which cost nothing.
    pub left_out: Vec<String>,
    /// Warnings of results that are likely wrong or unexpected, with remedies: walls that steps do not
    /// see, bodies that lock, values in millimetres, runs of hours.
    pub warnings: Vec<String>,
}

/// One body in numbers.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct BodyReport {
    /// Name of the body.
    pub name: String,
    /// Number of vertices.
    pub vertices: usize,
    /// Number of finite elements.
    pub elements: usize,
    /// Number of springs.
    pub springs: usize,
    /// Number of vertices with at least one constrained coordinate.
    pub pinned: usize,
    /// Mass [kg].
    pub mass: f64,
    /// Size and quality of the mesh.
    pub quality: Quality,
    /// Cells of each kind, unconnected pieces, results of cleaning.
    pub contents: Contents,
    /// Surface that the body was made from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceReport>,
}

impl Report {
    pub(super) fn new(
        scene: &Scene,
        simulation: &Simulation,
        bodies: &[BodyAssembly],
        attachments: &[AttachmentPlan],
        stability: Option<StabilityLimit>,
        tree_force_error: Option<ForceError>,
        bytes: usize,
    ) -> Self {
        let system = simulation.system();
        let d = system.dimension();
        let free = system.inverse_mass().iter().filter(|w| **w > 0.0).count();
        let plan = scene.plan();
        let (h, control) = (simulation.step_size(), simulation.step_control().copied());
        let of = AssembledScene { scene, bodies, attachments, simulation };
        let FeatureSentences { uses, left_out } = features::sentences(of);
        let of_bodies: Vec<BodyReport> = bodies.iter().map(BodyReport::new).collect();
        let of_surfaces = super::surfaces::warnings(scene, &of_bodies);
        Report {
            title: scene.title.clone(),
            dimension: d,
            vertices: system.mass().len(),
            free_coordinates: free,
            mass: system.mass().iter().sum(),
            size: extent(simulation.state().x(), d),
            bodies: of_bodies,
            bytes,
            integrator: simulation.method().documentation.name,
            step: h,
            steps: control.is_none().then(|| plan.steps(h)),
            frames: if control.is_some() { plan.exact_frames() } else { plan.frames(h) },
            step_control: control,
            walls: system.walls().len(),
            is_implicit: simulation.method().documentation.solves > 0,
            is_static: simulation.method().is_static(),
            stability,
            tree_force_error,
            contact: None,
            instruction_set: lanes::level().name(),
            uses,
            left_out,
            warnings: [
                of_surfaces,
                super::warnings::warnings(scene, simulation, bodies),
                super::locking::warnings(scene, bodies),
                super::millimetres::warnings(scene, bodies),
                super::duration::warnings(scene, simulation, bodies),
                super::formulas::warnings(scene, simulation, bodies),
                super::rounding::warnings(scene, simulation),
            ]
            .concat(),
        }
    }
}

impl Report {
    /// Adds the summary of contact.
    pub(super) fn add_contact(&mut self, contact: Option<ContactSummary>) {
        if let Some(contact) = &contact {
            self.uses.push(contact.described());
            self.warnings.extend(contact.warnings(self.integrator));
        }
        if contact.as_ref().is_none_or(|contact| contact.of_walls) {
            self.left_out.push("contact: no [contact], so bodies can interpenetrate".into());
        }
        self.contact = contact;
    }
}

impl BodyReport {
    fn new(body: &BodyAssembly) -> Self {
        let mesh = &body.mesh;
        BodyReport {
            name: body.name.clone(),
            vertices: body.mass.len(),
            elements: body.element_count(),
            springs: body.springs.len(),
            pinned: body.pinned().len(),
            mass: body.mass.iter().sum(),
            quality: mesh.quality(),
            contents: mesh.contents(),
            surface: mesh.surface_report(),
        }
    }
}

fn extent(x: &[f64], d: usize) -> Vec<f64> {
    let component = |c: usize| x.iter().skip(c).step_by(d).copied();
    let range =
        |c| component(c).fold(f64::NEG_INFINITY, f64::max) - component(c).fold(f64::INFINITY, f64::min);
    (0..d).map(range).collect()
}
