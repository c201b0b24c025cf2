//! Elastic constants in which energies are linear.

use pliant::dissipation::DissipativeTerm;
use pliant::energy::EnergyTerm;

use super::{ForceUse, ModeUse, Parameter};
use crate::adjoint::add_scaled;
use pliant::algebra::dot;

/// Parameter `theta` with `dE/d theta = sum_i c_i E_i` and `dR/d theta = sum_i b_i R_i`, energies and
/// dissipation functions with other constants.
///
/// Energies of isotropic models are linear in the Lame parameters, `E = lambda E_l + mu E_m`. Both parts
/// are energies of the same model, with `lambda = 0` and `lambda = mu`, so that the derivatives of forces
/// by Young's modulus and Poisson's ratio are exact.
pub struct Modulus {
    /// True if the only energy is that of the system's term with the same name.
    is_of_system: bool,
    /// Index of that term, once it has been found.
    place: Option<usize>,
    energies: Vec<(f64, Box<dyn EnergyTerm>)>,
    dissipation: Vec<(f64, Box<dyn DissipativeTerm>)>,
    gradient: Vec<f64>,
}

impl Modulus {
    /// Parameter with these parts, factors first.
    pub fn new(
        energies: Vec<(f64, Box<dyn EnergyTerm>)>,
        dissipation: Vec<(f64, Box<dyn DissipativeTerm>)>,
    ) -> Self {
        Modulus { is_of_system: false, place: None, energies, dissipation, gradient: vec![] }
    }

    /// Declares that its only energy is that of the system's term with the same name, whose work need not
    /// be computed again where it is known. Factors of terms are those of this energy.
    #[must_use]
    pub fn of_system(self) -> Self {
        Modulus { is_of_system: true, ..self }
    }

    /// Derivative of the energies along `p`, if the system's term has computed it.
    fn known_work(&mut self, of: &ForceUse<'_>) -> Option<f64> {
        let [(factor, energy)] = &self.energies[..] else { return None };
        if !self.is_of_system || of.works.is_empty() {
            return None;
        }
        let find = || of.system.terms().iter().position(|term| term.name() == energy.name());
        self.place = self.place.or_else(find);
        let work = of.works.get(self.place?)?;
        work.map(|work| factor * work)
    }
}

impl Parameter for Modulus {
    fn len(&self) -> usize {
        1
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        let mut product = vec![0.0; of.x.len()];
        for (factor, term) in &mut self.energies {
            product.fill(0.0);
            term.add_hessian_product(of.x, of.shape, &mut product);
            derivative[0] += *factor * dot(&product, of.shape);
        }
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let Modulus { energies, dissipation, gradient, .. } = self;
        gradient.resize(of.x.len(), 0.0);
        for (factor, term) in energies {
            gradient.fill(0.0);
            term.add_gradient(of.x, gradient);
            add_scaled(force, -*factor * change[0], gradient);
        }
        for (factor, term) in dissipation {
            gradient.fill(0.0);
            term.evaluate(of.x, of.v);
            term.add_rows(0, gradient);
            add_scaled(force, -*factor * change[0], gradient);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let known = self.known_work(of);
        derivative[0] -= known.unwrap_or(0.0);
        let Modulus { energies, dissipation, gradient, .. } = self;
        gradient.resize(of.x.len(), 0.0);
        let mut subtract = |factor: f64, add: &mut dyn FnMut(&mut [f64])| {
            gradient.fill(0.0);
            add(gradient);
            let along = gradient.iter().zip(of.p).map(|(gradient, p)| gradient * p).sum::<f64>();
            derivative[0] -= factor * along;
        };
        for (factor, term) in energies.iter_mut().filter(|_| known.is_none()) {
            subtract(*factor, &mut |gradient| term.add_gradient(of.x, gradient));
        }
        for (factor, term) in dissipation {
            subtract(*factor, &mut |gradient| {
                term.evaluate(of.x, of.v);
                term.add_rows(0, gradient);
            });
        }
    }
}
