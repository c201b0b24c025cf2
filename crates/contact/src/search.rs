//! Cached contact search: energy, friction and matrix ask for the same positions.

use std::sync::Arc;

use crate::candidates::{CandidateCache, CandidatePairs};
use crate::contacts::Contacts;
use crate::expected::ExpectedForces;
use crate::model::ContactModel;
use crate::surface::ContactSurface;

/// Smallest margin: these fractions of the largest activation distance and of a typical edge length,
/// whichever is larger.
const LEAST_MARGIN: [f64; 2] = [0.5, 0.05];
/// Largest margin as a fraction of a typical edge length, however fast bodies move.
const LARGEST_MARGIN: f64 = 0.1;

/// Search with the contacts at the last positions.
#[derive(Debug)]
pub(crate) struct ContactSearch<const D: usize> {
    cache: CandidateCache<D>,
    at: Vec<f64>,
    contacts: Contacts,
    /// Distance that vertices may move before the next search [m].
    margin: f64,
    least_margin: f64,
    largest_margin: f64,
    /// Largest activation distance of surfaces [m].
    pub(crate) reach: f64,
    /// Forces predicted by the last linear solution of the current solve; empty otherwise.
    pub(crate) expected: Arc<ExpectedForces>,
}

/// Root mean square reference length of the edges of a surface [m].
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

    /// Sets the margin from the expected motion of vertices in the next steps [m].
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

    /// Candidate pairs at `x`, flat `(n, D)` [m].
    pub(crate) fn candidates_at(&mut self, model: &ContactModel, x: &[f64]) -> &CandidatePairs {
        self.cache.at(&model.surface, &model.pairs, x, self.reach, self.margin)
    }

    /// Candidates with all pairs within `near` [m] on the path from `x` to `x + dx`; reuses stored ones
    /// if complete.
    pub(crate) fn on_way(
        &mut self,
        model: &ContactModel,
        way: (&[f64], &[f64]),
        near: f64,
    ) -> &CandidatePairs {
        self.cache.on_way(&model.surface, &model.pairs, way, near, (self.reach, self.margin))
    }
}
