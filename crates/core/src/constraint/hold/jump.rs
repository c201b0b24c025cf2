//! Detection of jumps in prescribed motion.

use super::{Hold, PrescribedMotion};
use crate::constraint::motion::Moment;

/// A step is examined if a vertex moves farther than the velocities at both ends of the step predict, by
/// this fraction of the prediction.
const SUSPICIOUS: f64 = 1e-3;
/// Additional allowance for rounding, as a fraction of the distance from the origin.
const ROUNDING: f64 = 1e-12;
/// Fraction of the excess distance that remains at a jump when the interval can no longer be halved; a
/// continuous motion leaves next to nothing.
const LEFT: f64 = 1e-3;

/// A jump of coordinates under prescribed motion.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Jump {
    /// Time of the jump, bit-exact [s].
    pub(crate) time: f64,
    /// Largest displacement component [m].
    pub(crate) size: f64,
    /// Name of the pin.
    pub(crate) hold: String,
    /// Indices in a flat array, and displacements [m].
    pub(crate) coordinates: Vec<(usize, f64)>,
}

impl Hold {
    /// Returns the largest jump of each vertex in the interval (`from`, `to`] [s]; `None` without any.
    /// Continuous motions and drives are skipped.
    pub(crate) fn jump(&self, from: f64, to: f64, dimension: usize) -> Option<Jump> {
        let PrescribedMotion { motion, start, rest } =
            self.motion.as_ref().filter(|moved| self.drive.is_none() && !moved.motion.is_continuous())?;
        let (before, after) = (motion.at(from), motion.at(to));
        let (mut when, mut size, mut coordinates) = (to, 0.0, vec![]);
        for ((vertex, start), rest) in self.vertices.iter().zip(start).zip(rest) {
            let place = |moment: &Moment<'_>| moment.place(*start, *rest);
            let excess = excess(place(&before), place(&after), to - from);
            if excess == 0.0 {
                continue;
            }
            let (time, distance) = narrowed(|time| place(&motion.at(time)).0, from, to);
            for c in (0..dimension).filter(|c| self.axes[*c] && distance[*c].abs() > LEFT * excess) {
                if distance[c].abs() > size {
                    (when, size) = (time, distance[c].abs());
                }
                coordinates.push((*vertex as usize * dimension + c, distance[c]));
            }
        }
        let hold = || self.name.clone();
        (!coordinates.is_empty()).then(|| Jump { time: when, size, hold: hold(), coordinates })
    }
}

/// Returns the excess of the distance between two positions over that predicted by their velocities in
/// `h` [s]; zero if the motion may be smooth. NaN is not a jump, as a step to it fails.
fn excess(before: ([f64; 3], [f64; 3]), after: ([f64; 3], [f64; 3]), h: f64) -> f64 {
    let of_component = |c: usize| {
        let smooth = 0.5 * h * (before.1[c] + after.1[c]);
        let most = SUSPICIOUS * h * (before.1[c].abs() + after.1[c].abs()) + ROUNDING * after.0[c].abs();
        let excess = (after.0[c] - before.0[c] - smooth).abs();
        if excess > most { excess } else { 0.0 }
    };
    [0, 1, 2].map(of_component).into_iter().fold(0.0, f64::max)
}

/// Bisects the interval from `from` to `to` [s] towards the largest displacement until it cannot be
/// halved; returns the time and the displacement [m].
fn narrowed(place: impl Fn(f64) -> [f64; 3], mut from: f64, mut to: f64) -> (f64, [f64; 3]) {
    let difference = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|c| b[c] - a[c]);
    let length = |d: [f64; 3]| d.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
    let (mut before, mut after) = (place(from), place(to));
    loop {
        let middle = 0.5 * (from + to);
        if middle <= from || middle >= to {
            return (to, difference(before, after));
        }
        let there = place(middle);
        if length(difference(before, there)) >= length(difference(there, after)) {
            (to, after) = (middle, there);
        } else {
            (from, before) = (middle, there);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::Motion;

    fn hold(x: impl Fn(f64) -> (f64, f64) + Send + Sync + 'static) -> Hold {
        let path = move |t: f64| {
            let (x, v) = x(t);
            ([x, 0.0, -2.0 * x], [v, 0.0, -2.0 * v])
        };
        let zero = [0.0; 6];
        Hold::new("pin", vec![1]).moving(Motion::new().along(path), &zero, &zero, 3)
    }

    #[test]
    fn a_jump_is_found_where_and_as_large_as_it_is_beside_a_motion() {
        let hold = hold(|t| (t * t + if t < 0.7314 { 0.0 } else { 0.25 }, 2.0 * t));
        let jump = hold.jump(0.7, 0.8, 3).unwrap();
        assert_eq!((jump.time, jump.hold.as_str()), (0.7314, "pin"));
        let expected = [(3, 0.25), (5, -0.5)];
        for ((i, found), (j, distance)) in jump.coordinates.iter().zip(expected) {
            assert!(*i == j && (found - distance).abs() < 1e-12, "{jump:?}");
        }
        assert!(jump.coordinates.len() == 2 && (jump.size - 0.5).abs() < 1e-12, "{jump:?}");
        assert_eq!(hold.jump(0.5, 0.7, 3), None);
        assert_eq!(hold.jump(0.8, 0.9, 3), None);
        // What happens at the end of a step belongs to it.
        assert!(hold.jump(0.7, 0.7314, 3).is_some() && hold.jump(0.7314, 0.8, 3).is_none());
    }

    /// Unresolved oscillation, a kink and a steep slope are not jumps.
    #[test]
    fn what_is_continuous_does_not_jump() {
        let shake = hold(|t| ((90.0 * t).sin(), 90.0 * (90.0 * t).cos()));
        let kink = hold(|t| ((t - 0.5).abs(), (t - 0.5).signum()));
        let slope = hold(|t| ((1e6 * (t - 0.5)).tanh(), 1e6 / (1e6 * (t - 0.5)).cosh().powi(2)));
        for hold in [shake, kink, slope] {
            for step in 0..10 {
                let from = 0.1 * f64::from(step) + 0.03;
                assert_eq!(hold.jump(from, from + 0.1, 3), None);
            }
        }
    }
}
