//! The Hessians of nodes, `K_(bc) = 1/V_a sum_(jl) (dP_ij / dF_kl) (c_ab)_j (c_ac)_l` for the node `a` and
//! each two of its ring.
//!
//! Stencils have all the same size, rings have not. Small rings are filled up by vertices whose blocks are
//! zero; a ring that is larger than a stencil may be is cut in groups of half the size, and every two of
//! these make a stencil.

use std::ops::Range;

use super::Nodal;
use super::rings::NodeRings;
use crate::algebra::Mat;
use crate::energy::Stencils;
use crate::energy::elastic::predicted::add_excess;
use crate::lanes::{Kernel, Lanes, dispatch};
use crate::material::{Psd, Tangent};

/// Vertices of a stencil at most, an even number: those of most rings in common meshes.
const fn most<const D: usize>() -> usize {
    if D == 2 { 10 } else { MOST }
}

/// In any dimension.
const MOST: usize = 16;

/// Which pairs of vertices of a ring a stencil has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RingPart {
    node: u32,
    /// The groups, from 0; the same where the ring is whole.
    groups: [u16; 2],
    /// How many groups the ring is cut into; 1 where it is whole.
    count: u16,
}

impl RingPart {
    /// Those of a ring of `len` vertices in stencils of `size`.
    fn of(node: usize, len: usize, size: usize) -> Vec<RingPart> {
        let node = node as u32;
        if len <= size {
            return vec![RingPart { node, groups: [0, 0], count: 1 }];
        }
        let count = len.div_ceil(size / 2) as u16;
        let pairs = (0..count).flat_map(|p| (p + 1..count).map(move |q| [p, q]));
        pairs.map(|groups| RingPart { node, groups, count }).collect()
    }

    /// The places in a ring of `len` of the vertices of each half of a stencil.
    fn places(&self, len: usize, size: usize) -> [Range<usize>; 2] {
        if self.count == 1 {
            return [0..len, len..len];
        }
        let half = size / 2;
        self.groups.map(|g| usize::from(g) * half..((usize::from(g) + 1) * half).min(len))
    }

    /// True if it is this stencil that has the pairs within its first group and within its second: one for
    /// each group.
    fn within(&self) -> [bool; 2] {
        let [p, q] = self.groups;
        [self.count == 1 || q == p + 1, q + 1 == self.count && p + 1 == q]
    }
}

/// The stencils of all rings.
pub(super) fn stencils<const D: usize>(rings: &NodeRings<D>) -> (Vec<RingPart>, Stencils) {
    let len = |node: usize| rings.ring(node).len() + 1;
    let longest = (0..rings.count()).map(len).max().unwrap_or(1);
    let size = longest.min(most::<D>());
    let (mut parts, mut vertices) = (vec![], vec![]);
    for node in 0..rings.count() {
        for part in RingPart::of(node, len(node), size) {
            let [first, second] = part.places(len(node), size);
            let of_place = |place: usize| match place {
                0 => rings.vertices[node],
                _ => rings.ring(node)[place - 1].vertex,
            };
            let end = vertices.len() + size;
            vertices.extend(first.chain(second).map(of_place));
            // What fills up is coupled with all of the ring as it is.
            vertices.resize(end, rings.vertices[node]);
            parts.push(part);
        }
    }
    (parts, Stencils { size, vertices })
}

/// Writes the Hessians of these stencils; with a place `from`, with the stresses that are predicted from it.
pub(super) fn fill<const D: usize>(
    nodal: &Nodal<D>,
    stencils: Range<usize>,
    x: &[f64],
    (psd, from): (Psd, Option<&[f64]>),
    out: &mut [f64],
) {
    let (rings, size) = (&nodal.nodes.rings, nodal.part_size);
    let x = x.as_chunks::<D>().0;
    let per_stencil = size * (size + 1) / 2 * D * D;
    let mut known: Option<(u32, Tangent<D>)> = None;
    for (part, out) in nodal.parts[stencils].iter().zip(out.chunks_exact_mut(per_stencil)) {
        let node = part.node as usize;
        let tangent = match &known {
            Some((of, tangent)) if *of == part.node => *tangent,
            _ => {
                let f = rings.deformation_gradient(node, x);
                let mut tangent = nodal.material.tangent(&f, psd);
                if let Some(from) = from {
                    let from = rings.deformation_gradient(node, from.as_chunks::<D>().0);
                    add_excess(&*nodal.material, nodal.stress, [&from, &f], &mut tangent);
                }
                tangent
            }
        };
        known = Some((part.node, tangent));
        let ring = rings.ring(node);
        let [first, second] = part.places(ring.len() + 1, size);
        let split = first.len();
        let mut coefficients = [[0.0; D]; MOST];
        for (c, place) in coefficients.iter_mut().zip(first.chain(second)) {
            *c = if place == 0 { rings.own[node] } else { ring[place - 1].toward };
        }
        let weight = 1.0 / rings.volume[node];
        dispatch(StencilBlocks {
            tangent: &tangent,
            weight,
            coefficients: &coefficients[..size],
            split,
            within: part.within(),
            out,
        });
    }
}

/// The blocks of a stencil; zero for pairs within a half that is not to be counted here.
struct StencilBlocks<'a, const D: usize> {
    tangent: &'a Tangent<D>,
    weight: f64,
    coefficients: &'a [[f64; D]],
    split: usize,
    within: [bool; 2],
    out: &'a mut [f64],
}

impl<const D: usize> Kernel for StencilBlocks<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut blocks = self.out.chunks_exact_mut(D * D);
        for (b, left) in self.coefficients.iter().enumerate() {
            // w (c_ab)_j C_ijkl, by l.
            let mut half = [[[0.0; D]; D]; D];
            for i in 0..D {
                for j in 0..D {
                    let factor = self.weight * left[j];
                    for k in 0..D {
                        for l in 0..D {
                            half[l][i][k] += factor * self.tangent.0[i][j][k][l];
                        }
                    }
                }
            }
            for (c, right) in self.coefficients.iter().enumerate().skip(b) {
                let Some(out) = blocks.next() else { return };
                let halves = [b < self.split, c < self.split];
                let counted = match halves {
                    [true, true] => self.within[0],
                    [false, false] => self.within[1],
                    _ => true,
                };
                let mut block = Mat::<f64, D>::zero();
                if counted {
                    for l in 0..D {
                        for i in 0..D {
                            for k in 0..D {
                                block[i][k] += half[l][i][k] * right[l];
                            }
                        }
                    }
                }
                out.copy_from_slice(block.0.as_flattened());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each pair of vertices of a ring of any size is in exactly one stencil.
    #[test]
    fn stencils_have_each_pair_of_a_ring_once() {
        for size in [8, 10, 16] {
            for len in 3..70 {
                let mut times = vec![vec![0; len]; len];
                for part in RingPart::of(0, len, size) {
                    let [first, second] = part.places(len, size);
                    let split = first.len();
                    let places: Vec<usize> = first.chain(second).collect();
                    assert!(places.len() <= size);
                    for (b, at) in places.iter().enumerate() {
                        for (c, to) in places.iter().enumerate().skip(b) {
                            let counted = match [b < split, c < split] {
                                [true, true] => part.within()[0],
                                [false, false] => part.within()[1],
                                _ => true,
                            };
                            times[*at.min(to)][*at.max(to)] += i32::from(counted);
                        }
                    }
                }
                for b in 0..len {
                    for c in b..len {
                        assert_eq!(times[b][c], 1, "{len} vertices in stencils of {size}: {b}, {c}");
                    }
                }
            }
        }
    }
}
