//! Kinds of quantities in scenes.

use super::{Dimension, Quantity, QuantityError};

/// A kind of quantity: its name, its SI unit, an example.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Name with its article: `a pressure`.
    pub name: &'static str,
    /// The SI unit that plain numbers are in: `Pa`.
    pub unit: &'static str,
    /// A valid example: `3 MPa`.
    pub example: &'static str,
    /// The dimension of `unit`.
    pub dimension: Dimension,
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $constant:ident = $name:literal $unit:literal $example:literal
        [$length:literal $mass:literal $time:literal $angle:literal];)+) => {
        impl Kind {
            $(
                $(#[$doc])*
                pub const $constant: Kind = Kind {
                    name: $name,
                    unit: $unit,
                    example: $example,
                    dimension: Dimension::new($length, $mass, $time, $angle),
                };
            )+

            /// All kinds. The first kind of a dimension gives a text of that dimension its name in
            /// messages.
            pub const ALL: &[Kind] = &[$(Kind::$constant,)+];
        }
    };
}

kinds! {
    /// Length [m].
    LENGTH = "a length" "m" "3 cm" [1 0 0 0];
    /// Area [m^2].
    AREA = "an area" "m^2" "2 cm^2" [2 0 0 0];
    /// Volume [m^3].
    VOLUME = "a volume" "m^3" "2 l" [3 0 0 0];
    /// Mass [kg].
    MASS = "a mass" "kg" "200 g" [0 1 0 0];
    /// Time [s].
    TIME = "a time" "s" "0.1 ms" [0 0 1 0];
    /// Angle [rad].
    ANGLE = "an angle" "rad" "90 deg" [0 0 0 1];
    /// Velocity [m/s].
    VELOCITY = "a velocity" "m/s" "5 km/h" [1 0 -1 0];
    /// Angular velocity [rad/s].
    ANGULAR_VELOCITY = "an angular velocity" "rad/s" "90 deg/s" [0 0 -1 1];
    /// Acceleration [m/s^2].
    ACCELERATION = "an acceleration" "m/s^2" "-9.81 m/s^2" [1 0 -2 0];
    /// Events or decay per time [1/s].
    RATE = "a rate" "1/s" "60 Hz" [0 0 -1 0];
    /// Force [N].
    FORCE = "a force" "N" "2 kN" [1 1 -2 0];
    /// Pressure, stress, elastic modulus [Pa].
    PRESSURE = "a pressure" "Pa" "3 MPa" [-1 1 -2 0];
    /// Change of volume per pressure [1/Pa].
    COMPRESSIBILITY = "a compressibility" "1/Pa" "2e-3 1/MPa" [1 -1 2 0];
    /// Force per volume [N/m^3].
    FORCE_DENSITY = "a force per volume" "N/m^3" "2 kN/m^3" [-2 1 -2 0];
    /// Spring constant [N/m].
    STIFFNESS = "a stiffness" "N/m" "2 kN/m" [0 1 -2 0];
    /// Viscosity [Pa s].
    VISCOSITY = "a viscosity" "Pa s" "50 Pa s" [-1 1 -1 0];
    /// Force per velocity [N s/m].
    DASHPOT = "a damping constant" "N s/m" "0.2 N s/m" [0 1 -1 0];
    /// Energy [J].
    ENERGY = "an energy" "J" "2 kJ" [2 1 -2 0];
    /// Bending stiffness of a sheet, a moment per curvature and width [N m].
    PLATE_STIFFNESS = "a bending stiffness of a sheet" "N m" "0.1 N m" [2 1 -2 0];
    /// Bending stiffness of a strand, a moment per curvature [N m^2].
    BEAM_STIFFNESS = "a bending stiffness of a strand" "N m^2" "1e-3 N m^2" [3 1 -2 0];
    /// Power [W].
    POWER = "a power" "W" "2 kW" [2 1 -3 0];
    /// Mass per volume [kg/m^3].
    DENSITY = "a density" "kg/m^3" "1.2 g/cm^3" [-3 1 0 0];
    /// Mass per area [kg/m^2].
    AREA_DENSITY = "a mass per area" "kg/m^2" "150 g/m^2" [-2 1 0 0];
    /// Mass per length [kg/m].
    LINEAR_DENSITY = "a mass per length" "kg/m" "20 g/m" [-1 1 0 0];
    /// Newton's constant [m^3/(kg s^2)].
    GRAVITATIONAL_CONSTANT = "a gravitational constant" "m^3/(kg s^2)" "6.6743e-11 m^3/(kg s^2)" [3 -1 -2 0];
    /// A pure number.
    NUMBER = "a number without a unit" "1" "0.5" [0 0 0 0];
}

impl Kind {
    /// Parses `text` to a number in SI units; a plain number is in SI units already.
    ///
    /// ```
    /// use pliant::quantity::Kind;
    /// assert_eq!(Kind::PRESSURE.parse("3 MPa"), Ok(3e6));
    /// assert_eq!(Kind::PRESSURE.parse("3e6"), Ok(3e6));
    /// let wrong = Kind::PRESSURE.parse("3 m").unwrap_err();
    /// assert_eq!(wrong.to_string(), "`3 m` is a length [m], not a pressure [Pa]");
    /// ```
    ///
    /// # Errors
    /// `text` is not a quantity, or has another dimension.
    pub fn parse(&self, text: &str) -> Result<f64, QuantityError> {
        Ok(Kind::parse_any(std::slice::from_ref(self), text)?.value)
    }

    /// Parses `text` to a quantity of one of `kinds`, or a plain number.
    ///
    /// # Errors
    /// `text` is not a quantity, or has another dimension.
    pub fn parse_any(kinds: &[Kind], text: &str) -> Result<Quantity, QuantityError> {
        let quantity: Quantity = text.parse()?;
        match quantity.dimension {
            Some(dimension) if !kinds.iter().any(|kind| kind.dimension == dimension) => {
                Err(QuantityError::WrongDimension {
                    text: text.trim().to_owned(),
                    found: dimension,
                    expected: kinds.to_vec(),
                })
            }
            _ => Ok(quantity),
        }
    }

    /// `a pressure [Pa]`.
    pub fn described(&self) -> String {
        format!("{} [{}]", self.name, self.unit)
    }

    /// `a length [m]`; a dimension without a name is described by its unit alone.
    pub(super) fn of(dimension: Dimension) -> String {
        match Kind::ALL.iter().find(|kind| kind.dimension == dimension) {
            Some(kind) if kind.dimension == Dimension::default() => kind.name.to_owned(),
            Some(kind) => kind.described(),
            None => format!("in [{dimension}]"),
        }
    }
}
