//! A straight chain of equal segments.

use super::build::{at_least_one, vector};
use super::{Mesh, MeshError, MeshSize};
use crate::spec::StrandSpec;

/// Counts of the chain.
pub(super) fn size(spec: &StrandSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    at_least_one("segments", spec.segments)?;
    let edges = spec.segments as u64;
    MeshSize { vertices: edges.saturating_add(1), edges, ..MeshSize::default() }.checked(dimension)
}

/// Builds the chain. Vertex `i` lies at `(1 - i/n) start + i/n end`, both ends exactly; edge `i` joins
/// vertices `i` and `i + 1`.
pub(super) fn build(spec: &StrandSpec, dimension: usize) -> Result<Mesh, MeshError> {
    let size = size(spec, dimension)?;
    vector("start", &spec.start, dimension)?;
    vector("end", &spec.end, dimension)?;
    if spec.start == spec.end {
        return Err(MeshError::ZeroLengthStrand);
    }
    let mut mesh = Mesh { dimension, ..Mesh::default() };
    size.reserve(&mut mesh.points, size.vertices * dimension as u64)?;
    size.reserve(&mut mesh.edges, size.edges)?;
    for i in 0..=spec.segments {
        let s = i as f64 / spec.segments as f64;
        mesh.points.extend(spec.start.iter().zip(&spec.end).map(|(a, b)| (1.0 - s) * a + s * b));
    }
    mesh.edges.extend((0..spec.segments as u32).map(|i| [i, i + 1]));
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::spec::MeshSpec;

    fn built(segments: usize, start: &[f64], end: &[f64]) -> Result<Mesh, MeshError> {
        let spec = StrandSpec { segments, start: start.to_vec(), end: end.to_vec() };
        crate::build(&MeshSpec::Strand(spec), 2, Path::new("."))
    }

    #[test]
    fn both_ends_are_exact_and_segments_equal() {
        // 1 + (1e-17 - 1) would be 0.
        let mesh = built(3, &[1.0, 0.7], &[1e-17, -1.1]).unwrap();
        assert_eq!((mesh.point(0), mesh.point(3)), (&[1.0, 0.7][..], &[1e-17, -1.1][..]));
        assert_eq!(mesh.edges, [[0, 1], [1, 2], [2, 3]]);
        assert!((mesh.point(1)[1] - 0.1).abs() < 1e-15);
        assert!(mesh.triangles.is_empty());
    }

    #[test]
    fn faults_of_the_specification_are_told_apart() {
        assert!(matches!(
            built(0, &[0.0, 0.0], &[1.0, 0.0]),
            Err(MeshError::ZeroCount { field: "segments" })
        ));
        assert!(matches!(built(2, &[1.0, 0.0], &[1.0, 0.0]), Err(MeshError::ZeroLengthStrand)));
        assert!(matches!(
            built(2, &[1.0], &[1.0, 0.0]),
            Err(MeshError::Components { field: "start", expected: 2, found: 1 })
        ));
        assert!(matches!(
            built(2, &[1.0, f64::INFINITY], &[1.0, 0.0]),
            Err(MeshError::NotFinite { field: "start", value: f64::INFINITY })
        ));
    }
}
