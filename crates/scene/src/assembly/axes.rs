//! Assembly of material axes: a rotation of each element.

use super::muscles::{centres, directions, rounded};
use crate::{Body, KeyPath, Problem};
use pliant::algebra::Mat;
use pliant::material::material_axes;
use pliant_mesh::Mesh;

/// Rotation from the material axes to the space axes, for each element of a body; empty without `axes` or
/// after a problem.
pub(super) fn axes(
    spec: &Body,
    mesh: &Mesh,
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> Vec<Mat<f64, 3>> {
    let Some(axes) = &spec.elastic_axes else { return vec![] };
    let path = path.key("elastic_axes");
    let mut unit = |key: &str, spec| directions((spec, "axes"), mesh, &path.key(key), problems);
    let first = unit("first", &axes.first);
    let second = axes.second.as_ref().map(|second| unit("second", second));
    let (Some(first), false) = (first, matches!(second, Some(None))) else { return vec![] };
    let second = second.flatten();
    if let Some(element) = second.as_ref().and_then(|second| first_parallel(&first, second)) {
        let message = format!(
            "axes of element {element}, whose centre is at {} m at rest: `second` is parallel to `first`",
            rounded(&centres(mesh)[element])
        );
        let help = "a direction in the plane of the first two axes, along neither";
        problems.push(Problem::semantic(path.key("second"), message).with_help(help));
        return vec![];
    }
    let of_element = |i: usize| material_axes(&first[i], second.as_ref().map(|second| &second[i]));
    (0..first.len()).map(of_element).collect()
}

/// First element whose unit vectors are parallel, up to rounding.
fn first_parallel(first: &[[f64; 3]], second: &[[f64; 3]]) -> Option<usize> {
    let is_parallel = |(a, b): (&[f64; 3], &[f64; 3])| {
        [(1, 2), (2, 0), (0, 1)].iter().all(|&(i, j)| (a[i] * b[j] - a[j] * b[i]).abs() < 1e-12)
    };
    first.iter().zip(second).position(is_parallel)
}
