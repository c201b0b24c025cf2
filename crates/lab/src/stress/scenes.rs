//! Scenes of the suite, and their measurements.

use super::{CaseResult, CaseVerdict, Picture, Start};
use pliant::quantity::Rounded;
use pliant::simulation::Simulation;
use pliant::topology::Topology;
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Scene, SceneError};

/// Assembles a scene of the suite, which is valid.
pub(super) fn assemble(text: &str) -> Assembly {
    try_assemble(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Assembles a scene that may be invalid.
pub(super) fn try_assemble(text: &str) -> Result<Assembly, SceneError> {
    Scene::from_toml(text)?.assemble(UnstableStep::Accept).map_err(SceneError::new)
}

/// Scene with one solid: a grid of `cells` over `size`, with more `keys`.
pub(super) struct Solid<'a> {
    pub(super) cells: &'a [usize],
    pub(super) size: &'a [f64],
    pub(super) origin: &'a [f64],
    pub(super) material: &'a str,
    pub(super) young: f64,
    pub(super) poisson: f64,
    pub(super) density: f64,
    /// Integrator, in a scene's notation.
    pub(super) integrator: &'a str,
    pub(super) step: f64,
    /// More keys of `[time]`, and whole tables.
    pub(super) time: &'a str,
    pub(super) world: &'a str,
    /// More keys of the body.
    pub(super) keys: &'a str,
}

impl Solid<'_> {
    pub(super) const UNIT: Solid<'static> = Solid {
        cells: &[],
        size: &[],
        origin: &[],
        material: "stable-neo-hookean",
        young: 1e5,
        poisson: 0.3,
        density: 1000.0,
        integrator: "'quasi-static'",
        step: 1.0,
        time: "",
        world: "",
        keys: "",
    };

    /// Text of the scene.
    pub(super) fn text(&self) -> String {
        let Solid {
            cells,
            size,
            origin,
            material,
            young,
            poisson,
            density,
            integrator,
            step,
            time,
            world,
            keys,
        } = self;
        let origin = if origin.is_empty() { String::new() } else { format!(", origin = {origin:?}") };
        let poisson = if *material == "arap" { String::new() } else { format!(", poisson = {poisson:?}") };
        format!(
            "dimension = {}\ntime = {{ integrator = {integrator}, step = {step:?}, duration = 1.0{time} \
             }}\nworld = {{ {world} }}\n\
             [[body]]\nname = 'body'\nmesh = {{ grid = {{ cells = {cells:?}, size = {size:?}{origin} }} }}\n\
             elastic = {{ {material} = {{ young = {young:?}{poisson} }} }}\nmass = {{ density = {density:?} \
             }}\n{keys}\n",
            cells.len(),
        )
    }

    pub(super) fn assemble(&self) -> Assembly {
        assemble(&self.text())
    }
}

/// Pin of all vertices with `coordinate <= value` (`sign` 1) or `>= value` (-1) along an axis, without
/// the brackets.
pub(super) fn clamp(dimension: usize, axis: usize, sign: f64, value: f64, more: &str) -> String {
    let mut normal = vec![0.0; dimension];
    normal[axis] = sign;
    format!("{{ half_space = {{ normal = {normal:?}, offset = {:?} }}{more} }}", sign * value)
}

/// Integrator of this name with its usual parameters, in a scene's notation:
/// `{ generalised-alpha = { rho = 0.8 } }`.
pub(super) fn scheme(name: &str) -> String {
    match name {
        "generalised-alpha" => "{ generalised-alpha = { rho = 0.8 } }".into(),
        "bdf2" => "{ bdf2 = { start = 'tr-bdf2' } }".into(),
        "newmark" => "{ newmark = { beta = 0.25, gamma = 0.5 } }".into(),
        name => format!("'{name}'"),
    }
}

/// A beam of 8 x 2 cells, 4 m x 1 m, clamped at `x = 0`, released under gravity.
pub(super) fn beam() -> Solid<'static> {
    Solid {
        cells: &[8, 2],
        size: &[4.0, 1.0],
        young: 1e6,
        world: "gravity = [0, -9.81]",
        keys: "pin = [{ half_space = { normal = [1, 0], offset = 0 } }]",
        ..Solid::UNIT
    }
}

/// A bar of 1 x 1 x 4 cells, 1 m x 1 m x 4 m, clamped at `z = 0`, for [twisting](twist).
pub(super) fn pinned_bar() -> Solid<'static> {
    Solid {
        cells: &[1, 1, 4],
        size: &[1.0, 1.0, 4.0],
        young: 1e6,
        poisson: 0.45,
        keys: "pin = [{ half_space = { normal = [0, 0, 1], offset = 0 } }]",
        ..Solid::UNIT
    }
}

/// Sets the velocities of the bar to `5 sin(pi z/8) (-(y - 1/2), x - 1/2, 0)`.
pub(super) fn twist(simulation: &mut Simulation) {
    let x = simulation.state().x().to_vec();
    for (v, x) in simulation.state_mut().v_mut().chunks_exact_mut(3).zip(x.chunks_exact(3)) {
        let speed = 5.0 * (std::f64::consts::PI * x[2] / 8.0).sin();
        (v[0], v[1]) = (-speed * (x[1] - 0.5), speed * (x[0] - 0.5));
    }
}

/// Moves free vertices to a degenerate start; returns all former positions, flat [m].
pub(super) fn put(simulation: &mut Simulation, start: Start) -> Vec<f64> {
    let d = simulation.system().dimension();
    let rest = simulation.state().x().to_vec();
    let free: Vec<bool> = simulation.system().inverse_mass().iter().map(|w| *w > 0.0).collect();
    start.apply(d, simulation.state_mut().x_mut(), |i| free[i]);
    rest
}

/// Number of Newton iterations so far.
pub(super) fn iterations(simulation: &Simulation) -> u64 {
    simulation.work().solver.map_or(0, |solver| solver.newton_iterations)
}

/// Norm of the energy gradient over the free coordinates [N], plus `M (v - v0) / h` if `inertia` gives
/// `v0` and `h`: the gradient of the incremental potential of implicit Euler.
pub(super) fn gradient(simulation: &mut Simulation, inertia: Option<(&[f64], f64)>) -> f64 {
    let (x, v) = (simulation.state().x().to_vec(), simulation.state().v().to_vec());
    let system = simulation.system_mut();
    let mut a = vec![0.0; x.len()];
    if system.evaluate(&x).is_none() {
        return f64::NAN;
    }
    system.accelerations(&mut a);
    let d = system.dimension();
    let mut sum = 0.0;
    for i in (0..x.len()).filter(|i| system.inverse_mass()[*i] > 0.0) {
        let inertia = inertia.map_or(0.0, |(v0, h)| (v[i] - v0[i]) / h);
        sum += (system.mass()[i / d] * (inertia - a[i])).powi(2);
    }
    sum.sqrt()
}

/// Largest component of `F^T F - I` over all elements; infinite for an inverted element.
pub(super) fn strain(simulation: &Simulation) -> f64 {
    let mut worst: f64 = 0.0;
    for state in simulation.element_states() {
        let strain = state.green_strain();
        for row in 0..3 {
            worst = strain[row].iter().fold(worst, |m, e| m.max(2.0 * e.abs()));
        }
        if state.j() <= 0.0 {
            return f64::INFINITY;
        }
    }
    worst
}

/// Largest difference between two flat arrays.
pub(super) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

/// Final state for drawing: elements in 2D with their `J`, the surface in 3D.
pub(super) fn picture(simulation: &Simulation, topology: &Topology) -> Picture {
    let d = topology.dimension;
    let triangles: Vec<[u32; 3]> = topology
        .bodies
        .iter()
        .flat_map(|b| if d == 2 { &b.triangles } else { &b.surface })
        .copied()
        .collect();
    let states = simulation.element_states();
    let j = if states.len() == triangles.len() { states.iter().map(|s| s.j()).collect() } else { vec![] };
    Picture { dimension: d, x: simulation.positions().into_owned(), triangles, j }
}

/// Notes the kind of equilibrium, if it differs from the reference configuration.
pub(super) fn name_end(findings: &mut CaseResult, simulation: &mut Simulation, energy_density: f64) {
    let diagnostics = simulation.diagnostics();
    findings.note_inversion(&diagnostics);
    let Some(min_j) = diagnostics.min_j else { return };
    if diagnostics.inverted.unwrap_or(0) == 0 && energy_density > 1e-8 {
        let what = if min_j < 1e-3 { "collapsed" } else { "entangled" };
        findings.note(
            CaseVerdict::Flagged,
            format!(
                "{what}: an equilibrium away from rest, energy {} E V, least J {min_j:.3}",
                Rounded::<3>(energy_density)
            ),
        );
    }
}
