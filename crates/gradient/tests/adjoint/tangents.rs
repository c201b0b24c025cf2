//! Tangents against adjoints, which are compared with derivatives by complex steps: `w . (S u) = (S^T w) .
//! u`.

use pliant_gradient::{LossFrame, UNLIMITED, gradient, tangent};
use pliant_scene::Scene;

use crate::solid::{Further, assembled, scene};
use crate::support::{case, dot, scattered, schemes};

/// Compares both sides for a solid of the reference.
fn compare(setup: &str, scheme: &str, steps: u64, further: Further) {
    let scene = scene(&case(setup)["setup"], "neo-hookean", scheme, steps, further);
    compare_with_tangents(&format!("{setup}, {scheme}"), &scene, steps);
}

/// The same for any scene; the loss looks at a state on the way, too.
pub(crate) fn compare_with_tangents(what: &str, scene: &Scene, steps: u64) {
    let start = || assembled(scene).0;
    let n = start().state().x().len();
    let [x_dot, v_dot, w_x, w_v, w_middle] = [1.0, 2.0, 3.0, 4.0, 5.0].map(|seed| scattered(n, seed));
    let middle = steps / 2;
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]| {
        let mut value = 0.0;
        if frame.step == steps {
            x_bar.copy_from_slice(&w_x);
            v_bar.copy_from_slice(&w_v);
            value += dot(&w_x, frame.x) + dot(&w_v, frame.v);
        }
        if frame.step == middle {
            x_bar.iter_mut().zip(&w_middle).for_each(|(bar, w)| *bar += w);
            value += dot(&w_middle, frame.x);
        }
        value
    };
    let back = gradient(&mut start(), steps, &mut loss, &mut [], UNLIMITED).unwrap();
    let (mut at_middle, mut frames) = (vec![], 0);
    let mut simulation = start();
    let forth = tangent(&mut simulation, steps, (&x_dot, &v_dot), &mut |frame, dots| {
        frames += 1;
        if frame.step == middle {
            at_middle.clone_from(&dots.position);
        }
    });
    let forth = forth.unwrap();
    assert_eq!(frames, steps + 1);
    let forwards = dot(&w_x, &forth.position) + dot(&w_v, &forth.velocity) + dot(&w_middle, &at_middle);
    let backwards = dot(&back.position, &x_dot) + dot(&back.velocity, &v_dot);
    let sizes = [&forth.position, &forth.velocity, &at_middle].map(|dots| dot(dots, dots).sqrt());
    let size = sizes.iter().sum::<f64>() * (n as f64).sqrt();
    let error = (forwards - backwards).abs();
    assert!(error <= 1e-12 * size, "{what}: {forwards:e} and {backwards:e}: {:e}", error / size);
    assert!(forwards.abs() > 1e-3 * size, "{what}: nothing to compare");
}

// The adjoint is the transpose of the tangent, scheme by scheme.
#[test]
fn tangents_and_adjoints_of_all_schemes_agree() {
    let schemes = schemes();
    assert!(schemes.len() > 15, "{schemes:?}");
    for scheme in schemes {
        let steps = if scheme == "quasi-static" { 1 } else { 20 };
        compare("beam", scheme, steps, Further::default());
    }
    for scheme in ["velocity-verlet", "tr-bdf2", "bdf2", "generalised-alpha(.5)", "gauss2"] {
        compare("box", scheme, 10, Further::default());
    }
}

#[test]
fn damping_and_moved_pins_have_tangents() {
    let pin = "motion = { displacement = [\"0\", \"0.05*sin(12*t)\"] }";
    for scheme in [
        "velocity-verlet",
        "yoshida4",
        "rk4",
        "implicit-euler",
        "bdf2",
        "newmark(.3025,.6)",
        "gauss2",
        "radau-iia3",
        "ias15",
    ] {
        let (world, body) = ("ether_drag = 0.8", "damping = { mass_proportional = 1.5 }");
        compare("beam", scheme, 20, Further { world, body, pin });
        compare("beam", scheme, 20, Further { world, ..Further::default() });
        // Damping that follows positions: its matrix is not symmetric.
        let body =
            "damping = { stiffness_proportional = 0.004, strain_rate = { shear = 20.0, second = 10.0 } }";
        compare("beam", scheme, 20, Further { world, body, pin });
        compare("box", scheme, 8, Further { body, ..Further::default() });
    }
}
