//! Forces by their kinds, as parameters look at them.

use pliant::energy::EnergyKind;
use pliant::system::System;

use crate::adjoint::AdjointPlace;
use crate::parameter::{Parameter, ParameterNeeds};

/// Forces of a place that some parameter [asks for](Parameter::needs); the others stay empty.
pub(crate) struct ForceParts {
    needs_force: bool,
    needs_contact: bool,
    /// Gradient of the energy and of damping beside that by masses [N].
    pub(crate) gradient: Vec<f64>,
    /// Gradient of contact, and of friction [N].
    pub(crate) contact: Vec<f64>,
    pub(crate) friction: Vec<f64>,
    /// Gradients of terms by their names [N].
    pub(crate) terms: Vec<(String, Vec<f64>)>,
}

impl ForceParts {
    /// Parts that these parameters look at.
    pub(crate) fn new(parameters: &[Box<dyn Parameter>]) -> Self {
        let needs = ParameterNeeds::of_all(parameters.iter().map(|parameter| parameter.needs()));
        let mut names = needs.terms;
        names.sort_unstable();
        names.dedup();
        ForceParts {
            terms: names.into_iter().map(|name| (name.to_owned(), vec![])).collect(),
            needs_force: needs.force,
            needs_contact: needs.contact,
            gradient: vec![],
            contact: vec![],
            friction: vec![],
        }
    }

    /// Takes them at a place, whose time the system has.
    pub(crate) fn evaluate(&mut self, system: &mut System, at: AdjointPlace<'_>) {
        let ForceParts { needs_force, needs_contact, gradient, contact, friction, terms } = self;
        for (name, rows) in terms {
            rows.clear();
            rows.resize(at.x.len(), 0.0);
            system
                .terms_mut()
                .filter(|term| term.name() == *name)
                .for_each(|term| term.add_gradient(at.x, rows));
            for term in system.dissipation_mut().filter(|term| term.name() == *name) {
                term.evaluate(at.x, at.v);
                term.add_rows(0, rows);
            }
        }
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
