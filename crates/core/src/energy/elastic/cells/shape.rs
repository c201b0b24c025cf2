//! Derivatives of cells with respect to their reference shape and their material axes.
//!
//! The work along `p` is `w = p . dE/dx`, a function of the reference data of [`rest`](super::rest). Its
//! derivatives by these numbers are the change along `p` of those of the energy, `x_a . (V P)` by `b_a`
//! and so on: the force on the reference shape of Eshelby 1975, "The elastic energy-momentum tensor", J.
//! Elasticity 5, 321. Dual numbers give them in one pass. Derivatives by the reference nodes, or by
//! rotations of the material, follow from there. Changes of forces with the reference data are computed
//! on dual numbers.

use rayon::prelude::*;

use super::OnePointCells;
use super::from_first;
use super::hourglass::{RestModuli, amplitude_rates, by_each, hourglass, sum_of};
use super::rest::{CellRest, RestData, outer_sum};
use crate::algebra::{Dual, Mat};
use crate::energy::elastic::block::{stress_changes, stresses};
use crate::material::Tangent;
use crate::scalar::Scalar;

/// Cells whose rows are computed before they are added.
const BATCH_OF_CELLS: usize = 512;

/// Cells of any kind whose reference shape changes. Rows are flat, over all vertices of the system.
pub trait CellShapes: Send {
    /// Adds the derivatives of `p . (dE/dx + dR/dv)` at `(x, v)` with respect to reference positions.
    fn add_works(&self, at: (&[f64], &[f64]), p: &[f64], rows: &mut [f64]);

    /// Adds the change of `dE/dx + dR/dv` if reference positions move by `change`: the transpose.
    fn add_gradients(&self, at: (&[f64], &[f64]), change: &[f64], gradient: &mut [f64]);

    /// Adds the derivatives of `p . (d2E/dx2 p)` with respect to reference positions, with which `x`
    /// moves; there is no stress at `x`.
    fn add_curvatures(&self, x: &[f64], p: &[f64], rows: &mut [f64]);
}

/// Cells of any kind whose axes change with the components of a direction of each cell.
pub trait CellTurns: Send {
    /// Adds the derivatives of `p . dE/dx` with respect to the components of the direction of each cell,
    /// flat `(cells, dimension)`.
    fn add_works(&self, x: &[f64], p: &[f64], works: &mut [f64]);

    /// Adds the change of `dE/dx` if the directions change by `change`: the transpose.
    fn add_gradients(&self, x: &[f64], change: &[f64], gradient: &mut [f64]);
}

/// Cells whose reference shape changes: see [`OnePointCells::shaped`].
pub struct ShapedCells<const D: usize, const N: usize> {
    cells: OnePointCells<D, N>,
    /// Shear viscosity and second viscosity [Pa s].
    viscosity: (f64, f64),
}

/// Cells whose axes change: see [`OnePointCells::turning`].
pub struct TurningCells<const D: usize, const N: usize> {
    cells: OnePointCells<D, N>,
    /// `dR` of each cell with respect to each component.
    turns: Vec<[Mat<f64, D>; D]>,
}

/// Returns dual numbers of rows and their change.
fn along<const D: usize, const N: usize>(
    rows: &[[f64; D]; N],
    change: &[[f64; D]; N],
) -> [[Dual<f64>; D]; N] {
    let mut both = [[Dual::constant(0.0); D]; N];
    for (a, i) in (0..N).flat_map(|a| (0..D).map(move |i| (a, i))) {
        both[a][i] = Dual { value: rows[a][i], derivative: change[a][i] };
    }
    both
}

fn constant<const D: usize, const N: usize>(rows: &[[f64; D]; N]) -> [[Dual<f64>; D]; N] {
    rows.map(|row| row.map(Dual::constant))
}

/// Returns the derivatives of dual numbers.
fn changes<const D: usize, const M: usize>(rows: &[[Dual<f64>; D]; M]) -> [[f64; D]; M] {
    rows.map(|row| row.map(|entry| entry.derivative))
}

impl<const D: usize, const N: usize> CellRest<Dual<f64>, D, N> {
    fn change(&self) -> CellRest<f64, D, N> {
        CellRest {
            volume: self.volume.derivative,
            gradient: changes(&self.gradient),
            weight: changes(&self.weight),
            inverse: Mat(changes(&self.inverse.0)),
        }
    }
}

impl<const D: usize, const N: usize> OnePointCells<D, N> {
    /// Returns these cells with a reference shape that changes, with the shear viscosity and the second
    /// viscosity [Pa s] of [`ViscousCells`](crate::dissipation::ViscousCells).
    pub fn shaped(self, viscosity: (f64, f64)) -> ShapedCells<D, N> {
        ShapedCells { cells: self, viscosity }
    }

    /// Returns these cells with axes that change by `turns` with the components of a direction of each
    /// cell.
    ///
    /// # Panics
    /// If the cells have no axes, or the numbers of cells and turns differ.
    pub fn turning(self, turns: Vec<[Mat<f64, D>; D]>) -> TurningCells<D, N> {
        assert_eq!(self.axes.len(), turns.len(), "a turn for each cell");
        TurningCells { cells: self, turns }
    }

    fn moduli<S: Scalar>(&self) -> RestModuli<S, D> {
        RestModuli::new(&super::rest_tangent(&*self.material))
    }

    /// Returns `P` at a deformation gradient that changes.
    fn changing_stress(&self, f: &Mat<Dual<f64>, D>) -> Mat<Dual<f64>, D> {
        let (value, change) = Dual::parts(f);
        let stress = stresses(&*self.material, self.stress, &[value]).lane(0);
        Dual::along(&stress, &stress_changes(&*self.material, &[value], &[change]).lane(0))
    }

    /// Returns the derivatives of `p . dE/dx` of a cell by its reference data.
    fn work_rates(
        &self,
        rest: &CellRest<f64, D, N>,
        x: &[[f64; D]; N],
        p: &[[f64; D]; N],
    ) -> CellRest<f64, D, N> {
        let (rest, x) = (rest.splat::<Dual<f64>>(), along(x, p));
        let (f, q) = rest.measure(&x);
        let cofactor = f.cofactor();
        let z = self.pull_back.pulled(&cofactor, &q);
        let of_modes = hourglass((rest.volume, &rest.inverse), &self.moduli(), &z);
        let (by_f, by_q) = self.pull_back.pushed((&f, &cofactor), &q, &of_modes.by_amplitudes);
        let stress = self.changing_stress(&f);
        let mut rates = CellRest::zero();
        rates.add_rates(&x, &stress.scale_add(rest.volume, &by_f), &by_q);
        rates.inverse = of_modes.by_inverse;
        rates.volume = of_modes.by_volume;
        let mut rates = rates.change();
        rates.volume += Dual::parts(&stress).0.dot(&Dual::parts(&f).1);
        rates
    }

    /// Returns the derivatives of `p . (d2E/dx2 p)` of a cell by its reference data, with `x` without
    /// stress and at a fixed `F`.
    fn curvature_rates(
        &self,
        rest: &CellRest<f64, D, N>,
        x: &[[f64; D]; N],
        p: &[[f64; D]; N],
    ) -> CellRest<f64, D, N> {
        let (f, _): (Mat<f64, D>, _) = rest.measure(x);
        let (g, q) = rest.measure(p);
        let stress = stress_changes(&*self.material, &[f], &[g]).lane(0);
        let cofactor = f.cofactor();
        let of_modes =
            hourglass((rest.volume, &rest.inverse), &self.moduli(), &self.pull_back.pulled(&cofactor, &q));
        let (_, by_q) = self.pull_back.pushed((&f, &cofactor), &q, &of_modes.by_amplitudes);
        let mut rates = CellRest::zero();
        rates.add_rates(p, &stress.scale(2.0 * rest.volume), &by_q.map(|row| row.map(|entry| 2.0 * entry)));
        rates.inverse = of_modes.by_inverse.scale(2.0);
        rates.volume = stress.dot(&g) + 2.0 * of_modes.by_volume;
        rates
    }

    /// Returns the change of `dE/dx` of a cell whose reference data change.
    fn change_of_gradient(&self, rest: &CellRest<Dual<f64>, D, N>, x: &[[f64; D]; N]) -> [[f64; D]; N] {
        let (f, q) = rest.measure(&constant(x));
        let cofactor = f.cofactor();
        let z = self.pull_back.pulled(&cofactor, &q);
        let y = hourglass((rest.volume, &rest.inverse), &self.moduli(), &z).by_amplitudes;
        let (by_f, by_q) = self.pull_back.pushed((&f, &cofactor), &q, &y);
        changes(&rest.spread(&self.changing_stress(&f).scale_add(rest.volume, &by_f), &by_q))
    }

    /// Adds rows of the nodes of every cell to those of all vertices, in the order of the cells.
    fn add_each(&self, of_cell: impl Fn(usize, &[u32; N]) -> [[f64; D]; N] + Sync, rows: &mut [f64]) {
        let cells: Vec<_> = self.elements().map(|(element, vertices, ..)| (element, vertices)).collect();
        for cells in cells.chunks(BATCH_OF_CELLS) {
            let found: Vec<_> =
                cells.par_iter().map(|(element, vertices)| of_cell(*element, vertices)).collect();
            for ((_, vertices), of_cell) in cells.iter().zip(found) {
                for (vertex, of_node) in vertices.iter().zip(of_cell) {
                    let row = &mut rows[*vertex as usize * D..][..D];
                    row.iter_mut().zip(of_node).for_each(|(row, by)| *row += by);
                }
            }
        }
    }
}

/// Returns `2 eta sym(A) + zeta tr(A) I`.
fn viscous<S: Scalar, const D: usize>((shear, second): (f64, f64), a: &Mat<S, D>) -> Mat<S, D> {
    a.symmetric().scale(S::splat(2.0 * shear)) + Mat::scalar(S::splat(second) * a.trace())
}

impl<const D: usize, const N: usize> ShapedCells<D, N> {
    fn viscous_moduli<S: Scalar>(&self) -> RestModuli<S, D> {
        RestModuli::new(&Tangent::isotropic(self.viscosity.1, self.viscosity.0))
    }

    fn is_viscous(&self) -> bool {
        self.viscosity != (0.0, 0.0)
    }

    /// Adds the derivatives of `p . dR/dv` of a cell by its reference data, a form of the strain rates of
    /// `v` and of `p`.
    fn add_viscous_rates(
        &self,
        rest: &CellRest<f64, D, N>,
        [x, v, p]: [&[[f64; D]; N]; 3],
        rates: &mut CellRest<f64, D, N>,
    ) {
        let [(f, q), (l, q_v), (g, q_p)] = [x, v, p].map(|rows| rest.measure(rows));
        let (of_v, of_p) = (f.transpose_mul(&l), f.transpose_mul(&g));
        let [s_v, s_p] = [&of_v, &of_p].map(|rate| viscous(self.viscosity, rate).scale(rest.volume));
        let (z_v, z_p) = (amplitude_rates((&f, &q), (&l, &q_v)), amplitude_rates((&f, &q), (&g, &q_p)));
        let still = rest.splat::<Dual<f64>>();
        let of_both = hourglass((still.volume, &still.inverse), &self.viscous_moduli(), &along(&z_v, &z_p));
        let y_v = of_both.by_amplitudes.map(|row| row.map(|entry| entry.value));
        let y_p = changes(&of_both.by_amplitudes);
        let by_f = l.mul(&s_p) + g.mul(&s_v) + outer_sum(&q_v, &y_p) + outer_sum(&q_p, &y_v);
        rates.add_rates(x, &by_f, &sum_of(&by_each(&l, &y_p), &by_each(&g, &y_v)));
        rates.add_rates(v, &(f.mul(&s_p) + outer_sum(&q, &y_p)), &by_each(&f, &y_p));
        rates.add_rates(p, &(f.mul(&s_v) + outer_sum(&q, &y_v)), &by_each(&f, &y_v));
        rates.volume += s_v.dot(&of_p) / rest.volume + of_both.by_volume.derivative;
        rates.inverse += Mat(changes(&of_both.by_inverse.0));
    }

    /// Returns the change of `dR/dv` of a cell whose reference data change.
    fn change_of_viscous(
        &self,
        rest: &CellRest<Dual<f64>, D, N>,
        [x, v]: [&[[f64; D]; N]; 2],
    ) -> [[f64; D]; N] {
        let [(f, q), (l, q_v)] = [x, v].map(|rows| rest.measure(&constant(rows)));
        let z = amplitude_rates((&f, &q), (&l, &q_v));
        let y = hourglass((rest.volume, &rest.inverse), &self.viscous_moduli(), &z).by_amplitudes;
        let stress = viscous(self.viscosity, &f.transpose_mul(&l)).scale(rest.volume);
        changes(&rest.spread(&(f.mul(&stress) + outer_sum(&q, &y)), &by_each(&f, &y)))
    }
}

impl<const D: usize, const N: usize> CellShapes for ShapedCells<D, N> {
    fn add_works(&self, (x, v): (&[f64], &[f64]), p: &[f64], rows: &mut [f64]) {
        let ShapedCells { cells, .. } = self;
        let of_cell = |element: usize, vertices: &[u32; N]| {
            let [x, v, p] = [x, v, p].map(|rows| from_first(rows, vertices));
            let rest = CellRest::new(cells.cell, &cells.nodes[element]);
            let mut rates = cells.in_space(element, cells.work_rates(&cells.rest(element), &x, &p));
            if self.is_viscous() {
                self.add_viscous_rates(&rest, [&x, &v, &p], &mut rates);
            }
            rates.by_nodes(cells.cell, &cells.nodes[element])
        };
        cells.add_each(of_cell, rows);
    }

    fn add_gradients(&self, (x, v): (&[f64], &[f64]), change: &[f64], gradient: &mut [f64]) {
        let ShapedCells { cells, .. } = self;
        let of_cell = |element: usize, vertices: &[u32; N]| {
            let [x, v, change] = [x, v, change].map(|rows| from_first(rows, vertices));
            let rest = CellRest::new(cells.cell, &along(&cells.nodes[element], &change));
            let turned = match cells.axes.get(element) {
                Some(axes) => rest.turned(&Mat::splat(&axes.leading())),
                None => rest,
            };
            let mut rows = cells.change_of_gradient(&turned, &x);
            if self.is_viscous() {
                let viscous = self.change_of_viscous(&rest, [&x, &v]);
                let entries = rows.as_flattened_mut().iter_mut();
                entries.zip(viscous.as_flattened()).for_each(|(entry, viscous)| *entry += viscous);
            }
            rows
        };
        cells.add_each(of_cell, gradient);
    }

    fn add_curvatures(&self, x: &[f64], p: &[f64], rows: &mut [f64]) {
        let ShapedCells { cells, .. } = self;
        let of_cell = |element: usize, vertices: &[u32; N]| {
            let [x, p] = [x, p].map(|rows| from_first(rows, vertices));
            let rates = cells.in_space(element, cells.curvature_rates(&cells.rest(element), &x, &p));
            rates.by_nodes(cells.cell, &cells.nodes[element])
        };
        cells.add_each(of_cell, rows);
    }
}

impl<const D: usize, const N: usize> OnePointCells<D, N> {
    /// Converts derivatives by reference data from material axes to the axes of space.
    fn in_space(&self, element: usize, mut rates: CellRest<f64, D, N>) -> CellRest<f64, D, N> {
        if let Some(axes) = self.axes.get(element) {
            let axes = axes.leading::<D>();
            rates.gradient = rates.gradient.map(|row| axes.mul_vec(&row));
            rates.inverse = rates.inverse.mul_transpose(&axes);
        }
        rates
    }

    /// Returns the change of the reference data of a cell in material axes that rotate by `dR`.
    fn turn_of_rest(&self, element: usize, turn: &Mat<f64, D>) -> CellRest<Dual<f64>, D, N> {
        let still = CellRest::new(self.cell, &self.nodes[element]).splat::<Dual<f64>>();
        still.turned(&Dual::along(&self.axes[element].leading(), turn))
    }
}

impl<const D: usize, const N: usize> CellTurns for TurningCells<D, N> {
    fn add_works(&self, x: &[f64], p: &[f64], works: &mut [f64]) {
        let TurningCells { cells, turns } = self;
        for (element, vertices, ..) in cells.elements() {
            let [x, p] = [x, p].map(|rows| from_first(rows, &vertices));
            let rates = cells.work_rates(&cells.rest(element), &x, &p);
            for (work, turn) in works[element * D..][..D].iter_mut().zip(&turns[element]) {
                let moved = cells.turn_of_rest(element, turn).change();
                let gradients = moved.gradient.as_flattened().iter().zip(rates.gradient.as_flattened());
                *work += gradients.map(|(moved, rate)| moved * rate).sum::<f64>();
                *work += moved.inverse.dot(&rates.inverse);
            }
        }
    }

    fn add_gradients(&self, x: &[f64], change: &[f64], gradient: &mut [f64]) {
        let TurningCells { cells, turns } = self;
        let of_cell = |element: usize, vertices: &[u32; N]| {
            let each = turns[element].iter().zip(&change[element * D..]);
            let turn = each.fold(Mat::zero(), |sum, (turn, change)| turn.scale_add(*change, &sum));
            cells.change_of_gradient(&cells.turn_of_rest(element, &turn), &from_first(x, vertices))
        };
        cells.add_each(of_cell, gradient);
    }
}
