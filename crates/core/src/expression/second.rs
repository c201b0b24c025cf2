//! Second derivatives of operators and functions, for rates that are differentiated by parameters of a
//! formula.

use super::function::Function;
use super::{Number, Rated, function};

/// Symmetric matrix over pairs of arguments.
type SecondPartials = [[f64; 3]; 3];

/// Second derivatives of a function of one argument.
fn of_one(second: f64) -> SecondPartials {
    let mut all = [[0.0; 3]; 3];
    all[0][0] = second;
    all
}

/// Second derivatives of a function of two arguments: first argument twice, mixed, second argument twice.
fn of_two(first: f64, mixed: f64, second: f64) -> SecondPartials {
    [[first, mixed, 0.0], [mixed, second, 0.0], [0.0; 3]]
}

/// Second derivatives of a function; one-sided at a jump or a kink.
fn second_partials(function: &Function, [a, b, c]: [f64; 3]) -> SecondPartials {
    let square_root = |a: f64| (1.0 - a * a) * (1.0 - a * a).sqrt();
    match (function.name, function.arity) {
        ("*", _) => of_two(0.0, 1.0, 0.0),
        ("/", _) => of_two(0.0, -1.0 / (b * b), 2.0 * a / (b * b * b)),
        ("^", _) => {
            let (power, slope) = (libm::pow(a, b), libm::pow(a, b - 1.0));
            let curvature = b * (b - 1.0) * libm::pow(a, b - 2.0);
            let by_exponent = function::logarithm_times(function::logarithm_times(power, a), a);
            of_two(curvature, slope + b * function::logarithm_times(slope, a), by_exponent)
        }
        ("sin", _) => of_one(-libm::sin(a)),
        ("cos", _) => of_one(-libm::cos(a)),
        ("tan", _) => of_one(2.0 * libm::tan(a) * (1.0 + libm::tan(a) * libm::tan(a))),
        ("asin", _) => of_one(a / square_root(a)),
        ("acos", _) => of_one(-a / square_root(a)),
        ("atan", _) => of_one(-2.0 * a / ((1.0 + a * a) * (1.0 + a * a))),
        ("atan2", _) => {
            let ([y, x], r2) = ([a, b], a * a + b * b);
            of_two(-2.0 * x * y / (r2 * r2), (y * y - x * x) / (r2 * r2), 2.0 * x * y / (r2 * r2))
        }
        ("sinh", _) => of_one(libm::sinh(a)),
        ("cosh", _) => of_one(libm::cosh(a)),
        ("tanh", _) => of_one(-2.0 * libm::tanh(a) * (1.0 - libm::tanh(a) * libm::tanh(a))),
        ("exp", _) => of_one(libm::exp(a)),
        ("ln" | "log", _) => of_one(-1.0 / (a * a)),
        ("sqrt", _) => of_one(-0.25 / (a * a.sqrt())),
        ("smoothstep", _) => smooth_step([a, b, c]),
        _ => [[0.0; 3]; 3],
    }
}

/// Second derivatives of `s^2 (3 - 2 s)`, `s = (x - from)/(to - from)`; zero before and after.
fn smooth_step([from, to, x]: [f64; 3]) -> SecondPartials {
    let width = to - from;
    let s = (x - from) / width;
    if s <= 0.0 || s >= 1.0 {
        return [[0.0; 3]; 3];
    }
    let (slope, curvature) = (6.0 * s * (1.0 - s), 6.0 - 12.0 * s);
    let first = [(s - 1.0) / width, -s / width, 1.0 / width];
    let mixed = (1.0 - 2.0 * s) / (width * width);
    let square = 1.0 / (width * width);
    let second = [
        [2.0 * (s - 1.0) * square, mixed, square],
        [mixed, 2.0 * s * square, -square],
        [square, -square, 0.0],
    ];
    let entry = |i: usize, j: usize| curvature * first[i] * first[j] + slope * second[i][j];
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// A number, its derivatives with respect to time and to a parameter, and the mixed derivative.
#[derive(Clone, Copy)]
pub(super) struct TwiceRated {
    pub(super) by_time: Rated,
    pub(super) by_number: f64,
    pub(super) mixed: f64,
}

impl Number for TwiceRated {
    fn constant(value: f64) -> Self {
        TwiceRated { by_time: Rated::constant(value), by_number: 0.0, mixed: 0.0 }
    }

    fn call(function: &Function, arguments: [Self; 3]) -> Self {
        let values = arguments.map(|argument| argument.by_time.value);
        let partials = (function.partials)(values);
        let (mut by_number, mut mixed) = (0.0, 0.0);
        // Zero times an infinite derivative is zero, as for rates.
        let times = |rate: f64, partial: f64| if rate == 0.0 { 0.0 } else { partial * rate };
        for (argument, partial) in arguments.iter().zip(partials) {
            by_number += times(argument.by_number, partial);
            mixed += times(argument.mixed, partial);
        }
        if arguments.iter().any(|argument| argument.by_number != 0.0) {
            let second = second_partials(function, values);
            for (one, row) in arguments.iter().zip(second) {
                for (other, entry) in arguments.iter().zip(row) {
                    mixed += times(one.by_time.rate * other.by_number, entry);
                }
            }
        }
        let by_time = Rated::call(function, arguments.map(|argument| argument.by_time));
        TwiceRated { by_time, by_number, mixed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::function::{ADD, DIVIDE, FUNCTIONS, MULTIPLY, NEGATE, POWER, SUBTRACT};

    // Central differences of the first derivatives, at points without kinks.
    #[test]
    fn second_derivatives_are_those_of_the_first() {
        let operators = [&NEGATE, &ADD, &SUBTRACT, &MULTIPLY, &DIVIDE, &POWER];
        for function in FUNCTIONS.iter().copied().chain(operators) {
            for at in [[0.37, 0.84, 0.61], [0.21, 0.93, 0.45]] {
                let found = second_partials(function, at);
                for i in 0..function.arity {
                    let moved = |by: f64| {
                        let mut moved = at;
                        moved[i] += by;
                        (function.partials)(moved)
                    };
                    let h = 1e-5;
                    let [up, down] = [moved(h), moved(-h)];
                    for j in 0..function.arity {
                        let expected = (up[j] - down[j]) / (2.0 * h);
                        let error = (found[i][j] - expected).abs();
                        let size = expected.abs().max(1.0);
                        assert!(error < 1e-7 * size, "{function:?} {i} {j}: {} {expected}", found[i][j]);
                    }
                }
            }
        }
    }
}
