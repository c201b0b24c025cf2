//! Golden counters: the work of solvers in the first steps of every scene whose steps are solved.
//!
//! `tests/data/counters.txt` has one line of integers for each scene. Counts are exact: the same program does
//! the same work on every machine. A change that is meant is recorded by `PLIANT_RECORD_COUNTERS=1 cargo test
//! --test pliant counters`, and shows in the diff of that file.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use pliant::simulation::Simulation;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// Steps that are taken of each scene; fewer where its duration has fewer.
const STEPS: u64 = 20;

const HEADER: &str = "# Work of solvers in the first steps of every scene whose steps are solved; \
                      `tests/counters.rs` compares it.\n\
    # scene steps newton_iterations energies halvings hessians factorizations cg_iterations fallbacks \
    rejected retried\n";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Scene files below `scenes/`, by name.
fn scenes() -> Vec<PathBuf> {
    let folders = ["scenes", "scenes/study"].map(|folder| root().join(folder).read_dir().unwrap());
    let mut paths: Vec<PathBuf> = folders.into_iter().flatten().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    paths
}

/// Takes the first steps, no further than `duration` [s].
fn take_steps(simulation: &mut Simulation, duration: f64) {
    while simulation.state().step < STEPS && simulation.state().time < duration * (1.0 - 1e-12) {
        simulation.step().unwrap();
    }
}

/// Counters of a scene in the order of the header; `None` for schemes that solve nothing.
fn counters(path: &Path) -> Option<String> {
    let scene = Scene::from_path(path).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|p| panic!("{p:?}")).simulation;
    take_steps(&mut simulation, scene.time.duration);
    let work = simulation.work();
    let solver = work.solver?;
    let name = path.strip_prefix(root().join("scenes")).unwrap().display();
    Some(format!(
        "{name} {} {} {} {} {} {} {} {} {} {}\n",
        work.steps,
        solver.newton_iterations,
        solver.energies,
        solver.halvings,
        solver.hessians,
        solver.factorizations,
        solver.cg_iterations,
        solver.fallbacks,
        work.rejected_steps.unwrap_or(0),
        work.retried.map_or(0, |retried| retried.steps),
    ))
}

#[test]
fn every_solved_scene_does_the_work_that_was_recorded() {
    let file = root().join("tests/data/counters.txt");
    let mut found = HEADER.to_owned();
    scenes().iter().filter_map(|path| counters(path)).for_each(|line| write!(found, "{line}").unwrap());
    assert!(found.lines().count() > 10, "{found}");
    if std::env::var_os("PLIANT_RECORD_COUNTERS").is_some() {
        std::fs::write(&file, &found).unwrap();
    }
    let recorded = std::fs::read_to_string(&file).unwrap();
    for (found, recorded) in found.lines().zip(recorded.lines()) {
        assert_eq!(found, recorded, "scene and its counters, found and recorded");
    }
    assert_eq!(found.lines().count(), recorded.lines().count(), "scenes that are solved");
}
