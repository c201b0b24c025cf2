//! Matrix structures that solvers lend each other.

use std::any::Any;

use super::hessian::Assembler;
use super::multigrid::Multigrid;
use crate::system::System;

/// Assembly plan for the matrices of a system, and multigrid levels for them.
///
/// Both depend on the mesh and the constraints alone. A solver that continues with those of another gives
/// bit-identical results, if it sets its own matrix first.
pub struct MatrixStructure<const D: usize> {
    /// Assembly plan and storage of the matrix.
    pub assembler: Assembler<D>,
    /// Multigrid levels over the reference positions, if a solver has built them.
    pub levels: Option<Multigrid<D>>,
}

/// A [`MatrixStructure`] of any dimension.
pub struct LentStructure {
    of: Box<dyn Any + Send + Sync>,
}

impl LentStructure {
    /// Returns the structure if it fits the dimension and structure of `system`; otherwise `None`.
    pub fn taken<const D: usize>(self, system: &System) -> Option<MatrixStructure<D>> {
        let structure = *self.of.downcast::<MatrixStructure<D>>().ok()?;
        structure.assembler.fits(system).then_some(structure)
    }
}

impl<const D: usize> MatrixStructure<D> {
    /// Lends the structure. `None` if the pattern has grown by contact during the run, which another
    /// solver has not seen.
    pub fn lent(self) -> Option<LentStructure> {
        self.assembler.is_fixed().then(|| LentStructure { of: Box::new(self) })
    }
}
