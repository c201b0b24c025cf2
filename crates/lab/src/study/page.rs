//! Self-contained HTML pages: paragraphs, tables that scroll on narrow screens, charts.

use std::fmt::Write;

const STYLE: &str = ":root{color-scheme:light \
dark;--ink:#1a1a1a;--page:#fff;--quiet:#555;--rule:#ddd;--strong:#999;--box:#f4f4f4;\
--good:#00734f;--fair:#8a5a00;--bad:#b3261e}\
@media(prefers-color-scheme:dark){:root{--ink:#e8e8e8;--page:#16181b;--quiet:#b0b4ba;--rule:#3a3e44;\
--strong:#777d86;--box:#24272c;--good:#5fd3a6;--fair:#e6b450;--bad:#ff8a80}\
svg{filter:invert(.91) hue-rotate(180deg)}}\
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:0 \
auto;padding:1rem;color:var(--ink);background:var(--page);overflow-wrap:anywhere}\
h1{font-size:1.6rem;line-height:1.25}h2{font-size:1.25rem;margin-top:2.5rem}\
.scroll{overflow-x:auto;margin:1rem 0}\
table{border-collapse:collapse;font-size:.875rem;font-variant-numeric:tabular-nums;overflow-wrap:normal}\
th,td{padding:.25rem .6rem;text-align:right;vertical-align:top;white-space:nowrap;border-bottom:1px solid \
var(--rule)}\
th{border-bottom:2px solid var(--strong)}th:first-child,td:first-child,.text{text-align:left}\
td:first-child,th:first-child{position:sticky;left:0;background:var(--page)}\
tr:hover td{background:var(--box)}\
.long{white-space:normal;min-width:18rem;max-width:34rem;text-align:left;color:var(--quiet)}\
.good{color:var(--good)}.fair{color:var(--fair)}.bad{color:var(--bad);font-weight:600}\
figure{margin:1.5rem 0}figure svg{display:block;max-width:100%;min-width:40rem;height:auto}\
svg polyline{pointer-events:stroke}svg:has(polyline:hover) polyline:not(:hover){opacity:.15}\
svg polyline:hover{stroke-width:4}\
figcaption,.note{color:var(--quiet);font-size:.875rem}\
pre{background:var(--box);padding:.75rem 1rem;overflow-x:auto;font-size:.875rem;overflow-wrap:normal}\
button{font:inherit;font-size:.875rem;color:var(--ink);background:var(--box);border:1px solid \
var(--strong);border-radius:.3rem;padding:.15rem .6rem;cursor:pointer}";

/// Puts what stands after its button on the clipboard.
const COPY: &str = "const copy=b=>navigator.clipboard.writeText(b.nextElementSibling.textContent)\
.then(()=>{b.textContent='copied'})";

/// Style of a table cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Look {
    /// A number, or a word among numbers.
    #[default]
    Number,
    /// A name.
    Text,
    /// Sentences, with line breaks.
    Long,
    /// A good result.
    Good,
    /// A result that needs attention.
    Fair,
    /// A bad result.
    Bad,
}

impl Look {
    fn class(self) -> &'static str {
        match self {
            Look::Number => "",
            Look::Text => " class=\"text\"",
            Look::Long => " class=\"long\"",
            Look::Good => " class=\"text good\"",
            Look::Fair => " class=\"text fair\"",
            Look::Bad => " class=\"text bad\"",
        }
    }
}

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TableCell {
    html: String,
    look: Look,
}

impl TableCell {
    /// A text.
    pub fn new(text: &str, look: Look) -> TableCell {
        TableCell { html: escaped(text), look }
    }

    /// A cell with a picture, an SVG of this program.
    pub fn picture(svg: String) -> TableCell {
        TableCell { html: svg, look: Look::Number }
    }
}

/// A page under construction, written from top to bottom.
#[derive(Clone, Debug)]
pub struct Page {
    html: String,
}

impl Page {
    /// A page with this title only.
    pub fn new(title: &str) -> Page {
        let title = escaped(title);
        let html = format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>{title}</title>\
             <style>{STYLE}</style><script>{COPY}</script></head><body>\n<h1>{title}</h1>\n"
        );
        Page { html }
    }

    fn line(&mut self, html: &str) {
        self.html += html;
        self.html.push('\n');
    }

    /// Adds a section heading.
    pub fn heading(&mut self, text: &str) {
        self.line(&format!("<h2>{}</h2>", escaped(text)));
    }

    /// Adds a paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.line(&format!("<p>{}</p>", escaped(text)));
    }

    /// Adds a note on the content above.
    pub fn note(&mut self, text: &str) {
        self.line(&format!("<p class=\"note\">{}</p>", escaped(text)));
    }

    /// Adds a table with its header; a cell has its column's style unless it has its own.
    pub fn table(&mut self, header: &[(&str, Look)], rows: &[Vec<TableCell>]) {
        let mut html = String::from("<div class=\"scroll\"><table>\n<tr>");
        for (name, look) in header {
            let _ = write!(html, "<th{}>{}</th>", look.class(), escaped(name));
        }
        html += "</tr>\n";
        for row in rows {
            html += "<tr>";
            for (i, cell) in row.iter().enumerate() {
                let of_column = header.get(i).map_or(Look::Number, |(_, look)| *look);
                let look = if cell.look == Look::Number { of_column } else { cell.look };
                let _ = write!(html, "<td{}>{}</td>", look.class(), cell.html);
            }
            html += "</tr>\n";
        }
        self.line(&(html + "</table></div>"));
    }

    /// Adds a chart, an SVG of this program, with its caption.
    pub fn figure(&mut self, svg: &str, caption: &str) {
        let caption = if caption.is_empty() {
            String::new()
        } else {
            format!("<figcaption>{}</figcaption>", escaped(caption))
        };
        self.line(&format!("<figure><div class=\"scroll\">{svg}</div>{caption}</figure>"));
    }

    /// Adds a list; no items add nothing.
    pub fn list<'a>(&mut self, items: impl IntoIterator<Item = &'a str>) {
        let items: String = items.into_iter().map(|item| format!("<li>{}</li>", escaped(item))).collect();
        if !items.is_empty() {
            self.line(&format!("<ul>{items}</ul>"));
        }
    }

    /// Adds preformatted text, with a button that copies it.
    pub fn preformatted(&mut self, text: &str) {
        let button = "<button type=\"button\" onclick=\"copy(this)\">copy</button>";
        self.line(&format!("{button}<pre>{}</pre>", escaped(text)));
    }

    /// Finishes the page.
    pub fn finish(self) -> String {
        self.html + "</body></html>\n"
    }
}

/// Escapes a text for HTML.
pub fn escaped(text: &str) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_fit_narrow_screens_and_hold_texts_as_they_are() {
        let mut page = Page::new("a < b & \"c\"");
        page.table(
            &[("name", Look::Text), ("n", Look::Number)],
            &[vec![TableCell::new("<script>", Look::Number), TableCell::new("x", Look::Bad)]],
        );
        page.figure("<svg></svg>", "1 > 0");
        page.list([]);
        let html = page.finish();
        assert!(html.contains("name=\"viewport\" content=\"width=device-width"), "phones ask for it");
        assert!(
            html.contains("<td class=\"text\">&lt;script&gt;</td><td class=\"text bad\">x</td>"),
            "{html}"
        );
        assert!(html.contains("<figcaption>1 &gt; 0</figcaption>") && !html.contains("<ul>"), "{html}");
        assert!(html.matches("<div class=\"scroll\">").count() == 2, "what is wide scrolls by itself");
        let markup = html.split_once("<body>").unwrap().1.replace("</body></html>", "");
        roxmltree::Document::parse(&format!("<body>{markup}</body>")).unwrap();
    }
}
