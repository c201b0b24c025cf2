//! Bands of counters: the work of solvers in the first steps of every scene whose steps are solved.
//!
//! `tests/data/counters.txt` has one line of integers for each scene. The same program does the same work on
//! every machine. A count that exceeds its record by more than a third fails; a smaller one passes.
//! `PLIANT_RECORD_COUNTERS=1 cargo test --test pliant counters` records all counts anew.

use std::collections::BTreeMap;
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
fn counters(path: &Path) -> Option<(String, Vec<u64>)> {
    let scene = Scene::from_path(path).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|p| panic!("{p:?}")).simulation;
    take_steps(&mut simulation, scene.time.duration);
    let work = simulation.work();
    let solver = work.solver?;
    let name = path.strip_prefix(root().join("scenes")).unwrap().display().to_string();
    let counts = vec![
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
    ];
    Some((name, counts))
}

/// Largest count that passes beside a recorded one: a third more, and three more where counts are small.
fn most(recorded: u64) -> u64 {
    (recorded + recorded / 3).max(recorded + 3)
}

/// The recorded counters of every scene, by its name.
fn recorded(file: &Path) -> BTreeMap<String, Vec<u64>> {
    let text = std::fs::read_to_string(file).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#')).map(|line| {
        let mut words = line.split(' ');
        let name = words.next().unwrap().to_owned();
        (name, words.map(|count| count.parse().unwrap()).collect())
    });
    rows.collect()
}

/// The names of counters that exceed their band, of one scene.
fn beyond<'a>(found: &[u64], recorded: &[u64]) -> Vec<&'a str> {
    let names = HEADER.lines().last().unwrap().split(' ').skip(2);
    let counts = found.iter().zip(recorded);
    names
        .zip(counts)
        .filter(|(_, (found, recorded))| **found > most(**recorded))
        .map(|(name, _)| name)
        .collect()
}

#[test]
fn no_solved_scene_does_a_third_more_work_than_was_recorded() {
    let file = root().join("tests/data/counters.txt");
    let found: BTreeMap<_, _> = scenes().iter().filter_map(|path| counters(path)).collect();
    assert!(found.len() > 10, "{found:?}");
    if std::env::var_os("PLIANT_RECORD_COUNTERS").is_some() {
        let mut text = HEADER.to_owned();
        for (name, counts) in &found {
            let counts: Vec<_> = counts.iter().map(u64::to_string).collect();
            writeln!(text, "{name} {}", counts.join(" ")).unwrap();
        }
        std::fs::write(&file, text).unwrap();
    }
    let recorded = recorded(&file);
    let names: Vec<_> = found.keys().collect();
    assert_eq!(names, recorded.keys().collect::<Vec<_>>(), "scenes that are solved");
    for (name, found) in &found {
        let recorded = &recorded[name];
        let beyond = beyond(found, recorded);
        assert!(beyond.is_empty(), "{name}: {beyond:?} beyond their bands: {found:?}, recorded {recorded:?}");
    }
}

#[test]
fn a_count_fails_from_a_third_more_on() {
    assert_eq!(beyond(&[20, 133, 3], &[20, 100, 0]), [] as [&str; 0]);
    assert_eq!(beyond(&[20, 134, 4], &[20, 100, 0]), ["newton_iterations", "energies"]);
}
