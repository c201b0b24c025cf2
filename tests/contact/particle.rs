//! A particle that falls on a half-space: the simplest contact, with answers from quadratures.

use std::sync::Arc;

use pliant::energy::gravity::UniformGravity;
use pliant::integrator::IntegratorSpec;
use pliant::integrator::generalised_alpha::GeneralisedAlphaParameters;
use pliant::simulation::Simulation;
use pliant::solver::SolverOptions;
use pliant::state::State;
use pliant::system::System;
use pliant_contact::barrier::{Barrier, PotentialForm};
use pliant_contact::candidates::BodyPairs;
use pliant_contact::energy::ContactEnergy;
use pliant_contact::friction_term::FrictionTerm;
use pliant_contact::model::{ContactLaw, ContactLaws, ContactModel, Duplicates, SolidHalfSpace};
use pliant_contact::surface::{ContactSurface, VertexKind};

/// A particle above a half-space.
pub(crate) struct FallingParticle {
    pub(crate) mass: f64,
    /// `kappa w` [N].
    pub(crate) stiffness: f64,
    pub(crate) reach: f64,
    pub(crate) gravity: [f64; 2],
    pub(crate) height: f64,
    pub(crate) velocity: [f64; 2],
    pub(crate) friction: f64,
    pub(crate) threshold: f64,
}

impl FallingParticle {
    /// Vertex 0 falls, vertex 1 is the half-space's.
    pub(crate) fn simulation(&self, scheme: &IntegratorSpec, step: f64) -> Simulation {
        self.simulation_to(scheme, step, 1e-14)
    }

    /// The same, solved until corrections are below `tolerance` [m].
    pub(crate) fn simulation_to(&self, scheme: &IntegratorSpec, step: f64, tolerance: f64) -> Simulation {
        // Explicit schemes have the form without a pole, as scenes have it.
        let form = match scheme.method().documentation.solves {
            0 => PotentialForm::Cubic,
            _ => PotentialForm::Barrier,
        };
        let barrier = Barrier { form, stiffness: self.stiffness, reach: self.reach, offset: 0.0 };
        let law = ContactLaw { barrier, friction: self.friction };
        let surface = ContactSurface {
            dimension: 2,
            vertices: vec![0],
            vertex_areas: vec![1.0, 0.0],
            bodies: vec![0, 1],
            kinds: vec![VertexKind::Particle; 2],
            inner_vertices: vec![true; 2],
            ..ContactSurface::default()
        };
        let model = ContactModel {
            surface,
            half_spaces: vec![SolidHalfSpace { vertex: 1, normal: [0.0, 1.0, 0.0], depth: 0.0, body: 1 }],
            balls: vec![],
            pairs: BodyPairs::all(2),
            laws: ContactLaws::new(2, |_, _| law),
            duplicates: Duplicates::Max,
            threshold_speed: self.threshold,
            friction_iterations: 20,
            shortened: vec![],
            names: vec!["particle".into(), "floor".into()],
            labels: vec![0, 0],
        };
        let mut system = System::new(2, vec![self.mass, 0.0]);
        system.pin(&[1]);
        system.add_term(Box::new(UniformGravity::new(&self.gravity, &[self.mass, 0.0])));
        let energy = ContactEnergy::<2>::new(Arc::new(model));
        if self.friction > 0.0 {
            let mut friction = FrictionTerm::new(&energy);
            if form == PotentialForm::Cubic {
                friction.raise_threshold(step, &[self.mass, 0.0]);
            }
            system.add_dissipation(Box::new(friction));
        }
        system.add_term(Box::new(energy));
        let [vx, vy] = self.velocity;
        let state = State::new(vec![0.0, self.height, 0.0, 0.0], vec![vx, vy, 0.0, 0.0]);
        let mut simulation = Simulation::new(system, state, scheme.method(), step);
        simulation.set_solver(SolverOptions { tolerance: Some(tolerance), ..SolverOptions::default() });
        simulation
    }
}

/// Case A of the references.
pub(crate) fn falls_from_half_a_metre() -> FallingParticle {
    FallingParticle {
        mass: 1.0,
        stiffness: 1000.0,
        reach: 0.01,
        gravity: [0.0, -9.81],
        height: 0.51,
        velocity: [0.0, 0.0],
        friction: 0.0,
        threshold: 1e-3,
    }
}

/// By quadrature of the energy, and by an integration of order 8: both agree to the digits given.
#[test]
fn a_particle_bounces_as_the_quadrature_says() {
    let mut simulation = falls_from_half_a_metre().simulation(&IntegratorSpec::TrBdf2, 1e-5);
    let mut at = 0;
    for (steps, y, v) in
        [(32_200, 0.006712923668451, 2.250140648854), (100_000, 0.1120992220696, 2.79406751225)]
    {
        super::advance(&mut simulation, steps - at);
        at = steps;
        let (x, velocity) = (simulation.state().x()[1], simulation.state().v()[1]);
        assert!((x - y).abs() < 1e-5 * 3.0, "at step {steps}: {x}, not {y}");
        assert!((velocity - v).abs() < 1e-5 * 3.0 * 100.0, "at step {steps}: {velocity}, not {v}");
    }
}

/// Fall of a particle on a floor: speed at contact, least gap, duration of contact, speed after it.
fn impact(particle: &FallingParticle, h: f64) -> [f64; 4] {
    let mut simulation = particle.simulation(&IntegratorSpec::TrBdf2, h);
    let (reach, fall) = (particle.reach, -particle.gravity[1]);
    let state = |simulation: &Simulation| {
        let state = simulation.state();
        (state.time, state.x()[1], state.v()[1])
    };
    // Of free flight through the border of the layer, from a place above it: its speed, and when.
    let border = |(time, y, v): (f64, f64, f64)| {
        let speed = (v * v + 2.0 * fall * (y - reach)).sqrt();
        // 2 (y - reach) / (speed + |v|) is the time between both, whatever the fall.
        (speed, time - v.signum() * 2.0 * (y - reach) / (speed + v.abs()))
    };
    let (mut least, mut before) = (f64::INFINITY, state(&simulation));
    while before.1 > reach {
        let last = before;
        super::advance(&mut simulation, 1);
        before = state(&simulation);
        if before.1 <= reach {
            let (speed, start) = border(last);
            let mut now = before;
            while now.1 <= reach {
                least = least.min(now.1);
                super::advance(&mut simulation, 1);
                now = state(&simulation);
            }
            let (after, end) = border(now);
            return [speed, least, end - start, after];
        }
    }
    panic!("it starts in contact")
}

/// By quadrature of the energy: under gravity, and without.
#[test]
fn an_impact_lasts_and_turns_as_the_quadrature_says() {
    let falls = falls_from_half_a_metre();
    let flies = FallingParticle {
        mass: 0.2,
        stiffness: 50.0,
        reach: 0.002,
        gravity: [0.0, 0.0],
        height: 0.01,
        velocity: [0.0, -1.5],
        ..falls_from_half_a_metre()
    };
    let expected = [
        (&falls, [3.132091952673, 0.005753795388865, 0.0038582926376, 3.132091952673]),
        (&flies, [1.5, f64::NAN, 0.0027644200689, 1.5]),
    ];
    for (particle, expected) in expected {
        let found = impact(particle, 1e-5);
        for (found, expected) in found.into_iter().zip(expected).filter(|(_, expected)| !expected.is_nan()) {
            assert!((found / expected - 1.0).abs() < 1e-5, "{found}, not {expected}");
        }
    }
}

#[test]
fn a_particle_at_rest_is_where_the_barrier_carries_it() {
    let falls = FallingParticle { height: 0.0099, ..falls_from_half_a_metre() };
    let mut simulation = falls.simulation(&IntegratorSpec::QuasiStatic, 0.1);
    super::advance(&mut simulation, 1);
    let y = simulation.state().x()[1];
    assert!((y - 0.009796444424245).abs() < 1e-12, "{y}");
    // About that place it oscillates, and explicit steps are bound by it.
    simulation.set_method(IntegratorSpec::SymplecticEuler.method());
    let limit = simulation.stability_limit(1.0).unwrap();
    assert!((limit.frequency / 309.401396 - 1.0).abs() < 1e-8, "{limit:?}");
    assert!((limit.step / 0.0064640949 - 1.0).abs() < 1e-7, "{limit:?}");
}

/// Restitution and the largest energy over the first, of the phase `k / 20` of a step.
fn rebound(scheme: &IntegratorSpec, h: f64, k: usize) -> [f64; 2] {
    let falls = falls_from_half_a_metre();
    // Free fall to just above the layer, at a phase of the steps.
    let t = (2.0 * (0.51 - 0.0101) / 9.81f64).sqrt() - h * k as f64 / 20.0 - h;
    let (height, speed) = (0.51 - 0.5 * 9.81 * t * t, -9.81 * t);
    let start = FallingParticle { height, velocity: [0.0, speed], ..falls };
    let mut simulation = match scheme.method().documentation.solves {
        // The barrier too, by a scheme that has another law by itself.
        0 => {
            let mut simulation = start.simulation(&IntegratorSpec::ImplicitEuler, h);
            simulation.set_method(scheme.method());
            simulation
        }
        _ => start.simulation(scheme, h),
    };
    let first = super::conserved(&mut simulation);
    let (mut largest, mut end): (f64, f64) = (first, first);
    let mut touched = false;
    for _ in 0..(0.06 / h) as usize + 12 {
        super::advance(&mut simulation, 1);
        end = super::conserved(&mut simulation);
        largest = largest.max(end);
        let (y, v) = (simulation.state().x()[1], simulation.state().v()[1]);
        touched |= y < 0.01;
        if touched && y > 0.01 && v > 0.0 {
            break;
        }
    }
    // Heights of the centre count from the layer: what is left of the speed at contact, 3.132 m/s.
    let at_contact = |energy: f64| (2.0 * (energy - 9.81 * 0.01)).max(0.0).sqrt();
    [at_contact(end) / at_contact(first), largest / first]
}

/// Means over twenty phases, from an independent program: implicit Euler and BDF2 never gain energy.
#[test]
fn rebounds_of_every_scheme_are_those_of_an_independent_program() {
    let alpha = IntegratorSpec::GeneralisedAlpha(GeneralisedAlphaParameters { rho: 0.0 });
    let bdf2 = IntegratorSpec::Bdf2(Default::default());
    let cases: [(&IntegratorSpec, f64, f64, f64, bool); 19] = [
        (&IntegratorSpec::VelocityVerlet, 1e-4, 1.0, 0.005, false),
        (&IntegratorSpec::SymplecticEuler, 1e-4, 1.0, 0.005, false),
        (&IntegratorSpec::ImplicitEuler, 1e-3, 0.299, 0.002, true),
        (&IntegratorSpec::ImplicitEuler, 3e-4, 0.646, 0.002, true),
        (&IntegratorSpec::ImplicitEuler, 1e-4, 0.858, 0.002, true),
        (&bdf2, 1e-3, 0.821, 0.002, true),
        (&bdf2, 3e-4, 0.982, 0.002, true),
        (&bdf2, 1e-4, 0.999, 0.002, true),
        (&IntegratorSpec::TrBdf2, 1e-3, 0.992, 0.002, false),
        (&IntegratorSpec::TrBdf2, 3e-4, 0.9997, 0.002, false),
        (&IntegratorSpec::TrBdf2, 1e-4, 1.0, 0.002, false),
        (&IntegratorSpec::Sdirk2, 1e-3, 0.990, 0.002, false),
        (&IntegratorSpec::Sdirk2, 3e-4, 0.9997, 0.002, false),
        (&IntegratorSpec::Trapezoid, 1e-3, 1.001, 0.02, false),
        (&IntegratorSpec::Trapezoid, 3e-4, 1.0, 0.002, false),
        (&IntegratorSpec::Trapezoid, 1e-4, 1.0, 6e-4, false),
        (&alpha, 1e-3, 0.742, 0.002, false),
        (&alpha, 3e-4, 0.964, 0.002, false),
        (&alpha, 1e-4, 0.998, 0.002, false),
    ];
    for (scheme, h, expected, tolerance, never_gains) in cases {
        let all: Vec<[f64; 2]> = (0..20).map(|k| rebound(scheme, h, k)).collect();
        let mean = all.iter().map(|[e, _]| e).sum::<f64>() / 20.0;
        let name = scheme.method().documentation.name;
        assert!((mean - expected).abs() < tolerance, "{name} at {h}: {mean}, not {expected}");
        if never_gains {
            let largest = all.iter().map(|[_, gain]| *gain).fold(0.0, f64::max);
            assert!(largest <= 1.0 + 1e-12, "{name} at {h} gains: {largest}");
        }
    }
}
