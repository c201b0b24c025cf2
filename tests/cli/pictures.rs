//! Pictures, charts and exports of whole recordings.
//!
//! `tests/data/pictures` has small pictures that are compared within a tolerance. A change that is meant is
//! recorded by `PLIANT_RECORD_PICTURES=1 cargo test --test pliant pictures`, and can be looked at there.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{Bench, SPRING};

/// A soft ball above a floor, and a strand beside it.
const BALL: &str = r#"
title = "A ball & a <strand>"
dimension = 3
[time]
integrator = "symplectic-euler"
step = 1e-3
duration = 0.2
[world]
gravity = [0.0, 0.0, -9.81]
walls = [{ normal = [0.0, 0.0, 1.0], offset = 0.0 }]
[[body]]
name = "ball"
mesh = { ball = { radius = 0.5, cells = 2 } }
transform = { translate = [0.0, 0.0, 0.8] }
elastic = { stable-neo-hookean = { young = 1e4, poisson = 0.3 } }
mass = { density = 1000.0 }
[[body]]
name = "strand"
mesh = { strand = { segments = 6, start = [0.9, 0.0, 1.2], end = [1.6, 0.0, 1.2] } }
springs = { stiffness = 200.0 }
mass = { per_vertex = 0.1 }
[output]
rate = 20.0
"#;

/// Two bodies about each other.
const ORBIT: &str = r#"
dimension = 3
[time]
integrator = "velocity-verlet"
step = 0.01
duration = 4.0
[world]
nbody = { constant = 1.0 }
[[body]]
name = "heavy"
mesh = { inline = { points = [[0.0, 0.0, 0.0]] } }
mass = { per_vertex = 1.0 }
[[body]]
name = "light"
mesh = { inline = { points = [[1.0, 0.0, 0.0]] } }
mass = { per_vertex = 0.01 }
velocity = { per_vertex = [[0.0, 0.9, 0.2]] }
[output]
rate = 10.0
"#;

fn recorded(scene: &str) -> Bench {
    let bench = Bench::new(scene);
    bench.pliant(["scene.toml", "-q"]).succeeded();
    bench
}

/// Width, height and bytes of a PNG, red, green, blue.
fn pixels(file: &[u8]) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(Cursor::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    bytes.truncate(info.buffer_size());
    (info.width, info.height, bytes)
}

/// Compares a picture with the stored one: rims may move by roundings of single precision, surfaces not.
#[track_caller]
fn assert_pictured(bench: &Bench, name: &str) {
    let made = std::fs::read(bench.path(&format!("{name}.png"))).unwrap();
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/pictures");
    let stored = stored.join(format!("{name}.png"));
    if std::env::var_os("PLIANT_RECORD_PICTURES").is_some() {
        std::fs::create_dir_all(stored.parent().unwrap()).unwrap();
        std::fs::write(&stored, &made).unwrap();
    }
    let (made, expected) = (pixels(&made), pixels(&std::fs::read(&stored).unwrap()));
    assert_eq!((made.0, made.1), (expected.0, expected.1));
    let differences = made.2.iter().zip(&expected.2).map(|(a, b)| a.abs_diff(*b));
    let far = differences.filter(|difference| *difference > 12).count();
    assert!(far * 200 < made.2.len(), "{far} of {} bytes of {name} differ", made.2.len());
}

#[test]
fn pictures_of_solids_strands_and_floors_are_the_stored_ones() {
    let bench = recorded(BALL);
    let render =
        |more: &[&str]| bench.pliant([&["render", "scene.mcap", "--size", "160x120"], more].concat());
    render(&["-o", "ball.png"]).succeeded().prints(&["1 frame to ball.png"]);
    render(&[
        "-o",
        "ball_dark.png",
        "--theme",
        "dark",
        "--colour-by",
        "speed",
        "--at",
        "0.1s",
        "--range",
        "0,2",
    ])
    .succeeded();
    render(&["-o", "ball_sheet.png", "--frames", "4", "--camera=-60,40,1.2"])
        .succeeded()
        .prints(&["4 frames"]);
    for name in ["ball", "ball_dark", "ball_sheet"] {
        assert_pictured(&bench, name);
    }
}

#[test]
fn pictures_of_orbits_and_plane_scenes_are_the_stored_ones() {
    let bench = recorded(ORBIT);
    bench.pliant(["render", "scene.mcap", "-o", "orbit.png", "--size", "160x120"]).succeeded();
    assert_pictured(&bench, "orbit");
    let bench = recorded(SPRING);
    bench.pliant(["render", "scene.mcap", "-o", "spring.png", "--size", "160x120", "--bare"]).succeeded();
    assert_pictured(&bench, "spring");
}

#[test]
fn an_animation_has_its_frames() {
    let bench = recorded(BALL);
    let arguments = ["render", "scene.mcap", "-o", "a.gif", "--frames", "4", "--size", "96x72", "--json"];
    let json = bench.pliant(arguments).succeeded().json();
    assert_eq!(json["rendered"]["frames"], 4);
    // Control extensions.
    let file = std::fs::read(bench.path("a.gif")).unwrap();
    assert_eq!(file.windows(3).filter(|window| *window == [0x21, 0xf9, 0x04]).count(), 4);
}

#[test]
fn what_cannot_be_drawn_is_said_with_what_can() {
    let bench = recorded(SPRING);
    let render = |more: &[&str]| bench.pliant([&["render", "scene.mcap"], more].concat());
    render(&["-o", "a.jpg"]).ended_with(2).says(&["a.jpg", ".png, .gif or .svg"]);
    render(&["-o", "a.png", "--colour-by", "heat"])
        .ended_with(2)
        .says(&["heat", "body, speed, displacement"]);
    render(&["-o", "f%04d.png"]).ended_with(2).says(&["f%04d.png", "--frames N", "--at TIME"]);
    render(&["-o", "a.svg", "--frames", "3"]).ended_with(2).says(&["one frame", "--at"]);
    render(&["-o", "a.png", "--size", "9x9"]).ended_with(2).says(&["640x480", "32 to 4096"]);
    render(&["-o", "a.png", "--range", "2,1"]).ended_with(2).says(&["the lower first"]);
    render(&["-o", "a.png", "--camera", "1,2,0"]).ended_with(2).says(&["25,15"]);
    render(&["-o", "a.png", "-q"]).succeeded();
    render(&["-o", "a.png"]).ended_with(2).says(&["a.png exists", "--force"]);
    bench.pliant(["plot", "scene.mcap", "-o", "a.txt"]).ended_with(2).says(&[".svg or .png"]);
    bench
        .pliant(["plot", "scene.mcap", "--quantity", "min-J"])
        .ended_with(2)
        .says(&["no numbers of elements"]);
    bench.pliant(["plot", "scene.mcap", "--quantity", "probes"]).ended_with(2).says(&["[[probe]]"]);
    assert_eq!(bench.files(), ["a.png", "scene.mcap"]);
    // No pattern.
    render(&["-o", "at 50%.png", "-q"]).succeeded();
}

#[test]
fn a_measure_of_several_numbers_is_told_with_their_names() {
    let bench = recorded(
        "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 1e-4, duration = 1e-3 }\n\
         output = { rate = 1e3, channels = ['state', 'principal-stretches'] }\n[[body]]\n\
         mesh = { grid = { cells = [2, 2], size = [1, 1] } }\nmass = { density = 1.0 }\n\
         elastic = { neo-hookean = { young = 1e3, poisson = 0.3 } }\n",
    );
    let render = |by: &str| bench.pliant(["render", "scene.mcap", "-q", "-o", "a.png", "--colour-by", by]);
    let told = ["more than one number", "`principal-stretches 1`, `principal-stretches 2`"];
    render("principal-stretches").ended_with(2).says(&told);
    render("principal-stretches 1").succeeded();
}

#[test]
fn pictures_and_exports_have_the_stress_at_nodes() {
    let bench = recorded(
        "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 1e-4, duration = 1e-3 }\n\
         output = { rate = 1e3, channels = ['state', 'nodal-von-mises', 'nodal-stress', 'zz'] }\n[[body]]\n\
         mesh = { grid = { cells = [2, 2], size = [1, 1] } }\nmass = { density = 1.0 }\n\
         elastic = { neo-hookean = { young = 1e3, poisson = 0.3 } }\n\
         position = { affine = { matrix = [[1.1, 0.0], [0.0, 1.0]] } }\n",
    );
    for by in ["nodal-von-mises", "nodal-stress xy", "zz"] {
        bench.pliant(["render", "scene.mcap", "-q", "-o", "a.svg", "--colour-by", by]).succeeded();
        let svg = std::fs::read_to_string(bench.path("a.svg")).unwrap();
        let unit = if by == "zz" { "sqrt(J)" } else { "Pa" };
        assert!(svg.contains(&format!("{by} [{unit}]")), "{by}");
        std::fs::remove_file(bench.path("a.svg")).unwrap();
    }
    bench.pliant(["view", "scene.mcap", "--no-open", "-o", "a.html"]).succeeded();
    bench.pliant(["export", "scene.mcap", "--to", "a.vtu", "--frames", "0"]).succeeded();
    let vtu = std::fs::read_to_string(bench.path("a.vtu")).unwrap();
    for name in ["nodal-von-mises", "nodal-stress", "principal-1", "principal-3", "zz"] {
        assert_eq!(vtu.matches(&format!("Name=\"{name}\"")).count(), 1, "{name}");
    }
}

#[test]
fn titles_are_text_in_svg() {
    let bench = recorded(BALL);
    bench.pliant(["render", "scene.mcap", "-o", "a.svg", "-q"]).succeeded();
    let svg = std::fs::read_to_string(bench.path("a.svg")).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let texts = document.descendants().filter(|node| node.has_tag_name("text") || node.has_tag_name("title"));
    assert!(texts.clone().any(|node| node.text() == Some("A ball & a <strand>")));
    assert!(document.descendants().filter(|node| node.has_tag_name("path")).count() > 50);
}

#[test]
fn walls_and_the_color_bar_are_in_svg() {
    let bench = recorded(BALL);
    let paths = |options: &[&str]| {
        let line = ["render", "scene.mcap", "-o", "a.svg", "-q", "--force"];
        bench.pliant(line.iter().chain(options)).succeeded();
        let svg = std::fs::read_to_string(bench.path("a.svg")).unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let named = |name: &str| document.descendants().filter(|node| node.has_tag_name(name)).count();
        let walls = document.descendants().filter(|node| node.attribute("class") == Some("wall")).count();
        let words = document
            .descendants()
            .filter(|node| node.is_element() && node.text() == Some("speed [m/s]"))
            .count();
        (walls, named("linearGradient"), words)
    };
    assert_eq!(paths(&["--colour-by", "speed"]), (1, 1, 1));
    assert_eq!(paths(&[]), (1, 0, 0));
    assert_eq!(paths(&["--colour-by", "speed", "--bare"]), (1, 0, 0));
}

#[test]
fn charts_are_drawn_to_files_and_in_the_terminal() {
    let bench = recorded(SPRING);
    bench.pliant(["plot", "scene.mcap"]).succeeded().prints(&["energy [J]", "kinetic", "elastic", "total"]);
    bench.pliant(["plot", "scene.mcap", "-o", "a.svg", "--quantity", "momentum"]).succeeded();
    bench.pliant(["plot", "scene.mcap", "-o", "a.png", "--quantity", "energy"]).succeeded();
    let svg = std::fs::read_to_string(bench.path("a.svg")).unwrap();
    assert!(svg.contains("linear momentum x") && roxmltree::Document::parse(&svg).is_ok());
    std::fs::copy(bench.path("scene.mcap"), bench.path("other.mcap")).unwrap();
    bench.pliant(["plot", "scene.mcap", "other.mcap", "-o", "b.svg"]).succeeded();
    let both = std::fs::read_to_string(bench.path("b.svg")).unwrap();
    assert!(both.contains("scene: total") && both.contains("other: total") && !both.contains("kinetic"));
    assert_eq!(pixels(&std::fs::read(bench.path("a.png")).unwrap()).0, 900);
}

#[test]
fn tables_hold_all_of_energy() {
    let bench = recorded(SPRING);
    bench.pliant(["export", "scene.mcap", "--to", "a.csv"]).succeeded().prints(&["11 frames to a.csv"]);
    let text = std::fs::read_to_string(bench.path("a.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 12);
    assert_eq!(rows[0][0], "time");
    let column = |name: &str| rows[0].iter().position(|column| *column == name).unwrap();
    let number = |row: usize, name: &str| rows[row][column(name)].parse::<f64>().unwrap();
    // k/2 d^2 at the start, and all of it stays.
    assert!((number(1, "elastic") - 0.5).abs() < 1e-12);
    assert!((1..12).all(|row| (number(row, "total") - 0.5).abs() < 0.01));
    bench
        .pliant(["export", "scene.mcap", "--to", "b.csv", "--frames", "1"])
        .ended_with(2)
        .says(&["--frames"]);
}

/// The document of a .glb and its buffer.
fn gltf(path: PathBuf) -> (Value, Vec<u8>) {
    let file = std::fs::read(path).unwrap();
    let number = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&file[..4], number(4), number(8)), (&b"glTF"[..], 2, file.len()));
    let length = number(12);
    assert_eq!(&file[16..20], b"JSON");
    let document = serde_json::from_slice(&file[20..20 + length]).unwrap();
    let buffer = file[28 + length..].to_vec();
    assert_eq!((number(20 + length), &file[24 + length..28 + length]), (buffer.len(), &b"BIN\0"[..]));
    (document, buffer)
}

/// Numbers of an accessor, checked against its bounds.
fn accessor((document, buffer): &(Value, Vec<u8>), number: usize) -> Vec<f64> {
    let accessor = &document["accessors"][number];
    let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let field = |value: &Value, key: &str| value[key].as_u64().unwrap_or(0) as usize;
    let width = if accessor["type"] == "VEC3" { 3 } else { 1 };
    let size = match field(accessor, "componentType") {
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        other => panic!("component type {other}"),
    };
    let stride = if view["byteStride"].is_null() { width * size } else { field(view, "byteStride") };
    let (start, length) = (field(view, "byteOffset"), field(view, "byteLength"));
    assert!(stride.is_multiple_of(4) || width == 1);
    assert!(start.is_multiple_of(4) && start + length <= buffer.len());
    assert!(stride * (field(accessor, "count") - 1) + width * size <= length);
    let mut numbers = vec![];
    for row in 0..field(accessor, "count") {
        for axis in 0..width {
            let bytes = &buffer[start + row * stride + axis * size..][..size];
            let value = match field(accessor, "componentType") {
                5122 => f64::from(i16::from_le_bytes(bytes.try_into().unwrap())),
                5123 => f64::from(u16::from_le_bytes(bytes.try_into().unwrap())),
                5125 => f64::from(u32::from_le_bytes(bytes.try_into().unwrap())),
                _ => f64::from(f32::from_le_bytes(bytes.try_into().unwrap())),
            };
            numbers.push(value);
        }
    }
    if !accessor["min"].is_null() {
        for axis in 0..width {
            let values = || numbers.iter().skip(axis).step_by(width).copied();
            let bound = |key: &str| accessor[key][axis].as_f64().unwrap() as f32;
            assert_eq!(values().fold(f64::INFINITY, f64::min) as f32, bound("min"));
            assert_eq!(values().fold(f64::NEG_INFINITY, f64::max) as f32, bound("max"));
        }
    }
    numbers
}

#[test]
fn gltf_holds_the_motion_as_morph_targets() {
    let bench = recorded(BALL);
    bench.pliant(["export", "scene.mcap", "--to", "a.glb"]).succeeded().prints(&["5 frames to a.glb"]);
    bench.pliant(["export", "scene.mcap", "--to", "q.glb", "--quantised"]).succeeded();
    for name in ["a.glb", "q.glb"] {
        let file = gltf(bench.path(name));
        let count = file.0["accessors"].as_array().unwrap().len();
        for number in 0..count {
            accessor(&file, number);
        }
        assert_eq!(file.0["meshes"].as_array().unwrap().len(), 2);
        let node = &file.0["nodes"][0];
        let primitive = &file.0["meshes"][0]["primitives"][0];
        let number = |value: &Value| value.as_u64().unwrap() as usize;
        let start = accessor(&file, number(&primitive["attributes"]["POSITION"]));
        let last = accessor(&file, number(&primitive["targets"][3]["POSITION"]));
        // Until the ball touches the floor it falls by g t^2 / 2, which is along -y there.
        let scale = node["scale"][1].as_f64().unwrap_or(1.0);
        let fallen: f64 = last.iter().skip(1).step_by(3).sum::<f64>() * scale / (last.len() / 3) as f64;
        assert!((fallen + 0.5 * 9.81 * 0.04).abs() < 2e-3, "{fallen}");
        let indices = accessor(&file, number(&primitive["indices"]));
        assert!(
            indices.iter().all(|index| (*index as usize) < start.len() / 3)
                && indices.len().is_multiple_of(3)
        );
        let sampler = &file.0["animations"][0]["samplers"][0];
        let (times, weights) =
            (accessor(&file, number(&sampler["input"])), accessor(&file, number(&sampler["output"])));
        assert_eq!((times.len(), weights.len()), (5, 5 * 4));
        // At each frame at most one target, and of the last one the last.
        assert!(weights.chunks(4).all(|row| row.iter().sum::<f64>() <= 1.0));
        assert_eq!(weights[16..], [0.0, 0.0, 0.0, 1.0]);
    }
}

#[test]
fn long_recordings_are_thinned_for_gltf() {
    let scene = SPRING.replace("rate = 10.0", "rate = 200.0");
    let bench = recorded(&scene);
    bench.pliant(["export", "scene.mcap", "--to", "a.glb"]).succeeded().prints(&[
        "101 frames to a.glb",
        "1 of every 2",
        "--frames",
    ]);
    bench
        .pliant(["export", "scene.mcap", "--to", "b.glb", "--frames", "..150"])
        .ended_with(2)
        .says(&["120 frames, not 150", "..:2"]);
    bench.pliant(["export", "scene.mcap", "--to", "b.glb", "--frames", "..:2"]).succeeded();
    let [a, b] = ["a.glb", "b.glb"].map(|name| std::fs::read(bench.path(name)).unwrap());
    assert!(a == b);
}

#[test]
fn arrays_are_stored_where_the_archive_says() {
    let bench = recorded(SPRING);
    bench.pliant(["export", "scene.mcap", "--to", "a.npz", "--frames", "2..4"]).succeeded();
    let file = std::fs::read(bench.path("a.npz")).unwrap();
    let at = |name: &[u8]| file.windows(name.len()).position(|window| window == name).unwrap();
    let start = at(b"positions.npy") + b"positions.npy".len();
    assert_eq!(&file[start..start + 8], b"\x93NUMPY\x01\x00");
    let header = u16::from_le_bytes([file[start + 8], file[start + 9]]) as usize;
    let text = String::from_utf8(file[start + 10..start + 10 + header].to_vec()).unwrap();
    assert!(text.contains("'descr': '<f8'") && text.contains("'shape': (2, 2, 2,)"), "{text}");
    assert!((10 + header).is_multiple_of(64) && text.ends_with('\n'));
    let x = f64::from_le_bytes(file[start + 10 + header..][..8].try_into().unwrap());
    // The left mass swings about -0.05 + 0.05 by 0.05 cos(sqrt(200) t).
    let expected = 0.05 - 0.05 * (200.0_f64.sqrt() * 0.2).cos();
    assert!((x - expected).abs() < 1e-3, "{x} {expected}");
}
