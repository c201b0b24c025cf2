//! Journal of finished rows, so that an interrupted study continues where it ended.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;

use super::Record;

#[derive(serde::Serialize, serde::Deserialize)]
struct JournalEntry {
    key: String,
    record: Record,
}

/// Finished rows by their keys; kept in memory only without a folder.
#[derive(Default)]
pub(super) struct StudyJournal {
    kept: HashMap<String, Record>,
    file: Option<File>,
}

impl StudyJournal {
    /// Opens the journal of a folder. An incomplete last line, left by a killed study, is skipped.
    pub(super) fn open(folder: Option<&Path>) -> std::io::Result<StudyJournal> {
        let Some(folder) = folder else { return Ok(StudyJournal::default()) };
        let path = folder.join("journal.jsonl");
        let mut kept = HashMap::new();
        let mut complete = true;
        if path.exists() {
            for line in BufReader::new(File::open(&path)?).lines() {
                let line = line?;
                complete = false;
                if let Ok(JournalEntry { key, record }) = serde_json::from_str(&line) {
                    kept.insert(key, record);
                    complete = true;
                }
            }
        }
        let mut file = OpenOptions::new().create(true).append(true).open(&path)?;
        if !complete {
            writeln!(file)?;
        }
        Ok(StudyJournal { kept, file: Some(file) })
    }

    /// Row of this key, if it is known.
    pub(super) fn find(&self, key: &str) -> Option<&Record> {
        self.kept.get(key)
    }

    /// Adds a row to the journal.
    pub(super) fn keep(&mut self, key: String, record: &Record) -> std::io::Result<()> {
        if let Some(file) = &mut self.file {
            let mut line = serde_json::to_string(&JournalEntry { key: key.clone(), record: record.clone() })?;
            line.push('\n');
            file.write_all(line.as_bytes())?;
            file.flush()?;
        }
        self.kept.insert(key, record.clone());
        Ok(())
    }
}
