//! User formulas of position and time, `"0.1 * sin(2*pi*t)"`: parsed once, evaluated often.
//!
//! None of the existing crates that parse and evaluate formulas fits. `meval` and `fasteval` have been
//! unmaintained for years. `evalexpr` is under the AGPL. `exmex`, which also differentiates, depends on a
//! regular expression engine and does not report the position of a mistake in the text. None of them is
//! bit-identical on every machine: they call the `sin` and `exp` of the platform, whose last bit depends on
//! the C library and on the processor. Here these functions come from `libm`, which is plain Rust.
//!
//! Numbers are in SI units, angles in radian. The result is in the SI unit of the quantity that the formula
//! stands for.

mod branches;
mod build;
mod degenerate;
mod error;
mod function;
mod given;
mod graph;
mod parse;
mod program;
mod second;
#[cfg(test)]
mod tests;

use std::fmt;

pub(crate) use build::Formula;
pub use error::{ExpressionError, FormulaError};
use function::Function;
pub use function::signatures;
use given::GivenNumber;
pub(crate) use graph::{Graph, NodeId};
pub(crate) use program::Program;

/// A variable of a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// Time [s].
    T,
    /// First coordinate [m].
    X,
    /// Second coordinate [m].
    Y,
    /// Third coordinate [m].
    Z,
    /// First coordinate in the rest shape [m].
    RestX,
    /// Second coordinate in the rest shape [m].
    RestY,
    /// Third coordinate in the rest shape [m].
    RestZ,
}

impl Variable {
    /// Time alone.
    pub const TIME: &[Variable] = &[Variable::T];
    /// Time and position in the reference configuration.
    pub const AT_REST: &[Variable] = &[Variable::T, Variable::RestX, Variable::RestY, Variable::RestZ];
    /// Time and position.
    pub const ALL: &[Variable] = &[Variable::T, Variable::X, Variable::Y, Variable::Z];

    /// The name in a formula.
    pub fn name(self) -> &'static str {
        match self {
            Variable::T => "t",
            Variable::X => "x",
            Variable::Y => "y",
            Variable::Z => "z",
            Variable::RestX => "X",
            Variable::RestY => "Y",
            Variable::RestZ => "Z",
        }
    }

    /// Value of the variable at the point `x` [m] and the time `t` [s].
    fn of(self, x: [f64; 3], t: f64) -> f64 {
        match self {
            Variable::T => t,
            Variable::X | Variable::RestX => x[0],
            Variable::Y | Variable::RestY => x[1],
            Variable::Z | Variable::RestZ => x[2],
        }
    }
}

/// Meaning of a name in a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FormulaSymbol {
    Variable(Variable),
    /// Index of a parameter of the formula.
    Given(usize),
}

/// A formula of `x`, `y`, `z` [m] and `t` [s].
///
/// Operators, from the weakest: `<` `<=` `>` `>=` (1 if true, else 0), `+` `-`, `*` `/`, the sign `-`,
/// `^` or `**`. Functions: [`signatures`]. Constant: `pi`. Parameters in SI units may follow `where`:
/// `A*sin(w*t) where A = 2, w = 12`.
///
/// ```
/// use pliant::expression::{Expression, Variable};
/// let ramp = Expression::parse("2 * t^2 + x", Variable::ALL)?;
/// assert_eq!(ramp.value([1.0, 0.0, 0.0], 3.0), 19.0);
/// assert_eq!(ramp.rate([1.0, 0.0, 0.0], 3.0), 12.0);
/// # Ok::<(), pliant::expression::ExpressionError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Expression {
    text: String,
    /// Operations in postfix order.
    program: Vec<Operation<FormulaSymbol>>,
    given: Vec<GivenNumber>,
}

/// One operation of a formula of variables `V`: pops its arguments from a stack and pushes its result.
#[derive(Clone, Copy, Debug)]
enum Operation<V> {
    Number(f64),
    Variable(V),
    Call(&'static Function),
}

impl Operation<usize> {
    /// Replaces the index of a variable by that variable.
    fn of<V: Copy>(self, variables: &[V]) -> Operation<V> {
        match self {
            Operation::Number(number) => Operation::Number(number),
            Operation::Variable(index) => Operation::Variable(variables[index]),
            Operation::Call(function) => Operation::Call(function),
        }
    }
}

impl Expression {
    /// Maximum depth of the stack.
    const STACK: usize = 48;

    /// Reads a formula of `variables`.
    ///
    /// # Errors
    /// The text is not a formula, or contains a name that is neither a function nor one of `variables`.
    pub fn parse(text: &str, variables: &[Variable]) -> Result<Expression, ExpressionError> {
        let mut names: Vec<&str> = variables.iter().map(|variable| variable.name()).collect();
        let (formula, given) = given::split(text, &names)?;
        names.extend(given.iter().map(|given| &given.name[..]));
        let symbols = variables.iter().copied().map(FormulaSymbol::Variable);
        let symbols: Vec<FormulaSymbol> = symbols.chain((0..given.len()).map(FormulaSymbol::Given)).collect();
        let program = parse::program(formula, &names)?;
        let program: Vec<_> = program.into_iter().map(|(operation, _)| operation.of(&symbols)).collect();
        let is_used = |i: usize| {
            let is_it =
                |operation: &_| matches!(operation, Operation::Variable(FormulaSymbol::Given(j)) if *j == i);
            program.iter().any(is_it)
        };
        if let Some(i) = (0..given.len()).find(|i| !is_used(*i)) {
            let GivenNumber { name, place, .. } = given[i].clone();
            return Err(ExpressionError::Given { name, problem: "is not in the formula", place });
        }
        let mut height = 0_usize;
        for operation in &program {
            if let Operation::Call(function) = operation {
                height -= function.arity;
            }
            height += 1;
            if height > Self::STACK {
                return Err(ExpressionError::TooDeep { place: 0..text.len() });
            }
        }
        Ok(Expression { text: text.to_owned(), program, given })
    }

    /// The formula as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Value at the point `x` [m] and the time `t` [s]; NaN if the formula has none. Variables of the
    /// reference configuration, if the formula has them, also read `x`.
    pub fn value(&self, x: [f64; 3], t: f64) -> f64 {
        self.evaluate(|variable| variable.of(x, t))
    }

    /// Derivative with respect to `t` at a fixed point; a one-sided one at a jump or a kink.
    pub fn rate(&self, x: [f64; 3], t: f64) -> f64 {
        let result = self.evaluate(|variable| match variable {
            Variable::T => Rated { value: t, rate: 1.0 },
            place => Rated::constant(place.of(x, t)),
        });
        result.rate
    }

    /// Derivative with respect to the coordinates of `x` at a fixed time; a one-sided one at a jump or a
    /// kink.
    pub fn slope(&self, x: [f64; 3], t: f64) -> [f64; 3] {
        [0, 1, 2].map(|axis| {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            let rated = |variable: Variable| Rated { value: variable.of(x, t), rate: variable.of(unit, 0.0) };
            self.evaluate(rated).rate
        })
    }

    /// True if the formula depends on position.
    pub fn depends_on_place(&self) -> bool {
        self.variables().any(|variable| variable != Variable::T)
    }

    /// True if the formula depends on time.
    pub fn depends_on_time(&self) -> bool {
        self.variables().any(|variable| variable == Variable::T)
    }

    /// The variables of the formula, with repetitions.
    fn variables(&self) -> impl Iterator<Item = Variable> {
        self.program.iter().filter_map(|operation| match operation {
            Operation::Variable(FormulaSymbol::Variable(variable)) => Some(*variable),
            _ => None,
        })
    }

    /// True if the formula has no jumps: no comparison, `if`, `step`, `pulse`, `sign`, `floor`. Poles do
    /// not count as jumps.
    pub fn is_continuous(&self) -> bool {
        let mut calls = self.program.iter().filter_map(|operation| match operation {
            Operation::Call(function) => Some(function),
            _ => None,
        });
        !calls.any(|function| function.jumps())
    }

    fn evaluate<N: Number>(&self, variable: impl Fn(Variable) -> N) -> N {
        self.evaluate_watched(variable, |_, _| {})
    }

    /// Evaluates the formula; `watch` sees each call.
    fn evaluate_watched<N: Number>(
        &self,
        variable: impl Fn(Variable) -> N,
        watch: impl FnMut(&Function, [N; 3]),
    ) -> N {
        let of = |symbol| match symbol {
            FormulaSymbol::Variable(name) => variable(name),
            FormulaSymbol::Given(i) => N::constant(self.given[i].value),
        };
        self.run(of, watch)
    }

    /// Evaluates the formula for given values of its variables and parameters; `watch` sees each call.
    fn run<N: Number>(
        &self,
        symbol: impl Fn(FormulaSymbol) -> N,
        mut watch: impl FnMut(&Function, [N; 3]),
    ) -> N {
        let mut stack = [N::constant(0.0); Self::STACK];
        let mut height = 0;
        for operation in &self.program {
            let pushed = match operation {
                Operation::Number(number) => N::constant(*number),
                Operation::Variable(name) => symbol(*name),
                Operation::Call(function) => {
                    height -= function.arity;
                    let mut arguments = [N::constant(0.0); 3];
                    arguments[..function.arity].copy_from_slice(&stack[height..height + function.arity]);
                    watch(function, arguments);
                    N::call(function, arguments)
                }
            };
            stack[height] = pushed;
            height += 1;
        }
        stack[0]
    }
}

/// Compares the texts: equal texts are equal formulas.
impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.text)
    }
}

/// Numbers that a formula is evaluated on: plain numbers, or numbers with derivatives.
trait Number: Copy {
    fn constant(value: f64) -> Self;
    fn call(function: &Function, arguments: [Self; 3]) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn call(function: &Function, arguments: [Self; 3]) -> Self {
        (function.value)(arguments)
    }
}

/// A number and its derivative with respect to time.
#[derive(Clone, Copy)]
struct Rated {
    value: f64,
    rate: f64,
}

impl Number for Rated {
    fn constant(value: f64) -> Self {
        Rated { value, rate: 0.0 }
    }

    fn call(function: &Function, arguments: [Self; 3]) -> Self {
        let values = arguments.map(|argument| argument.value);
        let partials = (function.partials)(values);
        let mut rate = 0.0;
        for (argument, partial) in arguments.iter().zip(partials) {
            // A constant argument adds nothing, even if its partial derivative is infinite: `t^2` at 0.
            if argument.rate != 0.0 {
                rate += partial * argument.rate;
            }
        }
        Rated { value: (function.value)(values), rate }
    }
}
