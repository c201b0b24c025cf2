//! Scenes that mean something else than they say are told so, and scenes beside them are not.

use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

fn warnings(text: &str) -> String {
    let scene = Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}"));
    let assembled = scene.assemble(UnstableStep::Accept).map_err(|problems| format!("{problems:?}"));
    assembled.unwrap().report.warnings.join("\n")
}

/// A bar of 1 m by 10 cm with these lines of time, and more of it.
fn bar(time: &str, more: &str) -> String {
    warnings(&format!(
        "dimension = 2\ntime = {{ {time}, duration = 1.0 }}\n[[body]]\nname = 'bar'\n\
         mesh = {{ grid = {{ cells = [4, 1], size = [1.0, 0.1] }} }}\nmass = {{ density = 1000 }}\n{more}"
    ))
}

/// Asserts that `told` is in the warnings of the first and in none of those of the others.
fn tells(told: &str, [of, beside]: [&[String]; 2]) {
    of.iter().for_each(|warnings| assert!(warnings.contains(told), "{told:?} is not in {warnings}"));
    beside.iter().for_each(|warnings| assert!(!warnings.contains(told), "{told:?} is in {warnings}"));
}

const SOFT: &str = "elastic = { stvk = { young = 1e5, poisson = 0.3 } }";
const STIFF: &str = "elastic = { stvk = { young = 1e11, poisson = 0.3 } }";

fn loaded(elastic: &str, force: &str) -> String {
    format!(
        "{elastic}\npin = [{{ vertices = [0, 1] }}]\nload = [{{ vertices = [9], force = ['0', '{force}'] }}]"
    )
}

#[test]
fn a_load_that_changes_between_the_steps_is_told() {
    let of = |step: &str, force: &str| {
        bar(&format!("integrator = 'implicit-euler', step = '{step}'"), &loaded(SOFT, force))
    };
    let swing = "10*sin(2*pi*1000*t)";
    tells(
        "`body.0.load.0.force` changes too fast for steps of 1 ms",
        [
            &[of("1 ms", swing), of("1 ms", "cos(2000*pi*t)"), of("1 ms", "pulse(0.0102, 0.0107, t)")],
            &[
                of("0.1 ms", swing),
                of("1 ms", "10*sin(2*pi*100*t)"),
                of("1 ms", "step(0.5, t)"),
                of("1 ms", "smoothstep(0, 0.5, t)"),
                of("1 ms", "3 + 1e-18*t"),
            ],
        ],
    );
    let told = of("1 ms", swing);
    let advised: f64 = told
        .split(": use steps of ")
        .nth(1)
        .and_then(|rest| rest.split(" s").next())
        .unwrap()
        .parse()
        .unwrap();
    assert!((1e-5..3e-4).contains(&advised), "{told}");
}

#[test]
fn calls_whose_bounds_leave_nothing_between_them_are_told() {
    let of = |force: &str| bar("integrator = 'implicit-euler', step = 0.01", &loaded(SOFT, force));
    let told = |place: &str| format!("`body.0.load.0.force`: `{place}");
    for (call, beside) in [
        ("pulse(0, 0, t)", "pulse(0, 0.5, t)"),
        ("smoothstep(0.255, 0.255, t)", "smoothstep(1, 0, t)"),
        ("clamp(t, 1, -1)", "clamp(t, -1, 1)"),
        ("pulse(a, a - 1, t) where a = 1", "pulse(a, a + 1, t) where a = 1"),
    ] {
        let name = call.split('(').next().unwrap();
        tells(&told(name), [&[of(call)], &[of(beside)]]);
    }
}

#[test]
fn statics_of_what_swings_as_fast_as_its_load_are_told() {
    let of =
        |elastic: &str, force: &str| bar("integrator = 'quasi-static', step = 0.01", &loaded(elastic, force));
    tells(
        "quasi-static runs neglect inertia",
        [&[of(SOFT, "1e-3*sin(60*t)")], &[of(STIFF, "1e-3*sin(60*t)"), of(SOFT, "1e-3*t")]],
    );
}

#[test]
fn a_step_that_rounding_swallows_is_told() {
    let of = |step: &str, origin: &str| {
        bar(
            &format!("integrator = 'symplectic-euler', step = {step}"),
            &format!(
                "{SOFT}\nvelocity = {{ rigid = {{ linear = [1e-3, 0] }} }}\n\
                 transform = {{ translate = [{origin}, 0] }}"
            ),
        )
    };
    tells("moves nothing", [&[of("1e-9", "1e6")], &[of("1e-9", "0"), of("1e-3", "1e6")]]);
}

#[test]
fn a_tolerance_below_rounding_is_told() {
    let of = |tolerance: &str| {
        bar(
            &format!("integrator = 'implicit-euler', step = 0.01, solver = {{ tolerance = {tolerance} }}"),
            SOFT,
        )
    };
    tells("is below the round-off of positions", [&[of("1e-30")], &[of("1e-12")]]);
}

#[test]
fn a_body_in_pieces_is_told() {
    let of = |points: &str| {
        warnings(&format!(
            "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}\n\
             [[body]]\nname = 'plate'\nmesh = {{ inline = {{ points = [[0, 0], [1, 0], [0, 1], {points}], \
             triangles = [[0, 1, 2], [3, 4, 5]] }} }}\n{SOFT}\nmass = {{ density = 1000 }}\n"
        ))
    };
    let (apart, at_one_place) = (of("[2, 0], [3, 0], [2, 1]"), of("[1, 0], [1, 1], [0, 1]"));
    assert!(apart.contains("`plate` is of 2 pieces that nothing connects"), "{apart}");
    assert!(at_one_place.contains("2 vertices lie at the position of another"), "{at_one_place}");
    let whole = bar("integrator = 'implicit-euler', step = 0.01", SOFT);
    assert!(!whole.contains("pieces") && !whole.contains("at the position of another"), "{whole}");
}

#[test]
fn a_contact_distance_as_large_as_bodies_is_told() {
    let of = |distance: &str| {
        let floor = "[[obstacle]]\nshape = { half_space = { normal = [0, 1], offset = -1.0 } }\n";
        let contact = format!("[contact]\n{distance}");
        bar("integrator = 'implicit-euler', step = 0.01", &format!("{SOFT}\n{floor}{contact}"))
    };
    tells("it will hover", [&[of("distance = 0.5")], &[of("distance = 0.01"), of("")]]);
}

#[test]
fn a_pin_that_is_driven_through_a_wall_is_told() {
    let of = |integrator: &str, velocity: &str, offset: &str| {
        let wall = format!("world = {{ walls = [{{ normal = [0, 1], offset = {offset} }}] }}\n");
        warnings(&format!(
            "dimension = 2\ntime = {{ integrator = '{integrator}', step = 1e-3, duration = 1.0 }}\n{wall}\
             [[body]]\nname = 'bar'\nmesh = {{ grid = {{ cells = [4, 1], size = [1.0, 0.1] }} }}\n\
             mass = {{ density = 1000 }}\n{SOFT}\npin = [{{ name = 'end', vertices = [0, 1], motion = {{ \
             velocity = {velocity} }} }}]\n"
        ))
    };
    let explicit = |velocity: &str, offset: &str| of("symplectic-euler", velocity, offset);
    // Contact holds the walls of implicit Euler, which put vertices back elsewhere.
    tells(
        "the motion of pin `bar/end` goes 0.5 m behind `wall0`, at t = 1 s",
        [
            &[explicit("[0, -1]", "-0.5"), of("implicit-euler", "[0, -1]", "-0.5")],
            &[explicit("[0, -1]", "-1.5"), explicit("[0, 1]", "-0.5"), explicit("[0, -1]", "0.5")],
        ],
    );
}

/// The forces from both sides cancel.
#[test]
fn a_body_that_is_squeezed_at_the_start_is_told() {
    let of = |gap: f64| {
        let offset = -0.5 - gap;
        warnings(&format!(
            "dimension = 2\ncontact = {{ distance = 1e-2 }}\n\
             time = {{ integrator = 'implicit-euler', step = 1e-2, duration = 0.5 }}\n\
             [[body]]\nname = 'cube'\nmesh = {{ grid = {{ cells = [1, 1], size = [1, 1], origin = [-0.5, -0.5] \
             }} }}\n{SOFT}\nmass = {{ density = 1000 }}\n\
             [[obstacle]]\nshape = {{ half_space = {{ normal = [0, 1], offset = {offset} }} }}\n\
             [[obstacle]]\nshape = {{ half_space = {{ normal = [0, -1], offset = {offset} }} }}\n"
        ))
    };
    tells("`cube` starts 0.001 m from", [&[of(1e-3)], &[of(1.1e-2)]]);
}

#[test]
fn a_normal_of_any_size_is_a_wall() {
    for size in ["5e-324", "1e-300", "1e300"] {
        let told = warnings(&format!(
            "dimension = 2\ntime = {{ integrator = 'symplectic-euler', step = 1e-3, duration = 1.0 }}\n\
             world = {{ walls = [{{ normal = [0, {size}], offset = 0.05 }}] }}\n\
             [[body]]\nname = 'bar'\nmesh = {{ grid = {{ cells = [4, 1], size = [1.0, 0.1] }} }}\n\
             mass = {{ density = 1000 }}\n{SOFT}\n"
        ));
        assert!(told.contains("5 vertices start behind a wall"), "{size}: {told}");
    }
}
