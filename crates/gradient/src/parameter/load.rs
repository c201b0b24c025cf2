//! Parameters of loads.

use pliant::energy::LoadTerm;
use pliant::system::System;
use pliant_scene::OverTime;

use super::{ForceUse, Parameter, ParameterNeeds};
use crate::adjoint::add_scaled;

/// Value of a load: a vector, a pressure or the tension of a muscle. Derivatives are by a constant added
/// to each component, everywhere on the load and at all times.
#[derive(Clone, Debug)]
pub struct LoadValue {
    term: NamedLoad,
    components: usize,
}

/// Factor of a load, 1 in the scene, which multiplies its formula.
#[derive(Clone, Debug)]
pub struct LoadFactor {
    term: NamedLoad,
}

/// Parameter of the formulas of a load or a muscle, named after `where`; common to all components that
/// use it.
#[derive(Clone, Debug)]
pub struct FormulaNumber {
    term: NamedLoad,
    /// Components of the value.
    formulas: Vec<OverTime>,
    name: String,
}

/// Reference positions of a body's vertices, on which loads depend through face areas and positions in
/// formulas.
#[derive(Clone, Debug)]
pub struct LoadShape {
    term: NamedLoad,
    dimension: usize,
    /// Indices of the vertices in the simulation.
    vertices: Vec<u32>,
}

/// Load of a system, identified by the name of its term.
#[derive(Clone, Debug)]
struct NamedLoad {
    name: String,
    /// Index of the term, once it has been found.
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
    /// Value of the load with this name and number of components.
    pub fn new(name: String, components: usize) -> Self {
        LoadValue { term: NamedLoad::new(name), components }
    }
}

impl LoadFactor {
    /// Factor of the load with this name.
    pub fn new(name: String) -> Self {
        LoadFactor { term: NamedLoad::new(name) }
    }
}

impl FormulaNumber {
    /// Parameter with this name in the components of the load `term`.
    pub fn new(term: String, formulas: Vec<OverTime>, name: String) -> Self {
        FormulaNumber { term: NamedLoad::new(term), formulas, name }
    }
}

impl LoadShape {
    /// Shape parameter of the load `term`, which must [support it](LoadTerm::add_work_by_shape). The body
    /// has these vertices, by index in the simulation, in `dimension` dimensions.
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

/// Derivatives of the components of a value by the parameter `name` at a position [m] and a time [s].
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
