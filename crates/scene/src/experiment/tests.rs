//! Experiments: commands, refusals, replays.

use super::*;

/// A cantilever of 4 x 1 cells under its weight, implicit and with the damping of its scheme.
const BEAM: &str = "
dimension = 2
[time]
integrator = 'implicit-euler'
step = 0.05
duration = 1.0
[world]
gravity = [0.0, -9.81]
[[body]]
name = 'beam'
mesh = { grid = { cells = [4, 1], spacing = 0.25 } }
elastic = { corotated = { young = 2e6, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ name = 'clamp', vertices = [0, 5] }]
";

fn started(text: &str) -> Experiment {
    Experiment::new(Source::new("beam", text)).unwrap_or_else(|error| panic!("{error}"))
}

fn steps(experiment: &mut Experiment, count: usize) {
    (0..count).for_each(|_| assert!(experiment.step(), "{:?}", experiment.failure()));
}

fn set(path: &str, value: f64) -> ExperimentCommand {
    ExperimentCommand::Set { path: path.into(), value }
}

/// Height of a vertex above its place at the start [m].
fn lift(experiment: &Experiment, vertex: usize) -> f64 {
    let start = &experiment.topology().rest_positions;
    experiment.simulation().positions()[2 * vertex + 1] - start[2 * vertex + 1]
}

#[test]
fn controls_are_the_parameters_of_the_scene() {
    let experiment = started(BEAM);
    let controls = experiment.controls();
    let paths: Vec<&str> = controls.iter().map(|control| control.path.as_str()).collect();
    for path in [
        "body.0.elastic.corotated.young",
        "body.0.elastic.corotated.poisson",
        "body.0.damping.stiffness_proportional",
        "body.0.damping.mass_proportional",
        "world.gravity.0",
        "world.gravity.1",
        "world.ether_drag",
        "pin.beam/clamp",
    ] {
        assert!(paths.contains(&path), "{path} in {paths:?}");
    }
    let young = serde_json::to_value(&controls[0]).unwrap();
    assert_eq!(
        (&young["kind"], &young["unit"], &young["scale"]),
        (&"number".into(), &"Pa".into(), &"log".into())
    );
    assert_eq!((&young["value"], &young["group"]), (&2e6.into(), &"beam".into()));
    let (names, present) = experiment.integrators();
    assert!(present == "implicit-euler" && names.contains(&"velocity-verlet"), "{names:?}");
}

#[test]
fn a_stiffer_beam_rises() {
    let mut experiment = started(BEAM);
    steps(&mut experiment, 200);
    let before = lift(&experiment, 9);
    experiment.execute(&set("body.0.elastic.corotated.young", 4e6)).unwrap();
    assert_eq!(lift(&experiment, 9), before);
    steps(&mut experiment, 200);
    // Small deflections are as the inverse of Young's modulus; 1 % of the length bends the line by 1 %.
    let ratio = lift(&experiment, 9) / before;
    assert!(before < -0.001 && (0.49..0.51).contains(&ratio), "{before} {ratio}");
    let controls = experiment.controls();
    assert!(matches!(controls[0].value, ControlValue::Number { value: 4e6, maximum: 2e8, .. }));
}

#[test]
fn a_grabbed_vertex_follows_and_is_let_go() {
    for integrator in ["implicit-euler", "symplectic-euler"] {
        let text = BEAM.replace("implicit-euler", integrator);
        let explicit = integrator == "symplectic-euler";
        let (text, count) = if explicit { (text.replace("0.05", "2e-4"), 4000) } else { (text, 100) };
        let mut experiment = started(&text);
        let target = vec![1.0, 0.6];
        experiment.execute(&ExperimentCommand::Grab { vertex: 9, target: target.clone() }).unwrap();
        steps(&mut experiment, count);
        let pulled = lift(&experiment, 9);
        assert!(pulled > 0.05, "{integrator}: {pulled}");
        let down = vec![1.0, -0.1];
        experiment.execute(&ExperimentCommand::Drag { target: down.clone() }).unwrap();
        assert_eq!(experiment.grabbed().unwrap().target, down);
        steps(&mut experiment, count);
        assert!(lift(&experiment, 9) < -0.05, "{integrator}: {}", lift(&experiment, 9));
        experiment.execute(&ExperimentCommand::Release).unwrap();
        let terms = experiment.simulation().system().terms().len();
        assert_eq!((terms, experiment.simulation().system().dissipation().len()), (2, 0));
        let refused = experiment.execute(&ExperimentCommand::Drag { target }).unwrap_err().to_string();
        assert_eq!(refused, "no vertex is grabbed");
    }
}

#[test]
fn pins_let_go_and_hold_again_where_vertices_are() {
    let mut experiment = started(BEAM);
    let pin = |on| ExperimentCommand::Pin { name: "beam/clamp".into(), on };
    experiment.execute(&pin(false)).unwrap();
    steps(&mut experiment, 4);
    let fallen = lift(&experiment, 0);
    assert!(fallen < -0.1, "{fallen}");
    experiment.execute(&pin(true)).unwrap();
    steps(&mut experiment, 4);
    assert_eq!(lift(&experiment, 0), fallen);
}

#[test]
fn what_the_scene_refuses_is_refused_with_its_message_and_changes_nothing() {
    let mut experiment = started(BEAM);
    steps(&mut experiment, 3);
    let before = experiment.simulation().positions().into_owned();
    let cases = [
        (set("body.0.elastic.corotated.poisson", 0.5), "`poisson` = 0.5"),
        (set("body.0.elastic.corotated.young", -1.0), "young"),
        (set("body.0.elastic.corotated.young", f64::NAN), "is not finite"),
        (set("time.step", 1.0), "there is no parameter `time.step`"),
        (ExperimentCommand::Pin { name: "beam/foot".into(), on: false }, "there is no pin `beam/foot`"),
        (
            ExperimentCommand::Grab { vertex: 10, target: vec![0.0; 2] },
            "there is no vertex 10; the scene has 10",
        ),
        (ExperimentCommand::Grab { vertex: 9, target: vec![0.0; 3] }, "2 finite coordinates"),
        (ExperimentCommand::Grab { vertex: 0, target: vec![0.0; 2] }, "vertex 0 is pinned"),
        (ExperimentCommand::Integrator { name: "rk5".into() }, "there is no integrator `rk5`"),
        (ExperimentCommand::Integrator { name: "velocity-verlet".into() }, "is unstable for velocity-verlet"),
    ];
    for (command, message) in cases {
        let error = experiment.execute(&command).unwrap_err().to_string();
        assert!(error.contains(message), "{command:?}: {error}");
    }
    assert_eq!(experiment.simulation().positions(), &before[..]);
    assert!(experiment.log().commands.is_empty());
    assert_eq!(experiment.source().text(), BEAM);
    let error = started(BEAM).execute(&ExperimentCommand::GoBack).unwrap_err().to_string();
    assert!(error.contains("there is no earlier state"), "{error}");
}

#[test]
fn a_step_that_fails_names_its_element_and_an_earlier_state_is_gone_back_to() {
    let text = BEAM.replace("implicit-euler", "symplectic-euler").replace("0.05", "2e-4");
    let mut experiment = started(&text.replace("corotated", "neo-hookean"));
    steps(&mut experiment, 100);
    experiment.execute(&ExperimentCommand::Grab { vertex: 9, target: vec![-60.0, 30.0] }).unwrap();
    let failed = (0..3000).any(|_| !experiment.step());
    let failure = experiment.failure().cloned().unwrap();
    assert!(failed && failure.message.contains("s) failed"), "{failure:?}");
    assert!(failure.body.as_deref() == Some("beam") && failure.element.is_some(), "{failure:?}");
    let last = experiment.simulation().state().step;
    experiment.execute(&ExperimentCommand::Release).unwrap();
    experiment.execute(&ExperimentCommand::GoBack).unwrap();
    let (step, x) = (experiment.simulation().state().step, experiment.simulation().positions());
    assert!(step < last && step % 32 == 0 && x.iter().all(|x| x.is_finite()), "{step} {last}");
    assert!(experiment.failure().is_none());
}

/// Numbers below `bound`, without pattern.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound
    }

    /// Between 0 and 1.
    fn part(&mut self) -> f64 {
        self.below(1 << 30) as f64 / (1u64 << 30) as f64
    }

    fn command(&mut self) -> ExperimentCommand {
        let integrators = ["implicit-euler", "bdf2", "trapezoid"];
        match self.below(10) {
            0 => set("body.0.elastic.corotated.young", 1e6 * (1.0 + self.part())),
            1 => set("world.gravity.1", -10.0 * self.part()),
            2 => set("body.0.damping.mass_proportional", self.part()),
            3 => ExperimentCommand::Pin { name: "beam/clamp".into(), on: self.below(2) == 0 },
            4 => ExperimentCommand::Grab {
                vertex: self.below(10) as u32,
                target: vec![self.part(), self.part()],
            },
            5 | 6 => ExperimentCommand::Drag { target: vec![self.part(), self.part()] },
            7 => ExperimentCommand::Integrator { name: integrators[self.below(3) as usize].into() },
            8 => ExperimentCommand::Release,
            _ => [ExperimentCommand::Reset, ExperimentCommand::GoBack][self.below(2) as usize].clone(),
        }
    }
}

#[test]
fn a_log_of_a_hundred_commands_is_replayed_to_the_bit() {
    let (mut experiment, mut numbers) = (started(BEAM), Numbers(7));
    let mut executed = 0;
    for _ in 0..100 {
        (0..numbers.below(6)).for_each(|_| _ = experiment.step());
        executed += usize::from(experiment.execute(&numbers.command()).is_ok());
    }
    steps(&mut experiment, 5);
    assert!(executed > 60 && experiment.log().commands.len() == executed, "{executed}");
    let text = experiment.log().to_json_lines().unwrap();
    let log = CommandLog::from_json_lines(&text).unwrap();
    assert_eq!(&log, experiment.log());
    let again = Experiment::replay(Source::new("beam", log.scene.as_str()), &log, |_| {}).unwrap();
    let bits = |experiment: &Experiment| -> Vec<u64> {
        let simulation = experiment.simulation();
        simulation.positions().iter().chain(&*simulation.velocities()).map(|x| x.to_bits()).collect()
    };
    assert_eq!(bits(&again), bits(&experiment));
    assert_eq!(again.source().text(), experiment.source().text());
}

#[test]
fn a_text_that_is_no_log_is_refused_with_its_line() {
    let error = |text: &str| CommandLog::from_json_lines(text).unwrap_err().to_string();
    assert!(error("").starts_with("line 1"));
    assert!(error("{\"scene\":\"\"}\n{\"after\":1,\"do\":\"fly\"}\n{\"steps\":1}").starts_with("line 2"));
    assert!(error("{\"scene\":\"\"}\n{\"steps\":-1}").starts_with("line 2"));
}

/// A beam that falls to a floor.
const ABOVE_FLOOR: &str = "
dimension = 2
[time]
integrator = 'symplectic-euler'
step = 1e-3
duration = 1.0
[world]
gravity = [0.0, -9.81]
walls = [{ normal = [0.0, 1.0], offset = -0.5 }]
[[body]]
name = 'beam'
mesh = { grid = { cells = [4, 1], spacing = 0.25 } }
elastic = { corotated = { young = 2e4, poisson = 0.3 } }
mass = { density = 1000.0 }
";

fn switch(experiment: &mut Experiment, name: &str) {
    experiment.execute(&ExperimentCommand::Integrator { name: name.into() }).unwrap();
}

#[test]
fn walls_become_bodies_and_cease_to_be_where_the_scheme_is_switched() {
    let mut experiment = started(ABOVE_FLOOR);
    let count = experiment.topology().vertex_count;
    steps(&mut experiment, 100);
    experiment.execute(&ExperimentCommand::Grab { vertex: 4, target: vec![1.0, 0.2] }).unwrap();
    for (name, vertices) in [("implicit-euler", count + 1), ("symplectic-euler", count), ("bdf2", count + 1)]
    {
        let before = experiment.simulation().snapshot();
        switch(&mut experiment, name);
        let now = experiment.simulation().snapshot();
        assert_eq!(experiment.topology().vertex_count, vertices, "{name}");
        assert_eq!((now.step, now.time), (before.step, before.time), "{name}");
        let shared = 2 * count;
        assert_eq!((&now.x[..shared], &now.v[..shared]), (&before.x[..shared], &before.v[..shared]));
        assert!(experiment.grabbed().is_some() && !experiment.can_go_back(), "{name}");
        steps(&mut experiment, 40);
    }
    let log = experiment.log().clone();
    let again = Experiment::replay(Source::new("beam", ABOVE_FLOOR), &log, |_| {}).unwrap();
    assert_eq!(again.simulation().snapshot().x, experiment.simulation().snapshot().x);
}

#[test]
fn pins_of_obstacles_are_not_let_go() {
    let experiment = started(&ABOVE_FLOOR.replace("symplectic", "implicit"));
    assert!(experiment.simulation().pin_names().len() > experiment.pins.len(), "{:?}", experiment.pins);
}

#[test]
fn energy_that_grows_beyond_any_cause_ends_the_run_before_its_state_is_kept() {
    let mut experiment = started(ABOVE_FLOOR);
    steps(&mut experiment, 40);
    let snapshot = experiment.simulation().snapshot();
    let fast: Vec<f64> = snapshot.v.iter().map(|v| 1e4 * (v + 1.0)).collect();
    experiment.simulation.set_velocities(&fast);
    let failed = (0..64).find(|_| !experiment.step());
    assert!(failed.is_some() && experiment.failure().is_some());
    experiment.execute(&ExperimentCommand::GoBack).unwrap();
    let energy = experiment.simulation_mut().diagnostics().total;
    assert!(experiment.simulation().state().step <= 64 && energy.abs() < 1e5, "{energy}");
}
