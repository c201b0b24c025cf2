//! Quadrilaterals and hexahedra, whose stiffness in bending is no linear function of their moduli: against
//! differences of runs.

use pliant_scene::Scene;

use crate::differences::{compare_number, compare_starts};
use crate::support::scene;

/// Sizes of cells along a beam, which is 0.1 m high: as long as high, and narrower.
const LENGTHS: [f64; 2] = [0.1, 0.04];

/// A beam of cells, held at one end, that falls and bends; `material` and further keys of the body.
fn beam(scheme: &str, dimension: usize, length: f64, material: &str, body: &str) -> Scene {
    let (cells, size, element, gravity, velocity) = match dimension {
        2 => ("[3, 2]", format!("[{:?}, 0.2]", 3.0 * length), "quadrilateral", "[0.5, -9.81]", "[0.1, -0.4]"),
        _ => (
            "[2, 2, 1]",
            format!("[{:?}, 0.2, 0.12]", 2.0 * length),
            "hexahedron",
            "[0.5, -9.81, 3.0]",
            "[0.1, -0.4, 0.3]",
        ),
    };
    let held = if dimension == 2 { "[1, 0]" } else { "[1, 0, 0]" };
    let text = format!(
        "[world]
         gravity = {gravity}
         [[body]]
         name = \"beam\"
         mesh = {{ grid = {{ cells = {cells}, size = {size}, element = \"{element}\" }} }}
         elastic = {material}
         mass = {{ density = 1000.0 }}
         velocity = {{ rigid = {{ linear = {velocity} }} }}
         pin = [{{ half_space = {{ normal = {held}, offset = 0 }} }}]
         {body}"
    );
    scene(scheme, dimension, [5e-3, 5e-4], &text)
}

/// The material of this name and of these constants.
fn filled(name: &str, young: f64, poisson: f64) -> String {
    format!("{{ {name} = {{ young = {young:?}, poisson = {poisson:?} }} }}")
}

const YOUNG: &str = "body.beam.elastic.young";
const POISSON: &str = "body.beam.elastic.poisson";

#[test]
fn moduli_of_cells_have_derivatives() {
    for (scheme, dimension, steps) in [
        ("implicit-euler", 2, 12),
        ("implicit-euler", 3, 8),
        ("velocity-verlet", 2, 60),
        ("quasi-static", 3, 1),
    ] {
        for (name, poisson, length) in [
            ("neo-hookean", 0.3, LENGTHS[0]),
            ("neo-hookean", 0.45, LENGTHS[1]),
            ("stable-neo-hookean", 0.3, LENGTHS[1]),
            ("linear", 0.45, LENGTHS[0]),
            ("linear", 0.3, LENGTHS[1]),
        ] {
            let what = format!("{scheme} in {dimension}D, {name} of {poisson}, {length} m");
            let of_young = |young| beam(scheme, dimension, length, &filled(name, young, poisson), "");
            compare_number(&what, of_young, (YOUNG, 5e4, 5e4), (steps, 1e-6));
            let of_poisson = |poisson| beam(scheme, dimension, length, &filled(name, 5e4, poisson), "");
            compare_number(&what, of_poisson, (POISSON, poisson, 0.1), (steps, 1e-6));
        }
    }
}

/// Viscosities of both kinds.
fn viscous(shear: f64, second: f64, beta: f64) -> String {
    format!(
        "damping = {{ strain_rate = {{ shear = {shear:?}, second = {second:?} }}, stiffness_proportional = \
         {beta:?} }}"
    )
}

#[test]
fn viscosities_of_cells_have_derivatives() {
    for (scheme, dimension, steps) in
        [("implicit-euler", 2, 12), ("implicit-euler", 3, 6), ("velocity-verlet", 2, 60)]
    {
        for (name, poisson, length) in
            [("neo-hookean", 0.3, LENGTHS[0]), ("neo-hookean", 0.45, LENGTHS[1]), ("linear", 0.3, LENGTHS[1])]
        {
            let what = format!("{scheme} in {dimension}D, {name} of {poisson}, {length} m");
            let of = |young: f64, poisson: f64, [shear, second, beta]: [f64; 3]| {
                let material = filled(name, young, poisson);
                beam(scheme, dimension, length, &material, &viscous(shear, second, beta))
            };
            let compare = |of: &dyn Fn(f64) -> Scene, key: &str, value: f64, size: f64| {
                compare_number(&what, of, (&format!("body.beam.{key}"), value, size), (steps, 1e-6));
            };
            let damping = [20.0, 12.0, 4e-3];
            compare(&|young| of(young, poisson, damping), "elastic.young", 5e4, 5e4);
            compare(&|poisson| of(5e4, poisson, damping), "elastic.poisson", poisson, 0.1);
            let with = |change: [f64; 3]| of(5e4, poisson, change);
            compare(&|shear| with([shear, 12.0, 4e-3]), "damping.strain_rate.shear", 20.0, 50.0);
            compare(&|second| with([20.0, second, 4e-3]), "damping.strain_rate.second", 12.0, 50.0);
            compare(&|beta| with([20.0, 12.0, beta]), "damping.stiffness_proportional", 4e-3, 4e-3);
        }
    }
    let scene =
        beam("implicit-euler", 3, LENGTHS[1], &filled("neo-hookean", 5e4, 0.3), &viscous(20.0, 12.0, 4e-3));
    compare_starts("hexahedra", &scene, (6, 1e-7), |_| true);
}

#[test]
fn numbers_of_cells_of_second_order_have_derivatives() {
    for (scheme, dimension, steps) in [
        ("implicit-euler", 2, 8),
        ("implicit-euler", 3, 3),
        ("velocity-verlet", 2, 40),
        ("quasi-static", 3, 1),
    ] {
        for serendipity in [false, true] {
            let what = format!("{scheme} in {dimension}D, serendipity {serendipity}");
            let of = |young: f64, poisson: f64, shear: f64| {
                let damping =
                    if scheme == "quasi-static" { String::new() } else { viscous(shear, 12.0, 0.0) };
                let body = format!("order = 2\nserendipity = {serendipity}\n{damping}");
                beam(scheme, dimension, LENGTHS[0], &filled("neo-hookean", young, poisson), &body)
            };
            compare_number(&what, |young| of(young, 0.4, 20.0), (YOUNG, 5e4, 5e4), (steps, 1e-6));
            compare_number(&what, |poisson| of(5e4, poisson, 20.0), (POISSON, 0.4, 0.1), (steps, 1e-6));
            if scheme != "quasi-static" {
                let key = "body.beam.damping.strain_rate.shear";
                compare_number(&what, |shear| of(5e4, 0.4, shear), (key, 20.0, 50.0), (steps, 1e-6));
            }
        }
    }
}
