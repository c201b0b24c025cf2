//! Products with Hessians: symmetric, the whole of the Gauss-Newton matrix where states are linear, and
//! differences of losses.

use pliant::simulation::Simulation;
use pliant_gradient::{
    HessianProduct, LossFrame, RunDirection, RunTangent, UNLIMITED, gauss_newton_product, gradient,
    hessian_product,
};

use crate::solid::{Further, assembled, scene};
use crate::support::{case, dot, scattered, solve_exactly};

const STEPS: u64 = 20;

fn start(material: &str, scheme: &str) -> Simulation {
    let scene = scene(&case("beam")["setup"], material, scheme, STEPS, Further::default());
    let mut simulation = assembled(&scene).0;
    solve_exactly(&mut simulation);
    simulation
}

/// The same with its positions and velocities moved by so much.
fn moved(material: &str, scheme: &str, (by_x, by_v): (&[f64], &[f64])) -> Simulation {
    let mut simulation = start(material, scheme);
    let d = simulation.system().dimension();
    let [dx, dv] = [by_x, by_v].map(|rows| simulation.numbering().to_internal(rows, d).into_owned());
    let state = simulation.state_mut();
    state.x_mut().iter_mut().zip(&dx).for_each(|(x, dx)| *x += dx);
    state.v_mut().iter_mut().zip(&dv).for_each(|(v, dv)| *v += dv);
    simulation
}

/// Half the squares of all positions at every fifth state.
fn squares(frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]) -> f64 {
    if !frame.step.is_multiple_of(5) {
        return 0.0;
    }
    x_bar.copy_from_slice(frame.x);
    0.5 * dot(frame.x, frame.x)
}

fn scaled(h: f64, rows: &[f64]) -> Vec<f64> {
    rows.iter().map(|row| h * row).collect()
}

/// The product with a direction of the positions and velocities at the start.
fn product(material: &str, scheme: &str, (x, v): (&[f64], &[f64])) -> HessianProduct {
    let found = hessian_product(0.1, |h| {
        let mut simulation = moved(material, scheme, (&scaled(h, x), &scaled(h, v)));
        let found = gradient(&mut simulation, STEPS, &mut squares, &mut [], UNLIMITED)?;
        Ok::<_, pliant_gradient::GradientError>([found.position, found.velocity].concat())
    });
    found.unwrap()
}

/// Directions of positions and velocities, zero where held.
fn direction(seed: f64) -> [Vec<f64>; 2] {
    let simulation = start("neo-hookean", "velocity-verlet");
    let weights = simulation.system().inverse_mass();
    let weights = simulation.numbering().to_original(weights, simulation.system().dimension());
    [(0.1, seed), (1.0, seed + 0.5)].map(|(size, seed)| {
        let rows = scattered(weights.len(), seed).into_iter().zip(&*weights);
        rows.map(|(row, weight)| if *weight == 0.0 { 0.0 } else { size * row }).collect()
    })
}

#[test]
fn hessians_are_symmetric_and_differences_of_losses() {
    for scheme in ["velocity-verlet", "implicit-euler", "bdf2"] {
        let [u, w] = [1.0, 2.0].map(direction);
        let [of_u, of_w] = [&u, &w].map(|[x, v]| product("neo-hookean", scheme, (x, v)));
        let [u, w] = [u, w].map(|rows| rows.concat());
        let (one, other) = (dot(&w, &of_u.product), dot(&u, &of_w.product));
        let size = dot(&of_u.product, &of_u.product).sqrt() * dot(&w, &w).sqrt();
        assert!((one - other).abs() <= 1e-9 * size, "{scheme}: {one:e} and {other:e} of {size:e}");
        let least =
            |rows: &[f64], errors: &[f64]| rows.iter().zip(errors).map(|(r, e)| r.abs() * e).sum::<f64>();
        let bound = least(&w, &of_u.errors) + least(&u, &of_w.errors);
        assert!((one - other).abs() <= bound, "{scheme}: {:e} of {bound:e}", one - other);
        assert!(bound <= 1e-6 * size, "{scheme}: {bound:e} of {size:e}");
        let n = u.len() / 2;
        let value = |h: f64| {
            let (x, v) = u.split_at(n);
            let mut simulation = moved("neo-hookean", scheme, (&scaled(h, x), &scaled(h, v)));
            gradient(&mut simulation, STEPS, &mut squares, &mut [], UNLIMITED).unwrap().value
        };
        let (h, along) = (3e-3, dot(&u, &of_u.product));
        let [far, near] = [2.0 * h, h].map(|h| value(h) + value(-h) - 2.0 * value(0.0));
        let second = (16.0 * near - far) / (12.0 * h * h);
        assert!((along / second - 1.0).abs() < 1e-6, "{scheme}: {along:e}, {second:e}");
    }
}

// Positions of the material `linear` are linear in those of the start.
#[test]
fn where_states_are_linear_it_is_the_gauss_newton_product() {
    for scheme in ["velocity-verlet", "implicit-euler"] {
        let [x, v] = direction(1.0);
        let found = product("linear", scheme, (&x, &v));
        let mut curvature = |frame: &LossFrame<'_>, change: &RunTangent, x_bar: &mut [f64], _: &mut [f64]| {
            if frame.step.is_multiple_of(5) {
                x_bar.copy_from_slice(&change.position);
            }
        };
        let direction = RunDirection { position: &x, velocity: &v, parameters: &[] };
        let mut simulation = start("linear", scheme);
        let expected =
            gauss_newton_product(&mut simulation, STEPS, direction, &mut curvature, &mut [], UNLIMITED)
                .unwrap();
        let expected = [expected.position, expected.velocity].concat();
        let largest = expected.iter().fold(0.0, |largest: f64, e| largest.max(e.abs()));
        for (found, expected) in found.product.iter().zip(&expected) {
            assert!((found - expected).abs() <= 1e-11 * largest, "{scheme}: {found:e}, {expected:e}");
        }
        // Of a material that turns with what it is made of it is not.
        let turned = product("neo-hookean", scheme, (&x, &v));
        assert!(turned.product.iter().zip(&expected).any(|(a, b)| (a - b).abs() > 1e-3 * largest));
    }
}
