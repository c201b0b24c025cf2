//! The build for the lecture, `--cfg lecture`, which browsers load in half the time: linear simplices of the
//! lecture's materials, springs, gravity. Scenes that need more are refused.

use pliant::material::{MaterialSpec, MaterialVisitor};

/// True if this is the build for the lecture: it has no elements but linear simplices, no membranes and no
/// muscles.
pub const IS_FOR_LECTURE: bool = cfg!(lecture);

/// True if this build has the material.
pub fn has_material(material: &MaterialSpec) -> bool {
    use MaterialSpec::{Corotated, Linear, NeoHookean, StableNeoHookean, Stvk};
    let is_of_lecture =
        matches!(material, Linear(_) | Stvk(_) | Corotated(_) | NeoHookean(_) | StableNeoHookean(_));
    is_of_lecture || !IS_FOR_LECTURE
}

/// Calls `visitor` with the concrete model, as [`MaterialSpec::visit`] does.
#[cfg(not(lecture))]
pub(crate) fn visit<const D: usize, V: MaterialVisitor<D>>(material: &MaterialSpec, visitor: V) -> V::Output {
    material.visit(visitor)
}

/// Calls `visitor` with the concrete model, if this build has it.
///
/// # Panics
/// If it has not.
#[cfg(lecture)]
pub(crate) fn visit<const D: usize, V: MaterialVisitor<D>>(material: &MaterialSpec, visitor: V) -> V::Output {
    use pliant::material::{Corotated, Linear, Model, NeoHookean, StableNeoHookean, Stvk};
    match material {
        MaterialSpec::Linear(parameters) => visitor.visit(Linear::new(parameters)),
        MaterialSpec::Stvk(parameters) => visitor.visit(Stvk::new(parameters)),
        MaterialSpec::Corotated(parameters) => visitor.visit(Corotated::new(parameters)),
        MaterialSpec::NeoHookean(parameters) => visitor.visit(NeoHookean::new(parameters)),
        MaterialSpec::StableNeoHookean(parameters) => visitor.visit(StableNeoHookean::new(parameters)),
        _ => left_out(),
    }
}

/// Ends in a panic: scenes that need what is left out are refused before.
pub(crate) fn left_out() -> ! {
    unreachable!("the build for the lecture leaves it out")
}
