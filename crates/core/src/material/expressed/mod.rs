//! Energy densities that a scene defines by formulas.

mod measures;
mod parameters;
mod rest;

pub use parameters::{EnergyExpression, EnergyMistake};

use std::sync::Arc;

use super::barrier::{admissible, infinite_outside};
use super::spectrum::{InvariantDerivatives, Spectrum, out_of_plane};
use super::{Domain, Material, MaterialDescription, Model};
use crate::algebra::{IsotropicFunction, Mat, Vect};
use crate::scalar::Scalar;
use measures::{Compiled, Measures, Programs};

/// Elastic energy density given as a formula.
///
/// The formula `psi` [J/m^3] uses measures from this list, but not both principal stretches and
/// components:
///
/// ```text
/// I1, I2, I3, J     invariants of C = F^T F: tr C, (I1^2 - tr C^2)/2, det C; J = det F
/// l1, l2, l3        the principal stretches, with the sign of J on the last one; psi is symmetric in them
/// F11 .. F33        the deformation gradient; C11 .. C33 and E11 .. E33 of C and of E = (C - I)/2
/// I4, I6            |F a|^2 of the first and of the second fibre direction a
/// ```
///
/// In two dimensions `F33 = 1` (plane strain), so that `I1 = 3` in the reference configuration there too.
/// The stress is `P = 2 psi_I1 F + psi_I2 dI2/dF + psi_J cof F`, `P = U diag(psi_li) V^T` or
/// `P = sum psi_m dm/dF` over the components. First and second derivatives are those of the formula
/// itself, and isotropic energies (the first two lines) have the analytic eigensystem of the Hessian. The
/// formula is compiled once, to a program of a few registers that runs on packs of elements.
///
/// The domain is `J > 0` if the energy or its stress is not finite where `J <= 0`, else every `F`.
#[derive(Clone, Debug)]
pub struct ExpressedEnergy {
    compiled: Arc<Compiled>,
}

impl Model for ExpressedEnergy {
    type Parameters = EnergyExpression;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "An energy density of your own, written as a formula in the scene.",
        formula: "any psi of I1, I2, I3, J, or of the principal stretches l1, l2, l3, or of the components \
                  F11.., C11.., E11.. and the fibres' I4, I6",
        source: "the scene",
        domain: Domain::Everywhere,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    /// # Panics
    /// If the formula is invalid and was not [checked](super::Parameters::check).
    fn new(parameters: &EnergyExpression) -> Self {
        ExpressedEnergy { compiled: parameters.compiled().expect("parameters are checked before") }
    }
}

/// Formula of the principal stretches.
struct OfStretches<'p>(&'p Programs);

impl<const D: usize> IsotropicFunction<D> for OfStretches<'_> {
    #[inline(always)]
    fn in_stretches<S: Scalar>(&self, sigma: &Vect<S, D>) -> S {
        let mut psi = [S::zero()];
        self.0.energy.run(sigma, &mut psi);
        psi[0]
    }

    #[inline(always)]
    fn slopes<S: Scalar>(&self, sigma: &Vect<S, D>) -> Vect<S, D> {
        let mut slopes = [S::zero(); D];
        self.0.slopes.run(sigma, &mut slopes);
        slopes
    }

    #[inline(always)]
    fn curvatures<S: Scalar>(&self, sigma: &Vect<S, D>) -> Mat<S, D> {
        let mut curvatures = Mat::zero();
        self.0.curvatures.run(sigma, curvatures.0.as_flattened_mut());
        curvatures
    }
}

/// Returns 1 inside the domain and NaN outside.
#[inline(always)]
fn inside<S: Scalar>(domain: Domain, j: S) -> S {
    match domain {
        Domain::Everywhere => S::one(),
        Domain::PositiveJ => S::select(j.lt(S::splat(f64::MIN_POSITIVE)), S::splat(f64::NAN), S::one()),
    }
}

impl ExpressedEnergy {
    /// Returns `I1`, `I2` (0 if the formula does not contain it) and `J`.
    #[inline(always)]
    fn invariants<S: Scalar, const D: usize>(&self, f: &Mat<S, D>, cofactor: &Mat<S, D>, j: S) -> [S; 3] {
        let square = f.norm_squared();
        let second = match self.compiled.has_second {
            false => S::zero(),
            true if D == 2 => j.mul_add(j, square),
            true => cofactor.norm_squared(),
        };
        [square + S::splat(out_of_plane::<D>()), second, j]
    }

    /// Returns the `J` that the formula is evaluated at, NaN outside the domain.
    #[inline(always)]
    fn volume<S: Scalar>(&self, j: S) -> S {
        match self.compiled.domain {
            Domain::Everywhere => j,
            Domain::PositiveJ => admissible(j),
        }
    }
}

impl<const D: usize> Material<D> for ExpressedEnergy {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let cofactor = f.cofactor();
        let j = f.determinant_with(&cofactor);
        let psi = match &self.compiled.measures {
            Measures::Invariants(programs) => {
                let mut psi = [S::zero()];
                programs.energy.run(&self.invariants(f, &cofactor, j), &mut psi);
                psi[0]
            }
            Measures::Stretches(programs) => S::isotropic_value(&OfStretches(&programs[D - 2]), f),
            Measures::Components(programs) => {
                let mut psi = [S::zero()];
                programs[D - 2].energy.run(f.0.as_flattened(), &mut psi);
                psi[0]
            }
        };
        let square = f.norm_squared();
        let infinite = S::splat(f64::INFINITY);
        // Where the formula has no value, such as a logarithm beyond a limiting stretch, the energy is
        // infinite.
        let psi = S::select(psi.lt(infinite), psi, infinite * (square + S::one()));
        match self.compiled.domain {
            Domain::Everywhere => psi,
            Domain::PositiveJ => infinite_outside(j, square, psi),
        }
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        match &self.compiled.measures {
            Measures::Invariants(programs) => {
                let cofactor = f.cofactor();
                let j = self.volume(f.determinant_with(&cofactor));
                let mut slopes = [S::zero(); 3];
                programs.slopes.run(&self.invariants(f, &cofactor, j), &mut slopes);
                let [first, second, volume] = slopes;
                let first = first + first;
                if !self.compiled.has_second {
                    return f.scale_add(first, &cofactor.scale(volume));
                }
                let second = second + second;
                if D == 2 {
                    return f.scale_add(first + second, &cofactor.scale(second.mul_add(j, volume)));
                }
                // dI2/dF = 2 (I1 F - F F^T F)
                let bent = f.mul(&f.transpose_mul(f));
                let stretch = second.mul_add(f.norm_squared(), first);
                bent.scale_add(-second, &f.scale_add(stretch, &cofactor.scale(volume)))
            }
            Measures::Stretches(programs) => {
                let stress = S::isotropic_gradient(&OfStretches(&programs[D - 2]), f);
                stress.scale(inside(self.compiled.domain, f.determinant()))
            }
            Measures::Components(programs) => {
                let mut stress = Mat::zero();
                programs[D - 2].slopes.run(f.0.as_flattened(), stress.0.as_flattened_mut());
                stress.scale(inside(self.compiled.domain, f.determinant()))
            }
        }
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let j = self.volume(sigma.iter().product());
        match &self.compiled.measures {
            Measures::Invariants(programs) => {
                let diagonal = Mat::diagonal(sigma);
                let invariants = self.invariants(&diagonal, &diagonal.cofactor(), j);
                let mut all = [0.0; 9];
                programs.curvatures.run(&invariants, &mut all);
                let [i1, i2, j, i1_j, i2_j, j_j, i1_i1, i1_i2, i2_i2] = all;
                let derivatives = InvariantDerivatives { i1, i2, j, i1_j, i2_j, j_j };
                let mut spectrum = Spectrum::from_three_invariants(sigma, &derivatives);
                if self.compiled.bends {
                    let whole = invariants[0];
                    let slopes = sigma.map(|s| [2.0 * s, 2.0 * s * (whole - s * s)]);
                    for i in 0..D {
                        for k in 0..D {
                            let ([a, b], [c, d]) = (slopes[i], slopes[k]);
                            spectrum.scaling[i][k] += i1_i1 * a * c + i1_i2 * (a * d + b * c) + i2_i2 * b * d;
                        }
                    }
                }
                Some(spectrum)
            }
            Measures::Stretches(programs) => {
                let function = OfStretches(&programs[D - 2]);
                let inside = inside(self.compiled.domain, j);
                let slopes = IsotropicFunction::<D>::slopes(&function, sigma).map(|slope| inside * slope);
                Some(Spectrum::from_stretches(sigma, &slopes, &function.curvatures(sigma).scale(inside)))
            }
            Measures::Components(_) => None,
        }
    }

    fn domain(&self) -> Domain {
        self.compiled.domain
    }
}

#[cfg(test)]
mod tests;
