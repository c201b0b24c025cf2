//! Nothing that a user can type makes the reader panic.

use proptest::prelude::*;

use super::*;

/// Reads, renders, sets: whatever comes out. Places must lie in the text.
fn survive(text: &str) {
    let source = Source::new("scene.toml", text);
    if let Err(failed) = source.scene() {
        let _ = failed.render(true);
        for problem in failed.problems() {
            let span = problem.span.clone().expect("every problem of a text has a place");
            assert!(source.text().get(span).is_some());
            assert!(problem.line >= Some(1) && problem.column >= Some(1));
        }
    }
    if let Ok(set) = source.with_overrides(&[("body.0.mesh.grid.cells.1".to_owned(), "3".to_owned())]) {
        let _ = set.scene();
    }
}

/// Texts that reach deep: `GOOD` with pieces cut, doubled, or replaced by pieces that mean something.
fn mutated() -> impl Strategy<Value = String> {
    let piece = prop::sample::select(vec![
        "",
        "0",
        "-1",
        "nan",
        "inf",
        "1e999",
        "[",
        "]",
        "{",
        "}",
        "'",
        "\"",
        "=",
        ",",
        ".",
        "\n",
        "\r\n",
        "\t",
        "\u{feff}",
        "ü\u{1F600}",
        "[[body]]\n",
        "[world]\n",
        "body.0",
        "disk",
        "true",
        "2026-01-01",
        "[[",
        "{}",
        "[]",
        "#",
        "\u{1b}",
    ]);
    let edit = (0..GOOD.len(), 0_usize..12, piece);
    prop::collection::vec(edit, 1..4).prop_map(|edits| {
        let mut text = GOOD.to_owned();
        for (at, length, piece) in edits {
            let floor = |mut offset: usize| {
                offset = offset.min(text.len());
                while !text.is_char_boundary(offset) {
                    offset -= 1;
                }
                offset
            };
            let (start, end) = (floor(at), floor(at + length));
            text.replace_range(start..end, piece);
        }
        text
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text(text in any::<String>()) {
        survive(&text);
    }

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        survive(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn nearly_a_scene(text in mutated()) {
        survive(&text);
    }

    #[test]
    fn any_override(path in "[a-z0-9.]{0,20}|.{0,20}|(time|body)(\\.(0|1|step|mesh|grid|cells|pin)){0,4}", value in "\\PC{0,20}|[0-9e.+-]{1,5}|.{0,10}") {
        if let Ok(source) = Source::new("scene.toml", GOOD).with_overrides(&[(path, value)]) {
            survive(source.text());
        }
    }

    #[test]
    fn any_numbers(
        dimension in 0_usize..6,
        numbers in prop::collection::vec(any::<f64>(), 0..6),
        counts in prop::collection::vec(any::<u32>(), 0..6),
    ) {
        let numbers: Vec<String> = numbers.iter().map(|number| format!("{number:?}").to_lowercase()).collect();
        let (list, counts) = (format!("{numbers:?}").replace('"', ""), format!("{counts:?}"));
        for mesh in [
            format!("{{ grid = {{ cells = {counts}, size = {list}, origin = {list} }} }}"),
            format!("{{ cloth = {{ cells = [1, 2], origin = {list}, u = {list}, v = {list} }} }}"),
            format!("{{ inline = {{ points = [{list}, {list}], edges = [[0, 1], [2, 3]] }} }}"),
        ] {
            let text = changed(MESH, &mesh)
                .replace("dimension = 2", &format!("dimension = {dimension}"))
                .replace(SPRINGS, &format!("{{ stiffness = {list}, rest_length = {list} }}"))
                .replace(PIN, &format!("[{{ vertices = {counts} }}]\nvelocity = {{ rigid = {{ angular = \
                                        {list} }} }}"));
            survive(&text);
        }
    }
}
