//! `pliant stress`.

use std::path::PathBuf;

use clap::Args;
use pliant::solver::LinearSolver;

use super::values::time_span;

/// `pliant stress`.
#[derive(Args, Clone, Debug)]
pub(crate) struct StressArguments {
    /// Scene file (TOML), perturbed in place of the suite's own scenes; implicit integrators use its step,
    /// explicit ones a step below their own stability limit
    pub(crate) scene: Option<PathBuf>,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE", requires = "scene")]
    pub(crate) set: Vec<String>,
    /// Only these rows: torture, D1 to D13, K18, K18-long; or cases of these names
    #[arg(long, value_name = "ROW", value_delimiter = ',', conflicts_with = "scene")]
    pub(crate) only: Vec<String>,
    /// Only these materials; those without numbers of an independent program run if they are named
    #[arg(long, value_name = "NAME", value_delimiter = ',', conflicts_with = "scene")]
    pub(crate) materials: Vec<String>,
    /// Only these integrators; those without numbers of an independent program run if they are named
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) integrators: Vec<String>,
    /// Only these linear solvers: auto, cholesky, cg, multigrid, matrix-free; those that are named go
    /// through every start, and through every implicit scheme on a scene
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = linear_solver)]
    pub(crate) solvers: Vec<LinearSolver>,
    /// Cases that take a tenth of a second or less
    #[arg(long)]
    pub(crate) quick: bool,
    /// Long cases as well, row K18-long: contact through hundreds and thousands of steps, in scenes that take
    /// from seconds to many hours each
    #[arg(long, conflicts_with_all = ["scene", "quick"])]
    pub(crate) long: bool,
    /// Wall time for everything, for example 60s or "5 min": runs of a scene and long cases are cut short
    /// where it is over, and say so, other cases of the suite left out [default: 60s for a scene]
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) budget: Option<f64>,
    /// Print a row for each case of a scene on a terminal, too; without it a terminal shows verdicts in a
    /// grid, the main reasons and a conclusion
    #[arg(long, requires = "scene")]
    pub(crate) all: bool,
    /// Also write stress.csv, stress.json and stress.html with pictures of the end states into this folder
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Take results of long cases from stress.json in the folder of --output, which a program of the same
    /// commit wrote, in place of running them again; it is written after each of them
    #[arg(long, requires = "output", conflicts_with = "scene")]
    pub(crate) resume: bool,
    /// Also write a page of Markdown, with its pictures in a folder beside it
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
}

fn linear_solver(text: &str) -> Result<LinearSolver, String> {
    let named = LinearSolver::ALL.into_iter().find(|solver| solver.name().eq_ignore_ascii_case(text));
    named.ok_or_else(|| {
        format!("the linear solvers are {}", LinearSolver::ALL.map(LinearSolver::name).join(", "))
    })
}
