//! Curved boundaries of generated second-order meshes: mid-edge nodes are placed on the spheres, circles
//! and ellipses that contain the vertices.

use super::{Mesh, elliptic_membrane};
use crate::spec::MeshSpec;

/// Directions that differ by less count as equal: their edge is straight.
const STRAIGHT: f64 = 1e-12;

/// Moves the mid-edge nodes of a round mesh: to the mean radius of the edge's ends, in the mean of their
/// directions, about the centre of a ball or the axis of a cylinder. An edge between two vertices of a
/// shell becomes an arc, a radial edge stays straight.
///
/// With nodes on the boundary the geometric error falls from order 2 to order 3 and more: P. G. Ciarlet,
/// P.-A. Raviart, "Interpolation theory over curved elements, with applications to finite element
/// methods", Computer Methods in Applied Mechanics and Engineering 1 (1972), 217-249.
pub(super) fn curve(shape: &MeshSpec, mesh: &mut Mesh) {
    // The centre, and the number of coordinates measured from it.
    let (centre, round) = match shape {
        MeshSpec::Ball(spec) => (&spec.centre, 3),
        MeshSpec::Sphere(spec) => (&spec.centre, 3),
        MeshSpec::Cylinder(spec) => (&spec.origin, 2),
        MeshSpec::Tube(spec) => (&spec.origin, 2),
        MeshSpec::Annulus(spec) => (&spec.centre, 2),
        MeshSpec::EllipticMembrane(spec) => {
            elliptic_membrane::curve(spec, mesh);
            return mesh.centre();
        }
        _ => return,
    };
    let centre = centre.clone().unwrap_or_else(|| vec![0.0; round]);
    for ([a, b], middle) in mesh.middles() {
        let ends = [a, b].map(|end| radius_and_direction(mesh.point(end as usize), &centre, round));
        let [Some((r, u)), Some((s, v))] = ends else { continue };
        let sum = [0, 1, 2].map(|c| u[c] + v[c]);
        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (2.0 - length).abs() < STRAIGHT || length < STRAIGHT {
            continue;
        }
        let first = middle as usize * mesh.dimension;
        for c in 0..round {
            mesh.points[first + c] = centre[c] + (0.5 * r + 0.5 * s) * (sum[c] / length);
        }
    }
    mesh.centre();
}

/// Distance of a point from the centre in the first `round` coordinates, and the unit direction; `None`
/// at the centre.
fn radius_and_direction(point: &[f64], centre: &[f64], round: usize) -> Option<(f64, [f64; 3])> {
    let mut arm = [0.0; 3];
    (0..round).for_each(|c| arm[c] = point[c] - centre[c]);
    let radius = arm.iter().map(|x| x * x).sum::<f64>().sqrt();
    (radius > 0.0).then(|| (radius, arm.map(|x| x / radius)))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::path::Path;

    use super::*;
    use crate::build_body;
    use crate::spec::{BodyMesh, CellOrder};

    fn built(shape: &str, dimension: usize) -> Mesh {
        let shape: MeshSpec = serde_json::from_str(shape).unwrap();
        let body =
            BodyMesh { shape: &shape, order: CellOrder::Quadratic, refine: 0, transform: None, repeat: None };
        // `build_body` checks that det J is positive everywhere in every element.
        build_body(&body, dimension, Path::new(".")).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Area or volume by quadrature of the elements' det J.
    fn content(mesh: &Mesh) -> f64 {
        mesh.quality().elements.unwrap().total_volume
    }

    type Shape = (fn(usize) -> String, usize, f64);

    const SHAPES: [Shape; 4] = [
        (
            |n| format!(r#"{{ "ball": {{ "radius": 2.0, "cells": {n}, "centre": [1, 2, 3] }} }}"#),
            3,
            32.0 / 3.0,
        ),
        (
            |n| {
                format!(
                    r#"{{ "cylinder": {{ "radius": 1.0, "height": 2.0, "cells": [{n}, {n}], "origin": [1, 2, 3] }} }}"#
                )
            },
            3,
            2.0,
        ),
        (
            |n| {
                format!(
                    r#"{{ "tube": {{ "inner_radius": 1.0, "outer_radius": 2.0, "height": 0.5, "cells": [{n}, {}, 1] }} }}"#,
                    6 * n
                )
            },
            3,
            1.5,
        ),
        (
            |n| {
                format!(
                    r#"{{ "annulus": {{ "inner_radius": 1.0, "outer_radius": 2.0, "cells": [{n}, {}] }} }}"#,
                    6 * n
                )
            },
            2,
            3.0,
        ),
    ];

    #[test]
    fn contents_of_round_bodies_converge_at_order_four() {
        for (shape, dimension, exact) in SHAPES {
            let error = |n: usize| (content(&built(&shape(n), dimension)) / (PI * exact) - 1.0).abs();
            let errors = [2, 4, 8].map(error);
            for pair in errors.windows(2) {
                let order = (pair[0] / pair[1]).log2();
                assert!((3.6..4.4).contains(&order), "{}: {errors:?}", shape(2));
            }
        }
    }

    #[test]
    fn nodes_of_the_boundary_lie_on_it() {
        for (shape, dimension, _) in SHAPES {
            let mesh = built(&shape(3), dimension);
            let (group, centre, radius, round) = match &shape(3)[3..7] {
                "ball" => ("surface", [1.0, 2.0, 3.0], 2.0, 3),
                "cyli" => ("side", [1.0, 2.0, 3.0], 1.0, 2),
                _ => ("outer", [0.0; 3], 2.0, 2),
            };
            for &vertex in &mesh.groups[group].vertices {
                let (r, _) = radius_and_direction(mesh.point(vertex as usize), &centre, round).unwrap();
                assert!((r - radius).abs() < 4e-15 * radius, "{r}");
            }
        }
    }

    /// Triangles and quadrilaterals of both kinds.
    #[test]
    fn nodes_of_elliptic_sides_lie_on_them() {
        let quadrilateral = r#", "element": "quadrilateral""#;
        let lagrange = (quadrilateral, CellOrder::Quadratic);
        for (element, order) in
            [("", CellOrder::Quadratic), lagrange, (quadrilateral, CellOrder::Serendipity)]
        {
            for cells in ["[1, 1]", "[3, 1]", "[2, 5]"] {
                let shape = format!(r#"{{ "elliptic_membrane": {{ "cells": {cells}{element} }} }}"#);
                let shape: MeshSpec = serde_json::from_str(&shape).unwrap();
                let body = BodyMesh { shape: &shape, order, refine: 0, transform: None, repeat: None };
                let mesh = build_body(&body, 2, Path::new(".")).unwrap_or_else(|error| panic!("{error}"));
                for (side, [a, b]) in [("inner", [2.0, 1.0]), ("outer", [3.25, 2.75])] {
                    let group = &mesh.groups[side];
                    assert!(group.vertices.len() > group.cells.len() + 1, "{side}: no nodes in the middle");
                    for &vertex in &group.vertices {
                        let [x, y] = mesh.point(vertex as usize) else { panic!("a plane mesh") };
                        let distance = (x / a).hypot(y / b) - 1.0;
                        assert!(distance.abs() < 1e-14, "{cells}, {side}: {distance:e}");
                    }
                }
            }
        }
    }

    /// The coarsest meshes, thin rings and the longest arcs.
    #[test]
    fn no_generated_side_folds_its_element() {
        for n in [1, 2, 5] {
            for (shape, dimension, _) in &SHAPES[..2] {
                built(&shape(n), *dimension);
            }
        }
        for inner in [0.01, 0.5, 0.9, 0.99] {
            for cells in [[1, 3], [8, 3], [1, 4], [3, 5], [1, 40], [20, 7]] {
                let [radial, around] = cells;
                let ring = format!(r#""inner_radius": {inner}, "outer_radius": 1.0"#);
                built(&format!(r#"{{ "annulus": {{ {ring}, "cells": [{radial}, {around}] }} }}"#), 2);
                let tube = format!(r#"{ring}, "height": 0.3, "cells": [{radial}, {around}, 2]"#);
                built(&format!(r#"{{ "tube": {{ {tube} }} }}"#), 3);
            }
        }
    }
}
