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
//! In the plane `B` is `T` of cells that are alone through a thickness, both sides of them on the surface, and
//! `A` of a square of others: of `n` rows bending is the cells' own by a part of `1/n^2` alone.
//!
//! In space `T - A` is not positive semi-definite even of cubes, which are sheared where they bend to a
//! saddle, and nothing is ever taken away: of `B - A` the positive part is added. `B` is there
//!
//! - of cells that are alone `A` of a cube and the matrix of rank one with which a cube that is free along `m`
//!   bends by the modulus `E` along `k`, and likewise along `m`;
//! - of others, of whose rows a body that bends has `eps_m = -nu eps_k`, `A` of a cube less the multiple of
//!   `[[1, 1], [1, 1]]` that makes this cost `E`, if it costs more. Long cells of a beam widen and narrow
//!   along it, `eps_k = eps_m`, for nothing.

use std::collections::HashMap;

use super::super::kernels::{gather, scatter};
use super::Dilatation;
use super::hessian::add_product;
use super::kernels::{PackScalar, with_change};
use super::packs::{CellPacks, lengths};
use crate::algebra::{Dual, Mat};
use crate::element::Isoparametric;
use crate::energy::elastic::points_of;
use crate::energy::patch::{PackIndex, Patches};
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH};
use crate::material::Tangent;
use crate::scalar::Scalar;

/// Part of a modulus below which a difference is rounding.
const ROUNDING: f64 = 1e-12;

/// Pairs of axes of a cell in `D` dimensions.
const fn axes(d: usize) -> &'static [[usize; 2]] {
    if d == 2 { &[[0, 1]] } else { &[[0, 1], [0, 2], [1, 2]] }
}

/// Pairs of axes at most.
const MOST_PAIRS: usize = 3;

/// The mode along axis `k` across `l`: its pair and its side there.
const fn place(k: usize, l: usize) -> (usize, usize) {
    if k < l { (k + l - 1, 0) } else { (k + l - 1, 1) }
}

/// Modes along two axes across the third, of which one stretches what the other shrinks.
const COUPLED: [[(usize, usize); 2]; 3] =
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

/// What all pairs of axes of a pack have in common.
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
struct BendingMode<S, const D: usize> {
    s: S,
    /// `ds/dq = f/|f|`.
    of_q: [S; D],
    /// `ds/df = (q - s f/|f|)/|f|`, zero where `f` stays at rest.
    of_f: [S; D],
}

impl<S: Scalar, const D: usize> BendingMode<S, D> {
    #[inline(always)]
    fn zero() -> Self {
        BendingMode { s: S::zero(), of_q: [S::zero(); D], of_f: [S::zero(); D] }
    }

    #[inline(always)]
    fn new(q: &[S; D], f: &[S; D], turns: bool) -> Self {
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
fn dot<S: Scalar, const D: usize>(a: &[S; D], b: &[S; D]) -> S {
    let mut sum = S::zero();
    for i in 0..D {
        sum = a[i].mul_add(b[i], sum);
    }
    sum
}

/// `sum_a w_a x_a` for weights that add up to zero.
#[inline(always)]
fn weighted<S: Scalar, const D: usize, const N: usize>(x: &[[S; D]; N], weight: &[S; N]) -> [S; D] {
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
    pub(crate) dilatation: Dilatation,
}

/// Stiffnesses in bending of packs of cells.
#[derive(Clone)]
pub(crate) struct CellBending<const D: usize, const N: usize> {
    /// `dN_a/dxi_k` in the middle.
    slopes: [[f64; D]; N],
    /// Pairs of axes of every pack, one after the other.
    pairs: Vec<BendingPair<N>>,
    /// Of every pack.
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
        let pair = BendingPair { weight: [[0.0; WIDTH]; N], stiffness: [[0.0; WIDTH]; 2] };
        let common = BendingCommon { rest: [[[0.0; WIDTH]; D]; D], coupling: [[0.0; WIDTH]; 3] };
        let packs_count = patches.index.len();
        let mut bending = CellBending {
            slopes: (cell.slopes)(&[0.0; D]),
            pairs: vec![pair; packs_count * axes(D).len()],
            common: vec![common; packs_count],
        };
        let mut lacks = false;
        let surface = CellSides::of(cell, patches);
        let mut last: Option<CellFound<D, N>> = None;
        for (_, vertices, pack, lane) in patches.stencils() {
            let nodes = points_of::<D, N>(rest, &vertices);
            let mut alone = [true; D];
            (0..D).for_each(|l| alone[l] = surface.is_alone(cell, &vertices, l));
            let found = match last.take().filter(|last| last.is_of(&nodes, alone)) {
                Some(same) => last.insert(same),
                None => {
                    let points: Vec<_> = packs.rest(pack).iter().map(|point| point.lane(lane)).collect();
                    let lacking = LackingCell { cell, nodes: &nodes, points: &points };
                    last.insert(lacking.find(alone, packs.volume[pack][lane], solid))
                }
            };
            lacks |= found.stiffness.as_flattened().iter().any(|stiffness| *stiffness != 0.0);
            let pairs = bending.pairs[pack * axes(D).len()..].iter_mut();
            for (pair, (stiffness, weight)) in
                pairs.zip(found.stiffness.iter().zip(&found.weight)).take(axes(D).len())
            {
                pair.stiffness.iter_mut().zip(stiffness).for_each(|(lanes, of_side)| lanes[lane] = *of_side);
                pair.weight.iter_mut().zip(weight).for_each(|(lanes, weight)| lanes[lane] = *weight);
            }
            let common = &mut bending.common[pack];
            for l in 0..D {
                (0..D).for_each(|i| common.rest[l][i][lane] = found.middle[i][l]);
                common.coupling[l][lane] = found.coupling[l];
            }
        }
        // Lanes that fill up have directions, too: those of a real cell.
        for (common, stencils) in bending.common.iter_mut().zip(&patches.stencil) {
            let used = stencils.iter().flatten().count();
            for lanes in common.rest.as_flattened_mut() {
                (used..WIDTH).for_each(|lane| lanes[lane] = lanes[used - 1]);
            }
        }
        lacks.then_some(bending)
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

/// Sides of cells by their vertices, ascending, with how many cells have each.
struct CellSides(HashMap<[u32; MOST_OF_SIDE], u32>);

/// Vertices of a side at most.
const MOST_OF_SIDE: usize = 4;

impl CellSides {
    fn of<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, patches: &Patches<N>) -> Self {
        let mut sides = HashMap::new();
        for (_, vertices, ..) in patches.stencils() {
            for side in cell.kind.sides {
                *sides.entry(side_of(side, &vertices)).or_default() += 1;
            }
        }
        CellSides(sides)
    }

    /// True if both sides of a cell across axis `l` are on the surface.
    fn is_alone<const D: usize, const N: usize>(
        &self,
        cell: &Isoparametric<D, N>,
        vertices: &[u32; N],
        l: usize,
    ) -> bool {
        let across = |side: &&&[usize]| side.iter().all(|a| cell.nodes[*a][l] == cell.nodes[side[0]][l]);
        cell.kind.sides.iter().filter(across).all(|side| self.0[&side_of(side, vertices)] == 1)
    }
}

/// Vertices of a side of a cell, ascending; numbers of none behind them.
fn side_of<const N: usize>(side: &[usize], vertices: &[u32; N]) -> [u32; MOST_OF_SIDE] {
    let mut sorted = [u32::MAX; MOST_OF_SIDE];
    sorted.iter_mut().zip(side).for_each(|(vertex, a)| *vertex = vertices[*a]);
    sorted.sort_unstable();
    sorted
}

/// What a cell lacks.
struct CellFound<const D: usize, const N: usize> {
    /// Places of its nodes from the first one on [m].
    offsets: [[f64; D]; N],
    /// Axes across which it is alone.
    alone: [bool; D],
    /// `J` in its middle [m].
    middle: Mat<f64, D>,
    /// Of every pair of axes and side.
    stiffness: [[f64; 2]; MOST_PAIRS],
    /// Across every axis.
    coupling: [f64; MOST_PAIRS],
    /// `g` of every pair of axes.
    weight: [[f64; N]; MOST_PAIRS],
}

impl<const D: usize, const N: usize> CellFound<D, N> {
    /// True if it is that of a cell with these nodes but for rounding: neighbours in a grid are congruent.
    fn is_of(&self, nodes: &[[f64; D]; N], alone: [bool; D]) -> bool {
        let size = self.middle.norm_squared().sqrt();
        let is_near = |(node, offset): (&[f64; D], &[f64; D])| {
            (0..D).all(|i| (node[i] - nodes[0][i] - offset[i]).abs() <= CONGRUENT * size)
        };
        self.alone == alone && nodes.iter().zip(&self.offsets).all(is_near)
    }
}

/// Part of the size of a cell by which congruent ones may differ.
const CONGRUENT: f64 = 1e-11;

/// Gradient at a quadrature point and the part of the volume that it stands for.
type Slope<const D: usize> = ([f64; D], f64);

/// Directions of a cell, and of the solid what bending along them asks for.
struct CellFrame<const D: usize> {
    /// Unit vectors `n_k`.
    directions: [[f64; D]; D],
    /// `n_a_i C_ijkl n_b_k` [Pa].
    acoustic: [[Mat<Dual<f64>, D>; D]; D],
    /// `n_a_i C_ijkk` [Pa].
    volume: [[Dual<f64>; D]; D],
    /// `C_iikk` [Pa].
    bulk: Dual<f64>,
    /// True if all points have one ratio of volumes.
    is_mean: bool,
    /// `T` across every axis, and `B` of cells that are alone across it and of others.
    wanted: [[BendingModuli; 3]; D],
}

impl<const D: usize> CellFrame<D> {
    fn new<const N: usize>(
        cell: &Isoparametric<D, N>,
        directions: [[f64; D]; D],
        solid: BendingSolid<'_, D>,
    ) -> Self {
        let entry = |i: usize, j: usize, k: usize, l: usize| Dual {
            value: solid.tangent.0[i][j][k][l],
            derivative: solid.change.map_or(0.0, |change| change.0[i][j][k][l]),
        };
        let zero = Dual::splat(0.0);
        let mut frame = CellFrame {
            directions,
            acoustic: [[Mat::zero(); D]; D],
            volume: [[zero; D]; D],
            bulk: zero,
            is_mean: solid.dilatation != Dilatation::Own,
            wanted: [[BendingModuli::NONE; 3]; D],
        };
        for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
            for (k, l) in (0..D).flat_map(|k| (0..D).map(move |l| (k, l))) {
                let entry = entry(i, j, k, l);
                for a in 0..D {
                    let along = Dual::splat(directions[a][i]) * entry;
                    (0..D).for_each(|b| frame.acoustic[a][b][j][l] += along * Dual::splat(directions[b][k]));
                    frame.volume[a][j] += if k == l { along } else { zero };
                }
                frame.bulk += if i == j && k == l { entry } else { zero };
            }
        }
        for l in 0..D {
            frame.wanted[l] = frame.asked(cell, l);
        }
        frame
    }

    /// `T` across axis `l`, and `B` of cells that are alone across it and of others.
    fn asked<const N: usize>(&self, cell: &Isoparametric<D, N>, l: usize) -> [BendingModuli; 3] {
        let [k, m] = others::<D>(l);
        let normal = |a: usize, b: usize| {
            self.acoustic[a][b]
                .mul_vec(&self.directions[b].map(Dual::splat))
                .iter()
                .zip(&self.directions[a])
                .fold(Dual::splat(0.0), |sum, (along, n)| sum + *along * Dual::splat(*n))
        };
        let free = |a: usize, b: usize| normal(a, b) - normal(a, l) * normal(l, b) / normal(l, l);
        let target = BendingModuli { own: [free(k, k), free(m, m)], coupling: free(k, m) };
        let reference: f64 = cell.points.iter().map(|(_, weight)| weight).sum();
        // In a cube of edges 2 the slope of `xi_k xi_l` is `xi_l n_k + xi_k n_l`.
        let slopes = |k: usize| -> Vec<Slope<D>> {
            let slope = |(xi, weight): &([f64; D], f64)| {
                let mut slope = [0.0; D];
                for i in 0..D {
                    slope[i] = xi[l] * self.directions[k][i] + xi[k] * self.directions[l][i];
                }
                (slope, weight / reference)
            };
            cell.points.iter().map(slope).collect()
        };
        let cube = self.moduli([k, m], &[slopes(k), slopes(m)]);
        match D {
            2 => [target, target, cube],
            _ => [target, cube.plus(&cube.lacking(&target), 1.0), cube.plus(&cube.over(&target), 1.0)],
        }
    }

    /// Moduli of the modes along axes `k` and `m` whose amplitudes have these slopes where the strain is 1 at
    /// the surface.
    fn moduli(&self, [k, m]: [usize; 2], slopes: &[Vec<Slope<D>>; 2]) -> BendingModuli {
        let [first, second] = slopes;
        let of = |a, b| self.product(a, b);
        BendingModuli {
            own: [of((k, first), (k, first)), of((m, second), (m, second))],
            coupling: of((k, first), (m, second)),
        }
    }

    /// `3 sum_q w_q dFb_q : C : dFb_q / V` of two modes, of a box the modulus in bending; with the slopes `g`
    /// of their amplitudes `dFb = n g^T + t I`, `t = (mean(n . g) - n . g)/D`.
    fn product(&self, (k, a): (usize, &[Slope<D>]), (m, b): (usize, &[Slope<D>])) -> Dual<f64> {
        let trace = |k: usize, slope: &[f64; D]| dot(&self.directions[k], slope);
        let mean = |k: usize, slopes: &[Slope<D>]| -> f64 {
            slopes.iter().map(|(slope, part)| part * trace(k, slope)).sum()
        };
        let (mean_a, mean_b) = (mean(k, a), mean(m, b));
        let dilated = |mean: f64, trace: f64| if self.is_mean { (mean - trace) / D as f64 } else { 0.0 };
        let mut sum = Dual::splat(0.0);
        for ((a, part), (b, _)) in a.iter().zip(b) {
            let (t, u) = (dilated(mean_a, trace(k, a)), dilated(mean_b, trace(m, b)));
            let mut work = Dual::splat(t * u) * self.bulk;
            for j in 0..D {
                work += Dual::splat(a[j] * u) * self.volume[k][j] + Dual::splat(b[j] * t) * self.volume[m][j];
                (0..D).for_each(|l| work += Dual::splat(a[j] * b[l]) * self.acoustic[k][m][j][l]);
            }
            sum += Dual::splat(3.0 * part) * work;
        }
        sum
    }
}

/// The axes beside `l`, ascending; in the plane the other one, twice.
fn others<const D: usize>(l: usize) -> [usize; 2] {
    let mut beside = (0..D).filter(|k| *k != l);
    let first = beside.next().unwrap_or(l);
    [first, beside.next().unwrap_or(first)]
}

/// A cell at rest, to find the stiffness that it lacks.
struct LackingCell<'a, const D: usize, const N: usize> {
    cell: &'a Isoparametric<D, N>,
    nodes: &'a [[f64; D]; N],
    /// `b` of every node and the part of the volume, at the quadrature points.
    points: &'a [([[f64; D]; N], f64)],
}

impl<const D: usize, const N: usize> LackingCell<'_, D, N> {
    /// `xi_k xi_l` at the nodes.
    fn signs(&self, [k, l]: [usize; 2]) -> [f64; N] {
        self.cell.nodes.map(|node| node[k] * node[l])
    }

    /// `g` of every node.
    fn weights(&self, axes: [usize; 2]) -> [f64; N] {
        let signs = self.signs(axes);
        let mut along = [0.0; D];
        for (sign, node) in signs.iter().zip(self.nodes) {
            (0..D).for_each(|i| along[i] += sign * (node[i] - self.nodes[0][i]));
        }
        let mut weights = signs;
        for (gradient, part) in self.points {
            for (weight, b) in weights.iter_mut().zip(gradient) {
                *weight -= part * dot(&along, b);
            }
        }
        weights.map(|weight| weight / N as f64)
    }

    /// Unit vectors along the axes, made orthogonal one after the other.
    fn directions(&self) -> [[f64; D]; D] {
        let j = self.cell.jacobian(self.nodes, &[0.0; D]);
        let mut frame = [[0.0; D]; D];
        for k in 0..D {
            let mut e = [0.0; D];
            (0..D).for_each(|i| e[i] = j[i][k]);
            for of_before in &frame[..k] {
                let part = dot(&e, of_before);
                (0..D).for_each(|i| e[i] -= part * of_before[i]);
            }
            let length = dot(&e, &e).sqrt();
            frame[k] = e.map(|e| e / length);
        }
        frame
    }

    /// Slopes of `h_k/2 xi_k xi_l` at the quadrature points, as the cell takes them.
    fn slopes(&self, [k, l]: [usize; 2], length: f64) -> Vec<Slope<D>> {
        let signs = self.signs([k, l]);
        let slope = |(gradient, part): &([[f64; D]; N], f64)| {
            let mut slope = [0.0; D];
            for (sign, gradient) in signs.iter().zip(gradient) {
                (0..D).for_each(|i| slope[i] += 0.5 * length * sign * gradient[i]);
            }
            (slope, *part)
        };
        self.points.iter().map(slope).collect()
    }

    /// What the cell of this volume lacks of a solid, or its change.
    fn find(&self, alone: [bool; D], volume: f64, solid: BendingSolid<'_, D>) -> CellFound<D, N> {
        let frame = CellFrame::new(self.cell, self.directions(), solid);
        let lengths = lengths(self.cell, self.nodes);
        let mut found = CellFound {
            offsets: self.nodes.map(|node| {
                let mut offset = node;
                (0..D).for_each(|i| offset[i] -= self.nodes[0][i]);
                offset
            }),
            alone,
            middle: self.cell.jacobian(self.nodes, &[0.0; D]),
            stiffness: [[0.0; 2]; MOST_PAIRS],
            coupling: [0.0; MOST_PAIRS],
            weight: [[0.0; N]; MOST_PAIRS],
        };
        let wanted = |number: Dual<f64>| {
            volume / 3.0 * if solid.change.is_some() { number.derivative } else { number.value }
        };
        for (l, is_alone) in alone.into_iter().enumerate() {
            let BendingModuli { own, coupling } = self.across(l, is_alone, &frame, &lengths);
            for (k, number) in (0..D).filter(|k| *k != l).zip(own) {
                let (pair, side) = place(k, l);
                found.stiffness[pair][side] = wanted(number);
            }
            found.coupling[l] = wanted(coupling);
        }
        for (weight, axes) in found.weight.iter_mut().zip(axes(D)) {
            *weight = self.weights(*axes);
        }
        found
    }

    /// `4/(h_k h_m) (B - A)` across axis `l`, across which the cell may be alone, and its change.
    fn across(&self, l: usize, is_alone: bool, frame: &CellFrame<D>, lengths: &[f64; D]) -> BendingModuli {
        let [k, m] = others::<D>(l);
        let own = frame.moduli([k, m], &[k, m].map(|k| self.slopes([k, l], lengths[k])));
        let [target, alone, one_of_many] = &frame.wanted[l];
        let wanted = if is_alone { alone } else { one_of_many };
        let lacks = if D == 2 {
            BendingModuli {
                own: [lacking(wanted.own[0], own.own[0]), Dual::splat(0.0)],
                ..BendingModuli::NONE
            }
        } else {
            wanted.plus(&own, -1.0).positive_part(target.own[0].value)
        };
        lacks.scaled([k, m].map(|k| Dual::splat(2.0 / lengths[k])))
    }
}

/// `wanted - own`, zero where the cell is stiff enough or the solid has no stiffness across.
fn lacking(wanted: Dual<f64>, own: Dual<f64>) -> Dual<f64> {
    let lacks = wanted - own;
    // Not a number without stiffness across.
    if lacks.value > ROUNDING * wanted.value { lacks } else { Dual::splat(0.0) }
}

/// Symmetric matrix of two modes.
#[derive(Clone, Copy)]
struct BendingModuli {
    own: [Dual<f64>; 2],
    coupling: Dual<f64>,
}

impl BendingModuli {
    const NONE: Self = {
        let zero = Dual { value: 0.0, derivative: 0.0 };
        BendingModuli { own: [zero; 2], coupling: zero }
    };

    /// `S A S` with the diagonal matrix `S`.
    fn scaled(self, by: [Dual<f64>; 2]) -> Self {
        let [a, b] = self.own;
        BendingModuli { own: [a * by[0] * by[0], b * by[1] * by[1]], coupling: self.coupling * by[0] * by[1] }
    }

    /// `self + factor other`.
    fn plus(&self, other: &BendingModuli, factor: f64) -> Self {
        let plus = |a: Dual<f64>, b: Dual<f64>| a + Dual::splat(factor) * b;
        let [a, b] = self.own;
        BendingModuli {
            own: [plus(a, other.own[0]), plus(b, other.own[1])],
            coupling: plus(self.coupling, other.coupling),
        }
    }

    /// The part with positive eigenvalues, of moduli of this size.
    fn positive_part(self, size: f64) -> Self {
        let [a, b] = self.own;
        let (half, o) = (Dual::splat(0.5), self.coupling);
        let (mean, apart) = (half * (a + b), half * (a - b));
        let radius = (apart * apart + o * o).sqrt();
        let largest = mean + radius;
        // Not a number where the solid has no stiffness across.
        if largest.value.is_nan() || largest.value <= ROUNDING * size {
            return Self::NONE;
        }
        if (mean - radius).value >= -ROUNDING * size {
            return self;
        }
        let part = half * largest / radius;
        BendingModuli { own: [part * (radius + apart), part * (radius - apart)], coupling: part * o }
    }

    /// `sqrt(E)` along both axes of what is free along the other; `None` where it has no stiffness.
    fn roots(&self) -> Option<[Dual<f64>; 2]> {
        let [t, u] = self.own;
        let free = |a: Dual<f64>, b: Dual<f64>| a - self.coupling * self.coupling / b;
        let roots = [free(t, u).sqrt(), free(u, t).sqrt()];
        roots.iter().all(|root| root.value > 0.0).then_some(roots)
    }

    /// The multiple of `[[1, 1], [1, 1]]`, not positive, that makes the bending `(1, -nu)` of a body of the
    /// moduli `T` cost `E`, where it costs more by the moduli of `self`, which stay positive.
    fn over(self, target: &BendingModuli) -> Self {
        let Some(roots) = target.roots() else { return Self::NONE };
        let (inverse, one) = (roots.map(|root| Dual::splat(1.0) / root), Dual::splat(1.0));
        let (unit, free) = (self.scaled(inverse), target.scaled(inverse));
        let nu = free.coupling / free.own[0];
        let [a, b] = unit.own;
        let costs = a + nu * (nu * b - Dual::splat(2.0) * unit.coupling);
        let over = (costs - one) / ((one - nu) * (one - nu));
        let most = Dual::splat(0.25) * (a + b + Dual::splat(2.0) * unit.coupling);
        let over = if over.value < most.value { over } else { most };
        if over.value.is_nan() || over.value <= 0.0 {
            return Self::NONE;
        }
        BendingModuli { own: [-over, -over], coupling: -over }.scaled(roots)
    }

    /// `B - A` of the moduli `A` of a cell, for the moduli `T`.
    fn lacking(self, target: &BendingModuli) -> Self {
        let Some(roots) = target.roots() else { return Self::NONE };
        let [t, u] = target.own;
        let lacks = [t - self.own[0], u - self.own[1]];
        let coupling = target.coupling - self.coupling;
        let determinant = lacks[0] * lacks[1] - coupling * coupling;
        if lacks.iter().all(|lack| lack.value >= 0.0) && determinant.value >= 0.0 {
            return BendingModuli { own: lacks, coupling };
        }
        let unit = self.scaled(roots.map(|root| Dual::splat(1.0) / root));
        unit.of_rank_one().unwrap_or_else(|| unit.diagonal()).scaled(roots)
    }

    /// The matrix `[[d, o], [o, e]]` with `o^2 = d e` that makes both `A + d - (c + o)^2 / (B + e)` and the
    /// same of the other 1: both are then `x`, `o = (p x - r) / (2 c)`, `p = A + B - 1`, `r = A B + c^2` and
    /// `4 c^2 (x - A) (x - B) = (p x - r)^2`. `None` where none has `d, e, o >= 0`.
    fn of_rank_one(&self) -> Option<Self> {
        let ([a, b], c, two) = (self.own, self.coupling, Dual::splat(2.0));
        let (p, r) = (a + b - Dual::splat(1.0), a * b + c * c);
        let second = p * p - two * two * c * c;
        let first = p * r - two * c * c * (a + b);
        let root = (first * first - second * (r * r - two * two * c * c * a * b)).sqrt();
        [-root, root].into_iter().find_map(|root| {
            let x = (first + root) / second;
            let (own, coupling) = ([x - a, x - b], (p * x - r) / (two * c));
            (own.iter().chain([&coupling]).all(|entry| entry.value >= 0.0))
                .then_some(BendingModuli { own, coupling })
        })
    }

    /// The diagonal matrix that does the same, or less where one is stiff enough.
    fn diagonal(&self) -> Self {
        let squared = Dual::splat(4.0) * self.coupling * self.coupling;
        let wanted = Dual::splat(0.5) * (Dual::splat(1.0) + (Dual::splat(1.0) + squared).sqrt());
        BendingModuli { own: self.own.map(|own| lacking(wanted, own)), coupling: Dual::splat(0.0) }
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

/// A pack of cells that bend.
#[derive(Clone, Copy)]
pub(crate) struct BendingPack<'a, const D: usize, const N: usize> {
    pub(crate) bending: &'a CellBending<D, N>,
    pub(crate) index: &'a PackIndex<N>,
    /// Its number.
    pub(crate) pack: usize,
    /// Directions `f_k` are those of now, not of rest.
    pub(crate) turns: bool,
}

impl<'a, const D: usize, const N: usize> BendingPack<'a, D, N> {
    #[inline(always)]
    fn pairs(&self) -> &'a [BendingPair<N>] {
        &self.bending.pairs[self.pack * axes(D).len()..][..axes(D).len()]
    }

    /// `f_k` of all axes.
    #[inline(always)]
    fn directions<S: Scalar>(&self, x: &[[S; D]; N]) -> [[S; D]; D] {
        let mut f = [[S::zero(); D]; D];
        for k in 0..D {
            f[k] = weighted(x, &self.bending.slopes(k));
        }
        f
    }

    /// `f_k` at rest.
    #[inline(always)]
    fn at_rest<L: Lanes, S: PackScalar<L>>(&self) -> [[S; D]; D] {
        let mut f = [[S::zero(); D]; D];
        for k in 0..D {
            for i in 0..D {
                f[k][i] = S::constant(<L as Lanes>::load(&self.bending.common[self.pack].rest[k][i]));
            }
        }
        f
    }

    /// `q` of all pairs.
    #[inline(always)]
    fn hourglass<L: Lanes, S: PackScalar<L>>(&self, x: &[[S; D]; N]) -> [[S; D]; MOST_PAIRS] {
        let mut q = [[S::zero(); D]; MOST_PAIRS];
        for (q, pair) in q.iter_mut().zip(self.pairs()) {
            let mut weight = [S::zero(); N];
            for a in 0..N {
                weight[a] = S::constant(<L as Lanes>::load(&pair.weight[a]));
            }
            *q = weighted(x, &weight);
        }
        q
    }

    /// The modes of all pairs, and their `s`.
    #[inline(always)]
    fn modes<L: Lanes, S: PackScalar<L>>(
        &self,
        x: &[[S; D]; N],
    ) -> ([[BendingMode<S, D>; 2]; MOST_PAIRS], [[S; 2]; MOST_PAIRS]) {
        let f = if self.turns { self.directions(x) } else { self.at_rest::<L, S>() };
        let q = self.hourglass::<L, S>(x);
        let (mut modes, mut s) = ([[BendingMode::zero(); 2]; MOST_PAIRS], [[S::zero(); 2]; MOST_PAIRS]);
        for p in 0..axes(D).len() {
            for side in 0..2 {
                modes[p][side] = BendingMode::new(&q[p], &f[axes(D)[p][side]], self.turns);
                s[p][side] = modes[p][side].s;
            }
        }
        (modes, s)
    }

    /// Forces of displacements, or of rates, of the modes.
    #[inline(always)]
    fn forces<L: Lanes, S: PackScalar<L>>(&self, s: &[[S; 2]; MOST_PAIRS]) -> [[S; 2]; MOST_PAIRS] {
        let mut forces = [[S::zero(); 2]; MOST_PAIRS];
        for (p, pair) in self.pairs().iter().enumerate() {
            for side in 0..2 {
                forces[p][side] = s[p][side] * S::constant(<L as Lanes>::load(&pair.stiffness[side]));
            }
        }
        if D == 3 {
            for l in 0..3 {
                let [one, other] = COUPLED[l];
                let coupling = &self.bending.common[self.pack].coupling[l];
                let coupling = S::constant(<L as Lanes>::load(coupling));
                forces[one.0][one.1] += coupling * s[other.0][other.1];
                forces[other.0][other.1] += coupling * s[one.0][one.1];
            }
        }
        forces
    }

    /// Adds to the nodes these `q` times their weights and `f` times their slopes.
    #[inline(always)]
    fn spread<L: Lanes>(&self, q: &[[L; D]; MOST_PAIRS], f: &[[L; D]; D], gradients: &mut [[L; D]; N]) {
        for (q, pair) in q.iter().zip(self.pairs()) {
            for a in 0..N {
                let weight = L::load(&pair.weight[a]);
                for i in 0..D {
                    gradients[a][i] = q[i].mul_add(weight, gradients[a][i]);
                }
            }
        }
        for k in 0..D {
            for a in 0..N {
                let slope = L::splat(self.bending.slopes[a][k]);
                for i in 0..D {
                    gradients[a][i] = f[k][i].mul_add(slope, gradients[a][i]);
                }
            }
        }
    }

    /// Adds viscous forces to the nodes; gives their power. With the stiffnesses of a solid of the
    /// viscosities `R` is of the rates of `q . f` over `|f|` at rest what the energy is of `s`: like Green's
    /// strain `q . f` is quadratic in the positions.
    #[inline(always)]
    pub(crate) fn add_viscous<L: Lanes>(
        &self,
        x: &[[L; D]; N],
        v: &[[L; D]; N],
        gradients: &mut [[L; D]; N],
    ) -> L {
        let (f, rates_of_f, rest) = (self.directions(x), self.directions(v), self.at_rest::<L, L>());
        let (q, rates_of_q) = (self.hourglass::<L, L>(x), self.hourglass::<L, L>(v));
        let (mut of_q, mut of_f) = ([[L::zero(); D]; MOST_PAIRS], [[L::zero(); D]; D]);
        let mut rates = [[L::zero(); 2]; MOST_PAIRS];
        let mut inverse = [L::zero(); D];
        for k in 0..D {
            inverse[k] = L::one() / dot(&rest[k], &rest[k]).sqrt();
        }
        for p in 0..axes(D).len() {
            for side in 0..2 {
                let k = axes(D)[p][side];
                rates[p][side] = (dot(&rates_of_q[p], &f[k]) + dot(&q[p], &rates_of_f[k])) * inverse[k];
            }
        }
        let forces = self.forces::<L, L>(&rates);
        let mut power = L::zero();
        for p in 0..axes(D).len() {
            for side in 0..2 {
                let k = axes(D)[p][side];
                power = forces[p][side].mul_add(rates[p][side], power);
                let force = forces[p][side] * inverse[k];
                for i in 0..D {
                    of_q[p][i] = force.mul_add(f[k][i], of_q[p][i]);
                    of_f[k][i] = force.mul_add(q[p][i], of_f[k][i]);
                }
            }
        }
        self.spread(&of_q, &of_f, gradients);
        power
    }
}

/// Adds the energy in bending of a pack to one sum per lane.
pub(super) struct BendingEnergyKernel<'a, const D: usize, const N: usize> {
    pub(super) pack: BendingPack<'a, D, N>,
    pub(super) position: &'a RowSlice<D>,
    pub(super) sum: &'a mut [f64; WIDTH],
}

impl<const D: usize, const N: usize> Kernel for BendingEnergyKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let x = gather::<L, D, N>(self.position, self.pack.index);
        let (_, s) = self.pack.modes::<L, L>(&x);
        let forces = self.pack.forces::<L, L>(&s);
        let mut sum = <L as Lanes>::load(self.sum);
        for p in 0..axes(D).len() {
            for side in 0..2 {
                sum = (L::splat(0.5) * forces[p][side]).mul_add(s[p][side], sum);
            }
        }
        <L as Lanes>::store(sum, self.sum);
    }
}

/// Adds the gradients of the energy in bending at the vertices of a pack, or their change `ALONG` a direction.
pub(super) struct BendingForceKernel<'a, const D: usize, const N: usize, const ALONG: bool> {
    pub(super) pack: BendingPack<'a, D, N>,
    pub(super) position: &'a RowSlice<D>,
    pub(super) direction: &'a RowSlice<D>,
    pub(super) gradient: &'a mut RowSlice<D>,
}

impl<const D: usize, const N: usize, const ALONG: bool> BendingForceKernel<'_, D, N, ALONG> {
    #[inline(always)]
    fn add<L: Lanes, S: PackScalar<L>>(self, x: &[[S; D]; N]) {
        let (modes, s) = self.pack.modes::<L, S>(x);
        let forces = self.pack.forces::<L, S>(&s);
        let (mut of_q, mut of_f) = ([[L::zero(); D]; MOST_PAIRS], [[L::zero(); D]; D]);
        for p in 0..axes(D).len() {
            for side in 0..2 {
                let (mode, force, k) = (&modes[p][side], forces[p][side], axes(D)[p][side]);
                for i in 0..D {
                    of_q[p][i] += (force * mode.of_q[i]).last();
                    of_f[k][i] += (force * mode.of_f[i]).last();
                }
            }
        }
        let mut gradients = [[L::zero(); D]; N];
        self.pack.spread(&of_q, &of_f, &mut gradients);
        scatter(self.gradient, self.pack.index, gradients);
    }
}

impl<const D: usize, const N: usize, const ALONG: bool> Kernel for BendingForceKernel<'_, D, N, ALONG> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let x = gather::<L, D, N>(self.position, self.pack.index);
        if !ALONG {
            return self.add::<L, L>(&x);
        }
        let dx = gather::<L, D, N>(self.direction, self.pack.index);
        self.add::<L, Dual<L>>(&with_change(&x, &dx));
    }
}
