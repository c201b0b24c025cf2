//! Stresses predicted by a linearisation: see
//! [`predicted_hessians`](crate::energy::PredictedStresses::predicted_hessians).
//!
//! The stress is split into a pressure, which turns with `cof F`, and a remainder, which turns with `F`.
//! With `q = P : F / D`,
//!
//! ```text
//! P = F S + q/J cof F,   S = F^-1 (P - q/J cof F)
//! ```

use super::block::{BlockMaterial, stresses};
use crate::algebra::Mat;
use crate::material::{Psd, Stress, Tangent};

/// Ratio of bulk to shear modulus from which on pressures are worth a prediction; in 3D it belongs to a
/// Poisson's ratio of 0.452.
///
/// Below it the other stresses have errors of that size, and one more matrix costs more than the
/// prediction saves.
const STIFF: f64 = 10.0;

/// True if the initial bulk modulus is much larger than the shear modulus.
pub(super) fn is_nearly_incompressible<const D: usize>(material: &dyn BlockMaterial<D>) -> bool {
    let tangent = material.tangent(&Mat::identity(), Psd::Exact);
    let bulk = tangent.apply(&Mat::identity()).trace() / (D * D) as f64;
    bulk > STIFF * tangent.0[0][1][0][1]
}

/// Parts of a stress, or their change along a direction.
#[derive(Clone, Copy)]
struct StressParts<const D: usize> {
    /// `S` [Pa].
    turning: Mat<f64, D>,
    /// `q` [Pa].
    pressure: f64,
}

/// Deformation gradient and stress, or their changes along a direction.
#[derive(Clone, Copy)]
struct Stressed<const D: usize> {
    f: Mat<f64, D>,
    p: Mat<f64, D>,
}

impl<const D: usize> Stressed<D> {
    fn parts(&self) -> StressParts<D> {
        let pressure = self.p.dot(&self.f) / D as f64;
        let rest = self.p - self.f.cofactor().scale(pressure / self.f.determinant());
        StressParts { turning: self.f.inverse().mul(&rest), pressure }
    }

    /// Returns the change of the parts along `d`, from `d(cof F / J) = d(F^-T) = -F^-T dF^T F^-T`.
    fn change(&self, d: &Stressed<D>) -> StressParts<D> {
        let inverse = self.f.inverse();
        let StressParts { turning, pressure } = self.parts();
        let dq = (d.p.dot(&self.f) + self.p.dot(&d.f)) / D as f64;
        let turned = inverse.mul(&d.f).mul(&inverse).transpose();
        let change = d.p - inverse.transpose().scale(dq) + turned.scale(pressure) - d.f.mul(&turning);
        StressParts { turning: inverse.mul(&change), pressure: dq }
    }
}

/// Replaces the turning stresses of an exact tangent at `to` by those that the linearisation at `from`
/// predicts. Does nothing if one of the volumes is not positive.
pub(super) fn add_excess<const D: usize>(
    material: &dyn BlockMaterial<D>,
    how: Stress,
    [from, to]: [&Mat<f64, D>; 2],
    tangent: &mut Tangent<D>,
) {
    let (j, j_to) = (from.determinant(), to.determinant());
    if j.min(j_to) <= 0.0 {
        return;
    }
    let p = stresses(material, how, &[*from, *to]);
    let before = Stressed { f: *from, p: p.lane(0) };
    let df = *to - *from;
    let dp = material.tangent(from, Psd::Exact).apply(&df);
    let (old, new) = (before.parts(), Stressed { f: *to, p: p.lane(1) }.parts());
    let change = before.change(&Stressed { f: df, p: dp });
    let dj = from.cofactor().dot(&df);
    let predicted = (old.pressure + change.pressure - old.pressure * dj / j) / j;
    tangent.add_second_of_determinant(to, predicted - new.pressure / j_to);
    tangent.add_turning(&(old.turning + change.turning - new.turning));
}
