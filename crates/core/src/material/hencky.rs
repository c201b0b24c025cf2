use super::{Domain, Isotropic, Lame, MaterialDescription, Model, Stretches};
use crate::algebra::{IsotropicFunction, Mat, Vect};
use crate::scalar::Scalar;

/// Hencky's elasticity: linear elasticity in the logarithmic strain.
///
/// With the principal stretches `sigma_i` of `F = U diag(sigma) V^T` and `J = det F`:
///
/// ```text
/// psi = mu sum_i (ln sigma_i)^2 + lambda/2 (ln J)^2                         [J/m^3]
/// P   = U diag((2 mu ln sigma_i + lambda ln J) / sigma_i) V^T               [Pa]
/// ```
///
/// The model is defined for `J > 0` only. It is accurate to moderate strains. It is not convex: in tension
/// the force has a maximum, at `sigma = e` for Poisson's ratio 0.
///
/// Source: Hencky, "Ueber die Form des Elastizitaetsgesetzes bei ideal elastischen Stoffen", 1928; Xiao and
/// Chen, "Hencky's elasticity model and linear stress-strain relations in isotropic finite hyperelasticity",
/// 2002.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hencky {
    lame: Lame,
}

impl Model for Hencky {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Hencky: linear elasticity in the logarithmic strain, forbids inversion.",
        formula: "mu sum (ln sigma_i)^2 + lambda/2 (ln J)^2, sigma_i principal stretches, J = det F",
        source: "Hencky 1928; Xiao and Chen 2002",
        domain: Domain::PositiveJ,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        Hencky { lame: parameters.lame() }
    }
}

/// Returns `ln sigma_i` and their sum `ln J`; NaN if a stretch is negative.
#[inline(always)]
pub(super) fn logarithms<S: Scalar, const D: usize>(sigma: &Vect<S, D>) -> (Vect<S, D>, S) {
    let mut ln = *sigma;
    let mut sum = S::zero();
    for i in 0..D {
        ln[i] = sigma[i].ln();
        sum += ln[i];
    }
    (ln, sum)
}

impl<const D: usize> IsotropicFunction<D> for Hencky {
    #[inline(always)]
    fn in_stretches<S: Scalar>(&self, sigma: &Vect<S, D>) -> S {
        let (ln, volume) = logarithms(sigma);
        let mut squares = S::zero();
        for i in 0..D {
            squares = ln[i].mul_add(ln[i], squares);
        }
        let inside =
            S::splat(self.lame.mu).mul_add(squares, S::splat(0.5 * self.lame.lambda) * volume * volume);
        // Only the last stretch can be negative.
        S::select(sigma[D - 1].lt(S::splat(f64::MIN_POSITIVE)), S::splat(f64::INFINITY), inside)
    }

    #[inline(always)]
    fn slopes<S: Scalar>(&self, sigma: &Vect<S, D>) -> Vect<S, D> {
        let (ln, volume) = logarithms(sigma);
        let pressure = S::splat(self.lame.lambda) * volume;
        let mut slopes = *sigma;
        for i in 0..D {
            slopes[i] = S::splat(2.0 * self.lame.mu).mul_add(ln[i], pressure) / sigma[i];
        }
        slopes
    }

    #[inline(always)]
    fn curvatures<S: Scalar>(&self, sigma: &Vect<S, D>) -> Mat<S, D> {
        let (ln, volume) = logarithms(sigma);
        let Lame { lambda, mu } = self.lame;
        let mut curvatures = Mat::zero();
        for i in 0..D {
            let inverse = S::one() / sigma[i];
            for j in 0..D {
                curvatures[i][j] = S::splat(lambda) * inverse / sigma[j];
            }
            // 2 mu (1 - ln sigma_i) - lambda ln J + lambda
            let tension = S::splat(2.0 * mu).mul_add(S::one() - ln[i], -(S::splat(lambda) * volume));
            curvatures[i][i] = (tension + S::splat(lambda)) * inverse * inverse;
        }
        curvatures
    }
}

impl<const D: usize> Stretches<D> for Hencky {
    fn domain(&self) -> Domain {
        Self::ABOUT.domain
    }
}
