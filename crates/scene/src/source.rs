//! The text of a scene.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::deserialize::{self, ReadDocument};
use super::error::{Problem, ProblemKind, SceneError};
use super::key_path::{KeyPath, KeySegment};
use super::suggest::nearest;
use super::{Scene, document};
use pliant_files::regular_file;

/// First bytes of every recording: those of MCAP.
const RECORDING: &[u8] = b"\x89MCAP";

/// Files of a folder among which a name is looked for.
const MOST_FILES: usize = 10_000;

/// The file in the folder of `path`, which is not there, that was most likely meant: the one with this
/// `ending`, or that of the path, whose name is nearest.
pub fn near_file(path: &Path, ending: &str) -> Option<PathBuf> {
    let (name, folder) = (path.file_name()?.to_str()?, path.parent()?);
    let added = folder.join(format!("{name}.{ending}"));
    if added.is_file() {
        return Some(added);
    }
    let listed = fs::read_dir(if folder.as_os_str().is_empty() { Path::new(".") } else { folder }).ok()?;
    let named = listed.take(MOST_FILES).filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let of_kind = |name: &String| Path::new(name).extension().is_some_and(|found| found == ending);
    let mut files: Vec<String> = named.filter(of_kind).collect();
    files.sort_unstable();
    // Stems are compared: a common ending makes all names alike.
    let stem = |name: &str| Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let stems: Vec<String> = files.iter().filter_map(|file| stem(file)).collect();
    let stems: Vec<&str> = stems.iter().map(String::as_str).collect();
    let near = nearest(&stem(name)?, &stems)?;
    Some(folder.join(format!("{near}.{ending}")))
}

/// The text of a scene and where it comes from: what errors point into, and what a recording keeps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    pub(super) name: String,
    pub(super) text: String,
    pub(super) directory: PathBuf,
    /// The change: the path, and how that was written, in backquotes.
    pub(super) overrides: Vec<(KeyPath, String)>,
    /// True if a program made the text: its lines say nothing to the user, paths of keys do.
    pub(super) is_made: bool,
}

impl Source {
    /// A text under the name that messages shall show. Files that the scene names are relative to the working
    /// directory.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Source {
        let mut text: String = text.into();
        // Editors do not show a byte-order mark and do not count it in columns.
        if text.starts_with('\u{feff}') {
            text.drain(..'\u{feff}'.len_utf8());
        }
        Source { name: name.into(), text, directory: PathBuf::new(), overrides: Vec::new(), is_made: false }
    }

    /// The same text, made by a program from tables that a user wrote elsewhere: problems name the path of
    /// the key in place of line and column.
    #[must_use]
    pub fn made_from_tables(self) -> Source {
        Source { is_made: true, ..self }
    }

    /// True if problems name paths in place of lines, see [`made_from_tables`](Self::made_from_tables).
    pub fn is_made_from_tables(&self) -> bool {
        self.is_made
    }

    /// The same text, where files that the scene names are relative to `directory`.
    #[must_use]
    pub fn in_directory(self, directory: impl Into<PathBuf>) -> Source {
        Source { directory: directory.into(), ..self }
    }

    /// Reads a file. Files that the scene names are relative to its directory.
    ///
    /// # Errors
    /// The file cannot be read, is a device or a pipe, or is not UTF-8.
    pub fn from_path(path: impl AsRef<Path>) -> Result<Source, SceneError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let bytes = regular_file::read(path).map_err(|error| {
            let message = format!("cannot read {name}: {error}");
            let mut problem = Problem::new(ProblemKind::Unreadable, KeyPath::root(), message);
            if error.kind() == ErrorKind::NotFound {
                let near = near_file(path, "toml");
                problem.help.extend(near.map(|near| format!("did you mean {}?", near.display())));
            }
            SceneError::new(vec![problem])
        })?;
        if bytes.starts_with(RECORDING) {
            let message = format!("{name} is a recording, not a scene");
            let problem = Problem::new(ProblemKind::Unreadable, KeyPath::root(), message);
            let help = format!("`pliant view {name}` plays it, `pliant info {name}` says what it holds");
            return Err(SceneError::new(vec![problem.with_help(help)]));
        }
        let directory = path.parent().map(Path::to_owned).unwrap_or_default();
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Source { directory, ..Source::new(name, text) }),
            Err(error) => {
                // Every good byte before the bad one is kept, so line and column are those of an editor.
                let lossy = String::from_utf8_lossy(error.as_bytes());
                let source = Source::new(name, lossy.as_ref());
                let byte_order_mark = lossy.len() - source.text.len();
                let offset = error.utf8_error().valid_up_to().saturating_sub(byte_order_mark);
                let message = "the file is not UTF-8 text";
                let problem = Problem::new(ProblemKind::Syntax, KeyPath::root(), message);
                Err(source.error(vec![Problem { span: Some(offset..offset), ..problem }]))
            }
        }
    }

    /// The name that messages show: the path of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text, overrides included, without a byte-order mark.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The directory that files named in the scene are relative to; empty for the working directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The scene that the text describes, validated.
    ///
    /// # Errors
    /// The text is not TOML, not a scene, or not one that can be simulated; each problem with line and
    /// column.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let reading = self.read()?;
        let Some(scene) = reading.value else { return Err(self.error(reading.problems)) };
        let mut problems = reading.problems;
        if !reading.renumbered {
            // Parts that can be read all through: others may contradict themselves because something is left
            // out.
            let sound = |found: &Problem| !problems.iter().any(|told| item(&told.path) == item(&found.path));
            let found: Vec<Problem> = scene.validate().into_iter().filter(sound).collect();
            problems.extend(found);
        }
        if problems.is_empty() { Ok(scene) } else { Err(self.error(problems)) }
    }

    /// As [`scene`](Self::scene), without validation.
    #[cfg(test)]
    pub(super) fn scene_unchecked(&self) -> Result<Scene, SceneError> {
        let reading = self.read()?;
        reading.value.filter(|_| reading.problems.is_empty()).ok_or_else(|| self.error(reading.problems))
    }

    fn read(&self) -> Result<ReadDocument<Scene>, SceneError> {
        let document = document::parse(&self.text).map_err(|error| self.error(vec![syntax(&error)]))?;
        let mut reading: ReadDocument<Scene> = deserialize::read(document.get_ref());
        if let Some(scene) = &mut reading.value {
            scene.directory.clone_from(&self.directory);
        }
        Ok(reading)
    }

    /// Problems with their lines and columns in this text, from top to bottom; what `--set` brought in is
    /// marked so.
    pub fn error(&self, problems: Vec<Problem>) -> SceneError {
        let document = document::parse(&self.text).ok();
        let (omitted, problems): (Vec<Problem>, Vec<Problem>) =
            problems.into_iter().partition(|problem| matches!(problem.kind, ProblemKind::Omitted { .. }));
        let located = problems.into_iter().map(|mut problem| {
            let span = match (problem.span.clone(), &document) {
                (Some(span), _) => Some(span),
                (None, Some(document)) => {
                    let (path, inside) = (&problem.path, problem.inside.clone());
                    let span = document::locate(&self.text, document.get_ref(), path, problem.underline);
                    if self.is_made && inside.is_some() {
                        // Of a formula, what the line would have shown.
                        let value = self.text[document::clamped(&self.text, span.clone())].to_owned();
                        problem.help.insert(0, format!("the value is {value}"));
                    }
                    Some(document::inside(&self.text, span, inside))
                }
                (None, None) => None,
            };
            problem.span = span.map(|span| document::clamped(&self.text, span));
            if problem.note.is_none() {
                let causes = if problem.causes.is_empty() {
                    std::slice::from_ref(&problem.path)
                } else {
                    &problem.causes
                };
                problem.note = self.override_of(causes).map(|text| format!("from {text}"));
            }
            problem
        });
        let mut located: Vec<Problem> = located.collect();
        located.sort_by_key(|problem| problem.span.as_ref().map(|span| span.start));
        if self.is_made {
            // The path is the place, of which `render` knows.
            located.iter_mut().for_each(|problem| problem.span = None);
            located.extend(omitted);
            return SceneError::located(located, self.clone());
        }
        let mut place = document::Cursor::START;
        for problem in &mut located {
            if let Some(span) = &problem.span {
                place = place.at(&self.text, span.start);
                (problem.line, problem.column) = (Some(place.line), Some(place.column));
            }
        }
        located.extend(omitted);
        SceneError::located(located, self.clone())
    }

    /// The last override of a value at any of `paths`, of what holds it, or of a part of it.
    fn override_of(&self, paths: &[KeyPath]) -> Option<&str> {
        let of = |set: &KeyPath| {
            let mut paths = paths.iter().filter(|path| !path.segments().is_empty());
            paths.any(|path| path.starts_with(set) || set.starts_with(path))
        };
        self.overrides.iter().rev().find(|(set, _)| of(set)).map(|(_, text)| text.as_str())
    }
}

/// The part of a scene that a path lies in: `time`, or one of the bodies.
fn item(path: &KeyPath) -> &[KeySegment] {
    let segments = path.segments();
    let of_list = matches!(segments.get(1), Some(KeySegment::Index(_)));
    &segments[..segments.len().min(1 + usize::from(of_list))]
}

pub(super) fn syntax(error: &toml::de::Error) -> Problem {
    let mut problem = Problem::new(ProblemKind::Syntax, KeyPath::root(), error.message());
    // At the start if the parser does not say where: better than nowhere.
    problem.span = Some(error.span().unwrap_or(0..0));
    problem
}
