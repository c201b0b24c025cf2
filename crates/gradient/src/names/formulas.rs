//! Numbers that formulas of a scene name after `where`.

use pliant_scene::OverTime;

/// Beginning of their keys.
const PREFIX: &str = "parameters.";

/// Names in these formulas, each once, in their order.
pub(super) fn names<'f>(formulas: impl IntoIterator<Item = &'f OverTime>) -> Vec<String> {
    let mut names: Vec<String> = vec![];
    for (name, _) in formulas.into_iter().flat_map(OverTime::parameters) {
        if !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
    names
}

/// The key of a name, `parameters.A`.
pub(super) fn key(name: &str) -> String {
    format!("{PREFIX}{name}")
}

/// The name of a key.
pub(super) fn name(key: &str) -> Option<String> {
    key.strip_prefix(PREFIX).map(String::from)
}
