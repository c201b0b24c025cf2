//! Numbers that terms are in proportion to, or to a power of, and masses that attract: against differences.

use pliant_gradient::{
    GradientError, LoadFactor, LossFrame, Parameter, RunDirection, TermFactor, UNLIMITED, gradient, names,
    tangent_along,
};
use pliant_scene::Scene;

use crate::by_parameters::compare;
use crate::differences::{compare_number, compare_numbers};
use crate::solid::assembled;
use crate::support;
use crate::tangents::compare_with_tangents;

/// A scene of this scheme with these further tables.
fn scene(scheme: &str, dimension: usize, text: &str) -> Scene {
    support::scene(scheme, dimension, [5e-3, 1e-3], text)
}

/// Schemes and steps; splitting with and without closed forms of kicks, stages, all of them, statics.
const RUNS: [(&str, u64); 6] = [
    ("velocity-verlet", 40),
    ("rk4", 40),
    ("implicit-euler", 12),
    ("generalised-alpha", 12),
    ("gauss2", 8),
    ("quasi-static", 2),
];

/// A beam tied to places and to itself; stiffness, total stiffness, dashpot.
fn tied(scheme: &str, numbers: [f64; 3]) -> Scene {
    tied_at(scheme, numbers, 0.05)
}

/// The same of ties of this rest length to places.
fn tied_at(scheme: &str, [stiffness, total, dashpot]: [f64; 3], rest_length: f64) -> Scene {
    let text = format!(
        "[world]
         gravity = [0.3, -9.81]
         [[body]]
         name = \"beam\"
         mesh = {{ grid = {{ cells = [3, 1], size = [0.9, 0.3] }} }}
         elastic = {{ neo-hookean = {{ young = 5e4, poisson = 0.35 }} }}
         mass = {{ density = 1000.0 }}
         velocity = {{ rigid = {{ linear = [0.3, -0.8] }} }}
         pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }} }}]
         [[attachment]]
         half_space = {{ normal = [-1, 0], offset = -0.9 }}
         points = [[1.0, 0.1], [1.1, 0.4]]
         stiffness = {stiffness:?}
         dashpot = {dashpot:?}
         rest_length = {rest_length:?}
         [[attachment]]
         name = \"sides\"
         vertices = [1, 2]
         total_stiffness = {total:?}
         points = [[0.2, -0.2], [0.7, 0.1]]"
    );
    scene(scheme, 2, &text)
}

#[test]
fn numbers_of_attachments_have_derivatives() {
    let at = [3e3, 5e3, 40.0];
    for (scheme, steps) in RUNS {
        let keys = ["attachment0.stiffness", "sides.total_stiffness", "attachment0.dashpot"];
        for (i, key) in keys.into_iter().enumerate().take(if scheme == "quasi-static" { 2 } else { 3 }) {
            let of = |number: f64| {
                let mut numbers = at;
                numbers[i] = number;
                tied(scheme, numbers)
            };
            compare_number(scheme, of, (&format!("attachment.{key}"), at[i], at[i]), (steps, 1e-6));
        }
    }
    for (scheme, steps) in RUNS {
        let of = |length: f64| tied_at(scheme, at, length);
        compare_number(scheme, of, ("attachment.attachment0.rest_length", 0.05, 0.05), (steps, 1e-6));
    }
    let keys = ["stiffness", "dashpot", "rest_length"].map(|key| format!("attachment.attachment0.{key}"));
    compare("attachments", &tied("bdf2", at), &keys.each_ref().map(|key| &key[..]), 12);
}

/// A sheet in space that is a membrane and bends, damped; further keys of the body.
fn sheet(scheme: &str, membrane: &str, bending: &str, further: &str) -> Scene {
    let text = format!(
        "[world]
         gravity = [0.3, -1.0, -9.81]
         [[body]]
         name = \"sheet\"
         mesh = {{ cloth = {{ cells = [2, 2], origin = [0, 0, 0], u = [0.4, 0, 0], v = [0, 0.3, 0] }} }}
         membrane = {{ {membrane} }}
         bending = {{ {bending} }}
         velocity = {{ rigid = {{ linear = [0.3, -0.8, 0.5], angular = [0.5, 2.0, -1.0] }} }}
         pin = [{{ vertices = [0, 2] }}]
         {further}"
    );
    scene(scheme, 3, &text)
}

#[test]
fn numbers_of_sheets_have_derivatives() {
    let bending = "stiffness = 0.02";
    for (scheme, steps) in RUNS.into_iter().filter(|(scheme, _)| *scheme != "quasi-static") {
        let of_thickness = |h: f64, mass: &str| {
            let further = format!(
                "elastic = {{ stable-neo-hookean = {{ young = 2e5, poisson = 0.35 }} }}
                 mass = {{ {mass} }}
                 damping = {{ stiffness_proportional = 2e-3, strain_rate = {{ shear = 20.0 }} }}"
            );
            sheet(scheme, &format!("thickness = {h:?}"), bending, &further)
        };
        let name = "body.sheet.membrane.thickness";
        for mass in ["density = 1000.0", "density = \"2 kg/m^2\"", "total = 0.3"] {
            compare_number(scheme, |h| of_thickness(h, mass), (name, 2e-3, 2e-3), (steps, 1e-6));
        }
        for (plane, material) in [
            ("plane = \"strain\"", "neo-hookean = { poisson = 0.35"),
            ("plane = \"stress\"", "neo-hookean = { poisson = 0.35"),
            ("plane = \"stress\"", "mooney-rivlin = { c10 = 0.3, c01 = 0.1, poisson = 0.35"),
        ] {
            let of_young = |young: f64| {
                let further = format!(
                    "elastic = {{ {material}, young = {young:?} }} }}
                     mass = {{ density = 1000.0 }}
                     damping = {{ stiffness_proportional = 2e-3 }}"
                );
                sheet(scheme, &format!("thickness = 2e-3, {plane}"), bending, &further)
            };
            compare_number(scheme, of_young, ("body.sheet.elastic.young", 2e5, 2e5), (steps, 1e-6));
        }
        for (plane, material, damping) in [
            ("strain", "neo-hookean", "stiffness_proportional = 2e-3"),
            ("stress", "neo-hookean", "stiffness_proportional = 2e-3"),
            ("stress", "corotated", "mass_proportional = 0.2"),
            ("stress", "hencky", "strain_rate = { shear = 20.0 }"),
        ] {
            let of_poisson = |poisson: f64| {
                let further = format!(
                    "elastic = {{ {material} = {{ young = 2e5, poisson = {poisson:?} }} }}
                     mass = {{ density = 1000.0 }}
                     damping = {{ {damping} }}"
                );
                sheet(scheme, &format!("thickness = 2e-3, plane = \"{plane}\""), bending, &further)
            };
            let what = format!("{scheme}, {plane}, {material}");
            compare_number(&what, of_poisson, ("body.sheet.elastic.poisson", 0.35, 0.1), (steps, 1e-6));
            compare(&what, &of_poisson(0.35), &["body.sheet.elastic.poisson"], steps);
        }
        let further = "elastic = { neo-hookean = { young = 2e4, poisson = 0.35 } }
                       mass = { density = 1000.0 }
                       damping = { stiffness_proportional = 2e-3 }";
        let bent = |bending: &str| sheet(scheme, "thickness = 2e-3", bending, further);
        let of = |key: &str, value: f64, bending: &dyn Fn(f64) -> String| {
            let name = format!("body.sheet.bending.{key}");
            compare_number(scheme, |number| bent(&bending(number)), (&name, value, value), (steps, 1e-6));
        };
        of("stiffness", 0.02, &|d| format!("stiffness = {d:?}"));
        of("young", 2e6, &|young| format!("young = {young:?}, thickness = 5e-3, poisson = 0.3"));
        of("thickness", 5e-3, &|h| format!("young = 2e6, thickness = {h:?}, poisson = 0.3"));
        of("poisson", 0.3, &|nu| format!("young = 2e6, thickness = 5e-3, poisson = {nu:?}"));
    }
}

/// A strand of springs that bends.
fn strand(scheme: &str, dimension: usize, bending: &str) -> Scene {
    let (start, end, gravity) = match dimension {
        2 => ("[0, 0]", "[0.6, 0.1]", "[0.3, -9.81]"),
        _ => ("[0, 0, 0]", "[0.6, 0.1, 0.2]", "[0.3, -2.0, -9.81]"),
    };
    let text = format!(
        "[world]
         gravity = {gravity}
         [[body]]
         name = \"strand\"
         mesh = {{ strand = {{ segments = 4, start = {start}, end = {end} }} }}
         springs = {{ stiffness = 500.0 }}
         bending = {{ {bending} }}
         damping = {{ stiffness_proportional = 2e-3 }}
         mass = {{ per_vertex = 0.02 }}
         pin = [{{ vertices = [0, 1] }}]"
    );
    scene(scheme, dimension, &text)
}

#[test]
fn numbers_of_strands_that_bend_have_derivatives() {
    for (scheme, steps) in RUNS.into_iter().filter(|(scheme, _)| *scheme != "quasi-static") {
        for dimension in [2, 3] {
            let of_thickness = |h: f64| strand(scheme, dimension, &format!("young = 4e5, thickness = {h:?}"));
            let name = "body.strand.bending.thickness";
            compare_number(scheme, of_thickness, (name, 0.02, 0.02), (steps, 1e-6));
            let of_young =
                |young: f64| strand(scheme, dimension, &format!("young = {young:?}, thickness = 0.02"));
            compare_number(scheme, of_young, ("body.strand.bending.young", 4e5, 4e5), (steps, 1e-6));
        }
    }
}

/// Particles that attract each other, and others that do not, under drag.
fn particles(scheme: &str, constant: f64, mass: &str, drag: f64) -> Scene {
    softened(scheme, constant, 0.1, mass, drag)
}

/// The same of this softening.
fn softened(scheme: &str, constant: f64, softening: f64, mass: &str, drag: f64) -> Scene {
    let text = format!(
        "[world]
         nbody = {{ constant = {constant:?}, softening = {softening:?} }}
         ether_drag = {drag:?}
         gravity = [0.2, -0.3]
         [[body]]
         name = \"three\"
         mesh = {{ inline = {{ points = [[1, 0.5], [-0.5, -0.4], [0.3, -0.8]] }} }}
         mass = {{ {mass} }}
         velocity = {{ per_vertex = [[0.5, 0.2], [-0.3, 1.0], [0.1, -0.2]] }}
         damping = {{ mass_proportional = 0.5 }}
         [[body]]
         name = \"one\"
         mesh = {{ inline = {{ points = [[-1, 0.7]] }} }}
         mass = {{ total = 2.0 }}
         [[attachment]]
         body = \"three\"
         vertices = [0]
         points = [[0.5, 0.5]]
         stiffness = 3.0"
    );
    scene(scheme, 2, &text)
}

#[test]
fn attraction_has_derivatives_by_its_constant_and_by_masses() {
    let explicit = ["velocity-verlet", "yoshida4", "rk4", "ias15"].map(|scheme| (scheme, 60));
    let implicit = ["implicit-euler", "bdf2", "gauss2"].map(|scheme| (scheme, 12));
    for (scheme, steps) in explicit.into_iter().chain(implicit) {
        let mass = "per_vertex = [3.0, 4.0, 5.0]";
        let of_constant = |g: f64| particles(scheme, g, mass, 0.0);
        compare_number(scheme, of_constant, ("world.nbody.constant", 2.0, 2.0), (steps, 1e-6));
        let of_masses = |masses: &[f64]| particles(scheme, 2.0, &format!("per_vertex = {masses:?}"), 0.0);
        let values = [3.0, 4.0, 5.0];
        compare_numbers(scheme, of_masses, ("body.three.mass.per_vertex", &values, &values), (steps, 1e-6));
        let of_softening = |softening: f64| softened(scheme, 2.0, softening, mass, 0.0);
        compare_number(scheme, of_softening, ("world.nbody.softening", 0.3, 0.3), (steps, 1e-6));
        let of_total = |total: f64| particles(scheme, 2.0, &format!("total = {total:?}"), 0.0);
        compare_number(scheme, of_total, ("body.three.mass.total", 9.0, 9.0), (steps, 1e-6));
    }
    let names = [
        "world.nbody.constant",
        "world.nbody.softening",
        "body.three.mass.per_vertex",
        "body.one.mass.total",
    ];
    for scheme in ["rk4", "implicit-euler", "sdirk2"] {
        compare("attraction", &particles(scheme, 2.0, "per_vertex = [3.0, 4.0, 5.0]", 0.0), &names, 100);
    }
    compare_with_tangents("attraction", &particles("bdf2", 2.0, "per_vertex = [3.0, 4.0, 5.0]", 0.3), 60);
}

#[test]
fn ether_drag_has_a_derivative() {
    let drag = ("world.ether_drag", 0.8, 0.8);
    for scheme in ["velocity-verlet", "yoshida4", "rk4", "ias15"] {
        let of_drag = |drag: f64| particles(scheme, 2.0, "per_vertex = [3.0, 4.0, 5.0]", drag);
        compare_number(scheme, of_drag, drag, (60, 1e-6));
    }
    for (scheme, steps) in RUNS.into_iter().filter(|(scheme, _)| *scheme != "quasi-static") {
        for damping in ["", "damping = { stiffness_proportional = 2e-3 }"] {
            let of_drag = |drag: f64| {
                let text = format!(
                    "[world]
                     gravity = [0.3, -9.81]
                     ether_drag = {drag:?}
                     [[body]]
                     name = \"beam\"
                     mesh = {{ grid = {{ cells = [3, 1], size = [0.9, 0.3] }} }}
                     elastic = {{ neo-hookean = {{ young = 5e4, poisson = 0.45 }} }}
                     mass = {{ density = 1000.0 }}
                     velocity = {{ rigid = {{ linear = [0.3, -0.8] }} }}
                     {damping}
                     pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }} }}]"
                );
                scene(scheme, 2, &text)
            };
            compare_number(scheme, of_drag, drag, (steps, 1e-6));
            compare(scheme, &of_drag(0.8), &["world.ether_drag"], steps);
        }
    }
    for scheme in ["velocity-verlet", "yoshida4", "ias15"] {
        let mass = "per_vertex = [3.0, 4.0, 5.0]";
        compare(scheme, &particles(scheme, 2.0, mass, 0.8), &["world.ether_drag"], 60);
    }
}

#[test]
fn what_is_zero_or_touches_is_not_offered() {
    let offered = |scene: &Scene| names(scene, &assembled(scene).1);
    let zero = offered(&tied("rk4", [3e3, 5e3, 0.0]));
    assert!(zero.iter().any(|name| name == "attachment.attachment0.stiffness"), "{zero:?}");
    assert!(!zero.iter().any(|name| name.ends_with("dashpot") || name.ends_with("ether_drag")), "{zero:?}");
    let mut touching = sheet(
        "rk4",
        "thickness = 2e-3",
        "stiffness = 0.02",
        "elastic = { neo-hookean = { young \
        = 2e4, poisson = 0.35 } }\nmass = { density = 1000.0 }",
    );
    assert!(offered(&touching).iter().any(|name| name == "body.sheet.membrane.thickness"));
    touching.contact = Some(serde_json::from_str("{}").unwrap());
    let names = offered(&touching);
    assert!(!names.iter().any(|name| name.ends_with("thickness") || name.ends_with("young")), "{names:?}");
    assert!(names.iter().any(|name| name == "body.sheet.bending.stiffness"), "{names:?}");
}

/// Derivatives by numbers of what is not there would be zero.
#[test]
fn parameters_of_terms_that_are_not_there_are_refused() {
    let (mut simulation, _) = assembled(&tied("velocity-verlet", [3e3, 5e3, 40.0]));
    let mut loss = |_: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| 0.0;
    let named = |name: &str| GradientError::Term { name: name.to_owned() };
    let factor =
        |name: &str| TermFactor::new(vec![(1.0, "attachment `sides`".into()), (1.0, name.to_owned())]);
    for (parameter, expected) in [
        (Box::new(factor("attachment `side`")) as Box<dyn Parameter>, Some("attachment `side`")),
        (Box::new(factor("damping of attachment `attachment0`")), None),
        // An energy, and no load.
        (Box::new(LoadFactor::new("attachment `sides`".into())), Some("attachment `sides`")),
    ] {
        let expected = expected.map(named);
        let mut parameters = [parameter];
        let found = gradient(&mut simulation, 1, &mut loss, &mut parameters, UNLIMITED);
        assert_eq!(found.err(), expected);
        let zero = vec![0.0; simulation.state().x().len()];
        let direction = RunDirection { position: &zero, velocity: &zero, parameters: &[vec![1.0]] };
        let found = tangent_along(&mut simulation, 1, direction, &mut parameters, &mut |_, _| {});
        assert_eq!(found.err(), expected);
    }
}
