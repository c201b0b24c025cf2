//! Parameters of the forces: derivatives of forces by them, one type for each kind.

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

/// One use of a force in a run, `M a = -dE/dx(x, t) - dR/dv(x, v)`, as its adjoint sees it.
#[derive(Clone, Copy)]
pub struct ForceUse<'a> {
    /// The equations of motion, their time that of the force.
    pub system: &'a System,
    /// Steps of the run before this one.
    pub step: u64,
    /// Time [s].
    pub time: f64,
    /// Positions, flat, vertices in the order of the simulation [m].
    pub x: &'a [f64],
    /// Velocities, likewise [m/s].
    pub v: &'a [f64],
    /// Positions that friction has its normal forces of, where these are held as they are at the beginning of
    /// the step.
    pub held: Option<&'a [f64]>,
    /// `M^-1` times the derivative of the loss by the acceleration; zero at held coordinates.
    pub p: &'a [f64],
    /// `dE/dx + dR/dv` there [N], without damping in proportion to masses, where a parameter
    /// [asked for it](ParameterNeeds::force); else empty.
    pub gradient: &'a [f64],
    /// `dE/dx` of contact there [N], where a parameter [asked for it](ParameterNeeds::contact); else empty.
    pub contact: &'a [f64],
    /// `dR/dv` of friction there [N], likewise.
    pub friction: &'a [f64],
    /// `dE/dx` or `dR/dv` of terms there [N], by their names, of those that a parameter
    /// [asked for](ParameterNeeds::terms).
    pub terms: &'a [(String, Vec<f64>)],
    /// Derivatives of `dE/dx` by the rest lengths of terms there [N/m], by their names, of those that a
    /// parameter [asked for](ParameterNeeds::rest_lengths).
    pub rest_lengths: &'a [(String, Vec<f64>)],
    /// `(d2E/dx2 + (d2R/dx dv)^T) p`: minus the derivative by the positions there, held ones included.
    pub by_positions: &'a [f64],
    /// `d2R/dv2 p`: minus the derivative by the velocities there.
    pub by_velocities: &'a [f64],
    /// `p . dE/dx` of each energy term of the system, in their order, where it came with these products.
    pub works: &'a [Option<f64>],
}

impl ForceUse<'_> {
    /// The gradient of the terms of this name [N], which some parameter [asked for](ParameterNeeds::terms).
    ///
    /// # Panics
    /// If none has.
    pub fn rows_of(&self, name: &str) -> &[f64] {
        found(self.terms, name)
    }

    /// The derivative of the gradient of the term of this name by its rest length [N/m], which some parameter
    /// [asked for](ParameterNeeds::rest_lengths).
    ///
    /// # Panics
    /// If none has.
    pub fn by_rest_length(&self, name: &str) -> &[f64] {
        found(self.rest_lengths, name)
    }
}

/// Rows of this name.
fn found<'a>(all: &'a [(String, Vec<f64>)], name: &str) -> &'a [f64] {
    let (_, rows) = all.iter().find(|(known, _)| known == name).expect("it is asked for");
    rows
}

/// A use of a state, of which the places and velocities of held coordinates are a part: by a loss, or by a
/// wall.
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
    /// Derivatives by the positions, this use alone.
    pub x_bar: &'a [f64],
    /// Derivatives by the velocities.
    pub v_bar: &'a [f64],
}

/// Change of places [m] and of velocities [m/s], flat, vertices in the order of the simulation.
pub struct HeldChange<'a> {
    /// Places.
    pub x: &'a mut [f64],
    /// Velocities.
    pub v: &'a mut [f64],
}

/// A state on the way back, with all that comes after it.
#[derive(Clone, Copy)]
pub struct StateUse<'a> {
    /// The equations of motion.
    pub system: &'a System,
    /// Steps of the run before it.
    pub step: u64,
    /// Derivatives of the loss by its positions, flat, vertices in the order of the simulation; of held
    /// coordinates by their places from there on.
    pub x_bar: &'a [f64],
}

/// A natural mode about a shape at rest on which no force acts, as its derivative sees it.
#[derive(Clone, Copy)]
pub struct ModeUse<'a> {
    /// The equations of motion.
    pub system: &'a System,
    /// Positions, flat, vertices in the order of the simulation [m].
    pub x: &'a [f64],
    /// The shape `phi`, likewise, `phi^T M phi = 1` [kg^-1/2]; zero at held coordinates.
    pub shape: &'a [f64],
    /// `omega^2` [rad^2/s^2].
    pub square: f64,
    /// True if all masses are lumped.
    pub is_lumped: bool,
}

/// Quantities that a parameter looks at beside the state and the direction of a use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ParameterNeeds<'a> {
    /// [`ForceUse::gradient`].
    pub force: bool,
    /// [`ForceUse::contact`] and [`ForceUse::friction`].
    pub contact: bool,
    /// Uses of [held coordinates](Parameter::add_held), which depend on it.
    pub held: bool,
    /// The ether drag, which it is. Kicks under it have closed forms, whose further part is added to its
    /// derivative.
    pub ether_drag: bool,
    /// [`ForceUse::rows_of`] terms of the system, energies or dissipation functions, of these names.
    pub terms: Vec<&'a str>,
    /// Loads of the system, of these names, that it looks at itself.
    pub loads: Vec<&'a str>,
    /// [`ForceUse::by_rest_length`] of terms of these names.
    pub rest_lengths: Vec<&'a str>,
    /// Contact of the system as it goes by shapes at rest, that it looks at itself.
    pub shaped_contact: bool,
}

impl<'a> ParameterNeeds<'a> {
    /// Union of what these need.
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

/// Numbers that forces or masses depend on.
///
/// Each use of a force adds `-p . d(M a + dE/dx + dR/dv)/d theta` to the derivative by the number `theta`.
pub trait Parameter: Send {
    /// How many numbers it has.
    fn len(&self) -> usize;

    /// True if it has none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Quantities that it looks at beside the state and the direction of a use.
    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds::default()
    }

    /// Says how many steps a run has, before anything else is asked.
    fn begin(&mut self, steps: u64) {
        let _ = steps;
    }

    /// Takes what it has of a state; called for each, from the last to the first.
    fn add_state(&mut self, of: &StateUse<'_>, derivative: &mut [f64]) {
        let _ = (of, derivative);
    }

    /// Adds the part of one use of held coordinates in a state to the derivative by each number.
    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        let _ = (of, derivative);
    }

    /// Adds to the change of places and of velocities, flat, what a change of its numbers makes of those of
    /// held coordinates at a time [s]: the transpose of [`add_held`](Self::add_held).
    fn add_held_change(&mut self, system: &System, time: f64, change: &[f64], place: HeldChange<'_>) {
        let _ = (system, time, change, place);
    }

    /// Adds the derivative of `omega^2` of a mode by each number, `phi^T (dK - omega^2 dM) phi`; false where
    /// it is not known.
    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        let _ = (of, derivative);
        false
    }

    /// Adds to `force` what a change of its numbers makes of the force of one use, `-d(M a + dE/dx +
    /// dR/dv)/d theta` times `change` [N]: the transpose of [`add`](Self::add). False where that is not
    /// known. Directions `p` and products with them are empty then.
    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let _ = (of, change, force);
        false
    }

    /// Adds the part of one use of a force to the derivative by each number.
    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]);
}
