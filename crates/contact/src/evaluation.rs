//! Energies and gradients of contacts, in the order in which they are visited.

use pliant::lanes::Lanes;
use pliant::material::Psd;

use crate::merge::WeightedPair;
use crate::model::ContactLaw;
use crate::mollifier::{MollifiedPair, mollified_inner_pair};
use crate::packs::store_rows;
use crate::pair::PairGeometry;
use crate::visit::{PackVisitor, PlaneGeometry};

/// Energy and gradient of one contact.
#[derive(Clone, Copy)]
pub(crate) struct ContactTerm<const D: usize> {
    pub(crate) energy: f64,
    pub(crate) count: usize,
    pub(crate) vertices: [u32; 4],
    pub(crate) gradient: [[f64; D]; 4],
}

impl<const D: usize> ContactTerm<D> {
    /// A term without gradient.
    fn of(energy: f64) -> Self {
        ContactTerm { energy, count: 0, vertices: [0; 4], gradient: [[0.0; D]; 4] }
    }

    /// Vertices, and the gradient by each [N].
    pub(crate) fn gradient(&self) -> (&[u32], [[f64; D]; 4]) {
        (&self.vertices[..self.count], self.gradient)
    }
}

/// Energies of contacts, in the order visited.
pub(crate) struct EvaluatedContacts<const D: usize> {
    pub(crate) with_gradient: bool,
    pub(crate) terms: Vec<ContactTerm<D>>,
}

impl<const D: usize> PackVisitor<D> for EvaluatedContacts<D> {
    #[inline(always)]
    fn pack<L: Lanes, const N: usize, const P: usize>(
        &mut self,
        pairs: &[WeightedPair<N>],
        geometry: &PairGeometry<L, D, N, P>,
        law: &ContactLaw,
        weight: L,
    ) {
        let of_distance = law.barrier.at(geometry.squared_distance, weight);
        let energies = of_distance.energy.to_array();
        if !self.with_gradient {
            for lane in 0..pairs.len() {
                self.terms.push(ContactTerm::of(energies[lane]));
            }
            return;
        }
        let gradients = store_rows(&geometry.gradient(of_distance.slope));
        for lane in 0..pairs.len() {
            let mut term = ContactTerm { count: N, ..ContactTerm::of(energies[lane]) };
            for n in 0..N {
                term.vertices[n] = pairs[lane].vertices[n];
                for k in 0..D {
                    term.gradient[n][k] = gradients[n][k][lane];
                }
            }
            self.terms.push(term);
        }
    }

    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64) {
        let law = law.barrier.at_signed(plane.distance, weight);
        let mut term = ContactTerm::of(law.energy);
        if self.with_gradient && law.energy.is_finite() {
            term.count = 2;
            term.vertices[..2].copy_from_slice(vertices);
            let force = plane.normal.map(|n| law.slope * n);
            (term.gradient[0], term.gradient[1]) = (force, force.map(|f| -f));
        }
        self.terms.push(term);
    }

    fn mollified(&mut self, pair: &MollifiedPair, x: &[[f64; 3]; 4], law: &ContactLaw) {
        let found = mollified_inner_pair(x, &pair.inner, &law.barrier, pair.weight, pair.limit, Psd::Exact);
        let mut term = ContactTerm::of(found.value);
        if self.with_gradient {
            (term.count, term.vertices) = (4, pair.vertices);
            for i in 0..4 {
                term.gradient[i].copy_from_slice(&found.gradient[i][..D]);
            }
        }
        self.terms.push(term);
    }
}
