//! Pressure that follows surfaces: without an energy where their rim moves, with a Hessian that is not
//! symmetric.

use pliant_scene::Scene;

use crate::differences::{compare_number, compare_starts};
use crate::solid::assembled;
use crate::support::scene;
use crate::tangents::compare_with_tangents;

/// A block, held at one end, pressed from above by `pressure`; in 2D or in 3D, of elements of this order.
fn pressed(scheme: &str, dimension: usize, order: u32, young: f64, pressure: &str) -> Scene {
    let (cells, size, gravity, held, above) = match dimension {
        2 => ("[3, 1]", "[0.9, 0.3]", "[0.7, -9.81]", "[1, 0]", "{ normal = [0, -1], offset = -0.29 }"),
        _ => (
            "[2, 1, 1]",
            "[0.8, 0.3, 0.4]",
            "[0.7, -9.81, 2.0]",
            "[1, 0, 0]",
            "{ normal = [0, -1, 0], offset = -0.29 }",
        ),
    };
    let text = format!(
        "[world]
         gravity = {gravity}
         [[body]]
         name = \"block\"
         mesh = {{ grid = {{ cells = {cells}, size = {size} }} }}
         order = {order}
         elastic = {{ neo-hookean = {{ young = {young:?}, poisson = 0.35 }} }}
         mass = {{ density = 1000.0 }}
         pin = [{{ half_space = {{ normal = {held}, offset = 0 }} }}]
         load = [{{ half_space = {above}, pressure = {pressure} }}]"
    );
    scene(scheme, dimension, [0.01, 1e-3], &text)
}

#[test]
fn pressure_without_an_energy_has_derivatives() {
    for (scheme, steps) in [
        ("velocity-verlet", 40),
        ("rk4", 40),
        ("implicit-euler", 12),
        ("tr-bdf2", 12),
        ("bdf2", 12),
        ("newmark", 12),
        ("gauss2", 8),
        ("quasi-static", 2),
    ] {
        let by_place = "\"4e3*(1 + X)*cos(9*t)\"";
        for (dimension, order, pressure) in [(2, 1, by_place), (2, 2, "6e3"), (3, 1, by_place)] {
            let what = format!("{scheme} in {dimension}D of order {order}");
            let scene = pressed(scheme, dimension, order, 2e5, pressure);
            let is_conservative = |term: &dyn pliant::energy::EnergyTerm| term.properties().is_conservative;
            assert!(!assembled(&scene).0.system().terms().iter().all(|term| is_conservative(&**term)));
            compare_starts(&what, &scene, (steps, 1e-6), |_| true);
            compare_with_tangents(&what, &scene, steps);
            let young = |young| pressed(scheme, dimension, order, young, pressure);
            compare_number(&what, young, ("body.block.elastic.young", 2e5, 2e5), (steps, 1e-6));
        }
        let by = |p: f64| pressed(scheme, 2, 1, 2e5, &format!("\"p*(1 + X) where p = {p:?}\""));
        compare_number(scheme, by, ("body.block.load.0.parameters.p", 4e3, 4e3), (steps, 1e-6));
    }
}
