//! Structure of the matrices of a system, which solvers lend each other.

use std::any::Any;

use super::conjugate_gradients::Preconditioner;
use super::hessian::Assembler;
use super::multigrid::Multigrid;
use crate::system::System;

/// Plan by which the matrices of a system are assembled, and levels of multigrid for them.
///
/// Both are made from the mesh and from what is held alone: a solver that goes on with those of another finds
/// what it would with its own, to the last bit, if it gives them its own matrix first.
pub struct MatrixStructure<const D: usize> {
    /// Plan and place of the matrix.
    pub assembler: Assembler<D>,
    /// Levels over the positions at rest, where a solver has made them.
    pub levels: Option<Multigrid<D>>,
}

/// A [`MatrixStructure`] in some number of dimensions.
pub struct LentStructure {
    of: Box<dyn Any + Send + Sync>,
    bytes: usize,
}

impl LentStructure {
    /// The structure, in the dimensions of `system`; `None` where it does not fit that any more.
    pub fn taken<const D: usize>(self, system: &System) -> Option<MatrixStructure<D>> {
        let structure = *self.of.downcast::<MatrixStructure<D>>().ok()?;
        structure.assembler.fits(system).then_some(structure)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }
}

impl<const D: usize> MatrixStructure<D> {
    /// The structure, for others; `None` where the pattern has grown with what vertices met on their way,
    /// which another solver has not met.
    pub fn lent(self) -> Option<LentStructure> {
        let bytes = self.assembler.bytes() + self.levels.as_ref().map_or(0, Preconditioner::bytes);
        self.assembler.is_fixed().then(|| LentStructure { of: Box::new(self), bytes })
    }
}
