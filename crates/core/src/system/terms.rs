//! Terms that are added, removed or replaced, terms that limit steps, and terms with changing stencils.

use super::{ForceId, System, fresh};
use crate::constraint::Hold;
use crate::energy::{
    ChangingStencils, ContactExtremes, EnergyTerm, Fault, ObstructedMotion, TouchingSurfaces,
    WatchedContacts, WayObstruction,
};

/// Identity of a term in this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TermId(pub(super) u64);

/// True if the matrix has blocks for the second derivatives of a term.
fn has_blocks(term: &mut dyn EnergyTerm) -> bool {
    !term.stencils().vertices.is_empty() || term.changing().is_some()
}

impl System {
    /// Updates the properties derived from all terms.
    pub(super) fn terms_changed(&mut self) {
        self.changes_with_time = self.terms.iter().any(|term| term.properties().changes_with_time);
        self.remembers = self.terms.iter().any(|term| term.properties().remembers);
        self.has_guards = self.terms.iter().any(|term| term.limit().is_some_and(|limit| limit.guards_way()));
        self.is_watched = self.terms.iter().any(|term| term.watched().is_some());
        let changing = self.terms.iter().any(|term| term.changing().is_some())
            || self.dissipation.iter().any(|term| term.changing().is_some());
        self.changing = changing.then(fresh);
    }

    /// Returns the first term that satisfies `asked`.
    pub fn find_term(&self, asked: impl Fn(&dyn EnergyTerm) -> bool) -> Option<TermId> {
        let found = self.terms.iter().position(|term| asked(term.as_ref()))?;
        Some(self.ids[found])
    }

    /// Replaces a term, which keeps its identity; `None` removes it.
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
                // Later terms have new indices.
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

    /// Adds a term during a simulation. Forces without stencils have no blocks in the matrix and leave
    /// its structure unchanged.
    pub(crate) fn insert_term(&mut self, mut term: Box<dyn EnergyTerm>) -> TermId {
        let structure = (!has_blocks(term.as_mut())).then_some(self.structure);
        let id = self.add_term(term);
        self.structure = structure.unwrap_or(self.structure);
        self.books.energies.clear();
        id
    }

    /// Moves the target of a term that ties vertices to points; the structure is unchanged.
    pub(crate) fn move_places(&mut self, id: TermId, place: [f64; 3]) {
        let found = self.ids.iter().position(|other| *other == id);
        if let Some(ties) = found.and_then(|i| self.terms[i].ties()) {
            ties.move_places(place);
            self.force = ForceId::NONE;
            self.books.energies.clear();
        }
    }

    /// Removes the dissipative term with this index.
    pub(crate) fn remove_dissipation(&mut self, place: usize) {
        self.dissipation.remove(place);
        self.structure = fresh();
        self.terms_changed();
    }

    /// True if any term limits steps: all trajectories must then be checked.
    pub(crate) fn has_guards(&self) -> bool {
        self.has_guards
    }

    /// Returns the largest fraction of the path from `x` to `x + dx` that all terms which limit steps
    /// admit, in (0, 1], and the name of the most restrictive term; `None` if the whole path is free.
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

    /// Returns the fault of constrained coordinates at `x` that are blocked along `way`, which is zero at
    /// free coordinates; `None` if the path is free.
    pub(crate) fn obstruction(&self, x: &[f64], way: &[f64]) -> Option<Fault> {
        let mut limits = self.terms.iter().filter_map(|term| term.limit());
        let WayObstruction { pair, vertices, behind } = limits.find_map(|limit| limit.obstruction(x, way))?;
        let d = self.dimension();
        let longest = |hold: &Hold| hold.coordinates(d).map(|i| way[i].abs()).fold(0.0, f64::max);
        // Prefers the pin that is in contact itself; behind deformable obstacles, the pin with the
        // longest remaining displacement.
        let touches = |hold: &&&Hold| hold.vertices().iter().any(|v| vertices.contains(v));
        let moving: Vec<&Hold> = self.constraints().iter().filter(|hold| longest(hold) > 0.0).collect();
        let farthest = || moving.iter().max_by(|a, b| longest(a).total_cmp(&longest(b)));
        let pin = moving.iter().find(touches).or_else(farthest);
        let yields = |v: &u32| self.inverse_mass()[*v as usize * d..][..d].iter().any(|w| *w > 0.0);
        let behind = behind.filter(|_| vertices.iter().any(yields));
        let pin = pin.map(|hold| hold.name().to_owned());
        Some(Fault::Obstructed(Box::new(ObstructedMotion { pin, pair, behind })))
    }

    /// Returns the fault of the straight path between two configurations, if a term limits it.
    pub(crate) fn way_fault(&self, from: &[f64], to: &[f64]) -> Option<Fault> {
        if !self.has_guards {
            return None;
        }
        let dx: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        self.shortened_way(from, &dx).map(|(_, term)| Fault::Way { term })
    }

    /// True if forces alone keep surfaces apart: the worst contacts of each step are then recorded.
    pub(crate) fn is_watched(&self) -> bool {
        self.is_watched
    }

    fn watched(&self) -> impl Iterator<Item = &dyn WatchedContacts> {
        self.terms.iter().filter_map(|term| term.watched())
    }

    /// True if there is contact: each step must then be checked.
    pub(crate) fn touches(&self) -> bool {
        self.touching().next().is_some()
    }

    fn touching(&self) -> impl Iterator<Item = &dyn TouchingSurfaces> {
        self.terms.iter().filter_map(|term| term.touching())
    }

    /// Returns the fault of the straight path between two configurations, if surfaces cross along it.
    pub(crate) fn crossing(&self, from: &[f64], to: &[f64]) -> Option<Fault> {
        self.touching().find_map(|term| term.crossing(from, to))
    }

    /// Returns the worst contacts at `(x, v)` of surfaces that forces alone keep apart.
    pub(crate) fn contact_extremes(&self, x: &[f64], v: &[f64], time: f64) -> ContactExtremes {
        let mut worst = ContactExtremes::default();
        self.watched().for_each(|term| worst.merge(term.extremes((x, v), self.inverse_mass(), time)));
        worst
    }

    /// Returns an upper bound for what such contact, and time-dependent terms, add to the square of an
    /// angular frequency [1/s^2], whatever is in contact now.
    pub(crate) fn stiffening(&mut self) -> f64 {
        let of_contact: f64 = self.watched().map(|term| term.stiffening(self.inverse_mass())).sum();
        let System { terms, inverse_mass, .. } = self;
        let driven = terms.iter_mut().filter_map(|term| term.driven());
        of_contact + driven.map(|term| term.stiffening(inverse_mass.numbers())).sum::<f64>()
    }

    /// Updates the lagged quantities of dissipative terms at the positions `x`, their forces by the
    /// fraction `part` of the change. Returns false if nothing is lagged, and nothing was.
    pub(crate) fn freeze(&mut self, x: &[f64], part: f64) -> bool {
        let mut any = false;
        for term in self.dissipation.iter_mut().filter_map(|term| term.frozen()) {
            any |= term.freeze(x, part);
        }
        any
    }

    /// Lags dissipative terms at the positions `x`, flat [m], until [`thaw`](Self::thaw), as solves do
    /// that [update them once](Self::most_renewals). Their blocks are then exact at velocities `v`, flat
    /// [m/s], and their forces do not depend on positions.
    pub fn freeze_at(&mut self, x: &[f64], v: &[f64]) {
        self.freeze(x, 1.0);
        self.follow(v, &vec![0.0; v.len()]);
    }

    /// Returns how often a solve updates lagged quantities at most; 1 means at the start of its step
    /// only. `None` if no term has lagged quantities.
    pub fn most_renewals(&mut self) -> Option<u32> {
        self.dissipation.iter_mut().filter_map(|term| Some(term.frozen()?.most_renewals())).max()
    }

    /// Returns the smallest [regularisation velocity](crate::dissipation::FrozenParts::threshold_speed)
    /// of dissipative terms [m/s]; infinite without any.
    pub(crate) fn threshold_speed(&mut self) -> f64 {
        let frozen = self.dissipation.iter_mut().filter_map(|term| term.frozen()?.threshold_speed());
        frozen.fold(f64::INFINITY, f64::min)
    }

    /// Passes the solution `step` of the linear system at `x`, flat [m], to energies with changing
    /// stencils.
    pub(crate) fn follow_step(&mut self, x: &[f64], step: &[f64]) {
        let changing = self.terms.iter_mut().filter_map(|term| term.changing_mut());
        changing.for_each(|term| term.follow(x, step));
    }

    /// Tells these energies that the solve has ended.
    pub(crate) fn forget_steps(&mut self) {
        self.terms.iter_mut().filter_map(|term| term.changing_mut()).for_each(|term| term.forget());
    }

    /// Passes the direction `dv` of a solve from the velocities `v`, flat [m/s], to dissipative terms
    /// with lagged quantities.
    pub(crate) fn follow(&mut self, v: &[f64], dv: &[f64]) {
        self.dissipation.iter_mut().filter_map(|term| term.frozen()).for_each(|term| term.follow(v, dv));
    }

    /// Ends lagging: dissipative terms use the positions they are evaluated at.
    pub fn thaw(&mut self) {
        self.dissipation.iter_mut().filter_map(|term| term.frozen()).for_each(|term| term.thaw());
    }

    /// Tells terms with changing stencils that a step of `dt` [s] starts.
    pub(crate) fn begin_step(&mut self, x: &[f64], v: &[f64], dt: f64) {
        self.change_stencils(|term| term.begin_step(x, v, dt));
    }

    /// Lets terms find their changing stencils before a matrix is assembled at `x`.
    pub fn find_stencils(&mut self, x: &[f64]) {
        self.change_stencils(|term| term.find(x));
    }

    /// Calls `change` for all terms with changing stencils; changes the version if one reports a change.
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

    /// Returns the version of the changing stencils, which changes whenever a term finds other ones.
    /// `None` if no term has any.
    pub fn changing_structure(&self) -> Option<u64> {
        self.changing
    }
}
