//! Frames for other programs.

use super::{Bench, SPRING};

/// With a recording of eleven frames.
fn recorded() -> Bench {
    let bench = Bench::new(SPRING);
    bench.pliant(["scene.toml", "-q"]).succeeded();
    bench
}

#[test]
fn a_folder_gets_a_series_and_its_collection() {
    let bench = recorded();
    bench
        .pliant(["export", "scene.mcap", "--to", "out/deep"])
        .succeeded()
        .prints(&["11 frames", "scene.pvd"]);
    let folder = bench.path("out/deep");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 12);
    let collection = std::fs::read_to_string(folder.join("scene.pvd")).unwrap();
    assert_eq!(collection.matches("<DataSet").count(), 11);
    assert!(collection.contains("timestep=\"0.5\" part=\"0\" file=\"scene_0005.vtu\""), "{collection}");
    assert!(folder.join("scene_0010.vtu").is_file());
    // Nothing is replaced unasked, and nothing written before that is known.
    bench
        .pliant(["export", "scene.mcap", "--to", "out/deep"])
        .ended_with(2)
        .says(&["scene_0000.vtu exists", "--force"]);
    bench.pliant(["export", "scene.mcap", "--to", "out/deep", "--force"]).succeeded();
    bench
        .pliant(["export", "scene.mcap", "--to", "out/deep", "--format", "obj", "--frames", "..:5"])
        .succeeded()
        .prints(&["3 frames to out/deep"]);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 15);
    assert!(!std::fs::read_dir(&folder).unwrap().any(|e| e.unwrap().path().extension().unwrap() == "part"));
}

#[test]
fn files_are_named_by_their_extension() {
    let bench = recorded();
    let json = bench.pliant(["export", "scene.mcap", "--to", "a.pvd", "--frames", "2..8:3", "--json"]);
    let json = json.succeeded().json();
    assert_eq!(
        (json["exported"]["frames"].as_u64(), &json["exported"]["collection"]),
        (Some(2), &"a.pvd".into())
    );
    bench.pliant(["export", "scene.mcap", "--to", "last.vtu", "--frames", "10", "-q"]).succeeded();
    bench.pliant(["export", "scene.mcap", "--to", "one.obj", "--frames", "0..1"]).succeeded();
    assert_eq!(bench.files(), ["a.pvd", "a_0002.vtu", "a_0005.vtu", "last.vtu", "one.obj", "scene.mcap"]);
    let text = std::fs::read_to_string(bench.path("one.obj")).unwrap();
    assert!(text.contains("o pair\nv 0.0 0.0 0.0\nv 1.1 0.0 0.0\nl 1 2"), "{text}");
}

#[test]
fn what_cannot_be_written_or_read_is_said() {
    let bench = recorded();
    let export = |arguments: &[&str]| bench.pliant([&["export"], arguments].concat());
    export(&["nothing.mcap", "--to", "out"]).ended_with(2).says(&["cannot read nothing.mcap"]);
    export(&["scene.toml", "--to", "out"]).ended_with(2).says(&["not an MCAP file"]);
    export(&["scene.mcap"]).ended_with(2).says(&["--to"]);
    export(&["scene.mcap", "--to", "a.vtu"])
        .ended_with(2)
        .says(&["holds one frame, not 11 frames", "--frames N"]);
    export(&["scene.mcap", "--to", "a.vtu", "--format", "obj"]).ended_with(2).says(&["--format"]);
    export(&["scene.mcap", "--to", "scene.toml"]).ended_with(2).says(&["scene.toml ends in .toml", "folder"]);
    export(&["scene.mcap", "--to", "no/a.pvd"]).ended_with(1).says(&["cannot write no/a_0000.vtu"]);
    export(&["scene.mcap", "--to", "scene.mcap/out"]).ended_with(1).says(&["cannot write scene.mcap/out"]);
    for (frames, message) in [
        ("11", "has no frame 11: it has 11 frames, 0 to 10"),
        ("0..12", "has no frame 11"),
        ("20..", "has no frame 20"),
        ("5..5", "the range is empty"),
        ("0..5:0", "the stride must be 1 or more"),
        ("x", "`x` is not a frame"),
        ("-1", "`-1` is not a frame"),
        ("3:2", "a stride needs a range"),
    ] {
        export(&["scene.mcap", "--to", "out", "--frames", frames]).ended_with(2).says(&[message]);
    }
    let bytes = std::fs::read(bench.path("scene.mcap")).unwrap();
    std::fs::write(bench.path("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    export(&["cut.mcap", "--to", "out"]).ended_with(2).says(&["cut.mcap is not finished", "recover"]);
    assert_eq!(bench.files(), ["cut.mcap", "scene.mcap"], "nothing is left behind");
    // A recording without positions.
    let silent = SPRING.replace("rate = 10.0", "rate = 10.0\nchannels = [\"energy\"]");
    let bench = Bench::new(&silent);
    bench.pliant(["scene.toml", "-q"]).succeeded();
    bench.pliant(["export", "scene.mcap", "--to", "out"]).ended_with(2).says(&["no channel /state"]);
}
