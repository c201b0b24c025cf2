//! Integrator of the Gauss-Radau method IAS15: a fixed-point iteration for the acceleration as a
//! polynomial through seven nodes and the start of the step.

use super::Integrator;
use super::equations::{acceleration, acceleration_at};
use super::estimate::{Judgement, Tolerances};
use super::ias15::Ias15Parameters;
use super::implicit::NextState;
use crate::solver::StepFault;
use crate::solver::{SolveError, SolveFailure};
use crate::state::State;
use crate::system::{ForceId, System};

/// Terms of the polynomial, without the constant one.
pub const TERMS: usize = 7;
/// Nodes: zeros of `(P_7 + P_8)(2 s - 1)`; Rein, Spiegel 2015, section 2.1, in more digits.
#[allow(clippy::excessive_precision, reason = "the digits of the reference")]
pub const NODES: [f64; TERMS + 1] = [
    0.0,
    0.056_262_560_536_922_146_465_652_191,
    0.180_240_691_736_892_364_987_579_942_8,
    0.352_624_717_113_169_637_373_907_770_2,
    0.547_153_626_330_555_383_001_448_557_7,
    0.734_210_177_215_410_531_523_210_605_8,
    0.885_320_946_839_095_768_090_359_762_9,
    0.977_520_613_561_287_501_891_174_500_4,
];
/// Relative change of the acceleration below which an iteration has converged.
const CONVERGED: f64 = 1e-16;
/// Relative change below which a stagnant iteration has reached rounding.
const ROUNDING: f64 = 1e-12;
/// Iterations after which the step counts as large, with the larger rounding `LARGE_ROUNDING`.
const LONG: u32 = 12;
const LARGE_ROUNDING: f64 = 1e-10;
/// Position change that counts as rounding, in units in the last place. Stiff forces give
/// `(h omega)^2 <= 4` per unit, a vertex sees those of a dozen neighbours, and the last divided
/// difference multiplies by `1 / prod_j (h_7 - h_j) = 233`.
const POSITION_ULPS: f64 = 16384.0;
/// Growth of the changes at which the iteration has diverged.
const HOPELESS: f64 = 1e6;
/// Iteration limit of a step.
const MAX_ITERATIONS: u32 = 40;
/// Largest ratio of a step size to the last one for which coefficients are predicted.
const LARGEST_RATIO: f64 = 20.0;

/// Values per coordinate in the stored history: coefficients, predicted coefficients, rounding errors of
/// position and velocity, and the last acceleration.
const ROW: usize = 2 * TERMS + 3;

/// Coefficients of one coordinate.
type Terms = [f64; TERMS];

/// Integrator of the Gauss-Radau method.
pub struct GaussRadau {
    parameters: Ias15Parameters,
    /// Coefficients of the products `s (s - h_1) ... (s - h_j)` in powers of `s` from the first power on,
    /// and of the powers in these products.
    to_powers: [Terms; TERMS],
    to_products: [Terms; TERMS],
    /// History of the last step, and of the one before it, to which `undo` returns.
    now: Memory,
    before: Memory,
    dimension: usize,
    /// Divided differences.
    g: Vec<Terms>,
    /// Rounding errors of the coefficients in this step.
    lost: Vec<Terms>,
    /// Accelerations at the beginning of the step and at a node.
    first: Vec<f64>,
    at: Vec<f64>,
    next: NextState,
    /// `max |b_6| / max |a|` of the last step.
    last_term: f64,
    /// Origin of the positions in this step [m]; zero unless the bodies only interact with each other.
    origin: [f64; 3],
    /// True if `origin` is used.
    has_origin: bool,
}

/// History that a step leaves for the next one.
struct Memory {
    /// Step size [s]; 0 without history.
    h: f64,
    b: Vec<Terms>,
    /// Predicted values of `b`.
    predicted: Vec<Terms>,
    /// State after the step, and its rounding errors.
    after: NextState,
    lost: NextState,
    /// Structure version of the system.
    structure: u64,
}

impl Memory {
    fn new(unknowns: usize) -> Self {
        Memory {
            h: 0.0,
            b: vec![[0.0; TERMS]; unknowns],
            predicted: vec![[0.0; TERMS]; unknowns],
            after: NextState::new(unknowns),
            lost: NextState::new(unknowns),
            structure: 0,
        }
    }

    /// Writes the history and the accelerations `at` as numbers for [`read`](Self::read): the step size,
    /// then one row per coordinate.
    fn write(&self, at: &[f64]) -> Vec<f64> {
        let row = |i: usize| {
            let terms = self.b[i].into_iter().chain(self.predicted[i]);
            // A failed step may have left values that are not finite.
            let at = if at[i].is_finite() { at[i] } else { 0.0 };
            terms.chain([self.lost.x[i], self.lost.v[i], at])
        };
        std::iter::once(self.h).chain((0..at.len()).flat_map(row)).collect()
    }

    /// Reads the numbers that [`write`](Self::write) produced for a step that led to `state`. Returns
    /// false if their count does not fit.
    fn read(&mut self, numbers: &[f64], at: &mut [f64], system: &System, state: &State) -> bool {
        let Some((h, rows)) = numbers.split_first() else { return false };
        if rows.len() != ROW * at.len() {
            return false;
        }
        for (i, row) in rows.chunks_exact(ROW).enumerate() {
            self.b[i].copy_from_slice(&row[..TERMS]);
            self.predicted[i].copy_from_slice(&row[TERMS..2 * TERMS]);
            (self.lost.x[i], self.lost.v[i], at[i]) =
                (row[2 * TERMS], row[2 * TERMS + 1], row[2 * TERMS + 2]);
        }
        self.after.x.copy_from_slice(state.x());
        self.after.v.copy_from_slice(state.v());
        (self.h, self.structure) = (*h, system.structure());
        true
    }

    /// True if the step led to `state`.
    fn leads_to(&self, system: &System, state: &State) -> bool {
        self.h > 0.0
            && self.structure == system.structure()
            && *self.after.x == *state.x()
            && *self.after.v == *state.v()
    }
}

impl GaussRadau {
    /// Creates the integrator for `unknowns` coordinates.
    pub fn new(parameters: Ias15Parameters, unknowns: usize) -> Self {
        let (to_powers, to_products) = conversions();
        GaussRadau {
            parameters,
            to_powers,
            to_products,
            now: Memory::new(unknowns),
            before: Memory::new(unknowns),
            dimension: 1,
            g: vec![[0.0; TERMS]; unknowns],
            lost: vec![[0.0; TERMS]; unknowns],
            first: vec![0.0; unknowns],
            at: vec![0.0; unknowns],
            next: NextState::new(unknowns),
            last_term: 0.0,
            origin: [0.0; 3],
            has_origin: false,
        }
    }

    /// Starts a step of `h` [s] with coefficients extrapolated from the last step, corrected by the error
    /// of its own prediction; Rein, Spiegel 2015, eq. 12 and 13.
    fn predict(&mut self, system: &System, state: &State, h: f64) {
        // The last step becomes the previous one; after an `undo` the previous one still is.
        if self.now.leads_to(system, state) {
            std::mem::swap(&mut self.now, &mut self.before);
        } else if !self.before.leads_to(system, state) {
            self.before.h = 0.0;
        }
        let (last, now) = (&self.before, &mut self.now);
        let ratio = h / last.h;
        let known = last.h > 0.0;
        if known {
            now.lost.x.copy_from_slice(&last.lost.x);
            now.lost.v.copy_from_slice(&last.lost.v);
        } else {
            now.lost.x.fill(0.0);
            now.lost.v.fill(0.0);
        }
        // Extrapolate the coefficients and add the last prediction error.
        if !known || ratio > LARGEST_RATIO {
            now.b.fill([0.0; TERMS]);
            now.predicted.fill([0.0; TERMS]);
        } else {
            for i in 0..now.b.len() {
                let predicted = continued(&last.b[i], ratio);
                for k in 0..TERMS {
                    now.b[i][k] = predicted[k] + (last.b[i][k] - last.predicted[i][k]);
                }
                now.predicted[i] = predicted;
            }
        }
        // Convert to divided differences.
        for (g, b) in self.g.iter_mut().zip(&now.b) {
            *g = [0.0; TERMS];
            for (j, g) in g.iter_mut().enumerate() {
                for k in j..TERMS {
                    *g += self.to_products[k][j] * b[k];
                }
            }
        }
        self.lost.fill([0.0; TERMS]);
    }

    /// Chooses the position of the most accelerated body as the origin of this step. Returns false if the
    /// forces depend on the origin. Bodies that only interact with each other do not feel the origin;
    /// near it, coordinates are small and have spare digits, which [`Memory::lost`] fills, so that the
    /// rounding of positions, large compared with a small distance, stays out of the forces.
    fn choose_origin(&mut self, system: &System, state: &State) -> bool {
        let d = self.dimension;
        self.origin = [0.0; 3];
        let only_each_other = system.terms().iter().all(|term| term.properties().couples_all)
            && !(system.terms().is_empty() || system.is_damped() || system.ether_drag() != 0.0)
            && system.constraints().is_empty();
        if !only_each_other {
            return false;
        }
        let (mut most, mut at) = (-1.0, 0);
        for (vertex, a) in self.at.chunks_exact(d).enumerate() {
            let square: f64 = a.iter().map(|a| a * a).sum();
            if square > most {
                (most, at) = (square, vertex);
            }
        }
        self.origin[..d].copy_from_slice(&state.x()[at * d..][..d]);
        true
    }

    /// Computes positions, and velocities if `wants_velocity`, at the fraction `s` of the step.
    fn advance(&mut self, state: &State, h: f64, s: f64, wants_velocity: bool) {
        let (hs, d) = (h * s, self.dimension);
        for i in 0..self.at.len() {
            let (b, a, v) = (&self.now.b[i], self.first[i], state.v()[i]);
            let [mut twice, mut once] = [0.0; 2];
            for k in (0..TERMS).rev() {
                let n = (k + 1) as f64;
                twice = s * (b[k] / ((n + 1.0) * (n + 2.0)) + twice);
                if wants_velocity {
                    once = s * (b[k] / (n + 1.0) + once);
                }
            }
            let (lost_x, lost_v) = (self.now.lost.x[i], self.now.lost.v[i]);
            let moved = hs * (v + (hs * (0.5 * a + twice) - lost_v));
            self.next.x[i] = (state.x()[i] - self.origin[i % d]) + (moved - lost_x);
            if wants_velocity {
                self.next.v[i] = v + (hs * (a + once) - lost_v);
            }
        }
    }

    /// Updates the polynomial with the accelerations at node `n`, in `at`. Returns the largest change of
    /// the last coefficient and the largest acceleration.
    fn correct(&mut self, n: usize) -> (f64, f64) {
        let (mut change, mut largest) = (0.0f64, 0.0f64);
        let weights = &self.to_powers[n - 1];
        for i in 0..self.at.len() {
            let (g, b, lost) = (&mut self.g[i], &mut self.now.b[i], &mut self.lost[i]);
            let mut difference = (self.at[i] - self.first[i]) / NODES[n];
            for j in 1..n {
                difference = (difference - g[j - 1]) / (NODES[n] - NODES[j]);
            }
            let by = difference - g[n - 1];
            g[n - 1] = difference;
            for k in 0..n {
                add(&mut b[k], &mut lost[k], by * weights[k]);
            }
            change = change.max(by.abs());
            largest = largest.max(self.at[i].abs());
            if !by.is_finite() {
                return (f64::NAN, largest);
            }
        }
        (change, largest)
    }

    /// Writes the accelerations at `(x, v)`, in `next`, to `at`.
    fn evaluate(&mut self, system: &mut System, time: f64) -> Result<(), StepFault> {
        let NextState { x, v } = &mut self.next;
        acceleration_at(system, time, (x, v), ForceId::NONE, &mut self.at)?;
        leave_held(system, &mut self.at);
        Ok(())
    }

    /// True if a position correction [m] is within the rounding of positions.
    fn is_rounding_of_positions(&self, correction: f64) -> bool {
        let reach = self.next.x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        correction <= POSITION_ULPS * f64::EPSILON * reach
    }

    /// Stores the last term relative to the `largest` acceleration: at the end of the step if bodies only
    /// interact with each other, over the whole step otherwise, since the acceleration may vanish at any
    /// one time.
    ///
    /// Stores zero if the term moves positions by no more than their rounding: near equilibrium, nearly
    /// cancelling forces leave an acceleration of rounding, whose last term does not shrink with the
    /// step. Bodies seen from a near origin have spare digits.
    fn note_last_term(&mut self, h: f64, largest: f64) {
        let last = self.now.b.iter().fold(0.0f64, |m, b| m.max(b[TERMS - 1].abs()));
        let is_rounding = !self.has_origin && self.is_rounding_of_positions(h * h * last);
        self.last_term = if last == 0.0 || is_rounding { 0.0 } else { last / largest };
    }

    /// Iterates until the polynomial agrees with the accelerations along it.
    fn iterate(&mut self, system: &mut System, state: &State, h: f64) -> Result<(), StepFault> {
        let wants_velocity =
            system.is_damped() || system.ether_drag() != 0.0 || system.has_prescribed_motion();
        let (mut before, mut least, mut correction) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
        let first = self.first.iter().fold(0.0f64, |m, a| m.max(a.abs()));
        for iteration in 1..=MAX_ITERATIONS {
            if system.is_stopped() {
                return Err(StepFault::stopped());
            }
            let (mut change, mut largest, mut in_step) = (0.0, 0.0, first);
            // Sweep over the nodes; each updates the polynomial.
            for n in 1..=TERMS {
                self.advance(state, h, NODES[n], wants_velocity);
                self.evaluate(system, state.time + NODES[n] * h)?;
                (change, largest) = self.correct(n);
                in_step = largest.max(in_step);
            }
            // Converged, or stagnant at rounding?
            let error = if change == 0.0 { 0.0 } else { change / largest };
            let rounding = if iteration > LONG { LARGE_ROUNDING } else { ROUNDING };
            let stagnates = iteration > 2 && error >= before || iteration == MAX_ITERATIONS;
            correction = h * h * change;
            let is_rounding = || error < rounding || self.is_rounding_of_positions(correction);
            if error < CONVERGED || stagnates && is_rounding() {
                self.note_last_term(h, if self.has_origin { largest } else { in_step });
                return Ok(());
            }
            // The first errors need not shrink.
            least = least.min(error);
            if error.is_nan() || error > HOPELESS * least {
                return Err(diverged(iteration, correction));
            }
            before = error;
        }
        Err(diverged(MAX_ITERATIONS, correction))
    }

    /// Computes the end of the step, adding small terms first with compensated summation.
    fn finish(&mut self, state: &State, h: f64) {
        let NextState { x, v } = &mut self.next;
        x.copy_from_slice(state.x());
        v.copy_from_slice(state.v());
        for i in 0..x.len() {
            let (b, lost) = (&self.now.b[i], &mut self.now.lost);
            let lost_v = lost.v[i];
            for k in (0..TERMS).rev() {
                let n = (k + 1) as f64;
                add(&mut x[i], &mut lost.x[i], h * h * (b[k] / ((n + 1.0) * (n + 2.0))));
                add(&mut v[i], &mut lost.v[i], h * (b[k] / (n + 1.0)));
            }
            add(&mut x[i], &mut lost.x[i], h * h * (0.5 * self.first[i]));
            add(&mut x[i], &mut lost.x[i], -h * lost_v);
            add(&mut x[i], &mut lost.x[i], h * state.v()[i]);
            add(&mut v[i], &mut lost.v[i], h * self.first[i]);
        }
    }
}

/// Compensated summation `sum += by`: `lost` carries the rounding error to the next addition; Kahan 1965,
/// *Further remarks on reducing truncation errors*.
fn add(sum: &mut f64, lost: &mut f64, by: f64) {
    let by = by - *lost;
    let new = *sum + by;
    *lost = (new - *sum) - by;
    *sum = new;
}

/// Sets the accelerations of prescribed coordinates to zero under drag: they do not enter the polynomial.
fn leave_held(system: &System, a: &mut [f64]) {
    if system.ether_drag() != 0.0 {
        let held = a.iter_mut().zip(system.inverse_mass()).filter(|(_, w)| **w == 0.0);
        held.for_each(|(a, _)| *a = 0.0);
    }
}

fn diverged(iterations: u32, correction: f64) -> StepFault {
    let solve = Some(SolveError { verdict: SolveFailure::Diverged, iterations, correction, left: None });
    StepFault { fault: None, vertex: None, solve }
}

/// Extrapolates the polynomial beyond its step, in powers of a step `ratio` times as large: Taylor series
/// about the end.
fn continued(b: &Terms, ratio: f64) -> Terms {
    let mut out = [0.0; TERMS];
    let mut power = 1.0;
    for k in 0..TERMS {
        power *= ratio;
        // Binomial coefficients (j + 1 over k + 1).
        let mut binomial = 1.0;
        let mut sum = 0.0;
        for j in k..TERMS {
            sum += binomial * b[j];
            binomial *= (j + 2) as f64 / (j + 1 - k) as f64;
        }
        out[k] = power * sum;
    }
    out
}

/// Returns the coefficients of the products in powers and of the powers in products. Row `j` belongs to
/// `s (s - h_1) ... (s - h_j)` and to `s^(j+1)`.
fn conversions() -> ([Terms; TERMS], [Terms; TERMS]) {
    let (mut to_powers, mut to_products) = ([[0.0; TERMS]; TERMS], [[0.0; TERMS]; TERMS]);
    for j in 0..TERMS {
        (to_powers[j][j], to_products[j][j]) = (1.0, 1.0);
        for k in 0..j {
            let below = |table: &[Terms; TERMS]| if k > 0 { table[j - 1][k - 1] } else { 0.0 };
            to_powers[j][k] = below(&to_powers) - NODES[j] * to_powers[j - 1][k];
            to_products[j][k] = below(&to_products) + NODES[k + 1] * to_products[j - 1][k];
        }
    }
    (to_powers, to_products)
}

impl Integrator for GaussRadau {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        self.dimension = system.dimension();
        self.predict(system, state, h);
        // Acceleration at the start of the step, relative to the origin if there is one.
        self.has_origin = self.choose_origin(system, state);
        if self.has_origin {
            self.advance(state, h, 0.0, false);
            if system.evaluate(&self.next.x).is_none() {
                return Err(StepFault::at(system, state.x(), state.v()));
            }
        } else if !system.holds(state.force) {
            system.set_time(state.time);
            if system.evaluate(state.x()).is_none() {
                return Err(StepFault::at(system, state.x(), state.v()));
            }
        }
        acceleration(system, state.x(), state.v(), &mut self.first);
        leave_held(system, &mut self.first);
        // The history is invalid until the step is complete.
        self.now.h = 0.0;
        self.iterate(system, state, h)?;
        self.finish(state, h);
        let NextState { x, v } = &mut self.next;
        system.prescribe(state.time + h, x, v);
        self.now.after.x.copy_from_slice(x);
        self.now.after.v.copy_from_slice(v);
        self.next.commit(system, state, h, ForceId::NONE)?;
        (self.now.h, self.now.structure) = (h, system.structure());
        Ok(())
    }

    fn judge(&mut self, _: &mut System, _: &State, h: f64, _: &Tolerances) -> Option<Judgement> {
        let ratio = self.parameters.epsilon / self.last_term;
        Some(Judgement::Step(if self.last_term == 0.0 { f64::INFINITY } else { h * ratio.powf(1.0 / 7.0) }))
    }

    fn stage_accelerations(&self) -> Vec<Vec<f64>> {
        let at =
            |s: f64, (first, b): (&f64, &Terms)| first + s * b.iter().rev().fold(0.0, |sum, b| b + s * sum);
        let row = |s: &f64| self.first.iter().zip(&self.now.b).map(|each| at(*s, each)).collect();
        NODES.iter().map(row).collect()
    }

    fn undo(&mut self, state: &mut State) {
        state.swap(&mut self.next.x, &mut self.next.v, ForceId::NONE);
        self.now.h = 0.0;
    }

    fn memory(&self, system: &System, state: &State) -> Vec<f64> {
        let last = [&self.now, &self.before].into_iter().find(|step| step.leads_to(system, state));
        last.map_or(vec![], |last| last.write(&self.at))
    }

    fn recall(&mut self, memory: &[f64], system: &System, state: &State) {
        (self.now.h, self.before.h) = (0.0, 0.0);
        if !self.now.read(memory, &mut self.at, system, state) {
            // The next step chooses its origin from these.
            self.at.fill(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nodes integrate polynomials of degree 14 exactly with interpolating weights, and not those of
    /// degree 15; the conversions between powers and products are inverse.
    #[test]
    fn nodes_and_conversions_are_those_of_the_gauss_radau_rule() {
        let (to_powers, to_products) = conversions();
        for i in 0..TERMS {
            for j in 0..TERMS {
                let sum: f64 = (0..TERMS).map(|k| to_powers[i][k] * to_products[k][j]).sum();
                assert!((sum - if i == j { 1.0 } else { 0.0 }).abs() < 1e-14, "{i} {j}: {sum}");
            }
        }
        let integral = |degree: i32| {
            // Newton's form through s^degree at the nodes, then powers.
            let mut g: Vec<f64> = NODES.iter().map(|s| s.powi(degree)).collect();
            for j in 1..=TERMS {
                for n in (j..=TERMS).rev() {
                    g[n] = (g[n] - g[n - 1]) / (NODES[n] - NODES[n - j]);
                }
            }
            (0..TERMS)
                .map(|j| (0..=j).map(|k| g[j + 1] * to_powers[j][k] / (k as f64 + 2.0)).sum::<f64>())
                .sum::<f64>()
        };
        for degree in 1..=14 {
            assert!((integral(degree) - 1.0 / f64::from(degree + 1)).abs() < 2e-14, "degree {degree}");
        }
        assert!((integral(15) - 1.0 / 16.0).abs() > 1e-9);
    }

    /// Taylor: continued by a step of the same size, `a_0 + b_0 s + ...` is itself at `1 + s`.
    #[test]
    fn a_polynomial_is_continued_beyond_its_step() {
        let b = [1.0, -2.0, 0.5, 3.0, -1.0, 0.25, 2.0];
        let value = |b: &Terms, s: f64| (0..TERMS).map(|k| b[k] * s.powi(k as i32 + 1)).sum::<f64>();
        for ratio in [0.3, 1.0, 2.5] {
            let continued = continued(&b, ratio);
            for s in [0.2, 0.7, 1.0] {
                let expected = value(&b, 1.0 + ratio * s) - value(&b, 1.0);
                assert!((value(&continued, s) - expected).abs() < 1e-12 * expected.abs(), "{ratio} {s}");
            }
        }
    }
}
