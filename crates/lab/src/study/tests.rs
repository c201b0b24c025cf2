//! Studies of small scenes, by a clock that counts force evaluations instead of waiting.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::*;
use pliant::integrator::splitting::Stage::{Drift, Kick};
use pliant::integrator::{IntegratorSpec, Scheme};
use pliant::observer::Work;
use pliant_scene::Source;

/// Clock on which every force evaluation takes ten microseconds, and nothing else takes time.
#[derive(Default)]
struct FakeClock(AtomicU64);

const FORCE_SECONDS: f64 = 1e-5;

impl Clock for FakeClock {
    fn now(&self) -> f64 {
        FORCE_SECONDS * self.0.load(Ordering::Relaxed) as f64
    }

    fn worked(&self, work: &Work) {
        self.0.fetch_add(work.force_evaluations, Ordering::Relaxed);
    }
}

/// A pendulum on a soft spring: smooth, nonlinear, not stiff.
const PENDULUM: &str = "dimension = 2
    time = { integrator = 'velocity-verlet', step = 0.01, duration = 1.0 }
    world = { gravity = [0.0, -9.81] }
    [[body]]
    mesh = { strand = { segments = 1, start = [0.0, 0.0], end = [1.0, 0.0] } }
    springs = { stiffness = 20.0 }
    mass = { per_vertex = 1.0 }
    pin = [{ vertices = [0] }]";

fn provenance() -> Provenance {
    let text = String::new;
    Provenance { commit: text(), host: text(), cpu: text(), rustc: text(), flags: text() }
}

/// Plan for these integrators and steps.
fn plan(text: &str, schemes: &[IntegratorSpec], steps: &[f64]) -> StudyPlan {
    let plan = StudyPlan::of(&Source::new("scene", text).scene().unwrap()).unwrap();
    let contenders = schemes.iter().map(|spec| (*spec).into()).collect();
    StudyPlan { contenders, steps: steps.to_vec(), repeats: Some(1), budget: Some(5.0), ..plan }
}

struct Made {
    results: Result<Results, StudyError>,
    clock: FakeClock,
    references: usize,
}

/// Runs a study that is interrupted after `rows` finished rows.
fn make(text: &str, plan: &StudyPlan, folder: Option<&Path>, rows: usize) -> Made {
    let (clock, interrupt) = (FakeClock::default(), AtomicBool::new(false));
    let source = Source::new("scene", text);
    let study = Study {
        source: &source,
        name: "scene",
        plan,
        folder,
        provenance: &provenance(),
        clock: &clock,
        interrupt: &interrupt,
    };
    let (mut finished, mut references) = (0, 0);
    let results = study.run(&mut |event| match event {
        Event::Finished(_) => {
            finished += 1;
            interrupt.store(finished >= rows, Ordering::Relaxed);
        }
        Event::Reference { .. } => references += 1,
        _ => {}
    });
    Made { results, clock, references }
}

fn made(text: &str, plan: &StudyPlan) -> Results {
    make(text, plan, None, usize::MAX).results.unwrap()
}

/// Columns that do not depend on machine or time of day, followed by counts.
fn errors(results: &Results) -> Vec<(String, [Option<f64>; 7], u64, u64)> {
    let columns = |r: &Row| {
        let errors = [
            r.err_q_rms,
            r.err_q_max,
            r.err_v_rms,
            r.err_energy_max,
            r.err_momentum,
            r.err_angmom,
            r.obs_order,
        ];
        (format!("{} {:?}", r.integrator, r.dt), errors, r.n_force, r.n_newton)
    };
    results.rows().map(columns).collect()
}

// E: orders are observed, and a wrong order is reported.
#[test]
fn a_scheme_that_is_wrong_is_exposed_by_its_order() {
    let mut wrong: Contender = IntegratorSpec::VelocityVerlet.into();
    // The kicks are not halves: first order, stable, and nearly right at any single step.
    wrong.method.scheme = Scheme::Splitting(&[Kick(0.45), Drift(1.0), Kick(0.55)]);
    let right = plan(PENDULUM, &[IntegratorSpec::VelocityVerlet], &[0.01, 0.005, 0.0025, 0.00125]);
    let wrong = StudyPlan { contenders: vec![wrong], ..right.clone() };
    let line = |plan: &StudyPlan| made(PENDULUM, plan).variants[0].lines[0].clone();
    let (right, wrong) = (line(&right), line(&wrong));
    assert!((right.order_observed.unwrap() - 2.0).abs() < 0.05 && !right.falls_short(), "{right:?}");
    assert!((wrong.order_observed.unwrap() - 1.0).abs() < 0.1 && wrong.falls_short(), "{wrong:?}");
}

#[test]
fn every_order_of_the_usual_schemes_is_observed() {
    let scene = Source::new("scene", PENDULUM).scene().unwrap();
    let usual = StudyPlan::of(&scene).unwrap();
    let plan = StudyPlan { steps: vec![0.02, 0.01, 0.005], repeats: Some(1), budget: Some(20.0), ..usual };
    let results = made(PENDULUM, &plan);
    assert!(results.variants[0].lines.len() >= 12);
    for line in &results.variants[0].lines {
        assert!(!line.falls_short(), "{line:?}");
    }
}

#[test]
fn schemes_that_are_named_run_alone_and_the_usual_ones_beside_that_of_the_scene() {
    let names = |text: &str| {
        let plan = StudyPlan::of(&Source::new("scene", text).scene().unwrap()).unwrap();
        plan.contenders.iter().map(|c| c.method.documentation.name).collect::<Vec<_>>()
    };
    let own = PENDULUM.replace("velocity-verlet", "newmark");
    assert!(names(&own).contains(&"newmark") && names(&own).len() > 10, "{own}");
    let named = format!("study = {{ integrators = ['rk4', 'symplectic-euler'] }}\n{own}");
    assert_eq!(names(&named), ["rk4", "symplectic-euler"]);
}

// Promise 1, and E: errors are equal in every run.
#[test]
fn everything_but_times_is_the_same_again() {
    let plan = plan(PENDULUM, &[IntegratorSpec::Rk4, IntegratorSpec::TrBdf2], &[0.02, 0.01]);
    let once = made(PENDULUM, &plan);
    let again = made(PENDULUM, &StudyPlan { threads: 2, ..plan });
    assert_eq!(errors(&once), errors(&again));
    assert_eq!(once.variants[0].reference, again.variants[0].reference);
}

#[test]
fn a_budget_is_kept_and_used() {
    let budget = 3.0;
    let schemes = [IntegratorSpec::VelocityVerlet, IntegratorSpec::Rk4, IntegratorSpec::ImplicitMidpoint];
    let plan = StudyPlan { budget: Some(budget), ..plan(PENDULUM, &schemes, &[]) };
    let Made { results, clock, .. } = make(PENDULUM, &plan, None, usize::MAX);
    let results = results.unwrap();
    assert!(clock.now() <= 1.02 * budget, "{} s of {budget} s", clock.now());
    assert!(clock.now() >= 0.3 * budget, "{} s of {budget} s", clock.now());
    for line in &results.variants[0].lines {
        assert!(results.variants[0].of(&line.integrator).count() >= 5, "{line:?}");
    }
    assert!(results.variants[0].lines.iter().any(|line| line.stop == StopReason::Budget));
    // A tenth of the budget completes fewer rows.
    let less = make(PENDULUM, &StudyPlan { budget: Some(0.1 * budget), ..plan }, None, usize::MAX);
    assert!(less.clock.now() <= 1.02 * 0.1 * budget, "{} s", less.clock.now());
    assert!(less.results.unwrap().rows().count() < results.rows().count());
}

#[test]
fn an_interrupted_study_goes_on_where_it_ended() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(PENDULUM, &[IntegratorSpec::VelocityVerlet, IntegratorSpec::Rk4], &[0.02, 0.01, 0.005]);
    let whole = make(PENDULUM, &plan, None, usize::MAX);
    let first = make(PENDULUM, &plan, Some(folder.path()), 2);
    let first_results = first.results.unwrap();
    assert!(!first_results.complete);
    assert_eq!(first_results.rows().count(), 2);
    assert!(first.references > 0);
    // Incomplete line of a killed program.
    let journal = folder.path().join("journal.jsonl");
    let mut text = std::fs::read_to_string(&journal).unwrap();
    text += "{\"key\": \"half a li";
    std::fs::write(&journal, text).unwrap();
    let second = make(PENDULUM, &plan, Some(folder.path()), usize::MAX);
    assert_eq!(second.references, 0, "the reference was kept");
    assert_eq!(errors(&second.results.unwrap()), errors(&whole.results.unwrap()));
    let third = make(PENDULUM, &plan, Some(folder.path()), usize::MAX);
    assert_eq!(third.clock.now(), 0.0, "nothing is left to do");
    // Another scene has another reference and other rows.
    let other = PENDULUM.replace("20.0", "25.0");
    assert!(make(&other, &plan, Some(folder.path()), usize::MAX).references > 0);
}

/// Row of one integrator at one step.
fn row(text: &str, spec: IntegratorSpec, step: f64) -> Row {
    made(text, &plan(text, &[spec], &[step])).rows().next().unwrap().clone()
}

const SQUARE: &str = "dimension = 2
    time = { integrator = 'velocity-verlet', step = 1e-3, duration = 0.5 }
    world = { gravity = [0.0, -9.81] }
    [[body]]
    mesh = { grid = { cells = [2, 2], spacing = 0.5 } }
    elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
    mass = { density = 1000.0 }
    pin = [{ half_space = { normal = [1.0, 0.0], offset = 0.0 } }]";

#[test]
fn a_run_that_works_is_ok() {
    let row = row(PENDULUM, IntegratorSpec::VelocityVerlet, 0.01);
    assert_eq!((row.status, row.fail_time, row.message), (RowStatus::Ok, None, None));
    assert!(row.err_q_rms.unwrap() < 1e-3);
}

#[test]
fn a_run_whose_state_is_not_finite_has_diverged() {
    // An element inverts, which a barrier does not allow.
    let row = row(SQUARE, IntegratorSpec::VelocityVerlet, 0.025);
    assert_eq!(row.status, RowStatus::Diverged, "{row:?}");
    assert!(row.fail_time.unwrap() > 0.0 && row.err_q_rms.is_none() && !row.dropped);
    assert!(row.message.unwrap().contains("s) failed"));
}

#[test]
fn a_run_that_gains_energy_has_blown_up() {
    // Omega is sqrt(20): the limit is 0.45 s, below half a second.
    let text = PENDULUM
        .replace("duration = 1.0", "duration = 150.0")
        .replace("gravity = [0.0, -9.81]", "gravity = [0.1, 0.0]");
    let row = row(&text, IntegratorSpec::VelocityVerlet, 0.5);
    assert_eq!(row.status, RowStatus::EnergyBlowUp, "{row:?}");
    assert!(row.fail_time.unwrap() > 0.0 && row.err_energy_max.is_none());
}

#[test]
fn a_run_whose_equations_are_not_solved_says_so() {
    let text = SQUARE.replace(
        "integrator = 'velocity-verlet',",
        "integrator = 'implicit-euler', solver = { iterations = 1, tolerance = 1e-12 },",
    );
    let row = row(&text, IntegratorSpec::ImplicitEuler, 0.025);
    assert_eq!(row.status, RowStatus::NewtonFailed, "{row:?}");
    assert!(row.message.unwrap().contains("not solved"));
}

#[test]
fn a_failed_run_is_a_cross_in_the_chart_and_a_remark_in_the_report() {
    let plan = plan(SQUARE, &[IntegratorSpec::VelocityVerlet], &[0.025, 0.001]);
    let results = made(SQUARE, &plan);
    let report = report::StudyReport::new("A & B <c>", &[results], &report::FigureKind::ALL).unwrap();
    assert!(report.sections[0].figures[0].svg.contains("the run failed"));
    let (page, html) = (report.markdown("charts/"), report.html());
    assert!(page.starts_with("# A & B \\<c\\>\n"), "{page}");
    assert!(page.contains(ABOUT_ERRORS) && html.contains(ABOUT_ERRORS));
    assert!(page.contains("velocity-verlet failed with steps of 25 ms (diverged at t ="), "{page}");
    assert!(html.contains("A &amp; B &lt;c&gt;") && !html.contains("<c>"));
    for (file, svg) in report.charts() {
        assert!(page.contains(&format!("](charts/{file})")), "{file}");
        assert!(html.contains(svg), "{file}");
    }
    let toml = page.rsplit("```toml\n").next().unwrap().trim_end().trim_end_matches("```");
    let back: toml::Table = toml.parse().unwrap();
    assert_eq!(back["time"]["integrator"].as_str(), Some("velocity-verlet"));
    assert_eq!(back["time"]["step"].as_float(), Some(0.001));
}

// A5: a linear scene, which modes solve exactly.
#[test]
fn a_linear_system_is_compared_with_its_modes() {
    let text = "dimension = 2
        time = { integrator = 'rk4', step = 1e-3, duration = 1.0 }
        [[body]]
        mesh = { strand = { segments = 3, start = [0.0, 0.0], end = [12.0, 0.0] } }
        springs = { stiffness = 100.0 }
        mass = { per_vertex = 0.1 }
        pin = [{ vertices = [0, 3] }]
        position = { per_vertex = [[0.0, 0.0], [5.0, 0.0], [8.0, 0.0], [12.0, 0.0]] }";
    let results = made(text, &plan(text, &[IntegratorSpec::Rk4], &[1e-3]));
    let reference = &results.variants[0].reference;
    assert!(
        reference.id.starts_with("modes-") && reference.error < 1e-11,
        "{} {}",
        reference.how,
        reference.error
    );
    // Two masses between walls: (cos w1 t +- cos w2 t)/2 with w1^2 = k/m, w2^2 = 3 k/m.
    let (w1, w2) = (1000f64.sqrt(), 3000f64.sqrt());
    let x = reference.trajectory.x.last().unwrap();
    assert!((x[2] - 4.0 - 0.5 * (w1.cos() + w2.cos())).abs() < 1e-12);
    assert!((x[4] - 8.0 - 0.5 * (w1.cos() - w2.cos())).abs() < 1e-12);
    // A nonlinear scene is not solved by modes.
    let bent = text.replace("[5.0, 0.0]", "[5.0, 0.5]");
    let reference = made(&bent, &plan(&bent, &[IntegratorSpec::Rk4], &[1e-3])).variants[0].reference.clone();
    assert!(reference.how.starts_with("computed"), "{}", reference.how);
    let exact =
        StudyPlan { reference: ReferenceChoice::Exact, ..plan(&bent, &[IntegratorSpec::Rk4], &[1e-3]) };
    assert!(matches!(make(&bent, &exact, None, usize::MAX).results, Err(StudyError::NotExact)));
}

// E: the reference's error is known, and rows near it are dropped.
#[test]
fn a_computed_reference_knows_its_error() {
    let text = "dimension = 2
        time = { integrator = 'rk4', step = 1e-2, duration = 2.5 }
        world = { nbody = { constant = 1.0 } }
        [[body]]
        mesh = { inline = { points = [[0.0, 0.0], [0.4, 0.0]] } }
        mass = { per_vertex = 1.0 }
        velocity = { per_vertex = [[0.0, 0.0], [0.0, 2.0]] }
        pin = [{ vertices = [0] }]";
    let exact = plan(text, &[IntegratorSpec::Rk4], &[0.01]);
    let computed = StudyPlan { reference: ReferenceChoice::Computed, budget: Some(20.0), ..exact.clone() };
    let of = |plan: &StudyPlan| made(text, plan).variants[0].reference.clone();
    let (exact, computed) = (of(&exact), of(&computed));
    assert_eq!(exact.how, "exact: Kepler's equation");
    let weights = ErrorScales::new(2, &[1.0, 1.0], |i| i == 0, &[0.0, 0.0, 0.4, 0.0]);
    let errors = weights.errors(&computed.trajectory, &exact.trajectory);
    assert!(
        errors.q_rms <= computed.error && errors.v_rms <= computed.error,
        "{errors:?} {}",
        computed.error
    );
    assert!(computed.error < 1e-10, "{}", computed.error);
}

#[test]
fn what_is_varied_has_rows_and_a_reference_of_its_own() {
    let axis = "body.0.springs.stiffness=20, 40".parse().unwrap();
    let plan = StudyPlan { axes: vec![axis], ..plan(PENDULUM, &[IntegratorSpec::Rk4], &[0.01]) };
    let results = made(PENDULUM, &plan);
    assert_eq!(results.variants.len(), 2);
    assert_eq!(results.variants[1].variant, "body.0.springs.stiffness=40");
    assert_ne!(results.variants[0].reference.id, results.variants[1].reference.id);
    // Each is a different problem with its own advice: the softer one does not replace the stiffer one.
    let advice = results.recommendations();
    assert_eq!(advice.len(), 2);
    for (advice, stiffness) in advice.iter().zip(["20", "40"]) {
        let change = format!("body.0.springs.stiffness={stiffness}");
        assert_eq!(advice.problem, change);
        assert!(advice.settings.contains(&format!("# with --set {change}\n")), "{}", advice.settings);
    }
    let report = report::StudyReport::new("two", &[results], &[report::FigureKind::Time]).unwrap();
    let problems: Vec<&str> = report.recommendations.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(problems, ["scene, body.0.springs.stiffness=20", "scene, body.0.springs.stiffness=40"]);
    // Another linear solver does not change the problem.
    let axis = "time.solver.linear=cholesky,cg".parse().unwrap();
    let plan = StudyPlan { axes: vec![axis], ..self::plan(PENDULUM, &[IntegratorSpec::Gauss2], &[0.01]) };
    let text = PENDULUM.replace("velocity-verlet", "implicit-euler");
    let results = made(&text, &plan);
    assert_eq!(results.variants[0].reference, results.variants[1].reference);
    assert_eq!(results.recommendations().len(), 1, "the cheaper solver");
    // Errors relative to different references are not comparable.
    let mut apart = results;
    apart.variants[1].reference.id = "another".into();
    let problems: Vec<String> = apart.recommendations().into_iter().map(|advice| advice.problem).collect();
    assert_eq!(problems, ["time.solver.linear=cholesky", "time.solver.linear=cg"]);
}

#[test]
fn advice_is_no_finer_than_the_reference_is_confirmed() {
    let results = made(PENDULUM, &plan(PENDULUM, &[IntegratorSpec::Rk4], &[0.01]));
    let [variant] = &results.variants[..] else { panic!("one variant") };
    let (row, sure) = (variant.rows().next().unwrap(), &variant.reference);
    assert!(row.error().unwrap() < 1e-7 && sure.trusted() < 1e-9, "{row:?} {}", sure.how);
    assert_eq!(words([row], sure).len(), 5);
    let weak = Reference { disagreement: Some(5e-4), ..sure.clone() };
    let said = words([row], &weak);
    assert!(said.len() == 3 && said[1].starts_with("for 1 % error take rk4"), "{said:?}");
    assert_eq!(said[2], "no advice for 0.1 % error: the reference is known to 5e-4 only");
    assert!(toml([row], &weak, 1e-2).contains("rk4") && !toml([row], &weak, 1e-3).contains("rk4"));
    let alone = Reference { disagreement: None, ..sure.clone() };
    let [said] = &words([row], &alone)[..] else { panic!("one line") };
    assert!(
        said.starts_with("no advice for 10 % error: no second integrator confirms the reference"),
        "{said}"
    );
    assert!(toml([row], &alone, 1e-2).starts_with("# no advice"));
}

#[test]
fn a_quasi_static_scene_is_refused() {
    let text = SQUARE.replace("'velocity-verlet'", "'quasi-static'");
    let made = make(&text, &plan(&text, &[IntegratorSpec::Rk4], &[0.01]), None, usize::MAX);
    let error = made.results.unwrap_err();
    assert!(matches!(error, StudyError::Static), "{error}");
    assert!(error.to_string().contains("time.step") && error.to_string().contains("time.integrator"));
}

#[test]
fn a_noisy_machine_is_said() {
    let mut results = made(PENDULUM, &plan(PENDULUM, &[IntegratorSpec::VelocityVerlet], &[0.02, 0.01]));
    let mut timed = |spread: [f64; 2], repeats| {
        for (record, spread) in results.variants[0].records.iter_mut().zip(spread) {
            let row = &mut record.row;
            (row.wall_median_s, row.wall_iqr_s, row.repeats) = (1e-3, 1e-3 * spread, repeats);
        }
        results.noise()
    };
    assert_eq!(timed([0.04, 0.01], 7), None);
    assert_eq!(timed([0.5, 0.5], 1), None, "of a single run there is no spread");
    let noise = timed([0.01, 0.25], 7).unwrap();
    assert!(
        noise.contains("of 2 rows") && noise.contains("1 have an interquartile range above 5 %"),
        "{noise}"
    );
    assert!(noise.contains("the worst 25 % (velocity-verlet, step 10 ms)"), "{noise}");
    let report = report::StudyReport::new("noisy", &[results], &[report::FigureKind::Time]).unwrap();
    assert!(report.html().contains("noisy timings") && report.markdown("").contains("noisy timings"));
}

#[test]
fn the_table_has_the_columns_of_the_plan_and_its_cells_are_quoted() {
    let mut row = row(PENDULUM, IntegratorSpec::VelocityVerlet, 0.01);
    row.variant = "a={ b, \"c\" }".into();
    let table = csv([&row]);
    let mut lines = table.lines();
    let planned = "schema,case,commit,host,cpu,threads,rustc,flags,precision,element,material,nu,ndof,mass,\
        integrator,order_nominal,stages,dt,steps,t_end,newton_tol,lin_solver,err_q_rms,err_q_max,err_v_rms,\
        err_energy_max,err_momentum,err_angmom,ref_id,ref_err,status,fail_time,n_force,n_hess,n_factor,n_newton,\
        n_linesearch,n_cg,wall_min_s,wall_median_s,wall_iqr_s,repeats,setup_s,peak_rss_mb,obs_order";
    assert!(lines.next().unwrap().starts_with(planned));
    assert!(lines.next().unwrap().contains("\"a={ b, \"\"c\"\" }\""));
    assert_eq!(COLUMNS.len(), planned.split(',').count() + 1);
}

#[test]
fn the_front_is_what_nothing_beats() {
    let base = row(PENDULUM, IntegratorSpec::VelocityVerlet, 0.01);
    let of = |name: &str, error: f64, time: f64| Row {
        integrator: name.into(),
        err_q_rms: Some(error),
        wall_min_s: time,
        ..base.clone()
    };
    let rows = [of("a", 1e-1, 1.0), of("b", 1e-2, 3.0), of("c", 2e-2, 4.0), of("d", 1e-3, 5.0)];
    let names: Vec<&str> = front(&rows).iter().map(|row| row.integrator.as_str()).collect();
    assert_eq!(names, ["a", "b", "d"]);
    let exact = Reference {
        id: String::new(),
        how: String::new(),
        error: 1e-12,
        disagreement: Some(0.0),
        trajectory: StateSamples::default(),
    };
    assert_eq!(words(&rows, &exact)[1], "for 1 % error take b at 10 ms: 3 s");
    assert!(toml(&rows, &exact, 1e-2).contains("integrator = \"b\""));
    assert!(toml(&rows, &exact, 1e-5).contains("no setting reaches"));
}

#[test]
fn steps_that_follow_the_error_land_on_the_times_of_comparison() {
    let schemes = [IntegratorSpec::DormandPrince5];
    let plan = StudyPlan { tolerances: vec![1e-4, 1e-8], ..plan(PENDULUM, &schemes, &[]) };
    let results = made(PENDULUM, &plan);
    let rows: Vec<&Row> = results.rows().collect();
    assert_eq!(rows.iter().map(|row| row.tol).collect::<Vec<_>>(), [Some(1e-4), Some(1e-8)]);
    assert!(rows.iter().all(|row| row.integrator == "dormand-prince5 (adaptive)" && row.n_reject.is_some()));
    let errors: Vec<f64> = rows.iter().map(|row| row.err_q_rms.unwrap()).collect();
    // Twenty intermediate frames are steps: even the coarse tolerance is met well.
    assert!(errors[1] < 1e-2 * errors[0] && errors[1] < 1e-7, "{errors:?}");
    assert!(
        toml(results.rows(), &results.variants[0].reference, 1e-7)
            .contains("adaptive = { tolerance = 1e-8 }")
    );
}
