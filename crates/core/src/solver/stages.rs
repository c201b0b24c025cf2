//! Matrix of all stages of a fully implicit step, and its sparse LU factors.
//!
//! Newton's method of these steps (`coupled.rs`), their adjoints and their tangents solve with it.

use pliant_sparse::{Lu, SymbolicLu};

use super::hessian::{Assembler, At, Weights};
use super::ordering::nested_dissection;
use crate::system::System;

/// Matrix with a block for every pair of stages, of the shape `a_ij M + b_ij C + c_ij H`.
///
/// Unknown `(k s + i) D + c` is coordinate `c` of stage `i` of the `k`-th vertex in elimination order, `s`
/// the number of stages.
pub struct StageMatrix<const D: usize> {
    stages: usize,
    assembler: Assembler<D>,
    /// Pattern version of the assembler that the structure is for.
    pattern: u64,
    is_coupled: bool,
    /// Position of each vertex in the elimination order.
    place: Vec<usize>,
    value: Vec<f64>,
    symbolic: SymbolicLu,
    lu: Option<Lu>,
    right: Vec<f64>,
}

impl<const D: usize> StageMatrix<D> {
    /// Builds the structure for `stages` stages, vertices ordered by their positions near `x`, flat [m].
    /// `is_coupled` is false if masses alone couple stages. `None` if the factors would not fit memory.
    pub fn new(system: &mut System, stages: usize, is_coupled: bool, x: &[f64]) -> Option<Self> {
        let assembler = Assembler::<D>::new(system);
        Self::of(assembler, is_coupled, stages, system.ordering_positions(x))
    }

    /// Builds the structure from the pattern of `assembler`.
    fn of(assembler: Assembler<D>, is_coupled: bool, stages: usize, positions: &[f64]) -> Option<Self> {
        let matrix = assembler.matrix();
        let order = nested_dissection(matrix, positions);
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(k, v)| place[*v as usize] = k);
        let (mut column_start, mut row) = (vec![0], vec![]);
        for &vertex in &order {
            let mut neighbours: Vec<usize> = matrix.row(vertex as usize).map(|(c, _)| place[c]).collect();
            neighbours.sort_unstable();
            for j in 0..stages {
                for c in 0..D {
                    for &k in &neighbours {
                        for i in 0..stages {
                            for r in 0..D {
                                let is_own = k == place[vertex as usize];
                                if i == j || is_coupled || is_own && r == c {
                                    row.push((k * stages + i) * D + r);
                                }
                            }
                        }
                    }
                    column_start.push(row.len());
                }
            }
        }
        let (value, right) = (vec![0.0; row.len()], vec![0.0; column_start.len() - 1]);
        let symbolic = SymbolicLu::new(column_start, row)?;
        let pattern = assembler.pattern();
        Some(StageMatrix { stages, assembler, pattern, is_coupled, place, value, symbolic, lu: None, right })
    }

    /// True if the structure is that of the system.
    pub fn fits(&self, system: &System) -> bool {
        self.assembler.fits(system)
    }

    /// Version of the pattern.
    pub fn pattern(&self) -> u64 {
        self.pattern
    }

    /// Makes room for the stencils at the positions `at` of all stages, flat [m]; another [`pattern`]
    /// (Self::pattern) says that the structure was built anew. `None` if its factors would not fit memory.
    pub fn including(mut self, system: &mut System, at: &[Vec<f64>], x: &[f64]) -> Option<Self> {
        if system.changing_structure().is_none() {
            return Some(self);
        }
        loop {
            let before = self.assembler.pattern();
            for x in at {
                system.find_stencils(x);
                self.assembler.include_stencils(system);
            }
            if self.assembler.pattern() == before {
                break;
            }
        }
        if self.assembler.pattern() == self.pattern {
            return Some(self);
        }
        StageMatrix::of(self.assembler, self.is_coupled, self.stages, x)
    }

    /// Sets all entries to zero.
    pub fn clear(&mut self) {
        self.value.fill(0.0);
    }

    /// Adds `factor(i, j)` times the Hessian and the damping matrix at one stage, in the proportions of
    /// `weights`, to the block of each pair of stages; a factor of `None` adds nothing.
    pub fn add(
        &mut self,
        system: &mut System,
        at: At<'_>,
        weights: Weights,
        factor: impl Fn(usize, usize) -> Option<f64>,
    ) {
        self.assembler.assemble(system, at, weights);
        let s = self.stages;
        let pairs = (0..s * s).map(|pair| (pair / s, pair % s));
        for (i, j, factor) in pairs.filter_map(|(i, j)| Some((i, j, factor(i, j)?))) {
            for vertex in 0..self.place.len() {
                for (other, block) in self.assembler.matrix().row(vertex) {
                    for r in 0..D {
                        for c in 0..D {
                            let row = (self.place[vertex] * s + i) * D + r;
                            let column = (self.place[other] * s + j) * D + c;
                            let at = self.symbolic.entry(row, column).expect("the structure has it");
                            self.value[at] += factor * block[r][c];
                        }
                    }
                }
            }
        }
    }

    /// Adds `factor(i, j)` times the masses to the block of each pair of stages, and makes rows and columns
    /// of fixed coordinates those of the identity.
    pub fn add_masses(&mut self, system: &System, factor: impl Fn(usize, usize) -> f64) {
        let s = self.stages;
        for (n, weight) in system.inverse_mass().iter().enumerate() {
            for (i, j) in (0..s * s).map(|pair| (pair / s, pair % s)) {
                let of = |i: usize| (self.place[n / D] * s + i) * D + n % D;
                let at = self.symbolic.entry(of(i), of(j)).expect("the structure has it");
                if *weight > 0.0 {
                    self.value[at] += factor(i, j) * system.mass()[n / D];
                } else {
                    self.value[at] = f64::from(u8::from(i == j));
                }
            }
        }
    }

    /// Factorises the matrix; false if it is singular, or if its factors do not fit memory.
    pub fn factorize(&mut self) -> bool {
        self.lu = self.symbolic.factorize(&self.value);
        self.lu.is_some()
    }

    /// Solves with the last factors in place; `b` has the rows of each stage. NaN without factors.
    pub fn solve(&mut self, b: &mut [impl AsMut<[f64]>]) {
        let StageMatrix { stages, place, right, lu, .. } = self;
        let at = |n: usize, i: usize| (place[n / D] * *stages + i) * D + n % D;
        for (i, b) in b.iter_mut().enumerate() {
            b.as_mut().iter().enumerate().for_each(|(n, b)| right[at(n, i)] = *b);
        }
        match lu {
            Some(lu) => lu.solve(right),
            None => right.fill(f64::NAN),
        }
        for (i, b) in b.iter_mut().enumerate() {
            b.as_mut().iter_mut().enumerate().for_each(|(n, b)| *b = right[at(n, i)]);
        }
    }

    /// Predicts the bytes of the matrix and its factors.
    pub fn predicted_bytes(&self) -> usize {
        let factors = self.symbolic.factor_bytes(self.is_coupled).unwrap_or(usize::MAX / 4);
        self.assembler.bytes() + 16 * self.value.len() + factors
    }
}
