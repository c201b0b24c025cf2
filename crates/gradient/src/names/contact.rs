//! Parameters of contact, and dependence of contact on other parameters of a scene.

use pliant::material::MaterialSpec;
use pliant_scene::{Body, Scene};

use super::constants::MaterialConstants;
use super::materials::young;
use crate::parameter::{ContactStiffness, FrictionCoefficient, Parameter};

const STIFFNESS: &str = "contact.stiffness";
const FRICTION: &str = "contact.friction";

/// Names of the parameters of contact itself. Friction is one only if a single positive coefficient
/// applies to all pairs.
pub(super) fn names(scene: &Scene) -> impl Iterator<Item = &'static str> {
    let contact = scene.contact.as_ref();
    let stiffness = contact.and_then(|contact| contact.stiffness).map(|_| STIFFNESS);
    let alike = contact.filter(|contact| contact.pairs.iter().all(|pair| pair.friction.is_none()));
    let friction = alike.filter(|contact| contact.friction > 0.0).map(|_| FRICTION);
    stiffness.into_iter().chain(friction)
}

/// Parameter of contact with this name.
pub(super) fn parameter(scene: &Scene, name: &str) -> Option<Box<dyn Parameter>> {
    let contact = scene.contact.as_ref()?;
    match names(scene).find(|known| *known == name)? {
        STIFFNESS => Some(Box::new(ContactStiffness::new(contact.stiffness?))),
        _ => Some(Box::new(FrictionCoefficient::new(contact.friction))),
    }
}

/// True if contact depends on the reference shape of this body.
pub(super) fn goes_by_shape(scene: &Scene, spec: &Body) -> bool {
    collides(spec) && scene.acting_contact().is_some()
}

/// True if the contact stiffness depends on a body through the modulus of its material only.
fn goes_by_modulus(spec: &Body) -> bool {
    let has_modulus = |material: &MaterialSpec| young(material).is_some() && material.lame().is_some();
    spec.membrane.is_none() && spec.elastic.as_ref().is_some_and(has_modulus)
}

/// True unless contact of the body is turned off.
fn collides(spec: &Body) -> bool {
    spec.contact.as_ref().and_then(|contact| contact.collides) != Some(false)
}

/// Reason why contact makes the derivative by this key of a body unknown; `None` if it does not.
///
/// Defaults have no derivatives: the distance and the friction regularisation velocity are fractions of
/// reference sizes, and the stiffness is the modulus of the softer body, or follows from masses, areas
/// and the step.
pub(super) fn obstacle(scene: &Scene, spec: &Body, key: &str) -> Option<String> {
    let contact = scene.acting_contact()?;
    if !collides(spec) {
        return None;
    }
    if key == "membrane.thickness" && !contact.of_walls {
        return Some("has no derivative where surfaces touch: contact keeps half of it away".into());
    }
    // Whether the key changes a default of the contact stiffness.
    let is_explicit = scene.time.integrator.method().documentation.solves == 0;
    let by_masses_and_areas = is_explicit || !goes_by_modulus(spec);
    let rubs = contact.friction > 0.0 || contact.pairs.iter().any(|pair| pair.friction.is_some());
    let stiffness = match key.split_once('.') {
        Some(("springs", _)) => true,
        Some(("elastic", key)) => {
            let constants = spec.elastic.as_ref().and_then(MaterialConstants::of);
            key == "young" || constants.is_some_and(|constants| constants.keys().any(|known| known == key))
        }
        Some(("mass", _)) => by_masses_and_areas,
        _ => key == "rest" && by_masses_and_areas,
    };
    // Defaults that depend on the key.
    let missing: Vec<&str> = [
        ("`distance`", key == "rest" && contact.distance.is_none()),
        ("`stiffness`", stiffness && contact.stiffness.is_none()),
        ("`threshold_speed`", key == "rest" && rubs && contact.threshold_speed.is_none()),
    ]
    .into_iter()
    .filter_map(|(name, is_missing)| is_missing.then_some(name))
    .collect();
    (!missing.is_empty()).then(|| {
        format!(
            "has no derivative where it decides a default of contact: give {} in [contact]",
            missing.join(" and ")
        )
    })
}
