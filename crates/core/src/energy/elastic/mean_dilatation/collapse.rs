//! How far cells may go until one of them collapses at a quadrature point.

use super::super::collapse::{MARGIN, first_root, suspects};
use super::kernels::cell_gradient;
use super::{MeanDilatation, PointPack, in_lanes};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};

/// Marks the cells of a pack that may collapse on their way: bit `l` is set for lane `l`.
struct SuspectsKernel<'a, const D: usize, const N: usize> {
    rest: &'a [PointPack<D, N>],
    from: &'a [[[f64; WIDTH]; D]; N],
    motion: &'a [[[f64; WIDTH]; D]; N],
}

/// Positions of the nodes of a pack in lanes.
#[inline(always)]
pub(super) fn loaded<L: Lanes, const D: usize, const N: usize>(
    nodes: &[[[f64; WIDTH]; D]; N],
) -> [[L; D]; N] {
    let mut rows = [[L::zero(); D]; N];
    for a in 0..N {
        for c in 0..D {
            rows[a][c] = L::load(&nodes[a][c]);
        }
    }
    rows
}

impl<const D: usize, const N: usize> Kernel for SuspectsKernel<'_, D, N> {
    type Output = u8;

    #[inline(always)]
    fn run<L: Lanes>(self) -> u8 {
        let (from, motion) = (loaded::<L, D, N>(self.from), loaded::<L, D, N>(self.motion));
        let mut found = 0;
        for rest in self.rest {
            found |= suspects(&cell_gradient(&from, rest), &cell_gradient(&motion, rest));
        }
        found
    }
}

/// How far cells may go towards `x + dx`: most of the way to the first `det F = 0`, in (0, 1].
pub(super) fn step_to_collapse<const D: usize, const N: usize>(
    term: &MeanDilatation<D, N>,
    x: &[f64],
    dx: &[f64],
) -> f64 {
    let packs = term.patches.index.len();
    let mut lanes = term.patches.lanes_in(0..packs * WIDTH);
    let mut step: f64 = 1.0;
    for pack in 0..packs {
        let cells: Vec<[u32; N]> = lanes.by_ref().take(WIDTH).map(|(vertices, ..)| vertices).collect();
        let (from, motion) = (&in_lanes(x, &cells), &in_lanes(dx, &cells));
        let found = dispatch(SuspectsKernel { rest: term.packs.rest(pack), from, motion });
        for (lane, vertices) in cells.iter().enumerate().filter(|(lane, _)| found >> lane & 1 == 1) {
            let [now, change] = [x, dx].map(|rows| term.deformations(rows, vertices, pack, lane));
            for (now, change) in now.iter().zip(&change) {
                step = step.min(MARGIN * first_root(now, change));
            }
        }
    }
    step
}
