//! Domain of an expressed energy density, and its values in the reference configuration.

use std::sync::Arc;

use super::measures::{Compiled, Measures};
use super::{EnergyMistake, ExpressedEnergy};
use crate::algebra::{Mat, symmetric_eigen};
use crate::material::{Domain, Lame, Material, ParameterError, Psd, Tangent};

/// Tolerance of the energy and the stress in the reference configuration, relative to the stiffness: many
/// times the rounding, and less than the error of any constant given with few digits.
const ROUNDING: f64 = 1e-10;

impl Compiled {
    pub(super) fn is_isotropic(&self) -> bool {
        !matches!(self.measures, Measures::Components(_))
    }

    /// Sets the domain: `J > 0` if energy or stress is not finite in some flat or inverted states.
    pub(super) fn find_domain(&mut self) {
        let material = ExpressedEnergy::of(&Arc::new(self.clone()));
        let fine2 = [[1.0, 0.0], [0.9, -0.2], [1.0, -1.0], [1.2, -0.7]];
        let fine3 = [[1.0, 1.0, 0.0], [0.9, 0.8, -0.2], [1.0, 1.0, -1.0], [1.2, 0.9, -0.7]];
        let everywhere = fine2.iter().all(|sigma| material.is_finite_at(&Mat::diagonal(sigma)))
            && fine3.iter().all(|sigma| material.is_finite_at(&Mat::diagonal(sigma)));
        self.domain = if everywhere { Domain::Everywhere } else { Domain::PositiveJ };
    }
}

impl ExpressedEnergy {
    pub(super) fn of(compiled: &Arc<Compiled>) -> Self {
        ExpressedEnergy { compiled: Arc::clone(compiled) }
    }

    fn is_finite_at<const D: usize>(&self, f: &Mat<f64, D>) -> bool {
        self.psi(f).is_finite() && self.pk1(f).norm_squared().is_finite()
    }

    /// Returns the Lame parameters of the initial stiffness, if the energy is isotropic and they are
    /// finite.
    pub(super) fn lame_at_rest(&self) -> Option<Lame> {
        if !self.compiled.is_isotropic() {
            return None;
        }
        let tangent: Tangent<3> = self.hessian(&Mat::identity(), Psd::Exact);
        let lame = Lame { lambda: tangent.0[0][0][1][1], mu: tangent.0[0][1][0][1] };
        (lame.lambda.is_finite() && lame.mu.is_finite()).then_some(lame)
    }

    pub(super) fn check_at_rest<const D: usize>(&self) -> Result<(), EnergyMistake> {
        let rest = Mat::<f64, D>::identity();
        let wrong = |value: f64, problem: &str| {
            Err(EnergyMistake::Parameter(ParameterError::new("psi", value, problem.to_owned())))
        };
        // Energy, stress and stiffness must be finite.
        let energy = self.psi(&rest);
        if !energy.is_finite() {
            return wrong(energy, "is the energy density at rest, where I1 = 3 and J = 1: it must be 0");
        }
        let (stress, tangent) = (self.pk1(&rest), self.hessian(&rest, Psd::Exact));
        let stress = largest(stress.0.as_flattened());
        if !stress.is_finite() {
            return wrong(stress, "is the stress at rest [Pa]: the energy has no derivative there");
        }
        let stiffness = tangent.0.as_flattened().iter().map(|part| largest(part.0.as_flattened()));
        let stiffness = largest(&stiffness.collect::<Vec<_>>()).abs();
        if !(stiffness.is_finite() && stiffness > 0.0) {
            return wrong(stiffness, "is the stiffness at rest [Pa]: it must be a positive number");
        }
        // The reference configuration must be free of stress and energy.
        if stress.abs() > ROUNDING * stiffness {
            let problem = "is the stress at rest [Pa], which must be 0: without a load the body would not \
                           stay in its shape; add a term such as -mu*log(J) or -mu*(J - 1)";
            return wrong(stress, problem);
        }
        if energy.abs() > ROUNDING * stiffness {
            let problem = "is the energy density at rest [J/m^3], which must be 0: subtract it, as 3 from I1";
            return wrong(energy, problem);
        }
        // The energy must be isotropic if it is one of principal stretches.
        if !self.compiled.is_symmetric() {
            let problem = "is by how much the energy changes where two principal stretches are exchanged; \
                           it must not: write all three alike, as l1^2 + l2^2 + l3^2";
            return wrong(self.asymmetry(), problem);
        }
        // Strong ellipticity, and a positive bulk modulus of isotropic energies.
        let weakest = weakest_wave(&tangent);
        if weakest <= ROUNDING * stiffness {
            let problem = "is the stiffness at rest against the weakest plane wave [Pa], which must be \
                           positive: the energy is not elliptic there";
            return wrong(weakest, problem);
        }
        match self.lame_at_rest() {
            Some(lame) if 3.0 * lame.lambda + 2.0 * lame.mu <= ROUNDING * stiffness => {
                let bulk = lame.lambda + 2.0 / 3.0 * lame.mu;
                wrong(bulk, "is the bulk modulus at rest [Pa], which must be positive")
            }
            _ => Ok(()),
        }
    }

    /// Returns the largest change of the energy when two of three different stretches are exchanged,
    /// relative to the energy.
    fn asymmetry(&self) -> f64 {
        let Measures::Stretches([_, programs]) = &self.compiled.measures else { return 0.0 };
        let psi = |sigma: [f64; 3]| {
            let mut psi = [0.0];
            programs.energy.run(&sigma, &mut psi);
            psi[0]
        };
        let first = psi([1.05, 1.02, 0.98]);
        let others = [psi([1.02, 1.05, 0.98]), psi([0.98, 1.02, 1.05]), psi([1.05, 0.98, 1.02])];
        others.iter().fold(0.0, |most: f64, other| most.max((other - first).abs() / first.abs()))
    }
}

impl Compiled {
    /// True if exchanging stretches does not change the energy.
    fn is_symmetric(&self) -> bool {
        ExpressedEnergy::of(&Arc::new(self.clone())).asymmetry() < ROUNDING
    }
}

/// Returns the entry of largest magnitude; NaN if any entry is NaN.
fn largest(entries: &[f64]) -> f64 {
    entries.iter().fold(
        0.0,
        |most: f64, entry| {
            if entry.is_nan() || entry.abs() > most.abs() { *entry } else { most }
        },
    )
}

/// Returns the smallest eigenvalue of the acoustic tensors `Q_ik(n) = C_ijkl n_j n_l` over unit vectors
/// `n` [Pa].
fn weakest_wave<const D: usize>(tangent: &Tangent<D>) -> f64 {
    /// Number of directions on half a circle, and of circles on half a sphere.
    const STEPS: usize = 24;
    let mut weakest = f64::INFINITY;
    let circles = if D == 2 { 1 } else { STEPS };
    for circle in 0..circles {
        for step in 0..STEPS {
            let turn = std::f64::consts::PI * step as f64 / STEPS as f64;
            let tilt = std::f64::consts::PI * circle as f64 / STEPS as f64;
            let mut n = [0.0; D];
            n[0] = turn.cos() * tilt.cos();
            n[1] = turn.sin() * tilt.cos();
            if D == 3 {
                n[D - 1] = tilt.sin();
            }
            let mut acoustic = Mat::<f64, D>::zero();
            for i in 0..D {
                for k in 0..D {
                    for j in 0..D {
                        for l in 0..D {
                            acoustic[i][k] += tangent.0[i][j][k][l] * n[j] * n[l];
                        }
                    }
                }
            }
            let (eigenvalues, _) = symmetric_eigen(&acoustic);
            weakest = eigenvalues.iter().fold(weakest, |least, value| least.min(*value));
        }
    }
    weakest
}
