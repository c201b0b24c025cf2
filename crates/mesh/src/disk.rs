//! Random points in a disk or annulus.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use super::build::{at_least_one, finite, positive, vector};
use super::{Mesh, MeshError, MeshSize};
use crate::spec::DiskSpec;

/// Default stream of the generator in the PCG library.
const STREAM: u128 = 0x0a02_bdbf_7bb3_c0a7_ac28_fa16_a64a_bf96;

/// Counts of the disk.
pub(super) fn size(spec: &DiskSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    at_least_one("count", spec.count)?;
    MeshSize { vertices: spec.count as u64, ..MeshSize::default() }.checked(dimension)
}

/// Builds points uniform over the area `inner_radius <= r <= radius` about `centre` in the x-y plane, in
/// 3D also uniform over `thickness` in z. There are no edges and no cells.
///
/// A seed gives the same bits on every machine: only operations that IEEE 754 rounds correctly are used
/// (`+ * /` and the square root). Sines and cosines differ between C libraries, therefore a direction is
/// the normalised position of a random point in the unit disk.
pub(super) fn build(spec: &DiskSpec, dimension: usize) -> Result<Mesh, MeshError> {
    let size = size(spec, dimension)?;
    positive("radius", spec.radius)?;
    for (field, value) in [("inner_radius", spec.inner_radius), ("thickness", spec.thickness)] {
        finite(field, value)?;
        if value < 0.0 {
            return Err(MeshError::Negative { field, value });
        }
    }
    if spec.inner_radius >= spec.radius {
        return Err(MeshError::InnerRadius { inner_radius: spec.inner_radius, radius: spec.radius });
    }
    if dimension == 2 && spec.thickness > 0.0 {
        return Err(MeshError::ThicknessInPlane { thickness: spec.thickness });
    }
    let centre = spec.centre.clone().unwrap_or_else(|| vec![0.0; dimension]);
    vector("centre", &centre, dimension)?;
    let mut mesh = Mesh { dimension, ..Mesh::default() };
    size.reserve(&mut mesh.points, size.vertices * dimension as u64)?;
    let mut random = Pcg64::new(u128::from(spec.seed), STREAM);
    let hole = (spec.inner_radius / spec.radius).powi(2);
    for _ in 0..spec.count {
        let [x, y] = direction(&mut random);
        // The area inside r grows as r^2: r^2 is uniform.
        let r = spec.radius * (hole + unit(&mut random) * (1.0 - hole)).sqrt();
        mesh.points.extend([centre[0] + r * x, centre[1] + r * y]);
        if dimension == 3 {
            mesh.points.push(centre[2] + spec.thickness * (unit(&mut random) - 0.5));
        }
    }
    Ok(mesh)
}

/// Uniform number in [0, 1) with 53 random bits.
fn unit(random: &mut Pcg64) -> f64 {
    (random.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

/// Unit vector in a uniform direction, by rejection: 4/pi attempts on average.
fn direction(random: &mut Pcg64) -> [f64; 2] {
    loop {
        let [x, y] = [2.0 * unit(random) - 1.0, 2.0 * unit(random) - 1.0];
        let square = x * x + y * y;
        if square <= 1.0 && square > 1e-12 {
            let length = square.sqrt();
            return [x / length, y / length];
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::spec::MeshSpec;

    fn annulus() -> DiskSpec {
        DiskSpec { count: 20_000, radius: 2.0, inner_radius: 1.0, centre: None, thickness: 0.5, seed: 7 }
    }

    fn built(spec: DiskSpec, dimension: usize) -> Result<Mesh, MeshError> {
        crate::build(&MeshSpec::Disk(spec), dimension, Path::new("."))
    }

    #[test]
    fn points_are_uniform_over_the_area_and_the_thickness() {
        let mesh = built(annulus(), 3).unwrap();
        assert_eq!((mesh.vertex_count(), mesh.element_dimension()), (20_000, 0));
        // Four rings of equal area, eight sectors, four layers: 1/128 of the points each, 156 +- 12.4.
        let mut bins = [0_usize; 128];
        for i in 0..mesh.vertex_count() {
            let [x, y, z] = [mesh.point(i)[0], mesh.point(i)[1], mesh.point(i)[2]];
            let ring = (((x * x + y * y) - 1.0) / 3.0 * 4.0) as usize;
            let sector = ((y.atan2(x) / std::f64::consts::TAU + 0.5) * 8.0) as usize;
            let layer = ((z / 0.5 + 0.5) * 4.0) as usize;
            bins[(ring.min(3) * 8 + sector.min(7)) * 4 + layer.min(3)] += 1;
        }
        let expected = 20_000.0 / 128.0;
        let chi_square: f64 = bins.iter().map(|&n| (n as f64 - expected).powi(2) / expected).sum();
        // 127 degrees of freedom: mean 127, standard deviation 16.
        assert!(chi_square < 127.0 + 4.0 * 16.0, "{chi_square}");
    }

    #[test]
    fn a_seed_gives_its_points() {
        let points = |seed| built(DiskSpec { count: 3, seed, ..annulus() }, 3).unwrap().points;
        assert_eq!(points(7), points(7));
        assert_ne!(points(7), points(8));
        // Recorded values: the points of a seed must not change with the version.
        assert_eq!(points(7)[..2], FIRST_OF_SEED_7);
    }

    const FIRST_OF_SEED_7: [f64; 2] = [-1.5411511268521028, 0.47102293603128337];

    #[test]
    fn faults_of_the_specification_are_told_apart() {
        let error = |spec: DiskSpec, dimension| built(spec, dimension).unwrap_err();
        assert!(matches!(
            error(DiskSpec { count: 0, ..annulus() }, 3),
            MeshError::ZeroCount { field: "count" }
        ));
        assert!(matches!(
            error(DiskSpec { radius: 0.0, ..annulus() }, 3),
            MeshError::NotPositive { field: "radius", .. }
        ));
        assert!(matches!(
            error(DiskSpec { inner_radius: -1.0, ..annulus() }, 3),
            MeshError::Negative { field: "inner_radius", .. }
        ));
        assert!(matches!(
            error(DiskSpec { inner_radius: 2.0, ..annulus() }, 3),
            MeshError::InnerRadius { .. }
        ));
        assert!(matches!(error(annulus(), 2), MeshError::ThicknessInPlane { thickness: 0.5 }));
        assert!(matches!(
            error(DiskSpec { centre: Some(vec![0.0]), ..annulus() }, 3),
            MeshError::Components { field: "centre", .. }
        ));
        assert!(matches!(
            error(DiskSpec { count: usize::MAX, ..annulus() }, 3),
            MeshError::TooMany { what: "vertices", .. }
        ));
    }
}
