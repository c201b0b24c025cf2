//! Friction of all contacts as a dissipation function: smooth Coulomb friction with lagged normal forces
//! and tangents, renewed in a fixed-point iteration until both agree.

use std::ops::Range;
use std::sync::Arc;

use pliant::dissipation::{DissipationViews, DissipativeTerm, FrozenParts, PositionProducts};
use pliant::energy::{ChangingStencils, Stencils};
use pliant::material::Psd;

use crate::energy::{ContactEnergy, SharedSearch, locked};
use crate::expected::ExpectedInTurn;
use crate::friction::PairFriction;
use crate::friction_slope::{FrictionSlopes, SlopeProduct};
use crate::model::ContactModel;
use crate::report::ContactReport;
use crate::rows::{StencilLists, TouchedRows};

/// One contact with its friction.
#[derive(Clone, Copy, Debug)]
struct RubbingContact<const D: usize> {
    count: usize,
    vertices: [u32; 4],
    pair: PairFriction<f64, D, 4>,
    /// Force as a fraction of the limit during a solve; `None` outside of one, where velocities determine
    /// it.
    part: Option<[f64; D]>,
}

/// Data that raise regularisation velocities.
#[derive(Clone, Debug)]
struct BorneThreshold {
    /// Step size `h` [s].
    step: f64,
    /// Inverse mass of every vertex [1/kg]; 0 if fixed.
    inverse_mass: Vec<f64>,
    /// `sum_k mu_k lambda_k |c_kv| sum_j |c_kj|` of every vertex [N], over the moving vertices `j`.
    force: Vec<f64>,
}

/// Dissipation function of the contacts of a model, `R(v) = sum mu lambda f0(|v_T|)`.
pub struct FrictionTerm<const D: usize> {
    borne: Option<BorneThreshold>,
    model: Arc<ContactModel>,
    search: SharedSearch<D>,
    /// Contacts with friction, by number of vertices: two, three, four.
    contacts: [Vec<RubbingContact<D>>; 3],
    lists: StencilLists,
    gradient: TouchedRows<D>,
    frozen: bool,
}

impl BorneThreshold {
    fn raise<const D: usize>(&mut self, contacts: &mut [Vec<RubbingContact<D>>; 3]) {
        let BorneThreshold { step, inverse_mass, force } = self;
        let moving = |contact: &RubbingContact<D>| {
            let all = contact.vertices.into_iter().zip(contact.pair.coefficients).take(contact.count);
            all.filter(|(v, _)| inverse_mass[*v as usize] > 0.0).collect::<Vec<_>>()
        };
        for contact in contacts.iter().flatten() {
            let moving = moving(contact);
            let all: f64 = moving.iter().map(|(_, c)| c.abs()).sum();
            moving.iter().for_each(|(v, c)| force[*v as usize] += contact.pair.limit * c.abs() * all);
        }
        for contact in contacts.iter_mut().flatten() {
            let borne = |(v, _): (u32, f64)| 2.0 * *step * force[v as usize] * inverse_mass[v as usize];
            let most = moving(contact).into_iter().map(borne).fold(0.0, f64::max);
            contact.pair.threshold = contact.pair.threshold.max(most);
        }
        for contact in contacts.iter().flatten() {
            contact.vertices[..contact.count].iter().for_each(|v| force[*v as usize] = 0.0);
        }
    }
}

impl<const D: usize> FrictionTerm<D> {
    /// Friction of the contacts of `energy`, with which it shares the search.
    pub fn new(energy: &ContactEnergy<D>) -> Self {
        FrictionTerm {
            borne: None,
            model: energy.model().clone(),
            search: energy.search(),
            contacts: [vec![], vec![], vec![]],
            lists: StencilLists::new(),
            gradient: TouchedRows::new(energy.model().surface.bodies.len()),
            frozen: false,
        }
    }

    /// Raises the regularisation velocity of contacts to what explicit steps of `h` [s] need for
    /// stability: `e_k = max(e, 2 h max_v F_v / m_v)` over the vertices of a contact, `F_v = sum_k mu_k
    /// lambda_k |c_kv| sum_j |c_kj|`.
    ///
    /// Friction then damps no motion faster than at the rate `1 / h`: the row sums of `M^-1 d2R/dv2`,
    /// with `2 mu lambda / e` at zero slip, bound its eigenvalues (Gershgorin). `mass` [kg] of every
    /// vertex, 0 if fixed.
    pub fn raise_threshold(&mut self, step: f64, mass: &[f64]) {
        let inverse_mass = mass.iter().map(|m| if *m > 0.0 { 1.0 / m } else { 0.0 }).collect();
        self.borne = Some(BorneThreshold { step, inverse_mass, force: vec![0.0; mass.len()] });
    }

    /// Evaluates normal forces and tangents at `x`.
    fn take(&mut self, x: &[f64]) {
        let mut search = locked(&self.search);
        let expected = search.expected.clone();
        let mut expected = ExpectedInTurn::new(&expected);
        let contacts = search.contacts_at(&self.model, x);
        self.contacts.iter_mut().for_each(Vec::clear);
        for mut report in ContactReport::<D>::of_all(contacts, &self.model, x) {
            // During a solve a barrier may push a thousand times as hard as at the solution.
            let force = expected.of(&report.vertices[..report.count]).filter(|_| report.force > 0.0);
            report.force = force.unwrap_or(report.force);
            if let Some(pair) = report.rubbing(self.model.threshold_speed) {
                let ContactReport { count, vertices, .. } = report;
                self.contacts[count - 2].push(RubbingContact { count, vertices, pair, part: None });
            }
        }
        drop(search);
        if let Some(borne) = &mut self.borne {
            borne.raise(&mut self.contacts);
        }
    }

    /// Evaluates normal forces and tangents at `x` unless they are lagged.
    fn look(&mut self, x: &[f64]) {
        if !self.frozen {
            self.take(x);
        }
    }

    /// Damps the update of the limits: the values `before` plus a fraction `part` of the change. The
    /// limit of a missing contact is 0.
    fn go_from(&mut self, before: [Vec<RubbingContact<D>>; 3], part: f64) {
        for (now, mut before) in self.contacts.iter_mut().zip(before) {
            before.sort_unstable_by_key(|contact| contact.vertices);
            let find =
                |vertices: &[u32; 4]| before.binary_search_by_key(vertices, |contact| contact.vertices);
            let mut gone = vec![true; before.len()];
            for contact in now.iter_mut() {
                let last = find(&contact.vertices).map_or(0.0, |at| {
                    gone[at] = false;
                    before[at].pair.limit
                });
                contact.pair.limit = last + part * (contact.pair.limit - last);
            }
            for mut contact in
                before.into_iter().zip(gone).filter_map(|(contact, gone)| gone.then_some(contact))
            {
                contact.pair.limit *= 1.0 - part;
                now.push(contact);
            }
        }
    }

    /// Force fractions of contacts, sorted by vertices, while lagged.
    fn known_parts(&self) -> Vec<([u32; 4], [f64; D])> {
        if !self.frozen {
            return vec![];
        }
        let known = |contact: &RubbingContact<D>| Some((contact.vertices, contact.part?));
        let mut parts: Vec<_> = self.all().filter_map(known).collect();
        parts.sort_unstable_by_key(|(vertices, _)| *vertices);
        parts
    }

    fn all(&self) -> impl Iterator<Item = &RubbingContact<D>> {
        self.contacts.iter().flatten()
    }

    /// Adds a product with the derivative of forces by positions, which is zero while lagged.
    ///
    /// Returns false and adds nothing if regularisation velocities are raised, because these depend on
    /// the normal forces, too.
    fn add_slopes(&self, product: SlopeProduct, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        if self.borne.is_some() {
            return false;
        }
        if self.frozen {
            return true;
        }
        let mut slopes = FrictionSlopes { product, threshold: self.model.threshold_speed, v, p, y };
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        (0..contacts.len()).for_each(|i| contacts.visit::<D>(&self.model, x, i, &mut slopes));
        true
    }
}

impl<const D: usize> RubbingContact<D> {
    /// Velocities of four vertices; missing ones repeat and have zero coefficients.
    fn velocities(&self, v: &[f64]) -> [[f64; D]; 4] {
        crate::vector::rows::<D, 4>(v, &self.vertices)
    }
}

impl<const D: usize> DissipativeTerm for FrictionTerm<D> {
    fn name(&self) -> String {
        "friction".into()
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        self.look(x);
        self.gradient.clear();
        let mut finite = true;
        for contact in self.contacts.iter().flatten() {
            let gradient = contact.pair.gradient(&contact.velocities(v));
            let own = &gradient[..contact.count];
            finite &= own.as_flattened().iter().all(|g| g.is_finite());
            self.gradient.add(&contact.vertices[..contact.count], own);
        }
        finite
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.gradient.add_to(first, g);
    }

    fn add_damping_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) {
        self.look(x);
        for contact in self.all() {
            let m = contact.pair.hessian(&contact.velocities(v));
            let c = &contact.pair.coefficients;
            let directions = contact.velocities(p);
            let mut relative = [0.0; D];
            for i in 0..contact.count {
                (0..D).for_each(|k| relative[k] += c[i] * directions[i][k]);
            }
            for i in 0..contact.count {
                let row = &mut y[contact.vertices[i] as usize * D..][..D];
                for k in 0..D {
                    row[k] += c[i] * (0..D).map(|l| m[k][l] * relative[l]).sum::<f64>();
                }
            }
        }
    }

    fn is_friction(&self) -> bool {
        true
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.look(x);
        self.all().fold(0.0, |sum, contact| sum + contact.pair.power(&contact.velocities(v)))
    }

    fn value(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.look(x);
        self.all().fold(0.0, |sum, contact| sum + contact.pair.value(&contact.velocities(v)))
    }
}

impl<const D: usize> DissipationViews for FrictionTerm<D> {
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        Some(self)
    }

    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        Some(self)
    }

    fn frozen(&mut self) -> Option<&mut dyn FrozenParts> {
        Some(self)
    }
}

impl<const D: usize> PositionProducts for FrictionTerm<D> {
    fn add_position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        self.add_slopes(SlopeProduct::Transposed, x, v, p, y)
    }

    fn add_position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        self.add_slopes(SlopeProduct::Change, x, v, u, y)
    }
}

impl<const D: usize> FrozenParts for FrictionTerm<D> {
    fn freeze(&mut self, x: &[f64], part: f64) -> bool {
        let known = self.known_parts();
        let held = self.frozen && self.all().next().is_some();
        let before = if self.frozen && part < 1.0 { self.contacts.clone() } else { Default::default() };
        self.take(x);
        if part < 1.0 {
            self.go_from(before, part);
        }
        self.frozen = true;
        for contact in self.contacts.iter_mut().flatten() {
            // The matrix of a new contact is `mu lambda / g (I - n n^T)`, stiff along its slip as well:
            // with the small stiffness of sliding, a vertex that comes to rest would overshoot many times
            // its displacement.
            contact.part = match known.binary_search_by_key(&contact.vertices, |(vertices, _)| *vertices) {
                Ok(at) => Some(contact.pair.in_plane(&known[at].1)),
                Err(_) => Some([0.0; D]),
            };
        }
        held || self.all().next().is_some()
    }

    fn follow(&mut self, v: &[f64], dv: &[f64]) {
        for contact in self.contacts.iter_mut().flatten() {
            let (from, change) = (contact.velocities(v), contact.velocities(dv));
            let part = contact.part.unwrap_or_else(|| contact.pair.part_of_limit(&from));
            contact.part = Some(contact.pair.part_after(&part, &from, &change));
        }
    }

    fn thaw(&mut self) {
        self.frozen = false;
    }

    fn threshold_speed(&self) -> Option<f64> {
        Some(self.model.threshold_speed)
    }

    fn most_renewals(&self) -> u32 {
        self.model.friction_iterations
    }
}

impl<const D: usize> ChangingStencils for FrictionTerm<D> {
    fn find(&mut self, x: &[f64]) -> bool {
        self.look(x);
        let vertices = |contacts: &Vec<RubbingContact<D>>| {
            contacts.iter().flat_map(|c| c.vertices[..c.count].iter().copied()).collect()
        };
        self.lists.replace(self.contacts.each_ref().map(vertices))
    }

    fn lists(&self) -> &[Stencils] {
        self.lists.all()
    }

    fn blocks(&self, list: usize, stencils: Range<usize>, (_, v): (&[f64], &[f64]), _: Psd, out: &mut [f64]) {
        let size = list + 2;
        let each = size * (size + 1) / 2 * D * D;
        for (contact, out) in self.contacts[list][stencils].iter().zip(out.chunks_exact_mut(each)) {
            let v = contact.velocities(v);
            let m = match &contact.part {
                Some(part) => contact.pair.hessian_with(part, &v),
                None => contact.pair.hessian(&v),
            };
            let c = &contact.pair.coefficients;
            let mut next = out.chunks_exact_mut(D * D);
            for a in 0..size {
                for b in a..size {
                    let Some(out) = next.next() else { return };
                    for k in 0..D {
                        for l in 0..D {
                            out[k * D + l] = c[a] * c[b] * m[k][l];
                        }
                    }
                }
            }
        }
    }
}
