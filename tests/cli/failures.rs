//! Runs that cannot go on.

use super::{Bench, SPRING, logged};

/// A tetrahedron that two steps turn inside out: its tip flies through its base.
pub(super) const PIERCED: &str = r#"
dimension = 3
[time]
integrator = "symplectic-euler"
step = 1e-3
duration = 1.0
[[body]]
name = "tet"
mesh = { inline = { points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], tetrahedra = [[0, 1, 2, 3]] } }
elastic = { neo-hookean = { young = 1.0, poisson = 0.3 } }
mass = { per_vertex = 1.0 }
velocity = { per_vertex = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -400.0]] }
[output]
rate = 1000.0
"#;

#[test]
fn a_step_that_cannot_be_taken_is_named() {
    let bench = Bench::new(PIERCED);
    let ended = bench.pliant(["scene.toml"]).ended_with(1);
    let ended = ended.says(&["error: step ", "element 0 of `tet` has J = -", "smaller step"]);
    ended
        .says(&["scene.mcap is complete up to t = ", "the last good frame"])
        .prints(&["ended early", "rerun"]);
    assert_eq!(bench.files(), ["scene.mcap"]);
    let info = bench.info("scene.mcap");
    assert_eq!(
        (info["state"].as_str(), info["outcome"]["status"].as_str()),
        (Some("complete"), Some("failed"))
    );
    assert!(info["frames"].as_u64().unwrap() >= 2, "{info}");
    assert!(info["outcome"]["message"].as_str().unwrap().contains("element 0 of `tet`"), "{info}");
    assert!(logged(&bench.path("scene.mcap")).iter().any(|message| message.contains("element 0 of `tet`")));
}

#[test]
fn a_failure_is_json_too() {
    let json = Bench::new(PIERCED).pliant(["scene.toml", "--json"]).ended_with(1).json();
    assert_eq!(json["status"], "failed");
    assert_eq!(json["problems"][0]["kind"], "not_finite");
    assert_eq!(json["file"], "scene.mcap");
    assert!(json["summary"]["time"].as_f64().unwrap() > 0.0, "{json}");
    // Of the element at rest it is 1: lanes that only fill up a pack must not show.
    assert_eq!(json["summary"]["start"]["min_j"], 1.0);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_reported() {
    use std::process::{Command, Stdio};
    // A limit on the size of files stands for a full disk: the shell sets it, in blocks of 512 or 1024 bytes.
    let bench = Bench::new(
        &super::SPRING.replace("rate = 10.0", "rate = 100.0").replace("duration = 1.0", "duration = 100.0"),
    );
    let script = format!("ulimit -f 200; trap '' XFSZ; exec {} scene.toml", super::PLIANT);
    let mut command = Command::new("sh");
    command.args(["-c", &script]).current_dir(bench.directory.path()).stdin(Stdio::null());
    let ended: super::Ended = command.output().unwrap().into();
    let ended = ended.ended_with(1).says(&["cannot write scene.mcap.part at frame ", "pliant recover"]);
    let promised = ended.stderr.split_once(" at frame ").unwrap().1.split_once(':').unwrap().0;
    bench.pliant(["recover", "scene.mcap.part"]).succeeded();
    let kept = bench.info("scene.mcap")["frames"].as_u64().unwrap();
    assert!(kept > 10 && kept >= promised.parse().unwrap(), "{kept} frames of {promised}");
}

#[test]
fn a_path_deeper_than_any_scene_is_refused() {
    let bench = Bench::new(super::SPRING);
    let path = vec!["a"; 10_000].join(".");
    let ended = bench.pliant(["check", "scene.toml", "--set", &format!("{path}=1")]).ended_with(2);
    let ended = ended.says(&["`a.a.a.", "leads 10000 steps down; no key of a scene is deeper than 32"]);
    assert!(ended.stderr.len() < 500, "{}", ended.stderr);
    // What is deep without a path: lists, tables, and keys with dots in tables in each other.
    let lists = format!("a={}{}", "[".repeat(10_000), "]".repeat(10_000));
    let tables = format!("a={}1{}", "{ a = ".repeat(10_000), " }".repeat(10_000));
    let dotted = format!("a={}1{}", format!("{{ {} = ", vec!["a"; 79].join(".")).repeat(79), " }".repeat(79));
    for value in [&lists, &tables, &dotted] {
        bench.pliant(["check", "scene.toml", "--set", value]).ended_with(2);
        std::fs::write(bench.path("deep.toml"), value).unwrap();
        bench.pliant(["check", "deep.toml"]).ended_with(2);
    }
    std::fs::write(bench.path("deep.toml"), format!("{path} = 1")).unwrap();
    bench.pliant(["check", "deep.toml"]).ended_with(2);
}

#[test]
#[cfg(unix)]
fn what_is_no_regular_file_is_not_read() {
    let bench = Bench::new(super::SPRING);
    let made = std::process::Command::new("mkfifo").arg(bench.path("pipe")).status().unwrap();
    assert!(made.success());
    // Opening the pipe would wait for ever, reading the device to its end too.
    for command in ["run", "check", "modes", "study", "stability"] {
        bench.pliant([command, "pipe"]).ended_with(2).says(&["cannot read pipe", "named pipe"]);
        bench.pliant([command, "/dev/zero"]).ended_with(2).says(&["cannot read /dev/zero", "device"]);
    }
    for command in ["info", "recover"] {
        bench.pliant([command, "pipe"]).ended_with(2).says(&["pipe"]);
    }
    bench.pliant(["export", "pipe", "--to", "out"]).ended_with(2).says(&["pipe"]);
}

#[test]
fn a_terminal_is_not_given_orders_by_titles_and_names() {
    let title = r#"title = "\u001b]0;owned\u0007 \u009b2J \u202e""#;
    let bench = Bench::new(&format!("{title}\n{}", super::SPRING));
    let shown = r"\u{1b}]0;owned\u{7} \u{9b}2J \u{202e}";
    bench.pliant(["check", "scene.toml"]).succeeded().prints(&[shown]);
    bench.pliant(["run", "scene.toml", "--verbose"]).succeeded().says(&[shown]);
    bench.pliant(["info", "scene.mcap"]).succeeded().prints(&[shown]);
    let title = bench.pliant(["check", "scene.toml", "--json"]).succeeded().json()["report"]["title"].clone();
    assert_eq!(title, "\u{1b}]0;owned\u{7} \u{9b}2J \u{202e}", "documents hold what is there");
    #[cfg(unix)]
    for color in ["always", "never"] {
        let name = "\u{1b}[2J.toml";
        std::fs::write(bench.path(name), "dimension = 'x'").unwrap();
        for arguments in [["check", name], ["info", name], ["check", "\u{1b}[2J"]] {
            let ended = bench.pliant(arguments.into_iter().chain(["--color", color])).ended_with(2);
            assert!(!ended.stderr.contains("\u{1b}[2J"), "{:?}", ended.stderr);
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn standard_output_that_takes_nothing_is_reported() {
    use std::process::Command;
    let bench = Bench::new(PIERCED);
    let script = format!("exec {} list > /dev/full", super::PLIANT);
    let output =
        Command::new("sh").args(["-c", &script]).current_dir(bench.directory.path()).output().unwrap();
    super::Ended::from(output).ended_with(1).says(&["cannot write to standard output"]);
}

/// Energies of 5e309 J are no numbers, and nothing is said in parts of them.
#[test]
fn energies_beyond_all_numbers_are_told_in_words() {
    let heavy = SPRING.replace("per_vertex = 1.0", "per_vertex = 1e300");
    let bench =
        Bench::new(&heavy.replace("[output]", "velocity = { rigid = { linear = [1e5, 0.0] } }\n[output]"));
    let ended = bench.pliant(["run", "scene.toml"]);
    ended.says(&[]).prints(&["more than 1.797e308 J", "its drift is unknown"]);
    let ended = bench.pliant(["run", "scene.toml", "--force"]);
    for told in [&ended.stdout, &ended.stderr] {
        assert!(!told.contains("inf J") && !told.contains("NaN"), "{told}");
    }
}

/// A sheet that its weight stretches to twice its length, and no advice to hold it better.
#[test]
fn a_sheet_that_gets_too_thin_is_told_with_materials_that_do_not() {
    let hangs = |material: &str, integrator: &str| {
        format!(
            "dimension = 3\ntime = {{ integrator = \"{integrator}\", step = 0.02, duration = 1.0 }}\n\
             world = {{ gravity = [\"400*t\", 0, -1] }}\n\
             [[body]]\nname = \"sheet\"\n\
             mesh = {{ cloth = {{ cells = [4, 4], origin = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0] }} }}\n\
             membrane = {{ thickness = 1e-3 }}\nelastic = {{ {material} = {{ young = 1e5, poisson = 0.3 }} \
             }}\n\
             mass = {{ density = 1000 }}\npin = [{{ half_space = {{ normal = [1, 0, 0], offset = 0.001 }} \
             }}]\n"
        )
    };
    for (material, integrator) in
        [("stvk", "implicit-euler"), ("stvk", "quasi-static"), ("corotated", "implicit-euler")]
    {
        let ended = Bench::new(&hangs(material, integrator)).pliant(["run", "scene.toml"]).ended_with(1);
        let ended = ended.says(&[
            "of `sheet` is stretched",
            "`stable-neo-hookean` withstand any stretch",
            "use a material",
        ]);
        assert!(!ended.stderr.contains("support every body"), "{}", ended.stderr);
    }
    Bench::new(&hangs("stable-neo-hookean", "implicit-euler")).pliant(["run", "scene.toml"]).succeeded();
}

/// What a material is taken for already is no advice.
#[test]
fn an_inverted_element_is_met_with_another_material_only_where_it_helps() {
    let of = |material: &str| {
        let scene = format!(
            "dimension = 2\ntime = {{ integrator = 'symplectic-euler', step = 2e-3, duration = 5.0, \
             allow_unstable = true }}\nworld = {{ gravity = [0, -9.81] }}\n[[body]]\nname = 'block'\n\
             mesh = {{ grid = {{ cells = [8, 2], size = [0.4, 0.1] }} }}\nmass = {{ density = 1000 }}\n\
             elastic = {{ {material} = {{ young = 1e7, poisson = 0.3 }} }}\n\
             pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }} }}]\n"
        );
        Bench::new(&scene).pliant(["run", "scene.toml"]).ended_with(1).stderr
    };
    let (forbids, allows) = (of("neo-hookean"), of("stable-neo-hookean"));
    assert!(forbids.contains("such as stable-neo-hookean"), "{forbids}");
    assert!(!allows.contains("such as stable-neo-hookean") && !allows.contains("inf"), "{allows}");
}
