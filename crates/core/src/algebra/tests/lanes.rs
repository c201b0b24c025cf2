//! A pack gives each lane the bits that the lane has alone, whatever its neighbours need.

use super::sample::{Random, bits, categories, load_lanes, not_finite, store_lanes};
use crate::algebra::{Mat, rotation, signed_svd};
use crate::lanes::{InstructionSet, Kernel, Lanes, WIDTH, dispatch_at};

/// One matrix per lane.
struct Decompose<'a, const D: usize>(&'a [Mat<f64, D>]);

impl<const D: usize> Kernel for Decompose<'_, D> {
    /// The rotation, `U`, `V`, and the singular values on a diagonal, each for every lane.
    type Output = [[Mat<f64, D>; WIDTH]; 4];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let f = load_lanes::<L, D>(self.0);
        let svd = signed_svd(&f);
        let values = Mat::diagonal(&svd.sigma);
        [store_lanes(&rotation(&f)), store_lanes(&svd.u), store_lanes(&svd.v), store_lanes(&values)]
    }
}

fn same_bits<const D: usize>() {
    // Neighbours of every kind: some lanes take the fallback, some converge early, some are not finite.
    let mut random = Random(31);
    let mut all = vec![];
    for _ in 0..60 {
        for (_, generate) in categories::<D>() {
            all.push(generate(&mut random));
        }
    }
    all.extend(not_finite::<D>());
    for pack in all.chunks_exact(WIDTH) {
        for level in InstructionSet::ALL {
            let out = dispatch_at(level, Decompose(pack));
            for (l, f) in pack.iter().enumerate() {
                let svd = signed_svd(f);
                let alone = [rotation(f), svd.u, svd.v, Mat::diagonal(&svd.sigma)];
                for k in 0..4 {
                    assert_eq!(bits(&out[k][l]), bits(&alone[k]), "{level:?}, result {k}, {f:?}");
                }
            }
        }
    }
}

#[test]
fn two_dimensions() {
    same_bits::<2>();
}

#[test]
fn three_dimensions() {
    same_bits::<3>();
}
