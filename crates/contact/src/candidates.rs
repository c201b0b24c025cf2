//! Pairs of primitives that may come near: those whose boxes meet.
//!
//! Lists are in the order of their numbers, whatever threads found them, and hold no pair that shares a
//! vertex.

use crate::broad_phase::{Bounds, BoundsTree};
use crate::surface::ContactSurface;
use rayon::prelude::*;

/// Queries that one task answers.
const QUERIES: usize = 256;

/// Candidates of a surface with itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CandidatePairs {
    /// Vertex and triangle; in space.
    pub point_triangle: Vec<[u32; 2]>,
    /// Edges, the lower number first; in space.
    pub edge_edge: Vec<[u32; 2]>,
    /// Vertex and edge; in the plane.
    pub point_edge: Vec<[u32; 2]>,
}

/// Bodies that may touch each other, and which may touch themselves.
#[derive(Clone, Debug)]
pub struct BodyPairs {
    count: usize,
    touch: Vec<bool>,
}

impl BodyPairs {
    /// All pairs of `count` bodies, themselves included.
    pub fn all(count: usize) -> Self {
        BodyPairs { count, touch: vec![true; count * count] }
    }

    /// Lets two bodies touch, or pass through each other.
    pub fn set(&mut self, a: u32, b: u32, touch: bool) {
        let (a, b) = (a as usize, b as usize);
        self.touch[a * self.count + b] = touch;
        self.touch[b * self.count + a] = touch;
    }

    /// True if the two bodies touch.
    #[inline]
    pub fn touch(&self, a: u32, b: u32) -> bool {
        self.touch[a as usize * self.count + b as usize]
    }
}

impl CandidatePairs {
    /// Pairs of the surface at `x`, flat `(n, D)` [m], that may be nearer than `reach` [m] on the way to `x +
    /// dx`, or at `x` where nothing moves.
    ///
    /// # Panics
    /// If the surface is of another dimension.
    pub fn gather<const D: usize>(
        surface: &ContactSurface,
        bodies: &BodyPairs,
        x: &[f64],
        dx: Option<&[f64]>,
        reach: f64,
    ) -> Self {
        assert_eq!(surface.dimension, D, "dimension of the surface");
        let points: Vec<[u32; 1]> = surface.vertices.iter().map(|&v| [v]).collect();
        let edges = bounds_of::<D, 2>(&surface.edges, x, dx);
        let search = Search { bodies: &surface.bodies, pairs: bodies, reach };
        let point_bounds = bounds_of::<D, 1>(&points, x, dx);
        if D == 2 {
            let tree = BoundsTree::new(&edges);
            let mut point_edge = search.pairs(&points, &point_bounds, &surface.edges, &tree, false);
            point_edge.iter_mut().for_each(|pair| pair[0] = surface.vertices[pair[0] as usize]);
            return CandidatePairs { point_edge, ..CandidatePairs::default() };
        }
        let triangles = BoundsTree::new(&bounds_of::<D, 3>(&surface.triangles, x, dx));
        let mut point_triangle = search.pairs(&points, &point_bounds, &surface.triangles, &triangles, false);
        point_triangle.iter_mut().for_each(|pair| pair[0] = surface.vertices[pair[0] as usize]);
        let tree = BoundsTree::new(&edges);
        let edge_edge = search.pairs(&surface.edges, &edges, &surface.edges, &tree, true);
        CandidatePairs { point_triangle, edge_edge, point_edge: vec![] }
    }
}

fn bounds_of<const D: usize, const N: usize>(
    primitives: &[[u32; N]],
    x: &[f64],
    dx: Option<&[f64]>,
) -> Vec<Bounds<D>> {
    primitives.par_iter().map(|vertices| Bounds::of_vertices(vertices, x, dx)).collect()
}

struct Search<'a> {
    bodies: &'a [u32],
    pairs: &'a BodyPairs,
    reach: f64,
}

impl Search<'_> {
    /// Pairs of primitives of two kinds whose boxes come within reach; of one kind, each pair once.
    fn pairs<const D: usize, const N: usize, const M: usize>(
        &self,
        queries: &[[u32; N]],
        bounds: &[Bounds<D>],
        others: &[[u32; M]],
        tree: &BoundsTree<D>,
        once: bool,
    ) -> Vec<[u32; 2]> {
        let block = |(b, queries): (usize, &[[u32; N]])| {
            let (mut pairs, mut found) = (vec![], vec![]);
            for (i, query) in (b * QUERIES..).zip(queries) {
                found.clear();
                tree.find(&bounds[i].grown(self.reach), &mut found);
                let after = found.iter().filter(|&&j| !once || j as usize > i);
                let allowed = after.filter(|&&j| self.allows(query, &others[j as usize]));
                pairs.extend(allowed.map(|&j| [i as u32, j]));
            }
            pairs
        };
        let blocks: Vec<Vec<[u32; 2]>> = queries.par_chunks(QUERIES).enumerate().map(block).collect();
        blocks.concat()
    }

    #[inline]
    fn allows<const N: usize, const M: usize>(&self, a: &[u32; N], b: &[u32; M]) -> bool {
        let body = |v: u32| self.bodies[v as usize];
        !a.iter().any(|v| b.contains(v)) && self.pairs.touch(body(a[0]), body(b[0]))
    }
}

/// Candidates that stay complete while vertices move little.
///
/// Gathered with the reach and twice the `margin`, they hold all pairs within reach until bodies, relative to
/// each other, and vertices, relative to their bodies, have moved by more than the margin.
#[derive(Clone, Debug, Default)]
pub struct CandidateCache {
    pairs: CandidatePairs,
    gathered_at: Vec<f64>,
    margin: f64,
    /// Number of gatherings so far.
    pub gatherings: u64,
}

impl CandidateCache {
    /// Candidates within `reach` at `x`, gathered anew with this margin [m] if a vertex has moved too far.
    pub fn at<const D: usize>(
        &mut self,
        surface: &ContactSurface,
        bodies: &BodyPairs,
        x: &[f64],
        reach: f64,
        margin: f64,
    ) -> &CandidatePairs {
        if !self.is_complete::<D>(surface, x) {
            self.pairs = CandidatePairs::gather::<D>(surface, bodies, x, None, reach + 2.0 * margin);
            self.gathered_at.clear();
            self.gathered_at.extend_from_slice(x);
            self.margin = margin;
            self.gatherings += 1;
        }
        &self.pairs
    }

    /// Candidates last gathered.
    pub fn pairs(&self) -> &CandidatePairs {
        &self.pairs
    }

    /// Forgets the candidates: bodies, pairs or reach have changed.
    pub fn clear(&mut self) {
        self.gathered_at.clear();
    }

    /// True if no pair can have come nearer by more than twice the margin: bodies have moved as wholes
    /// relative to each other, and vertices relative to their bodies, by no more than that together.
    pub fn is_complete<const D: usize>(&self, surface: &ContactSurface, x: &[f64]) -> bool {
        if self.gathered_at.len() != x.len() {
            return false;
        }
        let moved = |v: u32| {
            let at = v as usize * D;
            let mut moved = [0.0; D];
            (0..D).for_each(|k| moved[k] = x[at + k] - self.gathered_at[at + k]);
            moved
        };
        let body = |v: u32| surface.bodies[v as usize] as usize;
        let count = surface.vertices.iter().map(|&v| body(v) + 1).max().unwrap_or(0);
        let (mut means, mut vertices) = (vec![[0.0; D]; count], vec![0.0; count]);
        for &v in &surface.vertices {
            let own = moved(v);
            (0..D).for_each(|k| means[body(v)][k] += own[k]);
            vertices[body(v)] += 1.0;
        }
        let present: Vec<usize> = (0..count).filter(|b| vertices[*b] > 0.0).collect();
        for &b in &present {
            means[b].iter_mut().for_each(|m| *m /= vertices[b]);
        }
        let distance =
            |a: &[f64; D], b: &[f64; D]| (0..D).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt();
        let within =
            surface.vertices.iter().map(|&v| distance(&moved(v), &means[body(v)])).fold(0.0, f64::max);
        // Any two bodies differ by at most twice what each differs from the first.
        let first = present.first().map_or([0.0; D], |b| means[*b]);
        let between = present.iter().map(|b| distance(&means[*b], &first)).fold(0.0, f64::max);
        within + between <= self.margin
    }
}
