//! Syntax and types: kinds and places of mistakes.

use super::*;
use crate::KeyPath;
use crate::Problem;
use crate::ProblemKind;

/// The first line of each problem of `GOOD` with `old` replaced by `new`.
fn problems(old: &str, new: &str) -> Vec<String> {
    briefly(&error(&changed(old, new)))
}

#[test]
fn the_scene_of_the_tests_is_good() {
    let scene = read(GOOD).unwrap();
    assert_eq!((scene.dimension, scene.time.step, scene.body.len()), (2, Some(1e-3), 1));
}

#[test]
fn syntax() {
    let failed = error(&changed("step = 1e-3", "step = 1e"));
    assert_eq!((failed.line(), failed.column()), (Some(5), Some(10)));
    assert_eq!(failed.problems()[0].kind, ProblemKind::Syntax);
    assert_eq!(failed.problems().len(), 1);
    assert_eq!(problems("duration =", "step = 2\nduration ="), ["6:1 : duplicate key"]);
}

#[test]
fn unknown_fields_are_reported_together_and_with_what_else_is_wrong() {
    let failed = error(&changed("step = 1e-3", "zoom = 1\nstpe = 1e-3"));
    assert_eq!(
        briefly(&failed),
        ["5:1 time.zoom: unknown field `zoom`", "6:1 time.stpe: unknown field `stpe`",]
    );
    let expected = ["integrator", "solver", "step", "adaptive", "arc_length", "duration", "allow_unstable"];
    let expected = expected.map(str::to_owned).to_vec();
    assert_eq!(
        failed.problems()[1].kind,
        ProblemKind::UnknownField { field: "stpe".to_owned(), expected: expected.clone() }
    );
    assert_eq!(
        failed.problems()[1].help,
        [
            "did you mean `step`?",
            "fields here: `integrator`, `solver`, `step`, `adaptive`, `arc_length`, `duration`, \
             `allow_unstable`"
        ]
    );
    assert_eq!(failed.problems()[0].help.len(), 1, "nothing is near `zoom`");
}

#[test]
fn wrong_types() {
    for (old, new, expected) in [
        ("1e-3", "'abc'", "5:8 time.step: `step` takes a number, found the text `abc`"),
        ("1e-3", "1e400", "5:8 time.step: the number 1e400 is too large"),
        (
            "dimension = 2",
            "dimension = 2.0",
            "1:13 dimension: `dimension` takes a whole number, 0 or more, found the number 2.0",
        ),
        (
            "[2, 3]",
            "[2, -3]",
            "13:31 body.0.mesh.grid.cells.1: `cells` takes a whole number, 0 or more, found -3",
        ),
        (
            "stiffness = 100.0",
            "stiffness = [1, 2,\n 'x']",
            "15:2 body.0.springs.stiffness.2: `stiffness` takes a number, found the text `x`",
        ),
        (
            "stiffness = 100.0",
            "stiffness = true",
            "14:25 body.0.springs.stiffness: `stiffness` takes a number or a list of numbers, found `true`",
        ),
        (
            "[0.0, -9.8]",
            "2026-01-01",
            "9:11 world.gravity: `gravity` takes a list, found the date 2026-01-01",
        ),
        (
            "\"symplectic-euler\"",
            "{ symplectic-euler = 3 }",
            "4:35 time.integrator.symplectic-euler: `symplectic-euler` takes no parameters, found 3",
        ),
        (
            "{ per_vertex = 1.0 }",
            "1.0",
            "15:8 body.0.mass: `mass` takes exactly one of `density`, `per_vertex`, `total`, `preset`, \
             found the number 1.0",
        ),
        (
            "{ per_vertex = 1.0 }",
            "{ per_vertex = 1.0, total = 2.0 }",
            "15:8 body.0.mass: `mass` takes exactly one of `density`, `per_vertex`, `total`, `preset`, \
             found `per_vertex` and `total`",
        ),
        (
            "{ per_vertex = 1.0 }",
            "'density'",
            "15:8 body.0.mass.density: `density` takes a number, found nothing",
        ),
    ] {
        assert_eq!(problems(old, new), [expected], "{new}");
    }
}

/// Texts that `toml`'s own deserializer lets pass.
#[test]
fn a_number_for_a_list_is_told_with_a_list() {
    let failed = error(&changed("[0.0, -9.8]", "9.8"));
    let [problem] = failed.problems() else { panic!("{failed}") };
    assert_eq!(problem.message, "`gravity` takes a list, found the number 9.8");
    assert!(problem.help[0].contains("`gravity = [0.0, -9.81]` in 2D"), "{:?}", problem.help);
}

#[test]
fn lists_are_neither_tables_nor_longer_than_they_should_be() {
    let cloth = "cloth = { cells = [2, 3, 4], origin = [0, 0], u = [1, 0], v = [0, 1] }";
    assert_eq!(
        problems("grid = { cells = [2, 3], spacing = 0.1 }", cloth),
        ["13:28 body.0.mesh.cloth.cells: `cells` takes a list of 2 entries, found a list of 3 entries"]
    );
    assert_eq!(
        problems("{ stiffness = 100.0 }", "[100.0]"),
        ["14:11 body.0.springs: `springs` takes a table with `stiffness`, `young`, `expression`, \
             `parameters`, `rest_length`, found a list of 1 entry"]
    );
}

#[test]
fn missing_fields_point_at_what_should_hold_them() {
    for (old, new, expected) in [
        ("dimension = 2", "", "1:1 dimension: missing field `dimension`"),
        ("step = 1e-3\n", "", "3:1 time: [time] has neither `step` nor `adaptive`"),
        ("cells = [2, 3], ", "", "13:10 body.0.mesh.grid.cells: missing field `cells` in `grid`"),
        ("[output]", "[[body]]\nname = 'x'\n[output]", "18:1 body.1.mesh: missing field `mesh` in `body`"),
        (
            "{ grid = { cells = [2, 3], spacing = 0.1 } }",
            "'grid'",
            "13:8 body.0.mesh.grid.cells: missing field `cells` in `grid`",
        ),
    ] {
        assert_eq!(problems(old, new), [expected], "{new}");
    }
    assert_eq!(briefly(&error("")), ["1:1 dimension: missing field `dimension`"]);
}

#[test]
fn unknown_choices() {
    for (old, new, expected) in [
        (
            "\"symplectic-euler\"",
            "'symplectic_euler'",
            "4:14 time.integrator: unknown choice `symplectic_euler` for `integrator`",
        ),
        ("grid =", "gird =", "13:10 body.0.mesh.gird: unknown choice `gird` for `mesh`"),
        ("[\"state\"]", "['state', 'mseh']", "20:22 output.channels.1: unknown choice `mseh` for `channels`"),
    ] {
        assert_eq!(problems(old, new), [expected], "{new}");
    }
    let failed = error(&changed("grid =", "gird ="));
    assert_eq!(failed.problems()[0].help[0], "did you mean `grid`?");
    assert_eq!(failed.problems()[0].path, "body.0.mesh.gird".parse::<KeyPath>().unwrap());
    let failed = error(&changed(MESH, "'bunny.msh'"));
    assert_eq!(failed.problems()[0].help[0], "a file is read by `{ file = { path = \"bunny.msh\" } }`");
}

#[test]
fn whole_numbers_are_numbers_too() {
    let scene = read(&changed("1e-3", "1_000000000000000000000")).unwrap();
    assert_eq!(scene.time.step, Some(1e21));
    let scene = read(&changed("stiffness = 100.0", "stiffness = 0x10")).unwrap();
    assert_eq!(scene.body[0].springs.as_ref().unwrap().stiffness.as_ref().unwrap().as_slice(), [16.0]);
    let scene = read(&changed("\"symplectic-euler\"", "{ symplectic-euler = {} }")).unwrap();
    assert_eq!(scene.time.integrator, read(GOOD).unwrap().time.integrator);
}

#[test]
fn columns_are_those_of_an_editor() {
    for (text, line, column) in [
        // A tab is one character, as are letters of several bytes; the byte-order mark is none.
        ("\tdimension = 'x'", 1, 14),
        ("\u{feff}dimension = 'x'", 1, 13),
        ("title = 'ü\u{1F600}'\r\ndimension = 'x'\r\n", 2, 13),
        ("world = { gravity = ['\u{1F600}é', 1] }\ndimension = 2", 1, 22),
        ("title = 'ü\u{1F600}' x", 1, 14),
    ] {
        let failed = error(text);
        // Before it, at the top, stands what is missing.
        let there = |found: &&Problem| (found.line, found.column) != (Some(1), Some(1));
        let found = failed.problems().iter().find(there).unwrap();
        assert_eq!((found.line, found.column), (Some(line), Some(column)), "{text:?}: {failed}");
    }
}

/// Values of the wrong type in several places, one of them that its table cannot do without, and mistakes of
/// meaning in a part that can be read: told at once, and nothing that only follows from them.
#[test]
fn every_mistake_is_told_at_once() {
    let text = "
dimension = 3
time = { integrator = 'velocity-verlet', step = 'soon', duration = 1.0 }
world = { walls = [{ normal = [0, 0, 0], offset = 0 }] }
[[body]]
mesh = { grid = { cells = 'many', size = [1, 1, 1] } }
elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
mass = { density = 1000.0 }
[[body]]
mesh = { grid = { cells = [1, 1, 1], size = [1, 1, 1] } }
elastic = { neo-hookean = { young = true, nu = 0.3 } }
mass = { density = 1000.0 }
";
    let expected = [
        "3:49 time.step: \"soon\"",
        "6:27 body.0.mesh.grid.cells: `cells` takes a list",
        "11:37 body.1.elastic.neo-hookean.young: `young` takes",
        "11:43 body.1.elastic.neo-hookean.nu: unknown field `nu`",
    ];
    let found = briefly(&error(text));
    for expected in expected {
        let place = expected.split(": ").next().unwrap();
        assert!(found.iter().any(|told| told.starts_with(place)), "{expected} is not in {found:#?}");
    }
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    // With all bodies readable, the wall without a normal is told too.
    let text = text.replace("'many'", "[1, 1, 1]").replace("true, nu", "1e5, poisson");
    let found = briefly(&error(&text));
    assert_eq!(found.len(), 2, "{found:#?}");
    assert!(found[1].contains("world.walls.0.normal"), "{found:#?}");
}

/// Editors underline what the schema does not have.
#[test]
fn every_scheme_that_is_read_as_a_word_is_one_in_the_schema() {
    let schema = crate::json_schema::schema();
    let choices = schema.as_value()["$defs"]["IntegratorSpec"]["oneOf"].as_array().unwrap();
    let words: Vec<&str> =
        choices[0]["enum"].as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect();
    for name in ["rk4", "bdf2", "newmark", "ias15", "generalised-alpha"] {
        assert!(words.contains(&name), "{name} of {words:?}");
    }
    for word in words {
        let text = format!(
            "dimension = 2\ntime = {{ integrator = '{word}', step = 1e-3, duration = 1.0 }}\n[[body]]\n\
             mesh = {{ inline = {{ points = [[0.0, 0.0]] }} }}\nmass = {{ total = 1.0 }}\n"
        );
        Scene::from_toml(&text).unwrap_or_else(|error| panic!("{word}: {error}"));
    }
}
