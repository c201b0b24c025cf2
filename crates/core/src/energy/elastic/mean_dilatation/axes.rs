//! Axes of the material in each cell.
//!
//! `psi(Fb R)` with the rotation `R` of a cell: with `R^T b` in place of `b` all that is made of `F_q` is in
//! the axes of the material, and forces are those in space. Stiffness in bending goes by the moduli at rest,
//! in the axes of space.

use super::bending::{BendingSolid, CellBending};
use super::kernels::{gradient_of_lane, root};
use super::{Dilatation, MeanDilatation};
use crate::algebra::Mat;
use crate::energy::elastic::block::stresses;
use crate::energy::elastic::points_of;
use crate::material::{Psd, Tangent};

impl<const D: usize, const N: usize> MeanDilatation<D, N> {
    /// The same cells at rest at `rest` (flat, all vertices of the system) [m], the material of each turned
    /// by the rotation `R` from its axes to those of space, in the order of the mesh, as
    /// [`Elastic::with_axes`](crate::energy::elastic::Elastic::with_axes) has it.
    ///
    /// # Panics
    /// If there is not one rotation for each cell, or the material is linear in `F`: it has no directions.
    #[must_use]
    pub fn with_axes(mut self, axes: &[Mat<f64, 3>], rest: &[f64]) -> Self {
        assert!(self.dilatation != Dilatation::Small, "a material that is linear in F");
        let places: Vec<(usize, usize, usize)> =
            self.elements().map(|(element, _, pack, lane)| (element, pack, lane)).collect();
        assert_eq!(places.len(), axes.len(), "one rotation for each cell");
        for (element, pack, lane) in places {
            self.packs.turn(pack, lane, &axes[element].leading());
        }
        self.axes = axes.to_vec();
        let tangent = self.material.tangent(&Mat::identity(), Psd::Exact);
        self.bending = self.lacking((&tangent, None), rest);
        self
    }

    /// Stiffness in bending that cells lack of a solid with this tangent at rest, or its change with that of
    /// the tangent.
    pub(super) fn lacking(
        &self,
        (tangent, change): (&Tangent<D>, Option<&Tangent<D>>),
        rest: &[f64],
    ) -> Option<CellBending<D, N>> {
        let axes: Vec<Mat<f64, D>> = self.axes.iter().map(Mat::leading).collect();
        let solid = BendingSolid { tangent, change, axes: &axes, turning: None, dilatation: self.dilatation };
        CellBending::new(self.cell, &self.patches, &self.packs, solid, rest)
    }

    /// These cells at rest at `rest` [m], whose axes change by `turns` with the components of a direction of
    /// each.
    ///
    /// # Panics
    /// If the cells have no axes, or there are not as many turns.
    pub fn turning(self, turns: Vec<[Mat<f64, D>; D]>, rest: &[f64]) -> TurningCells<D, N> {
        assert_eq!(self.axes.len(), turns.len(), "a turn for each cell");
        let axes: Vec<Mat<f64, D>> = self.axes.iter().map(Mat::leading).collect();
        let tangent = &self.material.tangent(&Mat::identity(), Psd::Exact);
        let bending = |c: usize| {
            let turning: Vec<Mat<f64, D>> = turns.iter().map(|turns| turns[c]).collect();
            let (turning, dilatation) = (Some(&turning[..]), self.dilatation);
            let solid = BendingSolid { tangent, change: None, axes: &axes, turning, dilatation };
            CellBending::new(self.cell, &self.patches, &self.packs, solid, rest)
        };
        let bending = std::array::from_fn(bending);
        // `R^T dR`.
        let relative = turns.iter().zip(&axes);
        let turns = relative.map(|(turns, axes)| turns.map(|turn| axes.transpose_mul(&turn))).collect();
        TurningCells { cells: self, turns, bending }
    }
}

/// Cells of whatever kind whose axes change with the components of a direction of each.
pub trait CellTurns: Send {
    /// Adds the derivatives of `p . dE/dx` by the components of the direction of each cell, flat `(cells,
    /// dimension)`.
    fn add_works(&self, x: &[f64], p: &[f64], works: &mut [f64]);

    /// Adds what is added to `dE/dx` where the directions change by `change`: the transpose.
    fn add_gradients(&self, x: &[f64], change: &[f64], gradient: &mut [f64]);
}

/// Cells whose axes change: see [`MeanDilatation::turning`].
///
/// With `G` made of `p` as `Fb` is of the positions, the derivative of `p . dE/dx` by `R` is `sum_q V w_q
/// (Fb^T (C : G) + G^T P) : R^T dR` in the axes of the material, and that of the stiffness in bending.
pub struct TurningCells<const D: usize, const N: usize> {
    cells: MeanDilatation<D, N>,
    /// `R^T dR` of each cell.
    turns: Vec<[Mat<f64, D>; D]>,
    /// Change of the stiffness in bending with each component.
    bending: [Option<CellBending<D, N>>; D],
}

impl<const D: usize, const N: usize> TurningCells<D, N> {
    /// The derivatives of `p . dE/dx` of a cell in a lane of a pack, with its nodes at `x`.
    fn works(
        &self,
        (element, pack, lane): (usize, usize, usize),
        x: &[[f64; D]; N],
        p: &[[f64; D]; N],
    ) -> [f64; D] {
        let MeanDilatation { packs, material, dilatation, stress, .. } = &self.cells;
        let points: Vec<(Mat<f64, D>, Mat<f64, D>, f64)> = packs
            .rest(pack)
            .iter()
            .map(|point| {
                let (gradient, part) = point.lane(lane);
                (gradient_of_lane(x, &gradient), gradient_of_lane(p, &gradient), part)
            })
            .collect();
        let theta: f64 = points.iter().map(|(f, _, part)| part * f.determinant()).sum();
        let growth: f64 = points.iter().map(|(f, g, part)| part * f.cofactor().dot(g)).sum();
        let dilated = |(f, g, _): &(Mat<f64, D>, Mat<f64, D>, f64)| {
            if *dilatation == Dilatation::Own {
                return (*f, *g);
            }
            let j = f.determinant();
            let scale = root::<f64, D>(theta, j);
            let rate = (growth / theta - f.cofactor().dot(g) / j) / D as f64;
            (f.scale(scale), f.scale_add(rate, g).scale(scale))
        };
        let (deformed, along): (Vec<Mat<f64, D>>, Vec<Mat<f64, D>>) = points.iter().map(dilated).unzip();
        let stresses = stresses(&**material, *stress, &deformed);
        let mut by_axes = Mat::zero();
        for (q, (f, g)) in deformed.iter().zip(&along).enumerate() {
            let change = material.tangent(f, Psd::Exact).apply(g);
            let rate = f.transpose_mul(&change) + g.transpose_mul(&stresses.lane(q));
            by_axes = rate.scale_add(packs.volume[pack][lane] * points[q].2, &by_axes);
        }
        std::array::from_fn(|c| {
            let bending = self.bending[c].as_ref();
            let in_bending = bending.map_or(0.0, |bending| bending.work_of_lane((x, p), (pack, lane), true));
            by_axes.dot(&self.turns[element][c]) + in_bending
        })
    }
}

impl<const D: usize, const N: usize> CellTurns for TurningCells<D, N> {
    fn add_works(&self, x: &[f64], p: &[f64], works: &mut [f64]) {
        for (element, vertices, pack, lane) in self.cells.elements() {
            let [x, p] = [x, p].map(|rows| points_of(rows, &vertices));
            let of_cell = works[element * D..][..D].iter_mut();
            of_cell.zip(self.works((element, pack, lane), &x, &p)).for_each(|(sum, work)| *sum += work);
        }
    }

    fn add_gradients(&self, x: &[f64], change: &[f64], gradient: &mut [f64]) {
        for (element, vertices, pack, lane) in self.cells.elements() {
            let x = points_of(x, &vertices);
            for (a, k) in (0..N).flat_map(|a| (0..D).map(move |k| (a, k))) {
                let mut unit = [[0.0; D]; N];
                unit[a][k] = 1.0;
                let works = self.works((element, pack, lane), &x, &unit);
                let change = change[element * D..][..D].iter().zip(works);
                gradient[vertices[a] as usize * D + k] +=
                    change.map(|(change, work)| change * work).sum::<f64>();
            }
        }
    }
}
