//! `--set`.

use super::*;

fn set(text: &str, overrides: &[&str]) -> Result<Source, SceneError> {
    let overrides: Vec<(String, String)> = overrides
        .iter()
        .map(|text| text.split_once('=').map(|(path, value)| (path.to_owned(), value.to_owned())).unwrap())
        .collect();
    Source::new("scene.toml", text).with_overrides(&overrides)
}

/// The lines that differ from `GOOD`, as they are now.
fn changed_lines(overrides: &[&str]) -> Vec<String> {
    let source = set(GOOD, overrides).unwrap();
    source.text().lines().filter(|line| !GOOD.lines().any(|old| old == *line)).map(str::to_owned).collect()
}

#[test]
fn values_are_replaced_where_they_stand() {
    for (text, lines) in [
        ("time.step=2e-4", vec!["step = 2e-4"]),
        ("time . step = 2e-4 ", vec!["step = 2e-4"]),
        ("body.0.mesh.grid.cells=[4, 4]", vec!["mesh = { grid = { cells = [4, 4], spacing = 0.1 } }"]),
        ("body.0.mesh.grid.cells.1=9", vec!["mesh = { grid = { cells = [2, 9], spacing = 0.1 } }"]),
        ("body.0.pin.0.box.min.0=-1", vec!["pin = [{ box = { min = [-1, 0.0], max = [0.0, 1.0] } }]"]),
        ("time.integrator=rk4", vec!["integrator = \"rk4\""]),
        ("body.0.name=\"a\"", vec!["name = \"a\""]),
        ("body.0.mesh={ file = { path = \"x.msh\" } }", vec!["mesh = { file = { path = \"x.msh\" } }"]),
        ("time.step=1 # fast", vec!["step = \"1 # fast\""]),
    ] {
        assert_eq!(changed_lines(&[text]), lines, "{text}");
    }
}

#[test]
fn comments_and_the_rest_stay() {
    let text = changed("1e-3", "1e-3   # [s]");
    let source = set(&text, &["time.step=1"]).unwrap();
    assert_eq!(source.text(), changed("1e-3", "1   # [s]"));
    assert_eq!(set(GOOD, &[]).unwrap().text(), GOOD);
    let windows = GOOD.replace('\n', "\r\n");
    assert_eq!(set(&windows, &["time.step=1"]).unwrap().scene().unwrap().time.step, Some(1.0));
}

#[test]
fn keys_and_tables_are_made() {
    let scene = |overrides: &[&str]| set(GOOD, overrides).unwrap().scene().unwrap();
    assert_eq!(scene(&["world.ether_drag=0.5"]).world.ether_drag, Some(0.5));
    assert!(scene(&["time.allow_unstable=true"]).time.allow_unstable);
    let velocity = scene(&["body.0.velocity.rigid.linear=[1, 2]"]).body[0].velocity.clone();
    assert!(velocity.is_some());
    let bare = GOOD.split("[output]").next().unwrap();
    assert_eq!(set(bare, &["output.rate=7"]).unwrap().scene().unwrap().output.rate, 7.0);
    assert_eq!(set(bare, &["output={ rate = 8 }"]).unwrap().scene().unwrap().output.rate, 8.0);
    let replaced =
        scene(&["time={ integrator = \"symplectic-euler\", step = 0.5, duration = 3 }", "title=Hello"]);
    assert_eq!((replaced.time.step, replaced.title.as_deref()), (Some(0.5), Some("Hello")));
    assert_eq!(scene(&["time.step=1", "time.step=2"]).time.step, Some(2.0));
    let body = "body.0={ mesh = { disk = { count = 1, radius = 1 } }, mass = { total = 2 } }";
    assert!(scene(&[body]).body[0].is_particles());
}

#[test]
fn words_need_no_quotes_but_mistakes_are_no_words() {
    for word in ["rk4", "symplectic-euler", "meshes/bunny.msh", "../x.msh", "3d.msh", "two words", "-", "e"] {
        assert!(set(GOOD, &[&format!("title={word}")]).is_ok(), "{word}");
    }
    for mistake in ["", " ", "1e", "1,5", "[1, 2", "{ a = 1", "\"abc", "'", "--1", "1\n[evil]", "a\u{1b}b"] {
        let failed = set(GOOD, &[&format!("time.step={mistake}")]).expect_err(mistake);
        assert_eq!(failed.problems()[0].kind, crate::ProblemKind::Override, "{mistake}");
    }
}

#[test]
fn paths_that_lead_nowhere() {
    for (text, message) in [
        ("=1", "`` is not a path of keys and indices joined by dots, like `body.0.mass.density`"),
        ("a..b=1", "`a..b` is not a path of keys and indices joined by dots, like `body.0.mass.density`"),
        ("body.1.name=x", "there is no `body.1`: `body` has 1 entry"),
        (
            "body.0.mesh.grid.cells.2=1",
            "there is no `body.0.mesh.grid.cells.2`: `body.0.mesh.grid.cells` has 2 entries",
        ),
        ("body.net.name=x", "no key `body.net.name`: `body` is a list of 1"),
        ("time.step.size=1", "no key `time.step.size`: `time.step` is a single value (float)"),
        ("time.0=1", "no key `time.0`: `time` is a table, whose keys are names"),
        ("0=1", "no key `0`: the scene is a table, whose keys are names"),
        ("body.0=1", "`body.0` is a table, and integer is not"),
    ] {
        let failed = set(GOOD, &[text]).expect_err(text);
        assert_eq!(failed.problems()[0].message, message);
        assert_eq!(failed.problems()[0].note.as_deref(), Some(&*format!("from `--set {text}`")));
    }
}

#[test]
fn mistakes_in_what_was_set_say_so() {
    let failed = set(GOOD, &["time.stpe=1"]).unwrap().scene().unwrap_err();
    let expected = "
error: unknown field `stpe`
 --> scene.toml:7:1
  |
7 | stpe = 1
  | ^^^^
  |
  = help: did you mean `step`?
  = help: fields here: `integrator`, `solver`, `step`, `adaptive`, `arc_length`, `duration`, `allow_unstable`
  = note: from `--set time.stpe=1`";
    assert_eq!(failed.to_string(), expected.trim_start());
    let failed = set(GOOD, &["time.step=-1"]).unwrap().scene().unwrap_err();
    assert_eq!(failed.problems()[0].note.as_deref(), Some("from `--set time.step=-1`"));
    // What was in the file before is not blamed on the override.
    let failed = set(&changed("60.0", "0"), &["time.step=-1"]).unwrap().scene().unwrap_err();
    assert_eq!(failed.problems()[1].note, None);
    // A text with a mistake in it is reported as such.
    let failed = set("step = ", &["time.step=1"]).unwrap_err();
    assert_eq!((failed.line(), failed.column()), (Some(1), Some(8)));
}

#[test]
fn scenes_made_from_tables_name_paths_in_place_of_lines() {
    let text = changed("[0.0, -9.8]", "[0.0, \"-9.8 * K\"]").replace("per_vertex = 1.0", "per_vertex = -1.0");
    let error = Source::new("<scene>", text).made_from_tables().scene().unwrap_err();
    let said = error.render(false);
    for part in [
        "error: world.gravity.1: `gravity`: unknown name `K`",
        "the value is \"-9.8 * K\"",
        "error: body.0.mass.per_vertex: `per_vertex` must be positive and finite, got -1",
    ] {
        assert!(said.contains(part), "{part} is not in\n{said}");
    }
    assert!(!said.contains("<scene>") && !said.contains(" | "), "{said}");
    assert!(error.problems().iter().all(|problem| problem.line.is_none() && problem.span.is_none()));
    let varied = Source::new("<scene>", GOOD).made_from_tables();
    let said = varied.varied(&[("time.step".into(), "-1".into())]).unwrap_err().to_string();
    assert!(
        said.starts_with("error: time.step: `step` must be positive and finite, got -1")
            && said.contains("from `time.step=-1`"),
        "{said}"
    );
}
