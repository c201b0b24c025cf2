//! Time integrators: one scheme, one file, one line in the registry below.
//!
//! A scheme is data: coefficients of kicks and drifts ([`splitting`]), a Butcher tableau ([`runge_kutta`],
//! [`dirk`]) or the coefficients of another family ([`alpha`]), with its own documentation. One engine for
//! each family turns the data into steps.

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

/// Declares the files of this folder and everything that is known by listing them: the enum that scenes name
/// a scheme by, and the list that `pliant list` and the conformance tests go through. `module => Variant`
/// for a scheme without parameters, which exports `METHOD`; `module => Variant(p: Parameters)` for one whose
/// parameters have a `DEFAULT`, a `check` and a `method`.
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
            /// Every scheme, those with parameters with their default ones.
            pub const ALL: &[IntegratorSpec] =
                &[$(IntegratorSpec::$variant $(($module::$parameters::DEFAULT))?),+];

            /// Checks that the parameters make sense.
            ///
            /// # Errors
            /// [`BadParameter`] for the first that does not.
            pub fn check(self) -> Result<(), BadParameter> {
                match self {
                    $(IntegratorSpec::$variant $(($p))? => register!(@check $($p)?),)+
                }
            }

            /// The scheme of this name.
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

/// A parameter of a scheme that makes no sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadParameter {
    /// Its key.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Right values.
    pub right: &'static str,
}

/// Documentation of a scheme; `pliant list` prints it, and the conformance tests measure every number in it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Documentation {
    /// Name in scenes.
    pub name: &'static str,
    /// One line.
    pub summary: &'static str,
    /// Order of convergence of positions and velocities; 0 for statics, where there is none.
    pub order: u32,
    /// Force evaluations per step; 0 for schemes that iterate, where that depends on the iterations.
    pub force_evaluations: u32,
    /// Systems of equations solved per step; 0 for explicit schemes.
    pub solves: u32,
    /// Largest `h omega` for which an undamped oscillator stays bounded; 0: none, the scheme gains energy at
    /// any step; infinite: any step.
    pub stability_limit: f64,
    /// True if it is symplectic: the energy error is bounded and does not drift.
    pub symplectic: bool,
    /// Quantities that it conserves beside linear momentum.
    pub conserves: &'static str,
    /// Where it comes from.
    pub source: &'static str,
}

/// The coefficients of a scheme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scheme {
    /// Alternating kicks and drifts.
    Splitting(&'static [splitting::Stage]),
    /// An explicit Runge-Kutta tableau on `(x, v)`.
    RungeKutta(tableau::Tableau),
    /// A diagonally implicit one.
    Dirk(tableau::Tableau),
    /// The same with one Newton step in place of each solution.
    Linearised(tableau::Tableau),
    /// Newmark and generalised alpha.
    Alpha(alpha::AlphaCoefficients),
    /// Backward differentiation over two steps, started so.
    Bdf2(bdf2::Bdf2Start),
    /// Fully implicit, all stages at once.
    Collocation(collocation::CollocationTableau),
    /// The acceleration as a polynomial through Gauss-Radau nodes.
    GaussRadau(ias15::Ias15Parameters),
    /// Static equilibrium, step after step.
    QuasiStatic,
}

/// A scheme with its documentation: what one file of this folder exports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method {
    /// Its documentation.
    pub documentation: Documentation,
    /// Its coefficients.
    pub scheme: Scheme,
}

impl Method {
    /// The power of the step that the estimate of the local error grows with; `None` for schemes without an
    /// estimate, whose steps cannot follow the error.
    pub fn error_exponent(&self) -> Option<u32> {
        let companion = match self.scheme {
            Scheme::RungeKutta(tableau) => tableau.companion?,
            Scheme::Dirk(tableau) => tableau.companion?,
            Scheme::GaussRadau(_) => return Some(gauss_radau::TERMS as u32),
            _ => return None,
        };
        Some(companion.order.min(self.documentation.order) + 1)
    }

    /// True if adaptive steps follow a criterion of the scheme's own instead of tolerances: in statics, how
    /// hard an increment is to solve.
    pub fn has_own_criterion(&self) -> bool {
        matches!(self.scheme, Scheme::GaussRadau(_) | Scheme::QuasiStatic)
    }

    /// True if it finds equilibria: nothing has inertia, momentum or an energy of motion, and time is a name
    /// for the load.
    pub fn is_static(&self) -> bool {
        self.scheme == Scheme::QuasiStatic
    }

    /// True if the new positions are those of its last solve: of a minimum, or of stages whose way was found
    /// free.
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

    /// True if a step has one force, that at its end, and ends at `x_(n+1) = x_n + h v_(n+1)`.
    pub fn is_backward_euler(&self) -> bool {
        match self.scheme {
            Scheme::Dirk(tableau) => tableau.is_backward_euler(),
            _ => false,
        }
    }

    /// True if contact holds in its steps: they end at minima, on the way to which nothing is passed through.
    pub fn holds_contact(&self) -> bool {
        self.ends_at_solution() && !matches!(self.scheme, Scheme::Collocation(_))
    }

    /// True if a step takes as many iterations as it needs, and may be long.
    pub fn iterates(&self) -> bool {
        self.documentation.solves > 0 || matches!(self.scheme, Scheme::GaussRadau(_))
    }

    /// True if steps can follow the error, or another criterion.
    pub fn is_adaptive(&self) -> bool {
        self.error_exponent().is_some() || self.has_own_criterion()
    }

    /// An integrator for systems with `unknowns = n * dimension` coordinates; implicit ones solve as
    /// `options` say. An explicit one allocates all it will ever need.
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

/// Advances a state by one step: the black box `(x_n, v_n) -> (x_{n+1}, v_{n+1})` (lecture 3).
pub trait Integrator: Send + Sync {
    /// One step of size `h` [s]. Advances positions and velocities, drag and walls included; time is the
    /// caller's.
    ///
    /// # Errors
    /// [`StepFault`] where a force or the new state is not finite. `state` is then what it was before.
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault>;

    /// Takes back the positions and velocities of the last [`step`](Self::step), to the last bit; once.
    fn undo(&mut self, state: &mut State);

    /// Memory of the steps that led to `state`, beside it: numbers for [`recall`](Self::recall), sizes of
    /// steps among them. Empty for schemes of one step, before the first, and where the state has been
    /// changed since.
    fn memory(&self, system: &System, state: &State) -> Vec<f64> {
        let _ = (system, state);
        vec![]
    }

    /// Goes on from `state` with the memory of the steps that led there; forgets everything else, and
    /// everything where `memory` is empty or of another scheme.
    fn recall(&mut self, memory: &[f64], system: &System, state: &State) {
        let _ = (memory, system, state);
    }

    /// What the last [`step`](Self::step), of size `h` [s], says of its error, walls left out; `state` is
    /// the new one. `None` for schemes without an estimate.
    fn judge(
        &mut self,
        _system: &mut System,
        _state: &State,
        _h: f64,
        _tolerances: &Tolerances,
    ) -> Option<Judgement> {
        None
    }

    /// Velocities of the stages of the last [`step`](Self::step), flat [m/s]: stage `i` was at the positions
    /// `x_n + h sum_j a_ij V_j`. None for schemes without stages, and before the first step.
    fn stage_velocities(&self) -> &[Vec<f64>] {
        &[]
    }

    /// Accelerations of the stages of the last step, flat [m/s^2], where the scheme makes a polynomial of
    /// them: at the nodes of the Gauss-Radau method, the beginning of the step first. None elsewhere.
    fn stage_accelerations(&self) -> Vec<Vec<f64>> {
        vec![]
    }

    /// Gives the structure of the matrices of its solver away, and goes on with the one `lent`; without a
    /// solver that has one, that is lost.
    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure> {
        let _ = (system, lent);
        None
    }

    /// Work done in solvers so far; nothing for explicit schemes.
    fn work(&self) -> SolverWork {
        SolverWork::default()
    }

    /// Bytes of scratch memory held.
    fn bytes(&self) -> usize;

    /// Bytes of scratch memory held once steps have been taken from `x`, flat [m]; explicit schemes hold it
    /// from the beginning.
    fn predicted_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        let _ = (system, x);
        self.bytes()
    }
}

/// The node of a stage, in steps. The end of the step is met exactly: a sum of rounded coefficients may be
/// beside it.
fn node(row: &[f64]) -> f64 {
    let sum = row.iter().sum::<f64>();
    if (sum - 1.0).abs() < 1e-14 { 1.0 } else { sum }
}
