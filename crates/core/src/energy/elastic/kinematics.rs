//! Kinematics of elements: deformation gradients at quadrature points from the positions of vertices, and
//! forces from stresses.
//!
//! Elements have `N` vertices in `D`-dimensional space and `R` dimensions of their own: solids `R = D`,
//! sheets in space `R = 2`. Kernels on lanes are compiled once for each element, whatever its law; see
//! [`block`](super::block). Eight elements side by side are a pack, a few packs a piece: few enough to
//! stay in the L1 cache, enough to make the call of a law free.

use std::ops::Range;

use super::block::Block;
use super::{centroids, points_of};
use crate::algebra::Mat;
use crate::element::{
    MOST_POINTS, QuadraticGradients, QuadraticPositions, SimplexPack, Tangents, edges, jacobian, order,
    point_content, quadrature_count, quadrature_position, reference_gradients, times,
};
use crate::energy::patch::{PackIndex, Patch, Patches};
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH, dispatch, dispatch_compact, filled};
use crate::numbering::along_curve;
use crate::scalar::Scalar;

/// Blocks of a piece of elements with few points: few enough to stay in the L1 cache, enough to make the
/// call of the law free.
const ENOUGH: usize = 16;

/// Maximum number of blocks: those of one pack of any element.
pub(crate) const BLOCKS: usize = MOST_POINTS;

/// Returns the number of packs of a piece.
const fn packs_at_once<const R: usize, const N: usize>() -> usize {
    let points = quadrature_count::<R, N>();
    if points > ENOUGH { 1 } else { ENOUGH / points }
}

/// Elements in patches, with the reference data of their quadrature points.
pub(crate) struct Kinematics<const D: usize, const R: usize, const N: usize> {
    pub(crate) patches: Patches<N>,
    /// Reference data of every pack, one quadrature point after the other.
    pub(crate) rest: Vec<SimplexPack<R>>,
}

impl<const D: usize, const R: usize, const N: usize> Kinematics<D, R, N> {
    /// Creates the elements `elements` (global vertex indices) of `body` with the reference positions
    /// `rest` (flat, all vertices of the system) [m]. `shape` gives the reference nodes of an element in
    /// `R` coordinates of its own [m].
    ///
    /// # Panics
    /// If `det J` is not positive at a quadrature point of an element; meshes are checked before.
    pub(crate) fn new(
        body: &str,
        elements: &[[u32; N]],
        rest: &[f64],
        shape: impl Fn(&[u32; N]) -> [[f64; R]; N],
    ) -> Self {
        let order = along_curve::<D>(&centroids(elements, rest));
        let patches = Patches::new::<D>(elements, &order, rest.len() / D);
        let points = quadrature_count::<R, N>();
        let mut packs = filled(SimplexPack::new(), patches.index.len() * points);
        for (element, vertices, pack, lane) in patches.stencils() {
            let nodes = shape(&vertices);
            for q in 0..points {
                let j = jacobian(&nodes, &quadrature_position::<R, N>(q));
                let weight = point_content::<R, N>(q, j.determinant());
                assert!(weight > 0.0, "element {element} of {body} has volume {weight} at point {q}");
                packs[pack * points + q].set(lane, &j.inverse(), weight);
            }
        }
        for (packs, stencils) in packs.chunks_exact_mut(points).zip(&patches.stencil) {
            packs.iter_mut().for_each(|pack| pack.fill_up(stencils.iter().flatten().count()));
        }
        Kinematics { patches, rest: packs }
    }

    /// Calls `change(element, pack, lane)` for the reference data of every quadrature point of every
    /// element.
    pub(crate) fn each_rest(&mut self, change: impl Fn(usize, &mut SimplexPack<R>, usize)) {
        let points = quadrature_count::<R, N>();
        for (element, _, pack, lane) in self.patches.stencils() {
            let packs = &mut self.rest[pack * points..(pack + 1) * points];
            packs.iter_mut().for_each(|pack| change(element, pack, lane));
        }
    }

    /// Returns the pieces of a patch.
    pub(crate) fn pieces<'a>(&'a self, patch: &Patch) -> impl Iterator<Item = ElementPiece<'a, D, R, N>> {
        let Range { start, end } = patch.packs;
        let at_once = packs_at_once::<R, N>();
        (start..end)
            .step_by(at_once)
            .map(move |first| ElementPiece { of: self, packs: first..end.min(first + at_once) })
    }

    /// Returns `F` at the quadrature points of one element, with `J^-1` there and the weight.
    pub(crate) fn at_points(
        &self,
        x: &[f64],
        vertices: &[u32; N],
        (pack, lane): (usize, usize),
    ) -> impl Iterator<Item = (Tangents<f64, D, R>, Mat<f64, R>, f64)> {
        let x = points_of::<D, N>(x, vertices);
        let count = quadrature_count::<R, N>();
        let rest = &self.rest[pack * count..][..count];
        rest.iter().enumerate().map(move |(q, rest)| {
            let (inverse, weight) = rest.lane(lane);
            (times(&tangents_at(&x, q), &inverse), inverse, weight)
        })
    }

    /// Returns `J^-1` at the quadrature points of an element.
    pub(crate) fn inverses(&self, pack: usize, lane: usize) -> impl Iterator<Item = Mat<f64, R>> {
        let count = quadrature_count::<R, N>();
        self.rest[pack * count..][..count].iter().map(move |rest| rest.lane(lane).0)
    }

    /// Writes the deformation gradients of one pack.
    #[inline(always)]
    pub(crate) fn deform_pack<L: Lanes>(&self, pack: usize, rows: &RowSlice<D>, f: &mut [Block<D, R>]) {
        let x = gather::<L, D, N>(rows, &self.patches.index[pack]);
        let rest = &self.rest[pack * f.len()..][..f.len()];
        if order::<R, N>() == 1 {
            f[0].store_tangents(&times(&edges(&x), &rest[0].inverse_rest()));
        } else {
            let positions = QuadraticPositions::new(x);
            for q in 0..f.len() {
                f[q].store_tangents(&times(&as_tangents(&positions.at(q)), &rest[q].inverse_rest()));
            }
        }
    }
}

/// Returns `dx/dxi` at quadrature point `q` of an element with these positions.
#[inline(always)]
fn tangents_at<S: Scalar, const D: usize, const R: usize, const N: usize>(
    x: &[[S; D]; N],
    q: usize,
) -> Tangents<S, D, R> {
    if order::<R, N>() == 1 { edges(x) } else { as_tangents(&QuadraticPositions::new(*x).at(q)) }
}

/// Returns `dx/dxi` at quadrature point `q` of a solid.
#[inline(always)]
pub(super) fn edges_at<S: Scalar, const D: usize, const N: usize>(x: &[[S; D]; N], q: usize) -> Mat<S, D> {
    Mat(tangents_at(x, q))
}

/// Returns the reference gradients of the shape functions at quadrature point `q`, `J^-T dN_a/dxi` [1/m],
/// given `J^-1` there.
pub(crate) fn rest_gradients<const R: usize, const N: usize>(
    q: usize,
    inverse: &Mat<f64, R>,
) -> [[f64; R]; N] {
    let reference = reference_gradients::<R, N>(&quadrature_position::<R, N>(q));
    reference.map(|slope| std::array::from_fn(|j| (0..R).map(|l| slope[l] * inverse[l][j]).sum()))
}

/// Returns the entries of a square matrix; `R = D`, as in curved elements.
#[inline(always)]
fn as_tangents<S: Scalar, const D: usize, const R: usize>(m: &Mat<S, D>) -> Tangents<S, D, R> {
    let mut t = [[S::zero(); R]; D];
    for i in 0..D {
        for j in 0..R {
            t[i][j] = m[i][j];
        }
    }
    t
}

/// Returns the square matrix with these entries; `R = D`, as in curved elements.
#[inline(always)]
fn as_square<S: Scalar, const D: usize, const R: usize>(t: &Tangents<S, D, R>) -> Mat<S, D> {
    let mut m = Mat::zero();
    for i in 0..D {
        for j in 0..R {
            m[i][j] = t[i][j];
        }
    }
    m
}

/// A few packs of one patch.
pub(crate) struct ElementPiece<'a, const D: usize, const R: usize, const N: usize> {
    of: &'a Kinematics<D, R, N>,
    packs: Range<usize>,
}

impl<'a, const D: usize, const R: usize, const N: usize> ElementPiece<'a, D, R, N> {
    fn index(&self) -> &'a [PackIndex<N>] {
        &self.of.patches.index[self.packs.clone()]
    }

    /// Returns the indices of the blocks of the piece among those of all pieces.
    pub(crate) fn blocks(&self) -> Range<usize> {
        let points = quadrature_count::<R, N>();
        self.packs.start * points..self.packs.end * points
    }

    fn rest(&self) -> &'a [SimplexPack<R>] {
        &self.of.rest[self.blocks()]
    }

    /// Computes the deformation gradients of positions, or of a direction, in which they are linear.
    pub(crate) fn deform<'f>(
        &self,
        rows: &RowSlice<D>,
        f: &'f mut [Block<D, R>; BLOCKS],
    ) -> &'f mut [Block<D, R>] {
        let f = &mut f[..self.blocks().len()];
        dispatch(DeformationKernel { piece: self, rows, f });
        f
    }

    /// Adds the gradients at the vertices, given the stresses at the quadrature points.
    pub(crate) fn add_forces(&self, stress: &[Block<D, R>], gradient: &mut RowSlice<D>) {
        dispatch(ForceKernel { piece: self, stress, gradient });
    }

    /// Adds `w psi` of the blocks to one sum per lane.
    pub(crate) fn add_weighted(&self, psi: &[[f64; WIDTH]], sum: &mut [f64; WIDTH]) {
        dispatch_compact(EnergyKernel { rest: self.rest(), psi, sum });
    }
}

/// Gathers the positions of the vertices of one pack.
#[inline(always)]
pub(crate) fn gather<L: Lanes, const D: usize, const N: usize>(
    rows: &RowSlice<D>,
    index: &PackIndex<N>,
) -> [[L; D]; N] {
    let mut x = [[L::zero(); D]; N];
    // Unrolled by hand: the compiler does not unroll a loop around so much code, and then keeps `x` in
    // memory.
    x[0] = L::gather(rows, &index[0]);
    x[1] = L::gather(rows, &index[1]);
    x[2] = L::gather(rows, &index[2]);
    if N == 4 {
        x[3] = L::gather(rows, &index[3]);
    }
    if N > 4 {
        for a in 3..N {
            x[a] = L::gather(rows, &index[a]);
        }
    }
    x
}

/// Adds the gradients at the vertices of one pack.
#[inline(always)]
pub(crate) fn scatter<L: Lanes, const D: usize, const N: usize>(
    rows: &mut RowSlice<D>,
    index: &PackIndex<N>,
    gradients: [[L; D]; N],
) {
    // Unrolled by hand, as in `gather`.
    L::scatter_add(rows, &index[0], gradients[0]);
    L::scatter_add(rows, &index[1], gradients[1]);
    L::scatter_add(rows, &index[2], gradients[2]);
    if N == 4 {
        L::scatter_add(rows, &index[3], gradients[3]);
    }
    if N > 4 {
        for a in 3..N {
            L::scatter_add(rows, &index[a], gradients[a]);
        }
    }
}

/// Writes the deformation gradients of a piece, `quadrature_count` blocks per pack.
struct DeformationKernel<'a, const D: usize, const R: usize, const N: usize> {
    piece: &'a ElementPiece<'a, D, R, N>,
    rows: &'a RowSlice<D>,
    f: &'a mut [Block<D, R>],
}

impl<const D: usize, const R: usize, const N: usize> Kernel for DeformationKernel<'_, D, R, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let points = quadrature_count::<R, N>();
        for (pack, f) in self.piece.packs.clone().zip(self.f.chunks_exact_mut(points)) {
            self.piece.of.deform_pack::<L>(pack, self.rows, f);
        }
    }
}

/// Adds the gradients at the vertices of a piece, given the stresses at its quadrature points.
struct ForceKernel<'a, const D: usize, const R: usize, const N: usize> {
    piece: &'a ElementPiece<'a, D, R, N>,
    stress: &'a [Block<D, R>],
    gradient: &'a mut RowSlice<D>,
}

impl<const D: usize, const R: usize, const N: usize> Kernel for ForceKernel<'_, D, R, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let points = quadrature_count::<R, N>();
        let packs = self.piece.rest().chunks_exact(points).zip(self.stress.chunks_exact(points));
        for (index, (rest, stress)) in self.piece.index().iter().zip(packs) {
            if order::<R, N>() == 1 {
                scatter(
                    self.gradient,
                    index,
                    vertex_gradients::<L, D, R, N>(&weighted(&rest[0], &stress[0])),
                );
            } else {
                let mut gradients = QuadraticGradients::<L, D, N>::new();
                for q in 0..points {
                    gradients.add(q, &as_square(&weighted(&rest[q], &stress[q])));
                }
                scatter(self.gradient, index, gradients.finish());
            }
        }
    }
}

/// Returns `H = w P J^-T`.
#[inline(always)]
fn weighted<L: Lanes, const D: usize, const R: usize>(
    rest: &SimplexPack<R>,
    stress: &Block<D, R>,
) -> Tangents<L, D, R> {
    let weight = rest.weight::<L>();
    let mut p = stress.load_tangents::<L>();
    for i in 0..D {
        for j in 0..R {
            p[i][j] *= weight;
        }
    }
    times(&p, &rest.inverse_rest().transpose())
}

/// Returns the gradients at the vertices of a linear element, given `H`.
#[inline(always)]
pub(super) fn vertex_gradients<L: Lanes, const D: usize, const R: usize, const N: usize>(
    h: &Tangents<L, D, R>,
) -> [[L; D]; N] {
    let mut g = [[L::zero(); D]; N];
    for i in 0..D {
        let mut sum = h[i][0];
        for a in 1..R {
            sum += h[i][a];
        }
        g[0][i] = -sum;
        for a in 0..R {
            g[a + 1][i] = h[i][a];
        }
    }
    g
}

/// Adds `w psi` of some blocks to one sum per lane.
struct EnergyKernel<'a, const R: usize> {
    rest: &'a [SimplexPack<R>],
    psi: &'a [[f64; WIDTH]],
    sum: &'a mut [f64; WIDTH],
}

impl<const R: usize> Kernel for EnergyKernel<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut sum = L::load(self.sum);
        for (rest, psi) in self.rest.iter().zip(self.psi) {
            let weight = rest.weight::<L>();
            // An empty lane has weight zero, but zero times infinity is not zero.
            sum += L::select(L::zero().lt(weight), weight * L::load(psi), L::zero());
        }
        sum.store(self.sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::tests::sample::Random;
    use crate::element::simplex_rest;
    use crate::energy::patch::Scratch;
    use crate::lanes::{InstructionSet, dispatch_at};

    /// Returns the gradient rows of `count` tetrahedra with common vertices whose stress is their `F`.
    fn gradient(level: InstructionSet, count: usize) -> Vec<u64> {
        let mut random = Random(8);
        let vertices = 2 * count + 4;
        let rest: Vec<f64> = (0..vertices).flat_map(|_| random.gaussian::<3>()[0]).collect();
        let mut elements = vec![];
        for i in 0..count as u32 {
            let mut element = [i, i + 1, 2 * i + 2, 2 * i + 3];
            if simplex_rest(&points_of::<3, 4>(&rest, &element)).1 < 0.0 {
                element.swap(2, 3);
            }
            elements.push(element);
        }
        let all = Kinematics::<3, 3, 4>::new("a", &elements, &rest, |element| points_of(&rest, element));
        let patch = &all.patches.patches[0];
        let mut scratch = Scratch::new();
        for (row, &v) in all.patches.vertices.iter().enumerate() {
            let moved = rest[3 * v as usize..][..3].iter().map(|x| 1.1 * x + 0.1 * x * x);
            scratch.position.load(row, &moved.collect::<Vec<_>>());
        }
        let mut blocks = [Block::ZERO; BLOCKS];
        for piece in all.pieces(patch) {
            let f = &mut blocks[..piece.blocks().len()];
            dispatch_at(level, DeformationKernel { piece: &piece, rows: &scratch.position, f });
            dispatch_at(level, ForceKernel { piece: &piece, stress: f, gradient: &mut scratch.gradient });
        }
        scratch.gradient.as_slice()[..4 * vertices].iter().map(|x| x.to_bits()).collect()
    }

    /// An even and an odd number of packs, the last one full or not.
    #[test]
    fn forces_have_the_same_bits_on_every_level_for_any_number_of_packs() {
        for count in [1, 8, 13, 16, 23, 24, 33, 70] {
            let expected = gradient(InstructionSet::Portable, count);
            assert!(expected.iter().any(|&bits| f64::from_bits(bits) != 0.0));
            for level in InstructionSet::ALL {
                assert_eq!(gradient(level, count), expected, "{level:?}, {count} elements");
            }
        }
    }
}
