//! Step fraction until the first cell collapses.

use super::super::collapse::{MARGIN, first_root, suspects};
use super::OnePointCells;
use super::kernels::loaded;
use super::packs::{PackRest, in_lanes};
use super::rest::RestData;
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};

/// Finds the cells of a pack that may collapse in the step: bit `l` is set for lane `l`.
struct SuspectsKernel<'a, const D: usize, const N: usize> {
    term: &'a OnePointCells<D, N>,
    pack: usize,
    from: &'a [[[f64; WIDTH]; D]; N],
    motion: &'a [[[f64; WIDTH]; D]; N],
}

impl<const D: usize, const N: usize> Kernel for SuspectsKernel<'_, D, N> {
    type Output = u8;

    #[inline(always)]
    fn run<L: Lanes>(self) -> u8 {
        let rest: PackRest<'_, L, D, N> = self.term.packs.rest(self.pack);
        let (f, _) = rest.measure(&loaded::<L, D, N>(self.from));
        let (change, _) = rest.measure(&loaded::<L, D, N>(self.motion));
        suspects::<L, D>(&f, &change)
    }
}

/// Returns the step fraction towards `x + dx`, at most 1: `MARGIN` times that at the first `det F = 0`.
pub(super) fn step_to_collapse<const D: usize, const N: usize>(
    term: &OnePointCells<D, N>,
    x: &[f64],
    dx: &[f64],
) -> f64 {
    let packs = term.patches.index.len();
    let mut lanes = term.patches.lanes_in(0..packs * WIDTH);
    let mut step: f64 = 1.0;
    for pack in 0..packs {
        let cells: Vec<[u32; N]> = lanes.by_ref().take(WIDTH).map(|(vertices, ..)| vertices).collect();
        let (from, motion) = (&in_lanes(x, &cells), &in_lanes(dx, &cells));
        let found = dispatch(SuspectsKernel { term, pack, from, motion });
        for (lane, vertices) in cells.iter().enumerate().filter(|(lane, _)| found >> lane & 1 == 1) {
            let [now, change] = [x, dx].map(|rows| term.deformation_of(rows, vertices, (pack, lane)));
            step = step.min(MARGIN * first_root(&now, &change));
        }
    }
    step
}
