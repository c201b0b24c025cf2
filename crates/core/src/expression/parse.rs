//! Recursive descent parser from a text to a program in postfix order. Loops read sequences of terms and
//! factors, so that only nesting deepens the recursion, and the depth is limited.

use std::ops::Range;

use super::function::{self, FUNCTIONS, Function};
use super::{ExpressionError, Operation};
use crate::quantity::number_length;

/// Depth limit of parentheses and signed exponents: it protects the stack of the parser from the user's
/// text.
const DEEPEST: usize = 16;

/// Length limit of a formula [bytes]: its compiled form takes a hundred times as much memory.
const LONGEST: usize = 64 * 1024;

/// An operation, with its variables as indices, and its position in the text.
pub(super) type PlacedOperation = (Operation<usize>, Range<usize>);

type Parsed<T = ()> = Result<T, ExpressionError>;

/// Symbols of one precedence; a longer symbol comes before its prefix.
type Operators = [(&'static str, &'static Function)];

const COMPARISONS: &Operators = &[
    ("<=", &function::LESS_OR_EQUAL),
    (">=", &function::GREATER_OR_EQUAL),
    ("<", &function::LESS),
    (">", &function::GREATER),
];
const SUMS: &Operators = &[("+", &function::ADD), ("-", &function::SUBTRACT)];
const PRODUCTS: &Operators = &[("*", &function::MULTIPLY), ("/", &function::DIVIDE)];
const POWERS: &Operators = &[("**", &function::POWER), ("^", &function::POWER)];

/// Parses a whole text, in which `names` stand for variables. Returns the operations, with indices into
/// `names`, and the position of each.
pub(super) fn program(text: &str, names: &[&str]) -> Parsed<Vec<PlacedOperation>> {
    if text.len() > LONGEST {
        return Err(ExpressionError::TooManyBytes { found: text.len(), most: LONGEST });
    }
    let mut parser = Parser { text, at: 0, names, depth: 0, program: Vec::new() };
    parser.comparison()?;
    match parser.next() {
        None => Ok(parser.program),
        Some('^' | '*' | '<' | '>') => {
            Err(parser.unexpected("parentheses (`a^b^c` can be read in two ways)"))
        }
        Some(_) => Err(parser.unexpected("an operator or the end")),
    }
}

struct Parser<'t> {
    text: &'t str,
    at: usize,
    names: &'t [&'t str],
    depth: usize,
    /// Operations parsed so far.
    program: Vec<PlacedOperation>,
}

impl<'t> Parser<'t> {
    fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    fn next(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn skip_spaces(&mut self) {
        self.at = self.text.len() - self.rest().trim_start_matches([' ', '\t', '\r', '\n']).len();
    }

    fn unexpected(&self, expected: &'static str) -> ExpressionError {
        let found = self.next();
        let place = self.at..self.at + found.map_or(0, char::len_utf8);
        ExpressionError::Unexpected { expected, found, place }
    }

    /// Consumes one of these operators, if it is next.
    fn operator(&mut self, operators: &Operators) -> Option<&'static Function> {
        self.skip_spaces();
        // `**` is a power, not a product.
        let is_power = self.rest().starts_with("**");
        let is_next = |symbol: &str| self.rest().starts_with(symbol) && !(is_power && symbol == "*");
        let (symbol, function) = operators.iter().find(|(symbol, _)| is_next(symbol))?;
        self.at += symbol.len();
        Some(function)
    }

    fn push(&mut self, operation: Operation<usize>, place: Range<usize>) {
        self.program.push((operation, place));
    }

    /// Appends a call of this operator or function.
    fn call(&mut self, function: &'static Function) {
        self.push(Operation::Call(function), self.at..self.at);
    }

    fn comparison(&mut self) -> Parsed {
        self.sum()?;
        if let Some(comparison) = self.operator(COMPARISONS) {
            self.sum()?;
            self.call(comparison);
        }
        Ok(())
    }

    fn sum(&mut self) -> Parsed {
        self.product()?;
        while let Some(operator) = self.operator(SUMS) {
            self.product()?;
            self.call(operator);
        }
        Ok(())
    }

    fn product(&mut self) -> Parsed {
        self.signed()?;
        while let Some(operator) = self.operator(PRODUCTS) {
            self.signed()?;
            self.call(operator);
        }
        Ok(())
    }

    /// A power with an optional sign.
    fn signed(&mut self) -> Parsed {
        let sign = self.operator(SUMS);
        self.power()?;
        if sign.is_some_and(|sign| std::ptr::eq(sign, &function::SUBTRACT)) {
            self.call(&function::NEGATE);
        }
        Ok(())
    }

    fn power(&mut self) -> Parsed {
        self.operand()?;
        if let Some(power) = self.operator(POWERS) {
            self.exponent()?;
            self.call(power);
        }
        Ok(())
    }

    /// An exponent, which may itself be a power only after a sign: `2^-2^-2`.
    fn exponent(&mut self) -> Parsed {
        self.skip_spaces();
        match self.next() {
            Some('-' | '+') => self.deeper(0, Self::signed),
            _ => self.operand(),
        }
    }

    fn operand(&mut self) -> Parsed {
        self.skip_spaces();
        match self.next() {
            Some('0'..='9' | '.') => self.number(),
            Some('(') => self.deeper(1, |parser| {
                parser.comparison()?;
                parser.closed("`)` or an operator")
            }),
            Some(c) if is_name(c) => self.name(),
            _ => Err(self.unexpected("a number, a name or `(`")),
        }
    }

    fn number(&mut self) -> Parsed {
        let start = self.at;
        let length = number_length(self.rest());
        if length == 0 {
            return Err(self.unexpected("a number"));
        }
        self.at += length;
        match self.text[start..self.at].parse::<f64>() {
            Ok(value) if value.is_finite() => self.push(Operation::Number(value), start..self.at),
            _ => return Err(ExpressionError::TooLarge { place: start..self.at }),
        }
        Ok(())
    }

    /// A variable, a constant, or a function with its arguments.
    fn name(&mut self) -> Parsed {
        let start = self.at;
        let name = self.rest();
        let name = &name[..name.find(|c| !is_name(c)).unwrap_or(name.len())];
        self.at += name.len();
        let place = start..self.at;
        if let Some(function) = function::function(name) {
            return self.function(function, place);
        }
        let variable = self.names.iter().position(|variable| *variable == name);
        let operation = match (name, variable) {
            ("pi", _) => Operation::Number(std::f64::consts::PI),
            (_, Some(variable)) => Operation::Variable(variable),
            (_, None) => return Err(self.unknown(name, place)),
        };
        self.push(operation, place);
        Ok(())
    }

    fn unknown(&self, name: &str, place: Range<usize>) -> ExpressionError {
        let known = self.names.iter().chain(&["pi"]);
        ExpressionError::UnknownName {
            name: name.to_owned(),
            known: known.map(|name| (*name).to_owned()).collect(),
            functions: FUNCTIONS.iter().map(|function| function.name).collect(),
            place,
        }
    }

    fn function(&mut self, function: &'static Function, place: Range<usize>) -> Parsed {
        self.skip_spaces();
        if self.next() != Some('(') {
            return Err(self.unexpected("`(` and the arguments of the function"));
        }
        let count = self.deeper(1, Self::arguments)?;
        function.takes(count, place.clone())?;
        self.push(Operation::Call(function), place);
        Ok(())
    }

    /// Reads arguments up to the parenthesis that closes them; returns their number.
    fn arguments(&mut self) -> Parsed<usize> {
        self.comparison()?;
        let mut count = 1;
        while self.next() == Some(',') {
            self.at += 1;
            self.comparison()?;
            count += 1;
        }
        self.closed("`,`, `)` or an operator")?;
        Ok(count)
    }

    /// Parses one level deeper, after a symbol of this length.
    fn deeper<T>(&mut self, symbol: usize, inside: impl FnOnce(&mut Self) -> Parsed<T>) -> Parsed<T> {
        if self.depth == DEEPEST {
            return Err(ExpressionError::TooDeep { place: self.at..self.at + 1 });
        }
        self.at += symbol;
        self.depth += 1;
        let value = inside(self)?;
        self.depth -= 1;
        Ok(value)
    }

    fn closed(&mut self, expected: &'static str) -> Parsed {
        if self.next() != Some(')') {
            return Err(self.unexpected(expected));
        }
        self.at += 1;
        Ok(())
    }
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}
