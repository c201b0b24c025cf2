//! Bodies on what has no inside: a ball on a bed of points, a sheet on knives.

use super::torture::{endured, head, solid, vertices};

/// A ball that falls on a hundred points; none gets in.
#[test]
fn a_ball_falls_on_a_hundred_needles() {
    let points: Vec<[f64; 3]> =
        (0..100).map(|i| [f64::from(i / 10) * 0.02 - 0.09, f64::from(i % 10) * 0.02 - 0.09, 0.0]).collect();
    let needles = format!(
        "[[body]]\nname = 'needles'\nmesh = {{ inline = {{ points = {points:?} }} }}\nmass = {{ per_vertex = 1.0 }}\n\
         contact = {{ self = false }}\npin = [{{ box = {{ min = [-1, -1, -1], max = [1, 1, 0.001] }} }}]\n"
    );
    let ball = "ball = { cells = 3, radius = 0.1, centre = [0.003, 0.004, 0.12] }";
    let text = head(0.01, -9.81, "distance = 2e-3, friction = 0.3")
        + &solid("ball", ball, 2e4, 1000.0, "velocity = { rigid = { linear = [0, 0, -1] } }")
        + &needles;
    let mut assembly = super::assembled(&text);
    let mut most = 0;
    for _ in 0..40 {
        endured("ball on needles", &mut assembly, 1, 1);
        most = most.max(assembly.simulation.contacts().len());
        let x = assembly.simulation.positions();
        let own = vertices(&assembly, "ball");
        let middle = own.clone().map(|v| x[3 * v + 2]).sum::<f64>() / own.len() as f64;
        assert!(middle > 0.03, "its middle is {middle} m above the points");
        // A point that a cell holds has gone through its surface.
        let body = assembly.topology.bodies.iter().find(|body| body.name == "ball").unwrap();
        for point in &points {
            let held = body.tetrahedra.iter().find(|t| is_inside(*point, t.map(|v| at(&x, v))));
            assert!(held.is_none(), "{point:?} is in {held:?}");
        }
    }
    assert!(most >= 4, "it lay on {most} points");
}

fn at(x: &[f64], v: u32) -> [f64; 3] {
    [0, 1, 2].map(|k| x[3 * v as usize + k])
}

/// Whether a tetrahedron of positive volume holds a point.
fn is_inside(p: [f64; 3], [a, b, c, d]: [[f64; 3]; 4]) -> bool {
    use super::scenes::volume;
    volume(p, b, c, d) > 0.0
        && volume(a, p, c, d) > 0.0
        && volume(a, b, p, d) > 0.0
        && volume(a, b, c, p) > 0.0
}

/// A sheet that falls on nine triangles that stand on edge.
fn on_knives(cells: usize, steps: usize) {
    let (mut points, mut triangles) = (vec![], vec![]);
    for k in 0..9 {
        let x = 0.1 * f64::from(k) - 0.4;
        points.extend([[x, -0.3, 0.0], [x, 0.3, 0.0], [x, 0.05 * f64::from(k % 3), 0.2]]);
        triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
    }
    let knives = format!(
        "[[obstacle]]\nname = 'knives'\n\
         shape = {{ mesh = {{ inline = {{ points = {points:?}, triangles = {triangles:?} }} }} }}\n"
    );
    let sheet = format!(
        "[[body]]\nname = 'sheet'\n\
         mesh = {{ cloth = {{ cells = [{cells}, {cells}], origin = [-0.5, -0.5, 0.21], u = [1, 0, 0], v = [0, 1, 0] }} }}\n\
         membrane = {{ thickness = 1e-3 }}\nelastic = {{ stable-neo-hookean = {{ young = 2e4, poisson = 0.3 }} }}\n\
         mass = {{ density = 1000 }}\n"
    );
    let text = head(0.01, -9.81, "distance = 1e-3, friction = 0.2") + &sheet + &knives;
    let mut assembly = super::assembled(&text);
    endured("sheet on knives", &mut assembly, steps, steps);
    let x = assembly.simulation.positions();
    let own = vertices(&assembly, "sheet");
    let heights: Vec<f64> = own.map(|v| x[3 * v + 2]).collect();
    // It hangs over the tips, which are 0.2 m high, and none has come through.
    let [low, high] =
        heights.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], z| [l.min(*z), h.max(*z)]);
    assert!(high > 0.19 && low < 0.15, "from {low} to {high} m");
}

#[test]
fn a_sheet_falls_on_knives() {
    on_knives(12, 30);
}

#[test]
#[ignore = "minutes: cargo test --release -p pliant-scene --test contact -- --ignored"]
fn torture_a_fine_sheet_falls_on_knives() {
    on_knives(40, 100);
}
