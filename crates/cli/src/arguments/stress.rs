//! `pliant stress`.

use std::path::PathBuf;

use clap::Args;
use pliant::solver::LinearSolver;

use super::values::time_span;

/// `pliant stress`.
#[derive(Args, Clone, Debug)]
pub(crate) struct StressArguments {
    /// Scene file (TOML) to perturb, instead of the built-in suite. Implicit integrators use its step,
    /// explicit ones a step below their own stability limit
    pub(crate) scene: Option<PathBuf>,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE", requires = "scene")]
    pub(crate) set: Vec<String>,
    /// Only these rows (torture, D1 to D13, K18, K18-long) or cases, by name
    #[arg(long, value_name = "ROW", value_delimiter = ',', conflicts_with = "scene")]
    pub(crate) only: Vec<String>,
    /// Only these materials; those without independent reference results run only if named
    #[arg(long, value_name = "NAME", value_delimiter = ',', conflicts_with = "scene")]
    pub(crate) materials: Vec<String>,
    /// Only these integrators; those without independent reference results run only if named
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) integrators: Vec<String>,
    /// Only these linear solvers: auto, cholesky, cg, multigrid, matrix-free; each runs every start, and on
    /// a scene every implicit integrator
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = linear_solver)]
    pub(crate) solvers: Vec<LinearSolver>,
    /// Only cases that take a tenth of a second or less
    #[arg(long)]
    pub(crate) quick: bool,
    /// Also the long cases, row K18-long: contact over hundreds and thousands of steps, each from seconds to
    /// many hours
    #[arg(long, conflicts_with_all = ["scene", "quick"])]
    pub(crate) long: bool,
    /// Wall time of all runs, for example 60s or "5 min": then runs of a scene and long cases are cut short,
    /// and say so, and other cases are omitted [default: 60s for a scene]
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) budget: Option<f64>,
    /// Print a row for each case on a terminal, too, instead of a grid of verdicts, the main reasons and a
    /// conclusion
    #[arg(long, requires = "scene")]
    pub(crate) all: bool,
    /// Also write stress.csv, stress.json and stress.html with pictures of the end states into this folder
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Reuse results of long cases in stress.json, in the folder of --output, if the same commit wrote them;
    /// the file is written after each case
    #[arg(long, requires = "output", conflicts_with = "scene")]
    pub(crate) resume: bool,
    /// Also write a Markdown page, with its pictures in a folder next to it
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
}

fn linear_solver(text: &str) -> Result<LinearSolver, String> {
    let named = LinearSolver::ALL.into_iter().find(|solver| solver.name().eq_ignore_ascii_case(text));
    named.ok_or_else(|| {
        format!("the linear solvers are {}", LinearSolver::ALL.map(LinearSolver::name).join(", "))
    })
}
