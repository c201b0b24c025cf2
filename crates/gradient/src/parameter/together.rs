//! Combined parameters: sums of several dependences on the same numbers, and concatenation.

use pliant::system::System;

use super::{ForceUse, HeldChange, HeldUse, ModeUse, Parameter, ParameterNeeds, StateUse};

/// Numbers whose derivatives are sums of those by the same numbers of other parameters.
pub struct Together {
    parts: Vec<Box<dyn Parameter>>,
}

impl Together {
    /// Sum of these parts, which must have equal lengths.
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

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds::of_all(self.parts.iter().map(|part| part.needs()))
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        self.parts.iter_mut().for_each(|part| part.add_held(of, derivative));
    }

    fn add_held_change(&mut self, system: &System, time: f64, change: &[f64], place: HeldChange<'_>) {
        let HeldChange { x, v } = place;
        for part in &mut self.parts {
            part.add_held_change(system, time, change, HeldChange { x: &mut *x, v: &mut *v });
        }
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

/// Numbers of several parameters, concatenated.
pub struct Concatenated {
    parts: Vec<Box<dyn Parameter>>,
}

impl Concatenated {
    /// Concatenates these parts in order.
    pub fn new(parts: Vec<Box<dyn Parameter>>) -> Self {
        Concatenated { parts }
    }

    /// Calls `each` with every part and its index range; true if every call returns true.
    fn all(&mut self, mut each: impl FnMut(&mut dyn Parameter, std::ops::Range<usize>) -> bool) -> bool {
        let mut first = 0;
        self.parts.iter_mut().all(|part| {
            let numbers = first..first + part.len();
            first = numbers.end;
            each(&mut **part, numbers)
        })
    }
}

impl Parameter for Concatenated {
    fn begin(&mut self, steps: u64) {
        self.parts.iter_mut().for_each(|part| part.begin(steps));
    }

    fn add_state(&mut self, of: &StateUse<'_>, derivative: &mut [f64]) {
        self.all(|part, numbers| {
            part.add_state(of, &mut derivative[numbers]);
            true
        });
    }

    fn len(&self) -> usize {
        self.parts.iter().map(|part| part.len()).sum()
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds::of_all(self.parts.iter().map(|part| part.needs()))
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        self.all(|part, numbers| {
            part.add_held(of, &mut derivative[numbers]);
            true
        });
    }

    fn add_held_change(&mut self, system: &System, time: f64, change: &[f64], place: HeldChange<'_>) {
        let HeldChange { x, v } = place;
        self.all(|part, numbers| {
            part.add_held_change(system, time, &change[numbers], HeldChange { x: &mut *x, v: &mut *v });
            true
        });
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        self.all(|part, numbers| part.add_mode(of, &mut derivative[numbers]))
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        self.all(|part, numbers| part.add_change(of, &change[numbers], force))
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        self.all(|part, numbers| {
            part.add(of, &mut derivative[numbers]);
            true
        });
    }
}
