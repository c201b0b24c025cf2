//! Forces that take energy away: each is the derivative of a dissipation function `R(x, v) >= 0` by the
//! velocities.
//!
//! The equations of motion become `M x'' = -dE/dx - dR/dv` (Rayleigh 1873; Goldstein, Poole, Safko 2002,
//! *Classical Mechanics*, section 1.5), and the energy that a term takes away per time is `v . dR/dv >= 0`.

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
/// As of an [`EnergyTerm`](crate::energy::EnergyTerm): flat arrays `(n, dimension)`, scratch memory of its
/// own, nothing allocated in a step, and the same bits for any number of threads.
pub trait DissipativeTerm: DissipationViews + PositionProducts + Send + Sync {
    /// Name for reports, e.g. `strain-rate damping of beam`.
    fn name(&self) -> String;

    /// Computes `dR/dv` [N] at `(x, v)` and holds it for [`add_rows`](Self::add_rows); returns whether all
    /// of it is finite.
    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool;

    /// Adds rows of the derivative last evaluated to `g`, flat `(vertices, dimension)`: as many as it has,
    /// from vertex `first` on. Called block by block, from several threads.
    fn add_rows(&self, first: usize, g: &mut [f64]);

    /// Adds the product `d2R/dv2 p` [N] at `(x, v)` to `y`, `p` [m/s]. The matrix is symmetric and positive
    /// semi-definite; where `R` is quadratic in `v` it is the damping matrix `C(x)`, whatever `v`. The
    /// derivative last evaluated is lost.
    fn add_damping_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]);

    /// True if the energy that it takes is lost to friction of surfaces, not to damping, in the balance.
    fn is_friction(&self) -> bool {
        false
    }

    /// The stencils of the damping matrix, as [`EnergyTerm::stencils`](crate::energy::EnergyTerm::stencils)
    /// has them of the Hessian.
    fn stencils(&mut self) -> Stencils {
        Stencils::default()
    }

    /// Writes the blocks of `d2R/dv2` [N s/m] of these stencils at `(x, v)` to `out`, laid out as
    /// [`EnergyTerm::stencil_hessians`](crate::energy::EnergyTerm::stencil_hessians) has them. Called from
    /// several threads.
    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], v: &[f64], out: &mut [f64]) {
        let _ = (stencils, x, v, out);
    }

    /// The energy taken away per time, `v . dR/dv` [W]: `2 R` where `R` is quadratic in `v`. The derivative
    /// last evaluated is lost.
    fn power(&mut self, x: &[f64], v: &[f64]) -> f64;

    /// The dissipation function `R(x, v)` itself [W]: half the [`power`](Self::power) where it is quadratic
    /// in `v`; another term says what it is. The derivative last evaluated is lost.
    fn value(&mut self, x: &[f64], v: &[f64]) -> f64 {
        0.5 * self.power(x, v)
    }

    /// The first place where `(x, v)` gives no finite force; called only after something went wrong.
    fn fault(&self, x: &[f64], v: &[f64]) -> Option<Fault> {
        let _ = (x, v);
        None
    }
}

/// The further traits that a dissipation function has; none, if it overrides nothing.
pub trait DissipationViews {
    /// Its stencils that change from one matrix to the next.
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        None
    }

    /// The same, to find them anew.
    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        None
    }

    /// Its parts that a solve holds as they are, where it has any.
    fn frozen(&mut self) -> Option<&mut dyn FrozenParts> {
        None
    }

    /// Its drag on each vertex, where it is one in proportion to masses.
    fn vertex_drag(&self) -> Option<&dyn VertexDrag> {
        None
    }
}

/// Drag of vertices against what does not move, in proportion to their masses.
pub trait VertexDrag {
    /// Coefficient of a vertex [N s/m]: the force on it is minus that times its velocity.
    fn drag(&self, vertex: usize) -> f64;
}

/// Derivatives of a dissipation function by positions.
pub trait PositionProducts {
    /// Adds the product `(d2R/dx dv)^T p` [N] at `(x, v)` to `y`, `p` [m/s]: the derivative of `p . dR/dv` by
    /// the positions. False where the term does not know it, and nothing is added. The derivative last
    /// evaluated is lost.
    fn add_position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        let _ = (x, v, p, y);
        false
    }

    /// Adds the product `d2R/dx dv u` [N] at `(x, v)` to `y`, `u` [m]: the change of `dR/dv` with the
    /// positions along `u`. False where the term does not know it, and nothing is added. The derivative last
    /// evaluated is lost.
    fn add_position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        let _ = (x, v, u, y);
        false
    }
}

/// A dissipation function whose dependence on positions is held while its minimum is sought, and renewed
/// until it no longer changes: normal forces and tangents of friction. Without that, a line search would
/// chase its own target.
pub trait FrozenParts {
    /// Takes these parts as they are at `x` [m], until [`thaw`](Self::thaw); whether there are any, or were
    /// among those held until now. Forces `f` that are held go by a `part` of the way to those at `x`,
    /// `f + part (f(x) - f)`, all of it for 1.
    fn freeze(&mut self, x: &[f64], part: f64) -> bool;

    /// Ends that: whatever is asked is about the positions given.
    fn thaw(&mut self);

    /// Says that a solve goes on from velocities `v` in the direction `dv`, both flat [m/s], maybe only a
    /// part of the way: the blocks of matrices to come may be of where forces were headed.
    fn follow(&mut self, v: &[f64], dv: &[f64]) {
        let _ = (v, dv);
    }

    /// Speed [m/s] from which on forces no longer grow with it: solves have to know velocities well within
    /// it, or what sticks and what slips is all the same to them. `None` where there is none.
    fn threshold_speed(&self) -> Option<f64> {
        None
    }

    /// The most times that a solve takes them: so often, less one, on its way and again once it has
    /// converged. A solve that takes them once has those of the start of its step.
    fn most_renewals(&self) -> u32;
}
