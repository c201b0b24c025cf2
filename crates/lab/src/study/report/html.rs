//! Report of a study as HTML.

use super::super::ABOUT_ERRORS;
use super::super::page::{Look, Page, TableCell};
use super::StudyReport;

pub(super) fn page(report: &StudyReport) -> String {
    let mut page = Page::new(&report.title);
    page.paragraph(ABOUT_ERRORS);
    page.paragraph(&report.machine);
    page.list(report.noise.iter().map(String::as_str));
    for section in &report.sections {
        page.heading(&section.heading);
        page.paragraph(&section.about.join(" "));
        for figure in &section.figures {
            page.figure(&figure.svg, &figure.caption);
        }
        if let Some((header, rows)) = section.table.split_first() {
            let last = header.len() - 1;
            let look = |i: usize| if i == 0 || i == last { Look::Text } else { Look::Number };
            let header: Vec<(&str, Look)> =
                header.iter().enumerate().map(|(i, name)| (name.as_str(), look(i))).collect();
            let cells =
                |row: &[String; 7]| row.iter().map(|cell| TableCell::new(cell, Look::Number)).collect();
            page.table(&header, &rows.iter().map(cells).collect::<Vec<_>>());
        }
        for list in [&section.words, &section.remarks] {
            page.list(list.iter().map(String::as_str));
        }
    }
    page.heading("What to write into the scene");
    for (name, toml) in &report.recommendations {
        page.paragraph(name);
        page.preformatted(toml);
    }
    page.finish()
}
