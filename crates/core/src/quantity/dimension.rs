//! Dimensions: powers of metre, kilogram, second and radian.

use std::fmt;

/// Powers of the base units m, kg, s and rad.
///
/// An angle is a dimension of its own, although the SI counts it as a number: a frequency in hertz taken for
/// an angular velocity is wrong by a factor of 2 pi.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimension {
    /// Power of the metre.
    pub length: i32,
    /// Power of the kilogram.
    pub mass: i32,
    /// Power of the second.
    pub time: i32,
    /// Power of the radian.
    pub angle: i32,
}

impl Dimension {
    /// Largest power of a base unit: more is a typing mistake.
    pub(super) const LARGEST: i32 = 9;

    pub(super) const fn new(length: i32, mass: i32, time: i32, angle: i32) -> Self {
        Dimension { length, mass, time, angle }
    }

    /// The dimension of `self^power`; `None` beyond the power 9 of a base unit.
    pub(super) fn power(self, power: i32) -> Option<Self> {
        let raised = |exponent: i32| {
            exponent.checked_mul(power).filter(|e| (-Self::LARGEST..=Self::LARGEST).contains(e))
        };
        Some(Dimension {
            length: raised(self.length)?,
            mass: raised(self.mass)?,
            time: raised(self.time)?,
            angle: raised(self.angle)?,
        })
    }

    /// The dimension of a product; `None` beyond the power 9 of a base unit.
    pub(super) fn times(self, other: Self) -> Option<Self> {
        Dimension {
            length: self.length + other.length,
            mass: self.mass + other.mass,
            time: self.time + other.time,
            angle: self.angle + other.angle,
        }
        .power(1)
    }
}

/// Formats as a unit: `kg/(m s^2)`.
impl fmt::Display for Dimension {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let powers = [(self.length, "m"), (self.mass, "kg"), (self.time, "s"), (self.angle, "rad")];
        let side = |sign: i32| -> Vec<String> {
            let some = powers.iter().filter(|(power, _)| power * sign > 0);
            some.map(|(power, unit)| match power * sign {
                1 => (*unit).to_owned(),
                power => format!("{unit}^{power}"),
            })
            .collect()
        };
        let (above, below) = (side(1), side(-1));
        formatter.write_str(&if above.is_empty() { "1".to_owned() } else { above.join(" ") })?;
        match below.as_slice() {
            [] => Ok(()),
            [one] => write!(formatter, "/{one}"),
            several => write!(formatter, "/({})", several.join(" ")),
        }
    }
}
