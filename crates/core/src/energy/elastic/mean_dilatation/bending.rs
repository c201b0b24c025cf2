//! Stiffness in bending that a cell lacks.
//!
//! In bending about its middle a cell moves by `u = s xi_k xi_l n_k`: fibres along `k`, of length `h_k`,
//! are stretched by `eps xi_l`, `eps = 2 s / h_k`. A body that bends across `l`, by `eps_k` along `k` and in
//! space by `eps_m` along `m`, has the energy `V/6 eps^T T eps`, `T` the moduli where its size across `l` is
//! free: in the plane `E/(1 - nu^2)`, in space `E/(1 - nu^2) [[1, nu], [nu, 1]]`. A cell with one volume and
//! slopes of [`packs`](super::packs) has other moduli `A` there: a row of cubes bends by `15/14/(1 + nu)` of
//! `E` in space and by `1 - nu` of `T` in the plane, cells that are narrower than high by a part that falls
//! with `(h_k/h_l)^2`. So a cell gets the energy
//!
//! ```text
//! E_b = sum_l V/6 eps^T (B - A) eps,   eps_k = 2 s_kl / h_k,
//! s_kl = q_kl . f_k / |f_k|,   q_kl = sum_a g_a x_a,   f_k = sum_a x_a dN_a/dxi_k(0)
//! ```
//!
//! where `g_a = (xi_k xi_l|_a - sum_i (sum_b xi_k xi_l|_b X_bi) b_ai) / N` is zero on every linear field, `b`
//! the mean gradients: Flanagan, Belytschko 1981, "A uniform strain hexahedron and quadrilateral with
//! orthogonal hourglass control", Int. J. Numer. Meth. Eng. 17, 679. So the patch test is passed as before.
//! `f_k` turns with the cell; for a material that is linear in `F` it stays at rest. Moduli are those of
//! the material at rest.
//!
//! In the plane `B` is `T` of cells that are alone through a thickness, both sides of them on the surface,
//! and `A` of a square of others: of `n` rows bending is the cells' own by a part of `1/n^2` alone.
//!
//! In space `T - A` is not positive semi-definite even of cubes, which are sheared where they bend to a
//! saddle, and nothing is ever taken away: of `B - A` the positive part is added. `B` is there
//!
//! - of cells that are alone `A` of a cube and the matrix of rank one with which a cube that is free along
//!   `m` bends by the modulus `E` along `k`, and likewise along `m`;
//! - of others, of whose rows a body that bends has `eps_m = -nu eps_k`, `A` of a cube less the multiple of
//!   `[[1, 1], [1, 1]]` that makes this cost `E`, if it costs more. Long cells of a beam widen and narrow
//!   along it, `eps_k = eps_m`, for nothing.

mod kernels;
mod lacking;

use super::Dilatation;
use super::hessian::add_product;
use super::packs::{CellPacks, RestPoint};
use super::shape::number::RestNumber;
use crate::algebra::{Dual, Mat};
use crate::element::Isoparametric;
use crate::energy::elastic::points_of;
use crate::energy::patch::Patches;
use crate::lanes::WIDTH;
use crate::material::Tangent;
use crate::scalar::Scalar;
pub(crate) use kernels::BendingPack;
pub(super) use kernels::{BendingEnergyKernel, BendingForceKernel};
use lacking::CellFound;
pub(super) use lacking::{BendingStiffness, CellSides, LackingCell};

/// Pairs of axes of a cell in `D` dimensions.
pub(super) const fn axes(d: usize) -> &'static [[usize; 2]] {
    if d == 2 { &[[0, 1]] } else { &[[0, 1], [0, 2], [1, 2]] }
}

/// Pairs of axes at most.
pub(super) const MOST_PAIRS: usize = 3;

/// The mode along axis `k` across `l`: its pair and its side there.
const fn place(k: usize, l: usize) -> (usize, usize) {
    if k < l { (k + l - 1, 0) } else { (k + l - 1, 1) }
}

/// Modes along two axes across the third, of which one stretches what the other shrinks.
pub(super) const COUPLED: [[(usize, usize); 2]; 3] =
    [[place(1, 0), place(2, 0)], [place(0, 1), place(2, 1)], [place(0, 2), place(1, 2)]];

/// Bending in the plane of two axes, of a pack of cells.
#[derive(Clone)]
#[repr(align(64))]
struct BendingPair<const N: usize> {
    /// `g` of every node.
    weight: [[f64; WIDTH]; N],
    /// Stiffness along the first axis and along the second [N/m in space].
    stiffness: [[f64; WIDTH]; 2],
}

/// Data that all pairs of axes of a pack have in common.
#[derive(Clone)]
#[repr(align(64))]
struct BendingCommon<const D: usize> {
    /// `f_k` at rest [m].
    rest: [[[f64; WIDTH]; D]; D],
    /// Stiffness that couples the modes across every axis [N/m].
    coupling: [[f64; WIDTH]; 3],
}

/// Displacement `s` of a mode of bending and its slopes.
#[derive(Clone, Copy)]
pub(super) struct BendingMode<S, const D: usize> {
    pub(super) s: S,
    /// `ds/dq = f/|f|`.
    pub(super) of_q: [S; D],
    /// `ds/df = (q - s f/|f|)/|f|`, zero where `f` stays at rest.
    pub(super) of_f: [S; D],
}

impl<S: Scalar, const D: usize> BendingMode<S, D> {
    #[inline(always)]
    fn zero() -> Self {
        BendingMode { s: S::zero(), of_q: [S::zero(); D], of_f: [S::zero(); D] }
    }

    #[inline(always)]
    pub(super) fn new(q: &[S; D], f: &[S; D], turns: bool) -> Self {
        let inverse = S::one() / dot(f, f).sqrt();
        let mut mode = BendingMode::zero();
        for i in 0..D {
            mode.of_q[i] = f[i] * inverse;
        }
        mode.s = dot(q, &mode.of_q);
        if turns {
            for i in 0..D {
                mode.of_f[i] = (q[i] - mode.s * mode.of_q[i]) * inverse;
            }
        }
        mode
    }
}

#[inline(always)]
pub(super) fn dot<S: Scalar, const D: usize>(a: &[S; D], b: &[S; D]) -> S {
    let mut sum = S::zero();
    for i in 0..D {
        sum = a[i].mul_add(b[i], sum);
    }
    sum
}

/// `sum_a a_a . b_a`.
fn dot_all<const D: usize, const N: usize>(a: &[[f64; D]; N], b: &[[f64; D]; N]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}

/// `sum_a w_a x_a` for weights that add up to zero.
#[inline(always)]
pub(super) fn weighted<S: Scalar, const D: usize, const N: usize>(
    x: &[[S; D]; N],
    weight: &[S; N],
) -> [S; D] {
    let mut sum = [S::zero(); D];
    for a in 1..N {
        for i in 0..D {
            // Measured from the first node: what is far from the origin loses no digits.
            sum[i] = (x[a][i] - x[0][i]).mul_add(weight[a], sum[i]);
        }
    }
    sum
}

/// Solid of which cells lack stiffness in bending.
#[derive(Clone, Copy)]
pub(crate) struct BendingSolid<'a, const D: usize> {
    /// `dP/dF` at rest [Pa].
    pub(crate) tangent: &'a Tangent<D>,
    /// Its change with a parameter, where the change of the stiffness is wanted.
    pub(crate) change: Option<&'a Tangent<D>>,
    /// Rotation from its axes to those of space in each cell, whose packs are in these axes; none where there
    /// is none.
    pub(crate) axes: &'a [Mat<f64, D>],
    /// Change of each rotation, where that of the stiffness with it is wanted.
    pub(crate) turning: Option<&'a [Mat<f64, D>]>,
    pub(crate) dilatation: Dilatation,
}

/// Stiffnesses in bending of packs of cells.
#[derive(Clone)]
pub(crate) struct CellBending<const D: usize, const N: usize> {
    /// `dN_a/dxi_k` in the middle.
    slopes: [[f64; D]; N],
    /// Pairs of axes of every pack, one after the other.
    pairs: Vec<BendingPair<N>>,
    /// Data of every pack.
    common: Vec<BendingCommon<D>>,
}

impl<const D: usize, const N: usize> CellBending<D, N> {
    /// Stiffnesses that cells of `packs` lack of a solid, or their change, at rest at `rest` (flat, all
    /// vertices of the system) [m]; `None` where none lacks any.
    pub(crate) fn new(
        cell: &Isoparametric<D, N>,
        patches: &Patches<N>,
        packs: &CellPacks<D, N>,
        solid: BendingSolid<'_, D>,
        rest: &[f64],
    ) -> Option<Self> {
        let mut bending = CellBending::empty(cell, patches.index.len());
        let lacks = if solid.change.is_some() || solid.turning.is_some() {
            bending.fill::<Dual<f64>>(cell, patches, packs, solid, rest, Dual::rate)
        } else {
            bending.fill::<f64>(cell, patches, packs, solid, rest, f64::value)
        };
        // Lanes that fill up have directions, too: those of a real cell.
        for (common, stencils) in bending.common.iter_mut().zip(&patches.stencil) {
            let used = stencils.iter().flatten().count();
            for lanes in common.rest.as_flattened_mut() {
                (used..WIDTH).for_each(|lane| lanes[lane] = lanes[used - 1]);
            }
        }
        lacks.then_some(bending)
    }

    /// Packs of cells that lack nothing.
    fn empty(cell: &Isoparametric<D, N>, packs: usize) -> Self {
        let pair = BendingPair { weight: [[0.0; WIDTH]; N], stiffness: [[0.0; WIDTH]; 2] };
        let common = BendingCommon { rest: [[[0.0; WIDTH]; D]; D], coupling: [[0.0; WIDTH]; 3] };
        CellBending {
            slopes: (cell.slopes)(&[0.0; D]),
            pairs: vec![pair; packs * axes(D).len()],
            common: vec![common; packs],
        }
    }

    /// Fills lanes of cells by `wanted` of what they lack; false where that is nothing.
    fn fill<S: RestNumber>(
        &mut self,
        cell: &Isoparametric<D, N>,
        patches: &Patches<N>,
        packs: &CellPacks<D, N>,
        solid: BendingSolid<'_, D>,
        rest: &[f64],
        wanted: fn(S) -> f64,
    ) -> bool {
        let mut lacks = false;
        let surface = CellSides::of(cell, patches);
        let mut last: Option<CellFound<S, D, N>> = None;
        let mut turned: Option<(&Mat<f64, D>, [Tangent<D>; 2])> = None;
        for (element, vertices, pack, lane) in patches.stencils() {
            let rotation = solid.axes.get(element);
            if let Some(rotation) = rotation
                .filter(|rotation| solid.turning.is_some() || turned.is_none_or(|(of, _)| of != *rotation))
            {
                let change = match solid.turning {
                    Some(turning) => solid.tangent.turned_along(rotation, &turning[element]),
                    None => solid.change.unwrap_or(solid.tangent).turned(rotation),
                };
                turned = Some((rotation, [solid.tangent.turned(rotation), change]));
                last = None;
            }
            let nodes = points_of::<D, N>(rest, &vertices);
            let alone = surface.alone(cell, &vertices);
            let found = match last.take().filter(|last| last.is_of(&nodes, alone)) {
                Some(same) => last.insert(same),
                None => {
                    let mut points: Vec<_> = packs.rest(pack).iter().map(|point| point.lane(lane)).collect();
                    let mut of_cell = solid;
                    if let Some((rotation, [tangent, change])) = &turned {
                        for b in points.iter_mut().flat_map(|(gradient, _)| gradient) {
                            *b = rotation.mul_vec(b);
                        }
                        of_cell.tangent = tangent;
                        let changes = solid.change.is_some() || solid.turning.is_some();
                        of_cell.change = changes.then_some(change);
                    }
                    let points: Vec<RestPoint<S, D, N>> = points
                        .into_iter()
                        .map(|(gradient, part)| (gradient.map(|b| b.map(S::splat)), S::splat(part)))
                        .collect();
                    let nodes = nodes.map(|node| node.map(S::splat));
                    let lacking = LackingCell { cell, nodes: &nodes, points: &points };
                    last.insert(lacking.find(alone, S::splat(packs.volume[pack][lane]), of_cell))
                }
            };
            let stiffness = found.stiffness.map(wanted);
            lacks |= stiffness.own.as_flattened().iter().any(|stiffness| *stiffness != 0.0);
            let pairs = self.pairs[pack * axes(D).len()..].iter_mut();
            for (pair, (stiffness, weight)) in
                pairs.zip(stiffness.own.iter().zip(&found.weight)).take(axes(D).len())
            {
                pair.stiffness.iter_mut().zip(stiffness).for_each(|(lanes, of_side)| lanes[lane] = *of_side);
                pair.weight.iter_mut().zip(weight).for_each(|(lanes, weight)| lanes[lane] = *weight);
            }
            let common = &mut self.common[pack];
            for l in 0..D {
                (0..D).for_each(|i| common.rest[l][i][lane] = found.middle[i][l]);
                common.coupling[l][lane] = stiffness.coupling[l];
            }
        }
        lacks
    }

    /// `dN_a/dxi_k` of every node in the middle.
    #[inline(always)]
    fn slopes<S: Scalar>(&self, k: usize) -> [S; N] {
        let mut slopes = [S::zero(); N];
        for a in 0..N {
            slopes[a] = S::splat(self.slopes[a][k]);
        }
        slopes
    }

    /// The modes of a cell with its nodes at `x`, by pairs and sides.
    fn modes_of_lane(
        &self,
        x: &[[f64; D]; N],
        (pack, lane): (usize, usize),
        turns: bool,
    ) -> Vec<[BendingLane<D, N>; 2]> {
        let of_pair = |(pair, axes): (&BendingPair<N>, &[usize; 2])| {
            let weight = pair.weight.map(|lanes| lanes[lane]);
            let q = weighted(x, &weight);
            [0, 1].map(|side| {
                let slopes = self.slopes(axes[side]);
                let rest = self.common[pack].rest[axes[side]].map(|lanes| lanes[lane]);
                let f = if turns { weighted(x, &slopes) } else { rest };
                BendingLane { weight, slopes, q, f, rest, stiffness: pair.stiffness[side][lane] }
            })
        };
        self.pairs[pack * axes(D).len()..].iter().zip(axes(D)).map(of_pair).collect()
    }

    /// Adds the Hessian of a cell to `matrix`, row by row: with the stiffnesses `K` of the modes, their
    /// forces `F = K s` and for each mode
    ///
    /// ```text
    /// ds_a = g_a n + c_a t / |f|,   n = f / |f|,   t = q - s n,
    /// d2s_ab = (g_a c_b + c_a g_b) (I - n n^T) / |f| - c_a c_b (t n^T + n t^T + s (I - n n^T)) / |f|^2
    /// ```
    ///
    /// it is `sum K ds ds^T + sum F d2s`.
    pub(super) fn add_hessian(
        &self,
        x: &[[f64; D]; N],
        (pack, lane): (usize, usize),
        turns: bool,
        matrix: &mut [f64],
    ) {
        let lanes = self.modes_of_lane(x, (pack, lane), turns);
        let each = |pair: &[BendingLane<D, N>; 2]| [0, 1].map(|side| pair[side].mode(turns));
        let modes: Vec<[BendingMode<f64, D>; 2]> = lanes.iter().map(each).collect();
        for (pair, modes) in lanes.iter().zip(&modes) {
            for (of_lane, mode) in pair.iter().zip(modes) {
                let slope = of_lane.slope(mode);
                add_product(&slope, &slope, of_lane.stiffness, matrix);
                of_lane.add_second(mode, of_lane.stiffness * mode.s, turns, matrix);
            }
        }
        for (coupling, [one, other]) in self.coupled(pack, lane) {
            let (a, b) = (&modes[one.0][one.1], &modes[other.0][other.1]);
            let (of_a, of_b) = (&lanes[one.0][one.1], &lanes[other.0][other.1]);
            let (slope_a, slope_b) = (of_a.slope(a), of_b.slope(b));
            add_product(&slope_a, &slope_b, coupling, matrix);
            add_product(&slope_b, &slope_a, coupling, matrix);
            of_a.add_second(a, coupling * b.s, turns, matrix);
            of_b.add_second(b, coupling * a.s, turns, matrix);
        }
    }

    /// `p . dE/dx` of a cell with its nodes at `x`.
    pub(super) fn work_of_lane(
        &self,
        (x, p): (&[[f64; D]; N], &[[f64; D]; N]),
        (pack, lane): (usize, usize),
        turns: bool,
    ) -> f64 {
        let lanes = self.modes_of_lane(x, (pack, lane), turns);
        // `s` and its change along `p`.
        let along = |of_lane: &BendingLane<D, N>| {
            let mode = of_lane.mode(turns);
            (mode.s, dot_all(&of_lane.slope(&mode), p))
        };
        let modes: Vec<[(f64, f64); 2]> =
            lanes.iter().map(|pair| [along(&pair[0]), along(&pair[1])]).collect();
        let own = lanes.as_flattened().iter().zip(modes.as_flattened());
        let own: f64 = own.map(|(of_lane, (s, ds))| of_lane.stiffness * s * ds).sum();
        let coupled = self.coupled(pack, lane).map(|(coupling, [one, other])| {
            let ((a, da), (b, db)) = (modes[one.0][one.1], modes[other.0][other.1]);
            coupling * (a * db + b * da)
        });
        own + coupled.sum::<f64>()
    }

    /// Couplings of one cell and the modes that they couple; none in the plane.
    fn coupled(&self, pack: usize, lane: usize) -> impl Iterator<Item = (f64, [(usize, usize); 2])> {
        let couplings = self.common[pack].coupling.iter().map(move |lanes| lanes[lane]);
        couplings.zip(COUPLED).take(if D == 3 { 3 } else { 0 })
    }

    /// Adds the blocks of the damping matrix of a cell with its nodes at `x`, for each pair `a <= b`.
    pub(crate) fn add_damping(&self, x: &[[f64; D]; N], (pack, lane): (usize, usize), out: &mut [f64]) {
        let lanes = self.modes_of_lane(x, (pack, lane), true);
        let mut add = |(a, b): (&BendingLane<D, N>, &BendingLane<D, N>), factor: f64| {
            let (slope_a, slope_b) = (a.rate_slope(), b.rate_slope());
            let pairs = (0..N).flat_map(|a| (a..N).map(move |b| (a, b)));
            for ((a, b), block) in pairs.zip(out.chunks_exact_mut(D * D)) {
                for (i, row) in block.chunks_exact_mut(D).enumerate() {
                    let columns = row.iter_mut().zip(&slope_b[b]);
                    columns.for_each(|(entry, slope)| *entry += factor * slope_a[a][i] * slope);
                }
            }
        };
        lanes.as_flattened().iter().for_each(|mode| add((mode, mode), mode.stiffness));
        for (coupling, [one, other]) in self.coupled(pack, lane) {
            let (a, b) = (&lanes[one.0][one.1], &lanes[other.0][other.1]);
            add((a, b), coupling);
            add((b, a), coupling);
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.pairs[..]) + size_of_val(&self.common[..])
    }
}

/// A mode of bending of one cell.
struct BendingLane<const D: usize, const N: usize> {
    /// `g` of every node.
    weight: [f64; N],
    /// `c_a = dN_a/dxi_k(0)`.
    slopes: [f64; N],
    q: [f64; D],
    f: [f64; D],
    /// `f` at rest.
    rest: [f64; D],
    stiffness: f64,
}

impl<const D: usize, const N: usize> BendingLane<D, N> {
    fn mode(&self, turns: bool) -> BendingMode<f64, D> {
        BendingMode::new(&self.q, &self.f, turns)
    }

    /// `ds/dx`.
    fn slope(&self, mode: &BendingMode<f64, D>) -> [[f64; D]; N] {
        self.spread(&mode.of_q, &mode.of_f)
    }

    /// The slope of the rate of `q . f / |f_rest|`.
    fn rate_slope(&self) -> [[f64; D]; N] {
        let inverse = 1.0 / dot(&self.rest, &self.rest).sqrt();
        self.spread(&self.f.map(|f| inverse * f), &self.q.map(|q| inverse * q))
    }

    /// `g_a q + c_a f`.
    fn spread(&self, q: &[f64; D], f: &[f64; D]) -> [[f64; D]; N] {
        let mut nodes = [[0.0; D]; N];
        for (a, node) in nodes.iter_mut().enumerate() {
            (0..D).for_each(|i| node[i] = self.weight[a] * q[i] + self.slopes[a] * f[i]);
        }
        nodes
    }

    /// Adds `force d2s`.
    fn add_second(&self, mode: &BendingMode<f64, D>, force: f64, turns: bool, matrix: &mut [f64]) {
        if !turns {
            return;
        }
        let BendingMode { s, of_q: n, of_f: t } = mode;
        let inverse = 1.0 / dot(&self.f, &self.f).sqrt();
        for a in 0..N {
            for b in 0..N {
                let crossed = self.weight[a] * self.slopes[b] + self.slopes[a] * self.weight[b];
                let along = self.slopes[a] * self.slopes[b];
                for i in 0..D {
                    for k in 0..D {
                        let across = f64::from(u8::from(i == k)) - n[i] * n[k];
                        // `t` of the mode is over `|f|`.
                        let turned = t[i] * n[k] + n[i] * t[k] + inverse * s * across;
                        matrix[(a * D + i) * N * D + b * D + k] +=
                            force * inverse * (crossed * across - along * turned);
                    }
                }
            }
        }
    }
}
