//! Numbers of contact, and numbers of a scene that its contact is made of.

use pliant_scene::{Body, ContactSpec, Scene};

use super::constants::MaterialConstants;
use super::materials::young;
use crate::parameter::{ContactStiffness, FrictionCoefficient, Parameter};

const STIFFNESS: &str = "contact.stiffness";
const FRICTION: &str = "contact.friction";

/// Names of the numbers of contact itself. One number says how all pairs rub, and rub they do.
pub(super) fn names(scene: &Scene) -> impl Iterator<Item = &'static str> {
    let contact = scene.contact.as_ref();
    let stiffness = contact.and_then(|contact| contact.stiffness).map(|_| STIFFNESS);
    let alike = contact.filter(|contact| contact.pairs.iter().all(|pair| pair.friction.is_none()));
    let friction = alike.filter(|contact| contact.friction > 0.0).map(|_| FRICTION);
    stiffness.into_iter().chain(friction)
}

/// The number of contact of this name.
pub(super) fn parameter(scene: &Scene, name: &str) -> Option<Box<dyn Parameter>> {
    let contact = scene.contact.as_ref()?;
    match names(scene).find(|known| *known == name)? {
        STIFFNESS => Some(Box::new(ContactStiffness::new(contact.stiffness?))),
        _ => Some(Box::new(FrictionCoefficient::new(contact.friction))),
    }
}

/// True if contact goes by the shape of this body at rest.
pub(super) fn goes_by_shape(scene: &Scene, spec: &Body) -> bool {
    collides(spec) && scene.acting_contact().is_some()
}

/// True if laws of contact are made of masses and moduli of this body, or may be: without a `stiffness`.
pub(super) fn goes_by_numbers(scene: &Scene, spec: &Body) -> bool {
    collides(spec) && scene.acting_contact().is_some_and(|contact| contact.stiffness.is_none())
}

/// True if Young's modulus of this body may be the stiffness of its contact.
pub(super) fn goes_by_young(scene: &Scene, spec: &Body) -> bool {
    scene.acting_contact().is_some_and(|contact| goes_by_modulus(&contact, spec))
}

/// True if what contact takes of a body for its stiffness is the modulus of its material alone.
fn goes_by_modulus(contact: &ContactSpec, spec: &Body) -> bool {
    let is_plain = spec.membrane.is_none() && spec.nodal_integration.is_none();
    is_plain
        && collides(spec)
        && contact.stiffness.is_none()
        && spec
            .elastic
            .as_ref()
            .is_some_and(|material| young(material).is_some() && material.lame().is_some())
}

/// True unless the body says that it touches nothing.
fn collides(spec: &Body) -> bool {
    spec.contact.as_ref().and_then(|contact| contact.collides) != Some(false)
}

/// Why contact leaves the derivative by this key of a body unknown; `None` where it does not.
///
/// Without a `stiffness` its `kappa` is the modulus of the softer body, that of springs made of theirs and of
/// areas and thicknesses.
pub(super) fn obstacle(scene: &Scene, spec: &Body, key: &str) -> Option<&'static str> {
    let contact = scene.acting_contact()?;
    if !collides(spec) {
        return None;
    }
    if key == "membrane.thickness" && !contact.of_walls {
        return Some("has no derivative where surfaces touch: contact keeps half of it away");
    }
    let decides = match key.split_once('.') {
        Some(("springs", _)) => true,
        Some(("elastic", key)) => {
            let constants = spec.elastic.as_ref().and_then(MaterialConstants::of);
            let is_constant = constants.is_some_and(|constants| constants.keys().any(|known| known == key));
            is_constant || key == "young" && !goes_by_modulus(&contact, spec)
        }
        _ => false,
    };
    (decides && contact.stiffness.is_none())
        .then_some("has no derivative where it decides how stiff contact is: give a `stiffness` in [contact]")
}
