//! Terms that come and go, that guard ways, and whose stencils change.

use super::{ForceId, System, fresh};
use crate::constraint::Hold;
use crate::energy::{
    ChangingStencils, ContactExtremes, EnergyTerm, Fault, ObstructedMotion, TouchingSurfaces,
    WatchedContacts, WayObstruction,
};

/// Tells one term from any other in this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TermId(pub(super) u64);

/// True if the matrix has a place for the second derivatives of a term.
fn has_blocks(term: &mut dyn EnergyTerm) -> bool {
    !term.stencils().vertices.is_empty() || term.changing().is_some()
}

impl System {
    /// Takes note of what the terms are now.
    pub(super) fn terms_changed(&mut self) {
        self.changes_with_time = self.terms.iter().any(|term| term.properties().changes_with_time);
        self.remembers = self.terms.iter().any(|term| term.properties().remembers);
        self.has_guards = self.terms.iter().any(|term| term.limit().is_some_and(|limit| limit.guards_way()));
        self.is_watched = self.terms.iter().any(|term| term.watched().is_some());
        let changing = self.terms.iter().any(|term| term.changing().is_some())
            || self.dissipation.iter().any(|term| term.changing().is_some());
        self.changing = changing.then(fresh);
    }

    /// The first term for which `asked` holds.
    pub fn find_term(&self, asked: impl Fn(&dyn EnergyTerm) -> bool) -> Option<TermId> {
        let found = self.terms.iter().position(|term| asked(term.as_ref()))?;
        Some(self.ids[found])
    }

    /// Puts `term` in the place of another, which keeps its identity; without a term, that one is gone.
    pub(crate) fn replace_term(&mut self, id: TermId, term: Option<Box<dyn EnergyTerm>>) {
        let Some(i) = self.ids.iter().position(|other| *other == id) else { return };
        self.force = ForceId::NONE;
        self.books.energies.clear();
        let mut has_blocks = has_blocks(self.terms[i].as_mut());
        match term {
            Some(mut term) => {
                has_blocks |= self::has_blocks(term.as_mut());
                self.terms[i] = term;
            }
            None => {
                // The terms after it have other places.
                has_blocks |= i + 1 < self.terms.len();
                self.terms.remove(i);
                self.ids.remove(i);
            }
        }
        if has_blocks {
            self.structure = fresh();
        }
        self.terms_changed();
    }

    /// Adds a term while a simulation runs. Forces without stencils come and go in every step: the matrix has
    /// no place for them, and its structure stays.
    pub(crate) fn insert_term(&mut self, mut term: Box<dyn EnergyTerm>) -> TermId {
        let structure = (!has_blocks(term.as_mut())).then_some(self.structure);
        let id = self.add_term(term);
        self.structure = structure.unwrap_or(self.structure);
        self.books.energies.clear();
        id
    }

    /// Moves the places of a term that ties vertices to them; its structure stays.
    pub(crate) fn move_places(&mut self, id: TermId, place: [f64; 3]) {
        let found = self.ids.iter().position(|other| *other == id);
        if let Some(ties) = found.and_then(|i| self.terms[i].ties()) {
            ties.move_places(place);
            self.force = ForceId::NONE;
            self.books.energies.clear();
        }
    }

    /// Removes the dissipative term at this place.
    pub(crate) fn remove_dissipation(&mut self, place: usize) {
        self.dissipation.remove(place);
        self.structure = fresh();
        self.terms_changed();
    }

    /// True if any term guards the ways of vertices: every motion must then ask how far it may go.
    pub(crate) fn has_guards(&self) -> bool {
        self.has_guards
    }

    /// The largest part of the way from `x` to `x + dx` that every term which guards ways admits, in (0, 1],
    /// and the name of the one that admits least; `None` where all of it is free.
    pub(crate) fn shortened_way(&self, x: &[f64], dx: &[f64]) -> Option<(f64, String)> {
        if !self.has_guards {
            return None;
        }
        let part = |term: &dyn EnergyTerm| {
            let limit = term.limit().filter(|limit| limit.guards_way())?;
            Some((limit.max_step(x, dx), term.name()))
        };
        let least =
            self.terms.iter().filter_map(|term| part(term.as_ref())).min_by(|a, b| a.0.total_cmp(&b.0));
        least.filter(|(part, _)| *part < 1.0)
    }

    /// Fault of held coordinates at `x` that cannot go on along `way`, which is zero where nothing is held;
    /// `None` where all of it is free.
    pub(crate) fn obstruction(&self, x: &[f64], way: &[f64]) -> Option<Fault> {
        let mut limits = self.terms.iter().filter_map(|term| term.limit());
        let WayObstruction { pair, vertices, behind } = limits.find_map(|limit| limit.obstruction(x, way))?;
        let d = self.dimension();
        let longest = |hold: &Hold| hold.coordinates(d).map(|i| way[i].abs()).fold(0.0, f64::max);
        // The one that is in the way itself; behind what yields, the one that has farthest to go.
        let touches = |hold: &&&Hold| hold.vertices().iter().any(|v| vertices.contains(v));
        let moving: Vec<&Hold> = self.constraints().iter().filter(|hold| longest(hold) > 0.0).collect();
        let farthest = || moving.iter().max_by(|a, b| longest(a).total_cmp(&longest(b)));
        let pin = moving.iter().find(touches).or_else(farthest);
        let yields = |v: &u32| self.inverse_mass()[*v as usize * d..][..d].iter().any(|w| *w > 0.0);
        let behind = behind.filter(|_| vertices.iter().any(yields));
        let pin = pin.map(|hold| hold.name().to_owned());
        Some(Fault::Obstructed(Box::new(ObstructedMotion { pin, pair, behind })))
    }

    /// Fault of the straight way `from` one configuration `to` another, where a term guards it.
    pub(crate) fn way_fault(&self, from: &[f64], to: &[f64]) -> Option<Fault> {
        if !self.has_guards {
            return None;
        }
        let dx: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        self.shortened_way(from, &dx).map(|(_, term)| Fault::Way { term })
    }

    /// True if forces alone keep surfaces apart: the worst contacts of every step are then noted.
    pub(crate) fn is_watched(&self) -> bool {
        self.is_watched
    }

    fn watched(&self) -> impl Iterator<Item = &dyn WatchedContacts> {
        self.terms.iter().filter_map(|term| term.watched())
    }

    /// True if any surfaces touch: every step must then be looked at.
    pub(crate) fn touches(&self) -> bool {
        self.touching().next().is_some()
    }

    fn touching(&self) -> impl Iterator<Item = &dyn TouchingSurfaces> {
        self.terms.iter().filter_map(|term| term.touching())
    }

    /// Fault of the straight way `from` one configuration `to` another, where it leads surfaces through each
    /// other.
    pub(crate) fn crossing(&self, from: &[f64], to: &[f64]) -> Option<Fault> {
        self.touching().find_map(|term| term.crossing(from, to))
    }

    /// The worst contacts at `(x, v)`, of surfaces that forces alone keep apart.
    pub(crate) fn contact_extremes(&self, x: &[f64], v: &[f64], time: f64) -> ContactExtremes {
        let mut worst = ContactExtremes::default();
        self.watched().for_each(|term| worst.merge(term.extremes((x, v), self.inverse_mass(), time)));
        worst
    }

    /// Most that such contact adds to the square of an angular frequency [1/s^2], whatever touches now, and
    /// what changes with time.
    pub(crate) fn stiffening(&mut self) -> f64 {
        let of_contact: f64 = self.watched().map(|term| term.stiffening(self.inverse_mass())).sum();
        let System { terms, inverse_mass, .. } = self;
        let driven = terms.iter_mut().filter_map(|term| term.driven());
        of_contact + driven.map(|term| term.stiffening(inverse_mass.numbers())).sum::<f64>()
    }

    /// Makes dissipative terms hold what they take from the positions `x`, their forces by a `part` of the
    /// way from those held; false where nothing is held, and nothing was.
    pub(crate) fn freeze(&mut self, x: &[f64], part: f64) -> bool {
        let mut any = false;
        for term in self.dissipation.iter_mut().filter_map(|term| term.frozen()) {
            any |= term.freeze(x, part);
        }
        any
    }

    /// Makes dissipative terms hold what they take from the positions `x`, flat [m], until
    /// [`thaw`](Self::thaw), as solves do that [renew it once](Self::most_renewals); their blocks are then
    /// exact at velocities `v`, flat [m/s], and their forces do not depend on positions.
    pub fn freeze_at(&mut self, x: &[f64], v: &[f64]) {
        self.freeze(x, 1.0);
        self.follow(v, &vec![0.0; v.len()]);
    }

    /// The most times that a solve takes what dissipative terms hold from positions: once is from those at
    /// the start of its step. `None` where no term takes anything from positions.
    pub fn most_renewals(&mut self) -> Option<u32> {
        self.dissipation.iter_mut().filter_map(|term| Some(term.frozen()?.most_renewals())).max()
    }

    /// The least [threshold speed](crate::dissipation::FrozenParts::threshold_speed) of dissipative terms
    /// [m/s]; infinite where none has any.
    pub(crate) fn threshold_speed(&mut self) -> f64 {
        let frozen = self.dissipation.iter_mut().filter_map(|term| term.frozen()?.threshold_speed());
        frozen.fold(f64::INFINITY, f64::min)
    }

    /// Tells energies whose stencils change that the linear system at `x` has the solution `step`, flat [m].
    pub(crate) fn follow_step(&mut self, x: &[f64], step: &[f64]) {
        let changing = self.terms.iter_mut().filter_map(|term| term.changing_mut());
        changing.for_each(|term| term.follow(x, step));
    }

    /// Tells them that the solve has ended.
    pub(crate) fn forget_steps(&mut self) {
        self.terms.iter_mut().filter_map(|term| term.changing_mut()).for_each(|term| term.forget());
    }

    /// Tells dissipative terms that hold what they take from positions that a solve goes on from velocities
    /// `v` in the direction `dv`, flat [m/s].
    pub(crate) fn follow(&mut self, v: &[f64], dv: &[f64]) {
        self.dissipation.iter_mut().filter_map(|term| term.frozen()).for_each(|term| term.follow(v, dv));
    }

    /// Ends that: dissipative terms take from positions what they are asked about.
    pub fn thaw(&mut self) {
        self.dissipation.iter_mut().filter_map(|term| term.frozen()).for_each(|term| term.thaw());
    }

    /// Tells terms whose stencils change that a step of `dt` [s] begins.
    pub(crate) fn begin_step(&mut self, x: &[f64], v: &[f64], dt: f64) {
        self.change_stencils(|term| term.begin_step(x, v, dt));
    }

    /// Lets terms find the stencils that change, before a matrix is assembled at `x`.
    pub fn find_stencils(&mut self, x: &[f64]) {
        self.change_stencils(|term| term.find(x));
    }

    /// Calls `change` for every term whose stencils change; another version where one says that they did.
    fn change_stencils(&mut self, mut change: impl FnMut(&mut dyn ChangingStencils) -> bool) {
        if self.changing.is_none() {
            return;
        }
        let mut changed = false;
        for term in self.terms.iter_mut().filter_map(|term| term.changing_mut()) {
            changed |= change(term);
        }
        for term in self.dissipation.iter_mut().filter_map(|term| term.changing_mut()) {
            changed |= change(term);
        }
        if changed {
            self.changing = Some(fresh());
        }
    }

    /// Version of the stencils that change: another number whenever a term has found others. `None` where
    /// no term has any.
    pub fn changing_structure(&self) -> Option<u64> {
        self.changing
    }
}
