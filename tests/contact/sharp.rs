//! Bodies on what has no inside: a ball on a bed of points, a sheet on knives.

use super::setups::{ball_on_needles, holds, needles, sheet_on_knives};
use super::torture::{endured, vertices};

/// A ball that falls on a hundred points; none gets in.
#[test]
fn a_ball_falls_on_a_hundred_needles() {
    let points = needles();
    let mut assembly = super::assembled(&ball_on_needles(3));
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
            let held = body.tetrahedra.iter().find(|t| holds(t.map(|v| at(&x, v)), *point));
            assert!(held.is_none(), "{point:?} is in {held:?}");
        }
    }
    assert!(most >= 4, "it lay on {most} points");
}

fn at(x: &[f64], v: u32) -> [f64; 3] {
    [0, 1, 2].map(|k| x[3 * v as usize + k])
}

/// A sheet that falls on nine triangles that stand on edge.
#[test]
fn a_sheet_falls_on_knives() {
    let mut assembly = super::assembled(&sheet_on_knives(12));
    endured("sheet on knives", &mut assembly, 30, 30);
    let x = assembly.simulation.positions();
    let own = vertices(&assembly, "sheet");
    let heights: Vec<f64> = own.map(|v| x[3 * v + 2]).collect();
    // It hangs over the tips, which are 0.2 m high, and none has come through.
    let [low, high] =
        heights.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], z| [l.min(*z), h.max(*z)]);
    assert!(high > 0.19 && low < 0.15, "from {low} to {high} m");
}
