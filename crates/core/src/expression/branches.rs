//! Times at which a formula takes another branch: kinks, jumps, ends of ramps.

use super::{Expression, Function, Variable};

/// Intervals that a formula is looked at in: two changes within one show as one or none.
const INTERVALS: usize = 1024;

impl Expression {
    /// Times in `from < t < to` [s], ascending, at which the formula takes another branch: where `min`,
    /// `max`, `abs`, `clamp` and `smoothstep` have a kink or an end, `step`, `pulse`, `if` and comparisons
    /// a jump, or `floor` and `sign` another value. To the last bit; of the two neighbours that a change
    /// lies between the one with fewer digits, which is that in the text where it is there.
    ///
    /// The range is looked at in 1024 parts: two changes within one of these may be missed. Of a formula of
    /// the place, which changes elsewhere at other times, there are none.
    pub fn branch_times(&self, from: f64, to: f64) -> Vec<f64> {
        if self.depends_on_place() || !(from < to) {
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
                // Between neighbours, or as near to zero as makes no difference.
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

    /// The branches that it takes at the time `t` [s], as one number.
    fn branches(&self, t: f64) -> u64 {
        let mut taken = 0_u64;
        self.evaluate_watched(
            |variable| if variable == Variable::T { t } else { 0.0 },
            |function, arguments| {
                if let Some(branch) = function.branch(arguments) {
                    // A hash of Knuth's: different sequences hardly ever meet.
                    taken = taken
                        .wrapping_add(branch as u64)
                        .wrapping_add(1)
                        .wrapping_mul(6_364_136_223_846_793_005);
                }
            },
        );
        taken
    }
}

/// Digits that a number is written with.
fn digits(time: f64) -> usize {
    time.to_string().len()
}

impl Function {
    /// The branch that it takes; `None` where it has but one.
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
            // Elsewhere it is at other times.
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
