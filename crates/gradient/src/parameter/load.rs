//! Values of loads.

use pliant::energy::LoadTerm;
use pliant::system::System;
use pliant_scene::OverTime;

use super::{ForceUse, Parameter, ParameterNeeds};
use crate::adjoint::add_scaled;

/// The value of a load, a vector, a pressure or the tension of a muscle: derivatives by what is added to each
/// of its components, everywhere on the load and at all times.
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

/// A number that the formulas of a load, or of a muscle, name after `where`; that of all components where
/// several name it.
#[derive(Clone, Debug)]
pub struct FormulaNumber {
    term: NamedLoad,
    /// Components of the value.
    formulas: Vec<OverTime>,
    name: String,
}

/// Rest positions of vertices of a body as loads go by them: by areas of faces, and by the places of
/// formulas.
#[derive(Clone, Debug)]
pub struct LoadShape {
    term: NamedLoad,
    dimension: usize,
    /// Numbers of the vertices in the simulation.
    vertices: Vec<u32>,
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

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { loads: vec![&self.name], ..ParameterNeeds::default() }
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

impl FormulaNumber {
    /// Of this name, in the components of the value of the load `term`.
    pub fn new(term: String, formulas: Vec<OverTime>, name: String) -> Self {
        FormulaNumber { term: NamedLoad::new(term), formulas, name }
    }
}

impl LoadShape {
    /// Of the load of this name, which [knows of its shape](LoadTerm::add_work_by_shape), on the body of
    /// these vertices, by their numbers in the simulation, in `dimension` dimensions.
    pub fn new(term: String, dimension: usize, vertices: Vec<u32>) -> Self {
        LoadShape { term: NamedLoad::new(term), dimension, vertices }
    }
}

impl Parameter for LoadShape {
    fn len(&self) -> usize {
        self.vertices.len() * self.dimension
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        self.term.needs()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let d = self.dimension;
        let mut rows = vec![0.0; force.len()];
        for (vertex, change) in self.vertices.iter().zip(change.chunks_exact(d)) {
            rows[*vertex as usize * d..][..d].copy_from_slice(change);
        }
        self.term.find(of.system).is_some_and(|load| load.add_force_by_shape(of.x, &rows, force))
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let d = self.dimension;
        let mut rows = vec![0.0; of.p.len()];
        if let Some(load) = self.term.find(of.system) {
            load.add_work_by_shape(of.x, of.p, &mut rows);
        }
        for (vertex, derivative) in self.vertices.iter().zip(derivative.chunks_exact_mut(d)) {
            add_scaled(derivative, 1.0, &rows[*vertex as usize * d..][..d]);
        }
    }
}

impl Parameter for FormulaNumber {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        self.term.needs()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let FormulaNumber { term, formulas, name } = self;
        if let Some(load) = term.find(of.system) {
            let rate = |place, time| rate(formulas, name, place, time).map(|rate| rate * change[0]);
            load.add_force_of(&rate, of.x, force);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let FormulaNumber { term, formulas, name } = self;
        if let Some(load) = term.find(of.system) {
            derivative[0] += load.work_of(&|place, time| rate(formulas, name, place, time), of.x, of.p);
        }
    }
}

/// Derivatives of the components of a value by the number `name` at a place [m] and a time [s].
fn rate(formulas: &[OverTime], name: &str, place: [f64; 3], time: f64) -> [f64; 3] {
    let mut rate = [0.0; 3];
    let components = rate.iter_mut().zip(formulas);
    components.for_each(|(rate, formula)| *rate = formula.derivative(name, place, time));
    rate
}

impl Parameter for LoadValue {
    fn len(&self) -> usize {
        self.components
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        self.term.needs()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        if let Some(load) = self.term.find(of.system) {
            load.add_force_by(change, of.x, force);
        }
        true
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

    fn needs(&self) -> ParameterNeeds<'_> {
        self.term.needs()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        if let Some(load) = self.term.find(of.system) {
            let mut whole = vec![0.0; force.len()];
            load.add_force(of.x, &mut whole);
            add_scaled(force, change[0], &whole);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        if let Some(load) = self.term.find(of.system) {
            derivative[0] += load.work(of.x, of.p);
        }
    }
}
