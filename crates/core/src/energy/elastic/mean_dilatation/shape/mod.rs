//! Derivatives of cells by their shape at rest.
//!
//! Forces of a cell follow from its rest data: gradients `b` and parts `w` at the quadrature points, the
//! volume `V`, and of bending the weights `g`, the directions `f_k` at rest and the stiffnesses `K`. What
//! they do along `p` is `p . dE/dx`; its derivatives by these numbers are taken here, and
//! [`RestRates`](rest::RestRates) leads from them to the nodes. With `G_q` and `Gb_q` made of `p` as the
//! change of `F_q` and of `Fb_q`, `P = P(Fb)`, `A = dP/dF : Gb` and `g = cof F : G`,
//!
//! ```text
//! t = (A : Fb + P : Gb) / D,   u = P : Fb / D,   Theta = mean(t)/theta - mean(u) theta'/theta^2,
//! d/dG = V w (s P + (mean(u)/theta - u/J) cof F),
//! d/dF = V w (s A + s r P + (Theta - t/J + u g/J^2) cof F + (mean(u)/theta - u/J) d(cof F)/dF : G),
//! d/dw = V (P : Gb + Theta J + mean(u)/theta g),
//! Gb = s (G + r F),   r = (theta'/theta - g/J)/D
//! ```
//!
//! Slopes are drawn by `c_lk = min(1, h_l/h_k)`, and stiffness in bending is a positive part: both have a
//! kink where two lengths of a cell are equal, as in squares and cubes. There the derivative by each
//! coordinate of a node is the mean of those from both sides, as central differences have it.

pub(crate) mod number;
mod rest;

use super::bending::{
    BendingMode, BendingSolid, BendingStiffness, COUPLED, CellSides, LackingCell, MOST_PAIRS, axes, dot,
    weighted,
};
use super::kernels::{gradient_of_lane, root};
use super::packs::{RestGradients, RestPoint, gradients, middle};
use super::{Dilatation, MeanDilatation};
use crate::algebra::{Dual, Mat};
use crate::element::Isoparametric;
use crate::energy::elastic::block::{stress_changes, stresses};
use crate::energy::elastic::points_of;
use crate::material::{Psd, Tangent};
use crate::scalar::Elementary;
use rayon::prelude::*;
use rest::{RestRates, ShapedStiffness};

/// Cells whose rows are at hand before they are added.
const AT_ONCE: usize = 512;

/// Cells of whatever kind whose shape at rest changes. Rows are flat, of all vertices of the system.
pub trait CellShapes: Send {
    /// Adds the derivatives of `p . (dE/dx + dR/dv)` at `(x, v)` by rest positions.
    fn add_works(&self, at: (&[f64], &[f64]), p: &[f64], rows: &mut [f64]);

    /// Adds what is added to `dE/dx + dR/dv` where rest positions move by `change`: the transpose.
    fn add_gradients(&self, at: (&[f64], &[f64]), change: &[f64], gradient: &mut [f64]);

    /// Adds the derivatives of `p . (d2E/dx2 p)` by rest positions that `x`, at which there is no stress,
    /// goes along with.
    fn add_curvatures(&self, x: &[f64], p: &[f64], rows: &mut [f64]);
}

/// Cells whose shape at rest changes: see [`MeanDilatation::shaped`].
pub struct ShapedCells<const D: usize, const N: usize> {
    cells: MeanDilatation<D, N>,
    /// Shear viscosity and second viscosity [Pa s].
    viscosity: (f64, f64),
    /// Stiffness in bending that cells lack of the solid, and of one of its viscosities.
    elastic: CellStiffnesses<N>,
    viscous: Option<CellStiffnesses<N>>,
}

/// Stiffnesses in bending of cells, of congruent neighbours once.
struct CellStiffnesses<const N: usize> {
    each: Vec<ShapedStiffness<N>>,
    /// Number of the stiffness of each cell, in the order of the mesh.
    of: Vec<u32>,
}

impl<const N: usize> CellStiffnesses<N> {
    fn new<const D: usize>(cells: &MeanDilatation<D, N>, solid: BendingSolid<'_, D>) -> Self {
        let surface = CellSides::of(cells.cell, &cells.patches);
        let mut found = CellStiffnesses { each: vec![], of: vec![0; cells.nodes.len()] };
        let mut last = None;
        let mut turned: Option<(Mat<f64, D>, Tangent<D>)> = None;
        for (element, vertices, ..) in cells.elements() {
            let rotation = solid.axes.get(element);
            if let Some(rotation) = rotation.filter(|rotation| turned.is_none_or(|(of, _)| of != **rotation))
            {
                turned = Some((*rotation, solid.tangent.turned(rotation)));
                last = None;
            }
            let (nodes, alone) = (&cells.nodes[element], surface.alone(cells.cell, &vertices));
            let mut of_cell = solid;
            of_cell.tangent = turned.as_ref().map_or(solid.tangent, |(_, tangent)| tangent);
            let number = last.filter(|(of, known)| is_congruent(&cells.nodes[*of], nodes) && *known == alone);
            if number.is_none() {
                found.each.push(ShapedStiffness::new(cells.cell, nodes, alone, of_cell));
            }
            last = Some((element, alone));
            found.of[element] = found.each.len() as u32 - 1;
        }
        found
    }

    fn of(&self, element: usize) -> &ShapedStiffness<N> {
        &self.each[self.of[element] as usize]
    }
}

/// True if cells with these nodes are one another's image by a translation, but for rounding.
fn is_congruent<const D: usize, const N: usize>(a: &[[f64; D]; N], b: &[[f64; D]; N]) -> bool {
    /// Part of the size of a cell by which congruent ones may differ.
    const CONGRUENT: f64 = 1e-11;
    let offset = |nodes: &[[f64; D]; N], n: usize, i: usize| nodes[n][i] - nodes[0][i];
    let places = (0..N).flat_map(|n| (0..D).map(move |i| (n, i)));
    let size = places.clone().fold(0.0, |size: f64, (n, i)| size.max(offset(a, n, i).abs()));
    places.into_iter().all(|(n, i)| (offset(a, n, i) - offset(b, n, i)).abs() <= CONGRUENT * size)
}

impl<const D: usize, const N: usize> MeanDilatation<D, N> {
    /// These cells, whose shape at rest changes, with the shear viscosity and the second viscosity [Pa s] of
    /// [`ViscousCells`](crate::dissipation::ViscousCells).
    pub fn shaped(self, viscosity: (f64, f64)) -> ShapedCells<D, N> {
        let axes: Vec<Mat<f64, D>> = self.axes.iter().map(Mat::leading).collect();
        let tangent = &self.material.tangent(&Mat::identity(), Psd::Exact);
        let dilatation = self.dilatation;
        let solid = BendingSolid { tangent, change: None, axes: &axes, turning: None, dilatation };
        let elastic = CellStiffnesses::new(&self, solid);
        let viscous = (viscosity != (0.0, 0.0)).then(|| {
            let tangent = &Tangent::isotropic(viscosity.1, viscosity.0);
            let dilatation = Dilatation::Small;
            let solid = BendingSolid { tangent, change: None, axes: &[], turning: None, dilatation };
            CellStiffnesses::new(&self, solid)
        });
        ShapedCells { cells: self, viscosity, elastic, viscous }
    }
}

/// `b` of all nodes at the quadrature points of a cell, weights and directions of its bending.
struct RestCell<S, const D: usize, const N: usize> {
    points: Vec<RestPoint<S, D, N>>,
    volume: S,
    /// `g` of every pair of axes.
    weights: [[S; N]; MOST_PAIRS],
    /// `f_k` at rest.
    directions: [[S; D]; D],
}

impl<S: number::RestNumber, const D: usize, const N: usize> RestCell<S, D, N> {
    fn new(cell: &Isoparametric<D, N>, nodes: &[[S; D]; N]) -> Self {
        let RestGradients { points, volume } = gradients(cell, nodes);
        let lacking = LackingCell { cell, nodes, points: &points };
        let mut weights = [[S::zero(); N]; MOST_PAIRS];
        weights.iter_mut().zip(axes(D)).for_each(|(weights, axes)| *weights = lacking.weights(*axes));
        RestCell { weights, directions: middle(cell, nodes).transpose().0, points, volume }
    }
}

/// Numbers of the modes of a cell in bending, by pairs of axes and sides.
type OfModes<S> = [[S; 2]; MOST_PAIRS];

/// Pairs and sides of the modes of cells in `D` dimensions, with the axis along each.
fn modes<const D: usize>() -> impl Iterator<Item = (usize, usize, usize)> {
    axes(D).iter().enumerate().flat_map(|(pair, axes)| [(pair, 0, axes[0]), (pair, 1, axes[1])])
}

/// Forces of displacements of the modes.
fn forces_of<S: number::RestNumber, const D: usize>(
    stiffness: &BendingStiffness<S>,
    s: &OfModes<S>,
) -> OfModes<S> {
    let mut forces = [[S::zero(); 2]; MOST_PAIRS];
    modes::<D>().for_each(|(pair, side, _)| forces[pair][side] = stiffness.own[pair][side] * s[pair][side]);
    if D == 3 {
        for (coupling, [one, other]) in stiffness.coupling.iter().zip(COUPLED) {
            forces[one.0][one.1] += *coupling * s[other.0][other.1];
            forces[other.0][other.1] += *coupling * s[one.0][one.1];
        }
    }
    forces
}

/// Derivatives of `a . K b` by the stiffnesses.
fn by_stiffness<const D: usize>(a: &OfModes<f64>, b: &OfModes<f64>) -> BendingStiffness<f64> {
    let mut by = BendingStiffness::splat(0.0);
    modes::<D>().for_each(|(pair, side, _)| by.own[pair][side] = a[pair][side] * b[pair][side]);
    if D == 3 {
        for (by, [one, other]) in by.coupling.iter_mut().zip(COUPLED) {
            *by = a[one.0][one.1] * b[other.0][other.1] + a[other.0][other.1] * b[one.0][one.1];
        }
    }
    by
}

fn add<const D: usize>(sum: &mut [f64; D], factor: f64, v: &[f64; D]) {
    sum.iter_mut().zip(v).for_each(|(sum, v)| *sum += factor * v);
}

/// `v - n (n . v)` over a length.
fn across<const D: usize>(n: &[f64; D], v: &[f64; D], length: f64) -> [f64; D] {
    let mut across = *v;
    add(&mut across, -dot(n, v), n);
    across.map(|a| a / length)
}

/// Rows of the nodes of a cell from the first one on: sums by gradients and weights see no more of them.
fn relative<const D: usize, const N: usize>(rows: &[f64], vertices: &[u32; N]) -> [[f64; D]; N] {
    let rows: [[f64; D]; N] = points_of(rows, vertices);
    rows.map(|row| {
        let mut offset = row;
        add(&mut offset, -1.0, &rows[0]);
        offset
    })
}

/// `dev(A)`.
fn deviator<S: number::RestNumber, const D: usize>(a: &Mat<S, D>) -> Mat<S, D> {
    *a - Mat::scalar(a.trace() / S::splat(D as f64))
}

impl<const D: usize, const N: usize> ShapedCells<D, N> {
    /// `P` of a cell at its points, and its change along other deformations, in the axes of space.
    fn stresses(&self, element: usize, f: &[Mat<f64, D>], along: &[Mat<f64, D>]) -> [Vec<Mat<f64, D>>; 2] {
        let MeanDilatation { material, stress, axes, .. } = &self.cells;
        let axes = axes.get(element).map(Mat::leading::<D>);
        let turned = |f: &Mat<f64, D>| axes.map_or(*f, |axes| f.mul(&axes));
        let back = |p: Mat<f64, D>| axes.map_or(p, |axes| p.mul_transpose(&axes));
        let [f, along] = [f, along].map(|of| of.iter().map(turned).collect::<Vec<_>>());
        let both = [stresses(&**material, *stress, &f), stress_changes(&**material, &f, &along)];
        both.map(|of_points| (0..f.len()).map(|q| back(of_points.lane(q))).collect())
    }

    /// Derivatives of the elastic forces at the quadrature points along `p` by rest data.
    fn add_elastic(
        &self,
        element: usize,
        rest: &RestCell<f64, D, N>,
        (x, p): (&[[f64; D]; N], &[[f64; D]; N]),
        rates: &mut RestRates<D, N>,
    ) {
        let (dilatation, d, volume) = (self.cells.dilatation, D as f64, rest.volume);
        let parts: Vec<f64> = rest.points.iter().map(|(_, part)| *part).collect();
        let [f, g] = [x, p].map(|rows| -> Vec<Mat<f64, D>> {
            rest.points.iter().map(|(gradient, _)| gradient_of_lane(rows, gradient)).collect()
        });
        let count = parts.len();
        let mean = |of: &dyn Fn(usize) -> f64| (0..count).map(|q| parts[q] * of(q)).sum::<f64>();
        let j: Vec<f64> = f.iter().map(Mat::determinant).collect();
        let growth: Vec<f64> = f.iter().zip(&g).map(|(f, g)| f.cofactor().dot(g)).collect();
        let (theta, theta_rate) = (mean(&|q| j[q]), mean(&|q| growth[q]));
        let (trace, trace_rate) = (mean(&|q| f[q].trace()), mean(&|q| g[q].trace()));
        let rate = |q: usize| (theta_rate / theta - growth[q] / j[q]) / d;
        let dilated = |q: usize| match dilatation {
            Dilatation::Finite => {
                let scale = root::<f64, D>(theta, j[q]);
                (f[q].scale(scale), f[q].scale_add(rate(q), &g[q]).scale(scale))
            }
            Dilatation::Small => (
                f[q] + Mat::scalar((trace - f[q].trace()) / d),
                g[q] + Mat::scalar((trace_rate - g[q].trace()) / d),
            ),
            Dilatation::Own => (f[q], g[q]),
        };
        let (fb, gb): (Vec<Mat<f64, D>>, Vec<Mat<f64, D>>) = (0..count).map(dilated).unzip();
        let [stress, along] = self.stresses(element, &fb, &gb);
        let is_small = dilatation == Dilatation::Small;
        let t = |q: usize| match is_small {
            true => along[q].trace() / d,
            false => (along[q].dot(&fb[q]) + stress[q].dot(&gb[q])) / d,
        };
        let u = |q: usize| if is_small { stress[q].trace() / d } else { stress[q].dot(&fb[q]) / d };
        let (mean_t, mean_u) = (mean(&t), mean(&u));
        for q in 0..count {
            let work = stress[q].dot(&gb[q]);
            let (by_f, by_g, by_part) = match dilatation {
                Dilatation::Finite => {
                    let (scale, by_rate) = (root::<f64, D>(theta, j[q]), mean_u / theta);
                    let by_theta = mean_t / theta - mean_u * theta_rate / (theta * theta);
                    let turned = by_rate - u(q) / j[q];
                    let cofactor = f[q].cofactor();
                    let by_j = by_theta - t(q) / j[q] + u(q) * growth[q] / (j[q] * j[q]);
                    let by_f = stress[q].scale_add(rate(q), &along[q]).scale(scale)
                        + cofactor.scale(by_j)
                        + f[q].cofactor_derivative(&g[q]).scale(turned);
                    let by_g = stress[q].scale(scale) + cofactor.scale(turned);
                    (by_f, by_g, work + by_theta * j[q] + by_rate * growth[q])
                }
                Dilatation::Small => (
                    along[q] + Mat::scalar(mean_t - t(q)),
                    stress[q] + Mat::scalar(mean_u - u(q)),
                    work + mean_t * f[q].trace() + mean_u * g[q].trace(),
                ),
                Dilatation::Own => (along[q], stress[q], work),
            };
            let weight = volume * parts[q];
            rates.add_point(q, weight, (&by_f, x));
            rates.add_point(q, weight, (&by_g, p));
            rates.parts[q] += volume * by_part;
            rates.volume += parts[q] * work;
        }
    }

    /// Derivatives of the viscous forces at the quadrature points along `p` by rest data.
    fn add_viscous(
        &self,
        rest: &RestCell<f64, D, N>,
        (x, v): (&[[f64; D]; N], &[[f64; D]; N]),
        p: &[[f64; D]; N],
        rates: &mut RestRates<D, N>,
    ) {
        let (two_eta, of_volume) = (2.0 * self.viscosity.0, self.of_volume());
        let [f, l, g] = [x, v, p].map(|rows| -> Vec<Mat<f64, D>> {
            rest.points.iter().map(|(gradient, _)| gradient_of_lane(rows, gradient)).collect()
        });
        let rate = |along: &[Mat<f64, D>]| -> Vec<Mat<f64, D>> {
            f.iter().zip(along).map(|(f, along)| f.transpose_mul(along).symmetric()).collect()
        };
        let (of_v, of_p) = (rate(&l), rate(&g));
        let mean = |rates: &[Mat<f64, D>]| -> f64 {
            rates.iter().zip(&rest.points).map(|(rate, (_, part))| part * rate.trace()).sum()
        };
        let (mean_v, mean_p) = (mean(&of_v), mean(&of_p));
        let volume = rest.volume;
        rates.volume += of_volume * mean_v * mean_p;
        for (q, (_, part)) in rest.points.iter().enumerate() {
            let stress =
                |rate: &Mat<f64, D>, mean: f64| deviator(rate).scale(two_eta) + Mat::scalar(of_volume * mean);
            let (s_v, s_p) = (stress(&of_v[q], mean_v), stress(&of_p[q], mean_p));
            let weight = volume * part;
            rates.add_point(q, weight, (&(l[q].mul(&s_p) + g[q].mul(&s_v)), x));
            rates.add_point(q, weight, (&f[q].mul(&s_p), v));
            rates.add_point(q, weight, (&f[q].mul(&s_v), p));
            let of_shape = two_eta * deviator(&of_v[q]).dot(&deviator(&of_p[q]));
            let by_means = of_volume * (mean_p * of_v[q].trace() + mean_v * of_p[q].trace());
            rates.parts[q] += volume * (of_shape + by_means);
            rates.volume += part * of_shape;
        }
    }

    /// `zeta + 2 eta / D`.
    fn of_volume(&self) -> f64 {
        self.viscosity.1 + 2.0 * self.viscosity.0 / D as f64
    }

    /// `f_k` of rows of the nodes of a cell.
    fn directions<S: number::RestNumber>(&self, x: &[[S; D]; N]) -> [[S; D]; D] {
        let slopes = (self.cells.cell.slopes)(&[0.0; D]);
        let mut directions = [[S::zero(); D]; D];
        for (k, direction) in directions.iter_mut().enumerate() {
            *direction = weighted(x, &slopes.map(|slope| S::splat(slope[k])));
        }
        directions
    }

    /// Derivatives of the elastic forces in bending along `p` by rest data.
    fn add_bending(
        &self,
        element: usize,
        rest: &RestCell<f64, D, N>,
        (x, p): (&[[f64; D]; N], &[[f64; D]; N]),
        rates: &mut RestRates<D, N>,
    ) {
        let turns = self.cells.dilatation != Dilatation::Small;
        let (f, f_rate) =
            if turns { (self.directions(x), self.directions(p)) } else { (rest.directions, [[0.0; D]; D]) };
        let [q, q_rate] = [x, p].map(|rows| rest.weights.map(|weights| weighted(rows, &weights)));
        let (mut s, mut s_rate) = ([[0.0; 2]; MOST_PAIRS], [[0.0; 2]; MOST_PAIRS]);
        let units = f.map(|f| {
            let length = dot(&f, &f).sqrt();
            (f.map(|c| c / length), length)
        });
        let turn = |k: usize| across(&units[k].0, &f_rate[k], units[k].1);
        for (pair, side, k) in modes::<D>() {
            s[pair][side] = dot(&q[pair], &units[k].0);
            s_rate[pair][side] = dot(&q_rate[pair], &units[k].0) + dot(&q[pair], &turn(k));
        }
        let stiffness = &self.elastic.of(element).value;
        let (force, force_rate) =
            (forces_of::<f64, D>(stiffness, &s), forces_of::<f64, D>(stiffness, &s_rate));
        let (mut by_q, mut by_rate) = ([[0.0; D]; MOST_PAIRS], [[0.0; D]; MOST_PAIRS]);
        for (pair, side, k) in modes::<D>() {
            let (n, length) = &units[k];
            let (phi, phi_rate) = (force[pair][side], force_rate[pair][side]);
            add(&mut by_q[pair], phi_rate, n);
            add(&mut by_q[pair], phi, &turn(k));
            add(&mut by_rate[pair], phi, n);
            if !turns {
                add(&mut rates.directions[k], phi_rate, &across(n, &q[pair], *length));
                add(&mut rates.directions[k], phi, &across(n, &q_rate[pair], *length));
            }
        }
        rates.add_weights(&by_q, x);
        rates.add_weights(&by_rate, p);
        rates.elastic = by_stiffness::<D>(&s, &s_rate);
    }

    /// Derivatives of the viscous forces in bending along `p` by rest data.
    fn add_viscous_bending(
        &self,
        stiffness: &BendingStiffness<f64>,
        rest: &RestCell<f64, D, N>,
        (x, v): (&[[f64; D]; N], &[[f64; D]; N]),
        p: &[[f64; D]; N],
        rates: &mut RestRates<D, N>,
    ) {
        let [f, f_v, f_p] = [x, v, p].map(|rows| self.directions(rows));
        let [q, q_v, q_p] = [x, v, p].map(|rows| rest.weights.map(|weights| weighted(rows, &weights)));
        let inverse = rest.directions.map(|f| 1.0 / dot(&f, &f).sqrt());
        let (mut of_v, mut of_p) = ([[0.0; 2]; MOST_PAIRS], [[0.0; 2]; MOST_PAIRS]);
        for (pair, side, k) in modes::<D>() {
            let rate = |q_along: &[f64; D], f_along: &[f64; D]| {
                (dot(q_along, &f[k]) + dot(&q[pair], f_along)) * inverse[k]
            };
            of_v[pair][side] = rate(&q_v[pair], &f_v[k]);
            of_p[pair][side] = rate(&q_p[pair], &f_p[k]);
        }
        let (by_v, by_p) = (forces_of::<f64, D>(stiffness, &of_p), forces_of::<f64, D>(stiffness, &of_v));
        let mut by = [[[0.0; D]; MOST_PAIRS]; 3];
        for (pair, side, k) in modes::<D>() {
            let (of_v, of_p) = (of_v[pair][side], of_p[pair][side]);
            let (by_v, by_p) = (by_v[pair][side], by_p[pair][side]);
            add(&mut by[0][pair], by_v * inverse[k], &f_v[k]);
            add(&mut by[0][pair], by_p * inverse[k], &f_p[k]);
            add(&mut by[1][pair], by_v * inverse[k], &f[k]);
            add(&mut by[2][pair], by_p * inverse[k], &f[k]);
            let by_length = -(by_v * of_v + by_p * of_p) * inverse[k] * inverse[k];
            add(&mut rates.directions[k], by_length, &rest.directions[k]);
        }
        for (by, rows) in by.iter().zip([x, v, p]) {
            rates.add_weights(by, rows);
        }
        rates.viscous = by_stiffness::<D>(&of_v, &of_p);
    }

    /// Derivatives of a function of rest data by the nodes of a cell.
    fn by_nodes(
        &self,
        element: usize,
        rest: &RestCell<f64, D, N>,
        mut rates: RestRates<D, N>,
    ) -> [[f64; D]; N] {
        let mut rows = [[0.0; D]; N];
        self.elastic.of(element).add(&rates.elastic, &mut rows);
        if let Some(viscous) = &self.viscous {
            viscous.of(element).add(&rates.viscous, &mut rows);
        }
        rates.add_to_nodes(self.cells.cell, &self.cells.nodes[element], &rest.points, &mut rows);
        rows
    }

    /// Rest data of a cell whose nodes move, at the mean of the rates to both sides.
    fn moving(&self, element: usize, change: &[[f64; D]; N]) -> RestCell<Dual<f64>, D, N> {
        let nodes = &self.cells.nodes[element];
        let towards = |sign: f64| {
            let mut moving = [[Dual::constant(0.0); D]; N];
            for (a, i) in (0..N).flat_map(|a| (0..D).map(move |i| (a, i))) {
                moving[a][i] = Dual { value: nodes[a][i], derivative: sign * change[a][i] };
            }
            RestCell::new(self.cells.cell, &moving)
        };
        let (mut rest, behind) = (towards(1.0), towards(-1.0));
        let mean = |ahead: &mut Dual<f64>, behind: &Dual<f64>| {
            ahead.derivative = 0.5 * (ahead.derivative - behind.derivative);
        };
        let points = rest.points.iter_mut().zip(&behind.points);
        for ((gradient, part), (gradient_behind, part_behind)) in points {
            let entries = gradient.as_flattened_mut().iter_mut().zip(gradient_behind.as_flattened());
            entries.for_each(|(ahead, behind)| mean(ahead, behind));
            mean(part, part_behind);
        }
        let weights = rest.weights.as_flattened_mut().iter_mut().zip(behind.weights.as_flattened());
        weights.for_each(|(ahead, behind)| mean(ahead, behind));
        rest
    }

    /// Change of `dE/dx + dR/dv` of a cell where its nodes at rest move.
    fn change_of_gradient(
        &self,
        element: usize,
        (x, v): (&[[f64; D]; N], &[[f64; D]; N]),
        change: &[[f64; D]; N],
    ) -> [[f64; D]; N] {
        let rest = self.moving(element, change);
        let constant = |rows: &[[f64; D]; N]| rows.map(|row| row.map(Dual::constant));
        let (x, v) = (constant(x), constant(v));
        let mut gradient = [[Dual::constant(0.0); D]; N];
        self.add_elastic_gradient(element, &rest, &x, &mut gradient);
        let stiffness = self.elastic.of(element).moving(change);
        let turns = self.cells.dilatation != Dilatation::Small;
        let f = if turns { self.directions(&x) } else { rest.directions };
        let q = rest.weights.map(|weights| weighted(&x, &weights));
        let mode = |pair: usize, k: usize| BendingMode::new(&q[pair], &f[k], turns);
        let mut s = [[Dual::constant(0.0); 2]; MOST_PAIRS];
        modes::<D>().for_each(|(pair, side, k)| s[pair][side] = mode(pair, k).s);
        let forces = forces_of::<_, D>(&stiffness, &s);
        for (pair, side, k) in modes::<D>() {
            let mode = mode(pair, k);
            self.spread(&rest, (pair, k), (forces[pair][side], &mode.of_q, &mode.of_f), &mut gradient);
        }
        if let Some(viscous) = &self.viscous {
            self.add_viscous_gradient(&rest, [&x, &v], &mut gradient);
            let stiffness = viscous.of(element).moving(change);
            let (f, f_v) = (self.directions(&x), self.directions(&v));
            let q_v = rest.weights.map(|weights| weighted(&v, &weights));
            let inverse = rest.directions.map(|f| Dual::constant(1.0) / dot(&f, &f).sqrt());
            let mut s = [[Dual::constant(0.0); 2]; MOST_PAIRS];
            for (pair, side, k) in modes::<D>() {
                s[pair][side] = (dot(&q_v[pair], &f[k]) + dot(&q[pair], &f_v[k])) * inverse[k];
            }
            let forces = forces_of::<_, D>(&stiffness, &s);
            for (pair, side, k) in modes::<D>() {
                let force = forces[pair][side] * inverse[k];
                self.spread(&rest, (pair, k), (force, &f[k], &q[pair]), &mut gradient);
            }
        }
        gradient.map(|row| row.map(|entry| entry.derivative))
    }

    /// Adds a force of a mode of a pair along an axis to the nodes, by its derivatives by `q` and `f`.
    fn spread(
        &self,
        rest: &RestCell<Dual<f64>, D, N>,
        (pair, k): (usize, usize),
        (force, of_q, of_f): (Dual<f64>, &[Dual<f64>; D], &[Dual<f64>; D]),
        gradient: &mut [[Dual<f64>; D]; N],
    ) {
        let slopes = (self.cells.cell.slopes)(&[0.0; D]);
        for (a, row) in gradient.iter_mut().enumerate() {
            for (i, row) in row.iter_mut().enumerate() {
                let along = rest.weights[pair][a] * of_q[i] + Dual::constant(slopes[a][k]) * of_f[i];
                *row += force * along;
            }
        }
    }

    /// Adds the elastic gradient at the quadrature points.
    fn add_elastic_gradient(
        &self,
        element: usize,
        rest: &RestCell<Dual<f64>, D, N>,
        x: &[[Dual<f64>; D]; N],
        gradient: &mut [[Dual<f64>; D]; N],
    ) {
        let (dilatation, d) = (self.cells.dilatation, Dual::constant(D as f64));
        let zero = Dual::constant(0.0);
        let f: Vec<Mat<Dual<f64>, D>> =
            rest.points.iter().map(|(gradient, _)| moving_gradient(x, gradient)).collect();
        let mean = |of: &dyn Fn(usize) -> Dual<f64>| {
            let parts = rest.points.iter().enumerate().map(|(q, (_, part))| *part * of(q));
            parts.fold(zero, |sum, part| sum + part)
        };
        let is_small = dilatation == Dilatation::Small;
        let theta = mean(&|q| if is_small { f[q].trace() } else { f[q].determinant() });
        let dilated = |f: &Mat<Dual<f64>, D>| match dilatation {
            Dilatation::Finite => f.scale(root::<Dual<f64>, D>(theta, f.determinant())),
            Dilatation::Small => *f + Mat::scalar((theta - f.trace()) / d),
            Dilatation::Own => *f,
        };
        let fb: Vec<Mat<Dual<f64>, D>> = f.iter().map(dilated).collect();
        let (values, changes): (Vec<_>, Vec<_>) = fb.iter().map(Dual::parts).unzip();
        let [stress, along] = self.stresses(element, &values, &changes);
        let stress: Vec<Mat<Dual<f64>, D>> =
            stress.iter().zip(&along).map(|(p, along)| Dual::along(p, along)).collect();
        let pressure = |q: usize| match is_small {
            true => stress[q].trace() / d,
            false => stress[q].dot(&fb[q]) / d,
        };
        let mean_pressure = mean(&pressure);
        for (q, (b, part)) in rest.points.iter().enumerate() {
            let working = match dilatation {
                Dilatation::Finite => {
                    let j = f[q].determinant();
                    let turned = mean_pressure / theta - pressure(q) / j;
                    stress[q].scale(root::<Dual<f64>, D>(theta, j)) + f[q].cofactor().scale(turned)
                }
                Dilatation::Small => stress[q] + Mat::scalar(mean_pressure - pressure(q)),
                Dilatation::Own => stress[q],
            };
            add_point_gradient(&working.scale(rest.volume * *part), b, gradient);
        }
    }

    /// Adds the viscous gradient at the quadrature points.
    fn add_viscous_gradient(
        &self,
        rest: &RestCell<Dual<f64>, D, N>,
        [x, v]: [&[[Dual<f64>; D]; N]; 2],
        gradient: &mut [[Dual<f64>; D]; N],
    ) {
        let (two_eta, of_volume) = (2.0 * self.viscosity.0, self.of_volume());
        let at = |(b, _): &RestPoint<Dual<f64>, D, N>| {
            let f = moving_gradient(x, b);
            (f, f.transpose_mul(&moving_gradient(v, b)).symmetric())
        };
        let states: Vec<_> = rest.points.iter().map(at).collect();
        let parts = rest.points.iter().zip(&states).map(|((_, part), (_, rate))| *part * rate.trace());
        let mean = parts.fold(Dual::constant(0.0), |sum, part| sum + part);
        for ((b, part), (f, rate)) in rest.points.iter().zip(&states) {
            let stress =
                deviator(rate).scale(Dual::constant(two_eta)) + Mat::scalar(Dual::constant(of_volume) * mean);
            add_point_gradient(&f.mul(&stress).scale(rest.volume * *part), b, gradient);
        }
    }

    /// Derivatives of `p . (d2E/dx2 p)` of a cell by rest data, where `x` goes along with it.
    fn curvature_rates(
        &self,
        element: usize,
        rest: &RestCell<f64, D, N>,
        (x, p): (&[[f64; D]; N], &[[f64; D]; N]),
    ) -> RestRates<D, N> {
        let mut rates = RestRates::new(rest.points.len());
        let (dilatation, d, volume) = (self.cells.dilatation, D as f64, rest.volume);
        let [f, g] = [x, p].map(|rows| -> Vec<Mat<f64, D>> {
            rest.points.iter().map(|(gradient, _)| gradient_of_lane(rows, gradient)).collect()
        });
        // Of a cell that has only turned, `cof F = F` and `J = 1`.
        let growth = |q: usize| f[q].cofactor().dot(&g[q]);
        let parts = |q: usize| rest.points[q].1;
        let mean = |of: &dyn Fn(usize) -> f64| (0..f.len()).map(|q| parts(q) * of(q)).sum::<f64>();
        let (is_own, mean_growth) = (dilatation == Dilatation::Own, mean(&growth));
        let dilated = |q: usize| match is_own {
            true => g[q],
            false => f[q].scale_add((mean_growth - growth(q)) / d, &g[q]),
        };
        let gb: Vec<Mat<f64, D>> = (0..f.len()).map(dilated).collect();
        let [_, along] = self.stresses(element, &f, &gb);
        let t = |q: usize| if is_own { 0.0 } else { along[q].dot(&f[q]) / d };
        let mean_t = mean(&t);
        for q in 0..f.len() {
            let work = along[q].dot(&gb[q]);
            let by_g = along[q] + f[q].cofactor().scale(mean_t - t(q));
            rates.add_point(q, 2.0 * volume * parts(q), (&by_g, p));
            rates.parts[q] += volume * (work + 2.0 * mean_t * growth(q));
            rates.volume += parts(q) * work;
        }
        let turned = f[0];
        let units = rest.directions.map(|f| {
            let f = turned.mul_vec(&f);
            let length = dot(&f, &f).sqrt();
            (f.map(|c| c / length), length)
        });
        let q = rest.weights.map(|weights| weighted(p, &weights));
        let mut s = [[0.0; 2]; MOST_PAIRS];
        modes::<D>().for_each(|(pair, side, k)| s[pair][side] = dot(&q[pair], &units[k].0));
        let forces = forces_of::<f64, D>(&self.elastic.of(element).value, &s);
        let mut by_q = [[0.0; D]; MOST_PAIRS];
        for (pair, side, k) in modes::<D>() {
            let force = 2.0 * forces[pair][side];
            add(&mut by_q[pair], force, &units[k].0);
            let by_f = across(&units[k].0, &q[pair], units[k].1);
            add(&mut rates.directions[k], force, &turned.transpose().mul_vec(&by_f));
        }
        rates.add_weights(&by_q, p);
        rates.elastic = by_stiffness::<D>(&s, &s);
        rates
    }
}

/// `sum_a x_a b_a^T` of rows and gradients that change.
fn moving_gradient<const D: usize, const N: usize>(
    x: &[[Dual<f64>; D]; N],
    gradient: &[[Dual<f64>; D]; N],
) -> Mat<Dual<f64>, D> {
    let mut f = Mat::zero();
    for (x, b) in x.iter().zip(gradient) {
        for i in 0..D {
            (0..D).for_each(|k| f[i][k] += x[i] * b[k]);
        }
    }
    f
}

/// Adds `T b_a` to the nodes.
fn add_point_gradient<const D: usize, const N: usize>(
    stress: &Mat<Dual<f64>, D>,
    b: &[[Dual<f64>; D]; N],
    gradient: &mut [[Dual<f64>; D]; N],
) {
    for (row, b) in gradient.iter_mut().zip(b) {
        row.iter_mut().zip(stress.mul_vec(b)).for_each(|(row, entry)| *row += entry);
    }
}

/// Adds rows of the nodes of a cell to those of all vertices.
fn add_rows<const D: usize, const N: usize>(vertices: &[u32; N], of_cell: &[[f64; D]; N], rows: &mut [f64]) {
    for (vertex, of_node) in vertices.iter().zip(of_cell) {
        rows[*vertex as usize * D..][..D].iter_mut().zip(of_node).for_each(|(row, by)| *row += by);
    }
}

impl<const D: usize, const N: usize> ShapedCells<D, N> {
    /// Adds rows of the nodes of every cell to those of all vertices, cells in their order.
    fn add_each(&self, of_cell: impl Fn(usize, &[u32; N]) -> [[f64; D]; N] + Sync, rows: &mut [f64]) {
        let cells: Vec<_> =
            self.cells.elements().map(|(element, vertices, ..)| (element, vertices)).collect();
        for cells in cells.chunks(AT_ONCE) {
            let found: Vec<_> =
                cells.par_iter().map(|(element, vertices)| of_cell(*element, vertices)).collect();
            cells.iter().zip(found).for_each(|((_, vertices), of_cell)| add_rows(vertices, &of_cell, rows));
        }
    }
}

impl<const D: usize, const N: usize> CellShapes for ShapedCells<D, N> {
    fn add_works(&self, (x, v): (&[f64], &[f64]), p: &[f64], rows: &mut [f64]) {
        let of_cell = |element: usize, vertices: &[u32; N]| {
            let [x, v, p] = [x, v, p].map(|rows| relative(rows, vertices));
            let rest = RestCell::new(self.cells.cell, &self.cells.nodes[element]);
            let mut rates = RestRates::new(rest.points.len());
            self.add_elastic(element, &rest, (&x, &p), &mut rates);
            self.add_bending(element, &rest, (&x, &p), &mut rates);
            if let Some(viscous) = &self.viscous {
                self.add_viscous(&rest, (&x, &v), &p, &mut rates);
                let stiffness = &viscous.of(element).value;
                self.add_viscous_bending(stiffness, &rest, (&x, &v), &p, &mut rates);
            }
            self.by_nodes(element, &rest, rates)
        };
        self.add_each(of_cell, rows);
    }

    fn add_gradients(&self, (x, v): (&[f64], &[f64]), change: &[f64], gradient: &mut [f64]) {
        let of_cell = |element: usize, vertices: &[u32; N]| {
            let [x, v, change] = [x, v, change].map(|rows| relative(rows, vertices));
            self.change_of_gradient(element, (&x, &v), &change)
        };
        self.add_each(of_cell, gradient);
    }

    fn add_curvatures(&self, x: &[f64], p: &[f64], rows: &mut [f64]) {
        let of_cell = |element: usize, vertices: &[u32; N]| {
            let [x, p] = [x, p].map(|rows| relative(rows, vertices));
            let rest = RestCell::new(self.cells.cell, &self.cells.nodes[element]);
            let rates = self.curvature_rates(element, &rest, (&x, &p));
            self.by_nodes(element, &rest, rates)
        };
        self.add_each(of_cell, rows);
    }
}
