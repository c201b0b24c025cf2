//! Mass matrix of the modes, lumped or consistent.

use crate::energy::ShapeProducts;
use crate::solver::block_matrix::BlockMatrix;
use crate::system::System;

/// Relative tolerance for lumped masses to agree with a uniform density.
const SAME_DENSITY: f64 = 1e-9;

/// Mass matrix in the free coordinates: consistent for second-order elements of uniform density,
/// `M_ab = rho integral of N_a N_b`, lumped elsewhere.
pub(super) struct Inertia<const D: usize> {
    /// Lumped mass of each coordinate [kg]; zero if it is constrained.
    lumped: Vec<f64>,
    /// Rows of vertices with consistent mass, columns ascending [kg]; empty for other vertices, no rows
    /// at all if everything is lumped.
    rows: Vec<Vec<(u32, f64)>>,
}

impl<const D: usize> Inertia<D> {
    /// Creates the lumped mass matrix of time steps.
    pub(super) fn lumped(system: &System) -> Self {
        let free = system.inverse_mass().iter().enumerate();
        let lumped = free.map(|(n, w)| if *w > 0.0 { system.mass()[n / D] } else { 0.0 }).collect();
        Inertia { lumped, rows: vec![] }
    }

    /// Creates a mass matrix that is consistent where possible.
    pub(super) fn consistent(system: &System) -> Self {
        let mut inertia = Self::lumped(system);
        for products in system.terms().iter().filter_map(|term| term.elements()?.shape_products()) {
            if let Some(density) = density(&products, system.mass()) {
                inertia.rows.resize(system.mass().len(), vec![]);
                products.each(|a, b, product| inertia.rows[a as usize].push((b, density * product)));
            }
        }
        for row in &mut inertia.rows {
            row.sort_by_key(|(column, _)| *column);
            row.dedup_by(|next, first| {
                let same = next.0 == first.0;
                first.1 += if same { next.1 } else { 0.0 };
                same
            });
        }
        inertia
    }

    /// True if any part is consistent.
    pub(super) fn is_consistent(&self) -> bool {
        !self.rows.is_empty()
    }

    /// Returns the lumped masses of all coordinates [kg]; zero if constrained.
    pub(super) fn diagonal(&self) -> &[f64] {
        &self.lumped
    }

    /// True if a coordinate is free.
    pub(super) fn is_free(&self, n: usize) -> bool {
        self.lumped[n] > 0.0
    }

    /// Computes `M x` [kg x]; zero at constrained coordinates, whatever `x` is there.
    pub(super) fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = x.iter().zip(&self.lumped).map(|(x, m)| x * m).collect();
        for (v, row) in self.rows.iter().enumerate().filter(|(_, row)| !row.is_empty()) {
            for n in (v * D..v * D + D).filter(|n| self.is_free(*n)) {
                let of = |(w, m): &(u32, f64)| {
                    let column = *w as usize * D + n % D;
                    if self.is_free(column) { m * x[column] } else { 0.0 }
                };
                y[n] = row.iter().map(of).sum();
            }
        }
        y
    }

    /// Adds `factor M` to a matrix that has the blocks of `M` between free vertices.
    pub(super) fn add_to(&self, factor: f64, matrix: &mut BlockMatrix<D>) {
        for v in 0..matrix.rows() {
            let row = self.rows.get(v).filter(|row| !row.is_empty());
            for at in matrix.row_start[v] as usize..matrix.row_start[v + 1] as usize {
                let w = matrix.column[at] as usize;
                let consistent = row.map(|row| match row.binary_search_by_key(&w, |(w, _)| *w as usize) {
                    Ok(place) => row[place].1,
                    Err(_) => 0.0,
                });
                for c in 0..D {
                    let (n, m) = (v * D + c, w * D + c);
                    if self.is_free(n) && self.is_free(m) {
                        let lumped = if v == w { self.lumped[n] } else { 0.0 };
                        matrix.value[at][c][c] += factor * consistent.unwrap_or(lumped);
                    }
                }
            }
        }
    }
}

/// Returns the density [kg/m^3] of elements from their lumped masses; `None` if these do not agree with a
/// uniform density, because a scene sets others.
fn density(products: &ShapeProducts, mass: &[f64]) -> Option<f64> {
    let mut shares = vec![0.0; mass.len()];
    products.each_lumped(|vertex, share| shares[vertex as usize] += share);
    let of_elements = || shares.iter().zip(mass).filter(|(share, _)| **share > 0.0);
    let volume: f64 = of_elements().map(|(share, _)| share).sum();
    let density = of_elements().map(|(_, mass)| mass).sum::<f64>() / volume;
    let same = |(share, mass): (&f64, &f64)| (density * share - mass).abs() <= SAME_DENSITY * mass;
    of_elements().all(same).then_some(density)
}
