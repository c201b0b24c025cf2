//! Loads and gravity of the page: arrows at some of their positions.

use serde_json::{Value, json};

use super::shown::ShownBody;
use crate::drawing::{Drawing, DrawnLoad};

/// Limit on the arrows of a load; more would hide the body.
const ARROWS: usize = 40;

/// Loads of a drawing that act on visible parts.
pub(super) fn loads(drawing: &Drawing, shown: &[ShownBody], frames: &[usize]) -> Vec<Value> {
    drawing.loads().iter().filter_map(|load| arrows(drawing, load, shown, frames)).collect()
}

/// Gravity in each frame [m/s^2]: one vector if constant, empty without gravity.
pub(super) fn gravity(drawing: &Drawing, frames: &[usize]) -> Vec<[f32; 3]> {
    let at = |&frame: &usize| drawing.gravity(drawing.times()[frame]).map(|g| g as f32);
    let mut values: Vec<[f32; 3]> = frames.iter().map(at).collect();
    if values.iter().all(|value| Some(value) == values.first()) {
        values.truncate(1);
    }
    if values == [[0.0; 3]] { vec![] } else { values }
}

/// Arrows of a load; `None` if nothing of it is visible, or its values depend on reference positions that
/// were not recorded.
fn arrows(drawing: &Drawing, load: &DrawnLoad, shown: &[ShownBody], frames: &[usize]) -> Option<Value> {
    let is_seen = |vertex: &u32| shown.iter().any(|body| body.vertices.binary_search(vertex).is_ok());
    let seen: Vec<&Vec<u32>> = load.on.iter().filter(|place| place.iter().all(is_seen)).collect();
    let on: Vec<&Vec<u32>> = seen.iter().step_by(seen.len().div_ceil(ARROWS).max(1)).copied().collect();
    let places: Vec<[f64; 3]> = if load.depends_on_place() {
        let rest = drawing.rest()?;
        on.iter().map(|place| middle(rest, place)).collect()
    } else {
        vec![[0.0; 3]]
    };
    let times = frames.iter().map(|&frame| drawing.times()[frame]);
    let times = times.take(if load.changes() { frames.len() } else { 1 });
    let at = |time: f64| places.iter().map(|x| load.value(*x, time).map(|c| c as f32)).collect::<Vec<_>>();
    let mut values: Vec<Vec<[f32; 3]>> = times.map(at).collect();
    // A formula of the position only has one value for all times.
    if values.iter().all(|value| Some(value) == values.first()) {
        values.truncate(1);
    }
    (!on.is_empty()).then(|| {
        json!({ "key": load.key, "unit": load.unit, "follows": load.follows(), "on": on, "values": values })
    })
}

/// Mean position of vertices.
fn middle(places: &[f64], vertices: &[u32]) -> [f64; 3] {
    let sum = |axis: usize| vertices.iter().map(|&vertex| places[3 * vertex as usize + axis]).sum::<f64>();
    [0, 1, 2].map(|axis| sum(axis) / vertices.len() as f64)
}
