//! Problems as a compiler shows them.

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet, normalize_untrusted_str};

use super::document::clamped;
use super::error::{Problem, ProblemKind};
use super::source::Source;

/// More problems than this are counted, not shown: the first ones explain the rest.
const SHOWN: usize = 50;

/// Fixed, so that the same error has the same text everywhere.
const WIDTH: usize = 140;

/// Bytes of a line that are looked at on either side of a place: far more than are shown.
const AROUND: usize = 1000;

pub(super) fn render(problems: &[Problem], source: Option<&Source>, color: bool) -> String {
    let renderer = if color { Renderer::styled() } else { Renderer::plain() }.term_width(WIDTH);
    let (mut reports, mut more) = (vec![], 0);
    for problem in problems {
        match problem.kind {
            ProblemKind::Omitted { count } => more += count,
            _ if reports.len() < SHOWN => reports.push(one(&renderer, problem, source)),
            _ => more += 1,
        }
    }
    if more > 0 {
        reports.push(format!("... and {more} more errors"));
    }
    reports.join("\n\n")
}

fn one(renderer: &Renderer, problem: &Problem, source: Option<&Source>) -> String {
    // Without a text the path is the only place.
    let snippet = source.zip(problem.span.clone()).zip(problem.line);
    let title = match snippet {
        None if !problem.path.segments().is_empty() => format!("{}: {}", problem.path, problem.message),
        _ => problem.message.clone(),
    };
    let mut group = Group::with_title(Level::ERROR.primary_title(title));
    if let Some(((source, span), line)) = snippet {
        // Only the lines concerned: a scene with an inline mesh can be very long.
        let text = source.text();
        let start = text[..span.start].rfind('\n').map_or(0, |newline| newline + 1);
        let end = text[span.end..].find('\n').map_or(text.len(), |newline| span.end + newline);
        // Of a line that is very long, too, what is around the place.
        let near = clamped(text, span.start.saturating_sub(AROUND)..span.start.saturating_add(AROUND));
        let name = normalize_untrusted_str(source.name());
        let whole = near.start <= start && end <= near.end;
        let (start, end) = (start.max(near.start), end.min(near.end));
        // The underline may end after the carriage return of a Windows text, which itself would be drawn.
        let lines = text[start..end].trim_end_matches('\r');
        let (from, to) = (span.start - start, span.end - start);
        let mut snippet = Snippet::source(lines)
            .line_start(line)
            .annotation(AnnotationKind::Primary.span(from.min(lines.len())..to.min(lines.len())));
        if whole {
            snippet = snippet.path(name);
        } else {
            // Its column is not that in the part.
            group = group.element(Origin::path(name).line(line).char_column(problem.column.unwrap_or(1)));
        }
        group = group.element(snippet);
    }
    for help in &problem.help {
        group = group.element(Level::HELP.message(normalize_untrusted_str(help)));
    }
    if let Some(note) = &problem.note {
        group = group.element(Level::NOTE.message(normalize_untrusted_str(note)));
    }
    renderer.render(&[group])
}
