//! A beam with a V-shaped notch in the middle of its upper side.

use super::build::{at_least_one, positive};
use super::cooks_membrane::plane;
use super::{Mesh, MeshError, MeshSize, mapped};
use crate::spec::NotchedBeamSpec;

fn rectangle([beside, notch, up]: [usize; 3]) -> [usize; 2] {
    [beside.saturating_add(notch).saturating_mul(2), up]
}

/// Counts of the beam.
pub(super) fn size(spec: &NotchedBeamSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    plane("notched_beam", dimension)?;
    spec.cells.iter().try_for_each(|&count| at_least_one("cells", count))?;
    mapped::size(rectangle(spec.cells), spec.element)
}

/// Builds the beam of columns of cells from `y = 0` to the upper side: `cells[0]` columns on either side
/// of the notch, `cells[1]` in either half of it, each `cells[2]` cells high.
pub(super) fn build(spec: &NotchedBeamSpec, dimension: usize) -> Result<Mesh, MeshError> {
    size(spec, dimension)?;
    let NotchedBeamSpec { length, height, depth, width, .. } = *spec;
    for (field, value) in [("length", length), ("height", height), ("depth", depth), ("width", width)] {
        positive(field, value)?;
    }
    if depth >= height {
        return Err(MeshError::NotLess { field: "depth", value: depth, other: "height", bound: height });
    }
    if width >= length {
        return Err(MeshError::NotLess { field: "width", value: width, other: "length", bound: length });
    }
    let [beside, notch, up] = spec.cells;
    let half = beside + notch;
    // Measured from the middle, so that both halves have the same numbers.
    let offset = |from_middle: usize| {
        if from_middle <= notch {
            from_middle as f64 / notch as f64 * (0.5 * width)
        } else {
            let outer = (from_middle - notch) as f64 / beside as f64;
            0.5 * width * (1.0 - outer) + 0.5 * length * outer
        }
    };
    let top = |from_middle: usize| height - depth * (1.0 - from_middle.min(notch) as f64 / notch as f64);
    let plan = (rectangle(spec.cells), spec.element);
    let mut mesh = mapped::build(plan, ["left", "right", "bottom", "top"], |i, j| {
        let from_middle = i.abs_diff(half);
        let offset = if i < half { -offset(from_middle) } else { offset(from_middle) };
        [0.5 * length + offset, j as f64 / up as f64 * top(from_middle)]
    })?;
    let index = |i: usize| (i * (up + 1) + up) as u32;
    mapped::add_lines(&mut mesh, "notch", (beside..half + notch).rev().map(|i| [index(i + 1), index(i)]));
    Ok(mesh)
}
