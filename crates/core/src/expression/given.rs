//! Parameters that a formula defines after `where`: `"A*sin(w*t) where A = 2, w = 12"`.

use std::ops::Range;

use super::function;
use super::second::TwiceRated;
use super::{Expression, ExpressionError, FormulaSymbol, Number, Rated, Variable};
use crate::quantity::number_length;

/// Keyword that begins the parameters.
const WHERE: &str = "where";

/// A named number of a formula.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GivenNumber {
    pub(super) name: String,
    pub(super) value: f64,
    /// Position of the name in the text.
    pub(super) place: Range<usize>,
}

impl Expression {
    /// Names and values of the parameters.
    ///
    /// ```
    /// use pliant::expression::{Expression, Variable};
    /// let wave = Expression::parse("A*sin(w*t) where A = 2, w = 12", Variable::TIME)?;
    /// assert_eq!(wave.parameters().collect::<Vec<_>>(), [("A", 2.0), ("w", 12.0)]);
    /// // A w cos(w t) and sin(w t) at t = 0.
    /// assert_eq!((wave.rate([0.0; 3], 0.0), wave.derivative("A", [0.0; 3], 0.0)), (24.0, 0.0));
    /// # Ok::<(), pliant::expression::ExpressionError>(())
    /// ```
    pub fn parameters(&self) -> impl Iterator<Item = (&str, f64)> {
        self.given.iter().map(|given| (&given.name[..], given.value))
    }

    /// Derivative with respect to a parameter, at the point `x` [m] and the time `t` [s]; zero for an
    /// unknown name. At a jump or a kink it is one-sided.
    pub fn derivative(&self, name: &str, x: [f64; 3], t: f64) -> f64 {
        let of = |symbol| match symbol {
            FormulaSymbol::Variable(variable) => Rated { value: variable.of(x, t), rate: 0.0 },
            FormulaSymbol::Given(i) => {
                let given = &self.given[i];
                Rated { value: given.value, rate: if given.name == name { 1.0 } else { 0.0 } }
            }
        };
        self.run(of, |_, _| {}).rate
    }

    /// Derivative of the [rate](Self::rate) with respect to a parameter, `d2f/dt dA`; zero for an unknown
    /// name.
    ///
    /// ```
    /// use pliant::expression::{Expression, Variable};
    /// let wave = Expression::parse("A*sin(w*t) where A = 2, w = 12", Variable::TIME)?;
    /// // w cos(w t) and A cos(w t) - A w t sin(w t) at t = 0.
    /// let by = |name| wave.rate_derivative(name, [0.0; 3], 0.0);
    /// assert_eq!((by("A"), by("w")), (12.0, 2.0));
    /// # Ok::<(), pliant::expression::ExpressionError>(())
    /// ```
    pub fn rate_derivative(&self, name: &str, x: [f64; 3], t: f64) -> f64 {
        let of = |symbol| match symbol {
            FormulaSymbol::Variable(variable) => {
                let rate = if variable == Variable::T { 1.0 } else { 0.0 };
                let by_time = Rated { value: variable.of(x, t), rate };
                TwiceRated { by_time, by_number: 0.0, mixed: 0.0 }
            }
            FormulaSymbol::Given(i) => {
                let given = &self.given[i];
                let by_number = if given.name == name { 1.0 } else { 0.0 };
                TwiceRated { by_number, ..TwiceRated::constant(given.value) }
            }
        };
        self.run(of, |_, _| {}).mixed
    }

    /// Derivatives of the [rate](Self::rate) with respect to the coordinates of the point, `d2f/dt dx`.
    ///
    /// ```
    /// use pliant::expression::{Expression, Variable};
    /// let wave = Expression::parse("X^2*sin(3*t) + Y*t", Variable::AT_REST)?;
    /// // 6 x cos(3 t) and 1 at x = 2, t = 0.
    /// assert_eq!(wave.rate_slope([2.0, 0.5, 0.0], 0.0), [12.0, 1.0, 0.0]);
    /// # Ok::<(), pliant::expression::ExpressionError>(())
    /// ```
    pub fn rate_slope(&self, x: [f64; 3], t: f64) -> [f64; 3] {
        [0, 1, 2].map(|axis| {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            let of = |symbol| match symbol {
                FormulaSymbol::Variable(variable) => {
                    let rate = if variable == Variable::T { 1.0 } else { 0.0 };
                    let by_time = Rated { value: variable.of(x, t), rate };
                    TwiceRated { by_time, by_number: variable.of(unit, 0.0), mixed: 0.0 }
                }
                FormulaSymbol::Given(i) => TwiceRated::constant(self.given[i].value),
            };
            self.run(of, |_, _| {}).mixed
        })
    }
}

/// Splits a text into the formula and the parameters after `where`.
///
/// # Errors
/// The parameters do not read `name = number, ..`, or a name is taken by one of `variables`, by a
/// function or by another parameter.
pub(super) fn split<'t>(
    text: &'t str,
    variables: &[&str],
) -> Result<(&'t str, Vec<GivenNumber>), ExpressionError> {
    let is_word = |at: usize| {
        let is_apart = |c: Option<char>| !c.is_some_and(is_name);
        is_apart(text[..at].chars().next_back()) && is_apart(text[at + WHERE.len()..].chars().next())
    };
    let Some(at) = text.match_indices(WHERE).map(|(at, _)| at).find(|at| is_word(*at)) else {
        return Ok((text, vec![]));
    };
    let mut reader = GivenReader { text, at: at + WHERE.len() };
    let mut all: Vec<GivenNumber> = vec![];
    loop {
        let given = reader.given()?;
        let is_taken = function::function(&given.name).is_some()
            || given.name == "pi"
            || variables.contains(&&given.name[..])
            || all.iter().any(|other| other.name == given.name);
        if is_taken {
            let GivenNumber { name, place, .. } = given;
            return Err(ExpressionError::Given { name, problem: "is taken", place });
        }
        all.push(given);
        if !reader.takes(',') {
            break;
        }
    }
    if reader.next().is_some() {
        return Err(reader.unexpected("`,` or the end"));
    }
    Ok((&text[..at], all))
}

struct GivenReader<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> GivenReader<'t> {
    /// Rest of the text, without leading spaces.
    fn rest(&mut self) -> &'t str {
        let rest = self.text[self.at..].trim_start();
        self.at = self.text.len() - rest.len();
        rest
    }

    fn next(&mut self) -> Option<char> {
        self.rest().chars().next()
    }

    fn takes(&mut self, symbol: char) -> bool {
        let is_next = self.next() == Some(symbol);
        self.at += if is_next { symbol.len_utf8() } else { 0 };
        is_next
    }

    fn unexpected(&mut self, expected: &'static str) -> ExpressionError {
        let found = self.next();
        let place = self.at..self.at + found.map_or(0, char::len_utf8);
        ExpressionError::Unexpected { expected, found, place }
    }

    /// `name = number`.
    fn given(&mut self) -> Result<GivenNumber, ExpressionError> {
        let rest = self.rest();
        let name = &rest[..rest.find(|c| !is_name(c)).unwrap_or(rest.len())];
        if name.is_empty() || name.starts_with(|c: char| c.is_ascii_digit()) {
            return Err(self.unexpected("a name and its number, `A = 2`"));
        }
        let place = self.at..self.at + name.len();
        self.at = place.end;
        if !self.takes('=') {
            return Err(self.unexpected("`=` and a number"));
        }
        let rest = self.rest();
        let length = number_length(rest);
        if length == 0 {
            return Err(self.unexpected("a number in SI units"));
        }
        let number = self.at..self.at + length;
        self.at = number.end;
        match rest[..length].parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(GivenNumber { name: name.to_owned(), value, place }),
            _ => Err(ExpressionError::TooLarge { place: number }),
        }
    }
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Expression, ExpressionError> {
        Expression::parse(text, Variable::AT_REST)
    }

    #[test]
    fn numbers_with_names_have_values_and_derivatives() {
        let text = "A*exp(-k*t) + A*X^n where A = -2.5e1, k=.5,n = +3";
        let formula = parsed(text).unwrap();
        assert_eq!(formula.text(), text);
        let (x, t): (f64, f64) = (1.5, 0.8);
        let decay = libm::exp(-0.5 * t);
        let at = |name| formula.derivative(name, [x, 0.0, 0.0], t);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-13 * b.abs(), "{a:e}, expected {b:e}");
        close(formula.value([x, 0.0, 0.0], t), -25.0 * (decay + x.powi(3)));
        close(at("A"), decay + x.powi(3));
        close(at("k"), 25.0 * t * decay);
        close(at("n"), -25.0 * x.powi(3) * x.ln());
        close(formula.rate([x, 0.0, 0.0], t), 12.5 * decay);
        let rate = |name| formula.rate_derivative(name, [x, 0.0, 0.0], t);
        close(rate("A"), -0.5 * decay);
        close(rate("k"), 25.0 * (1.0 - 0.5 * t) * decay);
        assert_eq!((rate("n"), rate("B")), (0.0, 0.0));
        assert_eq!(at("B"), 0.0);
        // 0^n is 0 for all n above 0.
        assert_eq!(formula.derivative("n", [0.0; 3], t), 0.0);
        assert!(formula.depends_on_time() && formula.depends_on_place());
        // `somewhere` is no `where`.
        assert!(parsed("2 where somewhere = 1").is_err() && parsed("q where q = 3").is_ok());
    }

    #[test]
    fn mistakes_after_where_are_told_with_their_place() {
        let cases = [
            ("2*A where A = 1 kPa", "expected `,` or the end, found `k`", 16),
            ("2*A where A = ", "expected a number in SI units, found the end", 14),
            ("2*A where A 3", "expected `=` and a number, found `3`", 12),
            ("2*A where", "expected a name and its number, `A = 2`, found the end", 9),
            ("2*A where A = 1,", "expected a name and its number, `A = 2`, found the end", 16),
            ("2*A where A = 1, A = 2", "`A` is taken", 17),
            ("2*t where t = 1", "`t` is taken", 10),
            ("2*t where sin = 1", "`sin` is taken", 10),
            ("2*t where A = 1", "`A` is not in the formula", 10),
            ("2*B where A = 1", "unknown name `B`", 2),
            ("A where A = 1e999", "the number is too large", 12),
        ];
        for (text, message, place) in cases {
            let error = parsed(text).unwrap_err();
            assert_eq!((&error.to_string()[..], error.place().start), (message, place), "{text}");
        }
    }
}
