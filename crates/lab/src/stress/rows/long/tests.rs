//! The scenes of the long cases in sizes that take seconds, and wrong outcomes that must fail.

use super::chain::LinkedRings;
use super::run::LongRun;
use super::*;
use crate::stress::{CaseFilter, CaseResult, CaseVerdict, cases, row_description, row_title};

fn run(scenes: impl Fn(&mut LongRun<'_>) -> Option<()> + Send + Sync + 'static) -> CaseResult {
    LongCase::new("small", scenes).case().run()
}

/// Runs a small version: all criteria of its case hold.
fn stands(scenes: impl Fn(&mut LongRun<'_>) -> Option<()> + Send + Sync + 'static) -> CaseResult {
    let result = run(scenes);
    assert!(result.verdict != CaseVerdict::Fail, "{:?}", result.notes);
    assert!(!result.cut_short && result.least_gap.is_some(), "{result:?}");
    assert!(result.steps.unwrap() > 0 && result.worst_step.unwrap() < result.iterations.unwrap());
    result
}

#[test]
fn long_cases_are_there_if_they_are_asked_for() {
    let chosen = |long: bool, only: &[&str]| {
        let only = only.iter().map(|name| (*name).to_owned()).collect();
        let all = cases(&CaseFilter { long, only, ..CaseFilter::default() });
        all.into_iter().filter(|case| case.is_long).map(|case| case.name).collect::<Vec<_>>()
    };
    assert!(chosen(false, &[]).is_empty());
    let all = chosen(true, &[]);
    for what in [
        "sheet of 12 x 12",
        "sheet of 20 x 20",
        "needles",
        "knives",
        "cards",
        "1 um",
        "1 mm",
        "stiff cubes",
        "soft cubes",
        "large cube",
        "ball pressed",
        "16 x 16",
        "40 x 40",
        "of 2 s",
        "of 0.002 s",
        "halves of a step",
        "ten links",
    ] {
        assert_eq!(all.iter().filter(|name| name.contains(what)).count(), 1, "{what} in {all:?}");
    }
    // The command line separates names by commas.
    assert!(all.iter().all(|name| !name.contains(',')), "{all:?}");
    assert_eq!(chosen(false, &["k18-long"]), all);
    assert_eq!(chosen(false, &[&all[0]]), all[..1]);
    assert!(chosen(true, &["K18"]).is_empty());
    assert!(row_title("K18-long").len() > 20 && row_description("K18-long").is_some());
}

#[test]
fn small_scenes_that_fall_are_as_their_long_cases_ask() {
    stands(|run| falling::flies(run, 6, 4));
    stands(|run| falling::on_needles(run, 2, 30));
    stands(|run| falling::on_knives(run, 12, 30));
    stands(|run| falling::hangs(run, &LinkedRings { links: 2, cells: [12, 1] }, 50));
}

#[test]
fn small_scenes_that_stand_are_as_their_long_cases_ask() {
    let result = stands(|run| standing::stones(run, 1e-3, 50));
    assert_eq!(result.steps, Some(50 + 30));
    stands(|run| standing::cards(run, 8, 60));
    stands(|run| standing::stack(run, 1e9, 20));
}

#[test]
fn small_scenes_that_are_pressed_or_wrung_are_as_their_long_cases_ask() {
    stands(|run| pressed::pressed(run, 2, 5e-3));
    stands(|run| pressed::large_on_small(run, 1, 20));
    stands(|run| wrung::mat(run, 8, 64));
    stands(|run| wrung::rods(run, 20, 0.1, 5.0).map(|_| ()));
}

#[test]
fn what_crosses_is_found_and_ends_a_case() {
    let result = run(|run| {
        let chain = LinkedRings { links: 2, cells: [12, 1] };
        let mut scene = run.begin("rings without contact", &chain.text(""), 50);
        run.take(&mut scene, 50)
    });
    assert_eq!(result.verdict, CaseVerdict::Fail);
    assert!(result.notes[0].contains("rings without contact: after step "), "{:?}", result.notes);
    assert!(result.notes[0].contains("primitives cross"), "{:?}", result.notes);
    assert!((1..50).contains(&result.steps.unwrap()), "{result:?}");
}

#[test]
fn energy_from_nowhere_is_found() {
    let gains = |step: f64| {
        let text = format!(
            "dimension = 2\ntime = {{ integrator = 'velocity-verlet', step = {step:?}, duration = 1.0, \
             allow_unstable = true }}\n\
             world = {{ gravity = [0, -9.81] }}\n[[body]]\nname = 'block'\nmesh = {{ grid = {{ cells = [3, \
             2], spacing = 0.3 }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000.0 }}\n\
             pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }} }}]\n"
        );
        let result = run(move |run| {
            let mut scene = run.begin("block", &text, 13);
            run.take(&mut scene, 13)?;
            run.end(&mut scene);
            Some(())
        });
        result.notes.iter().any(|note| note.contains("come from nowhere"))
    };
    // Above the stability limit, and far below it, where energies vary by the integrator's second-order
    // error.
    assert!(gains(0.02));
    assert!(!gains(1e-6));
}

#[test]
fn what_falls_over_does_not_stand() {
    let result = run(|run| {
        let mut scene = run.begin("arch", &setups::arch(1e-3, 0.2), 30);
        let start = scene.centre("stone12")[1];
        run.take(&mut scene, 30)?;
        run.measure("the keystone", start - scene.centre("stone12")[1], 1e-3);
        run.end(&mut scene);
        Some(())
    });
    assert!(result.verdict == CaseVerdict::Fail && result.notes[0].contains("the keystone"), "{result:?}");
}

#[test]
fn a_long_case_that_is_out_of_time_says_how_far_it_came() {
    let case = LongCase::new("arch", |run| standing::stones(run, 1e-3, 2000)).case();
    let time = std::time::Duration::from_millis(300);
    let result = case.run_within(Some(time), &AtomicBool::new(false));
    assert!(result.cut_short && result.verdict == CaseVerdict::Flagged, "{result:?}");
    assert!(result.notes[0].starts_with("cut short: arch with mu = 0.5, sound for "), "{:?}", result.notes);
    assert!(result.notes[0].ends_with(" of 2000 steps"), "{:?}", result.notes);
}
