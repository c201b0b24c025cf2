//! Equations of motion `M x'' = -dE/dx - dR/dv`: masses, energy terms `E(x, t)`, dissipative terms
//! `R(x, v)` and constraints.

mod books;
mod flows;
mod history;
mod load_factor;
mod pins;
mod terms;
mod wall_drag;
mod wall_impulse;
mod wall_loss;
mod walls;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::constraint::{Hold, Wall};
use crate::deadline::Stop;
use crate::dissipation::DissipativeTerm;
use crate::energy::{DeformationExtremes, EnergyKind, EnergyTerm, Fault, Stencils};
use crate::pass::{InverseMass, KickDrift, PassResult, StepInputs};

use books::Books;
pub(crate) use flows::{PowerSelection, Powers, feeds, is_changing_gravity, power_of_motion};
pub(crate) use pins::{PinState, Pins};
pub use terms::TermId;
pub(crate) use wall_impulse::{WallImpulses, WallStop};
pub(crate) use wall_loss::{WallLoss, WallLosses};

/// Masses, energies and constraints of all bodies. Terms are boxed, so that generic types end here.
///
/// ```
/// use pliant::{energy::gravity::UniformGravity, system::System};
///
/// let mass = vec![1.0, 2.0];
/// let mut system = System::new(2, mass.clone());
/// system.add_term(Box::new(UniformGravity::new(&[0.0, -10.0], &mass)));
/// system.pin(&[0]);
/// let (x, mut gradient) = ([0.0, 1.0, 0.0, 3.0], [0.0; 4]);
/// assert_eq!(system.potential_energy(&x), 10.0 + 60.0);
/// system.gradient(&x, &mut gradient);
/// assert_eq!(gradient[2..], [0.0, 20.0]);
/// assert!(system.is_pinned(0) && !system.is_pinned(1));
/// ```
pub struct System {
    dimension: usize,
    mass: Vec<f64>,
    /// Positions in the reference configuration, flat [m], if a solver needs them.
    rest_positions: Option<Vec<f64>>,
    /// `1 / m` of each coordinate, zero if it is constrained.
    inverse_mass: InverseMass,
    pins: Pins,
    /// Version of the structure.
    structure: u64,
    terms: Vec<Box<dyn EnergyTerm>>,
    /// Identities of the terms, in their order.
    ids: Vec<TermId>,
    /// Version of the changing stencils; `None` if no term has any.
    changing: Option<u64>,
    /// True if any term limits steps.
    has_guards: bool,
    /// True if a term keeps surfaces apart by forces alone.
    is_watched: bool,
    /// Dissipative terms.
    dissipation: Vec<Box<dyn DissipativeTerm>>,
    /// True if any term is time-dependent.
    changes_with_time: bool,
    remembers: bool,
    walls: Vec<Wall>,
    /// True if the walls moved any vertex when last applied.
    put_back: bool,
    ether_drag: f64,
    /// Time last set for the terms, and time of their current force [s].
    time: f64,
    force_time: f64,
    /// Force that the terms hold.
    force: ForceId,
    books: Books,
    /// Load factor in arc-length continuation: the time of loads and prescribed motion.
    load_factor: Option<f64>,
    /// Further times that increments end at, besides those of pins, ascending [s].
    breaks: Vec<f64>,
    /// Flag set from outside to end solves.
    stop: Stop,
}

/// Identity of one force evaluation in this process; a state stores that of its positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForceId(u64);

impl ForceId {
    /// No force.
    pub(crate) const NONE: ForceId = ForceId(0);

    fn fresh() -> Self {
        ForceId(fresh())
    }
}

/// Returns a positive number, unique in this process.
fn fresh() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    LAST.fetch_add(1, Ordering::Relaxed) + 1
}

impl System {
    /// Creates a system of free vertices with these masses [kg] in `dimension` dimensions, without
    /// forces.
    pub fn new(dimension: usize, mass: Vec<f64>) -> Self {
        System {
            inverse_mass: InverseMass::free(&mass, dimension),
            dimension,
            mass,
            rest_positions: None,
            pins: Pins::new(dimension),
            structure: fresh(),
            terms: vec![],
            ids: vec![],
            changing: None,
            has_guards: false,
            is_watched: false,
            dissipation: vec![],
            changes_with_time: false,
            remembers: false,
            walls: vec![],
            put_back: false,
            ether_drag: 0.0,
            time: 0.0,
            force_time: 0.0,
            force: ForceId::NONE,
            books: Books::default(),
            load_factor: None,
            breaks: vec![],
            stop: Stop::default(),
        }
    }

    /// Adds a potential; returns its identity.
    pub fn add_term(&mut self, term: Box<dyn EnergyTerm>) -> TermId {
        self.force = ForceId::NONE;
        self.structure = fresh();
        // Reserved here, so that steps do not allocate.
        self.books.energies.reserve_exact(self.terms.len() + 1);
        self.terms.push(term);
        let id = TermId(fresh());
        self.ids.push(id);
        self.terms_changed();
        id
    }

    /// Adds a dissipative term.
    pub fn add_dissipation(&mut self, term: Box<dyn DissipativeTerm>) {
        self.structure = fresh();
        self.dissipation.push(term);
        self.terms_changed();
    }

    /// Adds a wall.
    pub fn add_wall(&mut self, wall: Wall) {
        self.walls.push(wall);
    }

    /// Replaces the walls; returns the old ones.
    pub fn replace_walls(&mut self, walls: Vec<Wall>) -> Vec<Wall> {
        std::mem::replace(&mut self.walls, walls)
    }

    /// Pins these vertices at their positions.
    pub fn pin(&mut self, vertices: &[u32]) {
        self.hold(Hold::new("", vertices.to_vec()));
    }

    /// Adds a pin. A moving coordinate must not be in another pin.
    pub fn hold(&mut self, hold: Hold) {
        self.structure = fresh();
        // Cost proportional to the pin's coordinates, as large systems may have many pins.
        hold.coordinates(self.dimension).for_each(|i| self.inverse_mass.hold(i));
        self.pins.add(hold);
    }

    /// Returns the active pins.
    pub fn constraints(&self) -> &[Hold] {
        self.pins.acting()
    }

    /// Returns the version of the structure. It changes when pins are added or released, and when terms
    /// with second derivatives are added, removed or replaced; matrix plans, factors and accelerations
    /// for another version are then invalid. No two systems of a process share a version.
    pub fn structure(&self) -> u64 {
        self.structure
    }

    /// True if any constrained coordinate moves as [`prescribe`](Self::prescribe) says.
    pub fn has_prescribed_motion(&self) -> bool {
        self.pins.move_any()
    }

    /// Writes positions [m] and velocities [m/s] of the prescribed coordinates at `time` [s] into the
    /// flat arrays `x` and `v`; returns false if a value is not finite. Does nothing without prescribed
    /// motion.
    pub fn prescribe(&self, time: f64, x: &mut [f64], v: &mut [f64]) -> bool {
        self.pins.prescribe(self.load_factor.unwrap_or(time), x, v)
    }

    /// Sets the ether drag [1/s]: velocities decay as `exp(-ether_drag t)`.
    pub fn set_ether_drag(&mut self, ether_drag: f64) {
        self.ether_drag = ether_drag;
    }

    /// Returns the dimension, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Returns the lumped masses of the vertices [kg].
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// Returns `1 / m` of each coordinate [1/kg], zero if it is constrained; flat `(n, dimension)`.
    pub fn inverse_mass(&self) -> &[f64] {
        self.inverse_mass.numbers()
    }

    /// True if vertex `i` is pinned.
    pub fn is_pinned(&self, i: usize) -> bool {
        self.inverse_mass()[i * self.dimension..][..self.dimension].iter().all(|w| *w == 0.0)
    }

    /// Sets the positions in the reference configuration, flat [m], for solvers that need them.
    pub fn set_rest_positions(&mut self, rest: Vec<f64>) {
        self.rest_positions = Some(rest);
    }

    /// Returns the positions in the reference configuration, if set.
    pub fn rest_positions(&self) -> Option<&[f64]> {
        self.rest_positions.as_deref()
    }

    /// Returns the positions for nested dissection: those of the reference configuration, if set, or `x`.
    /// Planes through an undeformed lattice are clean; after a step they are ragged, and the factor has
    /// up to twice as many entries. Vertices in contact are only close at `x`, which is therefore used
    /// with contact.
    pub fn ordering_positions<'a>(&'a self, x: &'a [f64]) -> &'a [f64] {
        match &self.rest_positions {
            Some(rest) if self.changing_structure().is_none() => rest,
            _ => x,
        }
    }

    /// Returns the potentials.
    pub fn terms(&self) -> &[Box<dyn EnergyTerm>] {
        &self.terms
    }

    /// Returns the potentials for evaluation one by one; the force of the system is then invalid.
    pub fn terms_mut(&mut self) -> impl Iterator<Item = &mut Box<dyn EnergyTerm>> {
        self.force = ForceId::NONE;
        self.terms.iter_mut()
    }

    /// Returns the dissipative terms.
    pub fn dissipation(&self) -> &[Box<dyn DissipativeTerm>] {
        &self.dissipation
    }

    /// Returns the dissipative terms for evaluation one by one.
    pub fn dissipation_mut(&mut self) -> impl Iterator<Item = &mut Box<dyn DissipativeTerm>> {
        self.dissipation.iter_mut()
    }

    /// Replaces the terms by equivalent ones, for example by instrumented wrappers.
    pub fn wrap_terms(
        &mut self,
        energy: impl FnMut(Box<dyn EnergyTerm>) -> Box<dyn EnergyTerm>,
        dissipation: impl FnMut(Box<dyn DissipativeTerm>) -> Box<dyn DissipativeTerm>,
    ) {
        self.force = ForceId::NONE;
        self.terms = std::mem::take(&mut self.terms).into_iter().map(energy).collect();
        self.dissipation = std::mem::take(&mut self.dissipation).into_iter().map(dissipation).collect();
    }

    /// True if any force except ether drag depends on velocities.
    pub fn is_damped(&self) -> bool {
        !self.dissipation.is_empty()
    }

    /// True if there is friction and prescribed motion. In steps of [backward
    /// Euler](crate::integrator::Method::is_backward_euler) dissipative terms then see prescribed
    /// coordinates at their mean velocities over the step, as they see free ones, so that sticking bodies
    /// move exactly as far as their support.
    pub fn rubs_by_way(&self) -> bool {
        self.has_prescribed_motion() && self.dissipation.iter().any(|term| term.is_friction())
    }

    /// Returns the walls.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// Returns the ether drag [1/s].
    pub fn ether_drag(&self) -> f64 {
        self.ether_drag
    }

    /// Returns the number of force evaluations so far.
    pub fn force_evaluations(&self) -> u64 {
        self.books.force_evaluations()
    }

    /// Returns the potential energy of one kind [J].
    pub fn potential(&mut self, kind: EnergyKind, x: &[f64]) -> f64 {
        self.potential_with_force(|of_term| of_term == kind, x, ForceId::NONE)
    }

    /// Sets a flag that ends solves and searches while set.
    pub fn set_stop(&mut self, stop: Option<Arc<AtomicBool>>) {
        self.stop = Stop::new(stop);
    }

    /// True if there is a flag that ends solves.
    pub(crate) fn can_be_stopped(&self) -> bool {
        self.stop.is_there()
    }

    /// True if solves must end.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_set()
    }

    /// Returns the flag that ends solves, for code without access to the system.
    pub(crate) fn stop(&self) -> Stop {
        self.stop.clone()
    }

    /// Estimates the energy that the terms can convert from `x` on [J], summed over terms.
    pub fn potential_scale(&mut self, x: &[f64]) -> f64 {
        let scale = |term: &mut Box<dyn EnergyTerm>| match term.measurements() {
            Some(term) => term.scale(x),
            None => term.energy(x).abs(),
        };
        self.terms.iter_mut().map(scale).sum()
    }

    /// Returns the potential energy of all terms [J]; `+inf` outside the domain of a barrier material.
    pub fn potential_energy(&mut self, x: &[f64]) -> f64 {
        self.terms.iter_mut().map(|t| t.energy(x)).sum()
    }

    /// Returns the potential energy of each term by name [J].
    pub(crate) fn potential_energies(&mut self, x: &[f64]) -> Vec<(String, f64)> {
        self.terms.iter_mut().map(|term| (term.name(), term.energy(x))).collect()
    }

    /// Returns the stencils of the energies and of the dissipative terms, in their order.
    pub(crate) fn stencils(&mut self) -> (Vec<Stencils>, Vec<Stencils>) {
        let energy = self.terms.iter_mut().map(|t| t.stencils()).collect();
        (energy, self.dissipation.iter_mut().map(|t| t.stencils()).collect())
    }

    /// Returns the largest fraction of the step from `x` to `x + dx` that all terms admit, in (0, 1].
    pub fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        let limits = self.terms.iter().filter_map(|term| term.limit());
        limits.map(|limit| limit.max_step(x, dx)).fold(1.0, f64::min)
    }

    /// Returns the kinetic energy `sum 1/2 m |v|^2` [J].
    pub fn kinetic(&self, v: &[f64]) -> f64 {
        let speeds = v.chunks_exact(self.dimension).map(|v| v.iter().map(|c| c * c).sum::<f64>());
        speeds.zip(&self.mass).map(|(v2, m)| 0.5 * m * v2).sum()
    }

    /// True if a potential is time-dependent: energy is then not conserved.
    pub fn changes_with_time(&self) -> bool {
        self.changes_with_time
    }

    /// Sets the time [s] of the time-dependent potentials; the last force is not re-evaluated. In
    /// arc-length continuation the load factor takes precedence.
    pub fn set_time(&mut self, time: f64) {
        self.time = time;
        let time = self.load_factor.unwrap_or(time);
        if self.changes_with_time {
            let changing = self.terms.iter_mut().filter(|term| term.properties().changes_with_time);
            changing.filter_map(|term| term.driven()).for_each(|term| term.set_time(time));
        }
    }

    /// Evaluates the force at `x`; the terms hold it until the next evaluation. Returns `None` if it is
    /// not finite at a free coordinate.
    pub fn evaluate(&mut self, x: &[f64]) -> Option<ForceId> {
        let mut finite = true;
        self.books.energies.clear();
        for term in &mut self.terms {
            if self.books.to_be_measured {
                let (is_finite, energy) = match term.measurements() {
                    Some(term) => term.evaluate_with_energy(x),
                    None => (term.evaluate(x), None),
                };
                self.books.energies.push(energy);
                finite &= is_finite;
            } else {
                finite &= term.evaluate(x);
            }
        }
        self.books.force_evaluations += 1;
        (self.force, self.force_time) = (ForceId::fresh(), self.time);
        (finite || self.is_finite_where_free()).then_some(self.force)
    }

    /// True if the current force is finite at all free coordinates.
    fn is_finite_where_free(&self) -> bool {
        let mut a = vec![0.0; self.inverse_mass().len()];
        StepInputs { dissipation: &[], ..self.step_inputs() }.accelerations(&mut a);
        a.iter().all(|a| a.is_finite())
    }

    /// Returns the force that the terms hold.
    pub(crate) fn force(&self) -> ForceId {
        self.force
    }

    /// Evaluates the dissipative forces at `(x, v)`; the terms hold them until the next evaluation. A
    /// force that is not finite shows in the resulting velocities.
    pub(crate) fn evaluate_dissipation(&mut self, x: &[f64], v: &[f64]) {
        for term in &mut self.dissipation {
            term.evaluate(x, v);
        }
    }

    /// Returns the time at which this force was evaluated [s], up to rounding the time of the state;
    /// `None` if the terms no longer hold it.
    pub(crate) fn time_of(&self, force: ForceId) -> Option<f64> {
        self.holds(force).then_some(self.force_time)
    }

    /// True if the terms still hold this force.
    pub(crate) fn holds(&self, force: ForceId) -> bool {
        force != ForceId::NONE && force == self.force
    }

    /// Advances `x` and `v`, starting from `from` if given, by the force that the terms hold.
    pub(crate) fn pass(
        &self,
        pass: &KickDrift,
        from: Option<(&[f64], &[f64])>,
        x: &mut [f64],
        v: &mut [f64],
    ) -> PassResult {
        self.step_inputs().run(pass, from, x, v)
    }

    /// Writes `-M^-1 (dE/dx + dR/dv)` [m/s^2] for the forces that the terms hold to `a`; zero at
    /// constrained coordinates.
    pub fn accelerations(&self, a: &mut [f64]) {
        self.step_inputs().accelerations(a);
    }

    /// Visits the rows of `dE/dx` [N] of the current force at these `vertices`, which ascend.
    pub(crate) fn visit_gradient(&self, vertices: &[u32], visit: impl FnMut(usize, &[f64])) {
        self.step_inputs().visit_gradient(vertices, self.mass.len(), visit);
    }

    /// Returns the potential energy [J] of the terms selected by `asked`.
    pub(crate) fn potential_of(&mut self, asked: impl Fn(&dyn EnergyTerm) -> bool, x: &[f64]) -> f64 {
        self.terms.iter_mut().filter(|term| asked(term.as_ref())).map(|term| term.energy(x)).sum()
    }

    /// Returns the power [W] of the terms selected by `asked`, at the time last set.
    pub(crate) fn power(&mut self, asked: impl Fn(&dyn EnergyTerm) -> bool, x: &[f64], v: &[f64]) -> f64 {
        let asked = self.terms.iter_mut().filter(|term| asked(term.as_ref()));
        asked.filter_map(|term| term.driven()).map(|term| term.power(x, v)).sum()
    }

    fn step_inputs(&self) -> StepInputs<'_> {
        StepInputs {
            dimension: self.dimension,
            terms: &self.terms,
            dissipation: &self.dissipation,
            inverse_mass: &self.inverse_mass,
            walls: &self.walls,
            stops: &self.books.wall_stops,
        }
    }

    /// Writes `dE/dx` [N] to `g`, pinned vertices included.
    pub fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.force = ForceId::NONE;
        g.fill(0.0);
        for term in &mut self.terms {
            term.add_gradient(x, g);
        }
    }

    /// Computes [`hessian_product`](Self::hessian_product), but terms may approximate; returns whether
    /// any did.
    pub(crate) fn stiffness_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        // Terms may reuse the memory of their force.
        self.force = ForceId::NONE;
        y.fill(0.0);
        let mut approximate = false;
        for term in &mut self.terms {
            match term.measurements() {
                Some(term) => approximate |= term.add_stiffness_product(x, p, y),
                None => term.add_hessian_product(x, p, y),
            }
        }
        approximate
    }

    /// Ends a series of stiffness products.
    pub(crate) fn end_stiffness_products(&mut self) {
        let terms = self.terms.iter_mut().filter_map(|term| term.measurements());
        terms.for_each(|term| term.end_stiffness_products());
    }

    /// Writes `d2E/dx2 p` [N] to `y`, pinned vertices included.
    pub fn hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        // Terms may reuse the memory of their force.
        self.force = ForceId::NONE;
        y.fill(0.0);
        for term in &mut self.terms {
            term.add_hessian_product(x, p, y);
        }
    }

    /// Writes the part of [`hessian_product`](Self::hessian_product) by terms with fixed stencils to `y`.
    pub(crate) fn fixed_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        self.force = ForceId::NONE;
        y.fill(0.0);
        for term in self.terms.iter_mut().filter(|term| term.changing().is_none()) {
            term.add_hessian_product(x, p, y);
        }
    }

    /// Writes the product with the transposed Hessian to `y`, and to `works` the work `p . dE/dx` of each
    /// energy term, in their order, if it comes with the product. Non-conservative forces have an
    /// unsymmetric Hessian.
    pub fn transposed_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64], works: &mut Vec<Option<f64>>) {
        self.force = ForceId::NONE;
        y.fill(0.0);
        works.clear();
        works.extend(self.terms.iter_mut().map(|term| term.add_transposed_product(x, p, y)));
    }

    /// Writes `dR/dv` [N] at `(x, v)` to `g`, pinned vertices included.
    pub fn dissipative_force(&mut self, x: &[f64], v: &[f64], g: &mut [f64]) {
        g.fill(0.0);
        for term in &mut self.dissipation {
            term.evaluate(x, v);
            term.add_rows(0, g);
        }
    }

    /// Writes `dR/dv` of damping and of friction to the two `parts`.
    pub(crate) fn dissipative_forces(&mut self, x: &[f64], v: &[f64], parts: &mut [Vec<f64>; 2]) {
        for part in parts.iter_mut() {
            part.clear();
            part.resize(x.len(), 0.0);
        }
        for term in &mut self.dissipation {
            term.evaluate(x, v);
            term.add_rows(0, &mut parts[usize::from(term.is_friction())]);
        }
    }

    /// Writes `d2R/dv2 p` [N] at `(x, v)` to `y`, pinned vertices included.
    pub fn damping_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for term in &mut self.dissipation {
            term.add_damping_product(x, v, p, y);
        }
    }

    /// Writes `(d2R/dx dv)^T p` [N] at `(x, v)` to `y`, pinned vertices included. Returns false if a
    /// dissipative term does not provide its part.
    pub fn position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        y.fill(0.0);
        self.dissipation.iter_mut().fold(true, |known, term| known & term.add_position_product(x, v, p, y))
    }

    /// Writes `d2R/dx dv u` [N] at `(x, v)` to `y`, pinned vertices included: the change of `dR/dv` with
    /// positions along `u`. Returns false if a dissipative term does not provide its part.
    pub fn position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        y.fill(0.0);
        self.dissipation.iter_mut().fold(true, |known, term| known & term.add_position_change(x, v, u, y))
    }

    /// Returns the sum of the dissipation functions `R(x, v)` [W].
    pub(crate) fn dissipation_functions(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.dissipation.iter_mut().map(|term| term.value(x, v)).sum()
    }

    /// Returns the power dissipated by the dissipative terms at `(x, v)`, `v . dR/dv` [W], without ether
    /// drag and walls.
    pub fn dissipated_power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.dissipated_powers(x, v).iter().sum()
    }

    /// Returns the dissipated power of damping and of friction.
    pub(crate) fn dissipated_powers(&mut self, x: &[f64], v: &[f64]) -> [f64; 2] {
        let mut powers = [0.0; 2];
        for term in &mut self.dissipation {
            powers[usize::from(term.is_friction())] += term.power(x, v);
        }
        powers
    }

    /// Returns the extremes of `det F` over all elements; `None` without elements.
    pub fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let terms = self.terms.iter_mut().filter_map(|term| term.measurements());
        terms.filter_map(|term| term.deformation(x)).reduce(DeformationExtremes::merge)
    }

    /// Diagnoses why `x` has no finite energy or force.
    pub fn fault(&self, x: &[f64]) -> Option<Fault> {
        if let Some(hold) = self.pins.lost(x) {
            return Some(Fault::Motion { hold: hold.name().to_owned() });
        }
        self.terms.iter().find_map(|t| t.fault(x))
    }

    /// Returns the first location at which a material is about to leave its domain at `x`.
    pub(crate) fn near_fault(&self, x: &[f64]) -> Option<Fault> {
        self.terms.iter().filter_map(|term| term.elements()).find_map(|elements| elements.near_fault(x))
    }

    /// Diagnoses why `(x, v)` has no finite dissipative force.
    pub fn dissipative_fault(&self, x: &[f64], v: &[f64]) -> Option<Fault> {
        self.dissipation.iter().find_map(|t| t.fault(x, v))
    }
}
