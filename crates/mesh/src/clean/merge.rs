//! `merge`: merges vertices within a tolerance.

use std::collections::HashMap;

use super::{Cleaned, CleaningStep};
use crate::Mesh;
use crate::MeshError;
use crate::file::FileMesh;
use crate::spec::FileSpec;
use pliant::lanes::hypot;

pub(super) const STEP: CleaningStep = CleaningStep {
    asked: |spec| spec.merge.is_some(),
    apply,
    cures: |error| matches!(error, MeshError::ZeroLengthEdge { .. }),
    advice: "`merge = 0.0` next to `path` joins vertices at the same position, `merge = \"1 um\"` those \
             within that distance",
};

fn apply(spec: &FileSpec, file: &mut FileMesh) -> Result<Vec<Cleaned>, MeshError> {
    let tolerance = spec.merge.unwrap_or(0.0);
    let targets = targets(&file.mesh, tolerance);
    let keep: Vec<bool> = (0..).zip(&targets).map(|(vertex, &target)| vertex == target).collect();
    let kept = super::consecutive(&keep);
    let numbers = targets.iter().map(|&target| kept[target as usize]).collect();
    file.retain_vertices(&keep, &numbers);
    let first_vertex = keep.iter().position(|keep| !keep);
    let count = keep.iter().filter(|keep| !**keep).count();
    Ok(vec![Cleaned { first_vertex, ..Cleaned::new("merge", "merged", count, "vertices") }])
}

/// Representative of each vertex: the lowest vertex within the tolerance that represents itself. No
/// vertex moves farther than the tolerance: chains of close vertices do not collapse.
pub(super) fn targets(mesh: &Mesh, tolerance: f64) -> Vec<u32> {
    let mut buckets = Buckets { mesh, tolerance, cells: HashMap::new() };
    (0..mesh.vertex_count() as u32)
        .map(|vertex| buckets.near(vertex).unwrap_or_else(|| buckets.enter(vertex)))
        .collect()
}

/// Hash grid of the vertices that represent themselves; at a tolerance of 0 the key is the coordinates'
/// bits.
struct Buckets<'a> {
    mesh: &'a Mesh,
    tolerance: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Buckets<'_> {
    /// Grid cube of the point moved by `offset` along every axis. The map is monotonic, rounding
    /// included: all close points lie between the cubes at `-tolerance` and `+tolerance`.
    fn cube(&self, point: &[f64], offset: f64) -> [i64; 3] {
        let width = 4.0 * self.tolerance;
        let mut cube = [0; 3];
        for (cube, &x) in cube.iter_mut().zip(point) {
            // Adding 0.0 turns -0 into 0; the cast saturates.
            let x = x + offset + 0.0;
            *cube = if width > 0.0 { (x / width).floor() as i64 } else { x.to_bits() as i64 };
        }
        cube
    }

    /// Lowest registered vertex within the tolerance.
    fn near(&self, vertex: u32) -> Option<u32> {
        let point = self.mesh.point(vertex as usize);
        let (low, high) = (self.cube(point, -self.tolerance), self.cube(point, self.tolerance));
        let is_near = |other: &u32| distance(point, self.mesh.point(*other as usize)) <= self.tolerance;
        let mut found = None;
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                for k in low[2]..=high[2] {
                    let entered = self.cells.get(&[i, j, k]).map_or(&[][..], Vec::as_slice);
                    let near = entered.iter().copied().find(is_near);
                    found = found.into_iter().chain(near).min();
                }
            }
        }
        found
    }

    /// Registers a vertex as its own representative.
    fn enter(&mut self, vertex: u32) -> u32 {
        let cube = self.cube(self.mesh.point(vertex as usize), 0.0);
        self.cells.entry(cube).or_default().push(vertex);
        vertex
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0_f64, |sum, (a, b)| hypot(sum, a - b))
}
