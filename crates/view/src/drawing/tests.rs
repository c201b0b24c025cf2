//! Tests of the drawing model.

use super::*;
use crate::test_support::recorded;

/// A pinned square of four triangles above a wall, with a probe.
const SQUARE: &str = "dimension = 2
title = 'A square'
time = { integrator = 'velocity-verlet', step = 1e-3, duration = 0.02 }
[world]
gravity = [0.0, -9.8]
walls = [{ normal = [0.0, 2.0], offset = -1.0 }]
[[body]]
name = 'square'
mesh = { grid = { size = [1.0, 1.0], cells = [2, 1] } }
elastic = { neo-hookean = { young = 1e4, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ half_space = { normal = [1.0, 0.0], offset = 0.0 } }]
[[probe]]
name = 'tip'
at = [1.0, 0.0]
[output]
rate = 100.0
channels = ['state', 'energy', 'jacobian', 'cauchy-stress']
";

fn drawing(text: &str) -> Drawing {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    recorded(text, &file);
    Drawing::open(&file).unwrap()
}

#[test]
fn a_flat_body_is_drawn_with_its_surroundings() {
    let mut drawing = drawing(SQUARE);
    assert_eq!((drawing.dimension(), drawing.title(), drawing.times().len()), (2, "A square", 3));
    let body = &drawing.bodies()[0];
    assert_eq!((body.triangles.len(), body.element_count(), body.element_size), (4, 4, 3));
    assert_eq!(body.elements.as_deref(), Some(&[0, 1, 2, 3][..]));
    assert!(body.lines.is_empty() && body.points.is_empty());
    // `offset` is along the unit normal.
    let wall = &drawing.walls()[0];
    assert_eq!((wall.point, wall.normal), ([0.0, -1.0, 0.0], [0.0, 1.0, 0.0]));
    let rest = drawing.rest().unwrap();
    let left: Vec<u32> = (0..6u32).filter(|v| rest[3 * *v as usize] == 0.0).collect();
    assert_eq!(drawing.pins(), left);
    let frame = drawing.frame(2).unwrap();
    assert_eq!((frame.time, frame.x.len()), (0.02, 18));
    assert!(frame.x.chunks(3).all(|x| x[2] == 0.0));
    let corner = (0..6).find(|v| rest_is(&drawing, *v, [1.0, 0.0])).unwrap();
    let probe = &drawing.probes()[0];
    assert_eq!((probe.name.as_str(), probe.positions.len()), ("tip", 3));
    let off: Vec<f64> = (0..2).map(|c| (probe.positions[2][c] - frame.x[3 * corner + c]).abs()).collect();
    assert!(off.iter().all(|off| *off < 1e-15), "{off:?}");
}

fn rest_is(drawing: &Drawing, vertex: usize, place: [f64; 2]) -> bool {
    drawing.rest().unwrap()[3 * vertex..3 * vertex + 2] == place
}

#[test]
fn colourings_are_those_recorded_and_have_units() {
    let mut drawing = drawing(SQUARE);
    let names: Vec<String> = drawing.colourings().iter().map(Colouring::to_string).collect();
    let stress: Vec<String> =
        ["xx", "yy", "zz", "xy", "yz", "xz"].map(|c| format!("cauchy-stress {c}")).to_vec();
    assert_eq!(
        names,
        [&["body", "speed", "displacement", "jacobian"].map(str::to_owned)[..], &stress].concat()
    );
    let colourings = drawing.colourings();
    let still = drawing.scalars(&colourings[3], 0).unwrap();
    assert_eq!((still.unit.as_str(), &still.bodies[0]), ("1", &BodyScalars::Elements(vec![1.0; 4])));
    let speed = drawing.scalars(&colourings[1], 2).unwrap();
    // Free fall at most; pinned vertices do not move.
    let (low, high) = speed.range().unwrap();
    assert!(low == 0.0 && high > 0.05 && high < 0.5, "{low} {high}");
    let stress = drawing.scalars(&colourings[4], 2).unwrap();
    assert_eq!((stress.unit.as_str(), stress.bodies[0].values().len()), ("Pa", 4));
}

#[test]
fn recovered_stresses_colour_vertices() {
    let rope = "[[body]]\nmesh = { strand = { segments = 2, start = [2.0, 0.0], end = [3.0, 0.0] } }\n\
                springs = { stiffness = 10.0 }\nmass = { per_vertex = 0.1 }\n[[probe]]";
    let named = SQUARE.replace("'jacobian', 'cauchy-stress'", "'nodal-von-mises', 'zz'");
    let mut drawing = drawing(&named.replacen("[[probe]]", rope, 1));
    let names: Vec<String> = drawing.colourings().iter().map(Colouring::to_string).collect();
    assert_eq!(names, ["body", "speed", "displacement", "zz", "nodal-von-mises"]);
    let colourings = drawing.colourings();
    let stress = drawing.scalars(&colourings[4], 2).unwrap();
    let BodyScalars::Vertices(values) = &stress.bodies[0] else { panic!("{stress:?}") };
    assert!(values.len() == 6 && values.iter().all(|stress| *stress > 0.0), "{values:?}");
    assert_eq!((stress.unit.as_str(), &stress.bodies[1]), ("Pa", &BodyScalars::None));
    assert!(matches!(&drawing.scalars(&colourings[3], 2).unwrap().bodies[0], BodyScalars::Elements(_)));
}

/// A 3D scene with one body of this mesh and these properties.
fn in_space(mesh: &str, part: &str) -> String {
    format!(
        "dimension = 3
time = {{ integrator = 'velocity-verlet', step = 1e-4, duration = 1e-3 }}
[[body]]
name = 'body'
mesh = {mesh}
{part}
[output]
rate = 1000.0
channels = ['state', 'jacobian']
"
    )
}

const ELASTIC: &str =
    "elastic = { neo-hookean = { young = 1e4, poisson = 0.3 } }\nmass = { density = 1000.0 }";

#[test]
fn each_triangle_of_a_solid_is_a_side_of_its_element() {
    for (cells, size) in [("tetrahedra", 4), ("hexahedra", 8)] {
        let kind = if size == 8 { ", element = 'hexahedron'" } else { "" };
        let mesh = format!("{{ grid = {{ size = [1.0, 1.0, 1.0], cells = [2, 2, 2]{kind} }} }}");
        let drawing = drawing(&in_space(&mesh, ELASTIC));
        let body = &drawing.bodies()[0];
        assert_eq!((body.element_size, body.triangles.len()), (size, 48), "{cells}");
        let elements = body.elements.as_ref().unwrap();
        for (triangle, element) in body.triangles.iter().zip(elements) {
            let first = *element as usize * size;
            let vertices = &body.element_vertices[first..first + size];
            assert!(triangle.iter().all(|corner| vertices.contains(corner)), "{cells}");
        }
    }
}

#[test]
fn strands_are_lines_and_particles_points() {
    let strand = "{ strand = { segments = 2, start = [0.0, 3.0, 0.0], end = [1.0, 3.0, 0.0] } }";
    let springs = "springs = { stiffness = 10.0 }\nmass = { per_vertex = 0.1 }";
    let strand = drawing(&in_space(strand, springs).replace(", 'jacobian'", ""));
    let body = &strand.bodies()[0];
    assert_eq!((&body.lines[..], body.points.len(), body.element_count()), (&[[0, 1], [1, 2]][..], 0, 0));
    let dust = "{ inline = { points = [[0.0, -3.0, 0.0], [1.0, -3.0, 0.0]] } }";
    let dust = drawing(&in_space(dust, "mass = { total = 1.0 }").replace(", 'jacobian'", ""));
    let body = &dust.bodies()[0];
    assert_eq!((&body.points[..], body.lines.len(), body.triangles.len()), (&[0, 1][..], 0, 0));
    assert_eq!(dust.masses(), Some(&[0.5, 0.5][..]));
}

#[test]
fn a_recording_of_an_unreadable_scene_is_drawn_without_walls() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    crate::test_support::recorded_as(SQUARE, "no scene at all", &file);
    let drawing = Drawing::open(&file).unwrap();
    assert!(drawing.walls().is_empty() && drawing.pins().is_empty());
    assert_eq!(drawing.bodies().len(), 1);
}

#[test]
fn loads_act_where_the_scene_says_and_change_with_time() {
    let load = "load = [{ half_space = { normal = [-1.0, 0.0], offset = -1.0 }, traction = [0.0, '30 * t'] },
    { vertices = [0], force = ['2 * X + 1', 3.0] }]\n[[probe]]";
    let drawing = drawing(&SQUARE.replacen("[[probe]]", load, 1));
    let [traction, force] = drawing.loads() else { panic!("{:?}", drawing.loads()) };
    assert_eq!((traction.key, traction.unit, force.key, force.unit), ("traction", "Pa", "force", "N"));
    let rest = drawing.rest().unwrap();
    let [edge] = &traction.on[..] else { panic!("{:?}", traction.on) };
    // The right side, upwards: counter-clockwise around the body.
    let places: Vec<&[f64]> = edge.iter().map(|v| &rest[3 * *v as usize..3 * *v as usize + 2]).collect();
    assert_eq!(places, [[1.0, 0.0], [1.0, 1.0]]);
    assert_eq!(traction.value([0.0; 3], 0.5), [0.0, 15.0, 0.0]);
    assert!(traction.changes() && !traction.depends_on_place() && !traction.follows());
    assert_eq!((&force.on[..], force.value([2.0, 0.0, 0.0], 9.0)), (&[vec![0]][..], [5.0, 3.0, 0.0]));
    assert!(force.depends_on_place());
    assert_eq!(drawing.gravity(0.01), [0.0, -9.8, 0.0]);
}

/// A cube of half a metre as OBJ, in two parts of a scene that makes it solid and lets it fall.
const CUBE: &str = "v 0 0 0\nv 0.5 0 0\nv 0 0.5 0\nv 0.5 0.5 0\nv 0 0 0.5\nv 0.5 0 0.5\nv 0 0.5 0.5\nv 0.5 \
                    0.5 0.5\n\
    f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

/// An embedded surface is drawn with its elements, in the colours of its vertices and elements; without
/// it the boundary is drawn.
#[test]
fn skins_are_drawn_in_place_of_the_boundary() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, file) = (folder.path().join("cube.obj"), folder.path().join("run.mcap"));
    std::fs::write(&surface, CUBE).unwrap();
    let scene = |keys: &str| {
        format!(
            "dimension = 3
            time = {{ integrator = 'velocity-verlet', step = 1e-3, duration = 0.02 }}
            world = {{ gravity = [0.0, 0.0, -10.0] }}
            output = {{ rate = 100.0, channels = ['state', 'mesh', 'jacobian', 'nodal-von-mises'] }}
            [[body]]
            name = 'cube'
            mesh = {{ surface = {{ path = '{}', cells = 3 {keys} }} }}
            elastic = {{ neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}
            mass = {{ density = 1000.0 }}",
            surface.display()
        )
    };
    recorded(&scene(""), &file);
    let mut drawing = Drawing::open(&file).unwrap();
    let body = drawing.bodies()[0].clone();
    let count = drawing.vertex_count();
    assert_eq!((body.triangles.len(), body.skin.clone()), (12, count as u32..count as u32 + 8));
    let frame = drawing.frame(2).unwrap();
    assert_eq!((frame.x.len(), frame.v.len()), (3 * (count + 8), 3 * (count + 8)));
    // In free fall: z = -g t^2 / 2.
    let last = &frame.x[3 * (count + 7)..];
    assert!((0..2).all(|c| (last[c] - 0.5).abs() < 1e-12) && (last[2] - 0.498).abs() < 1e-12, "{last:?}");
    let speed = drawing.scalars(&Colouring::Speed, 2).unwrap();
    let values = speed.bodies[0].values();
    assert_eq!(values.len(), count + 8);
    assert!((values[body.place(count as u32 + 7)] - 0.2).abs() < 1e-12);
    let elements = body.elements.unwrap();
    let measure = drawing.colourings().into_iter().find(|c| c.to_string() == "jacobian").unwrap();
    let of_elements = drawing.scalars(&measure, 2).unwrap();
    let largest = *elements.iter().max().unwrap() as usize;
    assert!(elements.len() == 12 && largest < of_elements.bodies[0].values().len());
    let stress = drawing.colourings().into_iter().find(|c| c.to_string() == "nodal-von-mises").unwrap();
    assert_eq!(drawing.scalars(&stress, 2).unwrap().bodies[0].values().len(), count + 8);
    let bare = Drawing::without_skins(&file, folder.path()).unwrap();
    assert!(bare.bodies()[0].triangles.len() > 12 && bare.bodies()[0].skin.is_empty());
    let file = folder.path().join("bare.mcap");
    recorded(&scene(", skin = false"), &file);
    let mut left_out = Drawing::open(&file).unwrap();
    assert_eq!(left_out.bodies()[0].triangles, bare.bodies()[0].triangles);
    assert_eq!(left_out.frame(2).unwrap().x.len(), 3 * count);
}
