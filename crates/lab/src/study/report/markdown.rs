//! Report of a study as Markdown.

use std::fmt::Write;

use super::super::ABOUT_ERRORS;
use super::StudyReport;

pub(super) fn page(report: &StudyReport, folder: &str) -> String {
    let mut out = format!("# {}\n\n{ABOUT_ERRORS}\n\n{}.\n", text(&report.title), text(&report.machine));
    for noise in &report.noise {
        let _ = write!(out, "\n{}.\n", text(noise));
    }
    for section in &report.sections {
        let _ = write!(out, "\n## {}\n\n", text(&section.heading));
        for line in &section.about {
            let _ = writeln!(out, "{}", text(line));
        }
        for figure in &section.figures {
            let _ = write!(out, "\n![{}]({folder}{})\n", text(&figure.caption), figure.file);
        }
        out.push('\n');
        for (i, row) in section.table.iter().enumerate() {
            let cells: Vec<String> = row.iter().map(|cell| text(cell).replace('|', "\\|")).collect();
            let _ = writeln!(out, "| {} |", cells.join(" | "));
            if i == 0 {
                let _ = writeln!(out, "|---|{}---|", "--:|".repeat(row.len() - 2));
            }
        }
        if !section.words.is_empty() {
            let _ = write!(out, "\n{}.\n", capitalised(&section.words.join("; ")));
        }
        for remark in &section.remarks {
            let _ = write!(out, "\n- {}", text(remark));
        }
        if !section.remarks.is_empty() {
            out.push('\n');
        }
    }
    out += "\n## What to write into the scene\n";
    for (name, toml) in &report.recommendations {
        let _ = write!(out, "\n{}:\n```toml\n{}```\n", text(name), toml);
    }
    out
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

/// Escapes characters with a meaning in Markdown.
fn text(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, c| {
        if matches!(c, '\\' | '`' | '*' | '_' | '<' | '>' | '[' | ']') {
            out.push('\\');
        }
        out.push(if c.is_control() { ' ' } else { c });
        out
    })
}
