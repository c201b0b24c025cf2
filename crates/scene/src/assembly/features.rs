//! What `pliant check` says of each feature: that a scene uses it, or that it leaves it out.
//!
//! A feature is a function and a line of [`FEATURES`], in the order of the sentences.

use super::attachments::AttachmentPlan;
use super::body::BodyAssembly;
use super::pins;
use crate::{Body, Channel, MassSpec, ObstacleShape, ProbeSpec, Scene, Stress};
use pliant::control::StepControl;
use pliant::diagnostics::recovery::Recovery;
use pliant::diagnostics::{FieldRows, RecordedField};
use pliant::integrator::Documentation;
use pliant::integrator::estimate::Tolerances;
use pliant::material::{
    AboutPreset, DispersedFibres, EnergyExpression, MaterialSpec, Parameters, Plane, Preset,
};
use pliant::quantity::{Rounded, Seconds, counted};
use pliant::simulation::Simulation;

/// A scene and what became of it.
#[derive(Clone, Copy)]
pub(super) struct AssembledScene<'a> {
    pub(super) scene: &'a Scene,
    pub(super) bodies: &'a [BodyAssembly],
    pub(super) attachments: &'a [AttachmentPlan],
    pub(super) simulation: &'a Simulation,
}

/// Sentences on features that a scene uses, and on those that it leaves out.
#[derive(Default)]
pub(super) struct FeatureSentences {
    pub(super) uses: Vec<String>,
    pub(super) left_out: Vec<String>,
}

/// The features, in the order of their sentences.
const FEATURES: &[fn(AssembledScene<'_>) -> FeatureSentences] = &[
    scheme,
    finite_elements,
    quadratic_elements,
    whole_cells,
    membranes,
    automatic_differentiation,
    materials,
    springs,
    bending,
    uniform_gravity,
    mutual_gravity,
    pinned,
    prescribed_motion,
    releases,
    material_axes,
    muscles,
    loads,
    attachments,
    walls,
    drag,
    damping,
    step_sizes,
    channels,
    measures,
    recovery,
    probes,
    linear_solver,
    steps_in_parts,
    study,
];

/// Returns the sentences on all features.
pub(super) fn sentences(of: AssembledScene<'_>) -> FeatureSentences {
    let mut all = FeatureSentences::default();
    for feature in FEATURES {
        let FeatureSentences { uses, left_out } = feature(of);
        all.uses.extend(uses);
        all.left_out.extend(left_out);
    }
    all
}

/// Says `yes` of a feature that is used, `no` otherwise.
fn either(yes: Option<impl Into<String>>, no: &str) -> FeatureSentences {
    match yes {
        Some(yes) => always(vec![yes.into()]),
        None => FeatureSentences { uses: vec![], left_out: vec![no.to_owned()] },
    }
}

/// Says what is found of a feature in one sentence, `no` if nothing is.
fn listed(found: Vec<String>, no: &str) -> FeatureSentences {
    either((!found.is_empty()).then(|| found.join("; ")), no)
}

/// Says nothing of what is left out.
fn always(uses: Vec<String>) -> FeatureSentences {
    FeatureSentences { uses, left_out: vec![] }
}

fn scheme(of: AssembledScene<'_>) -> FeatureSentences {
    let method = of.simulation.method().documentation;
    always(vec![format!("{}: {} a step", method.name, cost(&method))])
}

fn finite_elements(of: AssembledScene<'_>) -> FeatureSentences {
    let any = of.bodies.iter().any(|body| body.elastic);
    either(any.then_some("finite elements"), "finite elements: no body is `elastic`")
}

fn quadratic_elements(of: AssembledScene<'_>) -> FeatureSentences {
    let is_quadratic = |b: &BodyAssembly| b.elastic && b.mesh.order() == 2 && b.mesh.block().is_none();
    let points = if of.simulation.system().dimension() == 2 { 3 } else { 4 };
    let sentence = || {
        format!(
            "quadratic elements: the material is evaluated at {} in each{}",
            counted(points, "point", "points"),
            curved(of.bodies)
        )
    };
    let any = of.bodies.iter().any(is_quadratic);
    either(any.then(sentence), "quadratic elements: no body has `order = 2`")
}

/// The cells that are not simplices.
fn whole_cells(of: AssembledScene<'_>) -> FeatureSentences {
    let of_body = |body: &BodyAssembly| {
        let block = body.mesh.block().filter(|_| body.elastic)?;
        let how = match block.kind.order() {
            1 => "once in each, with hourglass stabilisation".into(),
            _ => {
                let points = counted(block.kind.quadrature_points() as u64, "point", "points");
                format!("at {points} in each")
            }
        };
        Some(format!("{} in `{}`: the material is evaluated {how}", block.kind.plural, body.name))
    };
    let found = of.bodies.iter().filter_map(of_body).collect();
    listed(found, "quadrilaterals and hexahedra: no body uses them")
}

fn membranes(of: AssembledScene<'_>) -> FeatureSentences {
    let of_body = |(spec, body): (&Body, &BodyAssembly)| {
        let membrane = spec.membrane.as_ref()?;
        let plane = match membrane.plane_or_default() {
            Plane::Stress => "plane stress: the thickness follows",
            Plane::Strain => "plane strain: the thickness stays",
        };
        Some(format!("`{}` is a membrane, {} m thick, in {plane}", body.name, membrane.thickness))
    };
    let found = of.scene.body.iter().zip(of.bodies).filter_map(of_body).collect();
    listed(found, "membranes: no body has `membrane`")
}

fn automatic_differentiation(of: AssembledScene<'_>) -> FeatureSentences {
    let any = of.scene.body.iter().any(|body| body.stress == Some(Stress::Autodiff));
    let yes = any.then_some("stress by automatic differentiation");
    either(yes, "automatic differentiation: no body has `stress = \"autodiff\"`")
}

/// Formulas, fibres and presets of the bodies.
fn materials(of: AssembledScene<'_>) -> FeatureSentences {
    let mut uses = vec![];
    for (i, body) in of.scene.body.iter().enumerate() {
        let name = body.name_or_default(i);
        match &body.elastic {
            Some(MaterialSpec::ExpressedEnergy(energy)) => {
                uses.push(format!("energy of `{name}` by its formula: {}", at_rest(energy)));
            }
            Some(MaterialSpec::HolzapfelGasserOgden(fibres)) => {
                uses.push(format!("fibres of `{name}`: {}", with_fibres_at_rest(fibres)));
            }
            _ => {}
        }
        if let Some(preset) = body.elastic.as_ref().and_then(MaterialSpec::preset) {
            let AboutPreset { name: material, young, poisson, source, .. } = preset.about();
            let young = Rounded::<17>(*young);
            uses.push(format!(
                "elastic constants of `{name}` from the preset {material}: young {young} Pa, poisson \
                 {poisson}, unless given ({source})"
            ));
        }
        if let MassSpec::Preset(preset) = body.mass {
            let AboutPreset { name: material, density, source, .. } = Preset::about(preset);
            uses.push(format!("density of `{name}` from the preset {material}: {density} kg/m^3 ({source})"));
        }
    }
    always(uses)
}

fn springs(of: AssembledScene<'_>) -> FeatureSentences {
    let any = of.bodies.iter().any(|body| !body.springs.is_empty());
    either(any.then_some("springs"), "springs: none")
}

fn bending(of: AssembledScene<'_>) -> FeatureSentences {
    let bends: usize = of.bodies.iter().map(|body| body.bends.count()).sum();
    let yes = (bends > 0).then(|| format!("bending at {bends} hinges and joints"));
    either(yes, "bending: no body has bending stiffness")
}

fn uniform_gravity(of: AssembledScene<'_>) -> FeatureSentences {
    let yes = super::gravity::named(of.scene).map(|_| match of.scene.world.gravity_changes() {
        true => "uniform gravity that changes with time: it does work, and energy is not conserved",
        false => "uniform gravity",
    });
    either(yes, "uniform gravity: none")
}

fn mutual_gravity(of: AssembledScene<'_>) -> FeatureSentences {
    let yes = of.scene.world.nbody.as_ref().map(|nbody| match &nbody.tree {
        Some(tree) => {
            format!("mutual gravity of particles, by a tree of opening angle {}", tree.opening_angle)
        }
        None => "mutual gravity of particles, every pair".into(),
    });
    either(yes, "mutual gravity: no [world] nbody")
}

fn pinned(of: AssembledScene<'_>) -> FeatureSentences {
    let held = of.bodies.iter().filter(|body| !body.is_obstacle);
    let pins = held.map(|body| body.pinned().len()).sum::<usize>() as u64;
    either((pins > 0).then(|| counted(pins, "pinned vertex", "pinned vertices")), "pins: no vertex is pinned")
}

fn prescribed_motion(of: AssembledScene<'_>) -> FeatureSentences {
    listed(pins::described(of.bodies, |held| held.motion()), "prescribed motion: none")
}

fn releases(of: AssembledScene<'_>) -> FeatureSentences {
    let found = pins::described(of.bodies, |held| {
        let fixed = of.simulation.step_control().is_none();
        held.release(fixed.then(|| of.simulation.step_size()))
    });
    listed(found, "timed releases: none")
}

fn material_axes(of: AssembledScene<'_>) -> FeatureSentences {
    let turned = of.bodies.iter().filter(|body| !body.axes.is_empty());
    let sentence = |body: &BodyAssembly| {
        let elements = counted(body.axes.len() as u64, "element", "elements");
        format!("axes of the material of `{}` in {elements}", body.name)
    };
    always(turned.map(sentence).collect())
}

fn muscles(of: AssembledScene<'_>) -> FeatureSentences {
    let found = of.bodies.iter().flat_map(BodyAssembly::described_muscles).collect();
    listed(found, "muscles: none")
}

fn loads(of: AssembledScene<'_>) -> FeatureSentences {
    let of_body = |body: &BodyAssembly| -> Vec<String> {
        body.loads.iter().map(|load| load.described(&body.fixed())).collect()
    };
    listed(of.bodies.iter().flat_map(of_body).collect(), "loads: none")
}

fn attachments(of: AssembledScene<'_>) -> FeatureSentences {
    let found = of.attachments.iter().map(AttachmentPlan::described).collect();
    listed(found, "attachments: none")
}

fn walls(of: AssembledScene<'_>) -> FeatureSentences {
    let is_half_space = |body: &Body| matches!(body.obstacle, Some(ObstacleShape::HalfSpace(_)));
    // The entry of contact describes those that are obstacles.
    if of.scene.body.iter().any(is_half_space) {
        return FeatureSentences::default();
    }
    let walls = of.simulation.system().walls().len() as u64;
    let yes = (walls > 0).then(|| counted(walls, "wall", "walls"));
    either(yes, "walls: none")
}

fn drag(of: AssembledScene<'_>) -> FeatureSentences {
    let drag = of.simulation.system().ether_drag();
    either((drag != 0.0).then(|| format!("ether drag {drag} 1/s")), "ether drag: none")
}

fn damping(of: AssembledScene<'_>) -> FeatureSentences {
    let names: Vec<String> = of.simulation.system().dissipation().iter().map(|term| term.name()).collect();
    let yes = (!names.is_empty()).then(|| names.join(", "));
    either(yes, "damping: none")
}

fn step_sizes(of: AssembledScene<'_>) -> FeatureSentences {
    let along = of.scene.time.arc_length.as_ref().map(|spec| {
        format!(
            "arc-length continuation, the first increment of the load factor {}: `t` in formulas is the load \
             factor, and time counts steps",
            spec.first_or_default()
        )
    });
    let control = || of.simulation.step_control().map(|control| follows(control, of.simulation));
    either(along.or_else(control), "error estimates, rejected steps: the step size is fixed")
}

fn channels(of: AssembledScene<'_>) -> FeatureSentences {
    let mut said = FeatureSentences::default();
    for channel in Channel::ALL {
        // Without contact these channels have nothing to list.
        let is_about_nothing = channel.is_of_contact() && of.scene.contact.is_none();
        if let Some([with, without]) = channel.sentences().filter(|_| !is_about_nothing) {
            let is_named = of.scene.output.channels.contains(channel);
            let list = if is_named { &mut said.uses } else { &mut said.left_out };
            list.push(if is_named { with } else { without }.into());
        }
    }
    said
}

fn measures(of: AssembledScene<'_>) -> FeatureSentences {
    let yes = fields(of, FieldRows::Elements).map(|names| format!("output /elements: {names}"));
    either(yes, "output /elements: no strain or stress of elements is computed")
}

fn recovery(of: AssembledScene<'_>) -> FeatureSentences {
    let yes = of.scene.recovery().map(|recovery| {
        let how = match recovery {
            Recovery::Patch => "by superconvergent patches",
            Recovery::Average => "by averages",
            Recovery::Element => "in each element",
        };
        let names = fields(of, FieldRows::Vertices).map(|names| format!(", output /vertices: {names}"));
        format!("stress recovered at vertices {how}{}", names.unwrap_or_default())
    });
    either(yes, "recovery: no stress at vertices is computed")
}

/// Names of the recorded fields without a sentence of their own, in the order of their list; `None` without
/// any.
fn fields(of: AssembledScene<'_>, rows: FieldRows) -> Option<String> {
    let is_asked = |field: &RecordedField| {
        let is_of = |channel: &Channel| channel.name() == field.name && channel.sentences().is_none();
        field.rows == rows && of.scene.output.channels.iter().any(is_of)
    };
    let names: Vec<&str> = RecordedField::all().filter(is_asked).map(|field| field.name).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

fn probes(of: AssembledScene<'_>) -> FeatureSentences {
    let probes = of.scene.probe.iter().map(ProbeSpec::count).sum::<u64>();
    let yes = (probes > 0).then(|| format!("{} on /probe", counted(probes, "probe", "probes")));
    either(yes, "probes: no [[probe]]")
}

fn linear_solver(of: AssembledScene<'_>) -> FeatureSentences {
    let solver = || match of.scene.time.arc_length.is_some() {
        true => "sparse LU of the exact tangent, definite or not".to_owned(),
        false => of.simulation.linear_solver(),
    };
    let solves = of.simulation.method().documentation.solves > 0;
    let no = "stiffness matrix, linear solver, Hessians: the integrator is explicit";
    either(solves.then(solver), no)
}

fn steps_in_parts(of: AssembledScene<'_>) -> FeatureSentences {
    let (simulation, time) = (of.simulation, &of.scene.time);
    let is_fixed = simulation.step_control().is_none() && time.arc_length.is_none();
    if simulation.method().documentation.solves == 0 || !is_fixed {
        return FeatureSentences::default();
    }
    let retries = time.solver_options().retries;
    let yes = (retries > 0).then(|| {
        format!(
            "step subdivision: a failed step is halved repeatedly, down to {}; every part is counted",
            Seconds(simulation.step_size() * 0.5_f64.powi(retries as i32))
        )
    });
    either(yes, "step subdivision: `retries` in [time] solver is 0, so a failed step ends the run")
}

fn study(of: AssembledScene<'_>) -> FeatureSentences {
    let no = "[study]: only `pliant study` reads it";
    let left_out = of.scene.study.iter().map(|_| no.to_owned()).collect();
    FeatureSentences { uses: vec![], left_out }
}

/// Small-strain elasticity of a formula.
fn at_rest(energy: &EnergyExpression) -> String {
    match energy.lame().map(|lame| lame.young_and_poisson()) {
        Some((young, poisson)) => {
            format!("E = {} Pa and nu = {} at rest", Rounded::<7>(young), Rounded::<6>(poisson))
        }
        None => "not isotropic, and elliptic at rest".to_owned(),
    }
}

/// Small-strain elasticity of a matrix and along its fibres.
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

/// Description of the step size control.
fn follows(control: &StepControl, simulation: &Simulation) -> String {
    if simulation.method().is_static() {
        let StepControl { first, smallest, largest, .. } = *control;
        return format!(
            "automatic increments, the first {}, down to {smallest} and up to {largest}; rejected ones are \
             counted",
            Seconds(first.unwrap_or(largest)),
            smallest = Seconds(smallest),
            largest = Seconds(largest)
        );
    }
    if simulation.method().has_own_criterion() {
        return format!("step sizes by the integrator's own criterion, up to {}", Seconds(control.largest));
    }
    let Tolerances { position, velocity, relative } = control.tolerances;
    format!(
        "adaptive step size: errors per step up to {position} m and {velocity} m/s + {relative} of the \
         speed, steps up to {}; rejected steps are counted",
        Seconds(control.largest),
        position = Rounded::<4>(position),
        velocity = Rounded::<4>(velocity),
        relative = Rounded::<17>(relative)
    )
}

/// Description of the cost of a step.
fn cost(method: &Documentation) -> String {
    match method.solves {
        0 if method.force_evaluations == 0 => "some iterations of seven force evaluations".into(),
        0 => counted(method.force_evaluations.into(), "force evaluation", "force evaluations"),
        solves => counted(solves.into(), "nonlinear solve", "nonlinear solves"),
    }
}

/// Description of the most curved element of all bodies, if any side is curved.
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
