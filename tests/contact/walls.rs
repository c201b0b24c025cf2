//! Walls of scenes without `[contact]`, in steps that are solved.

use pliant::integrator::IntegratorSpec;
use pliant_scene::assembly::UnstableStep;

/// Column of 0.1 m x 0.2 m with its foot at the height `foot` [m] over a wall, without Poisson's ratio.
fn column(time: &str, foot: f64) -> String {
    format!(
        "dimension = 2\ntime = {{ {time}, step = 0.01, duration = 10.0 }}\n\
         world = {{ gravity = [0, -10], walls = [{{ normal = [0, 2], offset = 0 }}] }}\n\
         [[body]]\nname = 'column'\nmesh = {{ grid = {{ cells = [2, 8], size = [0.1, 0.2], origin = [0, \
         {foot}] }} }}\n\
         elastic = {{ stvk = {{ young = 1e6, poisson = 0 }} }}\nmass = {{ density = 1000 }}\n\
         pin = [{{ name = 'side', vertices = [0], axes = ['x'] }}]\n"
    )
}

/// Mean heights of the foot and of the top [m], whose middle vertices stand for half of them.
fn heights(simulation: &pliant::simulation::Simulation) -> [f64; 2] {
    let x = simulation.positions();
    [0, 8].map(|end| {
        [0.25, 0.5, 0.25].iter().zip(0..).map(|(w, column)| w * x[2 * (9 * column + end) + 1]).sum()
    })
}

/// A column on a wall is as much shorter as its weight makes it, `rho g H^2 / (2 E)`, by every scheme that
/// holds walls, and sinks into the wall by less than the distance of contact; the wall bears its weight.
#[test]
fn what_rests_on_a_wall_is_pressed_by_its_weight() {
    let shorter = 1000.0 * 10.0 * 0.2 * 0.2 / (2.0 * 1e6);
    for (scheme, steps) in [("implicit-euler", 400), ("bdf2", 1000), ("sdirk2", 1000), ("quasi-static", 1)] {
        let mut simulation = super::assembled(&column(&format!("integrator = '{scheme}'"), 0.0)).simulation;
        super::advance(&mut simulation, steps);
        let [low, high] = heights(&simulation);
        assert!((0.2 - (high - low) - shorter).abs() < 0.01 * shorter, "{scheme}: {}", 0.2 - (high - low));
        assert!(low < 0.0 && low > -2e-4, "{scheme}: {low}");
        let reactions = simulation.reactions();
        let names: Vec<&str> = reactions.iter().map(|reaction| &reaction.name[..]).collect();
        assert_eq!(names, ["column/side", "wall0"]);
        assert!((reactions[1].force[1] - 200.0).abs() < 0.01, "{scheme}: {:?}", reactions[1]);
    }
}

/// Until it is met, a wall that is solved for does nothing.
#[test]
fn a_wall_that_is_not_met_changes_nothing() {
    let fallen = |text: &str| {
        let mut simulation = super::assembled(text).simulation;
        super::advance(&mut simulation, 10);
        simulation.positions()[..2 * 27].to_vec()
    };
    let over = column("integrator = 'implicit-euler'", 1.0);
    let without = over.replace(", walls = [{ normal = [0, 2], offset = 0 }]", "");
    assert!(without.len() < over.len());
    // The matrix has a vertex more, and another order.
    assert!(fallen(&over).iter().zip(&fallen(&without)).all(|(x, y)| (x - y).abs() < 1e-14));
}

/// Walls alone are met: bodies go through each other, and through themselves.
#[test]
fn bodies_on_a_wall_pass_through_each_other() {
    let other = column("", 0.05).split_once("[[body]]").unwrap().1.replace("'column'", "'other'");
    let text = column("integrator = 'implicit-euler'", 0.0) + "[[body]]" + &other;
    let assembly = super::assembled(&text);
    assert!(assembly.report.warnings.iter().any(|told| told.contains("`column` and `other` meet")));
    let mut simulation = assembly.simulation;
    super::advance(&mut simulation, 200);
    let x = simulation.positions();
    let height = |v: usize| x[2 * v + 1];
    assert!((0..27).all(|v| (height(v) - height(v + 27)).abs() < 1e-9), "both rest at one place");
}

/// Starts behind a wall, with what would be right.
#[test]
fn a_start_behind_a_wall_is_told() {
    let told = super::problems(&column("integrator = 'implicit-euler'", -0.01));
    assert!(told.contains("`column` and `wall0` overlap by 0.01 m at (0.000000, -0.010000) m"), "{told}");
    assert!(told.contains("or the wall by its `offset`") && !told.contains("[contact]"), "{told}");
}

/// Schemes that cannot hold walls put vertices back, and say so; so do those of scenes that keep one way for
/// all schemes.
#[test]
fn other_schemes_put_vertices_back() {
    let warned = |text: &str| {
        let assembly = super::assembled(text);
        assert_eq!(assembly.simulation.system().walls().len(), 1);
        assembly.report.warnings.iter().any(|told| told.contains("`sdirk2` hold walls in the solve"))
    };
    assert!(warned(&column("integrator = 'gauss2'", 0.0)));
    assert!(!warned(&column("integrator = 'velocity-verlet'", 0.0).replace("step = 0.01", "step = 1e-4")));
    let mut kept = pliant_scene::Scene::from_toml(&column("integrator = 'rk4'", 0.0)).unwrap();
    kept.keep_contact(1e-3);
    kept.time.integrator = IntegratorSpec::ImplicitEuler;
    let assembly = kept.assemble(UnstableStep::Accept).unwrap();
    assert_eq!(assembly.simulation.system().walls().len(), 1);
    let mut kept = pliant_scene::Scene::from_toml(&column("integrator = 'bdf2'", 0.0)).unwrap();
    kept.keep_contact(1e-3);
    kept.time.integrator = IntegratorSpec::Rk4;
    let assembly = kept.assemble(UnstableStep::Accept).unwrap();
    assert!(assembly.simulation.system().walls().is_empty());
}

/// A start behind a wall that a study keeps as contact is not told as one that is too near.
#[test]
fn a_start_behind_a_kept_wall_is_pushed_out() {
    let mut scene = super::scene(&column("integrator = 'implicit-euler'", -1e-4));
    scene.keep_contact(0.01);
    let assembly = scene.assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"));
    let said = assembly.report.warnings.join("\n");
    assert!(said.contains("`column` starts 1e-4 m behind `wall0`: the wall pushes it out with"), "{said}");
}
