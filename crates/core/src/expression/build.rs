//! Construction of the graph of a formula from its text.

use super::function::Function;
use super::graph::{Graph, NodeId};
use super::parse::{self, PlacedOperation};
use super::{ExpressionError, FormulaError, Operation};

/// A parsed formula of names that its reader chooses, not yet a [`Graph`].
#[derive(Clone, Debug)]
pub(crate) struct Formula {
    steps: Vec<PlacedOperation>,
}

/// Functions whose values and derivatives are available on packs of numbers.
const AVAILABLE: &[&str] =
    &["exp", "ln", "log", "sqrt", "abs", "min", "max", "clamp", "if", "sinh", "cosh", "tanh"];

impl Formula {
    /// Reads a formula of `names`.
    ///
    /// # Errors
    /// The text is not a formula, or contains a name that is neither a function nor one of `names`.
    pub(crate) fn parse(text: &str, names: &[&str]) -> Result<Formula, ExpressionError> {
        let steps = parse::program(text, names).map_err(|error| match error {
            ExpressionError::UnknownName { name, known, place, .. } => {
                ExpressionError::UnknownName { name, known, functions: AVAILABLE.to_vec(), place }
            }
            error => error,
        })?;
        Ok(Formula { steps })
    }

    /// Reads a formula of `variables`, then of `parameters`.
    ///
    /// # Errors
    /// Errors of [`parse`](Self::parse); a parameter whose name is taken, whose value is not finite, or
    /// which does not occur in the formula.
    pub(crate) fn with_parameters(
        text: &str,
        variables: &[&str],
        parameters: &[(&str, f64)],
    ) -> Result<Formula, FormulaError> {
        let wrong = |name: &str, problem| Err(FormulaError::Parameter { name: name.to_owned(), problem });
        for (name, value) in parameters {
            if *name == "pi" || variables.contains(name) {
                return wrong(name, "has a meaning of its own in the formula: choose another name");
            }
            if !value.is_finite() {
                return wrong(name, "must be a finite number");
            }
        }
        let of_parameters = parameters.iter().map(|(name, _)| *name);
        let names: Vec<&str> = variables.iter().copied().chain(of_parameters).collect();
        let formula = Formula::parse(text, &names)?;
        match parameters.iter().enumerate().find(|(index, _)| !formula.has(variables.len() + index)) {
            Some((_, (name, _))) => wrong(name, "is not in the formula: remove it, or use it there"),
            None => Ok(formula),
        }
    }

    /// True if the formula contains the name of this index.
    pub(crate) fn has(&self, name: usize) -> bool {
        self.steps.iter().any(|(step, _)| matches!(step, Operation::Variable(index) if *index == name))
    }

    /// Adds the formula's value to a graph; the names stand for `values`.
    ///
    /// # Errors
    /// A function of a non-constant argument that is not available on packs of numbers.
    pub(crate) fn add_to(&self, graph: &mut Graph, values: &[NodeId]) -> Result<NodeId, ExpressionError> {
        let mut stack: Vec<NodeId> = Vec::new();
        for (step, place) in &self.steps {
            let value = match step {
                Operation::Number(number) => graph.number(*number),
                Operation::Variable(index) => values[*index],
                Operation::Call(function) => {
                    let arguments = stack.split_off(stack.len() - function.arity);
                    call(graph, function, &arguments).ok_or_else(|| ExpressionError::Unavailable {
                        name: function.name,
                        available: AVAILABLE.to_vec(),
                        place: place.clone(),
                    })?
                }
            };
            stack.push(value);
        }
        Ok(stack.pop().expect("a formula has a value"))
    }
}

/// Adds an operator or a function to the graph; `None` if it is not available on packs.
fn call(graph: &mut Graph, function: &Function, arguments: &[NodeId]) -> Option<NodeId> {
    let constants: Option<Vec<f64>> = arguments.iter().map(|argument| graph.constant(*argument)).collect();
    if let Some(constants) = constants {
        let mut padded = [0.0; 3];
        padded[..constants.len()].copy_from_slice(&constants);
        return Some(graph.number((function.value)(padded)));
    }
    let (one, zero) = (graph.number(1.0), graph.number(0.0));
    let node = match (function.name, arguments) {
        ("-", [a]) => graph.negative(*a),
        ("+", [a, b]) => graph.sum(*a, *b),
        ("-", [a, b]) => graph.difference(*a, *b),
        ("*", [a, b]) => graph.product(*a, *b),
        ("/", [a, b]) => graph.quotient(*a, *b),
        ("^", [a, b]) => match graph.constant(*b) {
            Some(exponent) => graph.power(*a, exponent),
            None => {
                let logarithm = graph.logarithm(*a);
                let exponent = graph.product(*b, logarithm);
                graph.exponential(exponent)
            }
        },
        ("<", [a, b]) | (">", [b, a]) => graph.if_less(*a, *b, one, zero),
        (">=", [a, b]) | ("<=", [b, a]) => graph.if_less(*a, *b, zero, one),
        ("exp", [a]) => graph.exponential(*a),
        ("ln" | "log", [a]) => graph.logarithm(*a),
        ("sqrt", [a]) => graph.root(*a),
        ("abs", [a]) => graph.magnitude(*a),
        ("min", [a, b]) => graph.if_less(*a, *b, *a, *b),
        ("max", [a, b]) => graph.if_less(*b, *a, *a, *b),
        ("clamp", [x, low, high]) => {
            let below = graph.if_less(*high, *x, *high, *x);
            graph.if_less(*x, *low, *low, below)
        }
        ("if", [condition, then, otherwise]) => graph.choice(*condition, *then, *otherwise),
        ("sinh" | "cosh" | "tanh", [a]) => {
            let up = graph.exponential(*a);
            let down = graph.quotient(one, up);
            let (sinh, cosh) = (graph.difference(up, down), graph.sum(up, down));
            let half = graph.number(0.5);
            match function.name {
                "sinh" => graph.product(half, sinh),
                "cosh" => graph.product(half, cosh),
                _ => graph.quotient(sinh, cosh),
            }
        }
        _ => return None,
    };
    Some(node)
}
