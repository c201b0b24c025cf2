//! From a text to a program in postfix order.

use winnow::ascii::multispace0;
use winnow::combinator::{Infix, Prefix, alt, expression, opt, preceded};
use winnow::error::ParserError;
use winnow::prelude::*;
use winnow::stream::Stateful;
use winnow::token::{one_of, take_while};

use super::function::{self, FUNCTIONS, Function};
use super::{ExpressionError, Operation, Variable};
use crate::quantity::number_length;

/// Parentheses nest no deeper than this: the text is the user's, the stack of the parser is not.
const DEEPEST: usize = 16;

/// Longest formula, in bytes.
const LONGEST: usize = 1000;

/// Most powers in a formula: `2^-2^-2` is a power in a power without parentheses.
const MOST_POWERS: usize = 32;

type Program = Vec<Operation>;
type Input<'i> = Stateful<&'i str, State<'i>>;
type Parsed<T> = Result<T, Halt>;

#[derive(Clone, Copy, Debug)]
struct State<'i> {
    length: usize,
    variables: &'i [Variable],
    depth: usize,
}

/// Why a parser stops.
#[derive(Debug)]
enum Halt {
    /// Another may go on.
    NotMine,
    /// The text is wrong.
    Wrong(ExpressionError),
}

impl<'i> ParserError<Input<'i>> for Halt {
    type Inner = Self;

    fn from_input(_: &Input<'i>) -> Self {
        Halt::NotMine
    }

    fn is_backtrack(&self) -> bool {
        matches!(self, Halt::NotMine)
    }

    fn into_inner(self) -> Result<Self::Inner, Self> {
        Ok(self)
    }
}

/// Reads a whole text.
pub(super) fn program(text: &str, variables: &[Variable]) -> Result<Program, ExpressionError> {
    let powers = text.matches('^').count() + text.matches("**").count();
    if text.len() > LONGEST || powers > MOST_POWERS {
        return Err(ExpressionError::TooDeep { place: 0..text.len() });
    }
    let state = State { length: text.len(), variables, depth: 0 };
    let mut input = Input { input: text, state };
    let end = |input: &Input<'_>| match input.input.chars().next() {
        None => Ok(()),
        Some('^' | '*' | '<' | '>') => {
            Err(unexpected(input, "parentheses (`a^b^c` can be read in two ways)"))
        }
        Some(_) => Err(unexpected(input, "an operator or the end")),
    };
    let parsed = formula(&mut input).and_then(|program| end(&input).map(|()| program));
    parsed.map_err(|halt| match halt {
        Halt::Wrong(error) => error,
        Halt::NotMine => ExpressionError::Unexpected { expected: "a formula", found: None, place: 0..0 },
    })
}

fn at(input: &Input<'_>) -> usize {
    input.state.length - input.input.len()
}

fn unexpected(input: &Input<'_>, expected: &'static str) -> Halt {
    let found = input.input.chars().next();
    let place = at(input)..at(input) + found.map_or(0, char::len_utf8);
    Halt::Wrong(ExpressionError::Unexpected { expected, found, place })
}

/// Anything, up to what can be no part of it; spaces around it are taken.
fn formula(input: &mut Input<'_>) -> Parsed<Program> {
    let program = expression(operand).prefix(sign).infix(infix).parse_next(input)?;
    let _ = multispace0::<_, Halt>.parse_next(input)?;
    Ok(program)
}

fn sign<'i>(input: &mut Input<'i>) -> Parsed<Prefix<Input<'i>, Program, Halt>> {
    let expected = "a number, a name or `(`";
    let sign = opt(preceded(multispace0, one_of(['-', '+']))).parse_next(input)?;
    let _ = multispace0::<_, Halt>.parse_next(input)?;
    match (sign, input.input.starts_with(['-', '+'])) {
        (None, _) | (_, true) => Err(unexpected(input, expected)),
        (Some('-'), false) => Ok(Prefix(8, |_, a| Ok(called(vec![a], &function::NEGATE)))),
        (Some(_), false) => Ok(Prefix(8, |_, a| Ok(a))),
    }
}

fn infix<'i>(input: &mut Input<'i>) -> Parsed<Infix<Input<'i>, Program, Halt>> {
    let symbol = alt((alt(("**", "<=", ">=")), "^", "*", "/", "+", "-", "<", ">"));
    match preceded(multispace0, symbol).parse_next(input)? {
        "^" | "**" => Ok(Infix::Neither(10, |_, a, b| Ok(called(vec![a, b], &function::POWER)))),
        "*" => Ok(Infix::Left(7, |_, a, b| Ok(called(vec![a, b], &function::MULTIPLY)))),
        "/" => Ok(Infix::Left(7, |_, a, b| Ok(called(vec![a, b], &function::DIVIDE)))),
        "+" => Ok(Infix::Left(5, |_, a, b| Ok(called(vec![a, b], &function::ADD)))),
        "-" => Ok(Infix::Left(5, |_, a, b| Ok(called(vec![a, b], &function::SUBTRACT)))),
        "<" => Ok(Infix::Neither(3, |_, a, b| Ok(called(vec![a, b], &function::LESS)))),
        "<=" => Ok(Infix::Neither(3, |_, a, b| Ok(called(vec![a, b], &function::LESS_OR_EQUAL)))),
        ">" => Ok(Infix::Neither(3, |_, a, b| Ok(called(vec![a, b], &function::GREATER)))),
        _ => Ok(Infix::Neither(3, |_, a, b| Ok(called(vec![a, b], &function::GREATER_OR_EQUAL)))),
    }
}

fn called(arguments: Vec<Program>, function: &'static Function) -> Program {
    let mut program = arguments.concat();
    program.push(Operation::Call(function));
    program
}

fn operand(input: &mut Input<'_>) -> Parsed<Program> {
    let _ = multispace0::<_, Halt>.parse_next(input)?;
    match input.input.chars().next() {
        Some('0'..='9' | '.') => number(input),
        Some('(') => nested(input, |input| {
            let inside = formula(input)?;
            closed(input, "`)` or an operator")?;
            Ok(inside)
        }),
        Some(c) if is_name(c) => name(input),
        _ => Err(Halt::NotMine),
    }
}

fn number(input: &mut Input<'_>) -> Parsed<Program> {
    let start = at(input);
    let length = number_length(input.input);
    if length == 0 {
        return Err(unexpected(input, "a number"));
    }
    let (digits, rest) = input.input.split_at(length);
    input.input = rest;
    match digits.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(vec![Operation::Number(value)]),
        _ => Err(Halt::Wrong(ExpressionError::TooLarge { place: start..at(input) })),
    }
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// A variable, a constant, or a function with its arguments.
fn name(input: &mut Input<'_>) -> Parsed<Program> {
    let start = at(input);
    let name: &str = take_while(1.., is_name).parse_next(input)?;
    let place = start..at(input);
    if let Some(function) = function::function(name) {
        let _ = multispace0::<_, Halt>.parse_next(input)?;
        if !input.input.starts_with('(') {
            return Err(unexpected(input, "`(` and the arguments of the function"));
        }
        let arguments = nested(input, arguments)?;
        function.takes(arguments.len(), place).map_err(Halt::Wrong)?;
        return Ok(called(arguments, function));
    }
    if name == "pi" {
        return Ok(vec![Operation::Number(std::f64::consts::PI)]);
    }
    match input.state.variables.iter().find(|variable| variable.name() == name) {
        Some(variable) => Ok(vec![Operation::Variable(*variable)]),
        None => {
            let known = input.state.variables.iter().map(|variable| variable.name());
            Err(Halt::Wrong(ExpressionError::UnknownName {
                name: name.to_owned(),
                known: known.chain(["pi"]).collect(),
                functions: FUNCTIONS.iter().map(|function| function.name).collect(),
                place,
            }))
        }
    }
}

fn arguments(input: &mut Input<'_>) -> Parsed<Vec<Program>> {
    let mut arguments = vec![formula(input)?];
    while let Some(rest) = input.input.strip_prefix(',') {
        input.input = rest;
        arguments.push(formula(input)?);
    }
    closed(input, "`,`, `)` or an operator")?;
    Ok(arguments)
}

/// What is between parentheses.
fn nested<'i, T>(input: &mut Input<'i>, inside: impl FnOnce(&mut Input<'i>) -> Parsed<T>) -> Parsed<T> {
    if input.state.depth == DEEPEST {
        let place = at(input)..at(input) + 1;
        return Err(Halt::Wrong(ExpressionError::TooDeep { place }));
    }
    input.input = &input.input[1..];
    input.state.depth += 1;
    let value = inside(input)?;
    input.state.depth -= 1;
    Ok(value)
}

fn closed(input: &mut Input<'_>, expected: &'static str) -> Parsed<()> {
    match input.input.strip_prefix(')') {
        Some(rest) => {
            input.input = rest;
            Ok(())
        }
        None => Err(unexpected(input, expected)),
    }
}
