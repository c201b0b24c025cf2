//! Values against arithmetic, derivatives against differences, error positions.

use super::function::FUNCTIONS;
use super::*;

fn parsed(text: &str) -> Expression {
    Expression::parse(text, Variable::ALL).unwrap_or_else(|error| panic!("{text}: {error}"))
}

const X: [f64; 3] = [0.25, -1.5, 3.0];
const T: f64 = 0.5;

#[test]
fn values() {
    for (text, expected) in [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("8 - 3 - 2", 3.0),
        ("8 / 4 / 2", 1.0),
        ("-2^2", -4.0),
        ("2^-2", 0.25),
        ("2**3", 8.0),
        ("-2 * -3", 6.0),
        ("+4 - +3", 1.0),
        ("2 * t + x - y / z", 2.0 * T + 0.25 + 0.5),
        (" 1e3*t ", 500.0),
        (".5", 0.5),
        ("pi", std::f64::consts::PI),
        ("t < 1", 1.0),
        ("1 <= 0.5 + 0.5", 1.0),
        ("2 > 3", 0.0),
        ("2 >= 3", 0.0),
        ("if(t < 1, 10, 20)", 10.0),
        ("if(t>=1,10,20)", 20.0),
        ("min(3, -2) + max(3, -2)", 1.0),
        ("clamp(5, 0, 1) + clamp(-5, 0, 1) + clamp(0.25, 0, 1)", 1.25),
        ("step(0.5, t) + step(0.6, t)", 1.0),
        ("smoothstep(0, 1, t) + smoothstep(0, 1, 2) + smoothstep(0, 1, -2)", 1.5),
        ("smoothstep(0, 1, 0.25)", 3.0 * 0.0625 - 2.0 * 0.015625),
        ("pulse(0.5, 1, t) + pulse(0, 0.5, t)", 1.0),
        ("sqrt(16) + abs(-2) + sign(-3) + floor(-0.5)", 4.0),
        ("sin(0) + cos(0) + tan(0) + exp(0) + ln(1)", 2.0),
        ("atan2(0, 1) + asin(0) + atan(0) + sinh(0) + cosh(0) + tanh(0) + acos(1)", 1.0),
        ("sign(0)", 0.0),
    ] {
        assert_eq!(parsed(text).value(X, T), expected, "{text}");
    }
    let ramp = parsed("-9.81 * (1 - exp(-t/0.1))");
    assert!((ramp.value(X, 0.1) + 9.81 * (1.0 - (-1.0_f64).exp())).abs() < 1e-14);
    for text in [
        "0/0",
        "ln(-1)",
        "min(0/0, 1)",
        "max(1, 0/0)",
        "clamp(0/0, 0, 1)",
        "if(0/0, 1, 2)",
        "0/0 < 1",
        "sign(0/0)",
    ] {
        assert!(parsed(text).value(X, T).is_nan(), "{text}");
    }
}

/// The functions' bits come from `libm`, not from the platform: its exp(1) is the number after the one
/// nearest to e, while C libraries return the nearest; the others are the nearest.
#[test]
fn the_same_bits_everywhere() {
    for (text, bits) in [
        ("sin(1)", 0x3FEA_ED54_8F09_0CEE_u64),
        ("exp(1)", 0x4005_BF0A_8B14_576A),
        ("cos(2)", 0xBFDA_A226_5753_7205),
    ] {
        assert_eq!(parsed(text).value(X, T).to_bits(), bits, "{text}");
    }
}

/// A formula with every function in it, at a time without kinks. The error of central differences is of
/// order h^2: halving h must leave a quarter of it.
#[test]
fn rates_are_the_limits_of_differences() {
    let of = |name: &str| match name {
        "step" | "atan2" | "min" | "max" => format!("{name}(0.3 + t, 1.2 * sin(t) * t)"),
        "clamp" => {
            "clamp(sin(3*t), 0.1 * t, 1.5 + t) + clamp(-t, -t*t, 5) + clamp(9 * t, 0, t*t*t)".to_owned()
        }
        "smoothstep" => "smoothstep(0.1 * t, 1 + t*t, sin(t))".to_owned(),
        "pulse" | "if" => format!("{name}(t, sin(3*t), t*t*t)"),
        name => format!("{name}(0.7 * sin(t) + 0.1)"),
    };
    let mut texts: Vec<String> = FUNCTIONS.iter().map(|function| of(function.name)).collect();
    texts.extend(
        ["t^3 / (1 + t) - 2 / t", "(1 + t)^(2 * t)", "2^t", "-(t < 3) * t * x", "t * exp(-t / 0.1)"]
            .map(String::from),
    );
    for text in texts {
        let formula = parsed(&text);
        let exact = formula.rate(X, T);
        let error = |h: f64| (formula.value(X, T + h) - formula.value(X, T - h)) / (2.0 * h) - exact;
        let (coarse, fine) = (error(2e-3), error(1e-3));
        if coarse.abs() < 1e-9 {
            assert!(fine.abs() < 1e-9, "{text}: {fine}");
        } else {
            assert!((coarse / fine - 4.0).abs() < 0.05, "{text}: {coarse} {fine}, rate {exact}");
        }
    }
    // At the edge of the domain the constant exponent's infinite derivative is not used.
    assert_eq!(parsed("t^2").rate(X, 0.0), 0.0);
    assert_eq!(parsed("x^2").rate([0.0; 3], 0.0), 0.0);
}

#[test]
fn mistakes_have_their_place() {
    for (text, place, message) in [
        ("", 0..0, "expected a number, a name or `(`, found the end"),
        ("1 +", 3..3, "expected a number, a name or `(`, found the end"),
        ("1 + * 2", 4..5, "expected a number, a name or `(`, found `*`"),
        ("--t", 1..2, "expected a number, a name or `(`, found `-`"),
        ("9.81 m", 5..6, "expected an operator or the end, found `m`"),
        ("2 t", 2..3, "expected an operator or the end, found `t`"),
        ("(1 + 2", 6..6, "expected `)` or an operator, found the end"),
        ("1 + 2)", 5..6, "expected an operator or the end, found `)`"),
        ("sin t", 4..5, "expected `(` and the arguments of the function, found `t`"),
        ("sin()", 4..5, "expected a number, a name or `(`, found `)`"),
        ("min(1 2)", 6..7, "expected `,`, `)` or an operator, found `2`"),
        ("1 + sin(1, 2)", 4..7, "`sin` takes 1 argument, found 2"),
        ("clamp(1)", 0..5, "`clamp` takes 3 arguments, found 1"),
        ("2 * omega", 4..9, "unknown name `omega`"),
        ("t^2^3", 3..4, "expected parentheses (`a^b^c` can be read in two ways), found `^`"),
        ("1e400", 0..5, "the number is too large"),
        ("1.", 1..2, "expected an operator or the end, found `.`"),
        ("µ + 1", 0..2, "unknown name `µ`"),
        ("t = 1", 2..3, "expected an operator or the end, found `=`"),
    ] {
        let error = Expression::parse(text, Variable::ALL).expect_err(text);
        assert_eq!((error.to_string().as_str(), error.place()), (message, place), "{text}");
    }
    let error = Expression::parse("x + t", Variable::TIME).unwrap_err();
    assert!(
        matches!(&error, ExpressionError::UnknownName { known, .. } if *known == ["t", "pi"]),
        "{error:?}"
    );
}

/// Sums of x^k have closed forms: a long formula needs no deep stack.
#[test]
fn length_is_not_depth() {
    let sum = |n: usize, term: &dyn Fn(usize) -> String| (1..=n).map(term).collect::<Vec<_>>().join(" + ");
    // n terms, products, powers and functions; the longest has 52 kB of the 64 KiB limit.
    for n in [120, 400, 4_000] {
        let exact = n as f64;
        assert_eq!(parsed(&sum(n, &|_| "1".into())).value(X, T), exact);
        assert_eq!(parsed(&sum(n, &|_| "2*t^1*1".into())).value(X, T), exact);
        assert_eq!(parsed(&sum(n, &|_| "cos(0*t)".into())).value(X, T), exact);
        assert_eq!(parsed(&sum(n, &|_| "(2^-1 + t)".into())).value(X, T), exact);
        assert_eq!(parsed(&sum(n, &|k| format!("{k}*t"))).rate(X, T), exact * (exact + 1.0) / 2.0);
        assert_eq!(parsed(&vec!["1"; n].join("*")).value(X, T), 1.0);
    }
    assert_eq!(parsed(&format!("1{}", " ".repeat(60_000))).value(X, T), 1.0);
}

/// Deep nesting overflows neither the stack of the parser nor that of the evaluation.
#[test]
fn depth_is_bounded() {
    for text in [
        "(".repeat(999),
        format!("{}1{}", "sin(".repeat(17), ")".repeat(17)),
        format!("{}t", "1+(".repeat(300)),
        "1".repeat(1001),
        "2^-".repeat(100_000),
        "(".repeat(100_000),
        "-(".repeat(100_000),
        "if(0,0,1+2*3^(".repeat(15),
        "1-".repeat(499) + "1",
        "2^-".repeat(333) + "1",
        format!("{}1", "1<".repeat(400)),
    ] {
        let _ = Expression::parse(&text, Variable::ALL);
    }
    assert_eq!(parsed(&("1-".repeat(499) + "1")).value(X, T), -498.0);
    let deepest = format!("{}t{}", "1+(".repeat(16), ")".repeat(16));
    assert_eq!(parsed(&deepest).value(X, T), 16.5);
    assert!(Expression::parse(&format!("1+({deepest})"), Variable::ALL).is_err());
    let balanced = format!("{}1{}", "2^-".repeat(300), "");
    assert!(Expression::parse(&balanced, Variable::ALL).is_err());
}

#[test]
fn what_jumps_is_known_by_its_functions() {
    for text in
        ["step(1, t)", "t < 0.5", "t * (t >= 2)", "if(t, 1, 2)", "floor(t)", "sign(t)", "sin(pulse(0, 1, t))"]
    {
        assert!(!Expression::parse(text, Variable::TIME).unwrap().is_continuous(), "{text}");
    }
    for text in ["smoothstep(0, 1, t)", "abs(t) - min(t, 1)", "clamp(t, 0, 1)^2", "sin(2*pi*t)", "-t"] {
        assert!(Expression::parse(text, Variable::TIME).unwrap().is_continuous(), "{text}");
    }
}
