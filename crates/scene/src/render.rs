//! Problems as a compiler shows them.

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet, normalize_untrusted_str};

use super::error::Problem;
use super::source::Source;

/// More problems than this are counted, not shown: the first ones explain the rest.
const SHOWN: usize = 50;

/// Fixed, so that the same error has the same text everywhere.
const WIDTH: usize = 140;

pub(super) fn render(problems: &[Problem], source: Option<&Source>, color: bool) -> String {
    let renderer = if color { Renderer::styled() } else { Renderer::plain() }.term_width(WIDTH);
    let mut reports: Vec<String> =
        problems.iter().take(SHOWN).map(|problem| one(&renderer, problem, source)).collect();
    if problems.len() > SHOWN {
        reports.push(format!("... and {} more errors", problems.len() - SHOWN));
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
        // The underline may end after the carriage return of a Windows text, which itself would be drawn.
        let lines = text[start..end].trim_end_matches('\r');
        let (from, to) = (span.start - start, span.end - start);
        group = group.element(
            Snippet::source(lines)
                .line_start(line)
                .path(normalize_untrusted_str(source.name()))
                .annotation(AnnotationKind::Primary.span(from.min(lines.len())..to.min(lines.len()))),
        );
    }
    for help in &problem.help {
        group = group.element(Level::HELP.message(normalize_untrusted_str(help)));
    }
    if let Some(note) = &problem.note {
        group = group.element(Level::NOTE.message(normalize_untrusted_str(note)));
    }
    renderer.render(&[group])
}
