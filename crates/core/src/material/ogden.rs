use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::hencky::logarithms;
use super::parameters::{check_poisson, check_positive};
use super::{Domain, Lame, MaterialDescription, Model, ParameterError, Parameters, Stretches};
use crate::algebra::{IsotropicFunction, Mat, Vect};
use crate::scalar::Scalar;
use crate::value::{As, KeyRange, Pressure};

/// Ogden's elasticity of rubber, with any number of terms.
///
/// With the stretches at constant volume `s_i = J^(-1/3) sigma_i` (in 2D `sigma_3 = 1`) and the bulk modulus
/// `kappa`:
///
/// ```text
/// psi    = sum_p mu_p/alpha_p (s_1^alpha_p + s_2^alpha_p + s_3^alpha_p - 3) + kappa/2 (J - 1)^2   [J/m^3]
/// P      = U diag(psi_i) V^T                                                                      [Pa]
/// psi_i  = (sum_p mu_p (s_i^alpha_p - m_p) + kappa (J - 1) J) / sigma_i
/// m_p    = (s_1^alpha_p + s_2^alpha_p + s_3^alpha_p)/3
/// ```
///
/// For small strains `mu = 1/2 sum_p mu_p alpha_p`. One term with `alpha = 2` is the isochoric
/// neo-Hookean model; a second with `alpha = -2` makes it Mooney-Rivlin. The model is defined for `J > 0`
/// only.
///
/// Source: Ogden, "Large deformation isotropic elasticity: on the correlation of theory and experiment
/// for incompressible rubberlike solids", 1972; the split of shape and volume follows Holzapfel,
/// "Nonlinear solid mechanics", 2000.
#[derive(Clone, Debug, PartialEq)]
pub struct Ogden {
    terms: Vec<Term>,
    bulk: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Term {
    mu: f64,
    alpha: f64,
}

/// The terms of Ogden's series, with or without a Young's modulus that they are scaled to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OgdenTerms {
    /// Young's modulus E [Pa], positive. With it only the ratios between the `mu` count: they are scaled so
    /// that `E = (1 + nu) sum mu alpha`. Without it they are taken as they are.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Pressure>>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    pub young: Option<f64>,
    /// Poisson's ratio nu for small strains, above -1 and below 0.5; it sets the bulk modulus.
    #[schemars(transform = KeyRange::POISSON.in_schema())]
    pub poisson: f64,
    /// Weight of each term [Pa]; the sum of `mu alpha` must be positive.
    #[serde(with = "As::<Vec<Pressure>>")]
    #[schemars(length(min = 1))]
    pub mu: Vec<f64>,
    /// Exponent of each term, not zero; as many as there are `mu`.
    #[schemars(length(min = 1))]
    pub alpha: Vec<f64>,
}

impl OgdenTerms {
    /// Returns the shear modulus `1/2 sum mu alpha` of the terms before scaling.
    fn given_shear(&self) -> f64 {
        0.5 * self.mu.iter().zip(&self.alpha).map(|(mu, alpha)| mu * alpha).sum::<f64>()
    }

    fn elasticity(&self) -> Lame {
        let young = self.young.unwrap_or_else(|| 2.0 * (1.0 + self.poisson) * self.given_shear());
        Lame::new(young, self.poisson)
    }
}

impl Parameters for OgdenTerms {
    fn check(&self) -> Result<(), ParameterError> {
        if let Some(young) = self.young {
            check_positive("young", young)?;
        }
        check_poisson(self.poisson)?;
        if self.mu.is_empty() {
            return Err(ParameterError::new("mu", 0.0, "is the number of terms; one is needed at least"));
        }
        if self.alpha.len() != self.mu.len() {
            let problem = "is the number of exponents; there must be one for each `mu`";
            return Err(ParameterError::new("alpha", self.alpha.len() as f64, problem));
        }
        for (field, values) in [("mu", &self.mu), ("alpha", &self.alpha)] {
            if let Some(index) = values.iter().position(|value| !value.is_finite() || *value == 0.0) {
                let problem = "must be a finite number that is not zero; leave the term out";
                return Err(ParameterError::new(field, values[index], problem).at(index));
            }
        }
        let shear = self.given_shear();
        if shear.is_finite() && shear > 0.0 {
            return Ok(());
        }
        let problem = "is the shear modulus 1/2 sum mu alpha; it must be positive and finite";
        Err(ParameterError::new("mu", shear, problem))
    }

    fn lame(&self) -> Option<Lame> {
        Some(self.elasticity())
    }

    /// Returns the exponents and proportions of the moduli that Ogden found for Treloar's rubber.
    fn example() -> Self {
        OgdenTerms {
            young: Some(1e6),
            poisson: 0.3,
            mu: vec![0.63, 0.0012, -0.01],
            alpha: vec![1.3, 5.0, -2.0],
        }
    }
}

impl Model for Ogden {
    type Parameters = OgdenTerms;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Ogden: rubber up to large stretches, any number of terms, forbids inversion.",
        formula: "sum_p mu_p/alpha_p (sum_i (J^(-1/3) sigma_i)^alpha_p - 3) + kappa/2 (J - 1)^2, J = det F, \
                  mu = 1/2 sum mu_p alpha_p",
        source: "Ogden 1972; shape and volume apart as in Holzapfel 2000",
        domain: Domain::PositiveJ,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &OgdenTerms) -> Self {
        let lame = parameters.elasticity();
        let scale = if parameters.young.is_some() { lame.mu / parameters.given_shear() } else { 1.0 };
        let terms = parameters.mu.iter().zip(&parameters.alpha);
        let terms = terms.map(|(mu, &alpha)| Term { mu: scale * mu, alpha }).collect();
        Ogden { terms, bulk: lame.bulk() }
    }
}

/// Returns `s_i^alpha` and `s_1^alpha + s_2^alpha + s_3^alpha`, given `ln sigma_i` and `-1/3 ln J`.
#[inline(always)]
fn powers<S: Scalar, const D: usize>(ln: &Vect<S, D>, minus_third: S, alpha: f64) -> (Vect<S, D>, S) {
    let alpha = S::splat(alpha);
    let mut power = *ln;
    let mut sum = S::zero();
    for i in 0..D {
        power[i] = (alpha * (ln[i] + minus_third)).exp();
        sum += power[i];
    }
    if D == 2 {
        sum += (alpha * minus_third).exp();
    }
    (power, sum)
}

#[inline(always)]
fn product<S: Scalar, const D: usize>(sigma: &Vect<S, D>) -> S {
    let mut j = sigma[0];
    for i in 1..D {
        j *= sigma[i];
    }
    j
}

impl<const D: usize> IsotropicFunction<D> for Ogden {
    #[inline(always)]
    fn in_stretches<S: Scalar>(&self, sigma: &Vect<S, D>) -> S {
        let (ln, volume) = logarithms(sigma);
        let minus_third = volume * S::splat(-1.0 / 3.0);
        let dilation = product(sigma) - S::one();
        let mut psi = S::splat(0.5 * self.bulk) * dilation * dilation;
        for term in &self.terms {
            let (_, sum) = powers(&ln, minus_third, term.alpha);
            psi = S::splat(term.mu / term.alpha).mul_add(sum - S::splat(3.0), psi);
        }
        // Only the last stretch can be negative.
        S::select(sigma[D - 1].lt(S::splat(f64::MIN_POSITIVE)), S::splat(f64::INFINITY), psi)
    }

    #[inline(always)]
    fn slopes<S: Scalar>(&self, sigma: &Vect<S, D>) -> Vect<S, D> {
        let (ln, volume) = logarithms(sigma);
        let minus_third = volume * S::splat(-1.0 / 3.0);
        let j = product(sigma);
        let mut slopes = [S::splat(self.bulk) * (j - S::one()) * j; D];
        for term in &self.terms {
            let (power, sum) = powers(&ln, minus_third, term.alpha);
            for i in 0..D {
                slopes[i] = S::splat(term.mu).mul_add(sum.mul_add(S::splat(-1.0 / 3.0), power[i]), slopes[i]);
            }
        }
        for i in 0..D {
            slopes[i] = slopes[i] / sigma[i];
        }
        slopes
    }

    /// Returns second derivatives from `d s_i^alpha / d ln sigma_j = alpha s_i^alpha (delta_ij - 1/3)`.
    #[inline(always)]
    fn curvatures<S: Scalar>(&self, sigma: &Vect<S, D>) -> Mat<S, D> {
        let (ln, volume) = logarithms(sigma);
        let minus_third = volume * S::splat(-1.0 / 3.0);
        let j = product(sigma);
        let pressure = S::splat(self.bulk) * (j - S::one()) * j;
        let stiffening = S::splat(self.bulk) * (j + j - S::one()) * j;
        // sigma_i psi_i, and its derivative with respect to ln sigma_k.
        let mut tension = [pressure; D];
        let mut stiffness = Mat([[stiffening; D]; D]);
        for term in &self.terms {
            let (power, sum) = powers(&ln, minus_third, term.alpha);
            let weight = S::splat(term.mu * term.alpha);
            for i in 0..D {
                tension[i] =
                    S::splat(term.mu).mul_add(sum.mul_add(S::splat(-1.0 / 3.0), power[i]), tension[i]);
                for k in 0..D {
                    let both = sum.mul_add(S::splat(1.0 / 9.0), (power[i] + power[k]) * S::splat(-1.0 / 3.0));
                    stiffness[i][k] = weight.mul_add(both, stiffness[i][k]);
                }
                stiffness[i][i] = weight.mul_add(power[i], stiffness[i][i]);
            }
        }
        let mut curvatures = stiffness;
        for i in 0..D {
            curvatures[i][i] = stiffness[i][i] - tension[i];
            for k in 0..D {
                curvatures[i][k] = curvatures[i][k] / (sigma[i] * sigma[k]);
            }
        }
        curvatures
    }
}

impl<const D: usize> Stretches<D> for Ogden {
    fn domain(&self) -> Domain {
        Self::ABOUT.domain
    }
}
