//! Tangents of force evaluations.

use pliant::system::System;

use crate::adjoint::{AdjointPlace, Singular, add_scaled};
use crate::linear::{Coefficients, CorrectedSolver, Products};
use crate::parameter::{ForceUse, HeldChange, Parameter};
use crate::parts::ForceParts;
use crate::support::turns;
use pliant::algebra::dot;

/// Solver memory and products, and the changing parameters.
pub(super) struct TangentForces<'p> {
    parameters: &'p mut [Box<dyn Parameter>],
    /// Change of the numbers of each parameter.
    changes: &'p [Vec<f64>],
    parts: ForceParts,
    /// Number of steps of the run before the present one.
    pub(super) step: u64,
    /// Positions at the start of the step and their change, if solves lag position-dependent quantities
    /// of dissipative terms there, see [`System::freeze_at`].
    pub(super) held: Option<[Vec<f64>; 2]>,
    /// Beginning of the step and its size [s], if dissipative terms use the mean velocities of fixed
    /// coordinates over the step.
    pub(super) means_from: Option<(f64, f64)>,
    /// Index of a parameter whose change of forces is not known.
    pub(super) unknown: Option<usize>,
    /// Change of the initial positions of vertices with prescribed rotation, flat; empty if there are
    /// none.
    starts: Vec<f64>,
    /// Change of the initial state of the run, flat; parameters of prescribed motion change its fixed
    /// coordinates further. Empty if there is no such parameter.
    moved: Vec<f64>,
    solver: CorrectedSolver,
    products: Products,
    by_positions: Vec<f64>,
    by_velocities: Vec<f64>,
}

impl<'p> TangentForces<'p> {
    /// Memory for `unknowns` coordinates, `dimension` of each vertex.
    pub(super) fn new(
        dimension: usize,
        unknowns: usize,
        parameters: &'p mut [Box<dyn Parameter>],
        changes: &'p [Vec<f64>],
    ) -> Self {
        TangentForces {
            parts: ForceParts::new(parameters),
            parameters,
            changes,
            step: 0,
            held: None,
            means_from: None,
            unknown: None,
            starts: vec![],
            moved: vec![],
            solver: CorrectedSolver::new(dimension),
            products: Products::forth(unknowns),
            by_positions: vec![0.0; unknowns],
            by_velocities: vec![0.0; unknowns],
        }
    }

    /// Change of `-dE/dx - dR/dv - c M v` [N] due to the change `(x, v)` of the state and to the
    /// parameters, with the mass-proportional drag `c`; zero where fixed.
    pub(super) fn force(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        by: (&[f64], &[f64]),
    ) -> Vec<f64> {
        self.force_with(system, at, None, by)
    }

    /// Change of the force with lagged normal forces of friction at the positions `held_at`, if any.
    fn force_with(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        held_at: Option<&[f64]>,
        (x, v): (&[f64], &[f64]),
    ) -> Vec<f64> {
        system.set_time(at.time);
        let mut held = self.held_change(system, at.time, (x, v));
        if let (Some([end, means]), Some((time, h))) = (&mut held, self.means_from) {
            let [start, _] = self.held_change(system, time, (x, v)).expect("some at the end");
            for i in (0..x.len()).filter(|i| system.inverse_mass()[*i] == 0.0) {
                means[i] = (end[i] - start[i]) / h;
            }
        }
        let (x, v) = held.as_ref().map_or((x, v), |[x, v]| (x, v));
        system.hessian_product(at.x, x, &mut self.by_positions);
        self.by_velocities.fill(0.0);
        if system.is_damped() {
            system.position_change(at.x, at.v, x, &mut self.by_velocities);
            self.by_positions.iter_mut().zip(&self.by_velocities).for_each(|(y, part)| *y += part);
            system.damping_product(at.x, at.v, v, &mut self.by_velocities);
        }
        let (d, drag) = (system.dimension(), system.ether_drag());
        let change =
            |i: usize| -self.by_positions[i] - self.by_velocities[i] - drag * system.mass()[i / d] * v[i];
        let mut force: Vec<f64> = (0..x.len()).map(change).collect();
        self.add_parameters(system, at, held_at, &mut force);
        self.keep_free(system, &mut force);
        force
    }

    /// Sets the changes of initial positions of moving constraints, from the change `x` of the positions
    /// at `time` [s].
    pub(super) fn start_moving(&mut self, system: &System, time: f64, x: &[f64]) {
        let zero = vec![0.0; x.len()];
        for hold in system.constraints().iter().filter(|hold| turns(hold)) {
            self.starts.resize(x.len(), 0.0);
            hold.add_by_starts(time, system.dimension(), (x, &zero), &mut self.starts);
        }
        if self.parameters.iter().any(|parameter| parameter.needs().held) {
            self.moved = x.to_vec();
        }
    }

    /// Change `(x, v)` at `time` [s], completed for moving constraints: positions and velocities of
    /// rotating vertices are linear in their initial positions, and parameters of prescribed motion
    /// change others. `None` if there are no such constraints.
    pub(super) fn held_change(
        &mut self,
        system: &System,
        time: f64,
        (x, v): (&[f64], &[f64]),
    ) -> Option<[Vec<f64>; 2]> {
        if self.starts.is_empty() && self.moved.is_empty() {
            return None;
        }
        let mut change = [x.to_vec(), v.to_vec()];
        for (i, start) in self.moved.iter().enumerate().filter(|(i, _)| system.inverse_mass()[*i] == 0.0) {
            (change[0][i], change[1][i]) = (*start, 0.0);
        }
        if !self.starts.is_empty() {
            self.turn(system, time, &mut change);
        }
        let [x, v] = &mut change;
        for (parameter, numbers) in self.parameters.iter_mut().zip(self.changes) {
            parameter.add_held_change(system, time, numbers, HeldChange { x, v });
        }
        Some(change)
    }

    /// Sets the change of rotating vertices at `time` [s].
    fn turn(&self, system: &System, time: f64, turned: &mut [Vec<f64>; 2]) {
        let (d, zero) = (system.dimension(), vec![0.0; self.starts.len()]);
        for k in 0..d {
            let mut axis = zero.clone();
            axis.iter_mut().skip(k).step_by(d).for_each(|entry| *entry = 1.0);
            for ((x, v), turned) in [(&axis, &zero), (&zero, &axis)].into_iter().zip(&mut *turned) {
                for hold in system.constraints().iter().filter(|hold| turns(hold)) {
                    // Row k of the matrix of the motion.
                    let mut row = zero.clone();
                    hold.add_by_starts(time, d, (x, v), &mut row);
                    for vertex in hold.vertices() {
                        let at = *vertex as usize * d;
                        turned[at + k] = dot(&row[at..at + d], &self.starts[at..at + d]);
                    }
                }
            }
        }
    }

    /// Change of the force in an implicit stage, with quantities lagged at the start of the step.
    pub(super) fn solved_force(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        by: (&[f64], &[f64]),
    ) -> Vec<f64> {
        let Some([start, change]) = self.held.take() else { return self.force(system, at, by) };
        system.freeze_at(&start, at.v);
        let mut force = self.force_with(system, at, Some(&start), by);
        system.thaw();
        let mut of_start = vec![0.0; force.len()];
        for term in system.dissipation_mut().filter(|term| term.changing().is_some()) {
            term.add_position_change(&start, at.v, &change, &mut of_start);
        }
        add_scaled(&mut force, -1.0, &of_start);
        self.keep_free(system, &mut force);
        self.held = Some([start, change]);
        force
    }

    /// Adds the change of the force due to the parameters.
    fn add_parameters(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        held: Option<&[f64]>,
        force: &mut [f64],
    ) {
        let TangentForces { parameters, changes, parts, step, unknown, .. } = self;
        if parameters.is_empty() {
            return;
        }
        parts.evaluate(system, at);
        let ForceParts { gradient, contact, friction, terms, rest_lengths, .. } = &*parts;
        let of = ForceUse {
            system,
            step: *step,
            time: at.time,
            x: at.x,
            v: at.v,
            held,
            p: &[],
            gradient,
            contact,
            friction,
            terms,
            rest_lengths,
            by_positions: &[],
            by_velocities: &[],
            works: &[],
        };
        for (i, (parameter, change)) in parameters.iter_mut().zip(*changes).enumerate() {
            if !parameter.add_change(&of, change, force) {
                unknown.get_or_insert(i);
            }
        }
    }

    /// Change of the mass-proportional drag [1/s].
    pub(super) fn ether_drag_change(&self) -> f64 {
        let each = self.parameters.iter().zip(self.changes);
        each.filter(|(parameter, _)| parameter.needs().ether_drag).map(|(_, change)| change[0]).sum()
    }

    /// Change of the acceleration [m/s^2].
    pub(super) fn acceleration(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        by: (&[f64], &[f64]),
    ) -> Vec<f64> {
        let mut force = self.force(system, at, by);
        force.iter_mut().zip(system.inverse_mass()).for_each(|(force, weight)| *force *= weight);
        force
    }

    /// Solves `A p = right` with `A` of these `coefficients`; `p` is zero where fixed.
    pub(super) fn solve(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        coefficients: Coefficients,
        right: &[f64],
    ) -> Result<Vec<f64>, Singular> {
        let mut p = vec![0.0; right.len()];
        system.set_time(at.time);
        if let Some([start, _]) = &self.held {
            system.freeze_at(start, at.v);
        }
        let is_solved =
            self.solver.solve(system, (at.x, at.v), coefficients, right, &mut p, &mut self.products);
        system.thaw();
        if is_solved { Ok(p) } else { Err(Singular) }
    }

    /// True if the matrix of the last solve is positive definite.
    pub(super) fn is_definite(&mut self) -> bool {
        self.solver.is_definite()
    }

    /// Sets fixed components to zero.
    pub(super) fn keep_free(&self, system: &System, rows: &mut [f64]) {
        let held = rows.iter_mut().zip(system.inverse_mass()).filter(|(_, weight)| **weight == 0.0);
        held.for_each(|(row, _)| *row = 0.0);
    }
}
