//! Parser from a text to a number in SI units and its dimension.

use std::ops::Range;
use std::str::FromStr;

use super::unit::{self, Scale};
use super::{Dimension, QuantityError};

/// A number in SI units and its dimension.
///
/// ```
/// use pliant::quantity::Quantity;
/// let density: Quantity = "1.2 g/cm^3".parse()?;
/// assert_eq!(density.value, 1200.0);
/// assert_eq!(density.dimension.unwrap().to_string(), "kg/m^3");
/// # Ok::<(), pliant::quantity::QuantityError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Value in SI units.
    pub value: f64,
    /// Dimension; `None` for a plain number, which can be any quantity in SI units.
    pub dimension: Option<Dimension>,
}

/// True if `text` begins as a quantity (a number, then the end or a unit) rather than as a formula.
pub fn is_quantity(text: &str) -> bool {
    let text = text.trim();
    let number = number_length(text);
    let rest = text[number..].trim_start();
    let next = rest.chars().next();
    number > 0 && next.is_none_or(|c| is_symbol(c) || c.is_ascii_digit())
}

impl From<f64> for Quantity {
    /// A plain number, in SI units.
    fn from(value: f64) -> Self {
        Quantity { value, dimension: None }
    }
}

impl FromStr for Quantity {
    type Err = QuantityError;

    /// Reads a number and a unit: symbols with SI prefixes, products (`N m`, `N*m`, `N·m`, `N.m`),
    /// quotients (`m/s`), powers (`s^2`, `s**2`, `s²`, and `s2` as in Abaqus decks), parentheses.
    fn from_str(text: &str) -> Result<Quantity, QuantityError> {
        let start = text.len() - text.trim_start().len();
        let end = text.trim_end().len();
        let number = start + number_length(&text[start..]);
        if number == start {
            return Err(QuantityError::NotANumber { text: text.trim().to_owned() });
        }
        let digits = &text[start..number];
        let mut reader = UnitReader { text: &text[..end], at: number };
        reader.skip_spaces();
        let unit = if reader.at == end { None } else { Some(reader.whole_unit()?) };
        let (scale, dimension) = unit.unwrap_or((Scale::ONE, Dimension::default()));
        match scaled(digits, scale) {
            value if value.is_finite() => Ok(Quantity { value, dimension: unit.map(|_| dimension) }),
            _ => Err(QuantityError::TooLarge { text: text.trim().to_owned() }),
        }
    }
}

/// Length of the decimal number at the beginning of `text`.
pub(crate) fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let sign = |at: usize| usize::from(matches!(bytes.get(at), Some(b'+' | b'-')));
    let mut at = sign(0);
    let whole = digits(at);
    at += whole;
    let mut fraction = 0;
    if bytes.get(at) == Some(&b'.') {
        fraction = digits(at + 1);
        // In `2.m` the point is a product.
        if fraction > 0 {
            at += 1 + fraction;
        }
    }
    if whole + fraction == 0 {
        return 0;
    }
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let exponent = at + 1 + sign(at + 1);
        let length = digits(exponent);
        if length > 0 {
            at = exponent + length;
        }
    }
    at
}

/// The number `digits` in units of `scale`. The power of ten is applied to the text, so that a purely
/// decimal unit adds no rounding.
fn scaled(digits: &str, scale: Scale) -> f64 {
    let (mantissa, exponent) = digits.split_once(['e', 'E']).unwrap_or((digits, "0"));
    // An exponent of more than 18 digits is beyond every range anyway.
    let exponent: i64 = exponent.parse().unwrap_or(if exponent.starts_with('-') { -99_999 } else { 99_999 });
    let decimal = |power: i64| format!("{mantissa}e{power}").parse::<f64>().unwrap_or(f64::NAN);
    if scale.numerator == 1.0 && scale.denominator == 1.0 {
        return decimal(exponent.saturating_add(scale.exponent.into()));
    }
    let ten: f64 = format!("1e{}", scale.exponent.unsigned_abs()).parse().unwrap_or(f64::INFINITY);
    let (mut above, mut below) = (scale.numerator, scale.denominator);
    // These powers of ten are exact in floating point: dividing by one rounds once.
    *(if scale.exponent < 0 { &mut below } else { &mut above }) *= ten;
    if above.is_finite() && below.is_finite() { decimal(exponent) * above / below } else { f64::NAN }
}

/// True for characters of unit symbols.
fn is_symbol(character: char) -> bool {
    character.is_alphabetic() && !is_superscript(character) || matches!(character, '°' | 'µ')
}

const SUPERSCRIPTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";

fn is_superscript(character: char) -> bool {
    character == '⁻' || SUPERSCRIPTS.contains(character)
}

/// Reads a unit by recursive descent.
struct UnitReader<'a> {
    text: &'a str,
    at: usize,
}

/// Depth limit of parentheses in a unit: it protects the stack from the user's text.
const DEEPEST: usize = 16;

type Read = (Scale, Dimension);

impl UnitReader<'_> {
    fn next(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn skip_spaces(&mut self) {
        self.at = self.text.len() - self.text[self.at..].trim_start().len();
    }

    fn take(&mut self, what: &str) -> bool {
        let taken = self.text[self.at..].starts_with(what);
        self.at += if taken { what.len() } else { 0 };
        taken
    }

    fn take_while(&mut self, belongs: impl Fn(char) -> bool) -> Range<usize> {
        let start = self.at;
        self.at += self.text[start..].chars().take_while(|c| belongs(*c)).map(char::len_utf8).sum::<usize>();
        start..self.at
    }

    fn malformed(&self, expected: &'static str) -> QuantityError {
        let found = self.next();
        let place = self.at..self.at + found.map_or(0, char::len_utf8);
        QuantityError::Malformed { expected, found, place }
    }

    fn whole_unit(&mut self) -> Result<Read, QuantityError> {
        // The unit of `3 /s` has no numerator.
        let unit = if self.next() == Some('/') {
            self.product(0, (Scale::ONE, Dimension::default()))?
        } else {
            let first = self.factor(0)?;
            self.product(0, first)?
        };
        if self.at == self.text.len() { Ok(unit) } else { Err(self.malformed("a unit")) }
    }

    /// Parses the factors after the first.
    fn product(&mut self, depth: usize, first: Read) -> Result<Read, QuantityError> {
        let (mut scale, mut dimension) = first;
        let mut divided = false;
        loop {
            self.skip_spaces();
            let start = self.at;
            let power = if self.take("/") {
                divided = true;
                -1
            } else {
                let dot = self.take("*") || self.take("·") || self.take("⋅") || self.take(".");
                if !dot && !self.next().is_some_and(|c| is_symbol(c) || c == '(') {
                    return Ok((scale, dimension));
                }
                1
            };
            self.skip_spaces();
            let before = self.at;
            let factor = self.factor(depth)?;
            if divided && power == 1 {
                return Err(QuantityError::Ambiguous { place: before..self.at });
            }
            scale = scale.times(factor.0.power(power));
            dimension = factor
                .1
                .power(power)
                .and_then(|d| dimension.times(d))
                .ok_or(QuantityError::LargePower { place: start..self.at })?;
        }
    }

    /// Parses a symbol, a unit in parentheses or the number 1, with its power.
    fn factor(&mut self, depth: usize) -> Result<Read, QuantityError> {
        let start = self.at;
        let base = if self.take("(") {
            if depth == DEEPEST {
                return Err(self.malformed("fewer parentheses"));
            }
            self.skip_spaces();
            let first = self.factor(depth + 1)?;
            let inside = self.product(depth + 1, first)?;
            if !self.take(")") {
                return Err(self.malformed("`)`"));
            }
            inside
        } else if self.next() == Some('1')
            && !self.text[self.at + 1..].starts_with(|c: char| c.is_ascii_digit())
        {
            self.at += 1;
            (Scale::ONE, Dimension::default())
        } else {
            let place = self.take_while(is_symbol);
            if place.is_empty() {
                return Err(self.malformed("a unit"));
            }
            let symbol = &self.text[place.clone()];
            unit::find(symbol).ok_or_else(|| QuantityError::UnknownUnit {
                symbol: symbol.to_owned(),
                suggestions: unit::suggestions(symbol),
                place,
            })?
        };
        let power = self.power(start)?;
        let dimension = Some(power)
            .filter(|p| p.unsigned_abs() <= Dimension::LARGEST.unsigned_abs())
            .and_then(|p| base.1.power(p));
        match dimension {
            Some(dimension) => Ok((base.0.power(power), dimension)),
            None => Err(QuantityError::LargePower { place: start..self.at }),
        }
    }

    /// Power of the factor that begins at `start`; 1 if none is written.
    fn power(&mut self, start: usize) -> Result<i32, QuantityError> {
        // `m2`, but not `(m)2`.
        let of_symbol = self.text[start..self.at].ends_with(is_symbol);
        let superscript = self.take_while(is_superscript);
        let digits: String = if !superscript.is_empty() {
            let value = |c| SUPERSCRIPTS.chars().position(|digit| digit == c);
            let plain = |c| value(c).map_or('-', |digit| char::from(b'0' + digit as u8));
            self.text[superscript].chars().map(plain).collect()
        } else if self.take("^") || self.take("**") {
            let parenthesis = self.take("(");
            let start = self.at;
            let _ = self.take("-") || self.take("+");
            self.take_while(|c| c.is_ascii_digit());
            let digits = self.text[start..self.at].to_owned();
            if parenthesis && !self.take(")") {
                return Err(self.malformed("`)`"));
            }
            digits
        } else if of_symbol {
            let digits = self.take_while(|c| c.is_ascii_digit());
            if digits.is_empty() {
                return Ok(1);
            }
            self.text[digits].to_owned()
        } else {
            return Ok(1);
        };
        digits.parse::<i32>().map_err(|_| self.malformed("a whole power"))
    }
}
