//! Deformation gradients with prescribed singular values, by category.

use crate::algebra::{Mat, Vect};
use crate::lanes::{Lanes, WIDTH};

/// SplitMix64: deterministic, and enough for tests.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
    /// Uniform in `[a, b)`.
    pub(crate) fn uniform(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }
    /// Log-uniform in `[a, b)`, either sign.
    fn scale(&mut self, a: f64, b: f64) -> f64 {
        self.uniform(a.ln(), b.ln()).exp()
    }
    fn sign(&mut self) -> f64 {
        if self.bits() & 1 == 0 { 1.0 } else { -1.0 }
    }
    fn normal(&mut self) -> f64 {
        let r = self.uniform(1e-300, 1.0);
        (-2.0 * r.ln()).sqrt() * self.uniform(0.0, std::f64::consts::TAU).cos()
    }
    pub(crate) fn gaussian<const D: usize>(&mut self) -> Mat<f64, D> {
        let mut m = Mat::zero();
        for i in 0..D {
            for j in 0..D {
                m[i][j] = self.normal();
            }
        }
        m
    }
    /// A random rotation: Gram-Schmidt of a gaussian matrix, twice, the last row by the cofactor.
    pub(crate) fn rotation<const D: usize>(&mut self) -> Mat<f64, D> {
        let mut m = self.gaussian::<D>();
        for _ in 0..2 {
            for i in 0..D - 1 {
                for k in 0..i {
                    let d: f64 = (0..D).map(|c| m[i][c] * m[k][c]).sum();
                    for c in 0..D {
                        m[i][c] -= d * m[k][c];
                    }
                }
                let n = m[i].iter().map(|x| x * x).sum::<f64>().sqrt();
                m[i] = m[i].map(|x| x / n);
            }
            m[D - 1] = m.cofactor()[D - 1];
        }
        m
    }
    fn with_stretches<const D: usize>(&mut self, sigma: Vect<f64, D>) -> Mat<f64, D> {
        let (u, v) = (self.rotation(), self.rotation());
        u.mul(&Mat::diagonal(&sigma)).mul_transpose(&v)
    }
}

/// The categories: a name and a generator.
pub(crate) type Category<const D: usize> = (&'static str, fn(&mut Random) -> Mat<f64, D>);

/// `head` values spread by `spread`, then the last one.
fn stretches<const D: usize>(r: &mut Random, lo: f64, hi: f64, last: f64) -> Mat<f64, D> {
    let mut s = [0.0; D];
    for i in 0..D {
        s[i] = r.uniform(lo, hi);
    }
    s[D - 1] = last;
    r.with_stretches(s)
}

pub(crate) fn categories<const D: usize>() -> Vec<Category<D>> {
    vec![
        ("identity", |_| Mat::identity()),
        ("rotation", |r| r.rotation()),
        ("near identity", |r| r.gaussian().scale_add(r.scale(1e-12, 0.1), &Mat::identity())),
        ("clustered", |r| {
            let mut s = [1.0; D];
            for i in 0..D {
                s[i] += r.scale(1e-16, 1e-4);
            }
            r.with_stretches(s)
        }),
        ("moderate", |r| {
            let last = r.uniform(0.3, 3.0);
            stretches(r, 0.3, 3.0, last)
        }),
        ("inverted", |r| {
            let last = -0.5 * r.uniform(0.05, 0.8);
            stretches(r, 0.5, 2.0, last)
        }),
        ("flat", |r| {
            let last = 1e-8 * r.uniform(-1.0, 1.0);
            stretches(r, 0.5, 2.0, last)
        }),
        ("singular", |r| stretches(r, 0.5, 2.0, 0.0)),
        ("rank one", |r| {
            let mut s = [1.0; D];
            for i in 1..D {
                s[i] = 1e-8 * r.uniform(-1.0, 1.0);
            }
            r.with_stretches(s)
        }),
        ("ambiguous", |r| {
            let mut s = [r.uniform(0.5, 2.0); D];
            s[D - 2] = r.uniform(0.3, 0.5);
            s[D - 1] = -s[D - 2] + r.scale(1e-12, 1e-2);
            r.with_stretches(s)
        }),
        ("gaussian", |r| r.gaussian()),
        ("scaled gaussian", |r| r.gaussian().scale(r.scale(1e-6, 1e6))),
        ("independent", |r| {
            let mut s = [0.0; D];
            for i in 0..D {
                s[i] = r.scale(1e-3, 1e3) * r.sign();
            }
            r.with_stretches(s)
        }),
    ]
}

/// Largest entry of `|A^T A - I|`.
pub(crate) fn orthogonality<const D: usize>(a: &Mat<f64, D>) -> f64 {
    largest(&(a.transpose_mul(a) - Mat::identity()))
}

/// Largest entry by magnitude; NaN where there is one.
pub(crate) fn largest<const D: usize>(a: &Mat<f64, D>) -> f64 {
    a.0.iter().flatten().fold(0.0, |m, x| if x.abs() > m || x.is_nan() { x.abs() } else { m })
}

pub(crate) fn all_nan<const D: usize>(a: &Mat<f64, D>) -> bool {
    a.0.iter().flatten().all(|x| x.is_nan())
}

/// `F` with one entry replaced, for every entry and every value that is not a number to compute with.
pub(crate) fn not_finite<const D: usize>() -> Vec<Mat<f64, D>> {
    let mut list = vec![Mat([[1e160; D]; D])];
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for i in 0..D {
            for j in 0..D {
                let mut f = Random(7).gaussian::<D>();
                f[i][j] = bad;
                list.push(f);
            }
        }
    }
    list
}

/// One matrix per lane of a pack.
#[inline(always)]
pub(crate) fn load_lanes<L: Lanes, const D: usize>(matrices: &[Mat<f64, D>]) -> Mat<L, D> {
    let mut m = Mat::<L, D>::zero();
    for i in 0..D {
        for j in 0..D {
            let mut lanes = [0.0; WIDTH];
            for l in 0..WIDTH {
                lanes[l] = matrices[l][i][j];
            }
            m[i][j] = L::load(&lanes);
        }
    }
    m
}

/// The matrices in the lanes of a pack.
#[inline(always)]
pub(crate) fn store_lanes<L: Lanes, const D: usize>(m: &Mat<L, D>) -> [Mat<f64, D>; WIDTH] {
    let mut matrices = [Mat::zero(); WIDTH];
    for i in 0..D {
        for j in 0..D {
            let lanes = m[i][j].to_array();
            for l in 0..WIDTH {
                matrices[l][i][j] = lanes[l];
            }
        }
    }
    matrices
}

/// Every NaN is the same one: which of two a sum inherits is not specified.
pub(crate) fn bits<const D: usize>(m: &Mat<f64, D>) -> Vec<u64> {
    m.0.iter().flatten().map(|x| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }).collect()
}
