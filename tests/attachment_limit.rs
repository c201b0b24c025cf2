//! Largest stable steps of bodies that an attachment with a dashpot holds.

use pliant::integrator::{Method, amplification};
use pliant::simulation::Simulation;
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError};

use crate::support::methods;

/// Beam of 4 x 1 cells, clamped at one end, with a spring and a dashpot [N s/m] at the other.
fn beam(method: Method, dashpot: f64, damping: &str, h: f64) -> Simulation {
    let name = method.documentation.name;
    let text = format!(
        "dimension = 2\ntime = {{ integrator = '{name}', step = {h:?}, duration = 1.0 }}\n[[body]]\n\
         mesh = {{ grid = {{ cells = [4, 1], spacing = 0.25 }} }}\nelastic = {{ linear = {{ young = 1e4, \
         poisson = 0 }} }}\n\
         mass = {{ per_vertex = 1.0 }}\npin = [{{ half_space = {{ normal = [1, 0], offset = 0 }} }}]\n\
         velocity = {{ rigid = {{ linear = [0.0, 1e-3] }} }}\n{damping}\n\
         [[attachment]]\nvertices = [4]\nstiffness = 1.0\ndashpot = {dashpot:?}\n"
    );
    let scene = Scene::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    scene.assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap().simulation
}

/// Largest speed after 2000 steps, over that at the start; infinite where one could not be taken.
fn growth(mut simulation: Simulation) -> f64 {
    for _ in 0..2000 {
        if simulation.step().is_err() {
            return f64::INFINITY;
        }
    }
    simulation.state().v().iter().fold(0.0f64, |m, v| m.max(v.abs())) / 1e-3
}

/// Damping in proportion to the mass, faster than all motions of the beam [1/s].
const RATE: f64 = 2000.0;

/// At 0.95 of the limit nothing grows, by any explicit scheme with a limit, whether the dashpot is weak or
/// stronger than all stiffness; without any, and with mass-proportional damping alone, the limit is sharp.
#[test]
fn bodies_on_dashpots_stay_bounded_below_their_limit() {
    let limited = |m: &Method| (1e-9..1e9).contains(&m.documentation.stability_limit);
    for method in methods().filter(limited) {
        let name = method.documentation.name;
        let damped = format!("damping = {{ mass_proportional = {RATE:?} }}");
        for (dashpot, damping) in
            [(0.0, ""), (0.0, &damped), (30.0, ""), (150.0, ""), (300.0, ""), (2000.0, "")]
        {
            let limit = beam(method, dashpot, damping, 1e-3).stability_limit(1.0).unwrap();
            let below = growth(beam(method, dashpot, damping, 0.95 * limit.step));
            assert!(below < 20.0, "{name}, {dashpot} N s/m, {damping}: grows by {below} below {limit:?}");
            // Just above, some schemes grow by less than 2000 steps show.
            let (h, rate) = (1.05 * limit.step, if damping.is_empty() { 0.0 } else { RATE });
            let radius =
                |omega: f64| amplification(&method, h * omega, h * rate, 0.0).spectral_radius().powi(2000);
            if dashpot == 0.0 && radius(limit.frequency).max(radius(1.0)) > 1e9 {
                let above = growth(beam(method, dashpot, damping, h));
                assert!(above > 100.0, "{name}, {damping}: {above} above {limit:?}");
            }
        }
    }
}
