//! Subjects of a study.

use std::time::Duration;

use pliant::integrator::{IntegratorSpec, Method};
use pliant_scene::vary::VariedKey;
use pliant_scene::{KeyPath, Problem, Scene};

/// States are compared at this many times unless the scene says more.
pub const TIMES: usize = 20;
/// More times are taken, up to this many, where all given steps then meet them.
const MOST_TIMES: usize = 200;
/// Seconds for a study that nothing else ends.
const BUDGET: f64 = 60.0;
/// The schemes without a list: one or two of each family.
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

/// A scheme under test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// How a scene names it.
    pub spec: IntegratorSpec,
    /// Its method: of the same name, but maybe not the registry's.
    pub method: Method,
}

impl From<IntegratorSpec> for Contender {
    fn from(spec: IntegratorSpec) -> Contender {
        Contender { spec, method: spec.method() }
    }
}

impl Contender {
    /// Its name.
    pub fn name(&self) -> &'static str {
        self.method.documentation.name
    }
}

/// Time stepping of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeStepping {
    /// So many steps from one time of comparison to the next.
    Parts(u64),
    /// Steps that follow the error, of this tolerance.
    Tolerance(f64),
}

/// Source of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReferenceChoice {
    /// Exact where the problem is one whose solution is known, else computed.
    #[default]
    Auto,
    /// Exact, or the study is refused.
    Exact,
    /// Computed by independent schemes.
    Computed,
}

/// Subjects of a study, and their number.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyPlan {
    /// The schemes.
    pub contenders: Vec<Contender>,
    /// Steps [s]; chosen by factors of 2 if there are none.
    pub steps: Vec<f64>,
    /// Tolerances of schemes whose steps can follow the error; chosen by factors of 10 if there are neither
    /// steps nor tolerances.
    pub tolerances: Vec<f64>,
    /// The smallest step that is chosen [s].
    pub smallest_step: Option<f64>,
    /// Values that are varied beside.
    pub axes: Vec<VariedKey>,
    /// Number of times at which states are compared.
    pub times: usize,
    /// Timed runs of each row; `None`: seven, or as many as take a second.
    pub repeats: Option<usize>,
    /// Wall time of the whole study [s].
    pub budget: Option<f64>,
    /// Source of the reference.
    pub reference: ReferenceChoice,
    /// The largest error that a recommendation may have, relative.
    pub error: f64,
    /// Threads that steps run on.
    pub threads: usize,
}

impl StudyPlan {
    /// The plan of `scene`, the rest as usual.
    ///
    /// # Errors
    /// An axis of `vary` that is none.
    pub fn of(scene: &Scene) -> Result<StudyPlan, Vec<Problem>> {
        let spec = scene.study.clone().unwrap_or_default();
        let path = KeyPath::root().key("study").key("vary");
        let axes = spec.vary.iter().enumerate().map(|(index, text)| {
            text.parse::<VariedKey>()
                .map_err(|error| vec![Problem::semantic(path.index(index), error.to_string())])
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

    /// The budget as a time, to be shown.
    pub fn budget(&self) -> Option<Duration> {
        self.budget.map(Duration::from_secs_f64)
    }
}

/// Times at which states are compared, `duration * i / times`, and steps that meet all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeGrid {
    /// Simulated time [s].
    pub duration: f64,
    /// Number of times, the start not among them.
    pub times: usize,
}

impl TimeGrid {
    /// At `times` times or, where given `steps` do not meet these, at the fewest more that they do meet.
    pub fn new(duration: f64, times: usize, steps: &[f64]) -> TimeGrid {
        let meets = |times: usize| {
            let grid = TimeGrid { duration, times };
            steps.iter().all(|step| (grid.step(grid.parts(*step)) / step - 1.0).abs() < 1e-9)
        };
        let times = (times..=MOST_TIMES.max(times)).find(|times| meets(*times)).unwrap_or(times);
        TimeGrid { duration, times }
    }

    /// Number of steps between two times for steps as near to `step` [s] as can be.
    pub fn parts(&self, step: f64) -> u64 {
        (self.duration / (self.times as f64 * step)).round().max(1.0) as u64
    }

    /// The step that takes `parts` from one time to the next [s].
    pub fn step(&self, parts: u64) -> f64 {
        self.duration / (self.times as f64 * parts as f64)
    }

    /// Frames per simulated second.
    pub fn rate(&self) -> f64 {
        self.times as f64 / self.duration
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // E: at least 20 common times, which all schemes meet exactly.
    #[test]
    fn steps_meet_the_times_of_comparison() {
        let grid = TimeGrid::new(1.0, 20, &[1.0 / 25.0, 1.0 / 50.0]);
        assert_eq!((grid.times, grid.parts(1.0 / 50.0), grid.step(2)), (25, 2, 0.02));
        // No number of times goes with a step like this: it is changed to the nearest that goes with 20.
        let grid = TimeGrid::new(1.0, 20, &[0.0123456]);
        assert_eq!((grid.times, grid.parts(0.0123456), grid.step(4)), (20, 4, 0.0125));
        assert_eq!(
            TimeGrid::new(1.0, 20, &[]).parts(10.0),
            1,
            "a step reaches no further than the next time"
        );
    }
}
