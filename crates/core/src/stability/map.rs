//! Which steps a scene can take, against its stiffness, its Poisson's ratio or its density.

use super::{Status, attempt, with_step};
use crate::integrator::IntegratorSpec;
use crate::scene::{KeyPath, Problem, Scene, SceneError, Source};

/// What is varied beside the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Against {
    /// Young's modulus, or the constant of springs, of every body: times 1e-4 to 1e4.
    Young,
    /// Poisson's ratio of every body.
    Poisson,
    /// The density, or other mass, of the first body: times 1e-4 to 1e4. The others keep theirs.
    Density,
}

impl Against {
    /// All of them.
    pub const ALL: [Against; 3] = [Against::Young, Against::Poisson, Against::Density];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Against::Young => "young",
            Against::Poisson => "poisson",
            Against::Density => "density",
        }
    }
}

/// Steps of one run.
const EXPLICIT_STEPS: u64 = 500;
const IMPLICIT_STEPS: u64 = 50;

/// A map of states.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Map {
    /// The scheme.
    pub integrator: String,
    /// What rows differ in.
    pub against: Against,
    /// The steps, ascending [s].
    pub steps: Vec<f64>,
    /// Of the rows, ascending: the factor of what is varied, or Poisson's ratio.
    pub values: Vec<f64>,
    /// The limit of each row, linearised at its start [s]; `None`: any step.
    pub predicted: Vec<Option<f64>>,
    /// `[row][column]`.
    pub status: Vec<Vec<Status>>,
}

/// Runs `integrator` with steps around those of the scene, 500 each (50 of an implicit scheme), for every value of what is varied.
///
/// # Errors
/// What is wrong with the scene, or that nothing in it can be varied so.
pub fn map(
    source: &Source,
    integrator: IntegratorSpec,
    against: Against,
    around: f64,
    quick: bool,
) -> Result<Map, SceneError> {
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
    for value in &found.values {
        let changes = changes(&scene, against, *value);
        if changes.is_empty() {
            let message = match against {
                Against::Young => "no body has a Young's modulus or springs of one stiffness",
                Against::Poisson => "no body has a Poisson's ratio",
                Against::Density => "the first body has neither a density nor one mass for all",
            };
            return Err(source.error(vec![Problem::semantic(KeyPath::root().key("body"), message)]));
        }
        let varied = source.varied(&changes)?.scene()?;
        let limit = with_step(&varied, integrator, around)?.stability_limit(scene.time.duration).step;
        found.predicted.push(limit.is_finite().then_some(limit));
        let mut row = vec![];
        for step in &found.steps {
            row.push(attempt(&mut with_step(&varied, integrator, *step)?, runs));
        }
        found.status.push(row);
    }
    Ok(found)
}

/// Paths and values that make every body so many times as stiff.
pub(crate) fn stiffness_changes(scene: &Scene, factor: f64) -> Vec<(String, String)> {
    changes(scene, Against::Young, factor)
}

/// Paths and values of what a row changes.
fn changes(scene: &Scene, against: Against, value: f64) -> Vec<(String, String)> {
    let mut changes = vec![];
    for (i, body) in scene.body.iter().enumerate() {
        match against {
            Against::Density => {
                use crate::scene::{MassSpec, OneOrMany};
                let (key, mass) = match &body.mass {
                    MassSpec::Density(density) => ("density", density.value),
                    MassSpec::Total(total) => ("total", *total),
                    MassSpec::PerVertex(OneOrMany::One(mass)) => ("per_vertex", *mass),
                    _ => continue,
                };
                if i == 0 {
                    changes.push((format!("body.{i}.mass.{key}"), format!("{:?}", mass * value)));
                }
            }
            Against::Young | Against::Poisson => {
                if let Some(elastic) = &body.elastic {
                    let name = elastic.name();
                    let key = if against == Against::Young { "young" } else { "poisson" };
                    // As it would be written: a model without this constant has no such key.
                    let written = toml::Value::try_from(elastic).ok();
                    let constant = written.as_ref().and_then(|w| w.get(name)?.get(key)?.as_float());
                    if let Some(constant) = constant {
                        let number = if against == Against::Young { value * constant } else { value };
                        changes.push((format!("body.{i}.elastic.{name}.{key}"), format!("{number:?}")));
                    }
                }
                if let Some(springs) = body.springs.as_ref().filter(|_| against == Against::Young) {
                    use crate::scene::OneOrMany;
                    if let Some(OneOrMany::One(k)) = &springs.stiffness {
                        changes.push((format!("body.{i}.springs.stiffness"), format!("{:?}", k * value)));
                    } else if let Some(young) = springs.young {
                        changes.push((format!("body.{i}.springs.young"), format!("{:?}", young * value)));
                    }
                }
            }
        }
    }
    changes
}
