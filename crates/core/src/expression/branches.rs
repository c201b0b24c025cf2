//! Times at which a formula takes another branch: kinks, jumps, ends of ramps.

use super::{Expression, Function, Variable};

/// Number of intervals that a formula is sampled in: two changes within one interval show as one or none.
const INTERVALS: usize = 1024;

impl Expression {
    /// Times in `from < t < to` [s], ascending, at which the formula changes its branch: a kink or an end
    /// of `min`, `max`, `abs`, `clamp` and `smoothstep`, a jump of `step`, `pulse`, `if` and comparisons,
    /// or a new value of `floor` and `sign`. A time is exact to the last bit: a change lies between two
    /// neighbouring numbers, and the one with fewer digits is returned, which is the number in the text
    /// if it is there.
    ///
    /// The range is sampled in 1024 intervals: two changes within one may be missed. A formula of
    /// position has no branch times, because they differ from point to point.
    pub fn branch_times(&self, from: f64, to: f64) -> Vec<f64> {
        if self.depends_on_place() || from.is_nan() || to.is_nan() || from >= to {
            return vec![];
        }
        let time =
            |i: usize| if i == INTERVALS { to } else { from + (to - from) * (i as f64 / INTERVALS as f64) };
        let mut times = vec![];
        let mut before = self.branches(from);
        for i in 1..=INTERVALS {
            let (mut low, mut high) = (time(i - 1), time(i));
            let after = self.branches(high);
            if after != before {
                // Until the two are neighbours, or closer than rounding of the range allows.
                while high - low > f64::EPSILON * low.abs().max(high.abs()).max(f64::EPSILON * (to - from)) {
                    let middle = 0.5 * (low + high);
                    if self.branches(middle) == before { low = middle } else { high = middle }
                }
                let rounder = if digits(low) < digits(high) { low } else { high };
                times.push(rounder);
            }
            before = after;
        }
        times.dedup();
        times.retain(|time| *time > from && *time < to);
        times
    }

    /// A hash of the branches taken at the time `t` [s].
    fn branches(&self, t: f64) -> u64 {
        let mut taken = 0_u64;
        self.evaluate_watched(
            |variable| if variable == Variable::T { t } else { 0.0 },
            |function, arguments| {
                if let Some(branch) = function.branch(arguments) {
                    // Knuth's multiplier: different sequences hardly ever collide.
                    let number = (branch as u64).wrapping_add(1);
                    taken = taken.wrapping_add(number).wrapping_mul(6_364_136_223_846_793_005);
                }
            },
        );
        taken
    }
}

/// Number of characters of a number in decimal notation.
fn digits(time: f64) -> usize {
    time.to_string().len()
}

impl Function {
    /// The branch taken for these arguments; `None` for a function with a single branch.
    fn branch(&self, [a, b, c]: [f64; 3]) -> Option<i64> {
        let place = |x: f64, low: f64, high: f64| i64::from(x >= low) + i64::from(x >= high);
        Some(match self.name {
            "<" | "<=" | ">" | ">=" | "step" | "pulse" | "sign" | "floor" => (self.value)([a, b, c]) as i64,
            "abs" => i64::from(a >= 0.0),
            "min" | "max" => i64::from(a < b),
            "clamp" => place(a, b, c),
            "smoothstep" => place(c, a, b),
            "if" => i64::from(a != 0.0),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(text: &str) -> Vec<f64> {
        Expression::parse(text, Variable::AT_REST).unwrap().branch_times(0.0, 5.0)
    }

    #[test]
    fn branches_change_at_the_times_in_the_text() {
        let cases: [(&str, &[f64]); 12] = [
            ("3 * min(t, 4.5)", &[4.5]),
            ("max(t - 0.3, 0)", &[0.3]),
            ("clamp(t, 0.1, 1.7)", &[0.1, 1.7]),
            ("smoothstep(0.2, 0.7, t)", &[0.2, 0.7]),
            ("step(1.1, t) - pulse(2.3, 2.4, t)", &[1.1, 2.3, 2.4]),
            ("if(t < 0.6, t, 0.6)", &[0.6]),
            ("if(t <= 0.6, t, 0.6)", &[0.6]),
            ("abs(t - 2.2)", &[2.2]),
            ("floor(t)", &[1.0, 2.0, 3.0, 4.0]),
            ("sign(sin(pi * t / 2))", &[2.0, 4.0]),
            ("t^2 + sin(t)", &[]),
            // The times differ from point to point.
            ("min(t, X)", &[]),
        ];
        for (text, expected) in cases {
            let found = times(text);
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-15 * b;
            assert!(
                found.len() == expected.len() && found.iter().zip(expected).all(near),
                "{text}: {found:?}"
            );
            if !text.contains("sin(pi") {
                assert_eq!(found, expected, "{text}");
            }
        }
    }
}
