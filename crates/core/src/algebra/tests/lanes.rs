//! A pack gives each lane the bits that the lane has alone, whatever its neighbours need.

use super::sample::{Random, categories, not_finite};
use crate::algebra::{Mat, rotation, signed_svd};
use crate::lanes::{Kernel, Lanes, Level, WIDTH, dispatch_at};

/// One matrix per lane.
struct Decompose<'a, const D: usize>(&'a [Mat<f64, D>]);

impl<const D: usize> Kernel for Decompose<'_, D> {
    /// Per lane the rotation, `U`, `V`, and the singular values on a diagonal.
    type Output = [[Mat<f64, D>; 4]; WIDTH];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let mut f = Mat::<L, D>::zero();
        for i in 0..D {
            for j in 0..D {
                let mut lanes = [0.0; WIDTH];
                for l in 0..WIDTH {
                    lanes[l] = self.0[l][i][j];
                }
                f[i][j] = L::load(&lanes);
            }
        }
        let svd = signed_svd(&f);
        let results = [rotation(&f), svd.u, svd.v, Mat::diagonal(&svd.sigma)];
        let mut out = [[Mat::zero(); 4]; WIDTH];
        for k in 0..4 {
            for i in 0..D {
                for j in 0..D {
                    let lanes = results[k][i][j].to_array();
                    for l in 0..WIDTH {
                        out[l][k][i][j] = lanes[l];
                    }
                }
            }
        }
        out
    }
}

/// Every NaN is the same one: which of two a sum inherits is not specified.
fn bits<const D: usize>(m: &Mat<f64, D>) -> Vec<u64> {
    m.0.iter().flatten().map(|x| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }).collect()
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
        for level in Level::ALL {
            let out = dispatch_at(level, Decompose(pack));
            for (f, got) in pack.iter().zip(&out) {
                let svd = signed_svd(f);
                let alone = [rotation(f), svd.u, svd.v, Mat::diagonal(&svd.sigma)];
                for k in 0..4 {
                    assert_eq!(bits(&got[k]), bits(&alone[k]), "{level:?}, result {k}, {f:?}");
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
