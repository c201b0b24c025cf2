//! Implicit Euler with one Newton step, whose derivative has third derivatives of energies; the chain of
//! springs is compared with complex steps in `chain`.

use pliant_gradient::{LossFrame, UNLIMITED, check, gradient};
use pliant_scene::Scene;

use crate::differences::{compare_number, compare_starts};
use crate::solid::assembled;
use crate::tangents::compare_with_tangents;

/// A beam that falls and bends, held at one end; further keys of the world, of its pin and of the body.
fn beam(young: f64, [world, pin, further]: [&str; 3]) -> Scene {
    let text = format!(
        "dimension = 2
         [time]
         integrator = \"linearised-implicit-euler\"
         duration = 1.0
         step = 0.01
         [world]
         gravity = [0.7, -9.81]
         {world}
         [[body]]
         name = \"beam\"
         mesh = {{ grid = {{ cells = [4, 1], size = [1.0, 0.25] }} }}
         elastic = {{ stable-neo-hookean = {{ young = {young:?}, poisson = 0.35 }} }}
         mass = {{ density = 1000.0 }}
         velocity = {{ rigid = {{ linear = [0.3, -0.8] }} }}
         pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }}, {pin} }}]
         {further}"
    );
    Scene::from_toml(&text).unwrap()
}

#[test]
fn linearised_steps_have_derivatives() {
    let damped = "damping = { mass_proportional = 0.4, stiffness_proportional = 5e-3 }";
    for keys in [
        ["", "", ""],
        ["", "", damped],
        ["ether_drag = 0.8", "", damped],
        ["", "motion = { displacement = [\"0\", \"0.05*sin(12*t)\"] }", ""],
        ["", "until = 0.05", ""],
        ["walls = [{ normal = [0, 1], offset = -0.03 }]", "", ""],
    ] {
        let what = format!("{keys:?}");
        let scene = |young| beam(young, keys);
        compare_starts(&what, &scene(5e4), (15, 1e-6), |_| true);
        compare_with_tangents(&what, &scene(5e4), 15);
        compare_number(&what, scene, ("body.beam.elastic.young", 5e4, 5e4), (15, 1e-6));
    }
    let gravity = |g: f64| beam(5e4, [&format!("ether_drag = {g:?}"), "", damped]);
    compare_number("drag", gravity, ("world.ether_drag", 0.8, 0.8), (15, 1e-6));
}

#[test]
fn linearised_steps_with_another_matrix_are_refused() {
    let refusal = |scene: &Scene| check(&mut assembled(scene).0).unwrap_err().to_string();
    let pressed = beam(5e4, ["", "", "load = [{ pressure = '900*(1 + X)' }]"]);
    assert!(refusal(&pressed).starts_with("there is no derivative of linearised steps with "));
    let moved = "motion = { displacement = [\"0\", \"0.05*t\"] }";
    let both = beam(5e4, ["", moved, "damping = { stiffness_proportional = 5e-3 }"]);
    assert!(refusal(&both).contains("with damping and prescribed motion"), "{}", refusal(&both));
    // Compressed to a third of its length.
    let squeezed = "position = { affine = { matrix = [[0.3, 0], [0, 1]] } }";
    let mut simulation = assembled(&beam(1e7, ["", "", squeezed])).0;
    let mut nothing = |_: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| 0.0;
    let error = gradient(&mut simulation, 1, &mut nothing, &mut [], UNLIMITED).unwrap_err().to_string();
    assert!(error.contains("the linearised step 1, whose matrix is not positive definite"), "{error}");
}
