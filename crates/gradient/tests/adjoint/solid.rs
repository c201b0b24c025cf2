//! Solids of linear elements, made by scenes: a beam of six triangles, a box of twelve tetrahedra.

use pliant::material::{EnergyExpression, MaterialSpec};
use pliant::simulation::Simulation;
use pliant::topology::Topology;
use pliant_gradient::{GradientError, LossFrame, ParameterSelection, UNLIMITED, gradient, names};
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;
use serde_json::Value;

use crate::differences::compare_number;
use crate::support::{case, compare, method, numbers};

/// Rows of `width` numbers, as a scene has them.
pub(crate) fn rows(numbers: &[f64], width: usize) -> String {
    let rows: Vec<String> = numbers.chunks_exact(width).map(|row| format!("{row:?}")).collect();
    format!("[{}]", rows.join(","))
}

/// Velocities of all vertices: of the free ones as the reference has them, zero of the held.
fn velocities(setup: &Value, d: usize) -> Vec<f64> {
    let mut velocities = vec![0.0; numbers(&setup["rest"]).len()];
    let free = numbers(&setup["free"]).into_iter().map(|vertex| vertex as usize);
    for (vertex, row) in free.zip(numbers(&setup["velocity"]).chunks_exact(d)) {
        velocities[vertex * d..][..d].copy_from_slice(row);
    }
    velocities
}

/// Parts of a scene beside those of the reference: keys of the world, of the body, of the pin.
#[derive(Clone, Copy, Default)]
pub(crate) struct Further {
    pub(crate) world: &'static str,
    pub(crate) body: &'static str,
    pub(crate) pin: &'static str,
}

pub(crate) fn scene(setup: &Value, material: &str, scheme: &str, steps: u64, further: Further) -> Scene {
    let d = numbers(&setup["gravity"]).len();
    let number = |key: &str| numbers(&setup[key])[0];
    let method = method(scheme).documentation;
    let solver = if method.solves > 0 { "solver = { tolerance = 1e-14 }" } else { "" };
    let scheme = match scheme {
        "newmark(.3025,.6)" => "{ newmark = { beta = 0.3025, gamma = 0.6 } }".to_owned(),
        "generalised-alpha(.5)" => "{ generalised-alpha = { rho = 0.5 } }".to_owned(),
        scheme => format!("\"{scheme}\""),
    };
    let Further { world, body, pin } = further;
    let text = format!(
        "dimension = {d}
         [time]
         duration = {}
         step = 0.01
         integrator = {scheme}
         {solver}
         [world]
         gravity = {:?}
         {world}
         [[body]]
         name = \"beam\"
         mass = {{ density = {:?} }}
         elastic = {{ {material} = {{ young = {:?}, poisson = {:?} }} }}
         mesh = {{ inline = {{ points = {}, {} = {} }} }}
         position = {{ per_vertex = {} }}
         velocity = {{ per_vertex = {} }}
         {body}
         [[body.pin]]
         vertices = {}
         {pin}",
        steps as f64 * 0.01,
        numbers(&setup["gravity"]),
        number("density"),
        number("young"),
        number("poisson"),
        rows(&numbers(&setup["rest"]), d),
        if d == 2 { "triangles" } else { "tetrahedra" },
        setup["cells"],
        rows(&numbers(&setup["start"]), d),
        rows(&velocities(setup, d), d),
        setup["held"],
    );
    Scene::from_toml(&text).unwrap()
}

pub(crate) fn assembled(scene: &Scene) -> (Simulation, Topology) {
    let assembly = scene.assemble(UnstableStep::Accept).unwrap_or_else(|problems| panic!("{problems:?}"));
    (assembly.simulation, assembly.topology)
}

/// One of the losses of the reference, of a run of so many steps, in `d` dimensions.
fn loss(
    name: &str,
    steps: u64,
    d: usize,
    tip: usize,
) -> impl FnMut(&LossFrame<'_>, &mut [f64], &mut [f64]) -> f64 {
    move |frame, x_bar, _| match name {
        "sum_of_squares_over_frames" if frame.step % 10 == 0 => {
            x_bar.iter_mut().zip(frame.x).for_each(|(bar, x)| *bar = 2.0 * x);
            frame.x.iter().map(|x| x * x).sum()
        }
        "tip_x" | "tip_y" if frame.step == steps => {
            let i = tip * d + usize::from(name == "tip_y");
            x_bar[i] = 1.0;
            frame.x[i]
        }
        _ => 0.0,
    }
}

const NAMES: [(&str, &str); 9] = [
    ("body.beam.elastic.young", "young"),
    ("body.beam.elastic.poisson", "poisson"),
    ("body.beam.mass.density", "density"),
    ("world.gravity", "gravity"),
    ("position", "start"),
    ("velocity", "velocity"),
    ("body.beam.elastic.young_per_element", "young_of_element"),
    ("body.beam.elastic.poisson_per_element", "poisson_of_element"),
    ("body.beam.rest", "rest"),
];

/// A run of the reference: its mesh and start, and how it is taken.
struct Run<'a> {
    setup: &'a Value,
    material: &'a str,
    scheme: &'a str,
    steps: u64,
    tip: usize,
    further: Further,
}

impl Run<'_> {
    /// Compares the derivatives of all losses by these parameters; gives how many losses there were.
    fn compare(&self, losses: &Value, names: &[(&str, &str)], tolerance: f64) -> usize {
        let Run { setup, material, scheme, steps, tip, further } = *self;
        let d = numbers(&setup["gravity"]).len();
        let free: Vec<usize> = numbers(&setup["free"]).into_iter().map(|vertex| vertex as usize).collect();
        let keys: Vec<&str> = names.iter().map(|(key, _)| *key).collect();
        let losses = losses.as_object().unwrap();
        for (of, expected) in losses {
            let scene = scene(setup, material, scheme, steps, further);
            let (mut simulation, topology) = assembled(&scene);
            let mut selection =
                ParameterSelection::new(&scene, &topology, simulation.numbering(), &keys).unwrap();
            let mut loss = loss(of, steps, d, tip);
            let found =
                gradient(&mut simulation, steps, &mut loss, selection.parameters(), UNLIMITED).unwrap();
            let what = format!("{material}, {scheme}, {of}");
            compare(&what, &[found.value], &numbers(&expected["value"]), 1e-12);
            for ((_, key), mut part) in names.iter().zip(selection.parts(&found)) {
                if *key == "velocity" {
                    part = free.iter().flat_map(|vertex| part[vertex * d..][..d].to_vec()).collect();
                }
                let expected = match *key {
                    // The reference has it by the amplitude, 0.05 m.
                    "factor" => vec![0.05 * numbers(&expected["gradient"]["amplitude"])[0]],
                    key => numbers(&expected["gradient"][key]),
                };
                compare(&format!("{what} by {key}"), &part, &expected, tolerance);
            }
        }
        losses.len()
    }
}

/// Compares all derivatives of a case; gives how many runs were compared.
fn compare_case(name: &str, steps: u64, tip: usize, tolerance: f64) -> usize {
    let (case, further) = (case(name), Further::default());
    let mut compared = 0;
    for (material, schemes) in case["runs"].as_object().unwrap() {
        for (scheme, losses) in schemes.as_object().unwrap() {
            let run = Run { setup: &case["setup"], material, scheme, steps, tip, further };
            compared += run.compare(losses, &NAMES, tolerance);
        }
    }
    compared
}

/// The same for the beam with further parts, by the names that these leave and `added` ones.
fn compare_beam(name: &str, material: &str, further: Further, added: &[(&str, &str)]) -> usize {
    let (setup, mut compared) = (&case("beam")["setup"], 0);
    let names: Vec<_> = NAMES[..6].iter().chain(added).copied().collect();
    for (scheme, losses) in case(name).as_object().unwrap() {
        let run = Run { setup, material, scheme, steps: 50, tip: 7, further };
        compared += run.compare(losses, &names, 1e-10);
    }
    compared
}

#[test]
fn damping_has_the_derivatives_of_its_steps() {
    let body = "damping = { mass_proportional = 1.5, stiffness_proportional = 0.002, \
                strain_rate = { shear = 20.0, second = 10.0 } }";
    let added = [
        ("body.beam.damping.mass_proportional", "mass_proportional"),
        ("body.beam.damping.stiffness_proportional", "stiffness_proportional"),
        ("body.beam.damping.strain_rate.shear", "shear"),
        ("body.beam.damping.strain_rate.second", "second"),
    ];
    let further = Further { body, ..Further::default() };
    assert_eq!(compare_beam("damped", "neo-hookean", further, &added), 8 * 2);
}

#[test]
fn ether_drag_has_the_derivatives_of_its_steps() {
    let further = Further { world: "ether_drag = 0.8", ..Further::default() };
    assert_eq!(compare_beam("dragged", "neo-hookean", further, &[]), 2 * 2);
}

// The held velocity is in the damping force; held vertices start where the motion takes them from.
#[test]
fn moved_pins_have_the_derivatives_of_their_steps() {
    let further = Further {
        body: "damping = { stiffness_proportional = 0.004 }",
        pin: "motion = { displacement = [\"0\", \"0.05*sin(12*t)\"] }",
        ..Further::default()
    };
    let added = [("body.beam.pin.0.motion.factor", "factor")];
    assert_eq!(compare_beam("moved", "stable-neo-hookean", further, &added), 5 * 2);
    let pin = "motion = { displacement = [\"0\", \"A*sin(w*t) where A = 0.05, w = 12\"] }";
    let name = |key| format!("body.beam.pin.0.motion.parameters.{key}");
    let added = [(&name("A")[..], "amplitude"), (&name("w")[..], "omega")];
    assert_eq!(compare_beam("moved", "stable-neo-hookean", Further { pin, ..further }, &added), 5 * 2);
}

#[test]
fn a_beam_has_the_derivatives_of_its_steps() {
    assert_eq!(compare_case("beam", 50, 7, 1e-10), 3 * 5 * 3);
}

#[test]
fn a_box_of_tetrahedra_has_the_derivatives_of_its_steps() {
    assert_eq!(compare_case("box", 30, 11, 1e-10), 3 * 3 * 2);
}

// One equilibrium under weight and a load: what the start was does not matter, but for the places of pins.
#[test]
fn equilibria_have_derivatives() {
    let case = case("statics");
    let body = "load = [{ vertices = [6, 7], force_per_vertex = [300.0, -900.0] }]";
    let further = Further { body, ..Further::default() };
    let mut compared = 0;
    for (material, losses) in case["runs"].as_object().unwrap() {
        let setup = &case["setup"];
        let run = Run { setup, material, scheme: "quasi-static", steps: 1, tip: 7, further };
        let load = ("body.beam.load.0.force_per_vertex", "load");
        let names: Vec<_> = NAMES[..5].iter().chain(&NAMES[6..8]).copied().chain([load]).collect();
        compared += run.compare(losses, &names, 1e-10);
    }
    assert_eq!(compared, 3 * 2);
}

#[test]
fn names_that_are_no_parameter_are_answered_with_those_that_are() {
    let scene = scene(&case("beam")["setup"], "neo-hookean", "velocity-verlet", 1, Further::default());
    let (simulation, topology) = assembled(&scene);
    let all = names(&scene, &topology);
    let select = |name: &str| ParameterSelection::new(&scene, &topology, simulation.numbering(), &[name]);
    let expected = "`body.beam.elastic.youngs` has no derivative; the gradient can be taken with respect to: \
                    position, velocity, forces, pins, world.gravity, body.beam.mass.density, \
                    body.beam.elastic.young, body.beam.elastic.young_per_element, \
                    body.beam.elastic.poisson, body.beam.elastic.poisson_per_element, body.beam.rest";
    let error = |name| select(name).err().unwrap();
    assert_eq!(error("body.beam.elastic.youngs").to_string(), expected);
    let GradientError::Parameter { problem, known, .. } = error("time.step") else { panic!() };
    assert_eq!((problem.as_str(), known), ("is no parameter of this scene", all.clone()));
    assert!(all.iter().all(|name| select(name).is_ok()));
    assert!(select("body.0.elastic.young").is_ok());
}

// Viscosity of the material `linear` that follows from its stiffness stays at rest.
#[test]
fn the_shape_at_rest_is_a_parameter_where_all_that_is_made_of_it_is_known() {
    const BY_PLACE: &str = "motion = { displacement = ['t*(1 + X)', '0'] }";
    const TURNS_BY_PLACE: &str =
        "motion = { displacement = ['t*(1 + X)', '0'], rotation = { point = [0.0, 0.0], speed = 1.0 } }";
    const VISCOUS: &str = "damping = { stiffness_proportional = 1e-3 }";
    for (material, body, pin, is_parameter) in [
        ("neo-hookean", "", "", true),
        ("neo-hookean", "load = [{ force = [1.0, 't'] }]", "", true),
        ("neo-hookean", "load = [{ pressure = '10*t' }]", "", true),
        ("neo-hookean", "load = [{ force = [1.0, 'X'] }]", "", true),
        ("neo-hookean", "load = [{ body_force = [1.0, 0.0] }]", "", true),
        ("neo-hookean", "load = [{ body_force = [1.0, 'X'] }]", "", true),
        ("neo-hookean", "load = [{ body_force = [1.0, 0.0], vertices = [0, 1, 2, 3] }]", "", true),
        ("neo-hookean", "load = [{ traction = [1.0, 0.0] }]", "", true),
        ("neo-hookean", "load = [{ pressure = '10*X' }]", "", true),
        ("neo-hookean", "", BY_PLACE, true),
        ("neo-hookean", "", TURNS_BY_PLACE, true),
        ("neo-hookean", VISCOUS, "", true),
        ("linear", VISCOUS, "", false),
    ] {
        let further = Further { body, pin, ..Further::default() };
        let scene = scene(&case("beam")["setup"], material, "velocity-verlet", 1, further);
        let has = names(&scene, &assembled(&scene).1).iter().any(|name| name == "body.beam.rest");
        assert_eq!(has, is_parameter, "{material}, {body}{pin}");
    }
}

// Neo-Hookean as a formula of Young's modulus and Poisson's ratio: its derivatives by these are those of the
// model.
#[test]
fn numbers_of_a_formula_have_the_derivatives_of_the_model() {
    let psi = "young/(4*(1 + nu))*(I1 - 3 - 2*log(J)) + young*nu/(2*(1 + nu)*(1 - 2*nu))*log(J)^2";
    for (case_name, tip) in [("beam", 7), ("box", 7)] {
        for scheme in ["velocity-verlet", "implicit-euler"] {
            let setup = &case(case_name)["setup"];
            let by_hand = scene(setup, "neo-hookean", scheme, 10, Further::default());
            let Some(MaterialSpec::NeoHookean(solid)) = by_hand.body[0].elastic else {
                panic!("neo-Hookean")
            };
            let mut of_formula = by_hand.clone();
            let numbers = [("young", solid.young), ("nu", solid.poisson)];
            let formula = EnergyExpression::new(psi, numbers, &[]);
            of_formula.body[0].elastic = Some(MaterialSpec::ExpressedEnergy(formula));
            let by = |scene: &Scene, keys: [&str; 3]| {
                let keys = keys.map(|key| format!("body.beam.{key}"));
                let keys = keys.each_ref().map(String::as_str);
                let (mut simulation, topology) = assembled(scene);
                let mut selection =
                    ParameterSelection::new(scene, &topology, simulation.numbering(), &keys).unwrap();
                let mut loss = loss("tip_y", 10, topology.dimension, tip);
                let found =
                    gradient(&mut simulation, 10, &mut loss, selection.parameters(), UNLIMITED).unwrap();
                selection.parts(&found)
            };
            let expected = by(&by_hand, ["elastic.young", "elastic.poisson", "rest"]);
            let found = by(&of_formula, ["elastic.parameters.young", "elastic.parameters.nu", "rest"]);
            for (part, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert!(expected.iter().any(|number| *number != 0.0));
                compare(&format!("{case_name} {scheme} {part}"), found, expected, 1e-9);
            }
        }
    }
}

// Viscosities that are given do not depend on the material: its numbers are parameters as they are without.
#[test]
fn numbers_of_a_material_have_derivatives_beside_viscosities() {
    let body = "damping = { strain_rate = { shear = 20.0, second = 10.0 } }";
    let viscous = || {
        let further = Further { body, ..Further::default() };
        scene(&case("beam")["setup"], "neo-hookean", "implicit-euler", 20, further)
    };
    let (mut simulation, topology) = assembled(&viscous());
    let keys = ["young", "young_per_element", "poisson", "poisson_per_element"];
    let keys = keys.map(|key| format!("body.beam.elastic.{key}"));
    let mut selection =
        ParameterSelection::new(&viscous(), &topology, simulation.numbering(), &keys).unwrap();
    let mut loss = loss("tip_y", 20, 2, 7);
    let found = gradient(&mut simulation, 20, &mut loss, selection.parameters(), UNLIMITED).unwrap();
    let parts = selection.parts(&found);
    for whole in [0, 2] {
        let sum: f64 = parts[whole + 1].iter().sum();
        assert!((sum / parts[whole][0] - 1.0).abs() < 1e-12, "{}: {sum:e}, {:?}", keys[whole], parts[whole]);
    }
    let psi = "mu/2*(I1 - 3 - 2*log(J)) + lambda/2*log(J)^2";
    let of_formula = |mu: f64| {
        let mut scene = viscous();
        let formula = EnergyExpression::new(psi, [("mu", mu), ("lambda", 4e4)], &[]);
        scene.body[0].elastic = Some(MaterialSpec::ExpressedEnergy(formula));
        scene
    };
    compare_number("formula", of_formula, ("body.beam.elastic.parameters.mu", 2e4, 2e4), (20, 1e-7));
}

// The second viscosity of a sheet that is free to change its thickness is not that of plane strain.
#[test]
fn viscosity_in_plane_stress_has_derivatives() {
    let of = |young: f64, poisson: f64, beta: f64| {
        let mut sheet = scene(&case("beam")["setup"], "linear", "implicit-euler", 20, Further::default());
        let material =
            serde_json::json!({ "linear": { "young": young, "poisson": poisson, "plane": "stress" } });
        sheet.body[0].elastic = Some(serde_json::from_value(material).unwrap());
        let damping = serde_json::json!({ "stiffness_proportional": beta });
        sheet.body[0].damping = Some(serde_json::from_value(damping).unwrap());
        sheet
    };
    let key = |key: &str| format!("body.beam.{key}");
    let young = |young| of(young, 0.35, 0.02);
    compare_number("sheet", young, (&key("elastic.young"), 5e4, 5e4), (20, 1e-7));
    let poisson = |poisson| of(5e4, poisson, 0.02);
    compare_number("sheet", poisson, (&key("elastic.poisson"), 0.35, 0.1), (20, 1e-7));
    let beta = |beta| of(5e4, 0.35, beta);
    compare_number("sheet", beta, (&key("damping.stiffness_proportional"), 0.02, 0.02), (20, 1e-7));
    // Of none it is that of next to none.
    let [none, next] = [0.0, 1e-7].map(|beta| {
        let sheet = of(5e4, 0.35, beta);
        let (mut simulation, topology) = assembled(&sheet);
        let name = [key("damping.stiffness_proportional")];
        let mut selection =
            ParameterSelection::new(&sheet, &topology, simulation.numbering(), &name).unwrap();
        let mut loss = loss("tip_y", 20, 2, 7);
        let found = gradient(&mut simulation, 20, &mut loss, selection.parameters(), UNLIMITED).unwrap();
        selection.parts(&found)[0][0]
    });
    assert!((none / next - 1.0).abs() < 1e-4, "{none:e}, {next:e}");
}

// Sums are in fixed order, and what threads share has the same bits.
#[test]
fn the_number_of_threads_changes_no_bit() {
    let setup = &case("beam")["setup"];
    let of = |threads: usize, scheme: &str| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let scene = scene(setup, "neo-hookean", scheme, 20, Further::default());
            let (mut simulation, topology) = assembled(&scene);
            let keys = NAMES.map(|(key, _)| key);
            let mut selection =
                ParameterSelection::new(&scene, &topology, simulation.numbering(), &keys).unwrap();
            let mut loss = loss("tip_y", 20, 2, 7);
            gradient(&mut simulation, 20, &mut loss, selection.parameters(), UNLIMITED).unwrap()
        })
    };
    for scheme in ["velocity-verlet", "implicit-euler"] {
        assert_eq!(of(1, scheme), of(2, scheme), "{scheme}");
    }
}
