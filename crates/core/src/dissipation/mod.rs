//! Dissipative forces: each is the derivative of a dissipation function `R(x, v) >= 0` with respect to
//! the velocities.
//!
//! The equations of motion become `M x'' = -dE/dx - dR/dv` (Rayleigh 1873; Goldstein, Poole, Safko
//! 2002, *Classical Mechanics*, section 1.5). A term dissipates the power `v . dR/dv >= 0`.
//!
//! # How to add one
//! 1. Write a file in this folder that implements `DissipativeTerm`; `mass_proportional.rs` is the shortest.
//!    It implements `PositionProducts` if gradients shall go through it, and what it has of
//!    `DissipationViews`.
//! 2. Add it to `terms` in `tests.rs`. These tests compare forces, products and blocks with differences, and
//!    ask that rigid motion is not damped (`a_rigid_motion_of_a_deformed_body_is_not_damped`).
//! 3. A term that is generic over the dimension is built in `crates/terms`.
//! 4. For scenes: a key in `crates/scene/src/schema/damping.rs`, its check in `validate/damping.rs`, its
//!    term in `assembly/damping.rs`, its derivatives in `crates/gradient/src/names/terms.rs`.
//! 5. Add a case to `dampings` in `tests/element_record.rs` and to `tests/damping.rs`.

mod at_rest;
mod expressed;
mod mass_proportional;
mod measured;
mod strain_rate;
#[cfg(test)]
mod tests;

pub use at_rest::AtRest;
pub use expressed::{DashpotFormula, DashpotFormulaError};
pub use mass_proportional::MassProportional;
pub use measured::MeasuredRate;
pub use strain_rate::{StrainRate, Viscosity, ViscousCells, ViscousElements, ViscousPoints};

use std::ops::Range;

use crate::energy::{ChangingStencils, Fault, Stencils};

/// One additive dissipation function `R(x, v)` [W].
///
/// Terms work like an [`EnergyTerm`](crate::energy::EnergyTerm): flat arrays `(n, dimension)`, scratch
/// memory of their own, no allocation in a step, and bit-identical results for any number of threads.
pub trait DissipativeTerm: DissipationViews + PositionProducts + Send + Sync {
    /// Name for reports, e.g. `strain-rate damping of beam`.
    fn name(&self) -> String;

    /// Computes `dR/dv` [N] at `(x, v)` and keeps it for [`add_rows`](Self::add_rows). Returns true if
    /// all of it is finite.
    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool;

    /// Adds rows of the last evaluated derivative to `g`, flat `(vertices, dimension)`: as many as `g`
    /// has, from vertex `first` on. Called block by block, from several threads.
    fn add_rows(&self, first: usize, g: &mut [f64]);

    /// Adds the product `d2R/dv2 p` [N] at `(x, v)` to `y`, `p` [m/s]. The matrix is symmetric and
    /// positive semi-definite; if `R` is quadratic in `v`, it is the damping matrix `C(x)` at any `v`.
    /// May overwrite the last evaluated derivative.
    fn add_damping_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]);

    /// True if the energy balance counts the dissipation as surface friction, not as damping.
    fn is_friction(&self) -> bool {
        false
    }

    /// Returns the stencils of the damping matrix, in the layout of
    /// [`EnergyTerm::stencils`](crate::energy::EnergyTerm::stencils) for the Hessian.
    fn stencils(&mut self) -> Stencils {
        Stencils::default()
    }

    /// Writes the blocks of `d2R/dv2` [N s/m] of these stencils at `(x, v)` to `out`, in the layout of
    /// [`EnergyTerm::stencil_hessians`](crate::energy::EnergyTerm::stencil_hessians). Called from several
    /// threads.
    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], v: &[f64], out: &mut [f64]) {
        let _ = (stencils, x, v, out);
    }

    /// Returns the dissipated power `v . dR/dv` [W], `2 R` if `R` is quadratic in `v`. Overwrites the
    /// last evaluated derivative.
    fn power(&mut self, x: &[f64], v: &[f64]) -> f64;

    /// Returns the dissipation function `R(x, v)` [W]: half the [`power`](Self::power) if it is quadratic
    /// in `v`; other terms override it. May overwrite the last evaluated derivative.
    fn value(&mut self, x: &[f64], v: &[f64]) -> f64 {
        0.5 * self.power(x, v)
    }

    /// Returns the first location where `(x, v)` gives no finite force; called only after a failure.
    fn fault(&self, x: &[f64], v: &[f64]) -> Option<Fault> {
        let _ = (x, v);
        None
    }
}

/// Optional traits of a dissipation function; a method not overridden means that it has none.
pub trait DissipationViews {
    /// Returns the stencils that change from one matrix to the next.
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        None
    }

    /// Returns the changing stencils, to find them anew.
    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        None
    }

    /// Returns the parts that a solve lags, if there are any.
    fn frozen(&mut self) -> Option<&mut dyn FrozenParts> {
        None
    }

    /// Returns the drag on each vertex, if the term is a drag in proportion to masses.
    fn vertex_drag(&self) -> Option<&dyn VertexDrag> {
        None
    }
}

/// Drag of vertices relative to the fixed frame, in proportion to their masses.
pub trait VertexDrag {
    /// Returns the coefficient of a vertex [N s/m]: the force is minus the coefficient times the
    /// velocity.
    fn drag(&self, vertex: usize) -> f64;
}

/// Derivatives of a dissipation function with respect to positions.
pub trait PositionProducts {
    /// Adds the product `(d2R/dx dv)^T p` [N] at `(x, v)` to `y`, `p` [m/s]: the derivative of
    /// `p . dR/dv` with respect to the positions. Returns false and adds nothing if the term does not
    /// implement it. May overwrite the last evaluated derivative.
    fn add_position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        let _ = (x, v, p, y);
        false
    }

    /// Adds the product `d2R/dx dv u` [N] at `(x, v)` to `y`, `u` [m]: the change of `dR/dv` with the
    /// positions along `u`. Returns false and adds nothing if the term does not implement it. Overwrites
    /// the last evaluated derivative.
    fn add_position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        let _ = (x, v, u, y);
        false
    }
}

/// A dissipation function with lagged parts, such as the normal forces and tangents of friction. They
/// stay fixed during a minimisation and are updated by fixed-point iteration until they no longer change.
/// Otherwise a line search would chase its own target.
pub trait FrozenParts {
    /// Fixes the lagged parts at `x` [m] until [`thaw`](Self::thaw). Returns true if there are any now or
    /// were any before. Lagged forces `f` move by the fraction `part` towards those at `x`, to
    /// `f + part (f(x) - f)`.
    fn freeze(&mut self, x: &[f64], part: f64) -> bool;

    /// Ends the lagging: all evaluations use the positions given.
    fn thaw(&mut self);

    /// Tells the term that a solve continues from velocities `v` in the direction `dv`, both flat [m/s],
    /// possibly by a fraction of it. Later matrix blocks may be those of the predicted forces.
    fn follow(&mut self, v: &[f64], dv: &[f64]) {
        let _ = (v, dv);
    }

    /// Returns the friction regularisation velocity [m/s], from which on forces no longer grow. Solves
    /// must resolve velocities well below it to tell sticking from slipping. `None` if there is none.
    fn threshold_speed(&self) -> Option<f64> {
        None
    }

    /// Returns the limit on updates of the lagged parts: a solve makes at most one fewer on its way, and
    /// as many again after it has converged. With 1 a solve uses the parts at the start of its step.
    fn most_renewals(&self) -> u32;
}
