//! Adjoints of force evaluations: products with Hessians, linear solves, and contributions to parameters.

use std::mem::take;

use pliant::solver::structure::LentStructure;
use pliant::system::System;

use pliant::algebra::dot;

use super::{AdjointPlace, Singular, add_scaled};
use crate::linear::{Coefficients, CorrectedSolver, Products};
use crate::parameter::{ForceUse, HeldUse, Parameter, StateUse};
use crate::parts::ForceParts;
use crate::support::turns;

/// Derivatives by parameters, and solver memory, for one backward sweep.
pub(crate) struct Sums<'a> {
    parameters: &'a mut [Box<dyn Parameter>],
    /// Derivatives by each parameter.
    pub(crate) derivatives: Vec<Vec<f64>>,
    solver: CorrectedSolver,
    parts: ForceParts,
    p: Vec<f64>,
    products: Products,
    /// Index of the step being propagated, counted from the start of the run.
    pub(crate) step: u64,
    /// Derivatives by the initial positions of vertices with prescribed rotation.
    turning: Option<TurningStarts>,
    /// Derivatives by the history variables of terms at the beginning of the step; empty if there are
    /// none.
    pub(crate) history: Vec<f64>,
}

/// Derivatives by the initial positions of vertices with prescribed rotation: later positions are rotated
/// from there.
struct TurningStarts {
    /// Flat; by the positions at time 0.
    by_starts: Vec<f64>,
    /// Scratch: negated products.
    x_bar: Vec<f64>,
    v_bar: Vec<f64>,
}

impl TurningStarts {
    /// Adds the contributions of derivatives by positions and velocities at `time` [s].
    fn add(&mut self, system: &System, time: f64, (x_bar, v_bar): (&[f64], &[f64])) {
        for hold in system.constraints().iter().filter(|hold| turns(hold)) {
            hold.add_by_starts(time, system.dimension(), (x_bar, v_bar), &mut self.by_starts);
        }
    }
}

impl<'a> Sums<'a> {
    /// Zero derivatives for `unknowns` coordinates, `dimension` of each vertex.
    pub(crate) fn new(dimension: usize, unknowns: usize, parameters: &'a mut [Box<dyn Parameter>]) -> Self {
        Sums {
            derivatives: parameters.iter().map(|parameter| vec![0.0; parameter.len()]).collect(),
            parts: ForceParts::new(parameters),
            parameters,
            solver: CorrectedSolver::new(dimension),
            p: vec![0.0; unknowns],
            products: Products::back(unknowns),
            step: 0,
            turning: None,
            history: vec![],
        }
    }

    /// Adds derivatives by the initial positions of vertices with prescribed rotation, and by history
    /// variables.
    pub(crate) fn turning(self, system: &System) -> Self {
        let zero = || vec![0.0; system.inverse_mass().len()];
        let some = system.constraints().iter().any(turns);
        let turning = some.then(|| TurningStarts { by_starts: zero(), x_bar: zero(), v_bar: zero() });
        Sums { turning, history: vec![0.0; system.history_len()], ..self }
    }
}

impl Sums<'_> {
    /// True if any derivative needs fixed coordinates.
    pub(crate) fn look_at_held(&self) -> bool {
        self.turning.is_some() || self.parameters.iter().any(|parameter| parameter.needs().held)
    }

    /// Replaces derivatives by rotating positions, in `x_bar`, by those by the positions at `time` [s],
    /// from which they continue.
    pub(crate) fn place_turning(&self, system: &System, time: f64, x_bar: &mut [f64]) {
        let (Some(turning), d) = (&self.turning, system.dimension()) else { return };
        // x(0) = c + R^T (x - ..): component k by R_k . d x(0).
        for k in 0..d {
            let (zero, mut axis, mut row) = (vec![0.0; x_bar.len()], vec![0.0; x_bar.len()], vec![]);
            axis.iter_mut().skip(k).step_by(d).for_each(|entry| *entry = 1.0);
            for hold in system.constraints().iter().filter(|hold| turns(hold)) {
                row.clear();
                row.resize(x_bar.len(), 0.0);
                hold.add_by_starts(time, d, (&axis, &zero), &mut row);
                for vertex in hold.vertices() {
                    let at = *vertex as usize * d;
                    x_bar[at + k] = dot(&row[at..at + d], &turning.by_starts[at..at + d]);
                }
            }
        }
    }

    /// Direction of the last force evaluation.
    pub(crate) fn direction(&self) -> &[f64] {
        &self.p
    }

    /// True if the matrix of the last solve is positive definite.
    pub(crate) fn is_definite(&mut self) -> bool {
        self.solver.is_definite()
    }

    /// Hands out the matrix structure of the solver, and continues with the one `lent`.
    pub(crate) fn exchange_structure(
        &mut self,
        system: &System,
        lent: Option<LentStructure>,
    ) -> Option<LentStructure> {
        self.solver.exchange_structure(system, lent)
    }

    /// True if one of the parameters is the mass-proportional drag.
    pub(crate) fn has_ether_drag(&self) -> bool {
        self.parameters.iter().any(|parameter| parameter.needs().ether_drag)
    }

    /// Adds a contribution to the derivative by the mass-proportional drag.
    pub(crate) fn add_ether_drag(&mut self, part: f64) {
        let each = self.parameters.iter().zip(&mut self.derivatives);
        each.filter(|(parameter, _)| parameter.needs().ether_drag).for_each(|(_, by)| by[0] += part);
    }

    /// Lets parameters add their contributions of a state.
    pub(crate) fn add_state(&mut self, of: &StateUse<'_>) {
        for (parameter, derivative) in self.parameters.iter_mut().zip(&mut self.derivatives) {
            parameter.add_state(of, derivative);
        }
    }

    /// Lets parameters add their contributions of fixed coordinates.
    pub(crate) fn add_held(&mut self, of: &HeldUse<'_>) {
        if let Some(turning) = &mut self.turning {
            turning.add(of.system, of.time, (of.x_bar, of.v_bar));
        }
        for (parameter, derivative) in self.parameters.iter_mut().zip(&mut self.derivatives) {
            parameter.add_held(of, derivative);
        }
    }
}

/// Equations of motion, for one step back.
pub(crate) struct AdjointForces<'a, 'b> {
    pub(crate) system: &'a mut System,
    pub(crate) sums: &'a mut Sums<'b>,
    pub(crate) held: Option<HeldStart<'a>>,
    /// Beginning of the step and its size [s], if dissipative terms use the mean velocities of fixed
    /// coordinates over the step.
    pub(crate) means_from: Option<(AdjointPlace<'a>, f64)>,
}

/// Start of a step whose solves lag position-dependent quantities of dissipative terms there, see
/// [`System::freeze_at`].
pub(crate) struct HeldStart<'a> {
    /// Positions, flat.
    x: &'a [f64],
    /// Derivatives by the positions, through lagged quantities.
    pub(crate) x_bar: Vec<f64>,
}

impl<'a> HeldStart<'a> {
    /// Start at positions `x`, flat, with zero derivatives.
    pub(crate) fn new(x: &'a [f64]) -> Self {
        HeldStart { x, x_bar: vec![0.0; x.len()] }
    }
}

/// Derivatives by the positions and velocities of an evaluation point.
pub(crate) struct Bars<'a> {
    pub(crate) x: &'a mut [f64],
    pub(crate) v: &'a mut [f64],
}

impl AdjointForces<'_, '_> {
    /// Adjoint of `a = -M^-1 (dE/dx + dR/dv)`, `a_bar` the derivative by `a`: adds the contributions of
    /// `p = M^-1 a_bar` to the derivatives by positions and velocities.
    pub(crate) fn acceleration(&mut self, at: AdjointPlace<'_>, a_bar: &[f64], bars: Bars<'_>) {
        let Sums { p, products, .. } = &mut *self.sums;
        for ((p, a_bar), weight) in p.iter_mut().zip(a_bar).zip(self.system.inverse_mass()) {
            *p = weight * a_bar;
        }
        self.system.set_time(at.time);
        products.evaluate(self.system, (at.x, at.v), p);
        self.pass_on(at, None, bars);
    }

    /// Adjoint of an acceleration whose direction `p`, zero where fixed, is known.
    pub(crate) fn direction(&mut self, at: AdjointPlace<'_>, p: &[f64], bars: Bars<'_>) {
        self.sums.p.copy_from_slice(p);
        self.system.set_time(at.time);
        self.sums.products.evaluate(self.system, (at.x, at.v), p);
        self.pass_on(at, None, bars);
    }

    /// Adjoint of an implicit stage: solves `A p = right` with `A` of these `coefficients`. Adds the
    /// contributions of `p` to the derivatives by positions and velocities, and replaces `right` by `M
    /// p`, zero where fixed.
    ///
    /// # Errors
    /// [`Singular`].
    pub(crate) fn solve(
        &mut self,
        at: AdjointPlace<'_>,
        coefficients: Coefficients,
        right: &mut [f64],
        bars: Bars<'_>,
    ) -> Result<(), Singular> {
        if let Some(start) = &self.held {
            self.system.freeze_at(start.x, at.v);
        }
        let Sums { p, products, solver, .. } = &mut *self.sums;
        self.system.set_time(at.time);
        let is_solved = solver.solve(self.system, (at.x, at.v), coefficients, right, p, products);
        if is_solved {
            let d = self.system.dimension();
            for (i, right) in right.iter_mut().enumerate() {
                *right = self.system.mass()[i / d] * p[i];
            }
            let held = self.held.as_ref().map(|start| start.x);
            self.pass_on(at, held, bars);
        }
        self.release(at.v);
        if is_solved { Ok(()) } else { Err(Singular) }
    }

    /// Ends the lagging at the start of the step, and adds the derivatives by its positions.
    fn release(&mut self, v: &[f64]) {
        let Some(HeldStart { x, x_bar }) = &mut self.held else { return };
        self.system.thaw();
        let (p, mut product) = (&self.sums.p, vec![0.0; x.len()]);
        for term in self.system.dissipation_mut().filter(|term| term.changing().is_some()) {
            term.add_position_product(x, v, p, &mut product);
        }
        add_scaled(x_bar, -1.0, &product);
    }

    /// Converts derivatives by mean velocities `(x' - x) / h` of fixed coordinates to those by their
    /// positions at the end and the beginning of a step of `h` [s].
    fn pass_means_on(&mut self, from: AdjointPlace<'_>, h: f64) {
        let Products { by_positions, by_velocities, .. } = &mut self.sums.products;
        let still = vec![0.0; by_positions.len()];
        let mut x_bar = still.clone();
        for i in (0..x_bar.len()).filter(|i| self.system.inverse_mass()[*i] == 0.0) {
            x_bar[i] = take(&mut by_velocities[i]) / h;
            by_positions[i] += x_bar[i];
        }
        let AdjointPlace { time, x, v } = from;
        self.sums.add_held(&HeldUse { system: self.system, time, x, v, x_bar: &x_bar, v_bar: &still });
    }

    /// Subtracts the products with `p` from the derivatives, and lets parameters add their contributions
    /// of this force evaluation. Lagged normal forces of friction are those at `held`.
    fn pass_on(&mut self, at: AdjointPlace<'_>, held: Option<&[f64]>, bars: Bars<'_>) {
        let step = self.sums.step;
        // Derivatives by positions and velocities.
        bars.x.iter_mut().zip(&self.sums.products.by_positions).for_each(|(bar, y)| *bar -= y);
        if self.system.is_damped() {
            bars.v.iter_mut().zip(&self.sums.products.by_velocities).for_each(|(bar, y)| *bar -= y);
        }
        if let Some((from, h)) = self.means_from {
            self.pass_means_on(from, h);
        }
        let Sums { parameters, derivatives, parts, p, products, turning, history, .. } = &mut *self.sums;
        // History variables, and initial positions of rotating vertices.
        if !history.is_empty() {
            let minus: Vec<f64> = p.iter().map(|p| -p).collect();
            self.system.add_work_by_history(at.x, &minus, history);
        }
        if let Some(turning) = turning {
            let negative = |to: &mut [f64], of: &[f64]| to.iter_mut().zip(of).for_each(|(to, of)| *to = -of);
            let (mut x_bar, mut v_bar) = (take(&mut turning.x_bar), take(&mut turning.v_bar));
            negative(&mut x_bar, &products.by_positions);
            negative(&mut v_bar, &products.by_velocities);
            turning.add(self.system, at.time, (&x_bar, &v_bar));
            (turning.x_bar, turning.v_bar) = (x_bar, v_bar);
        }
        // Parameters.
        parts.evaluate(self.system, at);
        let ForceParts { gradient, contact, friction, terms, rest_lengths, .. } = &*parts;
        let Products { by_positions, by_velocities, works, .. } = products;
        let of = ForceUse {
            system: self.system,
            step,
            time: at.time,
            x: at.x,
            v: at.v,
            held,
            p,
            gradient,
            contact,
            friction,
            terms,
            rest_lengths,
            by_positions,
            by_velocities,
            works,
        };
        for (parameter, derivative) in parameters.iter_mut().zip(derivatives) {
            parameter.add(&of, derivative);
        }
    }
}
