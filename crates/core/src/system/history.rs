//! History of terms: internal variables from earlier steps.

use super::System;
use crate::energy::HistoryTerm;

impl System {
    fn remembering(&self) -> impl Iterator<Item = &dyn HistoryTerm> {
        self.terms.iter().filter_map(|term| term.elements()?.history())
    }

    fn remembering_mut(&mut self) -> impl Iterator<Item = &mut dyn HistoryTerm> {
        self.terms.iter_mut().filter_map(|term| term.driven()?.history_mut())
    }

    /// True if a term has [history](crate::energy::HistoryTerm).
    pub fn remembers(&self) -> bool {
        self.remembers
    }

    /// Returns the history of all terms, one term after the other.
    pub fn history(&self) -> Vec<f64> {
        self.remembering().flat_map(|term| term.history()).collect()
    }

    /// Number of entries of the [history](Self::history).
    pub fn history_len(&self) -> usize {
        self.remembering().map(|term| term.history_len()).sum()
    }

    /// Sets the history at the time `time` [s]; returns false without changes if the count does not fit.
    pub fn set_history(&mut self, mut numbers: &[f64], time: f64) -> bool {
        if numbers.len() != self.history_len() {
            return false;
        }
        for term in self.remembering_mut() {
            let (own, others) = numbers.split_at(term.history_len());
            term.set_history(own, time);
            numbers = others;
        }
        true
    }

    /// Ends a step at the positions `x` and the time `time` [s]; returns the energy lost there [J].
    pub(crate) fn commit(&mut self, x: &[f64], time: f64) -> f64 {
        self.remembering_mut().map(|term| term.commit(x, time)).sum()
    }

    /// Returns the power that terms with history lose at fixed positions [W].
    pub(crate) fn forgotten_power(&self, x: &[f64]) -> f64 {
        self.remembering().map(|term| term.loss_rate(x)).sum()
    }

    /// Adds the derivatives of `p . dE/dx` at `x` with respect to the [history](Self::history).
    pub fn add_work_by_history(&self, x: &[f64], p: &[f64], mut by: &mut [f64]) {
        for term in self.remembering() {
            let (own, others) = by.split_at_mut(term.history_len());
            term.add_work_by_history(x, p, own);
            by = others;
        }
    }

    /// Propagates derivatives `after` with respect to the history at the end of a step to `x` backwards,
    /// at the time last set: adds those with respect to the positions, and returns those with respect to
    /// the current history.
    pub fn commit_transposed(&self, x: &[f64], mut after: &[f64], by_x: &mut [f64]) -> Vec<f64> {
        let mut before = vec![0.0; after.len()];
        let mut left = &mut before[..];
        for term in self.remembering() {
            let (own, others) = left.split_at_mut(term.history_len());
            let (own_after, others_after) = after.split_at(own.len());
            term.add_commit_transposed(x, own_after, by_x, own);
            (left, after) = (others, others_after);
        }
        before
    }
}
