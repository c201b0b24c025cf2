//! The JSON Schema of a scene, for editors.

use std::sync::OnceLock;

use schemars::{Schema, generate::SchemaSettings};
use serde_json::Value;

use super::key_path::{KeyPath, KeySegment};
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

/// The schemas among which a value chooses: `node` itself, what it refers to, and its alternatives.
fn alternatives(node: &'static Value) -> Vec<&'static Value> {
    let mut found = vec![node];
    let mut next = 0;
    while let Some(&node) = found.get(next) {
        next += 1;
        let reference = node["$ref"].as_str().and_then(|reference| reference.strip_prefix('#'));
        found.extend(reference.and_then(|pointer| published().pointer(pointer)));
        let lists = ["anyOf", "oneOf", "allOf"].iter().filter_map(|kind| node[*kind].as_array());
        found.extend(lists.flatten());
    }
    found
}

/// The schemas of the value at `path`; empty where no scene has one.
pub(super) fn schemas_at(path: &KeyPath) -> Vec<&'static Value> {
    path.segments().iter().fold(alternatives(published()), |here, segment| {
        let next = here.iter().filter_map(|node| match segment {
            KeySegment::Key(key) => node["properties"].get(key).or_else(|| node.get("additionalProperties")),
            KeySegment::Index(index) => node["prefixItems"].get(index).or_else(|| node.get("items")),
        });
        next.flat_map(alternatives).collect()
    })
}

/// True if the value at `path` is a table with a key of this name, or a choice with one.
pub(super) fn has_key(path: &KeyPath, name: &str) -> bool {
    schemas_at(path).iter().any(|node| node["properties"].get(name).is_some())
}

/// True if a value for which `node` is a schema may be one for which `fits` holds.
fn takes(node: &'static Value, fits: impl Fn(&Value) -> bool) -> bool {
    alternatives(node).into_iter().any(fits)
}

/// True if a schema is of numbers.
fn is_number(node: &Value) -> bool {
    let of_numbers = |kind: &Value| kind == "number" || kind == "integer";
    of_numbers(&node["type"]) || node["type"].as_array().is_some_and(|kinds| kinds.iter().any(of_numbers))
}

/// True if a schema is of texts that are no quantities, and any will do.
fn is_text(node: &Value) -> bool {
    node["type"] == "string" && node["enum"].is_null() && node["const"].is_null() && node["pattern"].is_null()
}

/// The only required keys of tables that the value at `path` may be, of which a number, or a text, may be
/// the value, each with its unit where it has one: `density` of `mass`, `path` of `file`.
pub(super) fn keys_that_take(path: &KeyPath, number: bool) -> Vec<(&'static str, Option<&'static str>)> {
    let fits = if number { is_number } else { is_text };
    let key = |node: &'static Value| {
        let [only] = node["required"].as_array()?.as_slice() else { return None };
        let (only, content) = (only.as_str()?, node["properties"].get(only.as_str()?)?);
        let unit = alternatives(content).into_iter().find_map(|node| node["unit"].as_str());
        takes(content, fits).then_some((only, unit))
    };
    schemas_at(path).into_iter().filter_map(key).collect()
}

/// True if the value at `path` may be a list: of tables, or of texts.
pub(super) fn is_list_of(path: &KeyPath, tables: bool) -> bool {
    let fits: fn(&Value) -> bool =
        if tables { |node| node["type"] == "object" } else { |node| node["type"] == "string" };
    schemas_at(path).iter().filter_map(|node| node.get("items")).any(|items| takes(items, fits))
}

/// The place of the table that has a key of this name, for messages: "in `[world]`".
pub(super) fn table_with(name: &str) -> Option<String> {
    let root = KeyPath::root();
    if has_key(&root, name) {
        return Some("at the top of the file".to_owned());
    }
    let tables = published()["properties"].as_object()?.keys();
    let in_table = tables.clone().find_map(|table| {
        let path = root.key(table);
        let in_list = has_key(&path.index(0), name);
        match has_key(&path, name) {
            true => Some(format!("in `[{table}]`")),
            false => in_list.then(|| format!("in `[[{table}]]`")),
        }
    });
    let body = root.key("body").index(0);
    in_table.or_else(|| {
        let fields = schemas_at(&body).into_iter().filter_map(|node| node["properties"].as_object());
        let field = fields.flat_map(|fields| fields.keys()).find(|field| has_key(&body.key(field), name))?;
        Some(format!("in `{field}` of a `[[body]]`"))
    })
}
