//! HTML.

use std::fmt::Write;

use super::Report;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:960px;margin:2em auto;padding:0 1em;color:#111;\
    background:#fff}svg{max-width:100%;height:auto}figure{margin:1.5em 0}figcaption{color:#555;font-size:13px}\
    table{border-collapse:collapse;margin:1em 0}th,td{padding:2px 10px;text-align:right;border-bottom:1px solid #ddd}\
    th:first-child,td:first-child,th:last-child,td:last-child{text-align:left}pre{background:#f4f4f4;padding:1em;overflow:auto}";

pub(super) fn page(report: &Report) -> String {
    let title = escaped(&report.title);
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n<p>{}</p>\n",
        escaped(&report.machine)
    );
    for section in &report.sections {
        let _ = writeln!(
            out,
            "<h2>{}</h2>\n<p>{}</p>",
            escaped(&section.heading),
            escaped(&section.about.join(" "))
        );
        for figure in &section.figures {
            // The chart is our own text, its labels escaped by who drew it.
            let caption = escaped(&figure.caption);
            let _ = writeln!(out, "<figure>{}<figcaption>{caption}</figcaption></figure>", figure.svg);
        }
        out += "<table>\n";
        for (i, row) in section.table.iter().enumerate() {
            let tag = if i == 0 { "th" } else { "td" };
            let cells: String = row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect();
            let _ = writeln!(out, "<tr>{cells}</tr>");
        }
        out += "</table>\n";
        for list in [&section.words, &section.remarks].into_iter().filter(|list| !list.is_empty()) {
            let items: String = list.iter().map(|item| format!("<li>{}</li>", escaped(item))).collect();
            let _ = writeln!(out, "<ul>{items}</ul>");
        }
    }
    out += "<h2>What to write into the scene</h2>\n";
    for (name, toml) in &report.recommendations {
        let _ = writeln!(out, "<p>{}</p><pre>{}</pre>", escaped(name), escaped(toml));
    }
    out + "</body></html>\n"
}

fn escaped(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut out, c| {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
        out
    })
}
