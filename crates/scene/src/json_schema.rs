//! The JSON Schema of a scene, for editors.

use std::sync::OnceLock;

use schemars::{Schema, generate::SchemaSettings};
use serde_json::Value;

use super::schema::Scene;

/// The JSON Schema (draft 2020-12) that `pliant schema` prints: types, ranges, and the documentation of every
/// key.
///
/// A TOML file names it in a comment, `#:schema scene.json`, and editors then complete and underline. The
/// schema is looser than [`Scene::validate`]: it cannot compare two values.
pub fn schema() -> Schema {
    let mut schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<Scene>();
    schema.insert("title".to_owned(), "pliant scene".into());
    if let Some(definitions) = schema.get_mut("$defs").and_then(Value::as_object_mut) {
        let needs_nothing: Vec<String> = definitions
            .iter()
            .filter(|(_, definition)| definition["type"] == "object" && definition["required"].is_null())
            .map(|(name, _)| format!("#/$defs/{name}"))
            .collect();
        definitions.values_mut().for_each(|definition| add_words(definition, &needs_nothing));
    }
    schema
}

/// Where a choice has words, tables of which no key is required are words too: `"bdf2"` is `{ bdf2 = {} }`,
/// as the reader has it.
fn add_words(choice: &mut Value, needs_nothing: &[String]) {
    let Some(alternatives) = choice.get_mut("oneOf").and_then(Value::as_array_mut) else { return };
    let is_table = |content: &Value| {
        content["$ref"].as_str().is_some_and(|content| needs_nothing.iter().any(|known| known == content))
    };
    let tables =
        alternatives.iter().filter_map(|alternative| alternative["properties"].as_object()).flatten();
    let words: Vec<Value> =
        tables.filter(|(_, content)| is_table(content)).map(|(name, _)| name.clone().into()).collect();
    let listed = alternatives.iter_mut().find_map(|alternative| alternative.get_mut("enum")?.as_array_mut());
    if let Some(listed) = listed {
        listed.extend(words);
    }
}

/// The schema, made once: every number of a scene is compared with it.
pub(super) fn published() -> &'static Value {
    static SCHEMA: OnceLock<Schema> = OnceLock::new();
    SCHEMA.get_or_init(schema).as_value()
}

/// True if `field`, a table inside of a body, has a key of this name.
pub(super) fn has_key(field: &str, name: &str) -> bool {
    let of = |value: &Value| value.pointer("/$ref").and_then(Value::as_str).and_then(resolved);
    let table = || {
        let field = &fields_of_bodies()?.get(field)?;
        let choices = field["anyOf"].as_array();
        choices.map_or_else(|| of(field), |choices| choices.iter().find_map(of))
    };
    let has = |table: &Value| table["properties"].get(name).is_some();
    table().is_some_and(|table| {
        has(table) || table["oneOf"].as_array().is_some_and(|kinds| kinds.iter().any(has))
    })
}

/// Keys of a body, and what may be there.
fn fields_of_bodies() -> Option<&'static serde_json::Map<String, Value>> {
    let body = published().pointer("/properties/body/items/$ref")?.as_str()?;
    resolved(body)?["properties"].as_object()
}

/// Part of the schema that a reference names.
fn resolved(reference: &str) -> Option<&'static Value> {
    published().pointer(reference.strip_prefix('#')?)
}

/// The place of the table that has a key of this name, for messages: "in `[world]`".
pub(super) fn table_with(name: &str) -> Option<String> {
    let schema = published();
    let top = schema["properties"].as_object()?;
    if top.contains_key(name) {
        return Some("at the top of the file".to_owned());
    }
    let of = |value: &serde_json::Value| {
        let reference = value.pointer("/$ref").or_else(|| value.pointer("/items/$ref"))?.as_str()?;
        resolved(reference)?.get("properties")
    };
    let in_table = top.iter().find_map(|(table, value)| {
        of(value)?.get(name)?;
        let is_list = value.get("items").is_some();
        Some(if is_list { format!("in `[[{table}]]`") } else { format!("in `[{table}]`") })
    });
    in_table.or_else(|| {
        let field = fields_of_bodies()?.keys().find(|field| has_key(field, name))?;
        Some(format!("in `{field}` of a `[[body]]`"))
    })
}
