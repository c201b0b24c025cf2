//! Files, writing, and the schema.

use super::*;
use crate::ProblemKind;
use crate::schema;

#[test]
fn a_scene_knows_where_its_files_are() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("net.toml");
    std::fs::write(&path, GOOD).unwrap();
    let scene = Scene::from_path(&path).unwrap();
    assert_eq!(scene.resolve("bunny.msh".as_ref()), directory.path().join("bunny.msh"));
    assert_eq!(
        Scene::from_toml(GOOD).unwrap().resolve("bunny.msh".as_ref()),
        std::path::Path::new("bunny.msh")
    );
    std::fs::write(&path, GOOD.replace("1e-3", "x")).unwrap();
    let failed = Scene::from_path(&path).unwrap_err();
    assert!(failed.to_string().contains("net.toml:5:8"), "{failed}");
}

#[test]
fn files_that_are_no_text() {
    let directory = tempfile::tempdir().unwrap();
    let failed = Scene::from_path(directory.path().join("none.toml")).unwrap_err();
    assert_eq!(failed.problems()[0].kind, ProblemKind::Unreadable);
    assert!(failed.to_string().contains("none.toml"));
    let path = directory.path().join("latin1.toml");
    for (bytes, line, column) in [
        (&b"# \n\tx = 'm\xfcller'"[..], 2, 8),
        (b"\xef\xbb\xbf'\xff", 1, 2),
        (b"\xff\xfed\0", 1, 1),
        (b"ab\xc3", 1, 3),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let failed = Scene::from_path(&path).unwrap_err();
        assert_eq!((failed.line(), failed.column()), (Some(line), Some(column)), "{failed}");
        assert_eq!(failed.problems()[0].kind, ProblemKind::Syntax);
    }
}

#[test]
fn what_is_written_reads_the_same() {
    let full = changed(
        "[0.0, -9.8]",
        "[0.0, -9.8]\nether_drag = 0.1\nwalls = [{ normal = [0, 1], offset = \
                                       -1 }]",
    )
    .replace(SPRINGS, "{ young = 5, rest_length = [1, 2, 3] }")
    .replace(
        PIN,
        "[{ vertices = [1, 2] }, { half_space = { normal = [1, 0], offset = 0 } }]\nvelocity \
                       = { rigid = { linear = [1, 2], angular = 3 } }",
    );
    for text in [GOOD, &full] {
        let scene = read(text).unwrap();
        let written = scene.to_toml().unwrap();
        assert_eq!(
            Source::new("scene.toml", &written).scene().unwrap_or_else(|e| panic!("{e}")),
            scene,
            "{written}"
        );
    }
}

#[cfg(unix)]
#[test]
fn what_toml_cannot_hold_is_an_error() {
    use std::os::unix::ffi::OsStrExt;
    let mut scene = read(&changed(MESH, "{ file = { path = 'x.msh' } }")).unwrap();
    if let crate::MeshSpec::File(file) = &mut scene.body[0].mesh {
        file.path = std::ffi::OsStr::from_bytes(b"\xff.msh").into();
    }
    assert_eq!(scene.to_toml().unwrap_err().problems()[0].kind, ProblemKind::Unwritable);
}

#[test]
fn the_schema_has_ranges_and_documentation() {
    let schema = schema();
    let at =
        |pointer: &str| schema.as_value().pointer(pointer).unwrap_or_else(|| panic!("no {pointer}")).clone();
    assert_eq!(at("/properties/dimension/minimum"), 2);
    assert_eq!(at("/$defs/Time/properties/step/exclusiveMinimum"), 0.0);
    assert_eq!(
        at("/$defs/Time/properties/step/description"),
        "Time step [s]. A scene has one of this, `adaptive` and `arc_length`."
    );
    assert_eq!(at("/$defs/Time/additionalProperties"), false);
    assert_eq!(at("/$defs/World/properties/gravity/maxItems"), 3);
    assert_eq!(at("/$defs/Time/properties/duration/type"), serde_json::json!(["number", "string"]));
    let per_vertex = "/$defs/MassSpec/oneOf/1/properties/per_vertex/anyOf";
    assert_eq!(at(&format!("{per_vertex}/0/unit")), "kg");
    assert_eq!(at(&format!("{per_vertex}/1/items/unit")), "kg");
    assert!(schema.as_value().pointer("/properties/directory").is_none());
}
