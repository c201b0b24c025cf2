//! Functions that the kernels share: separations and powers of the softened distance, on lanes.

use crate::lanes::{Lanes, WIDTH};

/// `WIDTH` vectors, `v[component][lane]`.
pub(super) type Block<const D: usize> = [[f64; WIDTH]; D];

/// Positions of padding lanes, in every component [m]: distinct, and far away from all particles. Padding
/// particles have mass zero and finite pair terms, so that they contribute nothing without a comparison
/// in any inner loop.
pub(super) const FAR: [f64; WIDTH] = [1e100, 2e100, 3e100, 4e100, 5e100, 6e100, 7e100, 8e100];

/// Number of targets whose sums stay in registers during the loop over packs of sources.
pub(super) const TARGETS: usize = 4;

/// True if target `t` of a round computes its inverse roots by Newton's method, the others by square root
/// and division. The divider works in parallel with the multipliers: one of four by Newton's method keeps
/// both busy, and is a fifth faster than either method alone (two of four: equal within 3 %). Constant
/// after unrolling.
#[inline(always)]
pub(super) const fn by_newton(t: usize) -> bool {
    t.is_multiple_of(TARGETS)
}

#[inline(always)]
pub(super) fn load<L: Lanes, const N: usize>(block: &[[f64; WIDTH]; N]) -> [L; N] {
    let mut v = [L::zero(); N];
    for c in 0..N {
        v[c] = L::load(&block[c]);
    }
    v
}

/// Broadcasts a vector to every lane.
#[inline(always)]
pub(super) fn splat<L: Lanes, const D: usize>(vector: &[f64; D]) -> [L; D] {
    let mut v = [L::zero(); D];
    for c in 0..D {
        v[c] = L::splat(vector[c]);
    }
    v
}

/// Returns one lane of a block as a vector.
#[inline(always)]
pub(super) fn lane_of<const D: usize>(block: &Block<D>, lane: usize) -> [f64; D] {
    let mut v = [0.0; D];
    for c in 0..D {
        v[c] = block[c][lane];
    }
    v
}

/// Returns `a - b`.
#[inline(always)]
pub(super) fn difference<L: Lanes, const D: usize>(a: &[L; D], b: &[L; D]) -> [L; D] {
    let mut d = *a;
    for c in 0..D {
        d[c] -= b[c];
    }
    d
}

/// Returns `a . b + start`.
#[inline(always)]
pub(super) fn dot<L: Lanes, const D: usize>(a: &[L; D], b: &[L; D], start: L) -> L {
    let mut sum = start;
    for c in 0..D {
        sum = a[c].mul_add(b[c], sum);
    }
    sum
}

/// Returns `1 / sqrt(r2)` to a relative error below 1e-12, without the divider, before the correction
/// that the callers add. The seed comes from the bits of `r2`. One step follows, whose polynomial in
/// `e = 1 - r2 q^2` is the best of its degree in relative error for the seed's `e` in [-0.0692, 0.0676]
/// (largest error 7.5e-7).
#[inline(always)]
fn inverse_root_start<L: Lanes>(r2: L) -> L {
    let q = r2.inverse_sqrt_seed();
    let e = (q * q).mul_add(-r2, L::one());
    let p = L::splat(0.313_054_250_229_903_6).mul_add(e, L::splat(0.376_279_266_666_771_53));
    q * p.mul_add(e, L::splat(0.500_000_423_426_05)).mul_add(e, L::splat(0.999_999_253_325_241_8))
}

/// Returns `r2^(-1/2)`, to two units in the last place by either method; NaN or infinite at zero.
#[inline(always)]
pub(super) fn inverse_root<L: Lanes>(r2: L, newton: bool) -> L {
    if !newton {
        return L::one() / r2.sqrt();
    }
    let q = inverse_root_start(r2);
    let e = (q * q).mul_add(-r2, L::one());
    // (1 - e)^(-1/2) = 1 + e/2 + 3/8 e^2 + O(e^3), with e below 2e-6.
    (q * e).mul_add(L::splat(0.375).mul_add(e, L::splat(0.5)), q)
}

/// Returns `r2^(-3/2)`, to three units in the last place by either method; NaN or infinite at zero.
#[inline(always)]
pub(super) fn inverse_cube<L: Lanes>(r2: L, newton: bool) -> L {
    if !newton {
        return L::one() / (r2 * r2.sqrt());
    }
    let q = inverse_root_start(r2);
    let q2 = q * q;
    let e = q2.mul_add(-r2, L::one());
    let cube = q2 * q;
    // (1 - e)^(-3/2) = 1 + 3/2 e + 15/8 e^2 + O(e^3).
    (cube * e).mul_add(L::splat(1.875).mul_add(e, L::splat(1.5)), cube)
}

/// Returns a pair's scalar `s` and vector `v`: `m_j s v` is the contribution of the source to its target,
/// without `G` and the mass of the target.
///
/// The values are `s = r^-3` and `v = d`, the separation; for the derivative along a direction,
/// `v = dp - 3 (d . dp) / r^2 d` with the difference `dp` of the directions.
#[inline(always)]
pub(super) fn interaction<L: Lanes, const D: usize, const DERIVATIVE: bool>(
    target: &[[L; D]; 2],
    source: &[[L; D]; 2],
    softening2: L,
    newton: bool,
) -> (L, [L; D]) {
    let mut v = difference(&target[0], &source[0]);
    let r2 = dot(&v, &v, softening2);
    if !DERIVATIVE {
        return (inverse_cube(r2, newton), v);
    }
    let q = inverse_root(r2, newton);
    let q2 = q * q;
    let dp = difference(&target[1], &source[1]);
    let k = L::splat(-3.0) * q2 * dot(&v, &dp, L::zero());
    for c in 0..D {
        v[c] = k.mul_add(v[c], dp[c]);
    }
    (q2 * q, v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Kernel, dispatch};

    /// Computes `(inverse_root, inverse_cube)` by Newton's method.
    struct Powers<'a>(&'a [f64; WIDTH]);
    impl Kernel for Powers<'_> {
        type Output = [[f64; WIDTH]; 2];
        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let r2 = L::load(self.0);
            [inverse_root(r2, true).to_array(), inverse_cube(r2, true).to_array()]
        }
    }

    #[test]
    fn the_two_ways_agree_over_the_whole_range() {
        let (mut root, mut cube) = (0.0f64, 0.0f64);
        for exponent in -300..=300 {
            for i in 0..40 {
                let scale = 2f64.powi(exponent * 2 / 3);
                let r2: [f64; WIDTH] = std::array::from_fn(|l| scale * (1.0 + (8 * i + l) as f64 / 107.0));
                let [by_newton, cubes] = dispatch(Powers(&r2));
                for l in 0..WIDTH {
                    root = root.max((by_newton[l] * r2[l].sqrt() - 1.0).abs());
                    cube = cube.max((cubes[l] * (r2[l] * r2[l].sqrt()) - 1.0).abs());
                }
            }
        }
        assert!(root < 5e-16 && cube < 9e-16, "{root:e} {cube:e}");
    }

    #[test]
    fn coincidence_is_never_a_finite_force() {
        let [root, cube] = dispatch(Powers(&[0.0; WIDTH]));
        for l in 0..WIDTH {
            assert!(!cube[l].is_finite(), "{}", cube[l]);
            // Potential and derivative are computed from this root.
            assert!(!(root[l] * root[l] * root[l]).is_finite(), "{}", root[l]);
        }
    }

    #[test]
    fn filling_lanes_do_nothing() {
        let r2 = FAR.map(|far| 3.0 * far * far);
        let [root, cube] = dispatch(Powers(&r2));
        for l in 0..WIDTH {
            let by_division = 1.0 / (r2[l] * r2[l].sqrt());
            for x in [root[l], cube[l], by_division] {
                assert!(x > 0.0 && 0.0 * x * FAR[l] == 0.0, "{x:e}");
            }
        }
    }
}
