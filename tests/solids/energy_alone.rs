//! Materials that give their energy density and nothing else, in implicit schemes and in equilibrium.

use pliant::algebra::Mat;
use pliant::constraint::Hold;
use pliant::energy::elastic::Elastic;
use pliant::energy::load::{DeadLoad, Sample};
use pliant::material::{Domain, Isotropic, Material, Model, StableNeoHookean};
use pliant::scalar::Scalar;
use pliant::simulation::Simulation;
use pliant::solver::SolverOptions;
use pliant::state::State;
use pliant::system::System;
use pliant_scene::Stress;

use crate::support::solid::{Solid, isotropic};
use crate::support::{assert_relative, largest_difference, method};

/// The energy density of another model.
#[derive(Clone)]
struct EnergyAlone<M>(M);

impl<const D: usize, M: Material<D>> Material<D> for EnergyAlone<M> {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        self.0.psi(f)
    }
}

/// `psi = mu/2 (F : F - 2 - 2 ln J) + lambda/2 (ln J)^2 + k/4 (|F e_1|^2 - 1)^2` in the plane: fibres along
/// the first axis.
#[derive(Clone)]
struct Fibres {
    mu: f64,
    lambda: f64,
    k: f64,
}

impl<const D: usize> Material<D> for Fibres {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let log = f.determinant().ln();
        let squares = f.norm_squared() - S::splat(D as f64) - S::splat(2.0) * log;
        let fibre = (0..D).fold(S::zero() - S::one(), |sum, i| f[i][0].mul_add(f[i][0], sum));
        S::splat(0.5 * self.mu) * squares
            + S::splat(0.5 * self.lambda) * log * log
            + S::splat(0.25 * self.k) * fibre * fibre
    }

    fn domain(&self) -> Domain {
        Domain::PositiveJ
    }
}

/// A block 2 x 1 of `material`, whose left end slides along y and whose lower side slides along x.
fn block<M: Material<2> + Material<3> + Clone>(material: M) -> (System, Vec<f64>) {
    let mesh = Solid::grid(&[4, 2], &[2.0, 1.0], isotropic("linear", 1.0, 0.0)).mesh();
    let x = mesh.points.clone();
    let mut system = System::new(2, vec![0.1; x.len() / 2]);
    system.add_term(Box::new(Elastic::<2, 3>::linear(
        "block",
        material,
        Stress::Analytic,
        &mesh.triangles,
        &x,
    )));
    for (axis, axes) in [[true, false, false], [false, true, false]].into_iter().enumerate() {
        let on_it = (0..x.len() as u32 / 2).filter(|v| x[2 * *v as usize + axis] == 0.0);
        system.hold(Hold::new(format!("side {axis}"), on_it.collect()).along(axes));
    }
    (system, x)
}

// lecture 1, 6 and 20
#[test]
fn implicit_steps_with_an_energy_alone_are_those_with_closed_forms() {
    fn moved<M: Material<2> + Material<3> + Clone>(material: M, scheme: &str) -> Vec<f64> {
        let (system, x) = block(material);
        // Squeezed so far that some eigenvalues of the Hessian are negative.
        let start = x.chunks_exact(2).flat_map(|x| [0.5 * x[0], 1.1 * x[1] + 0.1 * x[0] * x[1]]).collect();
        let state = State::new(start, vec![0.0; x.len()]);
        let mut simulation = Simulation::new(system, state, method(scheme), 0.05);
        simulation.set_solver(SolverOptions { tolerance: Some(1e-11), ..SolverOptions::default() });
        (0..10).for_each(|_| simulation.step().unwrap());
        simulation.state().x().to_vec()
    }
    let material = StableNeoHookean::new(&Isotropic::new(10.0, 0.4));
    for scheme in ["implicit-euler", "implicit-midpoint", "sdirk3", "radau-iia2"] {
        let error = largest_difference(&moved(material, scheme), &moved(EnergyAlone(material), scheme));
        assert!(error < 1e-9, "{scheme}: off by {error:e} m");
    }
}

// lecture 1: an anisotropic model without derivatives by hand stands where its own two equations of
// equilibrium say.
#[test]
fn fibres_that_give_their_energy_alone_stretch_as_their_equations_say() {
    let (fibres, traction) = (Fibres { mu: 1.0, lambda: 2.0, k: 3.0 }, 2.0);
    let Fibres { mu, lambda, k } = fibres;
    // P_11 = T and P_22 = 0 in stretches a along and b across the fibres, by Newton's method.
    let (mut a, mut b) = (1.0f64, 1.0f64);
    for _ in 0..50 {
        let log = (a * b).ln();
        let p = mu * (a - 1.0 / a) + lambda * log / a + k * (a * a - 1.0) * a - traction;
        let q = mu * (b - 1.0 / b) + lambda * log / b;
        let p_a = mu * (1.0 + 1.0 / (a * a)) + lambda * (1.0 - log) / (a * a) + k * (3.0 * a * a - 1.0);
        let q_b = mu * (1.0 + 1.0 / (b * b)) + lambda * (1.0 - log) / (b * b);
        let coupled = lambda / (a * b);
        let determinant = p_a * q_b - coupled * coupled;
        a -= (q_b * p - coupled * q) / determinant;
        b -= (p_a * q - coupled * p) / determinant;
    }
    let (mut system, x) = block(fibres);
    let loaded: Vec<u32> = (0..x.len() as u32 / 2).filter(|v| x[2 * *v as usize] == 2.0).collect();
    let end = |v: u32| x[2 * v as usize + 1] == 0.0 || x[2 * v as usize + 1] == 1.0;
    let share = |v: u32| if end(v) { 0.25 } else { 0.5 };
    let shares = loaded.iter().enumerate().map(|(slot, v)| (slot as u32, share(*v))).collect();
    let sample = Sample { point: [0.0; 3], shares };
    let field = Box::new(move |_, _| [traction, 0.0, 0.0]);
    system.add_term(Box::new(DeadLoad::new("pull".into(), 2, loaded, &x, vec![sample], field, false)));
    let state = State::new(x.clone(), vec![0.0; x.len()]);
    let mut simulation = Simulation::new(system, state, method("quasi-static"), 1.0);
    simulation.set_solver(SolverOptions { tolerance: Some(1e-12), ..SolverOptions::default() });
    simulation.step().unwrap();
    for (found, rest) in simulation.state().x().chunks_exact(2).zip(x.chunks_exact(2)) {
        assert!(
            (found[0] - a * rest[0]).abs() < 1e-10 && (found[1] - b * rest[1]).abs() < 1e-10,
            "{found:?}"
        );
    }
    assert!(a > 1.1 && b < 0.95, "{a} {b}");
    assert_relative(simulation.diagnostics().elastic, 2.0 * energy(mu, lambda, k, a, b), 1e-9, "energy");
}

/// `psi` in stretches along and across.
fn energy(mu: f64, lambda: f64, k: f64, a: f64, b: f64) -> f64 {
    let log = (a * b).ln();
    0.5 * mu * (a * a + b * b - 2.0 - 2.0 * log) + 0.5 * lambda * log * log + 0.25 * k * (a * a - 1.0).powi(2)
}
