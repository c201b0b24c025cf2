//! Starts that are none, and scenes that contact cannot take.

const BODIES: &str = "dimension = 2\ntime = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }\n";

fn two_boxes(origin: &str) -> String {
    format!(
        "{BODIES}contact = {{}}\n\
         [[body]]\nname = 'low'\nmesh = {{ grid = {{ cells = [2, 2], size = [0.2, 0.2] }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
         [[body]]\nname = 'high'\nmesh = {{ grid = {{ cells = [2, 2], size = [0.2, 0.2], origin = {origin} \
         }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n"
    )
}

#[test]
fn bodies_that_cross_at_the_start_are_told_with_the_place() {
    let told = super::problems(&two_boxes("[0.05, 0.1999]"));
    assert!(told.contains("crosses") && told.contains("`low`") && told.contains("`high`"), "{told}");
    assert!(told.contains("edge ") && told.contains("(0."), "{told}");
}

/// An override of where a body is, or of how near it may come, and none of what it is made of.
#[test]
fn an_overlap_comes_from_overrides_of_places_alone() {
    let source = pliant_scene::Source::new("scene.toml", two_boxes("[0.05, 0.1999]"));
    let note = |sets: &[[&str; 2]]| {
        let sets: Vec<(String, String)> =
            sets.iter().map(|set| (set[0].to_owned(), set[1].to_owned())).collect();
        let source = source.with_overrides(&sets).unwrap();
        let problems =
            source.scene().unwrap().assemble(pliant_scene::assembly::UnstableStep::Refuse).err().unwrap();
        source.error(problems).problems()[0].note.clone()
    };
    let young = ["body.0.elastic.neo-hookean.young", "2e5"];
    let origin = ["body.1.mesh.grid.origin", "[0.05, 0.15]"];
    assert_eq!(note(&[young]), None);
    assert_eq!(note(&[["body.1.velocity.rigid.linear", "[0, 1]"], young]), None);
    for sets in [[origin, young], [young, origin]] {
        assert_eq!(note(&sets), Some("from `--set body.1.mesh.grid.origin=[0.05, 0.15]`".to_owned()));
    }
    let apart = ["contact.distance", "1e-3"];
    assert_eq!(note(&[young, apart]), Some("from `--set contact.distance=1e-3`".to_owned()));
}

#[test]
fn bodies_that_touch_at_no_distance_overlap() {
    let told = super::problems(&two_boxes("[0.05, 0.2]"));
    assert!(told.contains("overlap") || told.contains("crosses"), "{told}");
}

#[test]
fn bodies_apart_are_assembled_and_their_distance_is_told() {
    let report = super::assembled(&two_boxes("[0.05, 0.21]")).report;
    let contact = report.contact.unwrap();
    // A thousandth of the diagonal of 0.2 sqrt(2).
    assert!((contact.distance - 0.2e-3 * 2f64.sqrt()).abs() < 1e-12, "{contact:?}");
    assert_eq!(contact.pairs.len(), 3, "{contact:?}");
    let facts = contact.facts(Some(0.01)).join("\n");
    assert!(facts.contains("m, a thousandth of the size of `low`"), "{facts}");
    // Of two with one modulus the first is named.
    assert!(facts.contains("low-low, low-high: 100000 Pa, Young's modulus of `low`"), "{facts}");
    // Looked for by `check` alone.
    assert!(contact.start.is_none() && !facts.contains("at the start"), "{facts}");
    let fine = two_boxes("[0.05, 0.21]")
        .replace("cells = [2, 2], size = [0.2, 0.2] }", "cells = [400, 1], size = [0.2, 0.2] }");
    let contact = super::assembled(&fine).report.contact.unwrap();
    let facts = contact.facts(None).join("\n");
    assert!((contact.distance - 0.25 * 0.2 / 400.0).abs() < 1e-12, "{facts}");
    assert!(facts.contains("a quarter of the shortest edge, of `low`"), "{facts}");
    let soft = two_boxes("[0.05, 0.21]").replacen("young = 1e5", "young = 3e5", 1);
    let facts = super::assembled(&soft).report.contact.unwrap().facts(None).join("\n");
    assert!(facts.contains("low-high, high-high: 100000 Pa, Young's modulus of `high`"), "{facts}");
}

/// Gap at the start, and between what, as `check` has them.
fn start_gap(text: &str) -> (usize, Option<(f64, [String; 2])>) {
    let assembly = super::scene(text).assemble(pliant_scene::assembly::UnstableStep::Accept);
    let start = assembly.unwrap_or_else(|problems| panic!("{problems:?}")).report.contact.unwrap().start;
    let start = start.unwrap();
    (start.candidates, start.least.map(|least| (least.gap, least.between)))
}

/// Faces beside each other, corners across a gap, slants whose boxes overlap, and a floor that is nearer.
#[test]
fn the_least_gap_of_a_start_is_that_of_its_nearest_primitives() {
    let near = |text: &str, expected: f64, names: [&str; 2]| {
        let (_, least) = start_gap(text);
        let (gap, between) = least.unwrap();
        assert!((gap - expected).abs() < 1e-12, "{gap} m, not {expected} m");
        for name in names {
            assert!(between.concat().contains(name), "{between:?} without {name}");
        }
    };
    near(&two_boxes("[0.05, 0.21]"), 0.01, ["`low`", "`high`"]);
    near(&two_boxes("[0.35, 0.3]"), 0.15f64.hypot(0.1), ["vertex 8 of `low`", "`high`"]);
    near(&small_box(0.05, "[0.6, 0.1, 0.1]"), 0.2, ["`big`", "`small`"]);
    let floor =
        "[[obstacle]]\nname = 'floor'\nshape = { half_space = { normal = [0, 1], offset = -0.004 } }\n";
    near(&(two_boxes("[0.05, 0.21]") + floor), 0.004, ["vertex 0 of `low`", "`floor`"]);
    let triangle = |name: &str, points: &str| {
        format!(
            "[[body]]\nname = '{name}'\nmesh = {{ inline = {{ points = {points}, triangles = [[0, 1, 2]] }} \
             }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n"
        )
    };
    let slants = format!("{BODIES}contact = {{ distance = 1e-3 }}\n")
        + &triangle("one", "[[0, 0], [1, 0], [0, 1]]")
        + &triangle("other", "[[1, 1], [0.6, 1], [1, 0.6]]");
    near(&slants, 0.6 / 2f64.sqrt(), ["edge 1-2 of `one`", "vertex 1 of `other`"]);
    // Slanted faces far apart, whose bodies' boxes overlap: found by looking farther and farther.
    let tetrahedron = |name: &str, points: &str, order: &str| {
        format!(
            "[[body]]\nname = '{name}'\nmesh = {{ inline = {{ points = {points}, tetrahedra = [{order}] }} \
             }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n"
        )
    };
    let faces = BODIES.replace("dimension = 2", "dimension = 3")
        + "contact = { distance = 1e-3 }\n"
        + &tetrahedron("one", "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]", "[0, 1, 2, 3]")
        + &tetrahedron("other", "[[1, 1, 1], [0.2, 1, 1], [1, 0.2, 1], [1, 1, 0.2]]", "[0, 2, 1, 3]");
    near(&faces, 1.2 / 3f64.sqrt(), ["`one`", "`other`"]);
}

/// Pairs that the first search looks at: none of boxes apart, all that is within the distance of others.
#[test]
fn candidates_of_a_start_are_counted() {
    let count = |origin: &str, contact: &str| {
        let text = two_boxes(origin).replace("contact = {}", contact);
        start_gap(&text).0
    };
    let alone = "contact = { distance = 1e-3, pairs = [{ between = ['low', 'low'], contact = false }, \
                 { between = ['high', 'high'], contact = false }] }";
    assert_eq!(count("[0.05, 0.21]", alone), 0);
    // Two vertices of each side are over an edge of the other.
    assert_eq!(count("[0.05, 0.2005]", alone), 4);
}

/// A block of 40 kg/m on a floor: at rest it is held with its weight, and what starts deeper is thrown.
#[test]
fn a_body_that_starts_too_near_is_told_with_the_force_and_its_weight() {
    let block = |gap: f64, gravity: f64, integrator: &str| {
        let text = format!(
            "dimension = 2\ntime = {{ integrator = '{integrator}', step = 0.01, duration = 1.0 }}\n\
             contact = {{ distance = 0.001 }}\nworld = {{ gravity = [0, {gravity}] }}\n\
             [[body]]\nname = 'block'\nelastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\n\
             mesh = {{ grid = {{ cells = [2, 2], size = [0.2, 0.2], origin = [0, {gap}] }} }}\n\
             mass = {{ density = 1000 }}\n\
             [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
        );
        let warnings = super::assembled(&text).report.warnings;
        warnings.into_iter().filter(|warning| warning.contains("starts")).collect::<Vec<_>>()
    };
    let told = block(2e-4, -10.0, "implicit-euler");
    let [told] = &told[..] else { panic!("{told:?}") };
    assert!(told.contains("`block` starts 2e-4 m from `floor`, 20 % of the activation distance"), "{told}");
    assert!(told.contains("times its weight of 400 N"), "{told}");
    let adrift = block(9e-4, 0.0, "implicit-euler");
    assert!(adrift[0].contains("nothing holds it there"), "{adrift:?}");
    // Begins to push at 1 mm; pushed with less than its weight just below.
    for (gap, gravity, integrator) in
        [(1e-3, -10.0, "implicit-euler"), (0.998e-3, -10.0, "implicit-euler"), (2e-4, -10.0, "quasi-static")]
    {
        assert_eq!(block(gap, gravity, integrator), [""; 0], "{gap} {integrator}");
    }
}

#[test]
fn friction_of_no_surface_is_told() {
    let of = |friction: &str| {
        let text = two_boxes("[0.05, 0.21]").replace("contact = {}", friction);
        super::assembled(&text).report.warnings.concat().contains("coefficient of friction")
    };
    assert!(of("contact = { friction = 50 }"));
    assert!(of("contact = { pairs = [{ between = ['low', 'high'], friction = 50 }] }"));
    assert!(!of("contact = { friction = 2.0 }"));
}

#[test]
fn a_body_below_a_floor_is_told() {
    let text = format!(
        "{BODIES}contact = {{}}\n\
         [[body]]\nname = 'block'\nmesh = {{ grid = {{ cells = [2, 2], size = [0.2, 0.2], origin = [0, \
         -0.1] }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
         [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
    );
    let told = super::problems(&text);
    assert!(told.contains("overlap by 0.1 m") && told.contains("`floor`"), "{told}");
}

/// Scenes that are refused by validation, with what is said.
#[test]
fn schemes_and_tables_that_contact_cannot_take_are_refused() {
    let scene = two_boxes("[0.05, 0.21]");
    let midpoint = scene.replace("'implicit-euler'", "'implicit-midpoint'");
    let pair = scene
        .replace("contact = {}", "contact = { pairs = [{ between = ['low', 'hihg'], friction = 0.1 }] }");
    let empty = scene.replace("contact = {}", "contact = { pairs = [{ between = ['low', 'high'] }] }");
    let twice = "contact = { pairs = [{ between = ['low', 'high'], friction = 0.1 }, \
                 { between = ['high', 'low'], friction = 0.2 }] }";
    let friction = scene.replace("contact = {}", "contact = { friction = -0.1 }");
    let without = scene.replace("contact = {}\n", "")
        + "[[obstacle]]\nname = 'floor'\nshape = { half_space = { normal = [0, 1], offset = -1 } }\n";
    let cases = [
        (midpoint, "end elsewhere"),
        (pair, "did you mean `high`"),
        (empty, "sets nothing"),
        (scene.replace("contact = {}", twice), "has an entry already, `pairs[0]`"),
        (friction, "0 or more"),
        (without, "has no `[contact]`"),
    ];
    for (text, expected) in cases {
        let told = match pliant_scene::Scene::from_toml(&text) {
            Ok(_) => panic!("accepted: {text}"),
            Err(error) => error.to_string(),
        };
        assert!(told.contains(expected), "{told}");
    }
}

/// Walls rub where a pair says so, and let through what it lets through; they have names of their own.
#[test]
fn pairs_may_name_walls() {
    let slides = |pairs: &str| {
        format!(
            "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}\n\
             contact = {{ distance = 1e-3, friction = 0.9, pairs = [{pairs}] }}\n\
             world = {{ gravity = [0, -10], walls = [{{ normal = [0, 1], offset = 0 }}] }}\n\
             [[body]]\nname = 'block'\nmesh = {{ grid = {{ cells = [2, 2], size = [0.2, 0.1], origin = [0, \
             0.99e-3] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e6, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
             velocity = {{ rigid = {{ linear = [1, 0] }} }}\n"
        )
    };
    let end = |pairs: &str| {
        let mut simulation = super::assembled(&slides(pairs)).simulation;
        super::advance(&mut simulation, 20);
        let mean = |rows: &[f64], k: usize| rows.chunks(2).take(9).map(|row| row[k]).sum::<f64>() / 9.0;
        (mean(&simulation.velocities(), 0), mean(&simulation.positions(), 1))
    };
    let (speed, height) = end("");
    assert!((speed - 1.0).abs() < 1e-6 && height > 0.04, "a wall rubs by itself: {speed} m/s at {height} m");
    let (speed, height) = end("{ between = ['block', 'wall0'], friction = 0.3 }");
    assert!((speed - (1.0 - 0.3 * 10.0 * 0.2)).abs() < 0.05 && height > 0.04, "{speed} m/s at {height} m");
    // Switched on again it has no friction still.
    let (speed, _) = end("{ between = ['wall0', 'block'], contact = true }");
    assert!((speed - 1.0).abs() < 1e-6, "{speed}");
    let (_, height) = end("{ between = ['block', 'wall0'], contact = false }");
    assert!(height < -0.1, "it lies on a wall that is switched off, at {height} m");
    let told = |text: &str| pliant_scene::Scene::from_toml(text).unwrap_err().to_string();
    let unknown = told(&slides("{ between = ['block', 'wall1'], friction = 0.3 }"));
    assert!(unknown.contains("there is no body, obstacle or wall \"wall1\""), "{unknown}");
    assert!(unknown.contains("`wall0`"), "{unknown}");
    let idle = told(&slides("{ between = ['wall0', 'wall0'], friction = 0.3 }"));
    assert!(idle.contains("obstacles and walls do not touch each other"), "{idle}");
    let twice = told(&slides("").replace("name = 'block'", "name = 'wall0'"));
    assert!(twice.contains("the name of this wall in contact, is that of something else"), "{twice}");
}

/// Two solids in space, or one of them an obstacle: the scene.
fn in_space(second: &str) -> String {
    format!(
        "dimension = 3\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}\ncontact = \
         {{}}\n\
         [[body]]\nname = 'big'\nmesh = {{ grid = {{ cells = [2, 2, 2], size = [0.4, 0.4, 0.4] }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 \
         }}\n{second}"
    )
}

fn small_box(size: f64, origin: &str) -> String {
    in_space(&format!(
        "[[body]]\nname = 'small'\nmesh = {{ grid = {{ cells = [1, 1, 1], size = [{size}, {size}, {size}], \
         origin = {origin} }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n"
    ))
}

/// What crosses nowhere may still be where it cannot be.
#[test]
fn what_lies_inside_is_told() {
    let square = "dimension = 2\ntime = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 \
                  }\ncontact = {}\n\
        [[body]]\nname = 'big'\nmesh = { grid = { cells = [2, 2], size = [0.4, 0.4] } }\n\
        elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }\nmass = { density = 1000 }\n";
    let other = "[[body]]\nname = 'small'\nmesh = { grid = { cells = [1, 1], size = [0.05, 0.05], origin = \
                 [0.07, 0.31] } }\n\
        elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }\nmass = { density = 1000 }\n";
    let ball = |d: &str| {
        format!("[[obstacle]]\nname = 'small'\nshape = {{ ball = {{ centre = {d}, radius = 0.02 }} }}\n")
    };
    let cases = [
        small_box(0.05, "[0.07, 0.31, 0.11]"),
        in_space(&ball("[0.11, 0.09, 0.31]")),
        format!("{square}{other}"),
        format!("{square}{}", ball("[0.11, 0.31]")),
    ];
    for text in cases {
        let told = super::problems(&text);
        assert!(told.contains("`small` lies inside `big`"), "{told}");
    }
    // Beside each other on both sides of a ray's many directions, nothing is said.
    for origin in ["[0.41, 0.1, 0.1]", "[-0.06, 0.1, 0.1]", "[0.1, 0.41, 0.1]", "[0.1, -0.06, 0.1]"] {
        super::assembled(&small_box(0.05, origin));
    }
}

#[test]
fn boxes_that_overlap_by_a_hair_and_vertices_that_coincide_are_told() {
    let told = super::problems(&small_box(0.1, "[0.1, 0.13, 0.3999]"));
    assert!(told.contains("crosses") && told.contains("`small`") && told.contains("more pairs"), "{told}");
    // Exactly on each other: every vertex of one lies on a triangle or a vertex of the other.
    for origin in ["[0.4, 0.0, 0.0]", "[0.4, 0.4, 0.4]", "[0.1, 0.1, 0.4]"] {
        let told = super::problems(&small_box(0.2, origin));
        assert!(told.contains("overlap") || told.contains("crosses"), "{told}");
    }
    let ball = "[[obstacle]]\nname = 'ball'\nshape = { ball = { centre = [0.2, 0.2, 0.2], radius = 5.0 } }\n";
    let told = super::problems(&in_space(ball));
    assert!(told.contains("overlap") && told.contains("`ball`"), "{told}");
}

/// Two triangles on the same three vertices, which files of surfaces have, are one more weight, no fault: or
/// they are told.
#[test]
fn a_triangle_that_is_there_twice_is_told_or_touches() {
    let text = "dimension = 3\ntime = { integrator = 'implicit-euler', step = 0.005, duration = 1.0 }\n\
        world = { gravity = [0, 0, -9.81] }\ncontact = { distance = 1e-3 }\n\
        [[body]]\nname = 'sheet'\nmesh = { inline = { points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles \
        = [[0, 1, 2], [0, 1, 2]] } }\n\
        membrane = { thickness = 1e-3 }\nelastic = { stable-neo-hookean = { young = 1e5, poisson = 0.3 } }\n\
        mass = { density = 0.2 }\npin = [{ vertices = [0, 1, 2] }]\n\
        [[body]]\nname = 'grain'\nmesh = { inline = { points = [[0.3, 0.3, 0.02]] } }\nmass = { per_vertex \
        = 0.01 }\n";
    match pliant_scene::Scene::from_toml(text).map_err(|error| error.to_string()).and_then(|scene| {
        scene
            .assemble(pliant_scene::assembly::UnstableStep::Refuse)
            .map_err(|problems| format!("{problems:?}"))
    }) {
        Err(told) => assert!(told.contains("triangle") || told.contains("element"), "{told}"),
        Ok(assembly) => {
            let mut simulation = assembly.simulation;
            super::advance(&mut simulation, 60);
            assert!(simulation.positions()[11] > 0.0, "it fell through: {}", simulation.positions()[11]);
        }
    }
}

/// Pairs that are switched on while a simulation runs are looked at first.
#[test]
fn bodies_that_overlap_now_cannot_begin_to_touch() {
    let text = |contact: &str| {
        two_boxes("[0.05, 0.22]")
            .replace("contact = {}", contact)
            .replace("name = 'high'", "name = 'high'\nvelocity = { rigid = { linear = [0, -2] } }")
    };
    let apart = "contact = { pairs = [{ between = ['low', 'high'], contact = false }] }";
    let mut simulation = super::assembled(&text(apart)).simulation;
    super::advance(&mut simulation, 4);
    let before = simulation.state().x().to_vec();
    let error = simulation.adopt(super::assembled(&text("contact = {}")).simulation).unwrap_err();
    assert!(error.to_string().contains("`high`") && error.to_string().contains("now, at t = "), "{error}");
    assert_eq!(simulation.state().x(), before);
    // Once through, it may.
    super::advance(&mut simulation, 21);
    simulation.adopt(super::assembled(&text("contact = {}")).simulation).unwrap();
    super::advance(&mut simulation, 2);
}
