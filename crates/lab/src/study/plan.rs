//! Plan of a study.

use std::time::Duration;

use pliant::integrator::{IntegratorSpec, Method};
use pliant_scene::vary::VariedKey;
use pliant_scene::{KeyPath, Problem, Scene};

/// Default number of times of comparison.
pub const TIMES: usize = 20;
/// Maximum number of times of comparison, if more are needed so that all given steps meet them.
const MOST_TIMES: usize = 200;
/// Default budget of a study without given steps [s].
const BUDGET: f64 = 60.0;
/// Default integrators: one or two of each family.
const USUAL: [&str; 13] = [
    "symplectic-euler",
    "velocity-verlet",
    "rk4",
    "yoshida4",
    "dormand-prince5",
    "implicit-euler",
    "implicit-midpoint",
    "generalised-alpha",
    "bdf2",
    "tr-bdf2",
    "sdirk4",
    "gauss2",
    "radau-iia3",
];

/// An integrator under test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// Integrator in the notation of a scene.
    pub spec: IntegratorSpec,
    /// Method with this name, possibly other than the registry's.
    pub method: Method,
}

impl From<IntegratorSpec> for Contender {
    fn from(spec: IntegratorSpec) -> Contender {
        Contender { spec, method: spec.method() }
    }
}

impl Contender {
    /// Name of the integrator.
    pub fn name(&self) -> &'static str {
        self.method.documentation.name
    }
}

/// Time stepping of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeStepping {
    /// Number of steps from one time of comparison to the next.
    Parts(u64),
    /// Adaptive steps with this tolerance.
    Tolerance(f64),
}

/// Kind of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReferenceChoice {
    /// Exact if the problem has a known solution, otherwise computed.
    #[default]
    Auto,
    /// Exact; without a known solution the study is refused.
    Exact,
    /// Computed by independent integrators.
    Computed,
}

/// Plan of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyPlan {
    /// Integrators.
    pub contenders: Vec<Contender>,
    /// Steps [s]; if empty, chosen by factors of 2.
    pub steps: Vec<f64>,
    /// Tolerances for adaptive integrators; if steps and tolerances are empty, chosen by factors of 10.
    pub tolerances: Vec<f64>,
    /// Smallest step to choose [s].
    pub smallest_step: Option<f64>,
    /// Additional varied keys.
    pub axes: Vec<VariedKey>,
    /// Number of times at which states are compared.
    pub times: usize,
    /// Number of timed runs per row; `None`: seven, or as many as take a second.
    pub repeats: Option<usize>,
    /// Wall time of the whole study [s].
    pub budget: Option<f64>,
    /// Kind of the reference.
    pub reference: ReferenceChoice,
    /// Largest relative error of a recommendation.
    pub error: f64,
    /// Number of threads for steps.
    pub threads: usize,
}

impl StudyPlan {
    /// Plan of `scene`, with defaults for everything else.
    ///
    /// # Errors
    /// An invalid axis of `vary`.
    pub fn of(scene: &Scene) -> Result<StudyPlan, Vec<Problem>> {
        let spec = scene.study.clone().unwrap_or_default();
        let path = KeyPath::root().key("study").key("vary");
        let axes = spec.vary.iter().enumerate().map(|(index, text)| {
            let axis = text.parse::<VariedKey>().map_err(|error| error.to_string());
            axis.and_then(comparable).map_err(|told| vec![Problem::semantic(path.index(index), told)])
        });
        let usual =
            || IntegratorSpec::ALL.iter().filter(|spec| USUAL.contains(&spec.method().documentation.name));
        let mut contenders: Vec<Contender> = spec.integrators.iter().map(|spec| (*spec).into()).collect();
        if contenders.is_empty() {
            contenders = usual().map(|spec| (*spec).into()).collect();
            let own = scene.time.integrator.method();
            if own.documentation.order > 0 && contenders.iter().all(|c| c.method != own) {
                contenders.push(scene.time.integrator.into());
            }
        }
        let chosen = spec.steps.is_none() && spec.tolerances.is_empty() && spec.smallest_step.is_none();
        Ok(StudyPlan {
            contenders,
            steps: spec.steps.unwrap_or_default(),
            tolerances: spec.tolerances,
            smallest_step: spec.smallest_step,
            axes: axes.collect::<Result<_, _>>()?,
            times: spec.times.unwrap_or(TIMES),
            repeats: None,
            budget: chosen.then_some(BUDGET),
            reference: ReferenceChoice::Auto,
            error: spec.error.unwrap_or(1e-2),
            threads: 1,
        })
    }

    /// Budget as a duration, for display.
    pub fn budget(&self) -> Option<Duration> {
        self.budget.map(Duration::from_secs_f64)
    }
}

/// Axis of `vary`, unless it varies what a study compares anyway: every row sets these keys.
fn comparable(axis: VariedKey) -> Result<VariedKey, String> {
    let compared =
        [("time.integrator", "integrators"), ("time.step", "steps"), ("time.adaptive", "tolerances")];
    let is_of =
        |key: &str| axis.path.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    match compared.into_iter().find(|(key, _)| is_of(key)) {
        None => Ok(axis),
        Some((key, list)) => Err(format!(
            "`{key}` is what a study compares, not what it varies: list the values by `--{list}`, or by \
             `{list}` in [study]"
        )),
    }
}

/// Times of comparison, `duration * i / times`, and steps that meet all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeGrid {
    /// Simulated time [s].
    pub duration: f64,
    /// Number of times, without the start.
    pub times: usize,
}

impl TimeGrid {
    /// Grid of `times` times, or of the fewest more that all given `steps` meet.
    pub fn new(duration: f64, times: usize, steps: &[f64]) -> TimeGrid {
        let meets = |times: usize| {
            let grid = TimeGrid { duration, times };
            steps.iter().all(|step| (grid.step(grid.parts(*step)) / step - 1.0).abs() < 1e-9)
        };
        let times = (times..=MOST_TIMES.max(times)).find(|times| meets(*times)).unwrap_or(times);
        TimeGrid { duration, times }
    }

    /// Number of steps between two times, for steps as close to `step` [s] as possible.
    pub fn parts(&self, step: f64) -> u64 {
        (self.duration / (self.times as f64 * step)).round().max(1.0) as u64
    }

    /// Step size with `parts` steps from one time to the next [s].
    pub fn step(&self, parts: u64) -> f64 {
        self.duration / (self.times as f64 * parts as f64)
    }

    /// Number of frames per simulated second.
    pub fn rate(&self) -> f64 {
        self.times as f64 / self.duration
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // E: at least 20 common times, which all integrators meet exactly.
    #[test]
    fn steps_meet_the_times_of_comparison() {
        let grid = TimeGrid::new(1.0, 20, &[1.0 / 25.0, 1.0 / 50.0]);
        assert_eq!((grid.times, grid.parts(1.0 / 50.0), grid.step(2)), (25, 2, 0.02));
        // No number of times fits this step: it changes to the nearest one that fits 20.
        let grid = TimeGrid::new(1.0, 20, &[0.0123456]);
        assert_eq!((grid.times, grid.parts(0.0123456), grid.step(4)), (20, 4, 0.0125));
        assert_eq!(
            TimeGrid::new(1.0, 20, &[]).parts(10.0),
            1,
            "a step reaches no further than the next time"
        );
    }
}
