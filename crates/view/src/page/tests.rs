//! Tests of pages.

use pliant_files::base64;
use serde_json::Value;

use super::codec::tests::decode;
use super::*;
use crate::test_support::recorded;

const TITLE: &str = "</script><script>document.title='broken'</script><img src=x onerror=alert(1)>";

/// Two bodies, one of which flies.
fn drawing(title: &str) -> Drawing {
    let scene = format!(
        "dimension = 3
title = \"{title}\"
time = {{ integrator = 'velocity-verlet', step = 1e-3, duration = 0.1 }}
[[body]]
name = 'ball'
mesh = {{ ball = {{ radius = 0.5, cells = 1 }} }}
elastic = {{ neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}
mass = {{ density = 1000.0 }}
velocity = {{ rigid = {{ linear = [50.0, 0.0, 0.0] }} }}
[[body]]
name = 'dust'
mesh = {{ inline = {{ points = [[0.0, -3.0, 0.0], [1.0, -3.0, 0.0]] }} }}
mass = {{ total = 1.0 }}
[output]
rate = 400.0
channels = ['state', 'energy', 'von-mises']
"
    );
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    recorded(&scene, &file);
    Drawing::open(&file).unwrap()
}

/// Content of a block.
fn block(page: &ViewerPage, name: &str) -> Vec<u8> {
    let start = format!("data-data=\"{name}\">");
    let text = page.html.split(&start).nth(1).unwrap().split('<').next().unwrap();
    base64::decode(text.as_bytes()).0
}

fn head(page: &ViewerPage) -> Value {
    let text = miniz_oxide::inflate::decompress_to_vec(&block(page, "head")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
}

#[test]
fn positions_come_back_within_half_a_step_of_the_box() {
    let mut drawing = drawing("flight");
    let page = ViewerPage::new(&mut drawing, &PageBudget::default()).unwrap();
    let head = head(&page);
    assert_eq!((page.frames, page.frame_count, page.left_out.len()), (41, 41, 0));
    for (b, name) in ["ball", "dust"].iter().enumerate() {
        let body = &head["bodies"][b];
        assert_eq!(body["name"], *name);
        let centres = body["centres"].as_array().unwrap();
        assert_eq!(centres.is_empty(), *name == "dust");
        let (low, step) = (numbers(&body["low"]), numbers(&body["step"]));
        let vertices = miniz_oxide::inflate::decompress_to_vec(&block(&page, &format!("body{b}.vertices")));
        let vertices: Vec<u32> =
            vertices.unwrap().as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        let order = body["orders"][1].as_u64().unwrap() as u8;
        let n = vertices.len();
        let codes = decode(&block(&page, &format!("body{b}.position1")), order, 3 * n);
        // Frame 40 is the ninth of the second chunk.
        let x = drawing.frame(40).unwrap().x;
        let centre = centres.get(40).map_or(vec![0.0; 3], numbers);
        for (i, vertex) in vertices.iter().enumerate() {
            for axis in 0..3 {
                let shown = centre[axis] + low[axis] + step[axis] * f64::from(codes[8][axis * n + i]);
                let off = (shown - x[3 * *vertex as usize + axis]).abs();
                // The box of a flying body has the size of the body: half a metre, not five.
                assert!(off <= 0.5 * step[axis] + 1e-12 && step[axis] < 2.0 / 65_534.0, "{name}: {off}");
            }
        }
    }
}

#[test]
fn markup_in_titles_and_names_stays_data() {
    let page = ViewerPage::new(&mut drawing(TITLE), &PageBudget::default()).unwrap();
    assert_eq!(head(&page)["title"], TITLE);
    assert!(!page.html.contains("broken") && !page.html.contains("onerror=alert"));
    let clean = ViewerPage::new(&mut drawing("clean"), &PageBudget::default()).unwrap();
    let count = |page: &ViewerPage| page.html.matches("<script").count();
    assert_eq!(count(&page), count(&clean));
}

#[test]
fn too_many_frames_are_thinned_evenly() {
    let mut drawing = drawing("thin");
    let page = ViewerPage::new(&mut drawing, &PageBudget { frames: 10, ..PageBudget::default() }).unwrap();
    let frames = numbers(&head(&page)["frames"]);
    assert_eq!(frames, [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0]);
    assert_eq!((page.frames, page.frame_count), (9, 41));
    let whole = ViewerPage::new(&mut drawing, &PageBudget::default()).unwrap();
    let blocks = whole.html.split("data-data=\"body").skip(1);
    let bytes: usize = blocks.map(|block| block.split('<').next().unwrap().len() * 3 / 4).sum();
    let bytes = bytes * 3 / 4;
    let small = ViewerPage::new(&mut drawing, &PageBudget { bytes, ..PageBudget::default() }).unwrap();
    assert!(small.frames < 41 && small.frames > 2, "{}", small.frames);
    let tiny = ViewerPage::new(&mut drawing, &PageBudget { bytes: 1, frames: 300 }).unwrap();
    assert_eq!((tiny.frames, tiny.left_out.len()), (2, 3));
    assert_eq!(head(&tiny)["left_out"][2], "von-mises");
}

#[test]
fn the_page_asks_for_nothing() {
    let page = ViewerPage::new(&mut drawing("quiet"), &PageBudget::default()).unwrap();
    assert!(page.html.contains("default-src 'none'"));
    let outside = ["src=\"http", "href=\"http", "url(http", "@import"];
    let asked: Vec<&str> = outside.into_iter().filter(|text| page.html.contains(text)).collect();
    assert!(asked.is_empty(), "{asked:?}");
}

#[test]
fn arrows_of_loads_are_on_what_is_seen_and_few() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let scene = "dimension = 3
time = { integrator = 'velocity-verlet', step = 1e-3, duration = 0.1 }
world = { gravity = [0.0, 0.0, -2.0] }
[[body]]
name = 'block'
mesh = { grid = { size = [1.0, 1.0, 1.0], cells = [3, 3, 3] } }
elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
mass = { density = 1000.0 }
load = [{ pressure = '10 * t' }, { force = [1.0, 0.0, 'Z'] }]
[output]
rate = 100.0
channels = ['state']
";
    recorded(scene, &file);
    let page = ViewerPage::new(&mut Drawing::open(&file).unwrap(), &PageBudget::default()).unwrap();
    let head = head(&page);
    let loads = head["loads"].as_array().unwrap();
    let (pressure, force) = (&loads[0], &loads[1]);
    assert_eq!((&pressure["follows"], &force["follows"]), (&true.into(), &false.into()));
    // Every third of 108 triangles; every second of the 56 surface vertices (64 in all).
    let count = |load: &Value| load["on"].as_array().unwrap().len();
    assert_eq!((count(pressure), count(force)), (36, 28));
    // One value for all triangles in each frame; one for each vertex at all times.
    let shape = |load: &Value| {
        (load["values"].as_array().unwrap().len(), load["values"][0].as_array().unwrap().len())
    };
    assert_eq!((shape(pressure), shape(force)), ((11, 1), (1, 28)));
    let last = pressure["values"][10][0][0].as_f64().unwrap();
    assert!((last - 1.0).abs() < 1e-6, "{last}");
    assert_eq!(head["gravity"], serde_json::json!([[0.0, 0.0, -2.0]]));
    // Without loads and gravity the lists are empty.
    let free = self::head(&ViewerPage::new(&mut drawing("free"), &PageBudget::default()).unwrap());
    assert_eq!((&free["loads"], &free["gravity"]), (&serde_json::json!([]), &serde_json::json!([])));
}
