//! Numbers of a scene that its contact is made of.

use pliant_scene::{Body, Scene};

/// Why contact leaves the derivative by this key of a body unknown; `None` where it does not.
///
/// Areas that contact stands for are those of the shape at rest. Without a `stiffness` in `[contact]` its
/// `kappa` is the modulus of the softer body, or goes by masses: in the steps of explicit schemes, and of
/// bodies without a modulus.
pub(super) fn obstacle(scene: &Scene, spec: &Body, key: &str) -> Option<&'static str> {
    let contact = scene.contact.as_ref()?;
    if spec.contact.as_ref().and_then(|contact| contact.collides) == Some(false) {
        return None;
    }
    if key == "rest" {
        return Some("has no derivative where surfaces touch: contact is made of the shape at rest");
    }
    let has_modulus = match &spec.elastic {
        Some(material) => material.lame().is_some(),
        None => spec.springs.is_some(),
    };
    let by_masses = contact.has_explicit_law(scene.time.integrator) || !has_modulus;
    let decides = match key.split_once('.') {
        Some(("mass", _)) => by_masses,
        Some(("springs", _)) => true,
        Some(("elastic", key)) => key == "young" || key.starts_with("parameters."),
        _ => false,
    };
    (decides && contact.stiffness.is_none())
        .then_some("has no derivative where it decides how stiff contact is: give a `stiffness` in [contact]")
}
