//! Amplification factors of integrators for the oscillator `x'' = -omega^2 x`, measured by running them, next
//! to the formulas.

use num_complex::Complex64 as c64;

use pliant::integrator::{
    self, IntegratorSpec, Method, Scheme, alpha::AlphaCoefficients, amplification, modulus, spectral_radius,
    splitting,
};
use pliant::simulation::Simulation;
use pliant::solver::SolverOptions;

/// Spectral radii of one integrator.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct AmplificationCurve {
    /// Name of the integrator.
    pub integrator: String,
    /// Values of `h omega`.
    pub z: Vec<f64>,
    /// Largest modulus of an eigenvalue of one step, measured by taking steps.
    pub measured: Vec<f64>,
    /// Amplification by the formula of the integrator: its stability function, the product of its kicks
    /// and drifts, or its recurrence.
    pub formula: Vec<f64>,
}

/// Measures `integrator` at these `h omega`; `None` for statics, which has no oscillator, and for an
/// integrator with its own step sizes.
pub fn amplification_curve(integrator: IntegratorSpec, z: &[f64]) -> Option<AmplificationCurve> {
    let method = integrator.method();
    if matches!(method.scheme, Scheme::QuasiStatic | Scheme::GaussRadau(_)) {
        return None;
    }
    Some(AmplificationCurve {
        integrator: method.documentation.name.into(),
        z: z.to_vec(),
        measured: z.iter().map(|z| measured(&method, *z)).collect(),
        formula: z.iter().map(|z| formula(&method, *z)).collect(),
    })
}

/// Spectral radius of one step, from both unit vectors. An integrator that remembers more than positions
/// and velocities needs a recurrence over several steps.
fn measured(method: &Method, z: f64) -> f64 {
    let memory = match method.scheme {
        Scheme::Bdf2(_) => 4,
        Scheme::Alpha(c) if c.alpha_m != 0.0 || c.alpha_f != 0.0 => 3,
        _ => return amplification(method, z, 0.0, 0.0).spectral_radius(),
    };
    // The positions follow a linear recurrence over `memory` steps; twice as many steps determine its
    // coefficients.
    let mut simulation = oscillator(method, z);
    let mut x = vec![];
    for _ in 0..=2 * memory {
        if simulation.step().is_err() {
            return f64::NAN;
        }
        x.push(simulation.state().x()[0]);
    }
    let mut rows: Vec<Vec<f64>> = (0..memory).map(|i| x[i..=i + memory].to_vec()).collect();
    let Some(coefficients) = solve(&mut rows) else { return f64::NAN };
    let mut companion = vec![vec![c64::new(0.0, 0.0); memory]; memory];
    for i in 0..memory {
        if i + 1 < memory {
            companion[i][i + 1] = c64::new(1.0, 0.0);
        }
        companion[memory - 1][i] = c64::new(coefficients[i], 0.0);
    }
    spectral_radius(companion)
}

/// The oscillator `x'' = -x` from `x = 1`, in steps of `z`.
fn oscillator(method: &Method, z: f64) -> Simulation {
    let (system, state) = integrator::oscillator();
    let mut simulation = Simulation::new(system, state, *method, z);
    simulation.set_solver(SolverOptions { tolerance: Some(1e-300), ..SolverOptions::default() });
    simulation
}

/// Amplification by the integrator's formula.
fn formula(method: &Method, z: f64) -> f64 {
    match method.scheme {
        Scheme::Splitting(stages) => {
            let mut matrix = [[1.0, 0.0], [0.0, 1.0]];
            for stage in stages {
                let (row, factor) = match stage {
                    splitting::Stage::Kick(c) => (1, -c * z),
                    splitting::Stage::Drift(c) => (0, c * z),
                };
                for k in 0..2 {
                    matrix[row][k] += factor * matrix[1 - row][k];
                }
            }
            pliant::integrator::Amplification(matrix).spectral_radius()
        }
        Scheme::RungeKutta(t) => stability_function(t.a, t.b, z),
        Scheme::Dirk(t) | Scheme::Linearised(t) => stability_function(t.a, t.b, z),
        Scheme::Collocation(t) => stability_function(t.a, t.b, z),
        Scheme::Alpha(c) => generalised_alpha(c, z),
        Scheme::Bdf2(_) => bdf2(z),
        Scheme::QuasiStatic | Scheme::GaussRadau(_) => f64::NAN,
    }
}

/// Modulus of the stability function, `|R(i z)|` with `R(w) = 1 + w b^T (I - w A)^-1 1`; Hairer, Wanner
/// 1996, eq. IV.3.2.
fn stability_function(a: &[&[f64]], b: &[f64], z: f64) -> f64 {
    let w = c64::new(0.0, z);
    let n = b.len();
    let mut rows: Vec<Vec<c64>> = (0..n)
        .map(|i| {
            let entry = |j: usize| {
                let a = a.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0);
                c64::new(f64::from(u8::from(i == j)), 0.0) - w * a
            };
            (0..n).map(entry).chain([c64::new(1.0, 0.0)]).collect()
        })
        .collect();
    let Some(k) = solve(&mut rows) else { return f64::NAN };
    let sum = k.iter().zip(b).fold(c64::new(0.0, 0.0), |sum, (k, b)| sum + *k * *b);
    modulus(c64::new(1.0, 0.0) + w * sum)
}

/// Largest modulus of the roots of `(3 - 2 i z) r^2 - 4 r + 1`.
fn bdf2(z: f64) -> f64 {
    let a = c64::new(3.0, -2.0 * z);
    let discriminant = (c64::new(16.0, 0.0) - a * 4.0).sqrt();
    let root = |sign: f64| modulus((c64::new(4.0, 0.0) + discriminant * sign) / (a * 2.0));
    root(1.0).max(root(-1.0))
}

/// Spectral radius of Chung, Hulbert 1993, eqs. 1 to 6 for `a = -x`, as a matrix on `(x, v, a)` in units
/// of the step.
fn generalised_alpha(c: AlphaCoefficients, z: f64) -> f64 {
    let AlphaCoefficients { alpha_m: m, alpha_f: f, beta, gamma } = c;
    let s = z * z;
    // (1 - m) a1 + m a0 = -s ((1 - f) x1 + f x0), x1 = x0 + v0 + (1/2 - beta) a0 + beta a1
    let denominator = (1.0 - m) + (1.0 - f) * beta * s;
    let a1 =
        [-s / denominator, -s * (1.0 - f) / denominator, -(m + s * (1.0 - f) * (0.5 - beta)) / denominator];
    let x1 = [1.0 + beta * a1[0], 1.0 + beta * a1[1], 0.5 - beta + beta * a1[2]];
    let v1 = [gamma * a1[0], 1.0 + gamma * a1[1], 1.0 - gamma + gamma * a1[2]];
    spectral_radius([x1, v1, a1].iter().map(|row| row.iter().map(|e| c64::new(*e, 0.0)).collect()).collect())
}

/// Entries of a linear system: real or complex numbers.
trait FieldElement: Copy {
    fn size(self) -> f64;
    fn minus_times(self, factor: Self, other: Self) -> Self;
    fn over(self, other: Self) -> Self;
}

impl FieldElement for f64 {
    fn size(self) -> f64 {
        self.abs()
    }
    fn minus_times(self, factor: f64, other: f64) -> f64 {
        self - factor * other
    }
    fn over(self, other: f64) -> f64 {
        self / other
    }
}

impl FieldElement for c64 {
    fn size(self) -> f64 {
        modulus(self)
    }
    fn minus_times(self, factor: c64, other: c64) -> c64 {
        self - factor * other
    }
    fn over(self, other: c64) -> c64 {
        self / other
    }
}

/// Solves a linear system by Gauss-Jordan elimination with pivots; each row ends with its right-hand
/// side. Returns `None` for a singular matrix.
fn solve<T: FieldElement>(rows: &mut [Vec<T>]) -> Option<Vec<T>> {
    let n = rows.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| rows[*i][k].size().total_cmp(&rows[*j][k].size()))?;
        rows.swap(k, pivot);
        if rows[k][k].size() == 0.0 {
            return None;
        }
        let own = rows[k].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let factor = row[k].over(own[k]);
            row.iter_mut().zip(&own).for_each(|(e, o)| *e = e.minus_times(factor, *o));
        }
    }
    Some((0..n).map(|i| rows[i][n].over(rows[i][i])).collect())
}
