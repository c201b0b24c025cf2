//! Scenes that differ in chosen values: sweeps over materials, meshes, solvers, anything that has a key.
//!
//! ```
//! use pliant_scene::vary;
//! let text = "dimension = 2
//! time = { integrator = 'rk4', step = 1e-3, duration = 1.0 } # short
//! [[body]]
//! mesh = { grid = { cells = [4, 1], spacing = 0.1 } }
//! elastic = { corotated = { young = 1e5, poisson = 0.3 } }
//! mass = { density = 1000.0 }
//! ";
//! let stiffer = vary::with(text, "body.0.elastic.corotated.young", "1e6")?;
//! assert_eq!(stiffer, text.replace("1e5", "1e6"));
//! let axes = ["body.0.elastic.corotated.young=1e5,1e6".parse()?, "time.integrator=rk4,yoshida4".parse()?];
//! assert_eq!(vary::combinations(&axes).len(), 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt;
use std::str::FromStr;

use super::{KeyPath, SceneError, Source};

/// The text of a scene with the value at `path` replaced. `value` is TOML; a word needs no quotes. All else
/// stays as it is written, comments included.
///
/// # Errors
/// The text is no scene; `path` leads nowhere, or to a key that scenes do not have; the value is none, of
/// the wrong type or one that cannot be simulated. The message points at the changed line.
pub fn with(text: &str, path: &str, value: &str) -> Result<String, SceneError> {
    with_all(text, &[(path.to_owned(), value.to_owned())])
}

/// The same for several values, in order: pairs of path and value.
///
/// # Errors
/// As for [`with`].
pub fn with_all(text: &str, changes: &[(String, String)]) -> Result<String, SceneError> {
    Ok(Source::new("<scene>", text).varied(changes)?.text)
}

impl Source {
    /// The text with values replaced, in order, checked to be a scene: pairs of path and value, as for
    /// [`with`]. Its name, and the directory that files are relative to, stay.
    ///
    /// # Errors
    /// As for [`with`].
    pub fn varied(&self, changes: &[(String, String)]) -> Result<Source, SceneError> {
        let varied = self.with_values("", changes)?;
        varied.scene()?;
        Ok(varied)
    }
}

/// A value of a scene, and what it is to be in turn: `body.0.elastic.corotated.young=1e5,1e6`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VariedKey {
    /// Path of the key.
    pub path: String,
    /// Values as TOML, words without quotes; at least one.
    pub values: Vec<String>,
}

impl fmt::Display for VariedKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}={}", self.path, self.values.join(","))
    }
}

/// A text says no path and values.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` {wrong}; it is PATH=A,B,C, for example body.0.elastic.corotated.young=1e5,1e6")]
pub struct AxisError {
    /// The text.
    pub text: String,
    /// The mistake in it.
    pub wrong: &'static str,
}

impl FromStr for VariedKey {
    type Err = AxisError;

    /// Values are separated by commas that stand in no bracket, brace or quotes.
    fn from_str(text: &str) -> Result<VariedKey, AxisError> {
        let error = |wrong| AxisError { text: text.to_owned(), wrong };
        let (path, values) = text.split_once('=').ok_or_else(|| error("gives no values"))?;
        let path = path.trim();
        path.parse::<KeyPath>().map_err(|_| error("names no key"))?;
        let values: Vec<String> = split(values).into_iter().map(|value| value.trim().to_owned()).collect();
        if values.iter().any(String::is_empty) {
            return Err(error("has an empty value"));
        }
        Ok(VariedKey { path: path.to_owned(), values })
    }
}

/// The parts between commas at the top level.
fn split(text: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth, mut quote) = (vec![], 0, 0i32, None);
    for (i, c) in text.char_indices() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{' | '(') => depth += 1,
            (None, ']' | '}' | ')') => depth -= 1,
            (None, ',') if depth == 0 => {
                parts.push(&text[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

/// Every combination of the values of these axes, the last axis fastest: each a list of path and value for
/// [`with_all`]. One empty list without axes.
pub fn combinations(axes: &[VariedKey]) -> Vec<Vec<(String, String)>> {
    axes.iter().fold(vec![vec![]], |combinations, axis| {
        let extended = combinations.iter().flat_map(|before: &Vec<(String, String)>| {
            axis.values.iter().map(|value| {
                let mut changes = before.clone();
                changes.push((axis.path.clone(), value.clone()));
                changes
            })
        });
        extended.collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "dimension = 2 # plane
[time]
integrator = \"rk4\"
step = 1e-3   # [s]
duration = 1.0
[[body]]
mesh = { grid = { cells = [4, 1], spacing = 0.1 } }
elastic = { corotated = { young = 1e5, poisson = 0.3 } }
mass = { density = 1000.0 }
";

    #[test]
    fn a_value_is_replaced_and_the_rest_stays_as_written() {
        let varied = with(TEXT, "body.0.elastic.corotated.young", "2e6").unwrap();
        assert_eq!(varied, TEXT.replace("1e5", "2e6"));
        let varied = with(TEXT, "time.integrator", "{ newmark = { beta = 0.3 } }").unwrap();
        assert_eq!(varied, TEXT.replace("\"rk4\"", "{ newmark = { beta = 0.3 } }"));
    }

    #[test]
    fn what_leads_nowhere_or_is_not_of_a_scene_is_refused_by_name() {
        let cases = [
            ("body.1.order", "2", "there is no `body.1`"),
            ("body.0.elastic.corotated.yung", "1e5", "unknown field `yung`"),
            ("time.step.x", "1", "is a single value"),
            ("time.integrator", "rk5", "unknown choice `rk5`"),
            ("body.0.elastic.corotated.poisson", "0.5", "`poisson` = 0.5"),
            ("body.0.elastic.stvk.young", "1e5", "exactly one of"),
            ("a b", "1", "not a path of keys"),
        ];
        for (path, value, message) in cases {
            let error = with(TEXT, path, value).unwrap_err().to_string();
            assert!(error.contains(message), "{path}: {error}");
            assert!(error.contains(&format!("from `{path}={value}`")), "{path}: {error}");
        }
    }

    #[test]
    fn axes_split_at_commas_outside_of_brackets_and_quotes() {
        let axis: VariedKey =
            "body.0.elastic={ stvk = { young = 1, poisson = 0 } }, \"a,b\" ,[1,2]".parse().unwrap();
        assert_eq!(axis.values, ["{ stvk = { young = 1, poisson = 0 } }", "\"a,b\"", "[1,2]"]);
        assert_eq!("a.b=1,2".parse::<VariedKey>().unwrap().to_string(), "a.b=1,2");
        for bad in ["a.b", "a.b=", "a.b=1,,2", "=1", "a..b=1"] {
            assert!(bad.parse::<VariedKey>().is_err(), "{bad}");
        }
    }

    #[test]
    fn combinations_count_the_last_axis_fastest() {
        let axes: Vec<VariedKey> = ["a=1,2", "b=x,y,z"].iter().map(|axis| axis.parse().unwrap()).collect();
        let all: Vec<String> = combinations(&axes)
            .iter()
            .map(|changes| changes.iter().map(|(_, value)| value.as_str()).collect())
            .collect();
        assert_eq!(all, ["1x", "1y", "1z", "2x", "2y", "2z"]);
        assert_eq!(combinations(&[]), [vec![]]);
    }
}
