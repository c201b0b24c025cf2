//! Table of units.
//!
//! Source of the exact values: NIST Special Publication 811 (2008), appendix B.8 (inch, foot, pound,
//! pound-force, kilogram-force, atmosphere).

use std::f64::consts::PI;

use super::Dimension;

/// A unit without prefix: `numerator / denominator * 10^exponent` of the SI unit of its dimension.
pub(super) struct Unit {
    pub(super) symbol: &'static str,
    /// Names written out, for which the symbol is suggested.
    names: &'static [&'static str],
    prefixes: bool,
    pub(super) scale: Scale,
    pub(super) dimension: Dimension,
}

/// Factor of a unit. The power of ten is separate, so that it can move the decimal point of a number
/// exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub(super) numerator: f64,
    pub(super) denominator: f64,
    pub(super) exponent: i32,
}

impl Scale {
    pub(super) const ONE: Scale = Scale::new(1.0, 1.0, 0);

    const fn new(numerator: f64, denominator: f64, exponent: i32) -> Self {
        Scale { numerator, denominator, exponent }
    }

    pub(super) fn times(self, other: Scale) -> Scale {
        Scale {
            numerator: self.numerator * other.numerator,
            denominator: self.denominator * other.denominator,
            exponent: self.exponent.saturating_add(other.exponent),
        }
    }

    pub(super) fn power(self, power: i32) -> Scale {
        let size = power.unsigned_abs();
        let raised = |base: f64| (0..size).fold(1.0, |product, _| product * base);
        let (numerator, denominator) = (raised(self.numerator), raised(self.denominator));
        let exponent = self.exponent.saturating_mul(power);
        if power < 0 {
            Scale { numerator: denominator, denominator: numerator, exponent }
        } else {
            Scale { numerator, denominator, exponent }
        }
    }
}

const fn unit(
    symbol: &'static str,
    names: &'static [&'static str],
    prefixes: bool,
    scale: (f64, f64, i32),
    dimension: [i32; 4],
) -> Unit {
    let [length, mass, time, angle] = dimension;
    Unit {
        symbol,
        names,
        prefixes,
        scale: Scale::new(scale.0, scale.1, scale.2),
        dimension: Dimension::new(length, mass, time, angle),
    }
}

const LENGTH: [i32; 4] = [1, 0, 0, 0];
const VOLUME: [i32; 4] = [3, 0, 0, 0];
const MASS: [i32; 4] = [0, 1, 0, 0];
const TIME: [i32; 4] = [0, 0, 1, 0];
const ANGLE: [i32; 4] = [0, 0, 0, 1];
const FORCE: [i32; 4] = [1, 1, -2, 0];
const PRESSURE: [i32; 4] = [-1, 1, -2, 0];

/// Pound-force: 0.45359237 kg times 9.80665 m/s^2.
const POUND_FORCE: (f64, f64, i32) = (44_482_216_152_605.0, 1.0, -13);

pub(super) const UNITS: &[Unit] = &[
    unit("m", &["meter", "meters", "metre", "metres"], true, (1.0, 1.0, 0), LENGTH),
    unit("in", &["inch", "inches"], false, (254.0, 1.0, -4), LENGTH),
    unit("ft", &["foot", "feet"], false, (3048.0, 1.0, -4), LENGTH),
    unit("l", &["liter", "liters", "litre", "litres"], true, (1.0, 1.0, -3), VOLUME),
    unit("L", &[], true, (1.0, 1.0, -3), VOLUME),
    unit("g", &["gram", "grams", "gramme"], true, (1.0, 1.0, -3), MASS),
    unit("t", &["ton", "tons", "tonne", "tonnes"], false, (1.0, 1.0, 3), MASS),
    unit("lb", &["lbs", "pound", "pounds"], false, (45_359_237.0, 1.0, -8), MASS),
    unit("s", &["sec", "second", "seconds"], true, (1.0, 1.0, 0), TIME),
    unit("min", &["minute", "minutes"], false, (60.0, 1.0, 0), TIME),
    unit("h", &["hr", "hour", "hours"], false, (3600.0, 1.0, 0), TIME),
    unit("d", &["day", "days"], false, (86_400.0, 1.0, 0), TIME),
    unit("Hz", &["hertz"], true, (1.0, 1.0, 0), [0, 0, -1, 0]),
    unit("rad", &["radian", "radians"], true, (1.0, 1.0, 0), ANGLE),
    unit("deg", &["degree", "degrees"], false, (PI, 180.0, 0), ANGLE),
    unit("°", &[], false, (PI, 180.0, 0), ANGLE),
    unit("rev", &["revolution", "revolutions", "turn", "turns"], false, (2.0 * PI, 1.0, 0), ANGLE),
    unit("rpm", &[], false, (PI, 30.0, 0), [0, 0, -1, 1]),
    unit("N", &["newton", "newtons"], true, (1.0, 1.0, 0), FORCE),
    unit("kgf", &["kilopond", "kp"], false, (980_665.0, 1.0, -5), FORCE),
    unit("lbf", &[], false, POUND_FORCE, FORCE),
    unit("Pa", &["pascal", "pascals"], true, (1.0, 1.0, 0), PRESSURE),
    unit("bar", &["bars"], true, (1.0, 1.0, 5), PRESSURE),
    unit("atm", &["atmosphere", "atmospheres"], false, (101_325.0, 1.0, 0), PRESSURE),
    // Pound-force per square inch.
    unit("psi", &[], false, (POUND_FORCE.0, 254.0 * 254.0, POUND_FORCE.2 + 8), PRESSURE),
    unit("ksi", &[], false, (POUND_FORCE.0, 254.0 * 254.0, POUND_FORCE.2 + 11), PRESSURE),
    unit("J", &["joule", "joules"], true, (1.0, 1.0, 0), [2, 1, -2, 0]),
    unit("W", &["watt", "watts"], true, (1.0, 1.0, 0), [2, 1, -3, 0]),
];

/// Prefixes, in the order in which they are suggested: `MPa` before `mPa`. `µ` is U+00B5, `μ` U+03BC.
const PREFIXES: &[(&str, i32)] = &[
    ("k", 3),
    ("M", 6),
    ("G", 9),
    ("m", -3),
    ("c", -2),
    ("u", -6),
    ("µ", -6),
    ("μ", -6),
    ("n", -9),
    ("p", -12),
    ("T", 12),
    ("h", 2),
    ("da", 1),
    ("d", -1),
];

/// The symbols of all units, without prefixes; those that take prefixes first.
pub fn unit_symbols() -> (Vec<&'static str>, Vec<&'static str>) {
    let symbols = |prefixes| UNITS.iter().filter(|u| u.prefixes == prefixes).map(|u| u.symbol).collect();
    (symbols(true), symbols(false))
}

/// The prefixes of units.
pub fn prefixes() -> Vec<&'static str> {
    PREFIXES.iter().map(|(prefix, _)| *prefix).collect()
}

/// The unit of this symbol, with or without prefix. A symbol of its own takes precedence over one with
/// prefix: `min` is minutes.
pub(super) fn find(symbol: &str) -> Option<(Scale, Dimension)> {
    if let Some(unit) = UNITS.iter().find(|unit| unit.symbol == symbol) {
        return Some((unit.scale, unit.dimension));
    }
    PREFIXES.iter().find_map(|(prefix, exponent)| {
        let rest = symbol.strip_prefix(prefix)?;
        let unit = UNITS.iter().find(|unit| unit.prefixes && unit.symbol == rest)?;
        Some((unit.scale.times(Scale::new(1.0, 1.0, *exponent)), unit.dimension))
    })
}

/// Units that an unknown symbol may have meant, the best first.
pub(super) fn suggestions(symbol: &str) -> Vec<String> {
    let lower = symbol.to_lowercase();
    // Written-out words for units and prefixes: `kilograms`, `sec`.
    const WORDS: &[(&str, &str)] = &[
        ("", ""),
        ("kilo", "k"),
        ("mega", "M"),
        ("giga", "G"),
        ("milli", "m"),
        ("centi", "c"),
        ("micro", "u"),
        ("nano", "n"),
    ];
    let written_out = WORDS.iter().find_map(|(word, prefix)| {
        let rest = lower.strip_prefix(word)?;
        let unit = UNITS.iter().find(|unit| unit.names.contains(&rest))?;
        (prefix.is_empty() || unit.prefixes).then(|| format!("{prefix}{}", unit.symbol))
    });
    if let Some(unit) = written_out {
        return vec![unit];
    }
    let mut symbols: Vec<String> = UNITS.iter().map(|unit| unit.symbol.to_owned()).collect();
    for (prefix, _) in PREFIXES.iter().filter(|(prefix, _)| prefix.is_ascii()) {
        symbols.extend(UNITS.iter().filter(|u| u.prefixes).map(|unit| format!("{prefix}{}", unit.symbol)));
    }
    let cased: Vec<String> = symbols.iter().filter(|known| known.to_lowercase() == lower).cloned().collect();
    if !cased.is_empty() {
        return cased;
    }
    // One typing mistake turns a symbol of one or two letters into any other: no suggestion.
    if !(3..=16).contains(&symbol.chars().count()) {
        return Vec::new();
    }
    let near = symbols.iter().filter(|known| strsim::damerau_levenshtein(symbol, known) == 1);
    let likeness = |known: &str| strsim::jaro_winkler(symbol, known);
    near.max_by(|a, b| likeness(a).total_cmp(&likeness(b))).cloned().into_iter().collect()
}
