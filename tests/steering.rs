//! Pins that are steered while a simulation runs (lecture 21).

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use pliant::constraint::Waypoint;
use pliant::simulation::{MoveError, Simulation};
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// A bar in space with a clamp at its left; `keys` of time, `pin` beside its place.
fn bar(keys: &str, pin: &str) -> Simulation {
    let text = format!(
        "dimension = 3\ntime = {{ {keys}, duration = 1.0 }}\n[[body]]\nname = 'arm'\n\
         mesh = {{ grid = {{ cells = [2, 1, 1], spacing = 0.1 }} }}\n\
         elastic = {{ stable-neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}\nmass = {{ density = 1000.0 \
         }}\n\
         pin = [{{ name = 'clamp', half_space = {{ normal = [1.0, 0.0, 0.0], offset = 1e-9 }}{pin} }}]\n"
    );
    Scene::from_toml(&text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap().simulation
}

const CLAMP: &str = "arm/clamp";

fn target() -> Waypoint {
    Waypoint {
        pose: Isometry3::new(Vector3::new(0.02, -0.01, 0.03), Vector3::new(0.4, 0.1, -0.2)),
        velocity: Vector3::new(0.1, 0.0, -0.2),
        angular_velocity: Vector3::new(0.0, 1.0, 0.5),
    }
}

/// Positions of the vertices of the clamp, and their velocities.
fn clamp(simulation: &Simulation) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let rest = bar("integrator = 'rk4', step = 1e-4", "");
    let held: Vec<usize> = (0..12).filter(|i| rest.positions()[3 * i] < 0.01).collect();
    assert_eq!(held.len(), 4);
    let of = |rows: &[f64]| held.iter().map(|i| Vector3::from_column_slice(&rows[3 * i..][..3])).collect();
    (of(&simulation.positions()), of(&simulation.velocities()))
}

fn go(simulation: &mut Simulation, steps: usize) {
    (0..steps).for_each(|_| simulation.step().unwrap());
}

/// `x = c + u + R (X - c)` and `v = u' + w x R (X - c)` on arrival, and afterwards with constant velocities.
#[test]
fn a_pin_arrives_where_it_is_sent_and_goes_on() {
    for keys in ["integrator = 'rk4', step = 1e-4", "integrator = 'implicit-midpoint', step = 1e-3"] {
        let mut simulation = bar(keys, "");
        let (starts, _) = clamp(&simulation);
        simulation.move_pin(CLAMP, target(), 0.02).unwrap();
        let steps = (0.02 / simulation.step_size()).round() as usize;
        go(&mut simulation, steps);
        let mut way = target();
        for later in [0.0, 0.02] {
            let c: Vector3<f64> = starts.iter().sum::<Vector3<f64>>() / 4.0;
            let (x, v) = clamp(&simulation);
            for ((start, x), v) in starts.iter().zip(x).zip(v) {
                let arm = way.pose.rotation * (start - c);
                let place = c + way.pose.translation.vector + arm;
                assert!((x - place).norm() < 1e-12, "{keys}, {later} s later: {x} and {place}");
                let velocity = way.velocity + way.angular_velocity.cross(&arm);
                assert!((v - velocity).norm() < 1e-11, "{keys}, {later} s later: {v} and {velocity}");
            }
            go(&mut simulation, steps);
            // The displacement grows with v t, the rotation with w t.
            way.pose.translation.vector += 0.02 * way.velocity;
            way.pose.rotation =
                UnitQuaternion::from_scaled_axis(0.02 * way.angular_velocity) * way.pose.rotation;
        }
    }
}

/// In the middle of its way, and from a motion of the scene: the next step goes as far as the velocities say.
#[test]
fn nothing_jumps_where_a_pin_is_steered_anew() {
    let turning =
        ", motion = { rotation = { axis = [0.0, 0.0, 1.0], point = [0.1, 0.0, 0.0], angle = '2*t + t^2' } }";
    for (pin, sent) in [("", true), (turning, false)] {
        let mut simulation = bar("integrator = 'rk4', step = 1e-4", pin);
        if sent {
            simulation.move_pin(CLAMP, target(), 0.02).unwrap();
        }
        go(&mut simulation, 100);
        let before = clamp(&simulation);
        let away = Waypoint::at_rest(Isometry3::translation(0.0, 0.05, 0.0));
        simulation.move_pin(CLAMP, away, 0.05).unwrap();
        assert_eq!(clamp(&simulation), before);
        go(&mut simulation, 1);
        let after = clamp(&simulation);
        for (((x, v), y), w) in before.0.iter().zip(&before.1).zip(&after.0).zip(&after.1) {
            // Accelerations are below 1e3 m/s^2 here: 2 (1 m / (0.05 s)^2).
            assert!((w - v).norm() < 0.1, "{v} then {w}");
            assert!((y - x - 0.5e-4 * (v + w)).norm() < 1e-8, "{x} then {y}");
        }
    }
}

/// Resumed is never stopped, in the middle of a way too; going back ends it.
#[test]
fn checkpoints_know_of_ways_and_earlier_states_end_them() {
    for scheme in ["'rk4', step = 1e-4", "{ bdf2 = {} }, step = 1e-3"] {
        let keys = format!("integrator = {scheme}");
        let mut simulation = bar(&keys, "");
        let start = simulation.snapshot();
        go(&mut simulation, 2);
        simulation.move_pin(CLAMP, target(), 0.02).unwrap();
        go(&mut simulation, 3);
        let checkpoint = simulation.checkpoint();
        let mut resumed = bar(&keys, "");
        resumed.resume(&checkpoint).unwrap();
        go(&mut simulation, 30);
        go(&mut resumed, 30);
        assert_eq!(resumed.snapshot(), simulation.snapshot(), "{scheme}");
        resumed.restore(&start).unwrap();
        assert!(resumed.drives().is_empty());
        go(&mut resumed, 10);
        assert_eq!(clamp(&resumed).0, clamp(&bar(&keys, "")).0, "{scheme}");
    }
}

/// Work of the clamp on the body is the energy that comes in.
#[test]
fn the_balance_of_energy_closes_over_a_way() {
    let mut simulation = bar("integrator = 'rk4', step = 5e-5", "");
    simulation.move_pin(CLAMP, target(), 0.02).unwrap();
    let mut largest: f64 = 0.0;
    for _ in 0..60 {
        go(&mut simulation, 10);
        let found = simulation.diagnostics();
        let energy = found.kinetic + found.elastic;
        largest = largest.max(energy);
        let balance = found.balance.as_ref().unwrap();
        // RK4 leaves h^4; the books are of second order in time: 1e-4 of the way's 400 steps squared.
        assert!((energy - balance.motion.unwrap()).abs() < 2e-4 * largest, "{energy} J, {balance:?}");
    }
    assert!(largest > 1e-3, "{largest} J");
}

#[test]
fn what_cannot_be_steered_is_said() {
    let mut simulation = bar("integrator = 'rk4', step = 1e-4", ", until = 0.001");
    let error = simulation.move_pin("arm/grip", target(), 0.1).unwrap_err();
    assert_eq!(error.to_string(), "there is no pin `arm/grip` that holds; there are [\"arm/clamp\"]");
    let lost = Waypoint { velocity: Vector3::new(f64::NAN, 0.0, 0.0), ..target() };
    assert!(matches!(simulation.move_pin(CLAMP, lost, 0.1), Err(MoveError::NotFinite { .. })));
    for over in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(simulation.move_pin(CLAMP, target(), over), Err(MoveError::Time { .. })));
    }
    assert!(simulation.drives().is_empty());
    go(&mut simulation, 20);
    assert!(matches!(simulation.move_pin(CLAMP, target(), 0.1), Err(MoveError::NoPin { .. })));
}
