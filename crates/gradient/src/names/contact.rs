//! Numbers of contact, and numbers of a scene that its contact is made of.

use pliant_scene::{Body, Scene};

use super::constants::MaterialConstants;
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

/// True if the stiffness of contact is Young's modulus of this body, of all pairs that touch: it alone
/// collides, with itself and with obstacles, in steps that are solved.
pub(super) fn is_as_stiff(scene: &Scene, spec: &Body) -> bool {
    let Some(contact) = scene.acting_contact().filter(|contact| contact.stiffness.is_none()) else {
        return false;
    };
    let mut others = scene.body.iter().filter(|body| !std::ptr::eq(*body, spec));
    let is_plain = spec.membrane.is_none() && spec.nodal_integration.is_none();
    is_plain
        && collides(spec)
        && !others.any(collides)
        && !contact.has_explicit_law(scene.time.integrator)
        && spec.elastic.as_ref().is_some_and(|material| material.lame().is_some())
}

/// True if contact goes by the shape of this body at rest.
pub(super) fn goes_by_shape(scene: &Scene, spec: &Body) -> bool {
    collides(spec) && scene.acting_contact().is_some()
}

/// True unless the body says that it touches nothing.
fn collides(spec: &Body) -> bool {
    spec.contact.as_ref().and_then(|contact| contact.collides) != Some(false)
}

/// Why contact leaves the derivative by this key of a body unknown; `None` where it does not.
///
/// Without a `distance` in `[contact]` that goes by the shape of the smallest body at rest. Without a
/// `stiffness` its `kappa` is the modulus of the softer body, or goes by masses and areas: in the steps of
/// explicit schemes, and of bodies without a modulus.
pub(super) fn obstacle(scene: &Scene, spec: &Body, key: &str) -> Option<&'static str> {
    let contact = scene.acting_contact()?;
    if !collides(spec) {
        return None;
    }
    if key == "membrane.thickness" && !contact.of_walls {
        return Some("has no derivative where surfaces touch: contact keeps half of it away");
    }
    if key == "rest" && contact.distance.is_none() {
        return Some(
            "has no derivative where it decides how near surfaces touch: give a `distance` in [contact]",
        );
    }
    let has_modulus = match &spec.elastic {
        Some(material) => material.lame().is_some(),
        None => spec.springs.is_some(),
    };
    let by_masses = contact.has_explicit_law(scene.time.integrator) || !has_modulus;
    let decides = match key.split_once('.') {
        None => key == "rest" && by_masses,
        Some(("mass", _)) => by_masses,
        Some(("springs", _)) => true,
        Some(("elastic", key)) => {
            let constants = spec.elastic.as_ref().and_then(MaterialConstants::of);
            let is_constant = constants.is_some_and(|constants| constants.keys().any(|known| known == key));
            is_constant || key == "young" && !is_as_stiff(scene, spec)
        }
        _ => false,
    };
    (decides && contact.stiffness.is_none())
        .then_some("has no derivative where it decides how stiff contact is: give a `stiffness` in [contact]")
}
