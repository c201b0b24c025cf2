//! Stress at nodes: per element, averaged, and by superconvergent patch recovery; estimates of the error.
//!
//! Stresses of finite elements jump from element to element and are most accurate at points inside
//! (Barlow 1976, *Optimal stress locations in finite element models*). A [`Recovery`] fits polynomials to
//! the stresses at these points and evaluates them at the nodes. Source of the patches and of the
//! estimate: Zienkiewicz, Zhu 1992, "The superconvergent patch recovery and a posteriori error estimates,
//! part 1: the recovery technique; part 2: error estimates and adaptivity", Int. J. Numer. Meth. Eng. 33,
//! 1331 and 1365.
//!
//! | element | points of a patch | polynomial of a patch | per element |
//! |---|---|---|---|
//! | triangle, tetrahedron | centroid | linear | constant |
//! | quadratic triangle, tetrahedron | 3, 4 quadrature points | quadratic | linear |
//! | quadrilateral, hexahedron | centre | linear | multilinear |
//! | `quad8`, `quad9`, `hex20`, `hex27` | 2 Gauss points a direction | mixed cubic | multilinear |
//!
//! First-order quadrilaterals take no term `xy`: in a patch turned by 45 degrees it vanishes at all points.
//! Nothing is fitted or averaged across energy terms, that is across bodies and materials.

mod cells;
mod estimate;
mod fit;
mod patch;
mod reference;

pub(crate) use cells::SampledConfiguration;
pub use estimate::StressError;
pub(crate) use estimate::stress_error;

use crate::algebra::{Mat, symmetric_eigen};
use crate::element::{ElementState, von_mises};
use crate::energy::ElementTerm;
use cells::{Cells, NodalRows, Tensor};

/// Method by which stresses at nodes follow from stresses inside elements.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Recovery {
    /// Least squares in each element alone: one value for every element at a node. Shows the jumps.
    Element,
    /// Plain mean of the values of the elements at a node.
    Average,
    /// Superconvergent patch recovery: least squares over the elements around each corner. One order more
    /// accurate than the stress of the elements, except at the boundary of coarse meshes.
    #[default]
    Patch,
}

/// Stress at the nodes of all elements.
#[derive(Clone, Debug, PartialEq)]
pub struct NodalStress {
    /// Vertex of each row, in the order of the scene. Bodies follow one another; vertices of a body
    /// ascend. A vertex of no element has no row. [`Recovery::Element`] has a row for every element,
    /// in the order of the mesh, and node.
    pub vertices: Vec<u32>,
    /// Cauchy stress of each row [Pa]; in 2D the third axis is out of the plane. Not finite where the
    /// stress of an element is not.
    pub stress: Vec<Mat<f64, 3>>,
    /// Number of patches that had too few points for the polynomial of their element and took one of
    /// lower degree.
    pub lowered: usize,
}

/// Principal values and directions of a stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalStress {
    /// Principal stresses [Pa], in descending order.
    pub values: [f64; 3],
    /// Unit vectors along which they act, one row each; their signs are arbitrary.
    pub directions: Mat<f64, 3>,
}

impl NodalStress {
    /// Returns the von Mises stress `sqrt(3/2 s : s)` of each row [Pa], with the deviator `s` of the
    /// recovered tensor.
    pub fn von_mises(&self) -> Vec<f64> {
        self.stress.iter().map(von_mises).collect()
    }

    /// Returns principal stresses and directions of each row, of the recovered tensor.
    pub fn principal(&self) -> Vec<PrincipalStress> {
        self.stress.iter().map(PrincipalStress::of).collect()
    }

    /// Returns the stresses at a vertex [Pa]: none outside of elements, one for each element with
    /// [`Recovery::Element`].
    pub fn at(&self, vertex: u32) -> impl Iterator<Item = &Mat<f64, 3>> {
        let rows = self.vertices.iter().zip(&self.stress);
        rows.filter(move |(row, _)| **row == vertex).map(|(_, stress)| stress)
    }
}

impl PrincipalStress {
    /// Returns those of a symmetric tensor.
    pub fn of(stress: &Mat<f64, 3>) -> Self {
        let (values, vectors) = symmetric_eigen(stress);
        let mut order = [0, 1, 2];
        order.sort_by(|a: &usize, b: &usize| values[*b].total_cmp(&values[*a]));
        PrincipalStress { values: order.map(|k| values[k]), directions: Mat(order.map(|k| vectors[k])) }
    }
}

/// Recovers the Cauchy stress at the nodes of these terms.
pub(crate) fn nodal_stress<'a>(
    terms: impl Iterator<Item = &'a dyn ElementTerm>,
    at: SampledConfiguration<'_>,
    recovery: Recovery,
) -> NodalStress {
    let mut all = NodalStress { vertices: vec![], stress: vec![], lowered: 0 };
    for term in terms {
        let Some(cells) = Cells::sampled(term, at, ElementState::cauchy_stress) else { continue };
        let NodalRows { vertices, values, lowered } = recovered(&cells, recovery);
        all.vertices.extend(vertices);
        all.stress.extend(values.iter().map(|value| tensor(value).symmetric()));
        all.lowered += lowered;
    }
    all
}

/// Recovers a tensor at the nodes.
fn recovered(cells: &Cells, recovery: Recovery) -> NodalRows {
    match recovery {
        Recovery::Element => {
            NodalRows { vertices: cells.vertices.clone(), values: cells.element_values(), lowered: 0 }
        }
        Recovery::Average => cells.averaged(),
        Recovery::Patch => patch::patched(cells),
    }
}

fn tensor(entries: &Tensor) -> Mat<f64, 3> {
    let mut tensor = Mat::zero();
    tensor.0.as_flattened_mut().copy_from_slice(entries);
    tensor
}

#[cfg(test)]
mod tests;
