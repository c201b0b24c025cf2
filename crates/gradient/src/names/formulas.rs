//! Parameters of formulas in a scene, named after `where`.

use pliant_scene::OverTime;

/// Prefix of their keys.
const PREFIX: &str = "parameters.";

/// Distinct names in these formulas, in order.
pub(super) fn names<'f>(formulas: impl IntoIterator<Item = &'f OverTime>) -> Vec<String> {
    let mut names: Vec<String> = vec![];
    for (name, _) in formulas.into_iter().flat_map(OverTime::parameters) {
        if !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
    names
}

/// Key of a name, such as `parameters.A`.
pub(super) fn key(name: &str) -> String {
    format!("{PREFIX}{name}")
}

/// Name in a key.
pub(super) fn name(key: &str) -> Option<String> {
    key.strip_prefix(PREFIX).map(String::from)
}
