//! User-defined materials.

use super::Simulation;
use crate::energy::EnergyTerm;
use crate::energy::batch::{BatchElastic, BatchMaterial};
use crate::topology::{BodyKind, BodyTopology, Topology};

/// Error if a body cannot have this material.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// No body has this name.
    #[error("there is no body `{body}`")]
    NoBody {
        /// The name.
        body: String,
    },
    /// The body has no solid elements.
    #[error("`{body}` has no elements in which a deformation gradient is square: it is no elastic solid")]
    NoSolid {
        /// The body.
        body: String,
    },
    /// User-defined materials only support simplices.
    #[error("`{body}` is made of {cells}: materials that functions give are for triangles and tetrahedra")]
    NoSimplices {
        /// The body.
        body: String,
        /// Its cells.
        cells: &'static str,
    },
}

impl Simulation {
    /// Replaces the material of a solid's elements; `topology` is that of the scene's assembly. The
    /// stored stability limit is discarded.
    ///
    /// # Errors
    /// [`MaterialError`]; nothing is changed then.
    pub fn set_material(
        &mut self,
        topology: &Topology,
        body: &str,
        material: Box<dyn BatchMaterial>,
    ) -> Result<(), MaterialError> {
        let none = || MaterialError::NoBody { body: body.to_owned() };
        let found = topology.bodies.iter().find(|one| one.name == body).ok_or_else(none)?;
        if found.kind != BodyKind::Solid {
            return Err(MaterialError::NoSolid { body: body.to_owned() });
        }
        if let Some(block) = found.blocks.first() {
            return Err(MaterialError::NoSimplices { body: body.to_owned(), cells: block.kind.plural });
        }
        // The term to replace.
        let of_body = |term: &dyn EnergyTerm| term.elements().is_some_and(|elements| elements.body() == body);
        let id = self.system.find_term(of_body);
        // New term for the element type of the body.
        let rest = self.numbering.to_internal(&topology.rest_positions, topology.dimension).into_owned();
        let BodyTopology { triangles, triangle_middles, tetrahedra, tetrahedron_middles, .. } = found;
        let term: Box<dyn EnergyTerm> =
            match (topology.dimension, triangle_middles.is_empty(), tetrahedron_middles.is_empty()) {
                (2, true, _) => Box::new(BatchElastic::<2, 3>::new(
                    body,
                    material,
                    self.cells::<3, 0, 3>(triangles, &[]),
                    &rest,
                )),
                (2, false, _) => Box::new(BatchElastic::<2, 6>::new(
                    body,
                    material,
                    self.cells(triangles, triangle_middles),
                    &rest,
                )),
                (_, _, true) => Box::new(BatchElastic::<3, 4>::new(
                    body,
                    material,
                    self.cells::<4, 0, 4>(tetrahedra, &[]),
                    &rest,
                )),
                _ => Box::new(BatchElastic::<3, 10>::new(
                    body,
                    material,
                    self.cells(tetrahedra, tetrahedron_middles),
                    &rest,
                )),
            };
        // Replace or add the term, and invalidate results.
        match id {
            Some(id) => self.system.replace_term(id, Some(term)),
            None => {
                self.system.insert_term(term);
            }
        }
        self.changed();
        self.stability = None;
        Ok(())
    }

    /// Cells in simulation numbering: corners, then edge midpoints, if any.
    fn cells<const C: usize, const M: usize, const N: usize>(
        &self,
        corners: &[[u32; C]],
        middles: &[[u32; M]],
    ) -> Vec<[u32; N]> {
        let cell = |(i, corners): (usize, &[u32; C])| {
            let mut cell = [0; N];
            let middles = middles.get(i).map_or(&[][..], |middles| &middles[..]);
            for (node, vertex) in cell.iter_mut().zip(corners.iter().chain(middles)) {
                *node = self.numbering.internal(*vertex);
            }
            cell
        };
        corners.iter().enumerate().map(cell).collect()
    }
}
