//! Forces by kind, as parameters need them.

use pliant::energy::{EnergyKind, EnergyTerm};
use pliant::system::System;

use crate::GradientError;
use crate::adjoint::AdjointPlace;
use crate::parameter::{Parameter, ParameterNeeds, shaped};

/// Forces at an evaluation point that some parameter [needs](Parameter::needs); the others stay empty.
pub(crate) struct ForceParts {
    needs_force: bool,
    needs_contact: bool,
    /// Gradient of the energy and of damping, without mass-proportional damping [N].
    pub(crate) gradient: Vec<f64>,
    /// Gradient of contact, and of friction [N].
    pub(crate) contact: Vec<f64>,
    pub(crate) friction: Vec<f64>,
    /// Gradients of terms by name [N].
    pub(crate) terms: Vec<(String, Vec<f64>)>,
    /// Derivatives of the gradients of terms by their rest lengths [N/m].
    pub(crate) rest_lengths: Vec<(String, Vec<f64>)>,
    /// Indices of `terms` among the energy and the dissipative terms of the system, once looked up.
    places: Vec<[Vec<usize>; 2]>,
}

impl ForceParts {
    /// Forces that these parameters need.
    pub(crate) fn new(parameters: &[Box<dyn Parameter>]) -> Self {
        let needs = ParameterNeeds::of_all(parameters.iter().map(|parameter| parameter.needs()));
        let mut names = needs.terms;
        names.sort_unstable();
        names.dedup();
        ForceParts {
            terms: names.into_iter().map(|name| (name.to_owned(), vec![])).collect(),
            rest_lengths: needs.rest_lengths.into_iter().map(|name| (name.to_owned(), vec![])).collect(),
            places: vec![],
            needs_force: needs.force,
            needs_contact: needs.contact,
            gradient: vec![],
            contact: vec![],
            friction: vec![],
        }
    }

    /// Evaluates the forces; the system's time must be set.
    pub(crate) fn evaluate(&mut self, system: &mut System, at: AdjointPlace<'_>) {
        let ForceParts { needs_force, needs_contact, gradient, contact, friction, .. } = self;
        let (terms, places) = (&mut self.terms, &mut self.places);
        // Named terms.
        if places.is_empty() {
            places.extend(terms.iter().map(|(name, _)| places_of(system, name)));
        }
        for ((_, rows), [energies, dissipation]) in terms.iter_mut().zip(places) {
            rows.clear();
            rows.resize(at.x.len(), 0.0);
            for (_, term) in system.terms_mut().enumerate().filter(|(i, _)| energies.contains(i)) {
                term.add_gradient(at.x, rows);
            }
            for (_, term) in system.dissipation_mut().enumerate().filter(|(i, _)| dissipation.contains(i)) {
                term.evaluate(at.x, at.v);
                term.add_rows(0, rows);
            }
        }
        // Rest lengths of attachments.
        for (name, rows) in &mut self.rest_lengths {
            rows.clear();
            rows.resize(at.x.len(), 0.0);
            let mut tied = system.terms_mut().filter(|term| term.name() == *name);
            if let Some(ties) = tied.find_map(|term| term.ties()) {
                ties.add_gradient_by_rest_length(at.x, rows);
            }
        }
        // Total force, and contact with friction.
        if *needs_force {
            gradient.resize(at.x.len(), 0.0);
            system.gradient(at.x, gradient);
            for term in system.dissipation_mut().filter(|term| term.vertex_drag().is_none()) {
                term.evaluate(at.x, at.v);
                term.add_rows(0, gradient);
            }
        }
        if *needs_contact {
            for rows in [&mut *contact, &mut *friction] {
                rows.clear();
                rows.resize(at.x.len(), 0.0);
            }
            for term in system.terms_mut().filter(|term| term.properties().kind == EnergyKind::Contact) {
                term.add_gradient(at.x, contact);
            }
            for term in system.dissipation_mut().filter(|term| term.changing().is_some()) {
                term.evaluate(at.x, at.v);
                term.add_rows(0, friction);
            }
        }
    }
}

/// Indices of the terms with this name, among the energy and among the dissipative terms.
fn places_of(system: &System, name: &str) -> [Vec<usize>; 2] {
    let energies = system.terms().iter().map(|term| term.name());
    let dissipation = system.dissipation().iter().map(|term| term.name());
    let of_name = |(i, found): (usize, String)| (found == name).then_some(i);
    [
        energies.enumerate().filter_map(of_name).collect(),
        dissipation.enumerate().filter_map(of_name).collect(),
    ]
}

/// Refuses parameters of terms that the system does not have: their derivatives would be zero.
///
/// # Errors
/// [`GradientError::Term`].
pub(crate) fn check_terms(
    system: &mut System,
    parameters: &[Box<dyn Parameter>],
) -> Result<(), GradientError> {
    let needs = ParameterNeeds::of_all(parameters.iter().map(|parameter| parameter.needs()));
    let mut has = |name: &str, is_such: fn(&mut dyn EnergyTerm) -> bool| {
        system.terms_mut().any(|term| term.name() == name && is_such(&mut **term))
    };
    let is_no_load = |name: &&str| !has(name, |term| term.load().is_some());
    let missing = needs.loads.into_iter().find(is_no_load);
    let is_no_tie = |name: &&str| !has(name, |term| term.ties().is_some());
    let missing = missing.or_else(|| needs.rest_lengths.into_iter().find(is_no_tie));
    if needs.shaped_contact && shaped(system).is_none() {
        if system.terms().iter().any(|term| term.touching().is_some()) {
            let what = "the reference shape of a body whose self-contact distance depends on that shape";
            let remedy =
                "give a [contact] `distance` below half of its smallest reference gap, or `self = false`";
            return Err(GradientError::Unsupported { what: what.into(), remedy });
        }
        return Err(GradientError::Term { name: "contact".into() });
    }
    let is_unknown = |name: &&str| places_of(system, name).iter().all(Vec::is_empty);
    let missing = missing.or_else(|| needs.terms.into_iter().find(is_unknown));
    missing.map_or(Ok(()), |name| Err(GradientError::Term { name: name.to_owned() }))
}
