//! Predicted contact forces and the secant stiffness that leads to them.
//!
//! Near the activation distance the force of a barrier is quadratic in the remaining gap, and loads of
//! soft bodies are so small that they rest there. Newton's method with tangents then halves an excessive
//! force in every iteration, and overshoots where a gap has to close. The last linear solution gives a
//! better prediction: a contact with the force `f(g)` and the stiffness `K` whose gap changes by `dg`
//! gets the force `F = f(g) - K dg`, which balances the other forces. The next matrix uses the secant of
//! the law from `g` to the gap `g_F` of that force, `K = (f(g_F) - f(g)) / (g - g_F)`, and the contact
//! reaches it at once.
//!
//! The force acts as an independent unknown, as in primal-dual methods for inequalities (Nocedal, Wright
//! 2006, *Numerical optimization*, chapter 19). The energy and its gradient do not use it: they alone
//! decide where the solution is and whether a step lowers the energy.

use pliant::lanes::{Lanes, WIDTH};

use crate::barrier::{Barrier, EnergyOfGap};
use crate::merge::WeightedPair;
use crate::model::ContactLaw;
use crate::mollifier::MollifiedPair;
use crate::packs::load_rows;
use crate::pair::PairGeometry;
use crate::vector::{difference, dot, rows};
use crate::visit::{PackVisitor, PlaneGeometry};

/// Gaps that differ by less than this fraction of the activation distance use the tangent.
const SAME_GAP: f64 = 1e-4;

/// Vertices of a contact, padded with `u32::MAX`.
pub(crate) type ContactKey = [u32; 4];

/// Key of a contact with these vertices.
pub(crate) fn key(vertices: &[u32]) -> ContactKey {
    let mut key = [u32::MAX; 4];
    key[..vertices.len()].copy_from_slice(vertices);
    key
}

/// Normal forces [N], sorted by the vertices of their contacts; negative where the linear solution pulls.
#[derive(Debug, Default)]
pub(crate) struct ExpectedForces(Vec<(ContactKey, f64)>);

impl ExpectedForces {
    /// Stores these forces, one for each contact.
    pub(crate) fn of_contacts(mut forces: Vec<(ContactKey, f64)>) -> Self {
        // A few ascending runs, which a stable sort merges.
        forces.sort_by_key(|(key, _)| *key);
        ExpectedForces(forces)
    }

    /// True if no force is predicted.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Cursor over predicted forces: contacts of one kind are queried in ascending order, so the next is
/// near.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExpectedInTurn<'a> {
    forces: &'a [(ContactKey, f64)],
    /// Index at or after the last one found.
    next: usize,
}

impl<'a> ExpectedInTurn<'a> {
    pub(crate) fn new(forces: &'a ExpectedForces) -> Self {
        ExpectedInTurn { forces: &forces.0, next: 0 }
    }

    /// Predicted force of a contact, clamped to zero or above [N]; `None` if there is none.
    pub(crate) fn of(&mut self, vertices: &[u32]) -> Option<f64> {
        let (all, key) = (self.forces, key(vertices));
        let is_before = |at: usize| all.get(at).is_some_and(|(other, _)| *other < key);
        let (mut low, mut width) = (self.next, 1);
        if low > 0 && !is_before(low - 1) {
            low = 0;
        }
        while is_before(low + width - 1) {
            low += width;
            width *= 2;
        }
        let end = (low + width).min(all.len());
        self.next = low + all[low..end].partition_point(|(other, _)| *other < key);
        let found = all.get(self.next).filter(|(other, _)| *other == key);
        found.map(|(_, force)| force.max(0.0))
    }

    /// `K` [N/m] of a contact of weight `w` [m^2] at the distance `d` [m]: the secant stiffness if a
    /// force is predicted, else `E''(d)`.
    pub(crate) fn stiffness(
        &mut self,
        vertices: &[u32],
        barrier: &Barrier,
        distance: f64,
        weight: f64,
    ) -> f64 {
        self.chord(vertices, barrier, (distance, weight), &barrier.at_signed(distance, weight))
    }

    /// Stiffness as in [`stiffness`](Self::stiffness), from the known `law` at that distance.
    fn chord(
        &mut self,
        vertices: &[u32],
        barrier: &Barrier,
        (distance, weight): (f64, f64),
        law: &EnergyOfGap,
    ) -> f64 {
        // Negative weights subtract duplicates.
        let Some(force) = self.of(vertices).filter(|_| weight > 0.0) else { return law.curvature };
        let least = SAME_GAP * barrier.reach;
        if (force + law.slope).abs() <= law.curvature * least {
            return law.curvature;
        }
        let gap = distance - barrier.offset;
        let end = barrier.gap_of_force(force, weight, gap);
        if (end - gap).abs() <= least { law.curvature } else { (force + law.slope) / (gap - end) }
    }

    /// `K` [N/m] of a pack of pairs at the distances `d` [m], where their laws are known.
    #[inline(always)]
    pub(crate) fn stiffnesses<L: Lanes, const N: usize>(
        &mut self,
        pairs: &[WeightedPair<N>],
        barrier: &Barrier,
        distance: L,
        law: &EnergyOfGap<L>,
    ) -> L {
        let distance = distance.to_array();
        let [energy, slope] = [law.energy.to_array(), law.slope.to_array()];
        let mut curvature = law.curvature.to_array();
        for lane in 0..pairs.len() {
            let WeightedPair { vertices, weight } = &pairs[lane];
            let law = EnergyOfGap { energy: energy[lane], slope: slope[lane], curvature: curvature[lane] };
            curvature[lane] = self.chord(vertices, barrier, (distance[lane], *weight), &law);
        }
        L::load(&curvature)
    }
}

/// Visitor of the contacts of a matrix that records the forces its solution predicts.
pub(crate) struct ForceForecast<'a> {
    /// Forces that were predicted when the matrix was assembled.
    before: ExpectedInTurn<'a>,
    /// The solution, flat `(n, D)` [m].
    step: &'a [f64],
    found: Vec<(ContactKey, f64)>,
}

impl<'a> ForceForecast<'a> {
    pub(crate) fn new(before: &'a ExpectedForces, step: &'a [f64]) -> Self {
        ForceForecast { before: ExpectedInTurn::new(before), step, found: vec![] }
    }

    /// Forces of all contacts visited.
    pub(crate) fn end(self) -> ExpectedForces {
        ExpectedForces::of_contacts(self.found)
    }

    fn note(&mut self, vertices: &[u32], barrier: &Barrier, (distance, change): (f64, f64), weight: f64) {
        let law = barrier.at_signed(distance, weight);
        let stiffness = self.before.chord(vertices, barrier, (distance, weight), &law);
        self.found.push((key(vertices), -law.slope - stiffness * change));
    }
}

impl<const D: usize> PackVisitor<D> for ForceForecast<'_> {
    #[inline(always)]
    fn pack<L: Lanes, const N: usize, const P: usize>(
        &mut self,
        pairs: &[WeightedPair<N>],
        geometry: &PairGeometry<L, D, N, P>,
        law: &ContactLaw,
        weight: L,
    ) {
        let mut vertices = [pairs[pairs.len() - 1].vertices; WIDTH];
        for lane in 0..pairs.len() {
            vertices[lane] = pairs[lane].vertices;
        }
        let step = load_rows::<L, D, N>(self.step, &vertices);
        let mut change = geometry.coefficients[0] * dot(&geometry.normal, &step[0]);
        for i in 1..N {
            change += geometry.coefficients[i] * dot(&geometry.normal, &step[i]);
        }
        let of_gap = law.barrier.by_gap(geometry.distance, weight);
        let stiffness = self.before.stiffnesses(pairs, &law.barrier, geometry.distance, &of_gap);
        let forces = (-of_gap.slope - stiffness * change).to_array();
        for lane in 0..pairs.len() {
            self.found.push((key(&vertices[lane]), forces[lane]));
        }
    }

    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64) {
        let [p, o] = rows::<D, 2>(self.step, vertices);
        let change = dot(&plane.normal, &difference(&p, &o));
        self.note(vertices, &law.barrier, (plane.distance, change), weight);
    }

    /// Does nothing: nearly parallel edges keep their tangents.
    fn mollified(&mut self, _: &MollifiedPair, _: &[[f64; 3]; 4], _: &ContactLaw) {}
}
