//! Share of contact in the time of steps: its terms are wrapped by terms that measure time.
//!
//! The share includes the search, energies and forces, blocks of matrices, and the collision-free step
//! fractions. It excludes the sum of these blocks into the matrix, and the additional cost of the
//! factorisation.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use pliant::dissipation::{DissipationViews, DissipativeTerm, FrozenParts, PositionProducts};
use pliant::energy::{
    ChangingStencils, EnergyKind, EnergyTerm, Fault, Stencils, StepLimit, TermProperties, TermViews,
    TouchingSurfaces, WayObstruction,
};
use pliant::material::Psd;
use pliant::simulation::Simulation;

/// Time spent in contact, summed over all threads.
#[derive(Clone, Default)]
pub(super) struct ContactClock(Arc<AtomicU64>);

impl ContactClock {
    /// Wraps the contact and friction terms of a simulation; `None` if there are none.
    pub(super) fn of(simulation: &mut Simulation) -> Option<ContactClock> {
        let clock = ContactClock::default();
        let mut found = false;
        simulation.system_mut().wrap_terms(
            |term| {
                if term.properties().kind != EnergyKind::Contact {
                    return term;
                }
                found = true;
                Box::new(Timed { term, frozen: None, clock: clock.clone() })
            },
            |mut term| {
                if !term.is_friction() {
                    return term;
                }
                let frozen = term.frozen().map(|parts| (parts.threshold_speed(), parts.most_renewals()));
                Box::new(Timed { term, frozen, clock: clock.clone() })
            },
        );
        found.then_some(clock)
    }

    /// Time since the start, or since the last [`reset`](Self::reset).
    pub(super) fn elapsed(&self) -> Duration {
        Duration::from_nanos(self.0.load(Ordering::Relaxed))
    }

    /// Sets the time to zero.
    pub(super) fn reset(&self) {
        self.0.store(0, Ordering::Relaxed);
    }

    fn time<R>(&self, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        self.0.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
        result
    }
}

/// A term, and the clock that its time is added to.
struct Timed<T: ?Sized> {
    term: Box<T>,
    /// Regularisation velocity and renewal limit of its lagged parts.
    frozen: Option<(Option<f64>, u32)>,
    clock: ContactClock,
}

type TimedEnergy = Timed<dyn EnergyTerm>;
type TimedFriction = Timed<dyn DissipativeTerm>;

impl EnergyTerm for TimedEnergy {
    fn name(&self) -> String {
        self.term.name()
    }

    fn properties(&self) -> TermProperties {
        self.term.properties()
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        self.clock.time(|| self.term.energy(x))
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.clock.time(|| self.term.evaluate(x))
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.clock.time(|| self.term.add_rows(first, g));
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        self.clock.time(|| self.term.add_hessian_product(x, p, y));
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.term.fault(x)
    }
}

impl TermViews for TimedEnergy {
    fn limit(&self) -> Option<&dyn StepLimit> {
        self.term.limit().map(|_| self as &dyn StepLimit)
    }

    fn touching(&self) -> Option<&dyn TouchingSurfaces> {
        self.term.touching()
    }

    fn changing(&self) -> Option<&dyn ChangingStencils> {
        self.term.changing().map(|_| self as &dyn ChangingStencils)
    }

    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        if self.term.changing().is_some() { Some(self) } else { None }
    }
}

impl StepLimit for TimedEnergy {
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        self.clock.time(|| self.term.limit().map_or(1.0, |limit| limit.max_step(x, dx)))
    }

    fn guards_way(&self) -> bool {
        self.term.limit().is_some_and(|limit| limit.guards_way())
    }

    fn obstruction(&self, x: &[f64], dx: &[f64]) -> Option<WayObstruction> {
        self.term.limit().and_then(|limit| limit.obstruction(x, dx))
    }
}

impl DissipativeTerm for TimedFriction {
    fn name(&self) -> String {
        self.term.name()
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        self.clock.time(|| self.term.evaluate(x, v))
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.clock.time(|| self.term.add_rows(first, g));
    }

    fn add_damping_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) {
        self.clock.time(|| self.term.add_damping_product(x, v, p, y));
    }

    fn is_friction(&self) -> bool {
        self.term.is_friction()
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.clock.time(|| self.term.power(x, v))
    }

    fn value(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.clock.time(|| self.term.value(x, v))
    }

    fn fault(&self, x: &[f64], v: &[f64]) -> Option<Fault> {
        self.term.fault(x, v)
    }
}

/// Products for gradients, which no benchmark of steps uses.
impl PositionProducts for TimedFriction {}

impl DissipationViews for TimedFriction {
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        self.term.changing().map(|_| self as &dyn ChangingStencils)
    }

    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        if self.term.changing().is_some() { Some(self) } else { None }
    }

    fn frozen(&mut self) -> Option<&mut dyn FrozenParts> {
        if self.frozen.is_some() { Some(self) } else { None }
    }
}

impl FrozenParts for TimedFriction {
    fn freeze(&mut self, x: &[f64], part: f64) -> bool {
        self.clock.time(|| self.term.frozen().is_some_and(|parts| parts.freeze(x, part)))
    }

    fn thaw(&mut self) {
        self.term.frozen().into_iter().for_each(|parts| parts.thaw());
    }

    fn follow(&mut self, v: &[f64], dv: &[f64]) {
        self.clock.time(|| self.term.frozen().into_iter().for_each(|parts| parts.follow(v, dv)));
    }

    fn threshold_speed(&self) -> Option<f64> {
        self.frozen.and_then(|(speed, _)| speed)
    }

    fn most_renewals(&self) -> u32 {
        self.frozen.map_or(1, |(_, renewals)| renewals)
    }
}

/// A term with changing stencils.
trait HasStencils {
    fn found(&self) -> Option<&dyn ChangingStencils>;
    fn found_mut(&mut self) -> Option<&mut dyn ChangingStencils>;
}

impl HasStencils for dyn EnergyTerm {
    fn found(&self) -> Option<&dyn ChangingStencils> {
        self.changing()
    }

    fn found_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        self.changing_mut()
    }
}

impl HasStencils for dyn DissipativeTerm {
    fn found(&self) -> Option<&dyn ChangingStencils> {
        self.changing()
    }

    fn found_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        self.changing_mut()
    }
}

impl<T: HasStencils + Send + Sync + ?Sized> ChangingStencils for Timed<T> {
    fn begin_step(&mut self, x: &[f64], v: &[f64], dt: f64) -> bool {
        let stencils = self.term.found_mut();
        self.clock.time(|| stencils.is_some_and(|stencils| stencils.begin_step(x, v, dt)))
    }

    fn find(&mut self, x: &[f64]) -> bool {
        let stencils = self.term.found_mut();
        self.clock.time(|| stencils.is_some_and(|stencils| stencils.find(x)))
    }

    fn follow(&mut self, x: &[f64], step: &[f64]) {
        let stencils = self.term.found_mut();
        self.clock.time(|| stencils.into_iter().for_each(|stencils| stencils.follow(x, step)));
    }

    fn forget(&mut self) {
        self.term.found_mut().into_iter().for_each(|stencils| stencils.forget());
    }

    fn likely_pairs(&self, x: &[f64]) -> Vec<[u32; 2]> {
        self.term.found().map_or(vec![], |stencils| stencils.likely_pairs(x))
    }

    fn lists(&self) -> &[Stencils] {
        self.term.found().map_or(&[], |stencils| stencils.lists())
    }

    fn blocks(&self, list: usize, stencils: Range<usize>, at: (&[f64], &[f64]), psd: Psd, out: &mut [f64]) {
        let Some(of) = self.term.found() else { return };
        self.clock.time(|| of.blocks(list, stencils, at, psd, out));
    }
}
