//! Values of loads.

use pliant::energy::LoadTerm;
use pliant::system::System;

use super::{ForceUse, Parameter};

/// The value of a load, a vector or a pressure: derivatives by what is added to each of its components,
/// everywhere on the load and at all times.
#[derive(Clone, Debug)]
pub struct LoadValue {
    term: NamedLoad,
    components: usize,
}

/// A factor of a load, 1 as the scene has it: of its formula where it changes with time.
#[derive(Clone, Debug)]
pub struct LoadFactor {
    term: NamedLoad,
}

/// A load of a system by the name of its term.
#[derive(Clone, Debug)]
struct NamedLoad {
    name: String,
    /// Place among the terms, once it has been found.
    place: Option<usize>,
}

impl NamedLoad {
    fn new(name: String) -> Self {
        NamedLoad { name, place: None }
    }

    fn find<'s>(&mut self, system: &'s System) -> Option<&'s dyn LoadTerm> {
        let place = || system.terms().iter().position(|term| term.name() == self.name);
        self.place = self.place.or_else(place);
        system.terms().get(self.place?)?.load()
    }
}

impl LoadValue {
    /// Of the load of this name, of so many components.
    pub fn new(name: String, components: usize) -> Self {
        LoadValue { term: NamedLoad::new(name), components }
    }
}

impl LoadFactor {
    /// Of the load of this name.
    pub fn new(name: String) -> Self {
        LoadFactor { term: NamedLoad::new(name) }
    }
}

impl Parameter for LoadValue {
    fn len(&self) -> usize {
        self.components
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        if let Some(load) = self.term.find(of.system) {
            load.add_unit_works(of.x, of.p, derivative);
        }
    }
}

impl Parameter for LoadFactor {
    fn len(&self) -> usize {
        1
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        if let Some(load) = self.term.find(of.system) {
            derivative[0] += load.work(of.x, of.p);
        }
    }
}
