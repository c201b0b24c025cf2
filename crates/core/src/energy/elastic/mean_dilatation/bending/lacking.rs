//! Moduli in bending that a cell has, and those that it should have.

use std::collections::HashMap;

use super::super::Dilatation;
use super::super::packs::lengths;
use super::{BendingSolid, MOST_PAIRS, axes, dot, place};
use crate::algebra::{Dual, Mat};
use crate::element::Isoparametric;
use crate::energy::patch::Patches;
use crate::scalar::{Elementary, Scalar};

/// Part of a modulus below which a difference is rounding.
const ROUNDING: f64 = 1e-12;

/// Sides of cells by their vertices, ascending, with how many cells have each.
pub(super) struct CellSides(HashMap<[u32; MOST_OF_SIDE], u32>);

/// Vertices of a side at most.
const MOST_OF_SIDE: usize = 4;

impl CellSides {
    pub(super) fn of<const D: usize, const N: usize>(
        cell: &Isoparametric<D, N>,
        patches: &Patches<N>,
    ) -> Self {
        let mut sides = HashMap::new();
        for (_, vertices, ..) in patches.stencils() {
            for side in cell.kind.sides {
                *sides.entry(side_of(side, &vertices)).or_default() += 1;
            }
        }
        CellSides(sides)
    }

    /// True if both sides of a cell across axis `l` are on the surface.
    pub(super) fn is_alone<const D: usize, const N: usize>(
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

/// Stiffness in bending that a cell lacks.
pub(super) struct CellFound<const D: usize, const N: usize> {
    /// Places of its nodes from the first one on [m].
    offsets: [[f64; D]; N],
    /// Axes across which it is alone.
    alone: [bool; D],
    /// `J` in its middle [m].
    pub(super) middle: Mat<f64, D>,
    /// Stiffness of every pair of axes and side.
    pub(super) stiffness: [[f64; 2]; MOST_PAIRS],
    /// Across every axis.
    pub(super) coupling: [f64; MOST_PAIRS],
    /// `g` of every pair of axes.
    pub(super) weight: [[f64; N]; MOST_PAIRS],
}

impl<const D: usize, const N: usize> CellFound<D, N> {
    /// True if it is that of a cell with these nodes but for rounding: neighbours in a grid are congruent.
    pub(super) fn is_of(&self, nodes: &[[f64; D]; N], alone: [bool; D]) -> bool {
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
pub(super) struct LackingCell<'a, const D: usize, const N: usize> {
    pub(super) cell: &'a Isoparametric<D, N>,
    pub(super) nodes: &'a [[f64; D]; N],
    /// `b` of every node and the part of the volume, at the quadrature points.
    pub(super) points: &'a [([[f64; D]; N], f64)],
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

    /// Stiffness that the cell of this volume lacks of a solid, or its change.
    pub(super) fn find(&self, alone: [bool; D], volume: f64, solid: BendingSolid<'_, D>) -> CellFound<D, N> {
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
