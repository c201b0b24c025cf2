//! Numbers that those of another parameter depend on.

use pliant::system::System;

use super::{ForceUse, HeldChange, HeldUse, ModeUse, Parameter, ParameterNeeds, StateUse};

/// Numbers `theta_j` that the numbers of another parameter grow with, `d theta_i = sum_j w_ij d theta_j`.
pub struct Weighted {
    of: Box<dyn Parameter>,
    links: Vec<NumberLink>,
    numbers: usize,
    derivative: Vec<f64>,
}

/// Growth of a number with one that it depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberLink {
    /// Index of the number.
    pub number: usize,
    /// Index of that which it depends on.
    pub with: usize,
    /// Its derivative by that.
    pub weight: f64,
}

impl Weighted {
    /// The number that those `of` a parameter grow with by these weights.
    ///
    /// # Panics
    /// If there are more or fewer weights than numbers.
    pub fn new(of: Box<dyn Parameter>, weights: Vec<f64>) -> Self {
        assert_eq!(of.len(), weights.len(), "one weight for each number");
        let link = |(number, weight)| NumberLink { number, with: 0, weight };
        Weighted::linked(of, weights.into_iter().enumerate().map(link).collect(), 1)
    }

    /// So many `numbers` that those `of` a parameter grow with.
    ///
    /// # Panics
    /// If a link is to a number that there is not.
    pub fn linked(of: Box<dyn Parameter>, links: Vec<NumberLink>, numbers: usize) -> Self {
        let is_known = |link: &NumberLink| link.number < of.len() && link.with < numbers;
        assert!(links.iter().all(is_known), "links are between numbers");
        Weighted { derivative: vec![0.0; of.len()], of, links, numbers }
    }

    /// Changes of the numbers of the other parameter with those of these.
    fn changes(&self, change: &[f64]) -> Vec<f64> {
        let mut changes = vec![0.0; self.of.len()];
        self.links.iter().for_each(|link| changes[link.number] += link.weight * change[link.with]);
        changes
    }

    /// Adds what `add` makes of the numbers of the other parameter to the derivatives by these.
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
