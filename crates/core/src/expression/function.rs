//! Operators and functions that a formula can call, each with its partial derivatives.
//!
//! # How to add one
//! 1. Add a line to `functions!` with `[FUNCTIONS]`: name, signature, value, derivatives.
//! 2. Add its second derivatives to `second_partials` in `second.rs`; the test
//!    `second_derivatives_are_those_of_the_first` compares them with differences.
//! 3. Formulas of materials run on packs of numbers: give the nodes of the function in `call` of `build.rs`.
//! 4. Print the scene format anew, as the head of `crates/scene/src/schema/mod.rs` says: it lists all
//!    functions.

use super::ExpressionError;

/// An operator or a function of up to three arguments; `log` is the natural logarithm, as `ln` is.
pub(super) struct Function {
    pub(super) name: &'static str,
    /// Signature; empty for an operator.
    pub(super) signature: &'static str,
    pub(super) arity: usize,
    pub(super) value: fn([f64; 3]) -> f64,
    /// Partial derivatives with respect to each argument.
    pub(super) partials: fn([f64; 3]) -> [f64; 3],
}

impl std::fmt::Debug for Function {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name)
    }
}

macro_rules! functions {
    (@table [] $($constant:ident)+) => {};
    (@table [$table:ident] $($constant:ident)+) => {
        pub(super) static $table: &[&Function] = &[$(&$constant),+];
    };
    ([$($table:ident)?] $($constant:ident $name:literal $signature:literal $arity:literal:
        |[$($a:ident),*]| $value:expr, $partials:expr;)+) => {
        $(
            pub(super) static $constant: Function = Function {
                name: $name,
                signature: $signature,
                arity: $arity,
                #[allow(unused_variables, reason = "the third argument of a function of two")]
                value: |arguments| {
                    let [$($a,)* ..] = arguments;
                    $value
                },
                #[allow(unused_variables, reason = "a constant derivative")]
                partials: |arguments| {
                    let [$($a,)* ..] = arguments;
                    let partials: [f64; $arity] = $partials;
                    let mut padded = [0.0; 3];
                    padded[..$arity].copy_from_slice(&partials);
                    padded
                },
            };
        )+
        functions!(@table [$($table)?] $($constant)+);
    };
}

/// `power log(base)`; zero for a power of zero, even at a base of zero.
pub(super) fn logarithm_times(power: f64, base: f64) -> f64 {
    if power == 0.0 { 0.0 } else { power * libm::log(base) }
}

/// Result of a comparison: 1 if it holds, else 0; NaN if one side is.
fn truth(a: f64, b: f64, holds: bool) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { f64::from(u8::from(holds)) }
}

fn sign_of(x: f64) -> f64 {
    if x.is_nan() || x == 0.0 { x } else { x.signum() }
}

fn progress(from: f64, to: f64, x: f64) -> f64 {
    ((x - from) / (to - from)).clamp(0.0, 1.0)
}

functions! {
    []
    NEGATE "-" "" 1: |[a]| -a, [-1.0];
    ADD "+" "" 2: |[a, b]| a + b, [1.0, 1.0];
    SUBTRACT "-" "" 2: |[a, b]| a - b, [1.0, -1.0];
    MULTIPLY "*" "" 2: |[a, b]| a * b, [b, a];
    DIVIDE "/" "" 2: |[a, b]| a / b, [1.0 / b, -a / (b * b)];
    POWER "^" "" 2:
        |[a, b]| libm::pow(a, b), [b * libm::pow(a, b - 1.0), logarithm_times(libm::pow(a, b), a)];
    LESS "<" "" 2: |[a, b]| truth(a, b, a < b), [0.0, 0.0];
    LESS_OR_EQUAL "<=" "" 2: |[a, b]| truth(a, b, a <= b), [0.0, 0.0];
    GREATER ">" "" 2: |[a, b]| truth(a, b, a > b), [0.0, 0.0];
    GREATER_OR_EQUAL ">=" "" 2: |[a, b]| truth(a, b, a >= b), [0.0, 0.0];
}

functions! {
    [FUNCTIONS]
    SIN "sin" "sin(a)" 1: |[a]| libm::sin(a), [libm::cos(a)];
    COS "cos" "cos(a)" 1: |[a]| libm::cos(a), [-libm::sin(a)];
    TAN "tan" "tan(a)" 1: |[a]| libm::tan(a), [1.0 + libm::tan(a) * libm::tan(a)];
    ASIN "asin" "asin(a)" 1: |[a]| libm::asin(a), [1.0 / (1.0 - a * a).sqrt()];
    ACOS "acos" "acos(a)" 1: |[a]| libm::acos(a), [-1.0 / (1.0 - a * a).sqrt()];
    ATAN "atan" "atan(a)" 1: |[a]| libm::atan(a), [1.0 / (1.0 + a * a)];
    ATAN2 "atan2" "atan2(y, x)" 2: |[y, x]| libm::atan2(y, x), [x / (x * x + y * y), -y / (x * x + y * y)];
    SINH "sinh" "sinh(a)" 1: |[a]| libm::sinh(a), [libm::cosh(a)];
    COSH "cosh" "cosh(a)" 1: |[a]| libm::cosh(a), [libm::sinh(a)];
    TANH "tanh" "tanh(a)" 1: |[a]| libm::tanh(a), [1.0 - libm::tanh(a) * libm::tanh(a)];
    EXP "exp" "exp(a)" 1: |[a]| libm::exp(a), [libm::exp(a)];
    LN "ln" "ln(a)" 1: |[a]| libm::log(a), [1.0 / a];
    LOG "log" "log(a)" 1: |[a]| libm::log(a), [1.0 / a];
    SQRT "sqrt" "sqrt(a)" 1: |[a]| a.sqrt(), [0.5 / a.sqrt()];
    ABS "abs" "abs(a)" 1: |[a]| a.abs(), [sign_of(a)];
    SIGN "sign" "sign(a)" 1: |[a]| sign_of(a), [0.0];
    FLOOR "floor" "floor(a)" 1: |[a]| a.floor(), [0.0];
    MIN "min" "min(a, b)" 2: |[a, b]| if a.is_nan() || a < b { a } else { b },
        if a.is_nan() || a < b { [1.0, 0.0] } else { [0.0, 1.0] };
    MAX "max" "max(a, b)" 2: |[a, b]| if a.is_nan() || a > b { a } else { b },
        if a.is_nan() || a > b { [1.0, 0.0] } else { [0.0, 1.0] };
    CLAMP "clamp" "clamp(x, low, high)" 3:
        |[x, low, high]| if x < low { low } else if x > high { high } else { x },
        if x < low { [0.0, 1.0, 0.0] } else if x > high { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    STEP "step" "step(edge, x)" 2: |[edge, x]| truth(edge, x, x >= edge), [0.0, 0.0];
    SMOOTHSTEP "smoothstep" "smoothstep(from, to, x)" 3:
        |[from, to, x]| { let s = progress(from, to, x); s * s * (3.0 - 2.0 * s) },
        {
            let s = progress(from, to, x);
            let slope = 6.0 * s * (1.0 - s) / (to - from);
            [slope * (s - 1.0), -slope * s, slope]
        };
    PULSE "pulse" "pulse(from, to, x)" 3:
        |[from, to, x]| truth(from + to, x, from <= x && x < to), [0.0, 0.0, 0.0];
    IF "if" "if(condition, then, otherwise)" 3:
        |[c, a, b]| if c.is_nan() { c } else if c != 0.0 { a } else { b },
        if c != 0.0 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
}

/// Signatures of all functions: `sin(a)`.
pub fn signatures() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|function| function.signature)
}

pub(super) fn function(name: &str) -> Option<&'static Function> {
    FUNCTIONS.iter().copied().find(|function| function.name == name)
}

impl Function {
    /// True if the value can jump while the arguments are continuous.
    pub(super) fn jumps(&self) -> bool {
        const JUMPING: &[&str] = &["<", "<=", ">", ">=", "sign", "floor", "step", "pulse", "if"];
        JUMPING.contains(&self.name)
    }

    /// Checks the number of arguments.
    pub(super) fn takes(&self, count: usize, place: std::ops::Range<usize>) -> Result<(), ExpressionError> {
        if count == self.arity {
            return Ok(());
        }
        Err(ExpressionError::Arguments { name: self.name, signature: self.signature, found: count, place })
    }
}
