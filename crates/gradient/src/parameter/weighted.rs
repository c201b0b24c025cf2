//! Linear dependence of a parameter's numbers on others.

use pliant::system::System;

use super::{ForceUse, HeldChange, HeldUse, ModeUse, Parameter, ParameterNeeds, StateUse};

/// Numbers `theta_j` on which the numbers of another parameter depend linearly, `d theta_i = sum_j w_ij d
/// theta_j`.
pub struct Weighted {
    of: Box<dyn Parameter>,
    links: Vec<NumberLink>,
    numbers: usize,
    derivative: Vec<f64>,
}

/// Entry of the linear dependence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberLink {
    /// Index of the dependent number.
    pub number: usize,
    /// Index of the number that it depends on.
    pub with: usize,
    /// Derivative.
    pub weight: f64,
}

impl Weighted {
    /// Single number on which the numbers of the parameter `of` depend with these weights.
    ///
    /// # Panics
    /// If the number of weights is not that of the numbers.
    pub fn new(of: Box<dyn Parameter>, weights: Vec<f64>) -> Self {
        assert_eq!(of.len(), weights.len(), "one weight for each number");
        let link = |(number, weight)| NumberLink { number, with: 0, weight };
        Weighted::linked(of, weights.into_iter().enumerate().map(link).collect(), 1)
    }

    /// Vector of `numbers` numbers on which those of the parameter `of` depend through the links.
    ///
    /// # Panics
    /// If a link refers to a number that does not exist.
    pub fn linked(of: Box<dyn Parameter>, links: Vec<NumberLink>, numbers: usize) -> Self {
        let is_known = |link: &NumberLink| link.number < of.len() && link.with < numbers;
        assert!(links.iter().all(is_known), "links are between numbers");
        Weighted { derivative: vec![0.0; of.len()], of, links, numbers }
    }

    /// Changes of the other parameter's numbers due to changes of these.
    fn changes(&self, change: &[f64]) -> Vec<f64> {
        let mut changes = vec![0.0; self.of.len()];
        self.links.iter().for_each(|link| changes[link.number] += link.weight * change[link.with]);
        changes
    }

    /// Converts the derivatives that `add` computes for the other parameter to derivatives by these
    /// numbers, and adds them.
    fn add_by<T>(
        &mut self,
        derivative: &mut [f64],
        add: impl FnOnce(&mut dyn Parameter, &mut [f64]) -> T,
    ) -> T {
        self.derivative.fill(0.0);
        let added = add(&mut *self.of, &mut self.derivative);
        for link in &self.links {
            derivative[link.with] += link.weight * self.derivative[link.number];
        }
        added
    }
}

impl Parameter for Weighted {
    fn begin(&mut self, steps: u64) {
        self.of.begin(steps);
    }

    fn len(&self) -> usize {
        self.numbers
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        self.of.needs()
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        self.add_by(derivative, |parameter, derivative| parameter.add_held(of, derivative));
    }

    fn add_state(&mut self, of: &StateUse<'_>, derivative: &mut [f64]) {
        self.add_by(derivative, |parameter, derivative| parameter.add_state(of, derivative));
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        self.add_by(derivative, |parameter, derivative| parameter.add_mode(of, derivative))
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let changes = self.changes(change);
        self.of.add_change(of, &changes, force)
    }

    fn add_held_change(&mut self, system: &System, time: f64, change: &[f64], place: HeldChange<'_>) {
        let changes = self.changes(change);
        self.of.add_held_change(system, time, &changes, place);
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        self.add_by(derivative, |parameter, derivative| parameter.add(of, derivative));
    }
}
