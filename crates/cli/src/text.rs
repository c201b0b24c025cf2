//! Numbers and paragraphs for people.

use pliant::quantity::Rounded;
pub(crate) use pliant::quantity::{count, counted};

/// Four significant digits, without trailing zeros; powers of ten where they are shorter.
pub(crate) fn number(x: f64) -> String {
    Rounded::<4>(x).to_string()
}

/// A value with the digits that its uncertainty leaves: `-3.6664` for 1e-3.
pub(crate) fn rounded_to(value: f64, uncertainty: f64) -> String {
    let decimals = 1.0 - uncertainty.abs().log10().floor();
    match value.abs() {
        size if !(decimals.is_finite() && size.is_finite()) || size == 0.0 => number(value),
        size if (1e-3..1e7).contains(&size) => format!("{value:.*}", decimals.clamp(0.0, 12.0) as usize),
        size => format!("{value:.*e}", (decimals + size.log10().floor()).clamp(0.0, 12.0) as usize),
    }
}

/// `38.5 % of`, or `4.61 times` for a ratio above 1.
pub(crate) fn compared(ratio: f64) -> String {
    if ratio > 1.0 { format!("{} times", Rounded::<3>(ratio)) } else { format!("{} of", percent(ratio)) }
}

/// `0.351 %` of a fraction of either sign.
pub(crate) fn percent(fraction: f64) -> String {
    match 100.0 * fraction {
        p if p != 0.0 && p.abs() < 1e-3 => "less than 0.001 %".into(),
        p if p.abs() >= 1e3 => "more than 1000 %".into(),
        p => format!("{} %", Rounded::<3>(p)),
    }
}

/// `3.2 MB`.
pub(crate) fn bytes(n: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB"];
    let mut value = n as f64;
    let mut unit = 0;
    while value >= 999.5 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    let decimals = if unit == 0 || value >= 99.95 { 0 } else { 1 };
    format!("{value:.decimals$} {}", units[unit])
}

/// `4.2 s`, `3 min 20 s`, `2 h 5 min`.
pub(crate) fn duration(time: std::time::Duration) -> String {
    let seconds = time.as_secs_f64();
    let whole = seconds.round() as u64;
    match seconds {
        s if s < 1.0 => format!("{:.0} ms", 1e3 * s),
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// Breaks `text` into lines of at most `width` columns, each after `indent` spaces.
pub(crate) fn wrap(text: &str, indent: usize, width: usize) -> String {
    let mut out = String::new();
    for paragraph in text.lines() {
        let mut column = 0;
        for word in paragraph.split_whitespace() {
            let length = word.chars().count();
            if column > 0 && column + 1 + length > width {
                out.push('\n');
                column = 0;
            }
            if column == 0 {
                out.push_str(&" ".repeat(indent));
                column = indent;
            } else {
                out.push(' ');
                column += 1;
            }
            out.push_str(word);
            column += length;
        }
        out.push('\n');
    }
    out
}

/// `name  text`, the text wrapped beside a first column of `column` characters.
pub(crate) fn entry(name: &str, text: &str, indent: usize, column: usize, width: usize) -> String {
    let wrapped = wrap(text, indent + column, width);
    let head = format!("{}{name:<column$}", " ".repeat(indent));
    match wrapped.get(indent + column..) {
        // A name too long for its column stands on a line of its own.
        Some(rest) if name.chars().count() < column => head + rest,
        _ => format!("{}\n{wrapped}", head.trim_end()),
    }
}

/// Rows under a header, columns aligned: the first to the left, the others to the right.
pub(crate) fn table(rows: &[Vec<String>], indent: usize) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| {
        rows.iter().filter_map(|row| row.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut out = String::new();
    for row in rows {
        let mut line = " ".repeat(indent);
        for (c, cell) in row.iter().enumerate() {
            let padding = " ".repeat(widths[c] - cell.chars().count());
            match c {
                0 => line += &format!("{cell}{padding}"),
                _ => line += &format!("  {padding}{cell}"),
            }
        }
        out += line.trim_end();
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let cases = [
            (0.0, "0"),
            (1.67e-4, "1.67e-4"),
            (0.001, "0.001"),
            (9999.96, "10000"),
            (-12.34567, "-12.35"),
            (3e6, "3e6"),
            (1.0 / 3.0, "0.3333"),
        ];
        for (x, text) in cases {
            assert_eq!(number(x), text);
        }
        assert_eq!((count(0), count(999), count(1_234_567)), ("0".into(), "999".into(), "1,234,567".into()));
        assert_eq!(
            (bytes(999), bytes(1_000), bytes(1_234_567)),
            ("999 B".into(), "1.0 kB".into(), "1.2 MB".into())
        );
    }

    #[test]
    fn values_have_the_digits_that_their_uncertainty_leaves() {
        let cases = [
            (-3.66639, 1.3e-3, "-3.6664"),
            (36_363.4, 27.0, "36363"),
            (1.906_666_7e-4, 3e-9, "1.906667e-4"),
            (0.0, 1e-3, "0"),
            (2.5, 0.0, "2.5"),
        ];
        for (value, uncertainty, text) in cases {
            assert_eq!(rounded_to(value, uncertainty), text);
        }
    }

    #[test]
    fn fractions_are_percents_without_powers_of_ten() {
        assert_eq!(
            [0.385_15, -0.003_514, 1e-6, 0.0].map(percent),
            ["38.5 %", "-0.351 %", "less than 0.001 %", "0 %"]
        );
        assert_eq!([-1e3, f64::INFINITY].map(percent), ["more than 1000 %"; 2]);
        assert_eq!([1.0, 0.385, 4.606].map(compared), ["100 % of", "38.5 % of", "4.61 times"]);
    }

    #[test]
    fn durations_change_units() {
        let of = |s| duration(std::time::Duration::from_secs_f64(s));
        assert_eq!(
            [of(0.25), of(4.21), of(200.0), of(7500.0)],
            ["250 ms", "4.2 s", "3 min 20 s", "2 h 5 min"]
        );
    }

    #[test]
    fn wraps_at_words() {
        assert_eq!(wrap("one two three", 2, 9), "  one two\n  three\n");
        assert_eq!(entry("name", "one two three", 2, 6, 15), "  name  one two\n        three\n");
        assert_eq!(entry("long name", "text", 0, 4, 20), "long name\n    text\n");
        // A word longer than the line is not cut.
        assert_eq!(wrap("a incomprehensibilities b", 0, 5), "a\nincomprehensibilities\nb\n");
    }
}
