//! Jumps of prescribed motion.

use super::{Hold, PrescribedMotion};
use crate::constraint::motion::Moment;

/// A motion is looked at more closely where a vertex goes farther than its velocities at both ends of a step
/// say, by this part of that.
const SUSPICIOUS: f64 = 1e-3;
/// And by this part of how far it is from the origin: rounding.
const ROUNDING: f64 = 1e-12;
/// Part of the distance that is left once the time between is too short to be halved, as a part of what was
/// suspicious, is a jump; of a motion without one, next to nothing is left.
const LEFT: f64 = 1e-3;

/// Coordinates that a prescribed motion moves at once.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Jump {
    /// When, to the last bit [s].
    pub(crate) time: f64,
    /// How far the farthest component goes [m].
    pub(crate) size: f64,
    /// Name of the hold.
    pub(crate) hold: String,
    /// Numbers of coordinates in a flat array, and how far each goes [m].
    pub(crate) coordinates: Vec<(usize, f64)>,
}

impl Hold {
    /// The largest jump of each vertex after the time `from`, at the latest at `to` [s]; `None` without any.
    /// A continuous motion is not looked at; a drive is one.
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

/// How much farther it is between two places than the velocities there say over `h` [s]; zero where that may
/// be a smooth motion. Not a number is no jump: a step that leads there is not taken.
fn excess(before: ([f64; 3], [f64; 3]), after: ([f64; 3], [f64; 3]), h: f64) -> f64 {
    let of_component = |c: usize| {
        let smooth = 0.5 * h * (before.1[c] + after.1[c]);
        let most = SUSPICIOUS * h * (before.1[c].abs() + after.1[c].abs()) + ROUNDING * after.0[c].abs();
        let excess = (after.0[c] - before.0[c] - smooth).abs();
        if excess > most { excess } else { 0.0 }
    };
    [0, 1, 2].map(of_component).into_iter().fold(0.0, f64::max)
}

/// Halves the time from `from` to `to` [s] to where the place goes farthest, until it cannot be halved: when
/// that is, and how far [m].
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

    /// A shake that no step resolves, a kink and a steep slope are none.
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
