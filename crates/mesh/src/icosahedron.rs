//! The icosahedron, and lattices on its faces for balls and spheres.

use std::collections::BTreeMap;

/// Vertices of the icosahedron on the unit sphere.
fn vertices() -> [[f64; 3]; 12] {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let length = (1.0 + golden * golden).sqrt();
    let (a, b) = (1.0 / length, golden / length);
    [
        [-a, b, 0.0],
        [a, b, 0.0],
        [-a, -b, 0.0],
        [a, -b, 0.0],
        [0.0, -a, b],
        [0.0, a, b],
        [0.0, -a, -b],
        [0.0, a, -b],
        [b, 0.0, -a],
        [b, 0.0, a],
        [-b, 0.0, -a],
        [-b, 0.0, a],
    ]
}

/// Faces with ascending vertices, so that neighbours divide their common side alike. The vertex positions
/// determine whether a face is counter-clockwise seen from outside.
pub(super) const FACES: [[usize; 3]; 20] = [
    [0, 5, 11],
    [0, 1, 5],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [4, 5, 11],
    [2, 10, 11],
    [6, 7, 10],
    [1, 7, 8],
    [3, 4, 9],
    [2, 3, 4],
    [2, 3, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 5, 9],
    [2, 4, 11],
    [2, 6, 10],
    [6, 7, 8],
    [1, 8, 9],
];

/// Concentric shells of points: each shell is a division of the icosahedron's faces, projected to a
/// sphere. Points are numbered in the order of their first use.
#[derive(Default)]
pub(super) struct Shells {
    /// Flat `(n, 3)`, for the unit ball.
    pub points: Vec<f64>,
    /// Index of a point, by the icosahedron's vertices of non-zero weight and their weights.
    known: BTreeMap<[(usize, usize); 3], u32>,
}

impl Shells {
    /// Index of the point on shell `weights[0] + weights[1] + weights[2]` of `shells`, in the direction
    /// of the weighted sum of a face's vertices.
    pub(super) fn point(&mut self, face: [usize; 3], weights: [usize; 3], shells: usize) -> u32 {
        // Vertices of weight zero are omitted from the key: a point on a side belongs to both faces.
        let mut key = [(usize::MAX, 0); 3];
        let used = (0..3).filter(|&i| weights[i] > 0).map(|i| (face[i], weights[i]));
        key.iter_mut().zip(used).for_each(|(entry, used)| *entry = used);
        let next = self.known.len() as u32;
        let index = *self.known.entry(key).or_insert(next);
        if index == next {
            let corners = vertices();
            let mut sum = [0.0; 3];
            for (vertex, weight) in key.into_iter().filter(|(_, weight)| *weight > 0) {
                for axis in 0..3 {
                    sum[axis] += weight as f64 * corners[vertex][axis];
                }
            }
            let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
            let shell = weights.iter().sum::<usize>() as f64 / shells as f64;
            self.points.extend(sum.map(|x| if length > 0.0 { shell * (x / length) } else { 0.0 }));
        }
        index
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_faces_are_those_of_the_icosahedron() {
        let corners = vertices();
        let distance =
            |a: usize, b: usize| (0..3).map(|i| (corners[a][i] - corners[b][i]).powi(2)).sum::<f64>().sqrt();
        let edge = 4.0 / (10.0 + 2.0 * 5.0_f64.sqrt()).sqrt();
        let mut sides: Vec<[usize; 2]> = Vec::new();
        for face in FACES {
            assert!(face.is_sorted());
            for side in [[face[0], face[1]], [face[1], face[2]], [face[0], face[2]]] {
                assert!((distance(side[0], side[1]) - edge).abs() < 1e-14, "{face:?}");
                sides.push(side);
            }
        }
        sides.sort_unstable();
        assert!(sides.chunk_by(|a, b| a == b).all(|run| run.len() == 2));
        assert_eq!(sides.len(), 60);
    }
}
