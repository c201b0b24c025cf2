//! One row of a study: one integrator at one step, its errors and its cost.

use serde::{Deserialize, Serialize};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RowStatus {
    /// It reached the end.
    Ok,
    /// A position, velocity or force was not finite.
    Diverged,
    /// The equations of an implicit step were not solved.
    NewtonFailed,
    /// The energy grew beyond any physical cause.
    EnergyBlowUp,
}

impl RowStatus {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            RowStatus::Ok => "ok",
            RowStatus::Diverged => "diverged",
            RowStatus::NewtonFailed => "Newton failed",
            RowStatus::EnergyBlowUp => "energy blew up",
        }
    }
}

/// Version of the columns.
pub const SCHEMA: u32 = 1;

/// The columns of a study's table, and of its JSON. Errors and orders are `None` where a run failed; solver
/// columns where there is no solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Row {
    /// Version of the columns.
    pub schema: u32,
    /// Name of the scene.
    pub case: String,
    /// Of the program's source.
    pub commit: String,
    /// Name of the machine.
    pub host: String,
    /// Model of its processor.
    pub cpu: String,
    /// Threads that steps ran on.
    pub threads: usize,
    /// Version of the compiler.
    pub rustc: String,
    /// How it was called, and the instruction set of the kernels.
    pub flags: String,
    /// `f64`.
    pub precision: String,
    /// Elements of the bodies: `tri3`, `tet4`, `tri6`, `tet10`, `springs`, `particles`.
    pub element: String,
    /// Materials of the bodies.
    pub material: String,
    /// Poisson's ratio of the first material that has one.
    pub nu: Option<f64>,
    /// Coordinates that are free to move.
    pub ndof: usize,
    /// `lumped`.
    pub mass: String,
    /// The scheme.
    pub integrator: String,
    /// The order that it is documented to have.
    pub order_nominal: u32,
    /// Forces or solutions in a step.
    pub stages: u32,
    /// Step [s].
    pub dt: f64,
    /// Steps taken.
    pub steps: u64,
    /// Simulated time [s].
    pub t_end: f64,
    /// Newton's method stops at corrections below this [m].
    pub newton_tol: Option<f64>,
    /// The linear solver.
    pub lin_solver: Option<String>,
    /// Largest rms error of positions at any time of comparison, relative.
    pub err_q_rms: Option<f64>,
    /// Largest error of any vertex's position, relative to the same.
    pub err_q_max: Option<f64>,
    /// Largest rms error of velocities, relative.
    pub err_v_rms: Option<f64>,
    /// Largest change of what energy is conserved, over the energy in play.
    pub err_energy_max: Option<f64>,
    /// Largest error of the momentum, relative.
    pub err_momentum: Option<f64>,
    /// Largest error of the angular momentum, relative.
    pub err_angmom: Option<f64>,
    /// The reference.
    pub ref_id: String,
    /// Its own error, estimated.
    pub ref_err: f64,
    /// How the run ended.
    pub status: RowStatus,
    /// When, if it failed [s].
    pub fail_time: Option<f64>,
    /// Evaluations of the total force.
    pub n_force: u64,
    /// Matrices assembled.
    pub n_hess: u64,
    /// Matrices factorised.
    pub n_factor: u64,
    /// Newton iterations.
    pub n_newton: u64,
    /// Energies evaluated in line searches.
    pub n_linesearch: u64,
    /// Iterations of conjugate gradients.
    pub n_cg: u64,
    /// The shortest of the timed runs, stepping alone [s].
    pub wall_min_s: f64,
    /// Their median [s].
    pub wall_median_s: f64,
    /// Between their first and third quartile [s].
    pub wall_iqr_s: f64,
    /// How many there were.
    pub repeats: usize,
    /// Assembly [s]: meshes, masses, stability limit. The symbolic factorisation belongs to the first step.
    pub setup_s: f64,
    /// Largest resident memory of the process during the run [MB], where the system tells.
    pub peak_rss_mb: Option<f64>,
    /// Order between this row and that of the next larger step.
    pub obs_order: Option<f64>,
    /// Tolerance of steps that follow the error; `dt` is then their mean.
    pub tol: Option<f64>,
    /// Steps that were taken back.
    pub n_reject: Option<u64>,
    /// Changes beside the scheme: `path=value`, joined by `; `.
    pub variant: String,
    /// True if the error is too near to that of the reference to say anything.
    pub dropped: bool,
    /// The failure.
    pub message: Option<String>,
}

/// Columns of the table, in order.
pub const COLUMNS: [&str; 46] = [
    "schema",
    "case",
    "commit",
    "host",
    "cpu",
    "threads",
    "rustc",
    "flags",
    "precision",
    "element",
    "material",
    "nu",
    "ndof",
    "mass",
    "integrator",
    "order_nominal",
    "stages",
    "dt",
    "steps",
    "t_end",
    "newton_tol",
    "lin_solver",
    "err_q_rms",
    "err_q_max",
    "err_v_rms",
    "err_energy_max",
    "err_momentum",
    "err_angmom",
    "ref_id",
    "ref_err",
    "status",
    "fail_time",
    "n_force",
    "n_hess",
    "n_factor",
    "n_newton",
    "n_linesearch",
    "n_cg",
    "wall_min_s",
    "wall_median_s",
    "wall_iqr_s",
    "repeats",
    "setup_s",
    "peak_rss_mb",
    "obs_order",
    "variant",
];

/// Additional columns at the end.
const MORE: [&str; 4] = ["tol", "n_reject", "dropped", "message"];

/// All columns of the table, in order.
pub fn columns() -> impl Iterator<Item = &'static str> {
    COLUMNS.into_iter().chain(MORE)
}

impl Row {
    /// True if the row takes part in fits and charts of errors.
    pub fn counts(&self) -> bool {
        self.status == RowStatus::Ok && !self.dropped
    }

    /// Position error of a row that counts.
    pub fn error(&self) -> Option<f64> {
        self.err_q_rms.filter(|_| self.counts())
    }

    /// Cells in the order of the columns.
    fn cells(&self) -> Vec<String> {
        let value = serde_json::to_value(self).unwrap_or_default();
        let cell = |name: &str| match &value[name] {
            serde_json::Value::Null => String::new(),
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        columns().map(cell).collect()
    }
}

/// Rows as comma-separated values with a header and unrounded numbers.
pub fn csv<'a>(rows: impl IntoIterator<Item = &'a Row>) -> String {
    let header: Vec<&str> = columns().collect();
    let mut out = header.join(",") + "\n";
    for row in rows {
        let cells: Vec<String> = row.cells().into_iter().map(quoted).collect();
        out += &cells.join(",");
        out.push('\n');
    }
    out
}

/// Quotes a cell as in RFC 4180.
fn quoted(cell: String) -> String {
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell,
    }
}
