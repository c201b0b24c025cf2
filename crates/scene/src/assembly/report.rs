//! Report of `pliant check`: the assembled problem in numbers.

use pliant::quantity::{Rounded, counted};
use serde::Serialize;

use super::attachments::AttachmentPlan;
use super::body::BodyAssembly;
use super::contact::ContactSummary;
use crate::{Body, Channel, MassSpec, ObstacleShape, Scene, Stress};
use pliant::control::StepControl;
use pliant::diagnostics::{MEASURES, StabilityLimit};
use pliant::energy::nbody::ForceError;
use pliant::integrator::Documentation;
use pliant::integrator::estimate::Tolerances;
use pliant::lanes;
use pliant::material::{
    AboutPreset, DispersedFibres, EnergyExpression, MaterialSpec, Parameters, Plane, Preset,
};
use pliant::simulation::Simulation;
use pliant_mesh::{Contents, Quality, SurfaceReport};

/// The assembled problem in numbers.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// Title of the scene.
    pub title: Option<String>,
    /// 2 or 3.
    pub dimension: usize,
    /// Vertices of all bodies.
    pub vertices: usize,
    /// Coordinates that can move.
    pub free_coordinates: usize,
    /// Total mass [kg].
    pub mass: f64,
    /// Extent of all bodies along each axis [m].
    pub size: Vec<f64>,
    /// The bodies.
    pub bodies: Vec<BodyReport>,
    /// Bytes, about, that a run takes, those of the solvers of implicit steps included.
    pub bytes: usize,
    /// Name of the scheme.
    pub integrator: &'static str,
    /// Time step [s]; the first to be tried where step sizes follow the error.
    pub step: f64,
    /// Steps to the end of the run; `None` where their size follows the error.
    pub steps: Option<u64>,
    /// How step sizes follow the error; `None` where they are fixed.
    pub step_control: Option<StepControl>,
    /// Frames to be written.
    pub frames: u64,
    /// Walls, which the largest stable step does not account for.
    pub walls: usize,
    /// True if steps are solved.
    pub is_implicit: bool,
    /// True if it finds equilibria.
    #[serde(skip)]
    pub is_static: bool,
    /// The largest stable step and the frequency it comes from; `None` where the scheme is stable at any step
    /// and it was not asked for.
    pub stability: Option<StabilityLimit>,
    /// Error of mutual gravity by a tree at the start, against the sum over all pairs; `None` without a tree.
    pub tree_force_error: Option<ForceError>,
    /// Instruction set of the kernels.
    pub instruction_set: &'static str,
    /// Contact; `None` without `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactSummary>,
    /// Features that the scene uses: each entry is computed, held in memory or written.
    pub uses: Vec<String>,
    /// Features that it does not name, and that therefore cost nothing.
    pub left_out: Vec<String>,
    /// Answers that are likely to be wrong or other than one would think, and what to do about it: walls that
    /// steps do not see, bodies that lock, numbers of models in millimetres, runs of hours.
    pub warnings: Vec<String>,
}

/// One body in numbers.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct BodyReport {
    /// Its name.
    pub name: String,
    /// Vertices.
    pub vertices: usize,
    /// Finite elements.
    pub elements: usize,
    /// Springs.
    pub springs: usize,
    /// Pinned vertices, those with a single pinned coordinate included.
    pub pinned: usize,
    /// Mass [kg].
    pub mass: f64,
    /// Size and quality of the mesh.
    pub quality: Quality,
    /// Cells of each kind, unconnected pieces, results of cleaning.
    pub contents: Contents,
    /// Surface that it was made from.
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
        let (uses, left_out) = uses(scene, bodies, attachments, simulation);
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
    /// Adds what contact is.
    pub(super) fn add_contact(&mut self, contact: Option<ContactSummary>) {
        if let Some(contact) = &contact {
            self.uses.push(contact.described());
            self.warnings.extend(contact.warnings(self.integrator));
        }
        if contact.as_ref().is_none_or(|contact| contact.of_walls) {
            self.left_out.push("contact: no [contact], and bodies pass through each other".into());
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

/// Features that are used and those that are not, each in words.
fn uses(
    scene: &Scene,
    bodies: &[BodyAssembly],
    attachments: &[AttachmentPlan],
    simulation: &Simulation,
) -> (Vec<String>, Vec<String>) {
    let (mut uses, mut left_out) = (vec![], vec![]);
    let mut say = |used: bool, yes: String, no: &str| {
        if used {
            uses.push(yes);
        } else {
            left_out.push(no.to_owned());
        }
    };
    let method = simulation.method().documentation;
    say(true, format!("{}: {} a step", method.name, cost(&method)), "");
    say(bodies.iter().any(|b| b.elastic), "finite elements".into(), "finite elements: no body is `elastic`");
    let quadratic = bodies.iter().any(|b| b.elastic && b.mesh.order() == 2 && b.mesh.block().is_none());
    let points = if simulation.system().dimension() == 2 { 3 } else { 4 };
    say(
        quadratic,
        format!(
            "quadratic elements: the material is evaluated at {} in each{}",
            counted(points as u64, "point", "points"),
            curved(bodies)
        ),
        "quadratic elements: no body has `order = 2`",
    );
    let cells: Vec<String> = bodies.iter().filter_map(whole_cells).collect();
    say(!cells.is_empty(), cells.join("; "), "quadrilaterals and hexahedra: no body has any");
    let membranes: Vec<String> = scene
        .body
        .iter()
        .zip(bodies)
        .filter_map(|(spec, body)| {
            let membrane = spec.membrane.as_ref()?;
            let plane = match membrane.plane_or_default() {
                Plane::Stress => "plane stress: the thickness follows",
                Plane::Strain => "plane strain: the thickness stays",
            };
            Some(format!("`{}` is a membrane, {} m thick, in {plane}", body.name, membrane.thickness))
        })
        .collect();
    say(!membranes.is_empty(), membranes.join("; "), "membranes: no body is one");
    let autodiff = scene.body.iter().any(|b| b.stress == Some(Stress::Autodiff));
    say(
        autodiff,
        "stress by automatic differentiation".into(),
        "automatic differentiation: no body asks for it",
    );
    for (i, body) in scene.body.iter().enumerate() {
        if let Some(MaterialSpec::ExpressedEnergy(energy)) = &body.elastic {
            say(
                true,
                format!("energy of `{}` by its formula: {}", body.name_or_default(i), at_rest(energy)),
                "",
            );
        }
        if let Some(MaterialSpec::HolzapfelGasserOgden(fibres)) = &body.elastic {
            say(
                true,
                format!("fibres of `{}`: {}", body.name_or_default(i), with_fibres_at_rest(fibres)),
                "",
            );
        }
        let mass = if let MassSpec::Preset(preset) = body.mass { Some(preset) } else { None };
        let elastic = body.elastic.as_ref().and_then(MaterialSpec::preset);
        for (preset, what) in [(elastic, "elastic constants"), (mass, "density")] {
            let Some(AboutPreset { name, young, poisson, density, source, .. }) = preset.map(Preset::about)
            else {
                continue;
            };
            let numbers = match what {
                "density" => format!("{density} kg/m^3"),
                _ => {
                    format!(
                        "young {young} Pa, poisson {poisson}, unless given",
                        young = Rounded::<17>(*young)
                    )
                }
            };
            let body = body.name_or_default(i);
            say(true, format!("{what} of `{body}` from the preset {name}: {numbers} ({source})"), "");
        }
    }
    say(bodies.iter().any(|b| !b.springs.is_empty()), "springs".into(), "springs: no body has any");
    let bends: usize = bodies.iter().map(|b| b.bends.count()).sum();
    say(bends > 0, format!("bending at {bends} hinges and joints"), "bending: no body resists it");
    let gravity = super::gravity::named(scene);
    let uniform = match scene.world.gravity_changes() {
        true => "uniform gravity that changes with time: it does work, and energy is not conserved",
        false => "uniform gravity",
    };
    say(gravity.is_some(), uniform.into(), "uniform gravity: none given");
    say(scene.world.nbody.is_some(), mutual_gravity(scene), "mutual gravity: no [world] nbody");
    let held = bodies.iter().filter(|body| !body.is_obstacle);
    let pins = held.map(|body| body.pinned().len()).sum::<usize>();
    let pinned = counted(pins as u64, "pinned vertex", "pinned vertices");
    say(pins > 0, pinned, "pins: no vertex is held");
    let moving: Vec<String> = super::pins::described(bodies, |held| held.motion());
    say(!moving.is_empty(), moving.join("; "), "prescribed motion: no pin moves");
    let released: Vec<String> = super::pins::described(bodies, |held| {
        let fixed = simulation.step_control().is_none();
        held.release(fixed.then(|| simulation.step_size()))
    });
    say(!released.is_empty(), released.join("; "), "release: no pin lets go");
    for body in bodies.iter().filter(|body| !body.axes.is_empty()) {
        say(
            true,
            format!(
                "axes of the material of `{}` in {}",
                body.name,
                counted(body.axes.len() as u64, "element", "elements")
            ),
            "",
        );
    }
    let muscles: Vec<String> = bodies.iter().flat_map(BodyAssembly::described_muscles).collect();
    say(!muscles.is_empty(), muscles.join("; "), "muscles: no body contracts by itself");
    let loads: Vec<String> =
        bodies.iter().flat_map(|body| body.loads.iter().map(|load| load.described(&body.fixed()))).collect();
    say(!loads.is_empty(), loads.join("; "), "loads: no force from outside");
    let ties: Vec<String> = attachments.iter().map(AttachmentPlan::described).collect();
    say(!ties.is_empty(), ties.join("; "), "attachments: nothing is tied to a place or to another body");
    let walls = simulation.system().walls().len();
    let is_half_space = |body: &Body| matches!(body.obstacle, Some(ObstacleShape::HalfSpace(_)));
    // The entry of contact says so of those that are obstacles.
    if !scene.body.iter().any(is_half_space) {
        say(walls > 0, counted(walls as u64, "wall", "walls"), "walls: none, and no test for crossing them");
    }
    let drag = simulation.system().ether_drag();
    say(drag != 0.0, format!("ether drag {drag} 1/s"), "ether drag: none");
    let damping: Vec<String> = simulation.system().dissipation().iter().map(|term| term.name()).collect();
    say(
        !damping.is_empty(),
        damping.join(", "),
        "damping: no body has any, and no force depends on velocities",
    );
    let control = simulation.step_control();
    let along = scene.time.arc_length.as_ref().map(|spec| {
        format!(
            "the path of equilibria by arc length, the first increment of the load factor {}: `t` in \
             formulas is the load factor, and time counts steps",
            spec.first_or_default()
        )
    });
    say(
        control.is_some() || along.is_some(),
        along.or(control.map(|control| follows(control, simulation))).unwrap_or_default(),
        "error estimates, steps that are taken back: the step size is fixed",
    );
    for channel in Channel::ALL {
        // Without contact there is nothing that could be listed.
        let is_about_nothing = *channel == Channel::Contacts && scene.contact.is_none();
        if let Some([with, without]) = channel.sentences().filter(|_| !is_about_nothing) {
            say(scene.output.channels.contains(channel), with.into(), without);
        }
    }
    let measured = scene.output.channels.iter().filter_map(|channel| channel.measure());
    let mut measures: Vec<&str> = measured.map(|measure| measure.name).collect();
    measures.sort_by_key(|name| MEASURES.iter().position(|measure| measure.name == *name));
    say(
        !measures.is_empty(),
        format!("output /elements: {}", measures.join(", ")),
        "output /elements: no deformation, strain or stress of elements is computed",
    );
    let probes = scene.probe.len();
    say(
        probes > 0,
        format!("{} on /probe", counted(probes as u64, "probe", "probes")),
        "probes: no [[probe]]",
    );
    let by_path = scene.time.arc_length.is_some();
    let solver = (method.solves > 0).then(|| match by_path {
        true => "sparse LU of the exact tangent, definite or not".to_owned(),
        false => simulation.linear_solver(),
    });
    say(
        solver.is_some(),
        solver.unwrap_or_default(),
        "stiffness matrix, linear solver, Hessians in a step: the scheme is explicit",
    );
    if method.solves > 0 && control.is_none() && !by_path {
        let retries = scene.time.solver_options().retries;
        say(
            retries > 0,
            format!(
                "steps that are not solved are taken in parts, down to {} s; every one is counted",
                Rounded::<4>(simulation.step_size() * 0.5_f64.powi(retries as i32))
            ),
            "steps in parts: one that is not solved ends the run",
        );
    }
    if scene.study.is_some() {
        left_out.push("the study: a run takes no notice of it, `pliant study` makes it".into());
    }
    (uses, left_out)
}

/// The elasticity of small strains of a formula.
fn at_rest(energy: &EnergyExpression) -> String {
    match energy.lame().map(|lame| lame.young_and_poisson()) {
        Some((young, poisson)) => {
            format!("E = {} Pa and nu = {} at rest", Rounded::<7>(young), Rounded::<6>(poisson))
        }
        None => "not isotropic, and elliptic at rest".to_owned(),
    }
}

/// The elasticity of small strains of a matrix and along its fibres.
fn with_fibres_at_rest(fibres: &DispersedFibres) -> String {
    let (young, poisson) = fibres.matrix().young_and_poisson();
    let along: Vec<String> = (0..fibres.fibres.len())
        .map(|family| format!("{} Pa", Rounded::<7>(fibres.young_along(family))))
        .collect();
    format!(
        "E = {} Pa and nu = {} at rest in the matrix alone, E = {} along stretched fibres",
        Rounded::<7>(young),
        Rounded::<6>(poisson),
        along.join(" and ")
    )
}

/// How step sizes follow the error.
fn follows(control: &StepControl, simulation: &Simulation) -> String {
    if simulation.method().is_static() {
        let StepControl { first, smallest, largest, .. } = *control;
        return format!(
            "increments as large as they can be solved, the first {} s, down to {smallest} s and up to \
             {largest} s; every one that is taken back is counted",
            Rounded::<4>(first.unwrap_or(largest)),
            smallest = Rounded::<4>(smallest),
            largest = Rounded::<4>(largest)
        );
    }
    if simulation.method().has_own_criterion() {
        return format!(
            "step sizes by the scheme's own criterion, steps up to {} s",
            Rounded::<4>(control.largest)
        );
    }
    let Tolerances { position, velocity, relative } = control.tolerances;
    format!(
        "step sizes that follow the error: {position} m and {velocity} m/s + {relative} of the speed in \
         every step, steps up to {} s; every step that is taken back is counted",
        Rounded::<4>(control.largest),
        position = Rounded::<4>(position),
        velocity = Rounded::<4>(velocity),
        relative = Rounded::<17>(relative)
    )
}

/// Cost of a step.
fn cost(method: &Documentation) -> String {
    match method.solves {
        0 if method.force_evaluations == 0 => "some iterations of seven force evaluations".into(),
        0 => counted(method.force_evaluations.into(), "force evaluation", "force evaluations"),
        solves => counted(solves.into(), "nonlinear solve", "nonlinear solves"),
    }
}

/// Cells of a body of cells that are no simplices.
fn whole_cells(body: &BodyAssembly) -> Option<String> {
    let block = body.mesh.block().filter(|_| body.elastic)?;
    let how = match block.kind.order() {
        1 => "once in each, beside an energy of its hourglass modes".into(),
        _ => {
            let points = counted(block.kind.quadrature_points() as u64, "point", "points");
            format!("at {points} in each")
        }
    };
    Some(format!("{} in `{}`: the material is evaluated {how}", block.kind.plural, body.name))
}

/// The most curved element of all bodies, if any side is.
fn curved(bodies: &[BodyAssembly]) -> String {
    let of_body = |b: &BodyAssembly| Some((b.mesh.quality().elements?.curved?, b.name.clone()));
    let worst =
        bodies.iter().filter_map(of_body).min_by(|a, b| a.0.least_jacobian.total_cmp(&b.0.least_jacobian));
    match worst {
        Some((curved, body)) if curved.least_jacobian < 1.0 => format!(
            "; sides are curved: det J falls to {:.3} of its mean in element {} of `{body}`",
            curved.least_jacobian, curved.worst
        ),
        _ => String::new(),
    }
}

fn mutual_gravity(scene: &Scene) -> String {
    match scene.world.nbody.as_ref().and_then(|nbody| nbody.tree.as_ref()) {
        Some(tree) => {
            format!("mutual gravity of particles, by a tree of opening angle {}", tree.opening_angle)
        }
        None => "mutual gravity of particles, every pair".into(),
    }
}
