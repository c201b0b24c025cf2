//! Contact in surveys of whole scenes: the limit of steps, studies of schemes, the torture suite.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pliant::integrator::IntegratorSpec;
use pliant_lab::stability::{StabilitySurvey, SurveyOptions, measure_limit};
use pliant_lab::stress::{CaseFilter, CaseVerdict, cases};
use pliant_lab::study::{Provenance, Results, Study, StudyError, StudyPlan, WallClock};
use pliant_scene::{Scene, Source};

fn spec(name: &str) -> IntegratorSpec {
    *IntegratorSpec::ALL.iter().find(|s| s.method().documentation.name == name).unwrap()
}

/// A particle so heavy that it rests on a floor just where its gap would close: `m g = 2 kappa w` with `kappa
/// w` = 1000 N/m, 1 kg and a reach of 1 mm, so that `omega^2 = 4 kappa w / (m dhat)` there.
fn heavy_particle(integrator: &str) -> Scene {
    Scene::from_toml(&format!(
        "dimension = 2\ntime = {{ integrator = '{integrator}', step = 1e-4, duration = 1.0, allow_unstable \
         = true }}\n\
         world = {{ gravity = [0, -2000] }}\ncontact = {{ distance = 1e-3, stiffness = 1e5 }}\n\
         [[body]]\nmesh = {{ inline = {{ points = [[0, 0.0045000001]] }} }}\nmass = {{ per_vertex = 1.0 }}\n\
         contact = {{ radius = 0.0045 }}\n\
         [[obstacle]]\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
    ))
    .unwrap()
}

// Contact that is not there at the start counts as well as contact that is: here it is, and the limit is met.
#[test]
fn the_limit_of_a_body_at_rest_on_a_floor_is_the_one_predicted() {
    for name in ["symplectic-euler", "velocity-verlet", "yoshida4", "rk4"] {
        let found = measure_limit(&heavy_particle(name), spec(name), 1.0, &Arc::default()).unwrap().unwrap();
        let predicted = found.predicted.unwrap();
        let omega = (4.0 * 1000.0 / 1e-3f64).sqrt();
        let radians = spec(name).method().documentation.stability_limit;
        assert!((predicted - radians / omega).abs() < 1e-6 * predicted, "{name}: {found:?}");
        // Schemes that grow slowly above their limit are found out later: in 1000 steps from a nanometre.
        let ratio = found.measured / predicted;
        assert!((0.999..1.1).contains(&ratio), "{name}: {found:?}");
    }
}

#[test]
fn schemes_that_do_not_hold_contact_are_left_out_of_a_survey_with_the_reason() {
    let text = heavy_particle("velocity-verlet").to_toml().unwrap();
    let source = Source::new("heavy", &text);
    let survey = |names: &[&str]| {
        let integrators = names.iter().map(|name| (*name).to_owned()).collect();
        let choice = SurveyOptions { integrators, quick: true, ..SurveyOptions::default() };
        StabilitySurvey::of(&source, &choice, &Arc::default(), &mut |_| {})
    };
    let found = survey(&["velocity-verlet", "implicit-midpoint"]).unwrap();
    assert_eq!(found.limits.len(), 1);
    assert_eq!(found.refused[0].integrator, "implicit-midpoint");
    assert!(found.refused[0].reason.contains("behind an obstacle"), "{:?}", found.refused);
    let error = survey(&["gauss2"]).unwrap_err().to_string();
    assert!(error.contains("`gauss2`") && error.contains("behind an obstacle"), "{error}");
}

/// Two masses on a line that meet, as one particle each.
fn meeting(integrator: &str) -> String {
    let grain = |name: &str, x: f64, v: f64| {
        format!(
            "[[body]]\nname = '{name}'\nmesh = {{ inline = {{ points = [[{x}, 0]] }} }}\nmass = {{ \
             per_vertex = 1.0 }}\n\
             contact = {{ radius = 0.01 }}\nvelocity = {{ rigid = {{ linear = [{v}, 0] }} }}\n"
        )
    };
    format!(
        "dimension = 2\ntime = {{ integrator = '{integrator}', step = 1e-3, duration = 0.1 }}\n\
         contact = {{ distance = 0.02, stiffness = 1e4 }}\n{}{}",
        grain("a", -0.03, 0.5),
        grain("b", 0.03, -0.5)
    )
}

// All schemes have the energy of the scene's own, and what cannot hold it is said.
#[test]
fn schemes_are_compared_on_one_law_of_contact() {
    let schemes = [IntegratorSpec::VelocityVerlet, IntegratorSpec::TrBdf2, IntegratorSpec::ImplicitMidpoint];
    let steps = [1e-3, 5e-4, 2.5e-4];
    let explicit = meeting("velocity-verlet");
    let cubic = study(&explicit, &schemes, &steps).unwrap();
    assert!(cubic.refused.is_empty(), "{:?}", cubic.refused);
    assert_eq!(cubic.variants[0].lines.len(), 3);
    for line in &cubic.variants[0].lines {
        assert!(line.order_observed.is_some_and(|order| (order - 2.0).abs() < 0.4), "{line:?}");
    }
    let implicit = meeting("implicit-euler");
    let barrier = study(&implicit, &schemes, &steps).unwrap();
    let refused: Vec<&str> = barrier.refused.iter().map(|refused| refused.integrator.as_str()).collect();
    assert_eq!(refused, ["implicit-midpoint"]);
    assert_eq!(barrier.variants[0].lines.len(), 2);
    // Other laws, other motions.
    let end = |results: &Results| results.variants[0].reference.trajectory.x.last().unwrap()[0];
    assert!((end(&cubic) - end(&barrier)).abs() > 1e-4, "{} and {}", end(&cubic), end(&barrier));
    let only = study(&implicit, &[IntegratorSpec::ImplicitMidpoint], &steps).unwrap_err().to_string();
    assert!(only.contains("behind an obstacle"), "{only}");
}

/// A study of these schemes in these steps, each run once.
fn study(text: &str, schemes: &[IntegratorSpec], steps: &[f64]) -> Result<Results, StudyError> {
    let source = Source::new("meeting", text);
    let plan = StudyPlan::of(&source.scene().unwrap()).unwrap();
    let contenders = schemes.iter().map(|spec| (*spec).into()).collect();
    let plan = StudyPlan { contenders, steps: steps.to_vec(), repeats: Some(1), ..plan };
    let study = Study {
        source: &source,
        name: "meeting",
        plan: &plan,
        folder: None,
        provenance: &Provenance::here("", "", ""),
        clock: &WallClock::default(),
        interrupt: &AtomicBool::new(false),
    };
    study.run(&mut |_| {})
}

#[test]
fn contact_far_from_what_it_was_made_for_is_solved_or_said() {
    let choice = CaseFilter { only: vec!["K18".into()], ..CaseFilter::default() };
    let results: Vec<_> = cases(&choice).into_iter().map(|case| (case.run(), case)).collect();
    assert_eq!(results.len(), 18);
    for (found, case) in &results {
        assert!(found.verdict != CaseVerdict::Fail, "{case:?}: {}", found.notes.join("; "));
    }
    // What is far too soft is pressed to nothing, and it is told.
    let (soft, _) = results.iter().find(|(_, case)| case.name.ends_with("= 0.001")).unwrap();
    assert!(soft.verdict == CaseVerdict::Flagged && soft.notes[0].starts_with("overload"), "{soft:?}");
}
