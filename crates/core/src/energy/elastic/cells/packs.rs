//! Reference data of packs of cells.

use std::marker::PhantomData;

use super::hourglass::{MOST_STIFFNESS, RestModuli, stiffness, stiffness_entries};
use super::kernels::{PackScalar, loaded};
use super::rest::{CellRest, MOST_MODES, RestData, modes};
use crate::algebra::{Dual, Mat};
use crate::element::Isoparametric;
use crate::energy::elastic::points_of;
use crate::energy::patch::Patches;
use crate::lanes::{Lanes, Portable, WIDTH, filled};
use crate::material::Tangent;

/// One number of each cell of a pack.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct PackRow([f64; WIDTH]);

/// Reference data of packs of cells: volume, gradients, weights and the stiffness of the hourglass modes.
pub(crate) struct CellPacks<const D: usize, const N: usize>(Vec<PackRow>);

/// Solid that determines the stiffness of the hourglass modes of cells.
#[derive(Clone, Copy)]
pub(crate) struct HourglassSolid<'a, const D: usize> {
    /// Initial tangent [Pa].
    pub(crate) tangent: &'a Tangent<D>,
    /// Change of the tangent with a parameter: the stiffness is then the change of `K`.
    pub(crate) change: Option<&'a Tangent<D>>,
    /// Rotation from material axes to those of space, of each cell; empty if the axes are the same.
    pub(crate) axes: &'a [Mat<f64, 3>],
}

impl<const D: usize, const N: usize> CellPacks<D, N> {
    /// Number of rows of a pack.
    const ROWS: usize = 1 + N * D + modes(D) * N + stiffness_entries(D);
    const WEIGHTS: usize = 1 + N * D;
    const STIFFNESS: usize = Self::WEIGHTS + modes(D) * N;

    /// Creates the packs of these cells of `body` with the reference positions `rest` (flat, all
    /// vertices) [m].
    ///
    /// # Panics
    /// If the volume of a cell is not positive; meshes are checked before.
    pub(crate) fn new(
        body: &str,
        cell: &Isoparametric<D, N>,
        patches: &Patches<N>,
        rest: &[f64],
        solid: HourglassSolid<'_, D>,
    ) -> Self {
        let mut packs = CellPacks(filled(PackRow([0.0; WIDTH]), patches.index.len() * Self::ROWS));
        let mut lanes = patches.lanes_in(0..patches.index.len() * WIDTH);
        for (rows, stencils) in packs.0.chunks_exact_mut(Self::ROWS).zip(&patches.stencil) {
            let cells: Vec<[u32; N]> = lanes.by_ref().take(WIDTH).map(|(vertices, ..)| vertices).collect();
            let of_pack = CellRest::new(cell, &loaded::<Portable, D, N>(&in_lanes(rest, &cells)));
            let of_pack = match solid.axes {
                [] => of_pack,
                axes => of_pack.turned(&rotations(axes, stencils)),
            };
            Self::fill(rows, &of_pack, solid);
            // Padding lanes repeat a cell, without volume and stiffness.
            for (lane, stencil) in stencils.iter().enumerate() {
                let volume = rows[0].0[lane];
                match stencil {
                    Some(element) => assert!(volume > 0.0, "element {element} of {body} has volume {volume}"),
                    None => {
                        let without = rows[Self::STIFFNESS..].iter_mut();
                        without.for_each(|row| row.0[lane] = 0.0);
                        rows[0].0[lane] = 0.0;
                    }
                }
            }
        }
        packs
    }

    fn fill(rows: &mut [PackRow], rest: &CellRest<Portable, D, N>, solid: HourglassSolid<'_, D>) {
        rest.volume.store(&mut rows[0].0);
        for a in 0..N {
            for k in 0..D {
                rest.gradient[a][k].store(&mut rows[1 + a * D + k].0);
            }
            for h in 0..modes(D) {
                rest.weight[h][a].store(&mut rows[Self::WEIGHTS + h * N + a].0);
            }
        }
        let entries = match solid.change {
            None => stiffness((rest.volume, &rest.inverse), &RestModuli::new(solid.tangent)),
            Some(change) => {
                let inverse = Dual::along(&rest.inverse, &Mat::zero());
                let moduli = RestModuli::changing(solid.tangent, change);
                stiffness((Dual::constant(rest.volume), &inverse), &moduli).map(|entry| entry.derivative)
            }
        };
        for (row, entry) in rows[Self::STIFFNESS..].iter_mut().zip(entries) {
            entry.store(&mut row.0);
        }
    }

    /// Returns the reference data of a pack on lanes.
    #[inline(always)]
    pub(crate) fn rest<L: Lanes>(&self, pack: usize) -> PackRest<'_, L, D, N> {
        PackRest { rows: &self.0[pack * Self::ROWS..][..Self::ROWS], lanes: PhantomData }
    }

    /// Returns volume and gradients of one cell.
    pub(super) fn gradients_of_lane(&self, pack: usize, lane: usize) -> (f64, [[f64; D]; N]) {
        let rows = &self.0[pack * Self::ROWS..][..Self::ROWS];
        let mut gradient = [[0.0; D]; N];
        let entries = gradient.as_flattened_mut().iter_mut().zip(&rows[1..]);
        entries.for_each(|(entry, row)| *entry = row.0[lane]);
        (rows[0].0[lane], gradient)
    }

    /// Returns all numbers of one cell.
    pub(crate) fn lane(&self, pack: usize, lane: usize) -> CellLane<D, N> {
        let rows = &self.0[pack * Self::ROWS..][..Self::ROWS];
        let (volume, gradient) = self.gradients_of_lane(pack, lane);
        let mut of_cell =
            CellLane { volume, gradient, weight: [[0.0; N]; MOST_MODES], stiffness: [0.0; MOST_STIFFNESS] };
        let weights = of_cell.weight.as_flattened_mut()[..modes(D) * N].iter_mut();
        weights.zip(&rows[Self::WEIGHTS..]).for_each(|(weight, row)| *weight = row.0[lane]);
        let entries = of_cell.stiffness.iter_mut().zip(&rows[Self::STIFFNESS..]);
        entries.for_each(|(entry, row)| *entry = row.0[lane]);
        of_cell
    }
}

/// Reference data of one cell of a pack.
pub(crate) struct CellLane<const D: usize, const N: usize> {
    pub(crate) volume: f64,
    /// `b` of every node [1/m].
    pub(crate) gradient: [[f64; D]; N],
    /// `gamma` of every mode.
    pub(crate) weight: [[f64; N]; MOST_MODES],
    /// Stiffness of the hourglass modes.
    pub(crate) stiffness: [f64; MOST_STIFFNESS],
}

impl<const D: usize, const N: usize> RestData<f64, D, N> for CellLane<D, N> {
    fn volume(&self) -> f64 {
        self.volume
    }

    fn gradient(&self, node: usize, component: usize) -> f64 {
        self.gradient[node][component]
    }

    fn weight(&self, mode: usize, node: usize) -> f64 {
        self.weight[mode][node]
    }
}

/// Reference data of a pack on lanes.
#[derive(Clone, Copy)]
pub(crate) struct PackRest<'a, L, const D: usize, const N: usize> {
    rows: &'a [PackRow],
    lanes: PhantomData<L>,
}

impl<L: Lanes, const D: usize, const N: usize> PackRest<'_, L, D, N> {
    /// Loads the stiffness of the hourglass modes.
    #[inline(always)]
    pub(crate) fn stiffness<S: PackScalar<L>>(&self) -> [S; MOST_STIFFNESS] {
        let mut entries = [S::zero(); MOST_STIFFNESS];
        for i in 0..stiffness_entries(D) {
            entries[i] = S::constant(L::load(&self.rows[CellPacks::<D, N>::STIFFNESS + i].0));
        }
        entries
    }
}

impl<L: Lanes, S: PackScalar<L>, const D: usize, const N: usize> RestData<S, D, N> for PackRest<'_, L, D, N> {
    #[inline(always)]
    fn volume(&self) -> S {
        S::constant(L::load(&self.rows[0].0))
    }

    #[inline(always)]
    fn gradient(&self, node: usize, component: usize) -> S {
        S::constant(L::load(&self.rows[1 + node * D + component].0))
    }

    #[inline(always)]
    fn weight(&self, mode: usize, node: usize) -> S {
        S::constant(L::load(&self.rows[CellPacks::<D, N>::WEIGHTS + mode * N + node].0))
    }
}

/// Gathers the positions of the nodes of a pack of cells.
pub(super) fn in_lanes<const D: usize, const N: usize>(
    x: &[f64],
    cells: &[[u32; N]],
) -> [[[f64; WIDTH]; D]; N] {
    let mut nodes = [[[0.0; WIDTH]; D]; N];
    for (lane, vertices) in cells.iter().enumerate() {
        for (node, at) in nodes.iter_mut().zip(points_of::<D, N>(x, vertices)) {
            node.iter_mut().zip(at).for_each(|(component, at)| component[lane] = at);
        }
    }
    nodes
}

/// Returns the rotations of the cells of a pack; padding lanes repeat the last.
fn rotations<const D: usize>(axes: &[Mat<f64, 3>], stencils: &[Option<u32>; WIDTH]) -> Mat<Portable, D> {
    let mut rotation = Mat::zero();
    let mut last = 0;
    let elements = stencils.map(|stencil| {
        last = stencil.map_or(last, |element| element as usize);
        last
    });
    for i in 0..D {
        for k in 0..D {
            rotation[i][k] = Portable::load(&elements.map(|element| axes[element][i][k]));
        }
    }
    rotation
}
