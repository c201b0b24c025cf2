//! Derivatives of functions of the rest data of a cell by its nodes.

use super::super::bending::{BendingSolid, BendingStiffness, LackingCell, MOST_PAIRS, axes};
use super::super::packs::{
    RestGradients, RestPoint, drawn_slopes, exact_gradients, gradients, jacobian, lengths, lengths_to_draw,
    physical,
};
use super::number::below_one;
use super::{add, dot};
use crate::algebra::{Dual, Mat};
use crate::element::Isoparametric;

/// Stiffness in bending that a cell lacks, and its derivatives by the nodes.
pub(super) struct ShapedStiffness<const N: usize> {
    pub(super) value: BendingStiffness<f64>,
    /// By each coordinate of each node.
    by_nodes: Vec<BendingStiffness<f64>>,
}

impl<const N: usize> ShapedStiffness<N> {
    /// Stiffness of a cell with these nodes at rest, alone across these axes, of a solid.
    pub(super) fn new<const D: usize>(
        cell: &Isoparametric<D, N>,
        nodes: &[[f64; D]; N],
        alone: [bool; D],
        solid: BendingSolid<'_, D>,
    ) -> Self {
        let RestGradients { points, volume } = gradients(cell, nodes);
        let value = LackingCell { cell, nodes, points: &points }.stiffness(alone, volume, solid);
        let towards = |place: usize, sign: f64| {
            let mut moving = nodes.map(|node| node.map(Dual::constant));
            moving[place / D][place % D].derivative = sign;
            let RestGradients { points, volume } = gradients(cell, &moving);
            let lacking = LackingCell { cell, nodes: &moving, points: &points };
            lacking.stiffness(alone, volume, solid).map(|number| number.derivative)
        };
        let both = |place: usize| {
            let (mut mean, behind) = (towards(place, 1.0), towards(place, -1.0));
            let numbers = mean.numbers_mut().zip(behind.numbers());
            numbers.for_each(|(mean, behind)| *mean = 0.5 * (*mean - behind));
            mean
        };
        ShapedStiffness { value, by_nodes: (0..N * D).map(both).collect() }
    }

    /// Stiffness of the cell whose nodes move.
    pub(super) fn moving<const D: usize>(&self, change: &[[f64; D]; N]) -> BendingStiffness<Dual<f64>> {
        let mut moving = self.value.map(Dual::constant);
        for (by, change) in self.by_nodes.iter().zip(change.as_flattened()) {
            let numbers = moving.numbers_mut().zip(by.numbers());
            numbers.for_each(|(number, by)| number.derivative += change * by);
        }
        moving
    }

    /// Adds the derivatives by the nodes of a function with these derivatives by the stiffnesses.
    pub(super) fn add<const D: usize>(&self, rates: &BendingStiffness<f64>, rows: &mut [[f64; D]; N]) {
        for (row, by) in rows.as_flattened_mut().iter_mut().zip(&self.by_nodes) {
            *row += by.numbers().zip(rates.numbers()).map(|(by, rate)| by * rate).sum::<f64>();
        }
    }
}

/// Derivatives of a function of the rest data of a cell by these data.
pub(super) struct RestRates<const D: usize, const N: usize> {
    /// By `b` of all nodes at the quadrature points.
    gradients: Vec<[[f64; D]; N]>,
    /// By the parts of the volume that they stand for.
    pub(super) parts: Vec<f64>,
    pub(super) volume: f64,
    /// By `g` of every pair of axes.
    weights: [[f64; N]; MOST_PAIRS],
    /// By `f_k` at rest.
    pub(super) directions: [[f64; D]; D],
    pub(super) elastic: BendingStiffness<f64>,
    pub(super) viscous: BendingStiffness<f64>,
}

impl<const D: usize, const N: usize> RestRates<D, N> {
    /// Derivatives of a constant.
    pub(super) fn new(points: usize) -> Self {
        RestRates {
            gradients: vec![[[0.0; D]; N]; points],
            parts: vec![0.0; points],
            volume: 0.0,
            weights: [[0.0; N]; MOST_PAIRS],
            directions: [[0.0; D]; D],
            elastic: BendingStiffness::splat(0.0),
            viscous: BendingStiffness::splat(0.0),
        }
    }

    /// Adds those by `b` at a point of a function of `sum_a x_a b_a^T` with the derivative `weight T`.
    pub(super) fn add_point(&mut self, q: usize, weight: f64, (by, x): (&Mat<f64, D>, &[[f64; D]; N])) {
        let transposed = by.transpose();
        for (rate, x) in self.gradients[q].iter_mut().zip(x) {
            add(rate, weight, &transposed.mul_vec(x));
        }
    }

    /// Adds those by `g` of a function of `sum_a g_a x_a`, for every pair of axes.
    pub(super) fn add_weights(&mut self, by: &[[f64; D]; MOST_PAIRS], x: &[[f64; D]; N]) {
        for (rates, by) in self.weights.iter_mut().zip(by) {
            rates.iter_mut().zip(x).for_each(|(rate, x)| *rate += dot(by, x));
        }
    }

    /// Adds those by the nodes at rest, with this rest data at the quadrature points, all but those by way of
    /// stiffnesses in bending.
    pub(super) fn add_to_nodes(
        &mut self,
        cell: &Isoparametric<D, N>,
        nodes: &[[f64; D]; N],
        points: &[RestPoint<f64, D, N>],
        rows: &mut [[f64; D]; N],
    ) {
        self.add_by_weights(cell, nodes, points, rows);
        let drawn_by = lengths_to_draw(cell, nodes);
        // Slopes of a cell that would fold go by no lengths.
        let is_drawn = drawn_by == lengths(cell, nodes);
        let mut by_lengths = [0.0; D];
        let RestGradients { points: exact, volume } = exact_gradients(cell, nodes);
        let slopes: Vec<[[f64; D]; N]> =
            cell.points.iter().map(|(xi, _)| drawn_slopes(cell, xi, &drawn_by)).collect();
        let mut mean = [[0.0; D]; N];
        for by in &self.gradients {
            mean.iter_mut().zip(by).for_each(|(mean, by)| add(mean, 1.0, by));
        }
        for (q, (xi, _)) in cell.points.iter().enumerate() {
            let drawn = physical(nodes, &slopes[q]);
            let (exact, part) = &exact[q];
            let (mut by_drawn, mut by_exact) = (self.gradients[q], [[0.0; D]; N]);
            for a in 0..N {
                add(&mut by_drawn[a], -part, &mean[a]);
                add(&mut by_exact[a], *part, &mean[a]);
                self.parts[q] += dot(&mean[a], &exact[a]) - dot(&mean[a], &drawn[a]);
            }
            let of_drawn = add_by_gradients((nodes, &slopes[q]), (&drawn, &by_drawn), rows);
            add_by_gradients((nodes, &(cell.slopes)(xi)), (exact, &by_exact), rows);
            if is_drawn {
                add_by_lengths(cell, (xi, &drawn_by), &of_drawn, &mut by_lengths);
            }
        }
        // Parts are `w det J / V`.
        let of_parts: f64 = self.parts.iter().zip(&exact).map(|(by, (_, part))| by * part).sum();
        let by_volume = self.volume - of_parts / volume;
        for ((xi, weight), by_part) in cell.points.iter().zip(&self.parts) {
            let slopes = (cell.slopes)(xi);
            let cofactor = jacobian(nodes, &slopes).cofactor();
            let by_determinant = weight * (by_volume + by_part / volume);
            rows.iter_mut().zip(&slopes).for_each(|(row, s)| add(row, by_determinant, &cofactor.mul_vec(s)));
        }
        self.add_by_directions(cell, nodes, by_lengths, rows);
    }

    /// Adds those by way of `g`, to the nodes and to the rest data that it is made of.
    fn add_by_weights(
        &mut self,
        cell: &Isoparametric<D, N>,
        nodes: &[[f64; D]; N],
        points: &[RestPoint<f64, D, N>],
        rows: &mut [[f64; D]; N],
    ) {
        for ([k, l], weights) in axes(D).iter().zip(self.weights) {
            let signs = cell.nodes.map(|node| node[*k] * node[*l]);
            let mut along = [0.0; D];
            for (sign, node) in signs.iter().zip(nodes) {
                (0..D).for_each(|i| along[i] += sign * (node[i] - nodes[0][i]));
            }
            let weights = weights.map(|by| by / N as f64);
            let mut by_along = [0.0; D];
            for (q, (b, part)) in points.iter().enumerate() {
                let mut sum = [0.0; D];
                for ((by, b), rate) in weights.iter().zip(b).zip(&mut self.gradients[q]) {
                    add(rate, -by * part, &along);
                    add(&mut sum, -by, b);
                }
                self.parts[q] += dot(&sum, &along);
                add(&mut by_along, *part, &sum);
            }
            rows.iter_mut().zip(signs).for_each(|(row, sign)| add(row, sign, &by_along));
        }
    }

    /// Adds those by way of `f_k` and of the lengths of the cell, `h_k = 2 |f_k|`.
    fn add_by_directions(
        &self,
        cell: &Isoparametric<D, N>,
        nodes: &[[f64; D]; N],
        by_lengths: [f64; D],
        rows: &mut [[f64; D]; N],
    ) {
        let (slopes, lengths) = ((cell.slopes)(&[0.0; D]), lengths(cell, nodes));
        let middle = jacobian(nodes, &slopes).transpose();
        for k in 0..D {
            let mut by = self.directions[k];
            add(&mut by, 4.0 * by_lengths[k] / lengths[k], &middle[k]);
            rows.iter_mut().zip(&slopes).for_each(|(row, slope)| add(row, slope[k], &by));
        }
    }
}

/// Adds the derivatives by the nodes of a function of the gradients `b = J^-T s` with these derivatives by
/// them, `J = sum_a X_a s_a^T`; gives those by the slopes `s`.
fn add_by_gradients<const D: usize, const N: usize>(
    (nodes, slopes): (&[[f64; D]; N], &[[f64; D]; N]),
    (b, by): (&[[f64; D]; N], &[[f64; D]; N]),
    rows: &mut [[f64; D]; N],
) -> [[f64; D]; N] {
    let inverse = jacobian(nodes, slopes).inverse();
    let along = by.map(|by| inverse.mul_vec(&by));
    let mut both = Mat::<f64, D>::zero();
    for (b, y) in b.iter().zip(&along) {
        (0..D).for_each(|i| add(&mut both[i], b[i], y));
    }
    let transposed = both.transpose();
    let mut by_slopes = along;
    for a in 0..N {
        add(&mut rows[a], -1.0, &both.mul_vec(&slopes[a]));
        let mut offset = nodes[a];
        add(&mut offset, -1.0, &nodes[0]);
        add(&mut by_slopes[a], -1.0, &transposed.mul_vec(&offset));
    }
    by_slopes
}

/// Adds the derivatives by the lengths of a cell of a function with these derivatives by the slopes that they
/// draw to the middle.
fn add_by_lengths<const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    (xi, lengths): (&[f64; D], &[f64; D]),
    by_slopes: &[[f64; D]; N],
    by_lengths: &mut [f64; D],
) {
    for (l, k) in (0..D).flat_map(|l| (0..D).map(move |k| (l, k))).filter(|(l, k)| l != k) {
        let ratio = lengths[l] / lengths[k];
        // At the kink the mean of both sides.
        let part = match below_one(ratio) {
            Some(true) => 1.0,
            None => 0.5,
            Some(false) => continue,
        };
        let mut at = [Dual::constant(0.0); D];
        for (m, at) in at.iter_mut().enumerate() {
            at.value = xi[m] * (lengths[l] / lengths[m]).min(1.0);
        }
        at[k].derivative = xi[k];
        let slopes = (cell.moving_slopes)(&at);
        let by_ratio: f64 = slopes.iter().zip(by_slopes).map(|(s, by)| s[l].derivative * by[l]).sum();
        by_lengths[l] += part * by_ratio / lengths[k];
        by_lengths[k] -= part * by_ratio * ratio / lengths[k];
    }
}
