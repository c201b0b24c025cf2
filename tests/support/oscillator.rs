//! The oscillator `x'' = -omega^2 x`: what each scheme does to it, in closed form.

use pliant::energy::spring::Springs;
use pliant::integrator::Method;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

/// A 2x2 matrix acting on `(x, v / omega)`.
pub(crate) type Matrix = [[f64; 2]; 2];

/// The matrix that one step with `z = h omega` applies to `(x, v / omega)`, derived by hand from the definition of the
/// scheme (Runge-Kutta: the stability polynomial at `i z`).
pub(crate) fn closed_form(name: &str, z: f64) -> Matrix {
    let z2 = z * z;
    let rotation = |even: f64, odd: f64| [[even, odd], [-odd, even]];
    match name {
        "forward-euler" => rotation(1.0, z),
        "rk2-midpoint" => rotation(1.0 - z2 / 2.0, z),
        "rk4" => rotation(1.0 - z2 / 2.0 + z2 * z2 / 24.0, z - z * z2 / 6.0),
        "symplectic-euler" => [[1.0 - z2, z], [-z, 1.0]],
        "velocity-verlet" => verlet(z),
        "yoshida4" => {
            let outer = 1.0 / (2.0 - 2f64.cbrt());
            product(verlet(outer * z), product(verlet((1.0 - 2.0 * outer) * z), verlet(outer * z)))
        }
        _ => panic!("{name} has no closed form here: add the matrix that one step applies to the oscillator"),
    }
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

/// A mass on a spring of rest length zero, whose other end is held at the origin: an exact oscillator. Starts at
/// `(1, 0)`, at rest. Vertex 0 is the held one.
pub(crate) fn oscillator(method: Method, mass: f64, stiffness: f64, h: f64) -> Simulation {
    let mut system = System::new(2, vec![1.0, mass]);
    system.add_term(Box::new(Springs::<2>::new("oscillator", &[[0, 1]], &[stiffness], &[0.0], 2)));
    system.pin(&[0]);
    Simulation::new(system, State::new(vec![0.0, 0.0, 1.0, 0.0], vec![0.0; 4]), method, h)
}
