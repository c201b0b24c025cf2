//! Scaling, rotation and translation of meshes.

use super::build::{finite, vector};
use super::{Mesh, MeshError, turn};
use crate::spec::{RotateSpec, TransformSpec};
use pliant::algebra::direction;
use pliant::value::OneOrMany;

/// Moves every vertex to `centre + R S (X - centre) + translate`: first the scaling along the axes, then
/// the rotation, then the translation.
///
/// If the factors mirror the mesh, the vertices of its cells are reordered: volumes stay positive and
/// surfaces keep facing outwards. Multiplications by 1 and additions of 0 preserve the bits.
pub(super) fn apply(spec: &TransformSpec, mesh: &mut Mesh) -> Result<(), MeshError> {
    let dimension = mesh.dimension;
    let scale = factors(spec.scale.as_ref(), dimension)?;
    let rotation = spec.rotate.as_ref().map(|spec| rotation(spec, dimension)).transpose()?;
    let zeros = vec![0.0; dimension];
    let centre = spec.centre.as_ref().unwrap_or(&zeros);
    vector("centre", centre, dimension)?;
    let translate = spec.translate.as_ref().unwrap_or(&zeros);
    vector("translate", translate, dimension)?;
    for point in mesh.points.chunks_exact_mut(dimension) {
        let mut offset = [0.0; 3];
        for axis in 0..dimension {
            offset[axis] = scale[axis] * (point[axis] - centre[axis]);
        }
        if let Some(rows) = rotation {
            offset = rows.map(|row| row[0] * offset[0] + row[1] * offset[1] + row[2] * offset[2]);
        }
        for axis in 0..dimension {
            point[axis] = centre[axis] + offset[axis] + translate[axis];
        }
    }
    if scale.iter().filter(|factor| **factor < 0.0).count() % 2 == 1 {
        mirror(mesh);
    }
    Ok(())
}

/// Scale factor of each axis, none of them 0.
fn factors(scale: Option<&OneOrMany>, dimension: usize) -> Result<Vec<f64>, MeshError> {
    let factors = match scale {
        None => vec![1.0; dimension],
        Some(OneOrMany::One(factor)) => vec![*factor; dimension],
        Some(OneOrMany::Many(factors)) => factors.clone(),
    };
    vector("scale", &factors, dimension)?;
    if factors.contains(&0.0) { Err(MeshError::Zero { field: "scale" }) } else { Ok(factors) }
}

/// Rotation matrix by `angle` about `axis`; in the plane about the z-axis.
fn rotation(spec: &RotateSpec, dimension: usize) -> Result<[[f64; 3]; 3], MeshError> {
    finite("angle", spec.angle)?;
    let axis = match (&spec.axis, dimension) {
        (None, 2) => vec![0.0, 0.0, 1.0],
        (None, _) => return Err(MeshError::Components { field: "axis", expected: 3, found: 0 }),
        (Some(axis), 2) => {
            return Err(MeshError::Components { field: "axis", expected: 0, found: axis.len() });
        }
        (Some(axis), _) => axis.clone(),
    };
    vector("axis", &axis, 3)?;
    let axis = [axis[0], axis[1], axis[2]];
    rotation_about(axis, turn::of_angle(spec.angle)).ok_or(MeshError::Zero { field: "axis" })
}

/// Rotation matrix about `axis` by the angle of this cosine and sine (O. Rodrigues):
/// `cos I + (1 - cos) a a^T + sin [a]_x`; `None` for an axis of length zero.
pub(super) fn rotation_about(axis: [f64; 3], [c, s]: [f64; 2]) -> Option<[[f64; 3]; 3]> {
    let a = direction(&axis)?;
    let cross = [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]];
    let mut rows = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let identity = if i == j { c } else { 0.0 };
            rows[i][j] = identity + (1.0 - c) * a[i] * a[j] + s * cross[i][j];
        }
    }
    Some(rows)
}

/// Exchanges two vertices of every oriented cell, and the affected mid-edge nodes.
fn mirror(mesh: &mut Mesh) {
    mesh.triangles.iter_mut().for_each(|cell| cell.swap(1, 2));
    mesh.tetrahedra.iter_mut().for_each(|cell| cell.swap(1, 2));
    for block in &mut mesh.blocks {
        let (kind, before) = (block.kind, block.vertices.clone());
        let cells = block.vertices.chunks_exact_mut(kind.nodes).zip(before.chunks_exact(kind.nodes));
        cells.for_each(|(cell, before)| {
            cell.iter_mut().zip(kind.mirror).for_each(|(vertex, node)| *vertex = before[*node]);
        });
    }
    if let Some(skin) = &mut mesh.skin {
        skin.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    // Edges 01, 12, 20 become 02, 21, 10.
    mesh.triangle_middles.iter_mut().for_each(|middles| middles.swap(0, 2));
    for middles in &mut mesh.tetrahedron_middles {
        // Edges 01, 12, 02, 03, 13, 23 become 02, 21, 01, 03, 23, 13.
        middles.swap(0, 2);
        middles.swap(4, 5);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};
    use std::path::Path;

    use super::*;
    use crate::spec::{BallSpec, GridSpec, MeshSpec};
    use crate::test_support::{build_grid, grid};

    fn volume(mesh: &Mesh) -> f64 {
        super::super::check::check(mesh).unwrap();
        mesh.quality().elements.unwrap().total_volume
    }

    fn transformed(mesh: &Mesh, spec: &TransformSpec) -> Mesh {
        let mut mesh = mesh.clone();
        apply(spec, &mut mesh).unwrap();
        mesh
    }

    /// A box away from the origin.
    fn cuboid() -> Mesh {
        build_grid(&GridSpec { origin: Some(vec![1.0, 2.0, 3.0]), ..grid(&[2, 1, 1], 0.5) }, 3).unwrap()
    }

    #[test]
    fn scaled_then_rotated_about_the_centre_then_moved() {
        let spec = TransformSpec {
            scale: Some(OneOrMany::Many(vec![2.0, 3.0, 4.0])),
            rotate: Some(RotateSpec { axis: Some(vec![0.0, 0.0, 2.0]), angle: FRAC_PI_2 }),
            centre: Some(vec![1.0, 0.0, 0.0]),
            translate: Some(vec![0.0, 0.0, -10.0]),
        };
        let moved = transformed(&cuboid(), &spec);
        for (i, x) in cuboid().points.chunks(3).enumerate() {
            // Computed by hand: (x - 1, y, z) becomes (-3 y, 2 (x - 1), 4 z - 10), and 1 is added.
            let expected = [1.0 - 3.0 * x[1], 2.0 * (x[0] - 1.0), 4.0 * x[2] - 10.0];
            for axis in 0..3 {
                assert!(
                    (moved.point(i)[axis] - expected[axis]).abs() < 1e-14,
                    "{:?} {expected:?}",
                    moved.point(i)
                );
            }
        }
        assert!((volume(&moved) / (24.0 * volume(&cuboid())) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_rotation_keeps_lengths_whatever_its_axis() {
        for (axis, angle) in
            [([1.0, 2.0, -3.0], 0.7), ([1e-200, 0.0, 1e-200], -2.0), ([0.0, 1e200, 0.0], 100.0)]
        {
            let rotate = Some(RotateSpec { axis: Some(axis.to_vec()), angle });
            let moved = transformed(&cuboid(), &TransformSpec { rotate, ..TransformSpec::default() });
            assert!((volume(&moved) / volume(&cuboid()) - 1.0).abs() < 1e-14);
            let length = |p: &[f64]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
            for i in 0..moved.vertex_count() {
                assert!((length(moved.point(i)) / length(cuboid().point(i)) - 1.0).abs() < 4e-15);
            }
        }
        let plane = build_grid(&grid(&[1, 1], 1.0), 2).unwrap();
        let rotate = Some(RotateSpec { axis: None, angle: PI });
        let turned = transformed(&plane, &TransformSpec { rotate, ..TransformSpec::default() });
        assert!(turned.points.iter().zip(&plane.points).all(|(a, b)| (a + b).abs() < 1e-15));
    }

    #[test]
    fn mirrored_meshes_keep_positive_volumes_and_outward_surfaces() {
        let scale = Some(OneOrMany::Many(vec![1.0, -1.0, 1.0]));
        let spec = TransformSpec { scale, ..TransformSpec::default() };
        let ball = BallSpec { radius: 1.0, cells: 2, centre: Some(vec![0.0, 3.0, 0.0]) };
        let ball = super::super::build(&MeshSpec::Ball(ball), 3, Path::new(".")).unwrap();
        for mesh in [cuboid(), ball, cuboid().promoted_to_quadratic().unwrap()] {
            let mirrored = transformed(&mesh, &spec);
            assert!((volume(&mirrored) / volume(&mesh) - 1.0).abs() < 1e-14);
            let twice = transformed(&mirrored, &spec);
            assert_eq!(twice, mesh, "twice is never");
            let middle = |mesh: &Mesh| {
                let (Some(cell), Some(middles)) = (mesh.tetrahedra.first(), mesh.tetrahedron_middles.first())
                else {
                    return true;
                };
                pliant::element::TETRAHEDRON_EDGES.iter().zip(middles).all(|(&[a, b], &m)| {
                    let (a, b, m) =
                        (mesh.point(cell[a] as usize), mesh.point(cell[b] as usize), mesh.point(m as usize));
                    (0..3).all(|i| (0.5 * (a[i] + b[i]) - m[i]).abs() < 1e-15)
                })
            };
            assert!(middle(&mesh) && middle(&mirrored));
        }
        let flipped = TransformSpec { scale: Some(OneOrMany::One(-2.0)), ..TransformSpec::default() };
        assert!((volume(&transformed(&cuboid(), &flipped)) / (8.0 * volume(&cuboid())) - 1.0).abs() < 1e-14);
        let plane = build_grid(&grid(&[2, 3], 1.0), 2).unwrap();
        assert_eq!(volume(&transformed(&plane, &flipped)), 24.0);
    }

    #[test]
    fn faults_are_told_apart() {
        let fault = |spec: TransformSpec| apply(&spec, &mut cuboid()).unwrap_err();
        let none = TransformSpec::default;
        let scale =
            |factors: &[f64]| TransformSpec { scale: Some(OneOrMany::Many(factors.to_vec())), ..none() };
        assert!(matches!(fault(scale(&[1.0, 0.0, 1.0])), MeshError::Zero { field: "scale" }));
        assert!(matches!(fault(scale(&[1.0, 2.0])), MeshError::Components { field: "scale", found: 2, .. }));
        assert!(matches!(fault(scale(&[1.0, f64::NAN, 1.0])), MeshError::NotFinite { field: "scale", .. }));
        let rotate = |axis: Option<&[f64]>, angle| TransformSpec {
            rotate: Some(RotateSpec { axis: axis.map(<[f64]>::to_vec), angle }),
            ..none()
        };
        assert!(matches!(fault(rotate(None, 1.0)), MeshError::Components { field: "axis", found: 0, .. }));
        assert!(matches!(fault(rotate(Some(&[0.0; 3]), 1.0)), MeshError::Zero { field: "axis" }));
        assert!(matches!(
            fault(rotate(Some(&[1.0; 3]), f64::INFINITY)),
            MeshError::NotFinite { field: "angle", .. }
        ));
        let translate = TransformSpec { translate: Some(vec![0.0; 2]), ..none() };
        assert!(matches!(fault(translate), MeshError::Components { field: "translate", .. }));
    }
}
