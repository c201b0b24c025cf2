//! Embedded surfaces of meshes that are promoted, mirrored and repeated.

use super::Mesh;
use pliant::element::TETRAHEDRON_EDGES;
use pliant::topology::Skin;

impl Mesh {
    /// Positions of the vertices of its skin [m]; none without one.
    pub fn skin_points(&self) -> Vec<[f64; 3]> {
        let skin = self.skin.iter();
        skin.flat_map(|skin| (0..skin.vertex_count()).map(|v| skin.interpolated(v, &self.points))).collect()
    }
}

/// The skin of tetrahedra that now have nodes in the middle of their edges: `w (2 w - 1)` at corners, `4
/// w_a w_b` between.
pub(super) fn promote(mesh: &mut Mesh) {
    let Some(skin) = mesh.skin.take() else { return };
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

/// Appends the skin of a copy whose vertices begin at `first_vertex` and whose elements at `first_element`.
pub(super) fn append(skin: &mut Skin, other: &Skin, first_vertex: u32, first_element: u32) {
    let first = skin.vertex_count() as u32;
    skin.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|v| first + v)));
    skin.elements.extend(other.elements.iter().map(|element| first_element + element));
    skin.nodes.extend(other.nodes.iter().map(|node| first_vertex + node));
    skin.weights.extend(&other.weights);
}
