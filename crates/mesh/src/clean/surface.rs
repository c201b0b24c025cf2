//! Consistent orientation of triangle surfaces in space.

use crate::Mesh;
use crate::MeshError;

/// Neighbour across an edge of a triangle: the other triangle, whether both traverse the edge in the same
/// direction, and the edge.
type Neighbour = (u32, bool, [u32; 2]);

/// Indices of the triangles to turn for a consistent orientation. Closed surfaces face outwards; open
/// surfaces follow the majority of their triangles, and in a tie the first triangle. Only edges of
/// exactly two triangles connect neighbours: at an edge of three or more no orientation is preferred.
///
/// # Errors
/// [`MeshError::NotOrientable`] for a one-sided surface.
pub(super) fn other_side_up(mesh: &Mesh) -> Result<Vec<usize>, MeshError> {
    let neighbours = neighbours(&mesh.triangles);
    let mut turned: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    let mut result = Vec::new();
    for first in 0..mesh.triangles.len() {
        if turned[first].is_none() {
            let piece = spread(first, &neighbours, &mut turned)?;
            let is_turned = |i: usize| turned[i] == Some(true);
            let whole = is_inside_out(mesh, &piece, &neighbours, is_turned);
            result.extend(piece.into_iter().filter(|&i| is_turned(i) != whole));
        }
    }
    result.sort_unstable();
    Ok(result)
}

/// Neighbours of each triangle, across the edges that exactly two triangles share.
fn neighbours(triangles: &[[u32; 3]]) -> Vec<Vec<Neighbour>> {
    // Lower end, higher end, true if directed from lower to higher, triangle.
    let mut sides: Vec<(u32, u32, bool, u32)> = Vec::with_capacity(3 * triangles.len());
    for (i, &[a, b, c]) in (0..).zip(triangles) {
        sides.extend([[a, b], [b, c], [c, a]].map(|[from, to]| (from.min(to), from.max(to), from < to, i)));
    }
    sides.sort_unstable();
    let mut neighbours = vec![Vec::new(); triangles.len()];
    for run in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        if let [(low, high, one, a), (.., other, b)] = *run
            && a != b
        {
            neighbours[a as usize].push((b, one == other, [low, high]));
            neighbours[b as usize].push((a, one == other, [low, high]));
        }
    }
    neighbours
}

/// Collects the triangles connected with `first`, and writes into `turned` which of them are oriented
/// opposite to it.
fn spread(
    first: usize,
    neighbours: &[Vec<Neighbour>],
    turned: &mut [Option<bool>],
) -> Result<Vec<usize>, MeshError> {
    let mut piece = vec![first];
    turned[first] = Some(false);
    let mut next = 0;
    while let Some(&i) = piece.get(next) {
        next += 1;
        let own = turned[i] == Some(true);
        for &(other, same_way, edge) in &neighbours[i] {
            let other = other as usize;
            match turned[other] {
                None => {
                    turned[other] = Some(own != same_way);
                    piece.push(other);
                }
                Some(found) if found != (own != same_way) => return Err(MeshError::NotOrientable { edge }),
                Some(_) => {}
            }
        }
    }
    Ok(piece)
}

/// True if the whole piece must be turned relative to the orientation of its first triangle.
fn is_inside_out(
    mesh: &Mesh,
    piece: &[usize],
    neighbours: &[Vec<Neighbour>],
    is_turned: impl Fn(usize) -> bool,
) -> bool {
    let volume = enclosed(mesh, piece, &is_turned);
    if volume != 0.0 && volume.is_finite() && piece.iter().all(|&i| neighbours[i].len() == 3) {
        return volume < 0.0;
    }
    2 * piece.iter().filter(|&&i| is_turned(i)).count() > piece.len()
}

/// Six times the enclosed volume of a piece in units of the mesh's diagonal cubed, by the divergence
/// theorem with the piece's first corner as origin.
fn enclosed(mesh: &Mesh, piece: &[usize], is_turned: impl Fn(usize) -> bool) -> f64 {
    let scale = mesh.diagonal();
    let origin = mesh.point(mesh.triangles[piece[0]][0] as usize);
    let corner = |v: u32| {
        let x = mesh.point(v as usize);
        [0, 1, 2].map(|c| (x[c] - origin[c]) / scale)
    };
    let volume = |&i: &usize| {
        let [a, b, c] = mesh.triangles[i].map(corner);
        let volume = a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        if is_turned(i) { -volume } else { volume }
    };
    piece.iter().map(volume).sum()
}
