//! Energy of the hourglass modes: enhanced strains of the parallelepiped, condensed in closed form.
//!
//! With the gradients `g_l` of the cell's coordinates, the rows of `J^-1` at the centre, the amplitudes
//! `q` and the tangent `C` of the material in the reference configuration,
//!
//! ```text
//! E = sum_l V/3 W(A_l) + sum_l V/9 W'(q_012 g_l^T),   A_l = sum_(k != l) q_kl g_k^T
//! W(A)  = min over c of 1/2 (A - c g_l^T) : C : (A - c g_l^T)
//! W'(A) = min over s of 1/2 (A - s I) : C : (A - s I)
//! ```
//!
//! A strain `xi_l A_l` has no traction across `l`, as in bending, and a bilinear strain has no pressure.
//! These are the enhanced strains of Q1/E12 on a parallelepiped, where their integrals are exact: Simo,
//! Armero, Taylor 1993, "Improved versions of assumed enhanced strain tri-linear elements for 3D finite
//! deformation problems", Comput. Meth. Appl. Mech. Eng. 110, 359; Belytschko, Bindeman 1993, "Assumed
//! strain stabilization of the eight node hexahedral element", ibid. 105, 225; Puso 2000, "A highly
//! efficient enhanced assumed strain physically stabilized hexahedral element", Int. J. Numer. Meth. Eng.
//! 49, 1029. Derivatives by `C` and `g` need none of `c` and `s`, at which the energy is stationary.

use super::rest::{Amplitudes, MOST_MODES, mode_of_pair, modes, outer_sum};
use crate::algebra::{Dual, Mat};
use crate::material::{MaterialSpec, Tangent};
use crate::scalar::Scalar;

/// Transformation of hourglass amplitudes as a cell rotates and stretches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PullBack {
    /// None: for materials that are linear in `F`.
    None,
    /// `cof(F)^T q`, which is `det(F) F^-1 q` and exists for inverted cells, too.
    Cofactor,
}

impl PullBack {
    /// Returns the transformation that suits a material.
    pub fn of(material: &MaterialSpec) -> Self {
        match material {
            MaterialSpec::Linear(_) | MaterialSpec::Dirichlet(_) | MaterialSpec::DisplacementGradient(_) => {
                PullBack::None
            }
            _ => PullBack::Cofactor,
        }
    }

    /// Returns the amplitudes in reference axes.
    #[inline(always)]
    pub(crate) fn pulled<S: Scalar, const D: usize>(
        self,
        cofactor: &Mat<S, D>,
        q: &Amplitudes<S, D>,
    ) -> Amplitudes<S, D> {
        match self {
            PullBack::None => *q,
            PullBack::Cofactor => by_each::<S, D>(&cofactor.transpose(), q),
        }
    }

    /// Returns the derivatives by `F` and `q` of a function with the derivatives `y` by the amplitudes in
    /// reference axes.
    #[inline(always)]
    pub(crate) fn pushed<S: Scalar, const D: usize>(
        self,
        (f, cofactor): (&Mat<S, D>, &Mat<S, D>),
        q: &Amplitudes<S, D>,
        y: &Amplitudes<S, D>,
    ) -> (Mat<S, D>, Amplitudes<S, D>) {
        match self {
            PullBack::None => (Mat::zero(), *y),
            PullBack::Cofactor => (f.cofactor_derivative(&outer_sum(q, y)), by_each::<S, D>(cofactor, y)),
        }
    }
}

/// Returns `T q_h` of every mode.
#[inline(always)]
pub(crate) fn by_each<S: Scalar, const D: usize>(t: &Mat<S, D>, q: &Amplitudes<S, D>) -> Amplitudes<S, D> {
    let mut product = [[S::zero(); D]; MOST_MODES];
    for h in 0..modes(D) {
        product[h] = t.mul_vec(&q[h]);
    }
    product
}

/// Returns the sums of the amplitudes of every mode.
#[inline(always)]
pub(super) fn sum_of<S: Scalar, const D: usize>(
    a: &Amplitudes<S, D>,
    b: &Amplitudes<S, D>,
) -> Amplitudes<S, D> {
    let mut sum = *a;
    for h in 0..modes(D) {
        for i in 0..D {
            sum[h][i] += b[h][i];
        }
    }
    sum
}

/// Returns the amplitude rates `L^T q + F^T q'` on which viscosity acts, with the rates `L` and `q'`.
#[inline(always)]
pub(crate) fn amplitude_rates<S: Scalar, const D: usize>(
    (f, q): (&Mat<S, D>, &Amplitudes<S, D>),
    (l, rates): (&Mat<S, D>, &Amplitudes<S, D>),
) -> Amplitudes<S, D> {
    sum_of(&by_each::<S, D>(&l.transpose(), q), &by_each::<S, D>(&f.transpose(), rates))
}

/// Least determinant of `n . C . n`, relative to a power of its trace, that is more than rounding.
const RESISTS_SHEAR: f64 = 1e-13;

/// Reference moduli `C` [Pa] over any scalar.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestModuli<S, const D: usize>([[Mat<S, D>; D]; D]);

impl<S: Scalar, const D: usize> RestModuli<S, D> {
    pub(crate) fn new(tangent: &Tangent<D>) -> Self {
        RestModuli(tangent.0.map(|row| row.map(|entry| Mat::splat(&entry))))
    }

    fn apply(&self, a: &Mat<S, D>) -> Mat<S, D> {
        let mut stress = Mat::zero();
        for i in 0..D {
            for j in 0..D {
                stress[i][j] = self.0[i][j].dot(a);
            }
        }
        stress
    }

    /// Returns `A - c n^T` without traction across `n`, and `c`. If nothing resists shear, as in a fluid,
    /// only the pressure across `n` vanishes; if nothing resists that either, the result is `A`.
    fn without_traction(&self, a: &Mat<S, D>, n: &[S; D]) -> (Mat<S, D>, [S; D]) {
        let mut acoustic = Mat::zero();
        for i in 0..D {
            for j in 0..D {
                let along = self.0[i][j].mul_vec(n);
                for k in 0..D {
                    acoustic[i][k] += n[j] * along[k];
                }
            }
        }
        let traction = self.apply(a).mul_vec(n);
        let (mut pressure, mut normal) = (S::zero(), S::zero());
        let along = acoustic.mul_vec(n);
        for i in 0..D {
            pressure += n[i] * traction[i];
            normal += n[i] * along[i];
        }
        let across = S::select(S::zero().lt(normal), pressure / normal, S::zero());
        let free = acoustic.inverse().mul_vec(&traction);
        let trace = acoustic.trace();
        let least = S::splat(RESISTS_SHEAR) * if D == 3 { trace * trace * trace } else { trace * trace };
        let resists = least.lt(acoustic.determinant());
        let (mut strain, mut c) = (*a, [S::zero(); D]);
        for i in 0..D {
            c[i] = S::select(resists, free[i], across * n[i]);
            for j in 0..D {
                strain[i][j] -= c[i] * n[j];
            }
        }
        (strain, c)
    }

    /// Returns `A - s I` without pressure; `A` if nothing resists a change of volume.
    fn without_pressure(&self, a: &Mat<S, D>) -> Mat<S, D> {
        let of_volume = self.apply(&Mat::identity());
        let bulk = of_volume.trace();
        let s = S::select(S::zero().lt(bulk), self.apply(a).trace() / bulk, S::zero());
        *a - Mat::scalar(s)
    }
}

impl<S: Scalar, const D: usize> RestModuli<Dual<S>, D> {
    /// Returns moduli that change with a parameter.
    pub(crate) fn changing(tangent: &Tangent<D>, change: &Tangent<D>) -> Self {
        let mut moduli = Self::new(tangent);
        for i in 0..D {
            for j in 0..D {
                moduli.0[i][j] = Dual::along(&Mat::splat(&tangent.0[i][j]), &Mat::splat(&change.0[i][j]));
            }
        }
        moduli
    }
}

/// Returns `A_l`.
fn bending<S: Scalar, const D: usize>(l: usize, inverse: &Mat<S, D>, q: &Amplitudes<S, D>) -> Mat<S, D> {
    let mut a = Mat::zero();
    for k in 0..D {
        if k != l {
            add_outer(&q[mode_of_pair(k, l)], &inverse[k], &mut a);
        }
    }
    a
}

fn add_outer<S: Scalar, const D: usize>(u: &[S; D], v: &[S; D], sum: &mut Mat<S, D>) {
    for i in 0..D {
        for k in 0..D {
            sum[i][k] += u[i] * v[k];
        }
    }
}

fn add<S: Scalar, const D: usize>(sum: &mut [S; D], factor: S, v: &[S; D]) {
    for i in 0..D {
        sum[i] += factor * v[i];
    }
}

/// Derivatives of the energy of the hourglass modes.
pub(crate) struct HourglassRates<S, const D: usize> {
    pub(crate) by_amplitudes: Amplitudes<S, D>,
    /// Derivative by `J^-1`.
    pub(crate) by_inverse: Mat<S, D>,
    pub(crate) by_volume: S,
}

/// Returns the derivatives of the energy of the hourglass modes with the amplitudes `q` in reference
/// axes.
pub(crate) fn hourglass<S: Scalar, const D: usize>(
    (volume, inverse): (S, &Mat<S, D>),
    moduli: &RestModuli<S, D>,
    q: &Amplitudes<S, D>,
) -> HourglassRates<S, D> {
    let mut by_amplitudes = [[S::zero(); D]; MOST_MODES];
    let mut by_inverse = Mat::zero();
    let (third, ninth) = (volume * S::splat(1.0 / 3.0), volume * S::splat(1.0 / 9.0));
    for l in 0..D {
        // Bending: W(A_l), with the strain at the minimum over c.
        let (strain, c) = moduli.without_traction(&bending(l, inverse, q), &inverse[l]);
        let stress = moduli.apply(&strain).scale(third);
        let transposed = stress.transpose();
        for k in 0..D {
            if k != l {
                let mode = mode_of_pair(k, l);
                add(&mut by_amplitudes[mode], S::one(), &stress.mul_vec(&inverse[k]));
                add(&mut by_inverse[k], S::one(), &transposed.mul_vec(&q[mode]));
            }
        }
        add(&mut by_inverse[l], -S::one(), &transposed.mul_vec(&c));
        // Bilinear strain of the mode xi_0 xi_1 xi_2: W'.
        if D == 3 {
            let mut a = Mat::zero();
            add_outer(&q[3], &inverse[l], &mut a);
            let stress = moduli.apply(&moduli.without_pressure(&a)).scale(ninth);
            add(&mut by_amplitudes[3], S::one(), &stress.mul_vec(&inverse[l]));
            add(&mut by_inverse[l], S::one(), &stress.transpose().mul_vec(&q[3]));
        }
    }
    // The energy is quadratic in q and linear in V.
    let mut work = S::zero();
    for h in 0..modes(D) {
        for i in 0..D {
            work += by_amplitudes[h][i] * q[h][i];
        }
    }
    HourglassRates { by_amplitudes, by_inverse, by_volume: S::splat(0.5) * work / volume }
}

/// Returns the displacement gradient of the hourglass modes at `xi` in a cell, with its enhanced strains.
pub(super) fn gradient_at<const D: usize>(
    inverse: &Mat<f64, D>,
    moduli: &RestModuli<f64, D>,
    q: &Amplitudes<f64, D>,
    xi: &[f64; D],
) -> Mat<f64, D> {
    let mut gradient = Mat::zero();
    for l in 0..D {
        let (strain, _) = moduli.without_traction(&bending(l, inverse, q), &inverse[l]);
        gradient += strain.scale(xi[l]);
        if D == 3 {
            let mut a = Mat::zero();
            add_outer(&q[3], &inverse[l], &mut a);
            let others: f64 = (0..D).filter(|k| *k != l).map(|k| xi[k]).product();
            gradient += moduli.without_pressure(&a).scale(others);
        }
    }
    gradient
}

/// Maximum number of entries of the stiffness of the hourglass modes.
pub(crate) const MOST_STIFFNESS: usize = 51;

/// Ranges of the amplitudes of modes, in `d` dimensions, that share no stiffness with the others.
#[inline(always)]
const fn coupled(d: usize) -> &'static [(usize, usize)] {
    if d == 2 { &[(0, 2)] } else { &[(0, 9), (9, 12)] }
}

/// Number of entries of the stiffness: those of the lower triangles of its blocks.
#[inline(always)]
pub(crate) const fn stiffness_entries(d: usize) -> usize {
    if d == 2 { 3 } else { MOST_STIFFNESS }
}

/// Returns the stiffness `K` of the hourglass modes, whose energy is `1/2 q . K q`, as the lower
/// triangles of its blocks, row by row.
pub(crate) fn stiffness<S: Scalar, const D: usize>(
    rest: (S, &Mat<S, D>),
    moduli: &RestModuli<S, D>,
) -> [S; MOST_STIFFNESS] {
    let mut entries = [S::zero(); MOST_STIFFNESS];
    let mut entry = 0;
    for (from, to) in coupled(D) {
        for i in *from..*to {
            let mut unit = [[S::zero(); D]; MOST_MODES];
            unit.as_flattened_mut()[i] = S::one();
            let row = hourglass(rest, moduli, &unit).by_amplitudes;
            for j in *from..=i {
                entries[entry] = row.as_flattened()[j];
                entry += 1;
            }
        }
    }
    entries
}

/// Returns `K q`.
#[inline(always)]
pub(crate) fn times<S: Scalar, const D: usize>(
    stiffness: &[S; MOST_STIFFNESS],
    q: &Amplitudes<S, D>,
) -> Amplitudes<S, D> {
    let mut product = [[S::zero(); D]; MOST_MODES];
    let (out, q) = (product.as_flattened_mut(), q.as_flattened());
    let mut entry = 0;
    for (from, to) in coupled(D) {
        for i in *from..*to {
            let mut sum = out[i];
            for j in *from..i {
                let k = stiffness[entry];
                sum = k.mul_add(q[j], sum);
                out[j] = k.mul_add(q[i], out[j]);
                entry += 1;
            }
            out[i] = stiffness[entry].mul_add(q[i], sum);
            entry += 1;
        }
    }
    product
}

/// Returns `a . b`.
#[inline(always)]
pub(crate) fn dot<S: Scalar, const D: usize>(a: &Amplitudes<S, D>, b: &Amplitudes<S, D>) -> S {
    let mut sum = S::zero();
    for h in 0..modes(D) {
        for i in 0..D {
            sum = a[h][i].mul_add(b[h][i], sum);
        }
    }
    sum
}
