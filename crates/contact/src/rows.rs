//! Force rows of the few vertices in contact, and the stencil lists of the matrix.

use pliant::energy::Stencils;

/// Forces, one row per vertex of the system, few of them nonzero.
pub(crate) struct TouchedRows<const D: usize> {
    /// Flat `(n, D)` [N].
    rows: Vec<f64>,
    /// Vertices whose rows may be nonzero.
    touched: Vec<u32>,
}

impl<const D: usize> TouchedRows<D> {
    pub(crate) fn new(vertices: usize) -> Self {
        TouchedRows { rows: vec![0.0; D * vertices], touched: vec![] }
    }

    /// Sets all rows to zero.
    pub(crate) fn clear(&mut self) {
        for v in self.touched.drain(..) {
            self.rows[v as usize * D..][..D].fill(0.0);
        }
    }

    /// Adds forces to the rows of these vertices.
    pub(crate) fn add(&mut self, vertices: &[u32], rows: &[[f64; D]]) {
        for (v, row) in vertices.iter().zip(rows) {
            let sum = &mut self.rows[*v as usize * D..][..D];
            (0..D).for_each(|k| sum[k] += row[k]);
            self.touched.push(*v);
        }
    }

    /// Adds the rows from vertex `first` on to `g`, as many as it has.
    pub(crate) fn add_to(&self, first: usize, g: &mut [f64]) {
        let own = &self.rows[first * D..][..g.len()];
        g.iter_mut().zip(own).for_each(|(g, own)| *g += own);
    }
}

/// Lists of stencils of two, three and four vertices.
pub(crate) struct StencilLists([Stencils; 3]);

impl StencilLists {
    pub(crate) fn new() -> Self {
        StencilLists([2, 3, 4].map(|size| Stencils { size, vertices: vec![] }))
    }

    /// The lists.
    pub(crate) fn all(&self) -> &[Stencils] {
        &self.0
    }

    /// Replaces the vertices, flat for each list; true if any list has changed.
    pub(crate) fn replace(&mut self, found: [Vec<u32>; 3]) -> bool {
        let others = self.0.iter().zip(&found).any(|(list, found)| list.vertices != *found);
        self.0.iter_mut().zip(found).for_each(|(list, found)| list.vertices = found);
        others
    }
}
