//! Moduli in bending that a cell has, and those that it should have.

use std::collections::HashMap;

use super::super::Dilatation;
use super::super::packs::{RestPoint, lengths, middle};
use super::super::shape::number::{KINK, RestNumber};
use super::{BendingSolid, MOST_PAIRS, axes, dot, place};
use crate::algebra::Mat;
use crate::element::Isoparametric;
use crate::energy::patch::Patches;

/// Part of a modulus below which a difference is rounding.
const ROUNDING: f64 = 1e-12;

/// Sides of cells by their vertices, ascending, with how many cells have each.
pub(in super::super) struct CellSides(HashMap<[u32; MOST_OF_SIDE], u32>);

/// Vertices of a side at most.
const MOST_OF_SIDE: usize = 4;

impl CellSides {
    pub(in super::super) fn of<const D: usize, const N: usize>(
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

    /// Axes across which a cell is alone.
    pub(in super::super) fn alone<const D: usize, const N: usize>(
        &self,
        cell: &Isoparametric<D, N>,
        vertices: &[u32; N],
    ) -> [bool; D] {
        let mut alone = [true; D];
        (0..D).for_each(|l| alone[l] = self.is_alone(cell, vertices, l));
        alone
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

/// Stiffness in bending that a cell lacks.
pub(super) struct CellFound<S, const D: usize, const N: usize> {
    /// Places of its nodes from the first one on [m].
    offsets: [[f64; D]; N],
    /// Axes across which it is alone.
    alone: [bool; D],
    /// `J` in its middle [m].
    pub(super) middle: Mat<f64, D>,
    /// Stiffness of its modes.
    pub(super) stiffness: BendingStiffness<S>,
    /// `g` of every pair of axes.
    pub(super) weight: [[f64; N]; MOST_PAIRS],
}

/// Stiffness of the modes of a cell [N/m in space].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BendingStiffness<S> {
    /// Of every pair of axes and side.
    pub(crate) own: [[S; 2]; MOST_PAIRS],
    /// Across every axis.
    pub(crate) coupling: [S; MOST_PAIRS],
}

impl<S: Copy> BendingStiffness<S> {
    /// All numbers alike.
    pub(crate) fn splat(number: S) -> Self {
        BendingStiffness { own: [[number; 2]; MOST_PAIRS], coupling: [number; MOST_PAIRS] }
    }

    /// The same function of each number.
    pub(crate) fn map<T>(&self, of: impl Fn(S) -> T + Copy) -> BendingStiffness<T> {
        BendingStiffness { own: self.own.map(|pair| pair.map(of)), coupling: self.coupling.map(of) }
    }

    /// All numbers.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = &S> {
        self.own.as_flattened().iter().chain(&self.coupling)
    }

    /// All numbers, to change them.
    pub(crate) fn numbers_mut(&mut self) -> impl Iterator<Item = &mut S> {
        self.own.as_flattened_mut().iter_mut().chain(&mut self.coupling)
    }
}

impl<S, const D: usize, const N: usize> CellFound<S, D, N> {
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
type Slope<S, const D: usize> = ([S; D], S);

/// Directions of a cell, and of the solid what bending along them asks for.
struct CellFrame<S, const D: usize> {
    /// Unit vectors `n_k`.
    directions: [[S; D]; D],
    /// `n_a_i C_ijkl n_b_k` [Pa].
    acoustic: [[Mat<S, D>; D]; D],
    /// `n_a_i C_ijkk` [Pa].
    volume: [[S; D]; D],
    /// `C_iikk` [Pa].
    bulk: S,
    /// True if all points have one ratio of volumes.
    is_mean: bool,
    /// `T` across every axis, and `B` of cells that are alone across it and of others.
    wanted: [[BendingModuli<S>; 3]; D],
}

impl<S: RestNumber, const D: usize> CellFrame<S, D> {
    fn new<const N: usize>(
        cell: &Isoparametric<D, N>,
        directions: [[S; D]; D],
        solid: BendingSolid<'_, D>,
    ) -> Self {
        let entry = |i: usize, j: usize, k: usize, l: usize| {
            let change = solid.change.map_or(0.0, |change| change.0[i][j][k][l]);
            S::with_rate(solid.tangent.0[i][j][k][l], change)
        };
        let zero = S::zero();
        let mut frame = CellFrame {
            directions,
            acoustic: [[Mat::zero(); D]; D],
            volume: [[zero; D]; D],
            bulk: zero,
            is_mean: solid.dilatation != Dilatation::Own,
            wanted: [[BendingModuli::none(); 3]; D],
        };
        for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
            for (k, l) in (0..D).flat_map(|k| (0..D).map(move |l| (k, l))) {
                let entry = entry(i, j, k, l);
                for a in 0..D {
                    let along = directions[a][i] * entry;
                    (0..D).for_each(|b| frame.acoustic[a][b][j][l] += along * directions[b][k]);
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
    fn asked<const N: usize>(&self, cell: &Isoparametric<D, N>, l: usize) -> [BendingModuli<S>; 3] {
        let [k, m] = others::<D>(l);
        let normal = |a: usize, b: usize| {
            self.acoustic[a][b]
                .mul_vec(&self.directions[b])
                .iter()
                .zip(&self.directions[a])
                .fold(S::zero(), |sum, (along, n)| sum + *along * *n)
        };
        let free = |a: usize, b: usize| normal(a, b) - normal(a, l) * normal(l, b) / normal(l, l);
        let target = BendingModuli { own: [free(k, k), free(m, m)], coupling: free(k, m) };
        let reference: f64 = cell.points.iter().map(|(_, weight)| weight).sum();
        // In a cube of edges 2 the slope of `xi_k xi_l` is `xi_l n_k + xi_k n_l`.
        let slopes = |k: usize| -> Vec<Slope<S, D>> {
            let slope = |(xi, weight): &([f64; D], f64)| {
                let mut slope = [S::zero(); D];
                for i in 0..D {
                    slope[i] =
                        S::splat(xi[l]) * self.directions[k][i] + S::splat(xi[k]) * self.directions[l][i];
                }
                (slope, S::splat(weight / reference))
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
    fn moduli(&self, [k, m]: [usize; 2], slopes: &[Vec<Slope<S, D>>; 2]) -> BendingModuli<S> {
        let [first, second] = slopes;
        let of = |a, b| self.product(a, b);
        BendingModuli {
            own: [of((k, first), (k, first)), of((m, second), (m, second))],
            coupling: of((k, first), (m, second)),
        }
    }

    /// `3 sum_q w_q dFb_q : C : dFb_q / V` of two modes, of a box the modulus in bending; with the slopes `g`
    /// of their amplitudes `dFb = n g^T + t I`, `t = (mean(n . g) - n . g)/D`.
    fn product(&self, (k, a): (usize, &[Slope<S, D>]), (m, b): (usize, &[Slope<S, D>])) -> S {
        let trace = |k: usize, slope: &[S; D]| dot(&self.directions[k], slope);
        let mean = |k: usize, slopes: &[Slope<S, D>]| {
            let parts = slopes.iter().map(|(slope, part)| *part * trace(k, slope));
            parts.fold(S::zero(), |sum, part| sum + part)
        };
        let (mean_a, mean_b) = (mean(k, a), mean(m, b));
        let dilated = |mean: S, trace: S| {
            if self.is_mean { (mean - trace) / S::splat(D as f64) } else { S::zero() }
        };
        let mut sum = S::zero();
        for ((a, part), (b, _)) in a.iter().zip(b) {
            let (t, u) = (dilated(mean_a, trace(k, a)), dilated(mean_b, trace(m, b)));
            let mut work = t * u * self.bulk;
            for j in 0..D {
                work += a[j] * u * self.volume[k][j] + b[j] * t * self.volume[m][j];
                (0..D).for_each(|l| work += a[j] * b[l] * self.acoustic[k][m][j][l]);
            }
            sum += S::splat(3.0) * *part * work;
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
pub(in super::super) struct LackingCell<'a, S, const D: usize, const N: usize> {
    pub(in super::super) cell: &'a Isoparametric<D, N>,
    pub(in super::super) nodes: &'a [[S; D]; N],
    /// `b` of every node and the part of the volume, at the quadrature points.
    pub(in super::super) points: &'a [RestPoint<S, D, N>],
}

impl<S: RestNumber, const D: usize, const N: usize> LackingCell<'_, S, D, N> {
    /// `xi_k xi_l` at the nodes.
    fn signs(&self, [k, l]: [usize; 2]) -> [f64; N] {
        self.cell.nodes.map(|node| node[k] * node[l])
    }

    /// `g` of every node.
    pub(in super::super) fn weights(&self, axes: [usize; 2]) -> [S; N] {
        let signs = self.signs(axes).map(S::splat);
        let mut along = [S::zero(); D];
        for (sign, node) in signs.iter().zip(self.nodes) {
            (0..D).for_each(|i| along[i] += *sign * (node[i] - self.nodes[0][i]));
        }
        let mut weights = signs;
        for (gradient, part) in self.points {
            for (weight, b) in weights.iter_mut().zip(gradient) {
                *weight -= *part * dot(&along, b);
            }
        }
        weights.map(|weight| weight / S::splat(N as f64))
    }

    /// Unit vectors along the axes, made orthogonal one after the other.
    fn directions(&self) -> [[S; D]; D] {
        let j = middle(self.cell, self.nodes);
        let mut frame = [[S::zero(); D]; D];
        for k in 0..D {
            let mut e = [S::zero(); D];
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
    fn slopes(&self, [k, l]: [usize; 2], length: S) -> Vec<Slope<S, D>> {
        let signs = self.signs([k, l]);
        let slope = |(gradient, part): &RestPoint<S, D, N>| {
            let mut slope = [S::zero(); D];
            for (sign, gradient) in signs.iter().zip(gradient) {
                let factor = S::splat(0.5) * length * S::splat(*sign);
                (0..D).for_each(|i| slope[i] += factor * gradient[i]);
            }
            (slope, *part)
        };
        self.points.iter().map(slope).collect()
    }

    /// Stiffness that the cell of this volume lacks of a solid.
    pub(in super::super) fn stiffness(
        &self,
        alone: [bool; D],
        volume: S,
        solid: BendingSolid<'_, D>,
    ) -> BendingStiffness<S> {
        let frame = CellFrame::new(self.cell, self.directions(), solid);
        let lengths = lengths(self.cell, self.nodes);
        let mut stiffness = BendingStiffness::splat(S::zero());
        let third = volume / S::splat(3.0);
        for (l, is_alone) in alone.into_iter().enumerate() {
            let BendingModuli { own, coupling } = self.across(l, is_alone, &frame, &lengths);
            for (k, number) in (0..D).filter(|k| *k != l).zip(own) {
                let (pair, side) = place(k, l);
                stiffness.own[pair][side] = third * number;
            }
            stiffness.coupling[l] = third * coupling;
        }
        stiffness
    }

    /// Stiffness of a cell, and what goes with it.
    pub(super) fn find(&self, alone: [bool; D], volume: S, solid: BendingSolid<'_, D>) -> CellFound<S, D, N> {
        let nodes = self.nodes.map(|node| node.map(S::value));
        let mut found = CellFound {
            offsets: nodes.map(|node| {
                let mut offset = node;
                (0..D).for_each(|i| offset[i] -= nodes[0][i]);
                offset
            }),
            alone,
            middle: middle(self.cell, &nodes),
            stiffness: self.stiffness(alone, volume, solid),
            weight: [[0.0; N]; MOST_PAIRS],
        };
        for (weight, axes) in found.weight.iter_mut().zip(axes(D)) {
            *weight = self.weights(*axes).map(S::value);
        }
        found
    }

    /// `4/(h_k h_m) (B - A)` across axis `l`, across which the cell may be alone, and its change.
    fn across(
        &self,
        l: usize,
        is_alone: bool,
        frame: &CellFrame<S, D>,
        lengths: &[S; D],
    ) -> BendingModuli<S> {
        let [k, m] = others::<D>(l);
        let own = frame.moduli([k, m], &[k, m].map(|k| self.slopes([k, l], lengths[k])));
        let [target, alone, one_of_many] = &frame.wanted[l];
        let wanted = if is_alone { alone } else { one_of_many };
        let lacks = if D == 2 {
            BendingModuli { own: [lacking(wanted.own[0], own.own[0]), S::zero()], ..BendingModuli::none() }
        } else {
            wanted.plus(&own, -1.0).positive_part(target.own[0].value())
        };
        lacks.scaled([k, m].map(|k| S::splat(2.0) / lengths[k]))
    }
}

/// `wanted - own`, zero where the cell is stiff enough or the solid has no stiffness across.
fn lacking<S: RestNumber>(wanted: S, own: S) -> S {
    let (lacks, size) = (wanted - own, wanted.value());
    let value = lacks.value();
    // Not a number without stiffness across.
    let is_lacking = value > ROUNDING * size;
    let rate = if value.abs() <= KINK * size { lacks.rate().max(0.0) } else { lacks.rate() };
    match (is_lacking, value >= -KINK * size) {
        (true, _) => S::with_rate(value, rate),
        (false, true) => S::with_rate(0.0, rate),
        _ => S::zero(),
    }
}

/// Symmetric matrix of two modes.
#[derive(Clone, Copy, Debug)]
struct BendingModuli<S> {
    own: [S; 2],
    coupling: S,
}

impl<S: RestNumber> BendingModuli<S> {
    fn none() -> Self {
        BendingModuli { own: [S::zero(); 2], coupling: S::zero() }
    }

    /// `S A S` with the diagonal matrix `S`.
    fn scaled(self, by: [S; 2]) -> Self {
        let [a, b] = self.own;
        BendingModuli { own: [a * by[0] * by[0], b * by[1] * by[1]], coupling: self.coupling * by[0] * by[1] }
    }

    /// `self + factor other`.
    fn plus(&self, other: &Self, factor: f64) -> Self {
        let plus = |a: S, b: S| a + S::splat(factor) * b;
        let [a, b] = self.own;
        BendingModuli {
            own: [plus(a, other.own[0]), plus(b, other.own[1])],
            coupling: plus(self.coupling, other.coupling),
        }
    }

    /// The part with positive eigenvalues, of moduli of this size.
    fn positive_part(self, size: f64) -> Self {
        let value = self.map(S::value).positive_value(size);
        let rate = self.map(S::value).positive_rate(&self.map(S::rate), size);
        let with_rate = |(value, rate)| S::with_rate(value, rate);
        let [a, b] = [0, 1].map(|i| with_rate((value.own[i], rate.own[i])));
        BendingModuli { own: [a, b], coupling: with_rate((value.coupling, rate.coupling)) }
    }

    fn map<T>(&self, of: fn(S) -> T) -> BendingModuli<T> {
        BendingModuli { own: self.own.map(of), coupling: of(self.coupling) }
    }

    /// `sqrt(E)` along both axes of what is free along the other; `None` where it has no stiffness.
    fn roots(&self) -> Option<[S; 2]> {
        let [t, u] = self.own;
        let free = |a: S, b: S| a - self.coupling * self.coupling / b;
        let roots = [free(t, u).sqrt(), free(u, t).sqrt()];
        roots.iter().all(|root| root.value() > 0.0).then_some(roots)
    }

    /// The multiple of `[[1, 1], [1, 1]]`, not positive, that makes the bending `(1, -nu)` of a body of the
    /// moduli `T` cost `E`, where it costs more by the moduli of `self`, which stay positive.
    fn over(self, target: &Self) -> Self {
        let Some(roots) = target.roots() else { return Self::none() };
        let (inverse, one) = (roots.map(|root| S::splat(1.0) / root), S::splat(1.0));
        let (unit, free) = (self.scaled(inverse), target.scaled(inverse));
        let nu = free.coupling / free.own[0];
        let [a, b] = unit.own;
        let costs = a + nu * (nu * b - S::splat(2.0) * unit.coupling);
        let over = (costs - one) / ((one - nu) * (one - nu));
        let most = S::splat(0.25) * (a + b + S::splat(2.0) * unit.coupling);
        let over = if over.value() < most.value() { over } else { most };
        if over.value().is_nan() || over.value() <= 0.0 {
            return Self::none();
        }
        BendingModuli { own: [-over, -over], coupling: -over }.scaled(roots)
    }

    /// `B - A` of the moduli `A` of a cell, for the moduli `T`.
    fn lacking(self, target: &Self) -> Self {
        let Some(roots) = target.roots() else { return Self::none() };
        let [t, u] = target.own;
        let lacks = [t - self.own[0], u - self.own[1]];
        let coupling = target.coupling - self.coupling;
        let determinant = lacks[0] * lacks[1] - coupling * coupling;
        if lacks.iter().all(|lack| lack.value() >= 0.0) && determinant.value() >= 0.0 {
            return BendingModuli { own: lacks, coupling };
        }
        let unit = self.scaled(roots.map(|root| S::splat(1.0) / root));
        unit.of_rank_one().unwrap_or_else(|| unit.diagonal()).scaled(roots)
    }

    /// The matrix `[[d, o], [o, e]]` with `o^2 = d e` that makes both `A + d - (c + o)^2 / (B + e)` and the
    /// same of the other 1: both are then `x`, `o = (p x - r) / (2 c)`, `p = A + B - 1`, `r = A B + c^2` and
    /// `4 c^2 (x - A) (x - B) = (p x - r)^2`. `None` where none has `d, e, o >= 0`.
    fn of_rank_one(&self) -> Option<Self> {
        let ([a, b], c, two) = (self.own, self.coupling, S::splat(2.0));
        let (p, r) = (a + b - S::splat(1.0), a * b + c * c);
        let second = p * p - two * two * c * c;
        let first = p * r - two * c * c * (a + b);
        let root = (first * first - second * (r * r - two * two * c * c * a * b)).sqrt();
        [-root, root].into_iter().find_map(|root| {
            let x = (first + root) / second;
            let (own, coupling) = ([x - a, x - b], (p * x - r) / (two * c));
            (own.iter().chain([&coupling]).all(|entry| entry.value() >= 0.0))
                .then_some(BendingModuli { own, coupling })
        })
    }

    /// The diagonal matrix that does the same, or less where one is stiff enough.
    fn diagonal(&self) -> Self {
        let squared = S::splat(4.0) * self.coupling * self.coupling;
        let wanted = S::splat(0.5) * (S::splat(1.0) + (S::splat(1.0) + squared).sqrt());
        BendingModuli { own: self.own.map(|own| lacking(wanted, own)), coupling: S::splat(0.0) }
    }
}

impl BendingModuli<f64> {
    /// The part with positive eigenvalues.
    fn positive_value(self, size: f64) -> Self {
        let [a, b] = self.own;
        let (half, o) = (0.5, self.coupling);
        let (mean, apart) = (half * (a + b), half * (a - b));
        let radius = (apart * apart + o * o).sqrt();
        let largest = mean + radius;
        // Not a number where the solid has no stiffness across.
        if largest.is_nan() || largest <= ROUNDING * size {
            return Self::none();
        }
        if mean - radius >= -ROUNDING * size {
            return self;
        }
        let part = half * largest / radius;
        BendingModuli { own: [part * (radius + apart), part * (radius - apart)], coupling: part * o }
    }

    /// The rate of that part from here on where the matrix changes at this rate: with the eigenvectors `n_i`
    /// it is `sum_ij f_ij (n_i . dM n_j) n_i n_j^T`, `f_ij` the divided differences of the positive part of
    /// the eigenvalues, and among those that are zero the positive part of `dM`.
    fn positive_rate(&self, rate: &Self, size: f64) -> Self {
        let [a, b] = self.own;
        let (mean, apart, o) = (0.5 * (a + b), 0.5 * (a - b), self.coupling);
        let radius = (apart * apart + o * o).sqrt();
        if mean.is_nan() {
            return Self::none();
        }
        let zero = KINK * size;
        let values = [mean + radius, mean - radius];
        let is_zero = values.map(|value| value.abs() <= zero);
        if is_zero == [true; 2] {
            return rate.positive_value(0.0);
        }
        if values[1] > zero {
            return *rate;
        }
        if values[0] < -zero {
            return Self::none();
        }
        // Cosine and sine of the angle of the first eigenvector, from those of twice the angle.
        let larger = (0.5 * (1.0 + apart.abs() / radius)).sqrt();
        let smaller = 0.5 * o / (radius * larger);
        let (c, s) = if apart < 0.0 { (smaller.abs(), larger.copysign(o)) } else { (larger, smaller) };
        let [p, q, r] = [rate.own[0], rate.own[1], rate.coupling];
        let first = c * c * p + 2.0 * c * s * r + s * s * q;
        let second = s * s * p - 2.0 * c * s * r + c * c * q;
        let both = c * s * (q - p) + (c * c - s * s) * r;
        let kept = |i: usize, rate: f64| match (is_zero[i], values[i] > 0.0) {
            (true, _) => rate.max(0.0),
            (false, true) => rate,
            (false, false) => 0.0,
        };
        let positive = values.map(|value| value.max(0.0));
        let (first, second) = (kept(0, first), kept(1, second));
        let both = both * (positive[0] - positive[1]) / (2.0 * radius);
        BendingModuli {
            own: [
                c * c * first - 2.0 * c * s * both + s * s * second,
                s * s * first + 2.0 * c * s * both + c * c * second,
            ],
            coupling: c * s * (first - second) + (c * c - s * s) * both,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::BendingModuli;

    /// Symmetric matrix of these eigenvalues, its first eigenvector at this angle.
    fn turned([p, q]: [f64; 2], angle: f64) -> BendingModuli<f64> {
        let (s, c) = angle.sin_cos();
        BendingModuli { own: [c * c * p + s * s * q, s * s * p + c * c * q], coupling: c * s * (p - q) }
    }

    // Eigenvalues above zero, at zero and below it, at the kink and away from it; rates that lift both, sink
    // both, and turn.
    #[test]
    fn the_rate_of_a_positive_part_is_its_one_sided_derivative() {
        let values = [[2.0, 1.0], [1.0, 1.0], [2.0, 0.0], [0.0, 0.0], [0.0, -1.0], [2.0, -1.0], [-1.0, -2.0]];
        let rates = [([1.0, 0.7], 0.2), ([-1.0, -0.7], 0.2), ([1.0, -0.8], 0.4), ([-0.9, 0.6], 1.1)];
        for (values, angle) in values.into_iter().flat_map(|v| [0.0, 0.5, 1.3, 1.8, 2.9].map(|a| (v, a))) {
            let there = turned(values, angle);
            for rate in rates.map(|(rate, angle)| turned(rate, angle)) {
                let found = there.positive_rate(&rate, 1.0);
                let h = 1e-6;
                let ahead = there.plus(&rate, h).positive_value(1.0);
                let expected = ahead.plus(&there.positive_value(1.0), -1.0).scaled([h.sqrt().recip(); 2]);
                for (found, expected) in [
                    (found.own[0], expected.own[0]),
                    (found.own[1], expected.own[1]),
                    (found.coupling, expected.coupling),
                ] {
                    let error = (found - expected).abs();
                    assert!(error < 1e-5, "{values:?} at {angle}, {rate:?}: {found}, {expected}");
                }
            }
        }
    }
}
