//! Texts of others, titles and names of files, as a terminal may show them.

use std::borrow::Cow;

/// First byte of a command to a terminal.
const ESCAPE: char = '\u{1b}';

/// `text` with each character that a terminal would obey in place of showing it as an escape, `\u{1b}`:
/// control characters but for the ends of lines and tabs, and those that change the direction of what
/// follows.
pub(crate) fn plain(text: &str) -> Cow<'_, str> {
    escaped(text, |c| format!("\\u{{{:x}}}", u32::from(c)))
}

/// The same of a JSON document, with the escapes of JSON.
pub(crate) fn json(document: &str) -> Cow<'_, str> {
    escaped(document, |c| format!("\\u{:04x}", u32::from(c)))
}

/// As [`plain`], where parts of the text were coloured by the program: colours stay.
pub(crate) fn styled(text: &str) -> String {
    let mut parts = text.split(ESCAPE);
    let mut out = plain(parts.next().unwrap_or_default()).into_owned();
    for part in parts {
        let (colour, rest) = part.split_at(colour_length(part));
        out += if colour.is_empty() { "\\u{1b}" } else { "\u{1b}" };
        out += colour;
        out += &plain(rest);
    }
    out
}

/// Length of `[1;91m`, with which a text begins after an escape; 0 where it does not.
fn colour_length(text: &str) -> usize {
    let Some(numbers) = text.strip_prefix('[') else { return 0 };
    let rest = numbers.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';');
    if rest.starts_with('m') { text.len() - rest.len() + 1 } else { 0 }
}

fn escaped(text: &str, escape: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| if is_obeyed(c) { escape(c) } else { c.to_string() };
    Cow::Owned(text.chars().map(shown).collect())
}

/// True if a terminal does something at this character other than showing it.
fn is_obeyed(c: char) -> bool {
    let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || c.is_control() && c != '\n' && c != '\t'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_shown() {
        let hostile = "a\u{1b}]0;title\u{7}b\u{9b}31m\rc\u{202e}d\n\te\u{e9}";
        let shown = "a\\u{1b}]0;title\\u{7}b\\u{9b}31m\\u{d}c\\u{202e}d\n\te\u{e9}";
        assert_eq!(plain(hostile), shown);
        assert_eq!(styled(hostile), shown);
        assert!(matches!(plain("m\u{b2} \u{b5}"), Cow::Borrowed(_)));
    }

    #[test]
    fn colours_of_the_program_stay() {
        let text = "\u{1b}[1;91merror\u{1b}[0m: x \u{1b}[2J \u{1b}[1";
        assert_eq!(styled(text), "\u{1b}[1;91merror\u{1b}[0m: x \\u{1b}[2J \\u{1b}[1");
    }

    #[test]
    fn documents_stay_json() {
        let document = serde_json::json!({ "title": "\u{9b}31m\u{1b}[2J\u{7f}\u{202e}" });
        let printed = json(&document.to_string()).into_owned();
        assert!(printed.is_ascii(), "{printed}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&printed).unwrap(), document);
    }
}
