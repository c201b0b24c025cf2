//! Constants of a material from the way of a vertex, by derivatives of the run.

use pliant_gradient::{LossFrame, ParameterSelection, UNLIMITED, gradient};

use crate::solid::{Further, assembled, scene};
use crate::support::case;

const STEPS: u64 = 20;
const TIP: usize = 7;

/// Components of the tip at two times, and their derivatives by Young's modulus and Poisson's ratio.
fn film(young: f64, poisson: f64) -> ([f64; 4], [[f64; 2]; 4]) {
    let mut setup = case("beam")["setup"].clone();
    (setup["young"], setup["poisson"]) = ([young].to_vec().into(), [poisson].to_vec().into());
    let (mut values, mut derivatives) = ([0.0; 4], [[0.0; 2]; 4]);
    for i in 0..4 {
        let scene = scene(&setup, "neo-hookean", "velocity-verlet", STEPS, Further::default());
        let (mut simulation, topology) = assembled(&scene);
        let names = ["body.beam.elastic.young", "body.beam.elastic.poisson"];
        let mut selection =
            ParameterSelection::new(&scene, &topology, simulation.numbering(), &names).unwrap();
        let (step, component) = (if i < 2 { STEPS / 2 } else { STEPS }, 2 * TIP + i % 2);
        let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
            if frame.step != step {
                return 0.0;
            }
            x_bar[component] = 1.0;
            frame.x[component]
        };
        let found = gradient(&mut simulation, STEPS, &mut loss, selection.parameters(), UNLIMITED).unwrap();
        let parts = selection.parts(&found);
        (values[i], derivatives[i]) = (found.value, [parts[0][0], parts[1][0]]);
    }
    (values, derivatives)
}

/// Gauss-Newton's step of the residuals `r` with the Jacobian `j`, by the normal equations of scaled
/// unknowns.
fn step(r: &[f64; 4], j: &[[f64; 2]; 4], scale: [f64; 2]) -> [f64; 2] {
    let column = |k: usize| j.map(|row| row[k] * scale[k]);
    let dot = |a: &[f64; 4], b: &[f64; 4]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (a, b) = (column(0), column(1));
    let (aa, ab, bb, ar, br) = (dot(&a, &a), dot(&a, &b), dot(&b, &b), dot(&a, r), dot(&b, r));
    let determinant = aa * bb - ab * ab;
    [scale[0] * (bb * ar - ab * br) / determinant, scale[1] * (aa * br - ab * ar) / determinant]
}

// Data without noise has the constants as the only ones that leave no residual; Newton's convergence near
// them.
#[test]
fn young_and_poisson_of_a_beam_are_found_again_from_its_film() {
    let (data, _) = film(5e4, 0.35);
    let (mut young, mut poisson) = (6e4, 0.3);
    for _ in 0..8 {
        let (values, j) = film(young, poisson);
        let r: [f64; 4] = std::array::from_fn(|i| values[i] - data[i]);
        let [by_young, by_poisson] = step(&r, &j, [young, poisson]);
        (young, poisson) = (young - by_young, poisson - by_poisson);
    }
    assert!((young / 5e4 - 1.0).abs() < 1e-9 && (poisson / 0.35 - 1.0).abs() < 1e-9, "{young}, {poisson}");
}
