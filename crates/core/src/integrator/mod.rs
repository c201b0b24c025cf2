//! Time integrators: one file per method, one line per method in the registry below.
//!
//! A [`Method`] is data: kicks and drifts ([`splitting`]), a Butcher tableau ([`runge_kutta`], [`dirk`])
//! or the coefficients of another family ([`alpha`]), with its documentation. Each family has one
//! [`Integrator`], which turns this data into steps.
//!
//! # How to add one
//! 1. Write a file in this folder with coefficients and `Documentation`, and add a line to `register!`.
//!    Parameters are a struct with `DEFAULT`, `check` and `method`, as in `newmark.rs`.
//! 2. A second method on the same stages that estimates the error is its `companion`: weights of the method
//!    less those of the companion, and its order. A criterion of its own is `judge`.
//! 3. All that one step keeps for the next is its `memory`: the rest is forgotten every 64 steps, and
//!    `tests/checkpoints.rs` compares bits; its `named` lists methods with parameters.
//! 4. Add reference vectors to `VECTORS` (`tests/integrators/oscillator.rs`) and a formula to `closed_form`
//!    (`tests/support/oscillator.rs`). Tests measure everything else that the documentation states.
//! 5. A new family is a variant of `Scheme` with an `Integrator`, which takes accelerations from
//!    `equations.rs` and ends steps by `end_step`. Also needed: `ends_at_solution` and `build` below, an
//!    adjoint and a tangent in `crates/gradient/src` (`adjoint/mod.rs`, `tangent/one_step.rs`, `support.rs`,
//!    `sweep.rs`), `crates/lab/src/stability/amplification.rs`.
//! 6. Describe it in `docs/guide/theory/schemes.md` and print the scene format anew.

pub mod alpha;
mod amplification;
pub mod collocation;
pub mod dirk;
pub(crate) mod equations;
pub mod estimate;
pub mod gauss_radau;
mod implicit;
pub mod runge_kutta;
pub mod splitting;
pub mod tableau;
#[cfg(test)]
mod tests;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::solver::structure::LentStructure;
use crate::solver::{SolverOptions, SolverWork, StepFault};
use crate::state::State;
use crate::system::System;

pub use amplification::{Amplification, amplification};
pub use amplification::{coupled_radius, modulus, oscillator, spectral_radius};
use estimate::{Judgement, Tolerances};

/// Declares the modules of the registered methods, the enum that names them in scenes, and the list that
/// `pliant list` and the conformance tests iterate over. Write `module => Variant` for a method without
/// parameters, which exports `METHOD`, and `module => Variant(p: Parameters)` for one whose parameters
/// have `DEFAULT`, `check` and `method`.
macro_rules! register {
    (@check) => { Ok(()) };
    (@check $parameters:ident) => { $parameters.check() };
    (@method $module:ident) => { $module::METHOD };
    (@method $module:ident $parameters:ident) => { $parameters.method() };
    ($($module:ident => $variant:ident $(($p:ident : $parameters:ident))?),+ $(,)?) => {
        $(pub mod $module;)+

        /// A scheme by name, with its parameters if it has any.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "kebab-case")]
        pub enum IntegratorSpec {
            $(
                #[allow(missing_docs, reason = "the method documents itself")]
                $variant $(($module::$parameters))?,
            )+
        }

        impl IntegratorSpec {
            /// All methods, with their default parameters.
            pub const ALL: &[IntegratorSpec] =
                &[$(IntegratorSpec::$variant $(($module::$parameters::DEFAULT))?),+];

            /// Checks the ranges of the parameters.
            ///
            /// # Errors
            /// [`BadParameter`] for the first one out of range.
            pub fn check(self) -> Result<(), BadParameter> {
                match self {
                    $(IntegratorSpec::$variant $(($p))? => register!(@check $($p)?),)+
                }
            }

            /// Returns the method of this name.
            pub fn method(self) -> Method {
                match self {
                    $(IntegratorSpec::$variant $(($p))? => register!(@method $module $($p)?),)+
                }
            }
        }
    };
}

register! {
    forward_euler => ForwardEuler,
    symplectic_euler => SymplecticEuler,
    velocity_verlet => VelocityVerlet,
    rk2_midpoint => Rk2Midpoint,
    rk4 => Rk4,
    bogacki_shampine3 => BogackiShampine3,
    dormand_prince5 => DormandPrince5,
    ias15 => Ias15(p: Ias15Parameters),
    yoshida4 => Yoshida4,
    implicit_euler => ImplicitEuler,
    linearised_implicit_euler => LinearisedImplicitEuler,
    implicit_midpoint => ImplicitMidpoint,
    trapezoid => Trapezoid,
    newmark => Newmark(p: NewmarkParameters),
    generalised_alpha => GeneralisedAlpha(p: GeneralisedAlphaParameters),
    bdf2 => Bdf2(p: Bdf2Parameters),
    tr_bdf2 => TrBdf2,
    sdirk2 => Sdirk2,
    sdirk3 => Sdirk3,
    crouzeix3 => Crouzeix3,
    sdirk4 => Sdirk4,
    gauss2 => Gauss2,
    radau2 => RadauIia2,
    radau3 => RadauIia3,
    quasi_static => QuasiStatic,
}

/// Error for a parameter of a method that is out of range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadParameter {
    /// Key of the parameter.
    pub name: &'static str,
    /// Value given.
    pub value: f64,
    /// Description of the valid values.
    pub right: &'static str,
}

/// Documentation of a method. `pliant list` prints it, and the conformance tests measure each number in
/// it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Documentation {
    /// Name in scenes.
    pub name: &'static str,
    /// One-line summary.
    pub summary: &'static str,
    /// Order of convergence of positions and velocities; 0 for quasi-statics.
    pub order: u32,
    /// Force evaluations per step; 0 for iterative methods, where the count depends on the iterations.
    pub force_evaluations: u32,
    /// Systems of equations solved per step; 0 for explicit methods.
    pub solves: u32,
    /// Largest `h omega` for which an undamped oscillator stays bounded. 0: the method gains energy at
    /// any step. Infinite: unconditionally stable on the linear oscillator.
    pub stability_limit: f64,
    /// True if the method is symplectic: the energy error is bounded and does not drift.
    pub symplectic: bool,
    /// Quantities conserved in addition to linear momentum.
    pub conserves: &'static str,
    /// Literature reference.
    pub source: &'static str,
}

/// Family and coefficients of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scheme {
    /// Alternating kicks and drifts.
    Splitting(&'static [splitting::Stage]),
    /// An explicit Runge-Kutta tableau on `(x, v)`.
    RungeKutta(tableau::Tableau),
    /// A diagonally implicit Runge-Kutta tableau.
    Dirk(tableau::Tableau),
    /// A diagonally implicit tableau whose stages take one Newton step each instead of a full solve.
    Linearised(tableau::Tableau),
    /// Newmark or generalised alpha.
    Alpha(alpha::AlphaCoefficients),
    /// Backward differentiation over two steps, with the method of the first step.
    Bdf2(bdf2::Bdf2Start),
    /// A fully implicit Runge-Kutta method, all stages solved together.
    Collocation(collocation::CollocationTableau),
    /// The acceleration as a polynomial through Gauss-Radau nodes.
    GaussRadau(ias15::Ias15Parameters),
    /// Static equilibrium at the end of each step.
    QuasiStatic,
}

/// A method: its coefficients and its documentation. Each file of this folder exports one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method {
    /// Documentation, printed by `pliant list`.
    pub documentation: Documentation,
    /// Family and coefficients.
    pub scheme: Scheme,
}

impl Method {
    /// Returns the power of the step size with which the local error estimate grows; `None` without an
    /// error estimate, in which case tolerances cannot control the step size.
    pub fn error_exponent(&self) -> Option<u32> {
        let companion = match self.scheme {
            Scheme::RungeKutta(tableau) => tableau.companion?,
            Scheme::Dirk(tableau) => tableau.companion?,
            Scheme::GaussRadau(_) => return Some(gauss_radau::TERMS as u32),
            _ => return None,
        };
        Some(companion.order.min(self.documentation.order) + 1)
    }

    /// True if a criterion of the method itself controls adaptive steps instead of tolerances. In statics
    /// this is the cost of solving the last increment.
    pub fn has_own_criterion(&self) -> bool {
        matches!(self.scheme, Scheme::GaussRadau(_) | Scheme::QuasiStatic)
    }

    /// True for statics: no inertia, momentum or kinetic energy; time is the load parameter.
    pub fn is_static(&self) -> bool {
        self.scheme == Scheme::QuasiStatic
    }

    /// True if the new positions are those of the last solve: of a minimum, or of stages on a trajectory
    /// checked for contact.
    pub fn ends_at_solution(&self) -> bool {
        match self.scheme {
            Scheme::Dirk(tableau) => tableau.is_stiffly_accurate(),
            Scheme::Alpha(coefficients) => coefficients.alpha_f == 0.0,
            Scheme::Collocation(tableau) => tableau.a.last() == Some(&tableau.b),
            Scheme::Bdf2(_) | Scheme::QuasiStatic => true,
            Scheme::Splitting(_) | Scheme::RungeKutta(_) | Scheme::Linearised(_) | Scheme::GaussRadau(_) => {
                false
            }
        }
    }

    /// True if a step evaluates one force, at its end, and `x_(n+1) = x_n + h v_(n+1)`.
    pub fn is_backward_euler(&self) -> bool {
        match self.scheme {
            Scheme::Dirk(tableau) => tableau.is_backward_euler(),
            _ => false,
        }
    }

    /// True if implicit contact prevents interpenetration: steps end at minima reached along checked
    /// trajectories.
    pub fn holds_contact(&self) -> bool {
        self.ends_at_solution() && !matches!(self.scheme, Scheme::Collocation(_))
    }

    /// True if a step iterates, so that its cost varies.
    pub fn iterates(&self) -> bool {
        self.documentation.solves > 0 || matches!(self.scheme, Scheme::GaussRadau(_))
    }

    /// True if the step size can adapt to the error or to another criterion.
    pub fn is_adaptive(&self) -> bool {
        self.error_exponent().is_some() || self.has_own_criterion()
    }

    /// Builds the integrator for `unknowns = n * dimension` coordinates. Implicit ones solve with
    /// `options`; explicit ones allocate all their memory here.
    pub fn build(&self, unknowns: usize, options: SolverOptions) -> Box<dyn Integrator> {
        let options = SolverOptions { order: Some(self.documentation.order), ..options };
        match self.scheme {
            Scheme::Splitting(stages) => {
                Box::new(splitting::Splitting::new(stages, self.documentation.order, unknowns))
            }
            Scheme::RungeKutta(tableau) => Box::new(runge_kutta::RungeKutta::new(tableau, unknowns)),
            Scheme::Dirk(tableau) => Box::new(dirk::Dirk::new(tableau, false, unknowns, options)),
            Scheme::Linearised(tableau) => Box::new(dirk::Dirk::new(tableau, true, unknowns, options)),
            Scheme::Alpha(coefficients) => Box::new(alpha::Alpha::new(coefficients, unknowns, options)),
            Scheme::Collocation(tableau) => {
                Box::new(collocation::Collocation::new(tableau, unknowns, options))
            }
            Scheme::GaussRadau(parameters) => Box::new(gauss_radau::GaussRadau::new(parameters, unknowns)),
            Scheme::QuasiStatic => Box::new(quasi_static::QuasiStatic::new(unknowns, options)),
            Scheme::Bdf2(start) => Box::new(bdf2::Bdf2::new(start, unknowns, options)),
        }
    }
}

/// Advances a state by one step, `(x_n, v_n) -> (x_{n+1}, v_{n+1})` (lecture 3).
pub trait Integrator: Send + Sync {
    /// Takes one step of size `h` [s]. Advances positions and velocities, including drag and walls; the
    /// caller advances time.
    ///
    /// # Errors
    /// [`StepFault`] if a force or the new state is not finite or a solve fails; `state` is then
    /// unchanged.
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault>;

    /// Restores the positions and velocities before the last [`step`](Self::step), bit for bit. Works for
    /// one step.
    fn undo(&mut self, state: &mut State);

    /// Returns the history that the next step needs in addition to `state`, as numbers for
    /// [`recall`](Self::recall). Empty for one-step methods, before the first step, and if the state has
    /// been changed since the last step.
    fn memory(&self, system: &System, state: &State) -> Vec<f64> {
        let _ = (system, state);
        vec![]
    }

    /// Continues from `state` with the history returned by [`memory`](Self::memory). Discards all other
    /// history, and all history if `memory` is empty or comes from another method.
    fn recall(&mut self, memory: &[f64], system: &System, state: &State) {
        let _ = (memory, system, state);
    }

    /// Returns the error estimate of the last [`step`](Self::step), which had the size `h` [s] and led to
    /// `state`. Walls are not included. `None` without an estimate.
    fn judge(
        &mut self,
        _system: &mut System,
        _state: &State,
        _h: f64,
        _tolerances: &Tolerances,
    ) -> Option<Judgement> {
        None
    }

    /// Returns the stage velocities of the last [`step`](Self::step), flat [m/s]: stage `i` was at the
    /// positions `x_n + h sum_j a_ij V_j`. Empty for methods without stages and before the first step.
    fn stage_velocities(&self) -> &[Vec<f64>] {
        &[]
    }

    /// Returns the accelerations at the nodes of the last step of the Gauss-Radau method, flat [m/s^2];
    /// the first node is the start of the step. Empty for other methods.
    fn stage_accelerations(&self) -> Vec<Vec<f64>> {
        vec![]
    }

    /// Returns the solver's matrix structure and replaces it by `lent`. Without such a solver `lent` is
    /// dropped.
    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure> {
        let _ = (system, lent);
        None
    }

    /// Returns the solver work so far; zero for explicit methods.
    fn work(&self) -> SolverWork {
        SolverWork::default()
    }

    /// Estimates the memory of its solves of `system` after a step from `x`, flat [m], in bytes. Explicit
    /// methods have none.
    fn solver_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        let _ = (system, x);
        0
    }
}

/// Node of a stage in units of the step. The end of the step is exactly 1, despite rounding of the
/// coefficients.
fn node(row: &[f64]) -> f64 {
    let sum = row.iter().sum::<f64>();
    if (sum - 1.0).abs() < 1e-14 { 1.0 } else { sum }
}
