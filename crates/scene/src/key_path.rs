//! Where a value stands in a scene: `body.0.elastic.corotated.poisson`.

use std::fmt;
use std::str::FromStr;

use super::error::shortened;

/// One step down into a scene.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum KeySegment {
    /// A key of a table.
    Key(String),
    /// An element of a list, from 0.
    Index(usize),
}

/// The way from the top of a scene to one of its values.
///
/// ```
/// use pliant_scene::KeyPath;
/// let path = KeyPath::root().key("body").index(0).key("mesh");
/// assert_eq!(path.to_string(), "body.0.mesh");
/// assert_eq!("body.0.mesh".parse(), Ok(path));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct KeyPath(Vec<KeySegment>);

impl KeyPath {
    /// The scene itself.
    pub fn root() -> KeyPath {
        KeyPath::default()
    }

    /// The value under `key` of this table.
    #[must_use]
    pub fn key(&self, key: &str) -> KeyPath {
        self.child(KeySegment::Key(key.to_owned()))
    }

    /// Element `index` of this list.
    #[must_use]
    pub fn index(&self, index: usize) -> KeyPath {
        self.child(KeySegment::Index(index))
    }

    /// One step further down.
    #[must_use]
    pub fn child(&self, segment: KeySegment) -> KeyPath {
        let mut segments = Vec::with_capacity(self.0.len() + 1);
        segments.extend_from_slice(&self.0);
        segments.push(segment);
        KeyPath(segments)
    }

    /// The steps, from the top down.
    pub fn segments(&self) -> &[KeySegment] {
        &self.0
    }

    /// True if `other` is this value or holds it.
    pub fn starts_with(&self, other: &KeyPath) -> bool {
        self.0.starts_with(&other.0)
    }

    /// The innermost key: `cells` in `body.0.mesh.grid.cells.1`. What messages call the value.
    pub fn last_key(&self) -> Option<&str> {
        innermost_key(&self.0)
    }

    /// The innermost key of what holds the value: `walls` of `world.walls.0.offset`.
    pub(super) fn holder_key(&self) -> Option<&str> {
        innermost_key(&self.0[..self.0.len().saturating_sub(1)])
    }

    /// What holds the value; `None` of the scene itself.
    pub(super) fn holder(&self) -> Option<KeyPath> {
        let (_, holder) = self.0.split_last()?;
        Some(KeyPath(holder.to_vec()))
    }
}

fn innermost_key(segments: &[KeySegment]) -> Option<&str> {
    segments.iter().rev().find_map(|segment| match segment {
        KeySegment::Key(key) => Some(key.as_str()),
        KeySegment::Index(_) => None,
    })
}

impl FromIterator<KeySegment> for KeyPath {
    fn from_iter<I: IntoIterator<Item = KeySegment>>(segments: I) -> KeyPath {
        KeyPath(segments.into_iter().collect())
    }
}

fn is_bare(character: char) -> bool {
    character.is_ascii_alphanumeric() || character == '_' || character == '-'
}

impl fmt::Display for KeyPath {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, segment) in self.0.iter().enumerate() {
            if i > 0 {
                formatter.write_str(".")?;
            }
            match segment {
                KeySegment::Index(index) => write!(formatter, "{index}")?,
                // A key of digits only would read as an index.
                KeySegment::Key(key)
                    if !key.is_empty()
                        && key.chars().all(is_bare)
                        && !key.chars().all(|c| c.is_ascii_digit()) =>
                {
                    formatter.write_str(key)?;
                }
                KeySegment::Key(key) => write!(formatter, "{key:?}")?,
            }
        }
        Ok(())
    }
}

impl serde::Serialize for KeyPath {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Steps of the longest path that a text may say. No key of a scene is half as deep; what follows a path down
/// recurses.
const DEEPEST: usize = 32;

/// A text is not a path of keys.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeyPathError {
    /// The text is not made of keys and indices.
    #[error(
        "{} is not a path of keys and indices joined by dots, like `body.0.mass.density`",
        shortened(path)
    )]
    Malformed {
        /// The text.
        path: String,
    },
    /// More steps than any key of a scene is deep.
    #[error("{} leads {steps} steps down; no key of a scene is deeper than {DEEPEST}", shortened(path))]
    TooDeep {
        /// The text.
        path: String,
        /// Number of its steps.
        steps: usize,
    },
}

impl FromStr for KeyPath {
    type Err = KeyPathError;

    /// Reads keys and indices joined by dots. No quoted keys: no scene has a key that needs quotes.
    fn from_str(text: &str) -> Result<KeyPath, KeyPathError> {
        let steps = text.split('.').count();
        if steps > DEEPEST {
            return Err(KeyPathError::TooDeep { path: text.to_owned(), steps });
        }
        let segments = text.split('.').map(|part| segment(part.trim()));
        segments.collect::<Option<_>>().ok_or_else(|| KeyPathError::Malformed { path: text.to_owned() })
    }
}

/// A key, or an index where the text is a whole number; `None` if it is neither.
fn segment(text: &str) -> Option<KeySegment> {
    if text.is_empty() || !text.chars().all(is_bare) {
        return None;
    }
    if text.chars().all(|c| c.is_ascii_digit()) {
        return text.parse().map(KeySegment::Index).ok();
    }
    Some(KeySegment::Key(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_deeper_than_any_scene_is_refused_in_few_words() {
        let path = |steps: usize| vec!["a"; steps].join(".");
        assert_eq!(path(32).parse::<KeyPath>().unwrap().segments().len(), 32);
        for steps in [33, 10_000, 1_000_000] {
            let error = path(steps).parse::<KeyPath>().unwrap_err();
            assert!(matches!(&error, KeyPathError::TooDeep { steps: found, .. } if *found == steps));
            let message = error.to_string();
            assert!(message.len() < 150 && message.contains(&steps.to_string()), "{message}");
        }
    }

    #[test]
    fn reads_what_it_shows() {
        for text in ["time.step", "body.0.elastic.neo-hookean.young", "body.12", "a_b"] {
            assert_eq!(text.parse::<KeyPath>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn refuses_what_is_no_path() {
        for text in ["", ".", "a..b", "a.", "a b", "a=b", "body[0]", "body.99999999999999999999999999"] {
            assert!(text.parse::<KeyPath>().is_err(), "{text}");
        }
    }

    #[test]
    fn quotes_keys_that_would_read_as_something_else() {
        assert_eq!(KeyPath::root().key("a.b").key("7").key("").to_string(), r#""a.b"."7"."""#);
    }

    #[test]
    fn names_the_innermost_key() {
        assert_eq!("body.0.mesh.grid.cells.1".parse::<KeyPath>().unwrap().last_key(), Some("cells"));
        assert_eq!(KeyPath::root().last_key(), None);
    }
}
