//! Right forms of values of the wrong type, where the schema says what such a value may have been meant to be.

use toml::de::DeValue;

use crate::error::shortened;
use crate::json_schema::{is_list_of, keys_that_take};
use crate::key_path::{KeyPath, KeySegment};

/// Help for a `value` that no scene has at `path`.
pub(super) fn of(value: &DeValue<'_>, path: &KeyPath) -> Option<String> {
    let [.., KeySegment::Key(key)] = path.segments() else { return None };
    let written = match value {
        DeValue::Table(_) if is_list_of(path, true) => {
            let inline = format!("`{key} = [{{ .. }}]`");
            return Some(match path.segments().len() {
                1 => format!("there may be several: `[[{key}]]` begins one, or write {inline}"),
                _ => format!("there may be several, in brackets: {inline}"),
            });
        }
        DeValue::String(text) => format!("{text:?}"),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        _ => return None,
    };
    let is_text = matches!(value, DeValue::String(_));
    // What is too long to be shown was hardly meant.
    if shortened(&written) != format!("`{}`", written.escape_debug()) {
        return None;
    }
    if is_text && is_list_of(path, false) {
        return Some(format!("in brackets: `{key} = [{written}]`"));
    }
    let forms = keys_that_take(path, !is_text).into_iter().map(|(inner, unit)| {
        let unit = unit.map_or_else(String::new, |unit| format!(" [{unit}]"));
        format!("`{key} = {{ {inner} = {written} }}`{unit}")
    });
    let forms: Vec<String> = forms.collect();
    (!forms.is_empty()).then(|| format!("write {}", forms.join(", or ")))
}
