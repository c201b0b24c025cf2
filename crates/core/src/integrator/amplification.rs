//! What a scheme does to the oscillator, measured by running it.

use super::Method;
use std::ops::Range;

use crate::dissipation::MassProportional;
use crate::energy::{EnergyKind, EnergyTerm, Fault, Stencils};
use crate::material::Psd;
use crate::simulation::Simulation;
use crate::solver::SolverOptions;
use crate::state::State;
use crate::system::System;

/// The matrix that one step applies to `(x, v / omega)` of the oscillator `x'' = -omega^2 x - c x'`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplification(pub [[f64; 2]; 2]);

impl Amplification {
    /// Largest modulus of an eigenvalue.
    pub fn spectral_radius(&self) -> f64 {
        let [[a, b], [c, d]] = self.0;
        let (half_trace, determinant) = (0.5 * (a + d), a * d - b * c);
        // ((a - d)/2)^2 + b c is half_trace^2 - determinant without its cancellation.
        let discriminant = 0.25 * (a - d) * (a - d) + b * c;
        if discriminant < 0.0 { determinant.abs().sqrt() } else { half_trace.abs() + discriminant.sqrt() }
    }
}

/// Runs one step of `method` with `z = h omega` from both unit vectors. A force `-c x'` with `damping = h c` acts, and
/// velocities decay by `exp(-decay / 2)` before and after, which is what ether drag `decay / h` does.
pub fn amplification(method: &Method, z: f64, damping: f64, decay: f64) -> Amplification {
    let half_decay = (-0.5 * decay).exp();
    let mut columns = [[0.0; 2]; 2];
    for (column, start) in columns.iter_mut().zip([[1.0, 0.0], [0.0, 1.0]]) {
        let mut system = System::new(1, vec![1.0]);
        system.add_term(Box::<Oscillator>::default());
        if damping != 0.0 {
            let damper = MassProportional::new("oscillator", damping / z, &[1.0], 0..1, 1);
            system.add_dissipation(Box::new(damper));
        }
        let mut state = State::new(vec![start[0]], vec![start[1] * half_decay]);
        // In units where omega = 1, h = z. A step that overflows leaves the start, and the radius is large anyway.
        *column = match method.build(1, SolverOptions::default()).step(&mut system, &mut state, z) {
            Ok(()) => [state.x()[0], state.v()[0] * half_decay],
            Err(_) => [f64::INFINITY; 2],
        };
    }
    Amplification([[columns[0][0], columns[1][0]], [columns[0][1], columns[1][1]]])
}

/// The oscillator `x'' = -x` from `x = 1` at rest, to be advanced in steps of `z`: in units where omega = 1, h = z.
pub(crate) fn oscillator(method: Method, z: f64) -> Simulation {
    let mut system = System::new(1, vec![1.0]);
    system.add_term(Box::<Oscillator>::default());
    Simulation::new(system, State::new(vec![1.0], vec![0.0]), method, z)
}

/// `E = 1/2 |x|^2`.
#[derive(Default)]
struct Oscillator {
    gradient: Vec<f64>,
}

impl EnergyTerm for Oscillator {
    fn name(&self) -> String {
        "oscillator".into()
    }
    fn kind(&self) -> EnergyKind {
        EnergyKind::Elastic
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        0.5 * x.iter().map(|x| x * x).sum::<f64>()
    }
    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.gradient.clear();
        self.gradient.extend_from_slice(x);
        x.iter().all(|x| x.is_finite())
    }
    fn add_rows(&self, first: usize, g: &mut [f64]) {
        for (g, own) in g.iter_mut().zip(&self.gradient[first..]) {
            *g += own;
        }
    }
    fn add_hessian_product(&mut self, _x: &[f64], p: &[f64], y: &mut [f64]) {
        for (y, p) in y.iter_mut().zip(p) {
            *y += p;
        }
    }
    fn stencils(&mut self) -> Stencils {
        Stencils { size: 1, vertices: vec![0] }
    }
    fn stencil_hessians(&self, _: Range<usize>, _x: &[f64], _: Psd, out: &mut [f64]) {
        out.fill(1.0);
    }
    fn fault(&self, _x: &[f64]) -> Option<Fault> {
        None
    }
    fn bytes(&self) -> usize {
        0
    }
}
