//! The oscillator `x'' = -omega^2 x`: what each scheme does to it, in closed form.

use nalgebra::Complex;
use pliant::energy::spring::Springs;
use pliant::integrator::Method;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

use super::solve_to_rounding;

/// A 2x2 matrix acting on `(x, v / omega)`.
pub(crate) type Matrix = [[f64; 2]; 2];

/// `(x, v / omega)` after so many steps with `z = h omega` from `(1, 0)`, derived by hand from the
/// definition of the scheme.
pub(crate) fn from_rest(name: &str, z: f64, steps: usize) -> [f64; 2] {
    match name {
        "bdf2" => bdf2(z, steps),
        "generalised-alpha" => generalised_alpha(0.8, z, steps),
        _ => power_applied(closed_form(name, z), steps, [1.0, 0.0]),
    }
}

/// BDF2 after a step of TR-BDF2: `(3 - 2 i z) u_(n+1) = 4 u_n - u_(n-1)`, where `(x, v / omega) = (Re u, -Im
/// u)`.
fn bdf2(z: f64, steps: usize) -> [f64; 2] {
    let [[re, im], _] = closed_form("tr-bdf2", z);
    let (mut before, mut now) = (Complex::new(1.0, 0.0), Complex::new(re, im));
    for _ in 1..steps {
        (before, now) = (now, (now * 4.0 - before) / Complex::new(3.0, -2.0 * z));
    }
    [now.re, -now.im]
}

/// Chung and Hulbert's formulas for `x'' = -x` with `h = z`, the acceleration at the start that of the force.
pub(crate) fn generalised_alpha(rho: f64, z: f64, steps: usize) -> [f64; 2] {
    let (m, f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
    let (gamma, beta) = (0.5 - m + f, 0.25 * (1.0 - m + f).powi(2));
    let (mut x, mut v, mut a) = (1.0, 0.0, -1.0);
    for _ in 0..steps {
        let predicted = x + z * v + z * z * (0.5 - beta) * a;
        let new = -((1.0 - f) * predicted + f * x + m * a) / (1.0 - m + (1.0 - f) * beta * z * z);
        x = predicted + z * z * beta * new;
        v += z * ((1.0 - gamma) * a + gamma * new);
        a = new;
    }
    [x, v]
}

/// The matrix that one step with `z = h omega` applies to `(x, v / omega)`, derived by hand from the
/// definition of the scheme (Runge-Kutta: the stability function at `i z`).
pub(crate) fn closed_form(name: &str, z: f64) -> Matrix {
    let z2 = z * z;
    let rotation = |even: f64, odd: f64| [[even, odd], [-odd, even]];
    match name {
        "forward-euler" => rotation(1.0, z),
        "rk2-midpoint" => rotation(1.0 - z2 / 2.0, z),
        "rk4" => rotation(1.0 - z2 / 2.0 + z2 * z2 / 24.0, z - z * z2 / 6.0),
        "bogacki-shampine3" => rotation(1.0 - z2 / 2.0, z - z * z2 / 6.0),
        // Degree 6 with 1/600 for 1/720.
        "dormand-prince5" => rotation(
            1.0 - z2 / 2.0 + z2 * z2 / 24.0 - z2.powi(3) / 600.0,
            z - z * z2 / 6.0 + z * z2 * z2 / 120.0,
        ),
        // To rounding, up to z = 1.
        "ias15" => rotation(z.cos(), z.sin()),
        "symplectic-euler" => [[1.0 - z2, z], [-z, 1.0]],
        "velocity-verlet" => verlet(z),
        "yoshida4" => {
            let outer = 1.0 / (2.0 - 2f64.cbrt());
            product(verlet(outer * z), product(verlet((1.0 - 2.0 * outer) * z), verlet(outer * z)))
        }
        "implicit-euler" | "linearised-implicit-euler" => rational(&[1.0], (1.0, 1), z),
        // Newmark's method with its default coefficients is the trapezoidal rule.
        "implicit-midpoint" | "trapezoid" | "newmark" => rational(&[1.0, 0.5], (0.5, 1), z),
        "tr-bdf2" | "sdirk2" => {
            let g = 1.0 - 0.5f64.sqrt();
            rational(&[1.0, 1.0 - 2.0 * g], (g, 2), z)
        }
        "sdirk3" => {
            let g = 0.435_866_521_508_459;
            rational(&[1.0, 1.0 - 3.0 * g, 0.5 - 3.0 * g + 3.0 * g * g], (g, 3), z)
        }
        "crouzeix3" => {
            let g = 0.5 + 3f64.sqrt() / 6.0;
            rational(&[1.0, 1.0 - 2.0 * g, 0.5 - 2.0 * g + g * g], (g, 2), z)
        }
        // Hairer, Wanner 1996, table IV.6.5: 4 (768 - 192 w - 96 w^2 + 8 w^3 + 7 w^4) / (3 (4 - w)^5).
        "sdirk4" => rational(&[1.0, -0.25, -0.125, 8.0 / 768.0, 7.0 / 768.0], (0.25, 5), z),
        "gauss2" => quotient(&[12.0, 6.0, 1.0], &[12.0, -6.0, 1.0], z),
        "radau-iia2" => quotient(&[6.0, 2.0], &[6.0, -4.0, 1.0], z),
        // Hairer, Wanner 1996, table IV.3.1: the Pade approximation of degrees 2 and 3.
        "radau-iia3" => quotient(&[60.0, 24.0, 3.0], &[60.0, -36.0, 9.0, -1.0], z),
        _ => panic!("{name} has no closed form here: add the matrix that one step applies to the oscillator"),
    }
}

/// A stability function at `w = i z`: a polynomial over `(1 - g w)^n`. As `i` turns `(x, v / omega)` by a
/// right angle, `p + i q` is a matrix.
fn rational(numerator: &[f64], (g, n): (f64, i32), z: f64) -> Matrix {
    let w = Complex::new(0.0, z);
    as_matrix(polynomial(numerator, w) / (Complex::new(1.0, 0.0) - w * g).powi(n))
}

/// The same of two polynomials.
fn quotient(numerator: &[f64], denominator: &[f64], z: f64) -> Matrix {
    let w = Complex::new(0.0, z);
    as_matrix(polynomial(numerator, w) / polynomial(denominator, w))
}

fn polynomial(coefficients: &[f64], w: Complex<f64>) -> Complex<f64> {
    coefficients.iter().rev().fold(Complex::new(0.0, 0.0), |sum, c| sum * w + c)
}

fn as_matrix(value: Complex<f64>) -> Matrix {
    [[value.re, value.im], [-value.im, value.re]]
}

fn verlet(z: f64) -> Matrix {
    let z2 = z * z;
    [[1.0 - z2 / 2.0, z], [-z * (1.0 - z2 / 4.0), 1.0 - z2 / 2.0]]
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    let entry = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

/// `matrix^n (x, v)`, by repeated squaring.
pub(crate) fn power_applied(mut matrix: Matrix, mut n: usize, [mut x, mut v]: [f64; 2]) -> [f64; 2] {
    while n > 0 {
        if n % 2 == 1 {
            (x, v) = (matrix[0][0] * x + matrix[0][1] * v, matrix[1][0] * x + matrix[1][1] * v);
        }
        matrix = product(matrix, matrix);
        n /= 2;
    }
    [x, v]
}

/// A mass on a spring of rest length zero, whose other end is held at the origin: an exact oscillator.
/// Starts at `(1, 0)`, at rest. Vertex 0 is the held one.
pub(crate) fn oscillator(method: Method, mass: f64, stiffness: f64, h: f64) -> Simulation {
    let mut system = System::new(2, vec![1.0, mass]);
    system.add_term(Box::new(Springs::<2>::new("oscillator", &[[0, 1]], &[stiffness], &[0.0], 2)));
    system.pin(&[0]);
    let mut simulation =
        Simulation::new(system, State::new(vec![0.0, 0.0, 1.0, 0.0], vec![0.0; 4]), method, h);
    solve_to_rounding(&mut simulation);
    simulation
}
