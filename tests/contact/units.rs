//! Contact knows no units: `x -> s x`, `v -> v` under `L -> s L`, `t -> s t`, `g -> g / s`; nothing changes
//! under `E -> r E`, `rho -> r rho`.

use pliant::integrator::IntegratorSpec;

use super::particle::FallingParticle;

/// Lengths and times, and stiffnesses and densities: as they are, then in other units.
const UNITS: [[f64; 2]; 5] = [[1.0, 1.0], [1e-6, 1.0], [1e4, 1.0], [1.0, 1e6], [1e4, 1e-6]];

/// The largest difference of two lists over the largest number of the first.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / largest
}

/// Two soft bodies collide and part, with friction as well, in steps that are solved to rounding.
#[test]
fn a_collision_is_the_same_in_all_units() {
    for (integrator, step, friction) in
        [("'implicit-euler'", 2e-3, 0.0), ("'bdf2'", 2e-3, 0.4), ("'tr-bdf2'", 2e-3, 0.0)]
    {
        let run = |[s, r]: [f64; 2]| {
            let keys = format!("stiffness = {:?}, friction = {friction:?}, threshold_speed = 0.01", r * 1e4);
            let text = super::collision::scaled(integrator, step, [s, r], &keys);
            let mut simulation = super::assembled(&text).simulation;
            super::advance(&mut simulation, (0.2 / step).round() as usize);
            let x: Vec<f64> = simulation.positions().iter().map(|x| x / s).collect();
            (x, simulation.velocities().into_owned())
        };
        let (x, v) = run(UNITS[0]);
        for units in UNITS {
            let (other, fast) = run(units);
            let (of_x, of_v) = (apart(&x, &other), apart(&v, &fast));
            assert!(of_x < 1e-9 && of_v < 1e-7, "{integrator} in {units:?}: {of_x:e} of x, {of_v:e} of v");
        }
    }
}

/// What sticks on an incline, and what slides down.
#[test]
fn friction_is_the_same_in_all_units() {
    let (sin, cos) = (1.0 / 5f64.sqrt(), 2.0 / 5f64.sqrt());
    for friction in [0.49, 0.6] {
        let run = |[s, r]: [f64; 2]| {
            // A metre deep, as bodies in the plane are: masses go as areas, forces as lengths.
            let particle = FallingParticle {
                mass: r * s * s,
                stiffness: 1000.0 * r * s,
                reach: 0.01 * s,
                gravity: [9.81 * sin / s, -9.81 * cos / s],
                height: 0.0099 * s,
                velocity: [0.0, 0.0],
                friction,
                threshold: 1e-3,
            };
            let mut simulation = particle.simulation_to(&IntegratorSpec::ImplicitEuler, 0.01 * s, 1e-14 * s);
            super::advance(&mut simulation, 100);
            let x: Vec<f64> = simulation.state().x()[..2].iter().map(|x| x / s).collect();
            (x, simulation.state().v()[..2].to_vec())
        };
        let (x, v) = run(UNITS[0]);
        for units in UNITS {
            let (other, fast) = run(units);
            let (of_x, of_v) = (apart(&x, &other), apart(&v, &fast));
            assert!(of_x < 1e-9 && of_v < 1e-9, "mu {friction} in {units:?}: {of_x:e} of x, {of_v:e} of v");
        }
    }
}
