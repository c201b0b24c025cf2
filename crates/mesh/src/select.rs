//! Sets of vertices by position, index or name.

use super::build::{finite, vector};
use super::{Mesh, MeshError};
use crate::spec::{BoxSelection, HalfSpace, Selection};
use pliant::algebra::direction;

/// Tolerance of boxes and half-spaces, as a fraction of the body's diagonal.
const TOLERANCE: f64 = 1e-9;

/// Vertices of `mesh` that `selection` names, by their reference positions: ascending, each once, at
/// least one.
///
/// Boxes may be unbounded: `inf` and `-inf` are valid bounds. The tolerance of boxes and half-spaces is
/// 1e-9 of the diagonal of the mesh's bounding box.
///
/// # Errors
/// [`MeshError::Components`], [`MeshError::NotFinite`], [`MeshError::BoxReversed`],
/// [`MeshError::ZeroNormal`], [`MeshError::SelectedVertex`], [`MeshError::UnknownGroup`];
/// [`MeshError::NothingSelected`] if no vertex is selected.
pub fn select(mesh: &Mesh, selection: &Selection) -> Result<Vec<u32>, MeshError> {
    let vertices = match selection {
        Selection::Box(selection) => inside_box(mesh, selection)?,
        Selection::HalfSpace(wall) => below(mesh, wall)?,
        Selection::Vertices(vertices) => listed(mesh, vertices)?,
        Selection::Group(name) => group(mesh, name)?,
    };
    if vertices.is_empty() {
        let (lower, upper) = mesh.bounding_box();
        return Err(MeshError::NothingSelected { selection: describe(selection), lower, upper });
    }
    Ok(vertices)
}

/// Describes the selection in the keys of the scene.
fn describe(selection: &Selection) -> String {
    match selection {
        Selection::Box(b) => format!("the box from {:?} to {:?}", b.min, b.max),
        Selection::HalfSpace(w) => {
            format!("the half-space with normal {:?} and offset {:?}", w.normal, w.offset)
        }
        Selection::Vertices(_) => "the empty list of vertices".to_string(),
        Selection::Group(name) => format!("the group `{name}`"),
    }
}

/// Ascending indices of the vertices whose position satisfies `test`.
fn filter(mesh: &Mesh, test: impl Fn(&[f64]) -> bool) -> Vec<u32> {
    (0..mesh.vertex_count()).filter(|&i| test(mesh.point(i))).map(|i| i as u32).collect()
}

fn inside_box(mesh: &Mesh, selection: &BoxSelection) -> Result<Vec<u32>, MeshError> {
    for (field, corner) in [("min", &selection.min), ("max", &selection.max)] {
        if corner.len() != mesh.dimension {
            return Err(MeshError::Components { field, expected: mesh.dimension, found: corner.len() });
        }
        if let Some(&value) = corner.iter().find(|x| x.is_nan()) {
            return Err(MeshError::NotFinite { field, value });
        }
    }
    for (axis, (&min, &max)) in selection.min.iter().zip(&selection.max).enumerate() {
        if min > max {
            return Err(MeshError::BoxReversed { axis, min, max });
        }
    }
    let tolerance = TOLERANCE * mesh.diagonal();
    Ok(filter(mesh, |x| {
        let bounds = selection.min.iter().zip(&selection.max);
        x.iter().zip(bounds).all(|(x, (min, max))| *x >= min - tolerance && *x <= max + tolerance)
    }))
}

fn below(mesh: &Mesh, wall: &HalfSpace) -> Result<Vec<u32>, MeshError> {
    vector("normal", &wall.normal, mesh.dimension)?;
    finite("offset", wall.offset)?;
    let normal = direction(&wall.normal).ok_or(MeshError::ZeroNormal)?;
    let bound = wall.offset + TOLERANCE * mesh.diagonal();
    let height = |x: &[f64]| x.iter().zip(&normal).map(|(x, n)| x * n).sum::<f64>();
    Ok(filter(mesh, |x| height(x) <= bound))
}

fn listed(mesh: &Mesh, vertices: &[u32]) -> Result<Vec<u32>, MeshError> {
    let count = mesh.vertex_count();
    if let Some(&vertex) = vertices.iter().find(|&&v| v as usize >= count) {
        return Err(MeshError::SelectedVertex { vertex, count });
    }
    let mut sorted = vertices.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    Ok(sorted)
}

fn group(mesh: &Mesh, name: &str) -> Result<Vec<u32>, MeshError> {
    if let Some(group) = mesh.groups.get(name) {
        return Ok(group.vertices.clone());
    }
    // Above a similarity of 0.7 a name counts as a typing mistake, as in clap and cargo.
    let suggestion = mesh
        .groups
        .keys()
        .map(|known| (strsim::jaro_winkler(&known.to_lowercase(), &name.to_lowercase()), known))
        .filter(|(similarity, _)| *similarity > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| known.clone());
    Err(MeshError::UnknownGroup {
        name: name.to_string(),
        known: mesh.groups.keys().cloned().collect(),
        suggestion,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Group;
    use crate::test_support::{build_grid, grid};

    /// Vertices at x = 0, 0.1, 0.2 and y = 0, 0.1: index 2 i + j.
    fn mesh() -> Mesh {
        let mut mesh = build_grid(&grid(&[2, 1], 0.1), 2).unwrap();
        let named = |vertices: &[u32]| Group { vertices: vertices.to_vec(), ..Group::default() };
        mesh.groups = [("left".to_string(), named(&[0, 1])), ("right".to_string(), named(&[4, 5]))].into();
        mesh
    }

    fn in_box(min: &[f64], max: &[f64]) -> Result<Vec<u32>, MeshError> {
        select(&mesh(), &Selection::Box(BoxSelection { min: min.to_vec(), max: max.to_vec() }))
    }

    fn half_space(normal: &[f64], offset: f64) -> Result<Vec<u32>, MeshError> {
        select(&mesh(), &Selection::HalfSpace(HalfSpace { normal: normal.to_vec(), offset }))
    }

    #[test]
    fn a_box_takes_its_boundary_and_rounding() {
        assert_eq!(in_box(&[0.0, 0.0], &[0.1, 0.0]).unwrap(), [0, 2]);
        // The diagonal is 0.2236 m: the tolerance is 2.236e-10 m.
        assert_eq!(in_box(&[0.1 + 2.2e-10, 0.0], &[0.2, 0.1]).unwrap(), [2, 3, 4, 5]);
        assert_eq!(in_box(&[0.1 + 2.3e-10, 0.0], &[0.2, 0.1]).unwrap(), [4, 5]);
        assert_eq!(in_box(&[0.0, 0.0], &[0.1 - 2.3e-10, f64::INFINITY]).unwrap(), [0, 1]);
    }

    #[test]
    fn a_half_space_is_measured_along_the_unit_normal() {
        assert_eq!(half_space(&[10.0, 0.0], 0.1).unwrap(), [0, 1, 2, 3]);
        assert_eq!(half_space(&[-1.0, 0.0], -0.1).unwrap(), [2, 3, 4, 5]);
        assert_eq!(half_space(&[1.0, 0.0], 0.1 - 2.2e-10).unwrap(), [0, 1, 2, 3]);
        assert_eq!(half_space(&[1.0, 0.0], 0.1 - 2.3e-10).unwrap(), [0, 1]);
        for size in [f64::from_bits(1), 1e-300, 3.0, 1e300, f64::MAX] {
            let found = half_space(&[size, size], 0.1 / 2.0_f64.sqrt()).unwrap();
            assert_eq!(found, [0, 1, 2], "{size:e}");
        }
    }

    #[test]
    fn lists_are_sorted_and_groups_are_found() {
        assert_eq!(select(&mesh(), &Selection::Vertices(vec![5, 1, 5])).unwrap(), [1, 5]);
        assert_eq!(select(&mesh(), &Selection::Group("right".to_string())).unwrap(), [4, 5]);
    }

    #[test]
    fn faults_are_told_apart() {
        assert!(matches!(
            in_box(&[0.0], &[1.0, 1.0]),
            Err(MeshError::Components { field: "min", found: 1, .. })
        ));
        assert!(matches!(
            in_box(&[0.0; 2], &[f64::NAN, 1.0]),
            Err(MeshError::NotFinite { field: "max", .. })
        ));
        assert!(matches!(in_box(&[0.0, 1.0], &[1.0, 0.5]), Err(MeshError::BoxReversed { axis: 1, .. })));
        assert!(matches!(half_space(&[0.0, 0.0], 1.0), Err(MeshError::ZeroNormal)));
        assert!(matches!(half_space(&[1.0], 1.0), Err(MeshError::Components { field: "normal", .. })));
        assert!(matches!(
            half_space(&[1.0, 0.0], f64::NAN),
            Err(MeshError::NotFinite { field: "offset", .. })
        ));
        assert!(matches!(
            select(&mesh(), &Selection::Vertices(vec![1, 6])),
            Err(MeshError::SelectedVertex { vertex: 6, count: 6 })
        ));
    }

    #[test]
    fn nothing_selected_is_an_error_that_says_where_the_body_is() {
        let message = in_box(&[1.0, 1.0], &[2.0, 2.0]).unwrap_err().to_string();
        assert_eq!(
            message,
            "the box from [1.0, 1.0] to [2.0, 2.0] selects no vertex; the body spans [0.0, 0.0] to [0.2, 0.1]"
        );
        for nothing in [half_space(&[1.0, 0.0], -1.0), select(&mesh(), &Selection::Vertices(Vec::new()))] {
            assert!(matches!(nothing, Err(MeshError::NothingSelected { .. })));
        }
    }

    #[test]
    fn an_unknown_group_is_answered_with_the_known_ones() {
        let ask = |name: &str| select(&mesh(), &Selection::Group(name.to_string())).unwrap_err().to_string();
        assert_eq!(
            ask("Rigth"),
            "there is no group `Rigth` (did you mean `right`?); the mesh has `left`, `right`"
        );
        assert_eq!(ask("zzz"), "there is no group `zzz`; the mesh has `left`, `right`");
        let plain = build_grid(&grid(&[1, 1], 1.0), 2).unwrap();
        let message = select(&plain, &Selection::Group("top".to_string())).unwrap_err().to_string();
        assert_eq!(message, "there is no group `top`; the mesh has no groups");
    }
}
