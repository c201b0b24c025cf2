//! Numbers that forces depend on in several ways.

use super::{ForceUse, HeldUse, ModeUse, Parameter, StateUse};

/// Numbers whose derivatives are sums of those by the same numbers of other parameters.
pub struct Together {
    parts: Vec<Box<dyn Parameter>>,
}

impl Together {
    /// The numbers of these parts, which all have as many.
    pub fn new(parts: Vec<Box<dyn Parameter>>) -> Self {
        Together { parts }
    }
}

impl Parameter for Together {
    fn begin(&mut self, steps: u64) {
        self.parts.iter_mut().for_each(|part| part.begin(steps));
    }

    fn add_state(&mut self, of: &StateUse<'_>, derivative: &mut [f64]) {
        self.parts.iter_mut().for_each(|part| part.add_state(of, derivative));
    }

    fn len(&self) -> usize {
        self.parts.first().map_or(0, |part| part.len())
    }

    fn needs_force(&self) -> bool {
        self.parts.iter().any(|part| part.needs_force())
    }

    fn needs_contact(&self) -> bool {
        self.parts.iter().any(|part| part.needs_contact())
    }

    fn looks_at_held(&self) -> bool {
        self.parts.iter().any(|part| part.looks_at_held())
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        self.parts.iter_mut().for_each(|part| part.add_held(of, derivative));
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        self.parts.iter_mut().all(|part| part.add_mode(of, derivative))
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        self.parts.iter_mut().all(|part| part.add_change(of, change, force))
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        self.parts.iter_mut().for_each(|part| part.add(of, derivative));
    }
}
