//! What people write first, and what they are told.

use super::*;
use crate::ProblemKind;

/// The first problem of `GOOD` with `old` replaced by `new`.
fn problem(old: &str, new: &str) -> Problem {
    let failed = error(&changed(old, new));
    failed.problems().first().unwrap_or_else(|| panic!("{failed}")).clone()
}

/// Its help contains `expected`.
fn helps(old: &str, new: &str, expected: &str) {
    let problem = problem(old, new);
    assert!(problem.help.iter().any(|help| help.contains(expected)), "{new}: {problem:?}");
}

#[test]
fn a_table_in_the_place_of_a_list_is_told_the_brackets() {
    helps("[[body]]", "[body]", "`[[body]]`");
    helps(PIN, "{ vertices = [0] }", "`pin = [{ .. }]`");
    helps("[0.0, -9.8]", "[0.0, -9.8]\nwalls = { normal = [0, 1], offset = 0 }", "`walls = [{ .. }]`");
    helps("[\"state\"]", "\"state\"", "`channels = [\"state\"]`");
    assert!(matches!(problem("[[body]]", "[body]").kind, ProblemKind::WrongType { .. }));
}

#[test]
fn a_value_in_the_place_of_a_table_is_told_the_key_that_takes_it() {
    helps(MASS, "1", "`mass = { total = 1 }` [kg]");
    helps(MASS, "1", "`mass = { density = 1 }`");
    helps(MESH, "{ file = \"bunny.obj\" }", "`file = { path = \"bunny.obj\" }`");
    // What is no path, and no number, is not.
    assert_eq!(problem(MASS, "true").help, [""; 0]);
    assert_eq!(problem(MASS, "[1]").help, [""; 0]);
}

#[test]
fn keys_beside_a_choice_are_told_where_they_stand() {
    let beside = problem(MESH, "{ grid = { cells = [2, 3], spacing = 0.1 }, transform = { scale = 2.0 } }");
    assert_eq!(beside.path.to_string(), "body.0.mesh.transform");
    assert!(matches!(&beside.kind, ProblemKind::UnknownField { field, .. } if field == "transform"));
    assert!(beside.help[0].contains("belongs next to `mesh`"), "{beside:?}");
    let inside = problem(MESH, "{ grid = { cells = [2, 3] }, spacing = 0.1 }");
    assert!(inside.help[0].contains("`mesh = { grid = { spacing = .. } }`"), "{inside:?}");
    // Two choices are still two.
    assert!(matches!(problem(MASS, "{ per_vertex = 1.0, total = 2.0 }").kind, ProblemKind::WrongType { .. }));
}

#[test]
fn keys_of_other_programs_are_told_what_does_their_work() {
    helps(MESH, "{ cube = { cells = [2, 3], spacing = 0.1 } }", "did you mean `grid`?");
    helps("name = \"net\"", "name = \"net\"\nnodal_integration = {}", "give `order = 2`");
    helps("name = \"net\"", "name = \"net\"\ncolor = \"red\"", "--colour-by");
    let wall = "[0.0, -9.8]\nwalls = [{ normal = [0, 1], offset = 0, friction = 0.3 }]";
    helps("[0.0, -9.8]", wall, "\"wall0\"], friction = 0.3");
    helps("name = \"net\"", "name = \"net\"\nfriction = 0.3", "`friction` stands in `[contact]`");
}

#[test]
fn paths_that_lead_nowhere_are_told_the_one_that_leads_there() {
    let text = changed(SPRINGS, "{ stiffness = 100.0 }\nelastic = { stvk = { young = 1.0, poisson = 0.0 } }");
    let meant = |path: &str| {
        let set = Source::new("scene.toml", &text).with_overrides(&[(path.into(), "1".into())]);
        set.expect_err(path).problems()[0].help.clone()
    };
    for (path, right) in [
        ("body.net.springs.stiffness", "body.0.springs.stiffness"),
        ("body.net.elastic.yuong", "body.0.elastic.stvk.young"),
        ("body.elastic.stvk.poisson", "body.0.elastic.stvk.poisson"),
    ] {
        assert!(meant(path).contains(&format!("did you mean `{right}`?")), "{path}: {:?}", meant(path));
    }
    let nothing = meant("body.net.nonsense");
    assert!(!nothing.iter().any(|help| help.contains("did you mean")), "{nothing:?}");
}

#[test]
fn files_that_are_not_there_are_told_the_one_that_is_near() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("my_jelly.toml"), GOOD).unwrap();
    std::fs::write(directory.path().join("jolly.toml"), GOOD).unwrap();
    let help =
        |name: &str| Source::from_path(directory.path().join(name)).unwrap_err().problems()[0].help.clone();
    for name in ["my_jely.toml", "my_jelly", "My-Jelly.toml"] {
        assert!(help(name)[0].contains("my_jelly.toml"), "{name}: {:?}", help(name));
    }
    assert_eq!(help("galaxy.toml"), [""; 0]);
    std::fs::write(directory.path().join("run.mcap"), b"\x89MCAP0\r\n\x01").unwrap();
    let failed = Source::from_path(directory.path().join("run.mcap")).unwrap_err();
    assert_eq!(failed.problems()[0].kind, ProblemKind::Unreadable);
    assert!(failed.problems()[0].help[0].contains("pliant view"), "{failed}");
}

/// Many unknown keys are counted, not kept.
#[test]
fn of_many_unknown_keys_the_first_are_told_and_the_rest_counted() {
    let keys: String = (0..1000).map(|i| format!("key{i} = {i}\n")).collect();
    let failed = error(&changed("[output]", &format!("{keys}[output]")));
    assert_eq!(failed.problems().len(), 51);
    let last = &failed.problems()[50];
    assert_eq!((&last.kind, last.line), (&ProblemKind::Omitted { count: 950 }, None));
    assert!(failed.to_string().ends_with("... and 950 more errors"), "{failed}");
    assert!(failed.problems()[..50].iter().all(|problem| problem.line.is_some()));
}

/// Only a part of a long line is drawn, with the column that it has in all of it.
#[test]
fn of_a_long_line_the_part_around_the_place_is_shown() {
    let long = format!("pin = [{{ vertices = [{}0], zoom = 1 }}]", "0, ".repeat(100_000));
    let failed = error(&changed(&format!("pin = {PIN}"), &long));
    let column = 1 + long.find("zoom").unwrap();
    assert_eq!(failed.column(), Some(column));
    let said = failed.to_string();
    assert!(said.contains(&format!("scene.toml:16:{column}")) && said.contains("zoom = 1 }]"), "{said}");
    assert!(said.len() < 2000, "{} bytes", said.len());
    // A key of a megabyte is shortened wherever it is told.
    let said = error(&changed("name = \"net\"", &format!("{} = 1", "x".repeat(1 << 20)))).to_string();
    assert!(said.len() < 4000, "{} bytes", said.len());
}

#[test]
fn a_formula_has_a_bound_of_length() {
    let formula = |terms: usize| format!("[0.0, \"{}t\"]", "t+".repeat(terms));
    assert!(read(&changed("[0.0, -9.8]", &formula(30_000))).is_ok());
    let long = problem("[0.0, -9.8]", &formula(100_000));
    assert_eq!(long.kind, ProblemKind::Quantity);
    assert!(long.message.contains("200001 bytes") && long.message.contains("65536"), "{}", long.message);
}

#[test]
fn particles_in_one_place_are_refused_before_their_pairs_are_looked_at() {
    let points = vec!["[0.5, 0.5, 0.0]"; 20_000].join(", ");
    let text = format!(
        "dimension = 3\ncontact = {{}}\ntime = {{ integrator = 'implicit-euler', step = 1e-3, duration = 1e-2 \
         }}\n[[body]]\nname = 'sand'\nmesh = {{ inline = {{ points = [{points}] }} }}\nmass = {{ total = 1.0 \
         }}\ncontact = {{ radius = 0.01 }}\n"
    );
    let scene = read(&text).unwrap_or_else(|error| panic!("{error}"));
    let problems = scene.assemble(crate::assembly::UnstableStep::Accept).err().expect("they overlap");
    let [problem] = &problems[..] else { panic!("{problems:?}") };
    assert_eq!(problem.path.to_string(), "body.0");
    assert!(problem.message.contains("vertex 0 of `sand` and vertex 1 of `sand`"), "{}", problem.message);
    assert!(problem.message.contains("19998 more"), "{}", problem.message);
}
