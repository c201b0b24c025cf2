//! The commands that do not run anything.

use super::{Bench, SPRING};

#[test]
fn check_says_what_is_used_and_what_is_left_out() {
    let bench = Bench::new(SPRING);
    let ended = bench.pliant(["check", "scene.toml"]).succeeded();
    let (uses, left_out) = ended.stdout.split_once("\ninactive\n").unwrap();
    assert!(
        uses.contains("2 vertices") && uses.contains("velocity-verlet") && uses.contains("500 steps"),
        "{uses}"
    );
    assert!(uses.contains("- springs") && !uses.contains("- uniform gravity"), "{uses}");
    assert!(left_out.contains("finite elements") && left_out.contains("uniform gravity"), "{left_out}");
    let json = bench.pliant(["check", "scene.toml", "--json"]).succeeded().json();
    assert_eq!((json["report"]["vertices"].as_u64(), json["report"]["mass"].as_f64()), (Some(2), Some(2.0)));
    assert!(bench.files().is_empty());
}

// lecture 8.
#[test]
fn check_reports_the_force_error_of_a_tree() {
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let text = std::fs::read_to_string(scenes.join("galaxy_merger.toml")).unwrap();
    let bench = Bench::new(&text.replace("count = 1500", "count = 300"));
    let text = bench.pliant(["check", "scene.toml"]).succeeded().stdout;
    assert!(text.contains("256 particles against the sum over all pairs"), "{text}");
    assert!(text.contains("mutual gravity of particles, by a tree of opening angle 0.5"), "{text}");
    let rms = |set: &str| {
        let json = bench.pliant(["check", "scene.toml", "--json", "--set", set]).succeeded().json();
        json["report"]["tree_force_error"]["relative_rms"].as_f64().unwrap()
    };
    let (coarse, fine) =
        (rms("world.nbody.tree.opening_angle=0.8"), rms("world.nbody.tree.opening_angle=0.2"));
    assert!(fine > 0.0 && coarse > 10.0 * fine && coarse < 0.02, "{coarse:e}, {fine:e}");
}

#[test]
fn list_shows_every_registry() {
    let bench = Bench::new(SPRING);
    let text = bench.pliant(["list"]).succeeded().stdout;
    let json = bench.pliant(["list", "--json"]).succeeded().json();
    for (family, some) in [
        ("integrators", &["symplectic-euler", "rk4", "yoshida4"][..]),
        ("materials", &["corotated", "neo-hookean"]),
        ("presets", &["silicone", "steel"]),
        ("elements", &["triangle", "tetrahedron", "spring"]),
        ("meshes", &["grid", "cloth", "file"]),
        ("channels", &["state", "mesh", "energy"]),
    ] {
        let names: Vec<&str> =
            json[family].as_array().unwrap().iter().map(|i| i["name"].as_str().unwrap()).collect();
        for name in some {
            assert!(names.contains(name), "{family}: {names:?}");
        }
        for name in &names {
            assert!(text.contains(&format!("\n  {name}\n")), "{name}");
        }
        let alone = bench.pliant(["list", family]).succeeded().stdout;
        assert!(text.contains(alone.trim()), "{alone}");
    }
    // Nothing is wider than a terminal of unknown width.
    assert!(text.lines().all(|line| line.chars().count() <= 100));
}

#[test]
fn every_listed_integrator_and_material_runs() {
    let bench = Bench::new(SPRING);
    let json = bench.pliant(["list", "--json"]).succeeded().json();
    for integrator in json["integrators"].as_array().unwrap() {
        let set = format!("time.integrator={}", integrator["name"].as_str().unwrap());
        let arguments =
            ["scene.toml", "--no-record", "--set", &set, "--set", "time.step=1e-5", "--until", "1e-3"];
        bench.pliant(arguments).succeeded();
    }
    for material in json["materials"].as_array().unwrap() {
        let table = serde_json::json!({ material["name"].as_str().unwrap(): material["example"] });
        let elastic = table.to_string().replace(':', " =");
        let set = format!("body.0.elastic={elastic}");
        let mesh = "body.0.mesh={ grid = { cells = [2, 2], spacing = 1.0 } }";
        bench
            .pliant(["check", "scene.toml", "--set", &set, "--set", mesh, "--set", "time.step=1e-5"])
            .succeeded();
    }
}

#[test]
fn info_describes_a_recording() {
    let bench = Bench::new(SPRING);
    bench.pliant(["scene.toml"]).succeeded();
    bench.pliant(["info", "scene.mcap"]).succeeded().prints(&[
        "complete",
        "11, t = 0 to 1 s",
        "/state",
        "pair",
    ]);
    bench.pliant(["info", "scene.toml"]).ended_with(2).says(&["not an MCAP file"]);
    bench.pliant(["info", "."]).ended_with(2).says(&["directory"]);
    bench.pliant(["info", "missing.mcap"]).ended_with(2).says(&["cannot read missing.mcap"]);
    bench.pliant(["recover", "missing.mcap.part"]).ended_with(2).says(&["cannot read missing.mcap.part"]);
    std::fs::write(bench.path("text.part"), "no recording").unwrap();
    bench.pliant(["recover", "text.part"]).ended_with(2).says(&["not an MCAP file"]);
}

#[test]
fn schema_is_a_json_schema_of_scenes() {
    let schema = Bench::new(SPRING).pliant(["schema"]).succeeded().json();
    assert!(schema["$schema"].as_str().unwrap().contains("json-schema.org"));
    assert!(schema["properties"]["time"].is_object());
}
