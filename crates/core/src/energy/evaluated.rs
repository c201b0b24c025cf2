//! Elements evaluated at points of their own, for stresses at nodes and estimates of errors.

use crate::algebra::Mat;
use crate::element::{Barycentric, ElementState};
use crate::material::Tangent;

/// One element, evaluated at some of its points.
pub struct EvaluatedElement<'a> {
    /// Number of the element in the mesh.
    pub number: usize,
    /// Nodes of the element: vertices of the system.
    pub vertices: &'a [u32],
    /// Deformation and stress at the points, in their order.
    pub states: &'a [ElementState],
    /// Computes the tangent `dP/dF` [Pa] at the centre of the element, in 2D with zeros out of the plane;
    /// `None` if the element has none.
    pub tangent: &'a dyn Fn() -> Option<Tangent<3>>,
}

/// Visitor of evaluated elements.
pub type ElementVisitor<'a> = dyn FnMut(EvaluatedElement<'_>) + 'a;

/// Evaluates the same state at all points, in an element without a tangent.
pub(super) fn visit_uniform(
    (number, vertices): (usize, &[u32]),
    state: ElementState,
    points: &[Barycentric],
    visit: &mut ElementVisitor<'_>,
) {
    visit(EvaluatedElement { number, vertices, states: &vec![state; points.len()], tangent: &|| None });
}

/// Returns the tangent in the axes of space of a material with these axes, `P(F R) R^T`, that is
/// `C' : G = (C : G R) R^T`, given its `tangent` in its own axes. In 2D entries out of the plane are zero.
pub(super) fn tangent_in_space<const D: usize>(
    axes: Option<&Mat<f64, 3>>,
    tangent: &Tangent<D>,
) -> Tangent<3> {
    let turned = axes.map_or(*tangent, |axes| tangent.in_axes(&axes.leading()));
    let mut all = Tangent::zero();
    for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
        for k in 0..D {
            all.0[i][j][k][..D].copy_from_slice(&turned.0[i][j][k]);
        }
    }
    all
}
