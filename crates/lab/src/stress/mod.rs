//! The robustness suite: states, steps, ratios and shapes that break simulators, each with its expected
//! outcome.
//!
//! A [`Case`] is one scene or several with a criterion. Running it gives a [`CaseResult`] with a
//! [`CaseVerdict`]. Reference values of the criteria are closed forms, or were computed by independent codes.
//! Tests, `pliant stress` and `docs/stress.md` run these very cases.

mod advice;
mod limits;
mod rows;
mod scene;
mod scenes;
mod starts;
#[cfg(test)]
mod tests;
mod torture;

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use limits::Limits;
use pliant::diagnostics::Diagnostics;
use pliant::quantity::counted;
use pliant::simulation::StepError;
use pliant::solver::LinearSolver;

pub use limits::{Progress, run_all};
pub use scene::scene_cases;
pub use starts::Start;

/// Kind of the note on a step that failed with an error.
const REPORTED: &str = "reported";
/// Kind of the note on an explicit step above its stability limit.
pub const ABOVE_LIMIT: &str = "above the limit";

/// Outcome of a case.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Verdict")]
pub enum CaseVerdict {
    /// All that was asked for.
    Pass,
    /// An end that is allowed, but that a user must be told of: it is named in the notes.
    Flagged,
    /// Something that was asked for is missing.
    Fail,
}

impl CaseVerdict {
    /// Meaning of the verdicts, for the suite and for a scene: as a sentence.
    pub const MEANING: &str = "Pass: every criterion is met. Flagged: acceptable, but you should know, such \
                               as inverted elements, an equilibrium away from the reference configuration, \
                               a state outside of the domain of the material, a step above the stability \
                               limit of a scene that allows it, or a run cut short. Fail: a criterion is not \
                               met.";
}

impl std::fmt::Display for CaseVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            CaseVerdict::Pass => "pass",
            CaseVerdict::Flagged => "flagged",
            CaseVerdict::Fail => "FAIL",
        })
    }
}

/// Triangles of a final state, for drawing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Dimension, 2 or 3.
    pub dimension: usize,
    /// Positions, flat [m].
    pub x: Vec<f64>,
    /// Corners of the drawn triangles: elements in 2D, faces in 3D.
    pub triangles: Vec<[u32; 3]>,
    /// `det F` of the element of each triangle.
    pub j: Vec<f64>,
}

/// The outcome of one case.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[schemars(rename = "Findings")]
pub struct CaseResult {
    /// Whether it is what it should be.
    pub verdict: CaseVerdict,
    /// Remarks, most important first.
    pub notes: Vec<String>,
    /// Newton iterations: of the case, or of the worst step where the bar is by step.
    pub iterations: Option<u64>,
    /// How many there may be.
    pub bar: Option<u64>,
    /// Size of the time step, of cases of a scene [s].
    pub step_size: Option<f64>,
    /// Time steps taken, of long cases.
    pub steps: Option<u64>,
    /// Most Newton iterations of one step, of long cases.
    pub worst_step: Option<u64>,
    /// Least gap of all steps over the distance from which on surfaces push, of long cases.
    pub least_gap: Option<f64>,
    /// Smallest `det F` at the end.
    pub min_j: Option<f64>,
    /// Total energy at the end over that at the start.
    pub energy_ratio: Option<f64>,
    /// Error beside a reference, or the size of a number that must vanish: relative, or as the notes say.
    pub error: Option<f64>,
    /// The largest that `error` may be.
    pub tolerance: Option<f64>,
    /// Changes with which it would have passed, where it did not.
    pub advice: Option<String>,
    /// True if it was ended before it was through, because its time was over: the notes say how far it came.
    pub cut_short: bool,
    /// Wall time [s]: the only number that is not the same every time.
    pub seconds: f64,
    /// The end state.
    #[serde(skip)]
    pub picture: Option<Picture>,
}

impl Default for CaseResult {
    fn default() -> Self {
        CaseResult {
            verdict: CaseVerdict::Pass,
            notes: vec![],
            iterations: None,
            bar: None,
            step_size: None,
            steps: None,
            worst_step: None,
            least_gap: None,
            min_j: None,
            energy_ratio: None,
            error: None,
            tolerance: None,
            advice: None,
            cut_short: false,
            seconds: 0.0,
            picture: None,
        }
    }
}

impl CaseResult {
    /// Lowers the verdict to at most this one, with a note.
    pub(crate) fn note(&mut self, verdict: CaseVerdict, note: impl Into<String>) {
        let at = if verdict > self.verdict { 0 } else { self.notes.len() };
        self.notes.insert(at, note.into());
        self.verdict = self.verdict.max(verdict);
    }

    /// Fails the case unless the condition holds.
    pub(crate) fn demand(&mut self, holds: bool, otherwise: impl FnOnce() -> String) {
        if !holds {
            self.note(CaseVerdict::Fail, otherwise());
        }
    }

    /// Notes the smallest `det F`. A state with an inverted element is flagged, in equilibrium and in
    /// motion.
    pub(crate) fn note_inversion(&mut self, diagnostics: &Diagnostics) {
        self.min_j = diagnostics.min_j;
        let inverted = diagnostics.inverted.unwrap_or(0);
        if inverted > 0 {
            let least = diagnostics.min_j.filter(|j| j.is_finite());
            let least = least.map_or_else(String::new, |j| format!(", the least {j:.3}"));
            let have = counted(inverted, "element has", "elements have");
            self.note(CaseVerdict::Flagged, format!("inverted: {have} J <= 0{least}"));
        }
    }

    /// Notes a failed step: flagged if it is `allowed`, else failed.
    pub(crate) fn note_error(&mut self, told: &dyn std::fmt::Display, allowed: bool) {
        let verdict = if allowed { CaseVerdict::Flagged } else { CaseVerdict::Fail };
        self.note(verdict, format!("{REPORTED}: {told}"));
    }

    /// Kind of the most important note: its text before the colon.
    pub fn reason(&self) -> Option<&str> {
        Some(self.notes.first()?.split_once(':')?.0)
    }

    /// Compares the number of iterations with its limit.
    pub(crate) fn count(&mut self, iterations: u64, bar: Option<u64>) {
        (self.iterations, self.bar) = (Some(iterations), bar);
        if let Some(bar) = bar {
            self.demand(iterations <= bar, || format!("{iterations} Newton iterations, more than {bar}"));
        }
    }

    /// Compares an error with its tolerance; NaN exceeds it.
    pub(crate) fn measure(&mut self, what: &str, error: f64, tolerance: f64) {
        if !self.error.is_some_and(|worst| worst / self.tolerance.unwrap_or(1.0) > error / tolerance) {
            (self.error, self.tolerance) = (Some(error), Some(tolerance));
        }
        let holds = error <= tolerance;
        self.demand(holds, || match error.is_finite() {
            true => format!("{what}: off by {error:.3e}, may be {tolerance:.1e}"),
            false => format!("{what}: off by more than any number, may be {tolerance:.1e}"),
        });
    }
}

/// True if the material has no state such as the start.
fn is_outside(error: &StepError) -> bool {
    matches!(error, StepError::NotFinite { step: 1, fault: Some(_), .. })
}

/// One case of the suite.
pub struct Case {
    /// Row: `D1` to `D13` of the list of extreme cases, `K18` and `K18-long` of those of contact,
    /// `torture` for the table of starts.
    pub row: &'static str,
    /// Short description.
    pub name: String,
    /// Dimension, 2 or 3.
    pub dimension: usize,
    /// Material, or another energy.
    pub material: String,
    /// Poisson's ratio, if there is one.
    pub poisson: Option<f64>,
    /// Name of the integrator.
    pub integrator: String,
    /// Linear solver.
    pub solver: LinearSolver,
    /// True if the case takes about a tenth of a second or less.
    pub quick: bool,
    /// True if the case takes minutes to hours: it runs only on request.
    pub is_long: bool,
    run: Box<dyn Fn(&Limits<'_>) -> CaseResult + Send + Sync>,
}

impl Case {
    /// Runs the case. All findings except the time are reproducible on any number of threads.
    pub fn run(&self) -> CaseResult {
        self.run_within(None, &AtomicBool::new(false))
    }

    /// Runs the case until `interrupt` is set; a case of a [scene](scene_cases) or a long case ends after
    /// `time`.
    pub fn run_within(&self, time: Option<Duration>, interrupt: &AtomicBool) -> CaseResult {
        let start = Instant::now();
        let findings = (self.run)(&Limits { deadline: time.map(|time| start + time), interrupt });
        // Infinite values and NaN are described in the notes.
        let finite = |x: Option<f64>| x.filter(|x| x.is_finite());
        CaseResult {
            seconds: start.elapsed().as_secs_f64(),
            min_j: finite(findings.min_j),
            energy_ratio: finite(findings.energy_ratio),
            error: finite(findings.error),
            ..findings
        }
    }
}

impl std::fmt::Debug for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} {} {}D {} {:?} {}",
            self.row, self.name, self.dimension, self.material, self.poisson, self.integrator
        )
    }
}

/// Title of a row; an unknown row itself.
pub fn row_title(row: &str) -> &str {
    match row {
        "torture" => "Degenerate initial configurations",
        "D1" => "D1: steps from a tenth of a millisecond to a second",
        "D2" => "D2: an explicit integrator below and above its stability limit",
        "D3" => "D3: a bar twisted by up to four turns, then released",
        "D4" => "D4: mass ratios of up to a million",
        "D5" => "D5: stiffness ratios of up to a million",
        "D6" => "D6: nearly incompressible",
        "D7" => "D7: slivers",
        "D8" => "D8: elements of zero volume",
        "D9" => "D9: other units",
        "D10" => "D10: invalid input",
        "D11" => "D11: stretched tenfold, then released",
        "D12" => "D12: free spin",
        "D13" => "D13: a column under twice its buckling load",
        "K18" => "K18: contact that is too soft or too stiff, between bodies of different mass and stiffness",
        "K18-long" => "K18, long: contact over hundreds and thousands of steps",
        row => row,
    }
}

/// Criteria of a row beyond its title, and its cases, as a paragraph of Markdown.
pub fn row_description(row: &str) -> Option<&'static str> {
    (row == "K18-long").then_some(rows::ABOUT_LONG)
}

/// Selection of cases: those that match every non-empty list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CaseFilter {
    /// Rows and names of cases.
    pub only: Vec<String>,
    /// Materials. Those without reference iterations are added to the table of starts if named here.
    pub materials: Vec<String>,
    /// Names of integrators.
    pub integrators: Vec<String>,
    /// Linear solvers. Named solvers run through the whole table of starts, and through every implicit
    /// integrator on a scene.
    pub solvers: Vec<LinearSolver>,
    /// True for quick cases only.
    pub quick: bool,
    /// True to include long cases that `only` does not name.
    pub long: bool,
}

impl CaseFilter {
    fn takes(&self, case: &Case) -> bool {
        let listed = |list: &[String], name: &str| {
            list.is_empty() || list.iter().any(|l| l.eq_ignore_ascii_case(name))
        };
        let named = !self.only.is_empty() && (listed(&self.only, case.row) || listed(&self.only, &case.name));
        (named || self.only.is_empty() && (self.long || !case.is_long))
            && listed(&self.materials, &case.material)
            && listed(&self.integrators, &case.integrator)
            && (self.solvers.is_empty() || self.solvers.contains(&case.solver))
            && (case.quick || !self.quick)
    }
}

/// Selected cases of the suite, in order.
pub fn cases(choice: &CaseFilter) -> Vec<Case> {
    let mut cases = vec![];
    torture::add(choice, &mut cases);
    rows::add(&mut cases);
    cases.retain(|case| choice.takes(case));
    cases
}
