//! Parameters of a scene that can be fitted: every non-integer number, by its key.

use pliant::quantity::Quantity;
use pliant_scene::{KeyPath, KeySegment, Scene, Source};
use serde_json::Value;

use super::FitError;

/// Keys of a body that contain parameters.
const OF_BODIES: [&str; 9] =
    ["elastic", "mass", "damping", "springs", "bending", "membrane", "load", "velocity", "contact"];
/// Keys of a scene that contain parameters.
const OF_SCENES: [&str; 3] = ["world", "contact", "attachment"];
/// Keys of a scene for computation and output, which are no physical parameters.
const OF_RUNS: [&str; 4] = ["time", "output", "probe", "study"];
/// Maximum number of keys in a message.
const LISTED: usize = 40;

/// A number of a scene that can be fitted.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FittedKey {
    /// Path in the text of the scene.
    pub(super) path: KeyPath,
    /// Value in the scene, in SI units.
    pub(super) value: f64,
    /// Index of its body, if any.
    pub(super) body: Option<usize>,
}

impl FittedKey {
    /// Finds the key of this name in a scene: its path, with bodies by name or index; the name of the
    /// material may be omitted (`body.0.elastic.young`).
    ///
    /// # Errors
    /// [`FitError::Key`], which lists the valid keys.
    pub(super) fn find(source: &Source, scene: &Scene, name: &str) -> Result<FittedKey, FitError> {
        let document = serde_json::to_value(scene).unwrap_or(Value::Null);
        let wrong = |problem: &str| FitError::Key {
            name: name.to_owned(),
            problem: problem.to_owned(),
            known: known(&document),
        };
        let (path, body) =
            full_path(scene, &document, name).ok_or_else(|| wrong("is no key of this scene"))?;
        let read = of_scene(&document, &path);
        match read {
            Some(Value::Number(number)) if !number.is_f64() => return Err(wrong("is a whole number")),
            Some(Value::String(_)) => return Err(wrong("is a text or a formula, not a number")),
            Some(Value::Object(_) | Value::Array(_)) => return Err(wrong("is no single number")),
            Some(Value::Bool(_)) => return Err(wrong("is no number")),
            _ => {}
        }
        if let Some(KeySegment::Key(part)) = path.segments().first()
            && OF_RUNS.contains(&&part[..])
        {
            return Err(wrong("says how the scene is computed, not what it is made of"));
        }
        // The text may specify other moduli than the scene stores: `bulk` and `shear`.
        let value = of_text(source, &path).or_else(|| read.and_then(Value::as_f64));
        let value = value.ok_or_else(|| wrong("is not given in this scene"))?;
        Ok(FittedKey { path, value, body })
    }

    /// Key and value for [`Source::varied`].
    pub(super) fn set(&self, value: f64) -> (String, String) {
        (self.path.to_string(), format!("{value:?}"))
    }
}

/// Path for a name, and the index of its body.
fn full_path(scene: &Scene, document: &Value, name: &str) -> Option<(KeyPath, Option<usize>)> {
    let Some(rest) = name.strip_prefix("body.") else { return Some((name.parse().ok()?, None)) };
    let (i, key) = scene.body.iter().enumerate().find_map(|(i, body)| {
        let of = |prefix: &str| rest.strip_prefix(prefix)?.strip_prefix('.');
        Some((i, of(&body.name_or_default(i)).or_else(|| of(&i.to_string()))?))
    })?;
    let key: KeyPath = key.parse().ok()?;
    let mut segments = key.segments().to_vec();
    let model = document["body"][i]["elastic"].as_object().and_then(|elastic| elastic.keys().next());
    if let ([KeySegment::Key(first), KeySegment::Key(second), ..], Some(model)) = (&segments[..], model)
        && first == "elastic"
        && second != model
    {
        segments.insert(1, KeySegment::Key(model.clone()));
    }
    let body = KeyPath::root().key("body").index(i);
    Some((segments.into_iter().fold(body, |path, segment| path.child(segment)), Some(i)))
}

/// Value in the parsed scene, in SI units.
fn of_scene<'d>(document: &'d Value, path: &KeyPath) -> Option<&'d Value> {
    path.segments().iter().try_fold(document, |value, segment| match segment {
        KeySegment::Key(key) => value.get(key),
        KeySegment::Index(index) => value.get(index),
    })
}

/// Number in the text, with its unit converted.
fn of_text(source: &Source, path: &KeyPath) -> Option<f64> {
    let document: toml::Table = source.text().parse().ok()?;
    let document = toml::Value::Table(document);
    let value = path.segments().iter().try_fold(&document, |value, segment| match segment {
        KeySegment::Key(key) => value.get(key),
        KeySegment::Index(index) => value.get(*index),
    })?;
    match value {
        toml::Value::Float(value) => Some(*value),
        toml::Value::Integer(value) => Some(*value as f64),
        toml::Value::String(text) => text.parse::<Quantity>().ok().map(|quantity| quantity.value),
        _ => None,
    }
}

/// Paths of all numbers that can be fitted, without names of materials.
fn known(document: &Value) -> Vec<String> {
    let mut found = vec![];
    let bodies = document["body"].as_array().map_or(&[][..], Vec::as_slice);
    for (i, body) in bodies.iter().enumerate() {
        for part in OF_BODIES {
            let value = match (part, body[part].as_object()) {
                ("elastic", Some(elastic)) => elastic.values().next().unwrap_or(&Value::Null),
                _ => &body[part],
            };
            collect(value, &format!("body.{i}.{part}"), &mut found);
        }
    }
    for part in OF_SCENES {
        collect(&document[part], part, &mut found);
    }
    if found.len() > LISTED {
        let more = found.len() - LISTED;
        found.truncate(LISTED);
        found.push(format!("and {more} more"));
    }
    found
}

fn collect(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(number) if number.is_f64() => found.push(path.to_owned()),
        Value::Object(table) => {
            table.iter().for_each(|(key, value)| collect(value, &format!("{path}.{key}"), found));
        }
        // Longer lists are data of vertices or springs.
        Value::Array(list) if list.len() <= 8 => {
            list.iter().enumerate().for_each(|(i, value)| collect(value, &format!("{path}.{i}"), found));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "dimension = 2
        time = { integrator = 'implicit-euler', step = 1e-3, duration = 0.01 }
        world = { gravity = [0.0, -9.81] }
        [[body]]
        name = 'beam'
        mesh = { grid = { cells = [2, 1], spacing = 0.1 } }
        elastic = { neo-hookean = { young = '0.1 MPa', poisson = 0.3 } }
        mass = { density = 1000 }
        [[body]]
        mesh = { grid = { cells = [2, 1], spacing = 0.1 } }
        elastic = { neo-hookean = { bulk = 2e6, shear = 1e6 } }
        mass = { density = 1000 }";

    fn find(name: &str) -> Result<FittedKey, FitError> {
        let source = Source::new("scene.toml", SCENE);
        let scene = source.scene().unwrap();
        FittedKey::find(&source, &scene, name)
    }

    #[test]
    fn bodies_are_found_by_name_or_number_and_models_need_none() {
        let full = "body.0.elastic.neo-hookean.young";
        for name in ["body.beam.elastic.young", "body.0.elastic.young", full] {
            let key = find(name).unwrap();
            assert_eq!((key.path.to_string().as_str(), key.value, key.body), (full, 1e5, Some(0)));
        }
        assert_eq!(find("body.1.elastic.bulk").unwrap().value, 2e6);
        assert_eq!(find("body.0.mass.density").unwrap().value, 1000.0);
        assert_eq!(find("world.gravity.1").unwrap().value, -9.81);
    }

    #[test]
    fn what_is_no_number_is_refused_with_a_list_of_those_that_are() {
        for (name, problem) in [
            ("body.0.elastic.yuong", "is not given in this scene"),
            ("body.7.elastic.young", "is no key of this scene"),
            ("body.0.mesh.grid.cells.0", "is a whole number"),
            ("body.0.elastic", "is no single number"),
            ("time.integrator", "is a text or a formula"),
            ("time.duration", "says how the scene is computed"),
        ] {
            let message = find(name).unwrap_err().to_string();
            assert!(message.contains(&format!("`{name}` {problem}")), "{message}");
            assert!(
                message.contains("body.0.elastic.young") && message.contains("world.gravity.1"),
                "{message}"
            );
        }
    }
}
