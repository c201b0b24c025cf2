//! Stability maps: stable steps of a scene against its stiffness, its Poisson's ratio, its density or its
//! mutual gravity.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::limit::predicted;
use super::{AttemptStatus, attempt, with_step};
use pliant::integrator::IntegratorSpec;
use pliant_scene::{Body, KeyPath, MassSpec, NBodySpec, OneOrMany, Problem, Scene, SceneError, Source};

/// Quantity varied in addition to the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Against {
    /// Young's modulus and spring constants of every body: factors 1e-4 to 1e4.
    Young,
    /// Poisson's ratio of every body.
    Poisson,
    /// Density or other mass of the first body: factors 1e-4 to 1e4. Other bodies keep theirs.
    Density,
    /// Constant of mutual gravity: factors 1e-4 to 1e4.
    Gravity,
}

impl Against {
    /// All quantities.
    pub const ALL: [Against; 4] = [Against::Young, Against::Poisson, Against::Density, Against::Gravity];

    /// Name of the quantity.
    pub fn name(self) -> &'static str {
        match self {
            Against::Young => "young",
            Against::Poisson => "poisson",
            Against::Density => "density",
            Against::Gravity => "gravity",
        }
    }

    /// Quantities of `scene` that can be varied; masses always can.
    pub fn of(scene: &Scene) -> Vec<Against> {
        Against::ALL.into_iter().filter(|against| !changes(scene, *against, 0.25).is_empty()).collect()
    }

    /// Quantity with the largest effect on the stable step of `scene`: stiffness, without any mutual
    /// gravity, without either the masses.
    pub fn chosen(scene: &Scene) -> Against {
        let has = Against::of(scene);
        let first = [Against::Young, Against::Gravity].into_iter().find(|against| has.contains(against));
        first.unwrap_or(Against::Density)
    }
}

/// Number of steps in one run.
const EXPLICIT_STEPS: u64 = 500;
const IMPLICIT_STEPS: u64 = 50;

/// Stability map.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Map {
    /// Name of the integrator.
    pub integrator: String,
    /// Quantity that differs between rows.
    pub against: Against,
    /// Step sizes, ascending [s].
    pub steps: Vec<f64>,
    /// Values of the rows, ascending: factors of the varied quantity, or Poisson's ratios.
    pub values: Vec<f64>,
    /// Limit of each row, linearised at its start [s]; `None` if any step is stable, 0 if none is.
    pub predicted: Vec<Option<f64>>,
    /// Outcomes, `[row][column]`.
    pub status: Vec<Vec<AttemptStatus>>,
}

impl Map {
    /// True if this step failed although it is not above the predicted limit.
    pub fn fails_early(&self, row: usize, column: usize) -> bool {
        let below = self.predicted[row].is_some_and(|limit| self.steps[column] <= limit);
        below && self.status[row][column] != AttemptStatus::Ok
    }

    /// Number of failures below the predicted limit.
    pub fn failed_below_limit(&self) -> usize {
        let rows = 0..self.values.len();
        rows.map(|row| (0..self.steps.len()).filter(|column| self.fails_early(row, *column)).count()).sum()
    }
}

/// Runs `integrator` with steps around the scene's, 500 each (50 for an implicit integrator), for every
/// value of the varied quantity. Returns `None` if `stop` was set meanwhile.
///
/// # Errors
/// The mistakes in the scene, or a quantity that it does not have.
pub fn map(
    source: &Source,
    integrator: IntegratorSpec,
    against: Against,
    around: f64,
    quick: bool,
    stop: &Arc<AtomicBool>,
) -> Result<Option<Map>, SceneError> {
    let scene = source.scene()?;
    let about = integrator.method().documentation;
    let count = if quick { 7 } else { 13 };
    let width = 4.0;
    // Powers of ten: 10^-2 to 10^2 around the given step.
    let steps: Vec<f64> = (0..count)
        .map(|i| around * 10f64.powf(width * i as f64 / (count - 1) as f64 - 0.5 * width))
        .collect();
    let values: Vec<f64> = match (against, quick) {
        (Against::Poisson, false) => vec![0.0, 0.1, 0.2, 0.3, 0.4, 0.45, 0.49, 0.495, 0.499, 0.4999],
        (Against::Poisson, true) => vec![0.0, 0.3, 0.45, 0.495],
        (_, false) => (-4..=4).map(|e| 10f64.powi(e)).collect(),
        (_, true) => (-1..=1).map(|e| 10f64.powi(2 * e)).collect(),
    };
    let runs = if about.solves > 0 { IMPLICIT_STEPS } else { EXPLICIT_STEPS };
    let mut found =
        Map { integrator: about.name.into(), against, steps, values, predicted: vec![], status: vec![] };
    // One row for each value: its predicted limit, and a run for each step.
    for value in &found.values {
        let changes = changes(&scene, against, *value);
        if changes.is_empty() {
            let message = match against {
                Against::Young => "no body has a Young's modulus or springs",
                Against::Poisson => "no body has a Poisson's ratio",
                Against::Density => "there is no body that has a mass",
                Against::Gravity => "there is no mutual gravity, `nbody` in [world]",
            };
            let problem = Problem::semantic(KeyPath::root().key("body"), message);
            let has: Vec<&str> = Against::of(&scene).into_iter().map(Against::name).collect();
            let problem = problem.with_help(format!("this scene can be mapped against {}", has.join(", ")));
            return Err(source.error(vec![problem]));
        }
        let varied = source.varied(&changes)?.scene()?;
        let limit = with_step(&varied, integrator, around, stop)?.stability_limit(scene.time.duration);
        let Ok(limit) = limit else { return Ok(None) };
        found.predicted.push(predicted(&limit));
        let mut row = vec![];
        for step in &found.steps {
            row.push(attempt(&mut with_step(&varied, integrator, *step, stop)?, runs));
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
        }
        found.status.push(row);
    }
    Ok(Some(found))
}

/// Changes (paths and values) that multiply the stiffness of every body.
pub(crate) fn stiffness_changes(scene: &Scene, factor: f64) -> Vec<(String, String)> {
    changes(scene, Against::Young, factor)
}

/// Changes (paths and values) of a row.
fn changes(scene: &Scene, against: Against, value: f64) -> Vec<(String, String)> {
    let bodies = scene.body.iter().enumerate();
    match against {
        Against::Young => bodies.flat_map(|(i, body)| stiffness(i, body, value)).collect(),
        Against::Poisson => bodies.filter_map(|(i, body)| constant(i, body, "poisson", |_| value)).collect(),
        Against::Density => scene.body.first().map(|body| mass(body, value)).into_iter().collect(),
        Against::Gravity => {
            let of =
                |nbody: &NBodySpec| ("world.nbody.constant".into(), format!("{:?}", nbody.constant * value));
            scene.world.nbody.iter().map(of).collect()
        }
    }
}

/// Young's modulus of body `i`, and its spring constants.
fn stiffness(i: usize, body: &Body, factor: f64) -> Vec<(String, String)> {
    let mut changes: Vec<(String, String)> =
        constant(i, body, "young", |young| factor * young).into_iter().collect();
    if let Some(springs) = &body.springs {
        let of = [("stiffness", springs.stiffness.as_ref().map(|k| scaled(k, factor)))];
        let young = springs.young.map(|young| format!("{:?}", young * factor));
        let of = of.into_iter().chain([("young", young)]);
        changes.extend(of.filter_map(|(key, value)| Some((format!("body.{i}.springs.{key}"), value?))));
    }
    changes
}

/// A constant of the material of body `i`; `None` for a model without it.
fn constant(i: usize, body: &Body, key: &str, new: impl Fn(f64) -> f64) -> Option<(String, String)> {
    let elastic = body.elastic.as_ref()?;
    let name = elastic.name();
    // Serialised in the notation of a scene.
    let written = toml::Value::try_from(elastic).ok()?;
    let old = written.get(name)?.get(key)?.as_float()?;
    Some((format!("body.{i}.elastic.{name}.{key}"), format!("{:?}", new(old))))
}

/// Masses of the first body.
fn mass(body: &Body, factor: f64) -> (String, String) {
    let path = |key: &str| format!("body.0.mass{key}");
    match &body.mass {
        MassSpec::Density(density) => (path(".density"), format!("{:?}", density.value * factor)),
        MassSpec::Total(total) => (path(".total"), format!("{:?}", total * factor)),
        MassSpec::PerVertex(masses) => (path(".per_vertex"), scaled(masses, factor)),
        MassSpec::Preset(preset) => {
            (path(""), format!("{{ density = {:?} }}", preset.about().density * factor))
        }
    }
}

/// One number or a list, times `factor`, as TOML.
fn scaled(values: &OneOrMany, factor: f64) -> String {
    match values {
        OneOrMany::One(value) => format!("{:?}", value * factor),
        OneOrMany::Many(values) => {
            format!("{:?}", values.iter().map(|value| value * factor).collect::<Vec<f64>>())
        }
    }
}
