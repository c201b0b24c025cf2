//! Terms of whatever material is visited.

use pliant::energy::EnergyTerm;
use pliant::energy::elastic::{Elastic, Membrane, Sheet};
use pliant::material::{Material, MaterialVisitor};

use crate::ElementSet;

/// The term of elements with the factors and axes of a set.
fn finished<const D: usize, const N: usize>(
    mut elements: Elastic<D, N>,
    set: &ElementSet<'_>,
) -> Box<dyn EnergyTerm> {
    if let Some(factors) = set.factors {
        elements = elements.with_factors(factors);
    }
    if let Some(axes) = set.axes {
        elements = elements.with_axes(axes);
    }
    Box::new(elements)
}

/// Maker of linear elements.
pub(crate) struct LinearMaker<'a, const N: usize>(pub(crate) &'a ElementSet<'a>);

impl<const D: usize, const N: usize> MaterialVisitor<D> for LinearMaker<'_, N> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        let ElementSet { body, rest, stress, .. } = *self.0;
        finished(Elastic::<D, N>::linear(body, material, stress, self.0.of(), rest), self.0)
    }
}

/// Maker of quadratic elements.
pub(crate) struct QuadraticMaker<'a, const N: usize>(pub(crate) &'a ElementSet<'a>);

impl<const D: usize, const N: usize> MaterialVisitor<D> for QuadraticMaker<'_, N> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        let ElementSet { body, rest, stress, .. } = *self.0;
        finished(Elastic::<D, N>::quadratic(body, material, stress, self.0.of(), rest), self.0)
    }
}

/// Maker of membranes.
pub(crate) struct MembraneMaker<'a>(pub(crate) &'a ElementSet<'a>, pub(crate) Sheet);

impl MaterialVisitor<2> for MembraneMaker<'_> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<2> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        Box::new(Membrane::new(self.0.body, material, self.1, self.0.of(), self.0.rest))
    }
}
