//! Embedded surfaces of meshes that are promoted, mirrored and repeated.

use std::collections::HashMap;

use super::Mesh;
use pliant::element::{CellBlock, CellVisitor, Isoparametric, TETRAHEDRON_EDGES};
use pliant::topology::Skin;

impl Mesh {
    /// Positions of the skin's vertices [m]; empty without a skin.
    pub fn skin_points(&self) -> Vec<[f64; 3]> {
        let skin = self.skin.iter();
        skin.flat_map(|skin| (0..skin.vertex_count()).map(|v| skin.interpolated(v, &self.points))).collect()
    }
}

/// Converts the skin of hexahedra promoted to second order. The first-order weights are the shares of the
/// corners and give the local coordinates of each skin vertex; the second-order shape functions there are
/// the new weights.
struct PromotedSkin<'a> {
    skin: Skin,
    block: &'a CellBlock,
}

impl CellVisitor for PromotedSkin<'_> {
    type Output = Skin;

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) -> Skin {
        let (width, cells) = (self.skin.width, self.block.of::<N>());
        let of_corners: HashMap<&[u32], usize> = cells.iter().map(|cell| &cell[..width]).zip(0..).collect();
        let (mut nodes, mut weights) = (vec![], vec![]);
        for (corners, shares) in
            self.skin.nodes.chunks_exact(width).zip(self.skin.weights.chunks_exact(width))
        {
            let mut xi = [0.0; D];
            for (share, at) in shares.iter().zip(kind.nodes) {
                (0..D).for_each(|c| xi[c] += share * at[c]);
            }
            nodes.extend(cells[of_corners[corners]]);
            weights.extend((kind.shape)(&xi));
        }
        Skin { width: N, nodes, weights, ..self.skin }
    }
}

/// Converts the skin to second-order elements. In tetrahedra the weights are `w (2 w - 1)` at corners and
/// `4 w_a w_b` at mid-edge nodes.
pub(super) fn promote(mesh: &mut Mesh) {
    let Some(skin) = mesh.skin.take() else { return };
    if let Some(block) = mesh.block() {
        mesh.skin = Some(block.kind.visit_second(PromotedSkin { skin, block }));
        return;
    }
    let middles = mesh.middles();
    let (mut nodes, mut weights) = (vec![], vec![]);
    for (corners, shares) in skin.nodes.as_chunks::<4>().0.iter().zip(skin.weights.as_chunks::<4>().0) {
        nodes.extend(corners);
        weights.extend(shares.map(|w| w * (2.0 * w - 1.0)));
        for [a, b] in TETRAHEDRON_EDGES {
            nodes.push(middles[&super::quadratic::sorted(corners[a], corners[b])]);
            weights.push(4.0 * shares[a] * shares[b]);
        }
    }
    mesh.skin = Some(Skin { width: 10, nodes, weights, ..skin });
}

/// Appends the skin of a copy with this first vertex and first element.
pub(super) fn append(skin: &mut Skin, other: &Skin, first_vertex: u32, first_element: u32) {
    let first = skin.vertex_count() as u32;
    skin.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|v| first + v)));
    skin.elements.extend(other.elements.iter().map(|element| first_element + element));
    skin.nodes.extend(other.nodes.iter().map(|node| first_vertex + node));
    skin.weights.extend(&other.weights);
}
