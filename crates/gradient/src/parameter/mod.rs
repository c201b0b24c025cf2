//! Parameters of the forces: one type for each kind, with the derivatives of forces by it.
//!
//! # How to add one
//! 1. Write a file in this folder that implements `Parameter`: `add` for adjoints, its transpose
//!    `add_change` for tangents, `add_held` and `add_held_change` if it moves what is fixed, `add_mode` if
//!    stiffness or masses depend on it. `needs` says which terms it reads.
//! 2. Give it its key in `names/`. A number that whole terms are proportional to is a line in
//!    `names/proportional.rs`; the constants of a material are its formula in `names/constants.rs`.
//! 3. Tests in `crates/gradient/tests/adjoint`: `by_parameters.rs` compares `add` with `add_change`;
//!    `compare_number` of `differences.rs` compares with differences; `table.rs` tries every number that a
//!    scene in `scenes/` offers.

mod axes;
mod contact;
mod each_step;
mod elements;
mod fibre;
mod gravity;
mod load;
mod mass;
mod membrane;
mod moduli;
mod motion;
mod mutual_gravity;
mod points;
mod proportional;
mod rest_shape;
mod spring;
mod tie;
mod together;
mod weighted;

pub use axes::{AxisDirections, cell_axes};
pub(crate) use contact::shaped;
pub use contact::{ContactShape, ContactStiffness, FrictionCoefficient};
pub use each_step::{HeldPlaces, StepForces};
pub use elements::BodyElements;
pub use gravity::{Gravity, GravityNumber};
pub use load::{FormulaNumber, LoadFactor, LoadShape, LoadValue};
pub use mass::{BodyDensity, Masses, WeightDensity};
pub use membrane::MembraneElements;
pub use moduli::Modulus;
pub use motion::{MotionFactor, MotionNumber, MotionShape};
pub use mutual_gravity::{AttractingMasses, Softening};
pub use proportional::{EtherDrag, TermFactor};
pub use rest_shape::{FibreTension, ShapedElements, VolumeForce};
pub use spring::{RestLengths, SpringStiffness, TunedSpring};
pub use tie::{TieConstants, TieRestLength, TieShape};
pub use together::{Concatenated, Together};
pub use weighted::{NumberLink, Weighted};

use pliant::system::System;

/// One force evaluation of a run, `M a = -dE/dx(x, t) - dR/dv(x, v)`, as its adjoint sees it.
#[derive(Clone, Copy)]
pub struct ForceUse<'a> {
    /// Equations of motion, at the time of the force.
    pub system: &'a System,
    /// Number of steps of the run before this one.
    pub step: u64,
    /// Time [s].
    pub time: f64,
    /// Positions, flat, vertices in the order of the simulation [m].
    pub x: &'a [f64],
    /// Velocities, likewise [m/s].
    pub v: &'a [f64],
    /// Positions of the normal forces of friction, if these are lagged at the beginning of the step.
    pub held: Option<&'a [f64]>,
    /// Direction `p`: `M^-1` times the derivative of the loss by the acceleration; zero at fixed
    /// coordinates.
    pub p: &'a [f64],
    /// Gradient `dE/dx + dR/dv` [N] without mass-proportional damping, if a parameter [needs
    /// it](ParameterNeeds::force); otherwise empty.
    pub gradient: &'a [f64],
    /// Contact gradient `dE/dx` [N], if a parameter [needs it](ParameterNeeds::contact); otherwise empty.
    pub contact: &'a [f64],
    /// Friction gradient `dR/dv` [N], likewise.
    pub friction: &'a [f64],
    /// Gradients `dE/dx` or `dR/dv` of terms [N], by name, for those that a parameter
    /// [needs](ParameterNeeds::terms).
    pub terms: &'a [(String, Vec<f64>)],
    /// Derivatives of `dE/dx` by the rest lengths of terms [N/m], by name, for those that a parameter
    /// [needs](ParameterNeeds::rest_lengths).
    pub rest_lengths: &'a [(String, Vec<f64>)],
    /// Product `(d2E/dx2 + (d2R/dx dv)^T) p`: minus the derivative by the positions, including fixed
    /// ones.
    pub by_positions: &'a [f64],
    /// Product `d2R/dv2 p`: minus the derivative by the velocities.
    pub by_velocities: &'a [f64],
    /// `p . dE/dx` of each energy term of the system, in order, if computed along with these products.
    pub works: &'a [Option<f64>],
}

impl ForceUse<'_> {
    /// Gradient of the terms with this name [N], which some parameter must [need](ParameterNeeds::terms).
    ///
    /// # Panics
    /// If no parameter needs it.
    pub fn rows_of(&self, name: &str) -> &[f64] {
        found(self.terms, name)
    }

    /// Derivative of the gradient of the term with this name by its rest length [N/m], which some
    /// parameter must [need](ParameterNeeds::rest_lengths).
    ///
    /// # Panics
    /// If no parameter needs it.
    pub fn by_rest_length(&self, name: &str) -> &[f64] {
        found(self.rest_lengths, name)
    }
}

/// Rows with this name.
fn found<'a>(all: &'a [(String, Vec<f64>)], name: &str) -> &'a [f64] {
    let (_, rows) = all.iter().find(|(known, _)| known == name).expect("it is asked for");
    rows
}

/// Use of a state by a loss or a wall, which includes positions and velocities of fixed coordinates.
#[derive(Clone, Copy)]
pub struct HeldUse<'a> {
    /// The equations of motion.
    pub system: &'a System,
    /// Time [s].
    pub time: f64,
    /// Positions, flat, vertices in the order of the simulation [m].
    pub x: &'a [f64],
    /// Velocities, likewise [m/s].
    pub v: &'a [f64],
    /// Derivatives by the positions, from this use only.
    pub x_bar: &'a [f64],
    /// Derivatives by the velocities, from this use only.
    pub v_bar: &'a [f64],
}

/// Change of positions [m] and velocities [m/s], flat, vertices in the order of the simulation.
pub struct HeldChange<'a> {
    /// Change of the positions.
    pub x: &'a mut [f64],
    /// Change of the velocities.
    pub v: &'a mut [f64],
}

/// State in the backward sweep, with the derivatives from everything after it.
#[derive(Clone, Copy)]
pub struct StateUse<'a> {
    /// The equations of motion.
    pub system: &'a System,
    /// Number of steps of the run before it.
    pub step: u64,
    /// Derivatives of the loss by its positions, flat, vertices in the order of the simulation; for fixed
    /// coordinates by their positions from there on.
    pub x_bar: &'a [f64],
}

/// Natural mode about an unloaded reference configuration, as its derivative sees it.
#[derive(Clone, Copy)]
pub struct ModeUse<'a> {
    /// The equations of motion.
    pub system: &'a System,
    /// Positions, flat, vertices in the order of the simulation [m].
    pub x: &'a [f64],
    /// Mode shape `phi`, likewise, `phi^T M phi = 1` [kg^-1/2]; zero at fixed coordinates.
    pub shape: &'a [f64],
    /// Squared angular frequency `omega^2` [rad^2/s^2].
    pub square: f64,
    /// True if all masses are lumped.
    pub is_lumped: bool,
}

/// Quantities that a parameter needs in addition to the state and the direction.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ParameterNeeds<'a> {
    /// Needs [`ForceUse::gradient`].
    pub force: bool,
    /// Needs [`ForceUse::contact`] and [`ForceUse::friction`].
    pub contact: bool,
    /// Needs uses of [fixed coordinates](Parameter::add_held), which depend on the parameter.
    pub held: bool,
    /// True for the mass-proportional drag itself. Kicks under it have closed forms, whose contribution
    /// is added to its derivative.
    pub ether_drag: bool,
    /// Names of terms, energies or dissipation functions, whose [`ForceUse::rows_of`] are needed.
    pub terms: Vec<&'a str>,
    /// Names of loads of the system that the parameter accesses itself.
    pub loads: Vec<&'a str>,
    /// Names of terms whose [`ForceUse::by_rest_length`] is needed.
    pub rest_lengths: Vec<&'a str>,
    /// True if the parameter accesses the dependence of contact on reference shapes itself.
    pub shaped_contact: bool,
}

impl<'a> ParameterNeeds<'a> {
    /// Union of these needs.
    pub fn of_all(each: impl IntoIterator<Item = ParameterNeeds<'a>>) -> Self {
        each.into_iter().fold(ParameterNeeds::default(), |mut all, one| {
            all.force |= one.force;
            all.contact |= one.contact;
            all.shaped_contact |= one.shaped_contact;
            all.held |= one.held;
            all.ether_drag |= one.ether_drag;
            all.terms.extend(one.terms);
            all.loads.extend(one.loads);
            all.rest_lengths.extend(one.rest_lengths);
            all
        })
    }
}

/// Parameter: numbers that forces or masses depend on.
///
/// Each use of a force adds `-p . d(M a + dE/dx + dR/dv)/d theta` to the derivative by the number `theta`.
pub trait Parameter: Send {
    /// Number of its numbers.
    fn len(&self) -> usize;

    /// True if it has no numbers.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Quantities needed in addition to the state and the direction.
    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds::default()
    }

    /// Sets the number of steps of the run; called first.
    fn begin(&mut self, steps: u64) {
        let _ = steps;
    }

    /// Adds the contribution of a state; called for each, from the last to the first.
    fn add_state(&mut self, of: &StateUse<'_>, derivative: &mut [f64]) {
        let _ = (of, derivative);
    }

    /// Adds the contribution of one use of fixed coordinates in a state to the derivative by each number.
    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        let _ = (of, derivative);
    }

    /// Adds the change of positions and velocities of fixed coordinates at a time [s] due to a change of
    /// the numbers: the transpose of [`add_held`](Self::add_held).
    fn add_held_change(&mut self, system: &System, time: f64, change: &[f64], place: HeldChange<'_>) {
        let _ = (system, time, change, place);
    }

    /// Adds the derivative of `omega^2` of a mode by each number, `phi^T (dK - omega^2 dM) phi`; false if
    /// it is not implemented.
    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        let _ = (of, derivative);
        false
    }

    /// Adds to `force` its change due to a change of the numbers, `-d(M a + dE/dx + dR/dv)/d theta` times
    /// `change` [N]: the transpose of [`add`](Self::add). False if it is not implemented. The direction
    /// `p` and products with it are empty in this call.
    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let _ = (of, change, force);
        false
    }

    /// Adds the contribution of one force evaluation to the derivative by each number.
    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]);
}
