//! Generated shapes.

use super::check::Checker;
use super::mesh::whole_cells;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::MeshSpec;
use pliant_mesh::{MeshError, predicted_size};

/// Smallest number of cells around a ring.
const LEAST_AROUND: usize = 3;

/// Dimension of a shape that fits only one.
fn dimension_of(mesh: &MeshSpec) -> Option<usize> {
    match mesh {
        MeshSpec::Ball(_) | MeshSpec::Sphere(_) | MeshSpec::Cylinder(_) | MeshSpec::Tube(_) => Some(3),
        MeshSpec::Annulus(_)
        | MeshSpec::CooksMembrane(_)
        | MeshSpec::TaperedBeam(_)
        | MeshSpec::NotchedBeam(_)
        | MeshSpec::EllipticMembrane(_) => Some(2),
        _ => None,
    }
}

/// True if the number of vertices is known or too large; false for a shape without cells.
pub(super) fn is_countable(mesh: &MeshSpec) -> bool {
    let Some(dimension) = dimension_of(mesh) else { return true };
    matches!(
        predicted_size(mesh, dimension, std::path::Path::new("")),
        Ok(_) | Err(MeshError::TooMany { .. })
    )
}

pub(super) fn shape(check: &mut Checker, path: &KeyPath, mesh: &MeshSpec) {
    if let (Some(needed), Some(given)) = (dimension_of(mesh), check.dimension)
        && needed != given
    {
        let message = format!("this shape is {needed}-dimensional, and `dimension` is {given}");
        check.report(Problem::semantic(path.clone(), message).at_key());
        return;
    }
    match mesh {
        MeshSpec::Ball(spec) => {
            check.number(&path.key("radius"), spec.radius, "m");
            check.count(&path.key("cells"), spec.cells);
            optional(check, &path.key("centre"), spec.centre.as_deref());
        }
        MeshSpec::Sphere(spec) => {
            check.number(&path.key("radius"), spec.radius, "m");
            check.count(&path.key("cells"), spec.cells);
            optional(check, &path.key("centre"), spec.centre.as_deref());
        }
        MeshSpec::Cylinder(spec) => {
            check.number(&path.key("radius"), spec.radius, "m");
            check.number(&path.key("height"), spec.height, "m");
            cells(check, path, &spec.cells, None);
            optional(check, &path.key("origin"), spec.origin.as_deref());
        }
        MeshSpec::Tube(spec) => {
            less(check, path, ("inner_radius", spec.inner_radius), ("outer_radius", spec.outer_radius));
            check.number(&path.key("height"), spec.height, "m");
            cells(check, path, &spec.cells, Some(1));
            optional(check, &path.key("origin"), spec.origin.as_deref());
        }
        MeshSpec::Annulus(spec) => {
            less(check, path, ("inner_radius", spec.inner_radius), ("outer_radius", spec.outer_radius));
            cells(check, path, &spec.cells, Some(1));
            optional(check, &path.key("centre"), spec.centre.as_deref());
        }
        MeshSpec::CooksMembrane(spec) => {
            cells(check, path, &spec.cells, None);
            whole_cells(check, path, spec.element);
        }
        MeshSpec::TaperedBeam(spec) => {
            cells(check, path, &spec.cells, None);
            whole_cells(check, path, spec.element);
            check.number(&path.key("length"), spec.length, "m");
            check.numbers(&path.key("heights"), &spec.heights, "m");
        }
        MeshSpec::NotchedBeam(spec) => {
            cells(check, path, &spec.cells, None);
            whole_cells(check, path, spec.element);
            less(check, path, ("depth", spec.depth), ("height", spec.height));
            less(check, path, ("width", spec.width), ("length", spec.length));
        }
        MeshSpec::EllipticMembrane(spec) => {
            cells(check, path, &spec.cells, None);
            whole_cells(check, path, spec.element);
            let inner = check.numbers(&path.key("inner"), &spec.inner, "m");
            let outer = check.numbers(&path.key("outer"), &spec.outer, "m");
            if let Some(axis) = (0..2).find(|&i| inner && outer && spec.inner[i] >= spec.outer[i]) {
                let (inner, outer) = (spec.inner[axis], spec.outer[axis]);
                let message = format!("`inner` must be less than `outer`, got {inner:?} and {outer:?} [m]");
                check.report(Problem::semantic(path.key("inner").index(axis), message));
            }
        }
        _ => {}
    }
}

fn optional(check: &mut Checker, path: &KeyPath, vector: Option<&[f64]>) {
    if let Some(vector) = vector {
        check.vector(path, vector, "m");
    }
}

/// Checks that there is at least one cell in each direction, and enough in the direction `around`.
fn cells(check: &mut Checker, path: &KeyPath, cells: &[usize], around: Option<usize>) {
    for (index, &count) in cells.iter().enumerate() {
        let path = path.key("cells").index(index);
        if check.count(&path, count) && around == Some(index) && count < LEAST_AROUND {
            let message = format!("`cells` around must be {LEAST_AROUND} or more, got {count}");
            check.report(Problem::semantic(path, message));
        }
    }
}

/// Checks that both numbers are positive, and the first less than the second.
fn less(check: &mut Checker, path: &KeyPath, (small, a): (&str, f64), (large, b): (&str, f64)) {
    let first = check.number(&path.key(small), a, "m");
    let second = check.number(&path.key(large), b, "m");
    if first && second && a >= b {
        let message = format!("`{small}` must be less than `{large}`, got {a:?} and {b:?} [m]");
        check.report(Problem::semantic(path.key(small), message));
    }
}
