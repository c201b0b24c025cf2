//! Stress-stretch curves of a homogeneous piece of an isotropic material: uniaxial, equibiaxial, pure shear.
//!
//! The deformation is `F = diag(l, t, t)`, `diag(l, l, t)` or `diag(l, 1, t)`. The transverse stretch `t`
//! minimises the energy, `dpsi/dt = 0`; Newton's method finds it between bounds. The nominal stress is
//! `P_11`, force per reference area. Source: Holzapfel 2000, *Nonlinear solid mechanics*, section 6.5. For
//! nearly incompressible materials these are the closed forms of Treloar 1944, *Stress-strain data for
//! vulcanised rubber under various types of deformation*.

use pliant::algebra::Mat;
use pliant::material::{Material, MaterialSpec, MaterialVisitor, Psd};

/// A test of a piece of material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MaterialTest {
    /// Tension along one axis, free along the others.
    Uniaxial,
    /// Equal tension along two axes, free along the third.
    Equibiaxial,
    /// Tension along one axis, fixed along the second, free along the third: a wide strip (planar
    /// tension).
    PureShear,
}

impl MaterialTest {
    /// All tests, with the titles of their columns.
    pub(super) const ALL: [(&'static str, MaterialTest); 3] = [
        ("uniaxial", MaterialTest::Uniaxial),
        ("equibiaxial", MaterialTest::Equibiaxial),
        ("pure-shear", MaterialTest::PureShear),
    ];

    /// Stretches along the axes, and which of the axes are free.
    fn stretches(self, l: f64, t: f64) -> ([f64; 3], [bool; 3]) {
        match self {
            MaterialTest::Uniaxial => ([l, t, t], [false, true, true]),
            MaterialTest::Equibiaxial => ([l, l, t], [false, false, true]),
            MaterialTest::PureShear => ([l, 1.0, t], [false, false, true]),
        }
    }

    /// Transverse stretch at constant volume.
    fn at_constant_volume(self, l: f64) -> f64 {
        match self {
            MaterialTest::Uniaxial => 1.0 / l.sqrt(),
            MaterialTest::Equibiaxial => 1.0 / (l * l),
            MaterialTest::PureShear => 1.0 / l,
        }
    }
}

/// Nominal stress [Pa] of `material` in this test at the stretch `l`, positive; `None` if no transverse
/// stretch gives a stress-free side.
pub(super) fn nominal_stress(material: &MaterialSpec, test: MaterialTest, l: f64) -> Option<f64> {
    material.visit::<3, _>(Piece { test, l })
}

/// A homogeneous piece of material in a test.
struct Piece {
    test: MaterialTest,
    l: f64,
}

impl MaterialVisitor<3> for Piece {
    type Output = Option<f64>;

    fn visit<M: Material<3> + Material<3> + Clone>(self, material: M) -> Option<f64> {
        let Piece { test, l } = self;
        let gradient = |t: f64| {
            let (stretches, free) = test.stretches(l, t);
            (Mat::<f64, 3>::diagonal(&stretches), free)
        };
        let slope = |t: f64| {
            let (f, free) = gradient(t);
            let stress = material.pk1(&f);
            (0..3).filter(|&i| free[i]).map(|i| stress[i][i]).sum::<f64>()
        };
        let curvature = |t: f64| {
            let (f, free) = gradient(t);
            let tangent = material.hessian(&f, Psd::Exact);
            let axes = || (0..3).filter(|&i| free[i]);
            axes().flat_map(|i| axes().map(move |j| (i, j))).map(|(i, j)| tangent.0[i][i][j][j]).sum::<f64>()
        };
        let t = root(&slope, &curvature, test.at_constant_volume(l))?;
        let stress = material.pk1(&gradient(t).0)[0][0];
        stress.is_finite().then_some(stress)
    }
}

/// Nearest point at or around `start` where `slope` changes from negative to positive.
fn root(slope: &impl Fn(f64) -> f64, curvature: &impl Fn(f64) -> f64, start: f64) -> Option<f64> {
    let (mut low, mut high) = bracket(slope, start)?;
    let mut t = 0.5 * (low + high);
    for _ in 0..200 {
        let at = slope(t);
        if at == 0.0 {
            return Some(t);
        }
        if at < 0.0 {
            low = t
        } else {
            high = t
        }
        let newton = t - at / curvature(t);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - t).abs() <= f64::EPSILON * t {
            return Some(next);
        }
        t = next;
    }
    Some(t)
}

/// Points below and above the root.
fn bracket(slope: &impl Fn(f64) -> f64, start: f64) -> Option<(f64, f64)> {
    let at = slope(start);
    if !at.is_finite() {
        return None;
    }
    let (mut inner, mut width) = (start, 0.01);
    for _ in 0..60 {
        let outer = if at > 0.0 { inner / (1.0 + width) } else { inner * (1.0 + width) };
        let there = slope(outer);
        if !there.is_finite() {
            return None;
        }
        if (there > 0.0) != (at > 0.0) {
            return Some(if at > 0.0 { (outer, inner) } else { (inner, outer) });
        }
        (inner, width) = (outer, width * 1.5);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant::material::{Isotropic, OgdenTerms};

    const STRETCHES: [f64; 6] = [0.7, 0.9, 1.1, 1.5, 2.0, 4.0];

    // Incompressible neo-Hookean rubber: P = mu (l - p(l)) (Treloar 1944). A finite bulk modulus K leaves
    // an error of about mu/K.
    #[test]
    fn nearly_incompressible_rubber_has_the_closed_forms() {
        let (mu, poisson) = (0.4e6, 0.499_999_9);
        let material = MaterialSpec::IsochoricNeoHookean(Isotropic::new(2.0 * mu * (1.0 + poisson), poisson));
        for l in STRETCHES {
            let forms = [l - l.powi(-2), l - l.powi(-5), l - l.powi(-3)];
            for ((name, test), form) in MaterialTest::ALL.into_iter().zip(forms) {
                let found = nominal_stress(&material, test, l).unwrap();
                let error = (found - mu * form).abs() / (mu * form.abs());
                assert!(error < 2e-5, "{name} at {l}: {found}, not {}: {error:e}", mu * form);
            }
        }
    }

    // Ogden 1972: P = sum_p mu_p (l^(a - 1) - t^a / l) with the transverse stretch at constant volume.
    #[test]
    fn series_of_ogden_have_the_closed_form_along_one_axis() {
        let (mu, alpha) = ([0.63e6, 0.0012e6, -0.01e6], [1.3, 5.0, -2.0]);
        let material = MaterialSpec::Ogden(OgdenTerms {
            young: None,
            poisson: 0.499_999_9,
            mu: mu.to_vec(),
            alpha: alpha.to_vec(),
        });
        for l in STRETCHES {
            let term = |(mu, a): (f64, f64)| mu * (l.powf(a) - l.powf(-0.5 * a)) / l;
            let form: f64 = mu.into_iter().zip(alpha).map(term).sum();
            let found = nominal_stress(&material, MaterialTest::Uniaxial, l).unwrap();
            assert!((found - form).abs() < 2e-5 * form.abs(), "{l}: {found}, not {form}");
        }
    }

    // Hencky's energy is linear in the logarithms of the stretches: t = l^-nu and P = E ln(l)/l.
    #[test]
    fn compressible_hencky_has_the_closed_form_along_one_axis() {
        let material = MaterialSpec::Hencky(Isotropic::new(3e5, 0.23));
        for l in STRETCHES {
            let (found, form) =
                (nominal_stress(&material, MaterialTest::Uniaxial, l).unwrap(), 3e5 * l.ln() / l);
            assert!((found - form).abs() < 1e-9 * 3e5, "{l}: {found}, not {form}");
        }
    }
}
