//! Amplification matrix of a method on the oscillator, measured by running the integrator.

use std::ops::Range;

use num_complex::Complex64 as c64;

use super::Method;
use crate::dissipation::{DissipationViews, DissipativeTerm, MassProportional, PositionProducts};
use crate::energy::{EnergyKind, EnergyTerm, Fault, Stencils, TermProperties, TermViews};
use crate::material::Psd;
use crate::solver::SolverOptions;
use crate::state::State;
use crate::system::System;

/// Matrix that one step applies to `(x, v / omega)` of the oscillator `x'' = -omega^2 x - c x'`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplification(pub [[f64; 2]; 2]);

impl Amplification {
    /// Returns the largest modulus of an eigenvalue.
    pub fn spectral_radius(&self) -> f64 {
        let [[a, b], [c, d]] = self.0;
        let (half_trace, determinant) = (0.5 * (a + d), a * d - b * c);
        // ((a - d)/2)^2 + b c is half_trace^2 - determinant without its cancellation.
        let discriminant = 0.25 * (a - d) * (a - d) + b * c;
        if discriminant < 0.0 { determinant.abs().sqrt() } else { half_trace.abs() + discriminant.sqrt() }
    }
}

/// Runs one step of `method` with `z = h omega` from both unit vectors, under a force `-c x'` with
/// `damping = h c` and ether drag `decay / h`.
pub fn amplification(method: &Method, z: f64, damping: f64, decay: f64) -> Amplification {
    let mut columns = [[0.0; 2]; 2];
    for (column, start) in columns.iter_mut().zip([[1.0, 0.0], [0.0, 1.0]]) {
        let mut system = System::new(1, vec![1.0]);
        system.add_term(Box::<UnitOscillator>::default());
        if damping != 0.0 {
            let damper = MassProportional::new("oscillator", damping / z, &[1.0], 0..1, 1);
            system.add_dissipation(Box::new(damper));
        }
        system.set_ether_drag(decay / z);
        let mut state = State::new(vec![start[0]], vec![start[1]]);
        // In units with omega = 1, h = z. A step that overflows leaves the state unchanged; its column is
        // infinite.
        *column = match method.build(1, SolverOptions::default()).step(&mut system, &mut state, z) {
            Ok(()) => [state.x()[0], state.v()[0]],
            Err(_) => [f64::INFINITY; 2],
        };
    }
    Amplification([[columns[0][0], columns[1][0]], [columns[0][1], columns[1][1]]])
}

/// Creates the oscillator `x'' = -x` in the state `x = 1`, `v = 0`, for steps of `z = h omega` (units
/// with omega = 1).
pub fn oscillator() -> (System, State) {
    let mut system = System::new(1, vec![1.0]);
    system.add_term(Box::<UnitOscillator>::default());
    (system, State::new(vec![1.0], vec![0.0]))
}

/// Computes the spectral radius `lim |A^n|^(1/n)` by repeated squaring; Gelfand 1941.
pub fn spectral_radius(mut a: Vec<Vec<c64>>) -> f64 {
    const SQUARINGS: i32 = 40;
    let n = a.len();
    let (mut logarithm, mut weight) = (0.0, 1.0);
    for _ in 0..SQUARINGS {
        let norm = a.iter().flatten().fold(0.0, |m: f64, e| m.max(modulus(*e)));
        if norm == 0.0 || !norm.is_finite() {
            return norm;
        }
        logarithm += weight * libm::log(norm);
        weight *= 0.5;
        a.iter_mut().flatten().for_each(|e| *e /= norm);
        let product = |i: usize, j: usize| (0..n).fold(c64::new(0.0, 0.0), |sum, k| sum + a[i][k] * a[k][j]);
        a = (0..n).map(|i| (0..n).map(|j| product(i, j)).collect()).collect();
    }
    libm::exp(logarithm)
}

/// `|z|`.
pub fn modulus(z: c64) -> f64 {
    crate::lanes::hypot(z.re, z.im)
}

/// Computes the spectral radius of one step of `method` on a mode with `z = h omega` and a mode without
/// stiffness, coupled by a dashpot: `x'' = -omega^2 x - c n (n . x')` with `n = (sin angle, cos angle)`
/// and `damping = h c`. Stiffness and damping share no eigenvector.
pub fn coupled_radius(method: &Method, z: f64, damping: f64, angle: f64) -> f64 {
    let mut matrix = vec![vec![c64::new(0.0, 0.0); 4]; 4];
    for column in 0..4 {
        let mut system = System::new(2, vec![1.0]);
        system.add_term(Box::new(UnitOscillator { free_from: 1, ..UnitOscillator::default() }));
        let (sin, cos) = libm::sincos(angle);
        system.add_dissipation(Box::new(Dashpot {
            constant: damping / z,
            along: [sin, cos],
            gradient: [0.0; 2],
        }));
        let mut start = [0.0; 4];
        start[column] = 1.0;
        let mut state = State::new(start[..2].to_vec(), start[2..].to_vec());
        if method.build(2, SolverOptions::default()).step(&mut system, &mut state, z).is_err() {
            return f64::INFINITY;
        }
        for (row, end) in state.x().iter().chain(state.v()).enumerate() {
            matrix[row][column] = c64::new(*end, 0.0);
        }
    }
    spectral_radius(matrix)
}

/// Dissipation `R = 1/2 c (n . v)^2` of a single vertex in two dimensions.
struct Dashpot {
    constant: f64,
    along: [f64; 2],
    gradient: [f64; 2],
}

impl Dashpot {
    fn force(&self, v: &[f64]) -> [f64; 2] {
        let rate = self.along[0] * v[0] + self.along[1] * v[1];
        self.along.map(|n| self.constant * rate * n)
    }
}

impl DissipativeTerm for Dashpot {
    fn name(&self) -> String {
        "dashpot".into()
    }

    fn evaluate(&mut self, _x: &[f64], v: &[f64]) -> bool {
        self.gradient = self.force(v);
        v.iter().all(|v| v.is_finite())
    }

    fn add_rows(&self, _: usize, g: &mut [f64]) {
        g.iter_mut().zip(self.gradient).for_each(|(g, own)| *g += own);
    }

    fn add_damping_product(&mut self, _x: &[f64], _v: &[f64], p: &[f64], y: &mut [f64]) {
        y.iter_mut().zip(self.force(p)).for_each(|(y, force)| *y += force);
    }

    fn power(&mut self, _x: &[f64], v: &[f64]) -> f64 {
        self.force(v).iter().zip(v).map(|(force, v)| force * v).sum()
    }
}

impl DissipationViews for Dashpot {}

impl PositionProducts for Dashpot {}

/// Energy `E = 1/2 |x|^2` of the coordinates before `free_from`.
struct UnitOscillator {
    gradient: Vec<f64>,
    free_from: usize,
}

impl Default for UnitOscillator {
    fn default() -> Self {
        UnitOscillator { gradient: vec![], free_from: usize::MAX }
    }
}

impl UnitOscillator {
    fn stiff<'a>(&self, x: &'a [f64]) -> &'a [f64] {
        &x[..x.len().min(self.free_from)]
    }
}

impl EnergyTerm for UnitOscillator {
    fn name(&self) -> String {
        "oscillator".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        0.5 * self.stiff(x).iter().map(|x| x * x).sum::<f64>()
    }
    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.gradient.clear();
        self.gradient.extend_from_slice(self.stiff(x));
        self.gradient.resize(x.len(), 0.0);
        x.iter().all(|x| x.is_finite())
    }
    fn add_rows(&self, first: usize, g: &mut [f64]) {
        for (g, own) in g.iter_mut().zip(&self.gradient[first..]) {
            *g += own;
        }
    }
    fn add_hessian_product(&mut self, _x: &[f64], p: &[f64], y: &mut [f64]) {
        for (y, p) in y.iter_mut().zip(self.stiff(p)) {
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
}

impl TermViews for UnitOscillator {}
