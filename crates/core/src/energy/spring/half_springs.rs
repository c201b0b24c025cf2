//! Half-springs: every spring listed at both of its ends.

use crate::lanes::WIDTH;

/// Spring as seen from one of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct HalfSpring {
    /// Other end, counted from the first vertex.
    pub(super) neighbour: u32,
    /// Index of the spring.
    pub(super) spring: u32,
}

/// Springs of each vertex of a range, sorted by neighbour and then by index.
#[derive(Debug)]
pub(super) struct HalfSprings {
    /// First vertex that has springs.
    pub(super) first_vertex: usize,
    /// `half[start[i]..start[i + 1]]` belong to vertex `first_vertex + i`.
    start: Vec<u32>,
    half: Vec<HalfSpring>,
}

impl HalfSprings {
    /// Sorts `edges`.
    ///
    /// # Panics
    /// If an edge joins a vertex to itself, or there are more than `u32::MAX / 2` edges.
    pub(super) fn new(edges: &[[u32; 2]]) -> Self {
        assert!(edges.len() <= u32::MAX as usize / 2, "more springs than can be numbered");
        let (first, end) = edges
            .iter()
            .flatten()
            .fold((u32::MAX, 0), |(first, end), &v| (first.min(v), end.max(v as usize + 1)));
        let first_vertex = if edges.is_empty() { 0 } else { first as usize };
        let mut start = vec![0u32; end - first_vertex + 1];
        for (spring, &[a, b]) in edges.iter().enumerate() {
            assert!(a != b, "spring {spring} joins vertex {a} to itself");
            start[a as usize - first_vertex + 1] += 1;
            start[b as usize - first_vertex + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let mut half = vec![HalfSpring { neighbour: 0, spring: 0 }; 2 * edges.len()];
        for (spring, edge) in edges.iter().enumerate() {
            let [a, b] = edge.map(|v| v - first_vertex as u32);
            for (own, neighbour) in [(a, b), (b, a)] {
                half[next[own as usize] as usize] = HalfSpring { neighbour, spring: spring as u32 };
                next[own as usize] += 1;
            }
        }
        for i in 0..start.len() - 1 {
            half[start[i] as usize..start[i + 1] as usize].sort_unstable();
        }
        HalfSprings { first_vertex, start, half }
    }

    /// Returns the number of vertices from the first to the last that have springs.
    pub(super) fn vertex_count(&self) -> usize {
        self.start.len() - 1
    }

    /// Returns the number of blocks of `WIDTH` vertices.
    pub(super) fn block_count(&self) -> usize {
        self.vertex_count().div_ceil(WIDTH)
    }

    /// Returns the number of half-springs: two for every spring.
    pub(super) fn len(&self) -> usize {
        self.half.len()
    }

    /// Returns the half-springs of vertex `first_vertex + i`; none beyond the last.
    pub(super) fn of(&self, i: usize) -> &[HalfSpring] {
        match self.start.get(i..i + 2) {
            Some(range) => &self.half[range[0] as usize..range[1] as usize],
            None => &[],
        }
    }
}
