//! Linearisation of a system: its matrix, a Cholesky factor whose structure is kept as long as it fits, and
//! multigrid levels that solvers lend each other.
//!
//! Newton's method, adjoints and tangents of implicit steps use it. Each decides by itself which solver is
//! tried first, and when another takes over.

use super::cholesky::{Cholesky, NotPositiveDefinite};
use super::hessian::Assembler;
use super::multigrid::Multigrid;
use super::structure::{LentStructure, MatrixStructure};
use crate::deadline::Stop;
use crate::system::System;

/// Matrix of one system with its factor, kept from one configuration to the next.
#[derive(Default)]
pub struct Linearisation<const D: usize> {
    assembler: Option<Assembler<D>>,
    /// Multigrid levels that were lent, until they are used.
    levels: Option<Multigrid<D>>,
    cholesky: Option<Cholesky>,
    /// Pattern version of `cholesky`.
    factor_pattern: u64,
    /// Structure version of the system.
    structure: u64,
}

impl<const D: usize> Linearisation<D> {
    /// Builds the structure of the matrix unless the present one fits; true if it did not.
    pub fn fit(&mut self, system: &mut System) -> bool {
        let does_fit = self.assembler.as_ref().is_some_and(|assembler| assembler.fits(system));
        if !does_fit {
            self.levels = None;
            self.assembler = Some(Assembler::new(system));
        }
        // Released pins change the set of fixed coordinates.
        if self.structure != system.structure() {
            (self.cholesky, self.structure) = (None, system.structure());
        }
        !does_fit
    }

    /// Matrix last assembled; `None` before the first [`fit`](Self::fit).
    pub fn assembler(&self) -> Option<&Assembler<D>> {
        self.assembler.as_ref()
    }

    /// Assembler of the matrix, likewise.
    pub fn assembler_mut(&mut self) -> Option<&mut Assembler<D>> {
        self.assembler.as_mut()
    }

    /// Takes the levels that were lent, or builds new ones over the positions `rest`, flat [m]. `None` if
    /// they cannot be built, or were told to `stop`.
    pub fn take_levels(&mut self, rest: &[f64], stop: &Stop) -> Option<Multigrid<D>> {
        let assembler = self.assembler.as_ref()?;
        let new = || Multigrid::until(assembler.fixed(), rest, assembler.held(), stop);
        self.levels.take().or_else(new)
    }

    /// Analyses the structure of the matrix last assembled, unless the factor has it already; vertices are
    /// eliminated in an order by their positions `places`, flat [m]. True if a factor had another pattern
    /// before. `None` if the factor does not fit memory.
    pub fn analyse(&mut self, places: &[f64]) -> Option<bool> {
        let assembler = self.assembler.as_ref()?;
        let (matrix, pattern) = (assembler.matrix(), assembler.pattern());
        if self.cholesky.is_some() && self.factor_pattern == pattern {
            return Some(false);
        }
        // Reuses the memory of the last factor: two factors at a time would be the peak memory of a run with
        // contact.
        let last = self.cholesky.take();
        let is_again = last.is_some();
        self.cholesky = match last {
            Some(last) => last.analyse_again(matrix, places),
            None => Cholesky::new(matrix, places),
        };
        self.factor_pattern = pattern;
        self.cholesky.is_some().then_some(is_again)
    }

    /// Factorises the matrix last assembled, whose structure has been [analysed](Self::analyse).
    ///
    /// # Errors
    /// [`NotPositiveDefinite`].
    pub fn factorise(&mut self) -> Result<(), NotPositiveDefinite> {
        let (Some(assembler), Some(cholesky)) = (&self.assembler, &mut self.cholesky) else {
            return Err(NotPositiveDefinite);
        };
        cholesky.factorize(assembler.matrix())
    }

    /// Factor last made, whatever has been assembled since.
    pub fn factor(&mut self) -> Option<&mut Cholesky> {
        self.cholesky.as_mut()
    }

    /// Forgets the factor and its structure.
    pub fn forget_factor(&mut self) {
        self.cholesky = None;
    }

    /// Hands out the structure of the matrix, with the levels `used` or those that were lent before, and
    /// continues with the structure `lent` by another solver of the system.
    pub fn exchange(
        &mut self,
        system: &System,
        used: Option<Multigrid<D>>,
        lent: Option<LentStructure>,
    ) -> Option<LentStructure> {
        // Levels over other positions than the reference ones belong to one run alone.
        let levels = used.or(self.levels.take()).filter(|_| system.rest_positions().is_some());
        let own = self.assembler.take().map(|assembler| MatrixStructure { assembler, levels });
        if let Some(MatrixStructure { assembler, levels }) = lent.and_then(|lent| lent.taken(system)) {
            (self.assembler, self.levels) = (Some(assembler), levels);
        }
        own.and_then(MatrixStructure::lent)
    }
}
