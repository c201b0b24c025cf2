//! A chain of rings that hang in each other: links remain linked, by Gauss's integral.

use std::f64::consts::TAU;

use pliant_scene::assembly::Assembly;

use super::chain::{LinkedRings, linking_number};
use super::torture::endured;

#[test]
fn the_integral_counts_how_often_curves_are_linked() {
    let circle = |of: fn(f64, f64) -> [f64; 3]| -> Vec<[f64; 3]> {
        (0..12).map(|k| of((TAU * f64::from(k) / 12.0).cos(), (TAU * f64::from(k) / 12.0).sin())).collect()
    };
    let first = circle(|c, s| [c, s, 0.0]);
    for (second, linked) in [
        (circle(|c, s| [1.0 + c, 0.1, s]), 1.0),
        (circle(|c, s| [3.0 + c, 0.1, s]), 0.0),
        (circle(|c, s| [0.1 + 0.3 * c, 0.1, 0.3 * s]), 0.0),
    ] {
        let found = linking_number(&first, &second);
        assert!((found.abs() - linked).abs() < 1e-12, "{found}, not {linked}");
    }
}

#[test]
fn links_of_a_chain_remain_linked() {
    let chain = LinkedRings { links: 3, cells: [16, 1] };
    let linking = |assembly: &Assembly| chain.linking(&assembly.simulation.positions());
    let mut assembly = super::assembled(&chain.text("contact = { distance = 1e-3 }"));
    let start = linking(&assembly);
    assert!(start.iter().all(|n| (n.abs() - 1.0).abs() < 1e-9), "{start:?}");
    for _ in 0..50 {
        endured("chain", &mut assembly, 1, 1);
        let now = linking(&assembly);
        let off = now.iter().zip(&start).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(off < 1e-9, "{now:?} at {} s, {start:?} before", assembly.simulation.state().time);
    }
    // It hangs in the highest link: by the linked rings' own length, and not by what falls in half a second.
    let slack = chain.slack(&assembly.simulation.positions());
    assert!(slack < 0.1, "the lowest link hangs {slack} of the length of the taut chain away from its end");
    // Without contact they are not.
    let mut loose = super::assembled(&chain.text(""));
    super::advance(&mut loose.simulation, 50);
    let end = linking(&loose);
    assert!(end[0].abs() < 1e-9, "{end:?}");
}
