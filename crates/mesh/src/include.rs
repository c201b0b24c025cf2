//! Files that an Abaqus deck includes: their text is inserted, and every line keeps its position in its file.
//!
//! `*INCLUDE, INPUT=file` inserts the text of a file; `INPUT=file` at `*NODE`, `*ELEMENT` and sets
//! inserts data lines. A deck may come from an untrusted source: its files must be in its folder or
//! below, each is read once, and nesting is at most five deep, as in Abaqus.

use std::path::{Component, Path, PathBuf};

use super::abaqus::{Keyword, parse_keyword};
use super::{FormatError, MeshError};

/// Maximum depth of nested files.
const DEEPEST: usize = 5;

/// A stretch of the joined text, from line `first` on, that comes from a file, from its line `line` on.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    pub(super) first: u32,
    pub(super) path: PathBuf,
    pub(super) line: u32,
}

/// A deck joined with its included files.
#[derive(Debug)]
pub(super) struct JoinedDeck {
    pub(super) text: Vec<u8>,
    /// Stretches in the order of the text; at least one.
    pub(super) stretches: Vec<Stretch>,
    lines: u32,
    in_step: bool,
}

/// Inserts the files that a deck includes; `read` returns the content of a file.
///
/// # Errors
/// A file cannot be read or must not be included; the error names the file and line of the keyword.
pub(super) fn join(
    path: &Path,
    read: &dyn Fn(&Path) -> Result<Vec<u8>, MeshError>,
) -> Result<JoinedDeck, MeshError> {
    let mut deck = JoinedDeck { text: Vec::new(), stretches: Vec::new(), lines: 0, in_step: false };
    deck.append(path, path.parent().unwrap_or(Path::new("")), 0, read)?;
    Ok(deck)
}

impl JoinedDeck {
    /// All files, the deck first.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = Vec::new();
        for stretch in &self.stretches {
            if !files.contains(&stretch.path) {
                files.push(stretch.path.clone());
            }
        }
        files
    }

    fn append(
        &mut self,
        path: &Path,
        folder: &Path,
        depth: usize,
        read: &dyn Fn(&Path) -> Result<Vec<u8>, MeshError>,
    ) -> Result<(), MeshError> {
        let bytes = read(path)?;
        self.stretch(path, 1);
        let (mut pending, mut held) = (String::new(), Vec::new());
        for (line, bytes) in (1..).zip(bytes.strip_suffix(b"\n").unwrap_or(&bytes).split(|b| *b == b'\n')) {
            held.push(bytes);
            let text = String::from_utf8_lossy(bytes);
            let text = text.trim();
            let is_comment = text.is_empty() || text.starts_with("**");
            // Comments and lines of a keyword are held back until the keyword is complete.
            if !is_comment && (text.starts_with('*') || !pending.is_empty()) {
                pending.push_str(text);
            }
            if pending.is_empty() {
                held.drain(..).for_each(|text| self.push(text));
                continue;
            }
            // A keyword line that ends with a comma continues on the next line.
            if is_comment || text.ends_with(',') {
                continue;
            }
            let keyword = parse_keyword(&std::mem::take(&mut pending), line);
            self.in_step |= keyword.name == "STEP";
            let named = keyword.get("INPUT").filter(|_| !self.in_step && has_file(&keyword));
            for text in held.drain(..) {
                self.push(if named.is_some() && keyword.name == "INCLUDE" { b"**" } else { text });
            }
            // The included file follows its keyword line.
            if let Some(named) = named {
                let beneath = self.resolve(named, folder, depth);
                let appended = beneath.and_then(|file| self.append(&file, folder, depth + 1, read));
                appended.map_err(|error| in_line(path, line, error))?;
                self.stretch(path, line.saturating_add(1));
            }
        }
        held.into_iter().for_each(|text| self.push(text));
        Ok(())
    }

    fn push(&mut self, line: &[u8]) {
        self.text.extend_from_slice(line);
        self.text.push(b'\n');
        self.lines = self.lines.saturating_add(1);
    }

    fn stretch(&mut self, path: &Path, line: u32) {
        self.stretches.push(Stretch { first: self.lines.saturating_add(1), path: path.to_owned(), line });
    }

    /// Path of an included file, if it may be read.
    fn resolve(&self, named: &str, folder: &Path, depth: usize) -> Result<PathBuf, MeshError> {
        let unsupported =
            |found: String, supported| Err(MeshError::from(FormatError::Unsupported { found, supported }));
        let relative = PathBuf::from(named.replace('\\', "/"));
        let stays = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
        if !relative.components().all(stays) {
            let found = format!("the file `{named}`, which is not in the folder of the deck,");
            return unsupported(found, "copy it there and name it without its folders");
        }
        if depth == DEEPEST {
            let found = format!("the file `{named}`, {} files deep,", DEEPEST + 1);
            return unsupported(found, "files are read up to five deep; join some of them");
        }
        let path = folder.join(relative);
        if self.stretches.iter().any(|stretch| stretch.path == path) {
            return unsupported(format!("the file `{named}` a second time"), "name each file once");
        }
        Ok(path)
    }
}

/// True if the data of this keyword may be in a separate file.
fn has_file(keyword: &Keyword<'_>) -> bool {
    matches!(keyword.name.as_str(), "INCLUDE" | "NODE" | "ELEMENT" | "NSET" | "ELSET")
}

fn in_line(path: &Path, line: u32, error: MeshError) -> MeshError {
    match error {
        error @ MeshError::InFile { .. } => error,
        error => MeshError::InFile {
            path: path.to_owned(),
            line: Some(line),
            tag: None,
            cures: Vec::new(),
            source: Box::new(error),
        },
    }
}
