//! The JSON Schema of a scene, for editors.

use schemars::{Schema, generate::SchemaSettings};

use super::schema::Scene;

/// The JSON Schema (draft 2020-12) that `pliant schema` prints: types, ranges, and the documentation of every key.
///
/// A TOML file names it in a comment, `#:schema scene.json`, and editors then complete and underline. The schema is
/// looser than [`Scene::validate`]: it cannot compare two values.
pub fn schema() -> Schema {
    let mut schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<Scene>();
    schema.insert("title".to_owned(), "pliant scene".into());
    schema
}
