//! Messages as the user sees them.

use super::*;

fn picture(old: &str, new: &str) -> String {
    error(&changed(old, new)).to_string()
}

/// The text without the newlines that make it readable here.
fn golden(text: &str) -> &str {
    text.trim_matches('\n')
}

#[test]
fn syntax() {
    let expected = r"
error: invalid exponent, expected digits
 --> scene.toml:5:10
  |
5 | step = 1e
  |          ^
";
    assert_eq!(picture("step = 1e-3", "step = 1e"), golden(expected));
}

#[test]
fn unknown_field() {
    let expected = r"
error: unknown field `stifness`
  --> scene.toml:14:13
   |
14 | springs = { stifness = 100.0 }
   |             ^^^^^^^^
   |
   = help: did you mean `stiffness`?
   = help: fields here: `stiffness`, `young`, `expression`, `parameters`, `rest_length`
";
    assert_eq!(picture("stiffness", "stifness"), golden(expected));
}

#[test]
fn missing_field() {
    let expected = r"
error: [time] has neither `step` nor `adaptive`
 --> scene.toml:3:1
  |
3 | [time]
  | ^^^^^^
  |
  = help: give the time step [s], `step = 1e-3`
";
    assert_eq!(picture("step = 1e-3\n", ""), golden(expected));
}

#[test]
fn several_problems() {
    let text =
        changed("step = 1e-3", "step = -0.5").replace("spacing = 0.1", "spacing = 0.1, size = [1.0, 1.0]");
    let expected = r"
error: `step` must be positive and finite, got -0.5 [s]
 --> scene.toml:5:8
  |
5 | step = -0.5
  |        ^^^^

error: a grid takes exactly one of `spacing` [m] and `size` [m], both are given
  --> scene.toml:13:10
   |
13 | mesh = { grid = { cells = [2, 3], spacing = 0.1, size = [1.0, 1.0] } }
   |          ^^^^
   |
   = help: `spacing` is the edge of a cell, a number; `size` is that of the box, one number per dimension
";
    assert_eq!(error(&text).to_string(), golden(expected));
}

/// A byte-order mark, a tab before, wide letters and a tab inside, a carriage return after.
#[test]
fn unusual_text() {
    let expected = "
error: `dimension` takes a whole number, 0 or more, found the text `ü\u{1F600}\\tx`
 --> scene.toml:1:14
  |
1 |     dimension = 'ü\u{1F600}    x'  #ä
  |                 ^^^^^^^^^^

error: `time` takes a table with `integrator`, `solver`, `step`, `adaptive`, `arc_length`, `duration`, \
`allow_unstable`, found 3
 --> scene.toml:2:8
  |
2 | time = 3
  |        ^
";
    let text = "\u{feff}\tdimension = 'ü\u{1F600}\tx'  #ä\r\ntime = 3\r\n";
    assert_eq!(error(text).to_string(), golden(expected));
}

/// A file cannot drive the terminal that shows its errors.
#[test]
fn escape_sequences_are_shown_not_sent() {
    for text in [
        changed("\"net\"", "'\u{1b}[31mred'"),
        changed("\"net\"", r#""\u001b[31mred""#),
        changed("\"symplectic-euler\"", r#""\u001b[31mred""#),
        changed("name =", r#""\u001b[31mred" ="#),
    ] {
        assert!(!error(&text).render(false).contains('\u{1b}'), "{text}");
    }
    let problem = Problem::semantic("body.0.mass".parse().unwrap(), "bad\u{1b}").with_help("worse\u{1b}");
    assert!(!SceneError::new(vec![problem]).render(false).contains('\u{1b}'));
}

#[test]
fn colour_is_for_terminals_only() {
    let failed = error(&changed("1e-3", "-1"));
    assert!(failed.render(true).contains("\u{1b}["));
    assert!(!failed.to_string().contains('\u{1b}'));
}

#[test]
fn problems_without_a_text_show_their_path() {
    let failed =
        SceneError::new(vec![Problem::semantic("body.0.mass".parse().unwrap(), "vertex 3 has no mass")]);
    assert_eq!(failed.to_string(), "error: body.0.mass: vertex 3 has no mass");
    assert_eq!((failed.line(), failed.column()), (None, None));
    // What only the assembly finds out gets its place afterwards.
    let located = failed.locate(&Source::new("scene.toml", GOOD));
    assert_eq!((located.line(), located.column()), (Some(15), Some(8)));
}

#[test]
fn a_long_report_ends_with_a_count() {
    let problems = vec![Problem::semantic(Default::default(), "bad"); 53];
    let text = SceneError::new(problems).to_string();
    assert_eq!(text.matches("error: bad").count(), 50);
    assert!(text.ends_with("... and 3 more errors"));
}

#[test]
fn a_value_over_several_lines_is_shown_by_its_key() {
    let failed = error(&changed("[0.0, -9.8]", "[0,\n0,\n0]"));
    assert_eq!(
        failed.problems()[0].span.clone().map(|span| &failed.source_text().unwrap().text()[span]),
        Some("gravity")
    );
    let failed = error(&changed(
        "[0.0, -9.8]",
        "[0, 0]\nwalls = [{ normal = [0, 1], offset = 1 }, {\nnormal = [0, 1] }]",
    ));
    assert_eq!(briefly(&failed), ["10:43 world.walls.1.offset: missing field `offset` in `walls`"]);
}
