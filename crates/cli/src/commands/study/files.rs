//! The files of a study.

use std::path::{Path, PathBuf};

use pliant_files::durable_file;
use pliant_lab::study::report::StudyReport;
use pliant_lab::study::{Results, csv};
use serde_json::Value;

use crate::arguments::StudyArguments;
use crate::failure::Failure;

/// Where they go.
pub(super) struct Files {
    folder: PathBuf,
    markdown: Option<PathBuf>,
}

impl Files {
    /// Makes the folder; with `--fresh` what an earlier study kept there is forgotten.
    pub(super) fn new(arguments: &StudyArguments) -> Result<Files, Failure> {
        let folder = arguments.output.clone().unwrap_or_else(|| {
            let first = arguments.scenes.first().and_then(|scene| scene.file_stem());
            let name = first.map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned());
            PathBuf::from(format!("{name}-study"))
        });
        std::fs::create_dir_all(&folder).map_err(|error| {
            Failure::failed("output", format!("cannot make {}: {error}", folder.display()))
        })?;
        let files = Files { folder, markdown: arguments.markdown.clone() };
        if arguments.fresh {
            files.forget()?;
        }
        Ok(files)
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    fn forget(&self) -> Result<(), Failure> {
        let entries = std::fs::read_dir(&self.folder).map_err(|error| failed(&self.folder, &error))?;
        for entry in entries.flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if name == "journal.jsonl" || name.starts_with("reference-") && name.ends_with(".json") {
                std::fs::remove_file(entry.path()).map_err(|error| failed(&entry.path(), &error))?;
            }
        }
        Ok(())
    }

    /// Writes tables, charts and reports; says where they are.
    pub(super) fn write(
        &self,
        report: &StudyReport,
        studies: &[Results],
        document: &Value,
    ) -> Result<String, Failure> {
        let in_folder = |name: &str| self.folder.join(name);
        let rows = csv(studies.iter().flat_map(Results::rows));
        put(&in_folder("rows.csv"), &rows)?;
        put(&in_folder("study.json"), &format!("{document:#}\n"))?;
        put(&in_folder("report.html"), &report.html())?;
        for (name, svg) in report.charts() {
            put(&in_folder(name), svg)?;
        }
        let markdown = self.markdown.clone().unwrap_or_else(|| in_folder("report.md"));
        put(&markdown, &report.markdown(&self.prefix(&markdown)))?;
        Ok(format!(
            "{}  the report, one page\n{}  the report in Markdown, with charts\n{}  the rows as a table\n",
            in_folder("report.html").display(),
            markdown.display(),
            in_folder("rows.csv").display()
        ))
    }

    /// Writes one file of a report; its path.
    pub(super) fn put(&self, name: &str, text: &str) -> Result<PathBuf, Failure> {
        let path = self.folder.join(name);
        put(&path, text)?;
        Ok(path)
    }

    /// How a page at `markdown` reaches the charts.
    fn prefix(&self, markdown: &Path) -> String {
        let from = markdown.parent().unwrap_or(Path::new(""));
        match self.folder.strip_prefix(from) {
            Ok(rest) if rest.as_os_str().is_empty() => String::new(),
            Ok(rest) => format!("{}/", rest.display()),
            Err(_) => format!("{}/", self.folder.display()),
        }
    }
}

fn put(path: &Path, text: &str) -> Result<(), Failure> {
    // Whole or not at all: a report may be open in a browser.
    durable_file::replace(path, text.as_bytes()).map_err(|error| failed(path, &error))
}

fn failed(path: &Path, error: &std::io::Error) -> Failure {
    Failure::failed("output", format!("cannot write {}: {error}", path.display()))
}
