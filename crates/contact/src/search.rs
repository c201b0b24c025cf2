//! Search of contacts, with what was found last: energy, friction and matrix ask at the same places.

use std::sync::Arc;

use crate::candidates::{CandidateCache, CandidatePairs};
use crate::contacts::Contacts;
use crate::expected::ExpectedForces;
use crate::model::ContactModel;
use crate::surface::ContactSurface;

/// Candidates within these parts of the largest reach and of a typical edge beyond the reach, at least, are
/// kept for positions to come.
const LEAST_MARGIN: [f64; 2] = [0.5, 0.05];
/// Candidates are not gathered from farther than this part of a typical edge, however fast things move.
const LARGEST_MARGIN: f64 = 0.1;

/// Contacts at the positions last asked for.
#[derive(Debug)]
pub(crate) struct ContactSearch<const D: usize> {
    cache: CandidateCache<D>,
    at: Vec<f64>,
    contacts: Contacts,
    /// Distance that vertices may move until candidates are gathered anew [m].
    margin: f64,
    least_margin: f64,
    largest_margin: f64,
    /// Largest gap at which surfaces act [m].
    pub(crate) reach: f64,
    /// Forces that the last linear solution of a solve under way expects; none before and after.
    pub(crate) expected: Arc<ExpectedForces>,
}

/// Root of the mean squared length of the edges of a surface at rest [m].
pub(crate) fn typical_edge(surface: &ContactSurface) -> f64 {
    let lengths = &surface.squared_lengths;
    (lengths.iter().sum::<f64>() / lengths.len().max(1) as f64).sqrt()
}

impl<const D: usize> ContactSearch<D> {
    pub(crate) fn new(model: &ContactModel) -> Self {
        let reach = model.surface_reach();
        let typical = typical_edge(&model.surface);
        let [of_reach, of_edge] = LEAST_MARGIN;
        let least_margin = (of_reach * reach).max(of_edge * typical);
        let largest_margin = (LARGEST_MARGIN * typical).max(least_margin);
        ContactSearch {
            cache: CandidateCache::default(),
            at: vec![],
            contacts: Contacts::default(),
            margin: least_margin,
            least_margin,
            largest_margin,
            reach,
            expected: Arc::default(),
        }
    }

    /// Says how far vertices are likely to move in the steps to come [m].
    pub(crate) fn expect_motion(&mut self, motion: f64) {
        self.margin = motion.clamp(self.least_margin, self.largest_margin);
    }

    /// Contacts at `x`, flat `(n, D)` [m].
    pub(crate) fn contacts_at(&mut self, model: &ContactModel, x: &[f64]) -> &Contacts {
        if self.at != x {
            let reach = self.reach;
            let candidates = self.candidates_at(model, x);
            self.contacts = Contacts::find::<D>(model, candidates, x, reach);
            self.at.clear();
            self.at.extend_from_slice(x);
        }
        &self.contacts
    }

    /// Candidates for contacts at `x`, flat `(n, D)` [m].
    pub(crate) fn candidates_at(&mut self, model: &ContactModel, x: &[f64]) -> &CandidatePairs {
        self.cache.at(&model.surface, &model.pairs, x, self.reach, self.margin)
    }

    /// Candidates that hold all pairs within `near` [m] on the way from `x` to `x + dx`: those at hand where
    /// they do.
    pub(crate) fn on_way(
        &mut self,
        model: &ContactModel,
        way: (&[f64], &[f64]),
        near: f64,
    ) -> &CandidatePairs {
        self.cache.on_way(&model.surface, &model.pairs, way, near, (self.reach, self.margin))
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        8 * self.at.len() + self.cache.bytes() + 48 * self.contacts.len() + self.expected.bytes()
    }
}
