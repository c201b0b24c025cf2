//! Fill-reducing orderings for sparse factorisations: nested dissection by coordinates.
//!
//! A plane across the longest side of the bounding box cuts the vertices into two halves. Vertices of one
//! half with a neighbour in the other form the separator, which is eliminated last; both halves are
//! ordered recursively. George, "Nested dissection of a regular finite element mesh", SIAM J. Numer.
//! Anal. 10, 345 (1973), with geometric cuts as in Miller et al. 1993.

use super::block_matrix::BlockMatrix;

/// Vertices up to which a part is not cut further.
const LEAF: usize = 24;

/// Computes an elimination order of the rows of `matrix`, whose vertices are at `x` (flat): `order[k]` is
/// the `k`-th row to eliminate.
pub fn nested_dissection<const D: usize>(matrix: &BlockMatrix<D>, x: &[f64]) -> Vec<u32> {
    let points = x.as_chunks::<D>().0;
    let mut order = Vec::with_capacity(points.len());
    let mut side = vec![0u8; points.len()];
    let all: Vec<u32> = (0..points.len() as u32).collect();
    dissect(matrix, points, all, &mut side, &mut order);
    order
}

/// Appends the order of `part`; `side` is scratch memory, zero on entry and exit.
fn dissect<const D: usize>(
    matrix: &BlockMatrix<D>,
    points: &[[f64; D]],
    mut part: Vec<u32>,
    side: &mut [u8],
    order: &mut Vec<u32>,
) {
    if part.len() <= LEAF {
        order.extend(part);
        return;
    }
    let axis = longest_side(points, &part);
    // Ties are broken by number, so the order is deterministic.
    let key = |v: &u32| (points[*v as usize][axis], *v);
    let middle = part.len() / 2;
    part.select_nth_unstable_by(middle, |a, b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
    });
    let upper = part.split_off(middle);
    for v in &upper {
        side[*v as usize] = 1;
    }
    let touches = |v: &u32| matrix.row(*v as usize).any(|(c, _)| side[c] == 1);
    let (separator, lower): (Vec<u32>, Vec<u32>) = part.into_iter().partition(touches);
    for v in &upper {
        side[*v as usize] = 0;
    }
    dissect(matrix, points, lower, side, order);
    dissect(matrix, points, upper, side, order);
    order.extend(separator);
}

fn longest_side<const D: usize>(points: &[[f64; D]], part: &[u32]) -> usize {
    let extent = |c: usize| {
        let component = || part.iter().map(|v| points[*v as usize][c]);
        component().fold(f64::NEG_INFINITY, f64::max) - component().fold(f64::INFINITY, f64::min)
    };
    (1..D).fold(0, |longest, c| if extent(c) > extent(longest) { c } else { longest })
}
