//! Calls of functions whose constant arguments contradict each other.

use super::{Expression, Function, Number};
use crate::quantity::Rounded;

/// Value of a subexpression that depends on no variable; `None` for any other.
#[derive(Clone, Copy)]
struct Fixed(Option<f64>);

impl Number for Fixed {
    fn constant(value: f64) -> Self {
        Fixed(Some(value))
    }

    fn call(function: &Function, arguments: [Self; 3]) -> Self {
        let mut values = [0.0; 3];
        for (value, Fixed(argument)) in values.iter_mut().zip(arguments).take(function.arity) {
            let Some(argument) = argument else { return Fixed(None) };
            *value = argument;
        }
        Fixed(Some((function.value)(values)))
    }
}

impl Expression {
    /// Describes each call of `pulse`, `smoothstep` and `clamp` whose constant bounds enclose no
    /// interval, with the remedy.
    ///
    /// ```
    /// use pliant::expression::{Expression, Variable};
    /// let [of_width_zero, ramp] =
    ///     ["3 * pulse(2, 2, t)", "smoothstep(0, 1, t)"].map(|text| Expression::parse(text, Variable::TIME));
    /// assert!(of_width_zero?.degenerate_calls()[0].starts_with("`pulse(2, 2, ..)` is zero"));
    /// assert!(ramp?.degenerate_calls().is_empty());
    /// # Ok::<(), pliant::expression::ExpressionError>(())
    /// ```
    pub fn degenerate_calls(&self) -> Vec<String> {
        let mut found = vec![];
        self.evaluate_watched(
            |_| Fixed(None),
            |function, [a, b, c]| found.extend(degenerate(function.name, [a.0, b.0, c.0])),
        );
        found
    }
}

fn degenerate(name: &str, arguments: [Option<f64>; 3]) -> Option<String> {
    let shown = |x: f64| Rounded::<6>(x);
    match (name, arguments) {
        ("pulse", [Some(from), Some(to), _]) if from >= to => Some(format!(
            "`pulse({}, {}, ..)` is zero everywhere: its first number must be below its second",
            shown(from),
            shown(to)
        )),
        ("smoothstep", [Some(from), Some(to), _]) if from == to => Some(format!(
            "`smoothstep({0}, {0}, ..)` jumps, and has no value at {0}: it needs two numbers, or is \
             `step({0}, ..)`",
            shown(from)
        )),
        ("clamp", [_, Some(low), Some(high)]) if low > high => Some(format!(
            "`clamp(.., {0}, {1})` is {0} or {1}, and nothing between: the lower bound comes first",
            shown(low),
            shown(high)
        )),
        _ => None,
    }
}
