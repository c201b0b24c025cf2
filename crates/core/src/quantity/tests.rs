//! Values, dimensions and error messages of quantities.

use super::*;

fn value(text: &str) -> f64 {
    text.parse::<Quantity>().unwrap_or_else(|error| panic!("{text}: {error}")).value
}

fn refused(text: &str) -> QuantityError {
    text.parse::<Quantity>().expect_err(text)
}

#[test]
fn every_kind_reads_its_own_unit_and_its_example() {
    for kind in Kind::ALL {
        assert_eq!(kind.parse("2.5"), Ok(2.5), "{kind:?}");
        let unit: Quantity = format!("1 {}", kind.unit).parse().unwrap();
        assert_eq!((unit.value, unit.dimension), (1.0, Some(kind.dimension)), "{kind:?}");
        assert!(kind.parse(kind.example).is_ok(), "{kind:?}");
        // The displayed dimension parses back to itself.
        let shown: Quantity = format!("1 {}", kind.dimension).parse().unwrap();
        assert_eq!((shown.value, shown.dimension), (1.0, Some(kind.dimension)), "{kind:?}");
    }
}

/// Decimal units are exact: the same bits as the number in SI units.
#[test]
fn decimal_units_are_exact() {
    for (text, expected) in [
        ("3 MPa", 3e6),
        ("3MPa", 3e6),
        ("0.1 ms", 1e-4),
        ("1.67e-1 ms", 1.67e-4),
        ("3.125 cm", 0.03125),
        ("1.2 g/cm^3", 1200.0),
        ("7.85 kg/dm^3", 7850.0),
        ("-9.81 m/s^2", -9.81),
        ("+.5 m", 0.5),
        ("3e-3 km", 3.0),
        ("250 um", 250e-6),
        ("250 µm", 250e-6),
        ("250 μm", 250e-6),
        ("2 bar", 2e5),
        ("5 mbar", 500.0),
        ("3 t/m^3", 3000.0),
        ("200 N/mm**2", 200e6),
        ("200 N/mm2", 200e6),
        ("35 MN/m2", 35e6),
        ("35 MN/m^2", 35e6),
        ("7850 kg/m3", 7850.0),
        ("2 kgf", 19.6133),
        ("10 kgf/cm2", 980_665.0),
        ("200 N mm⁻²", 200e6),
        ("200 N·mm^-2", 200e6),
        ("200 N.mm^(-2)", 200e6),
        // A product before the stroke is not ambiguous.
        ("7 kg*m/s²", 7.0),
        ("7 (kg*m)/s²", 7.0),
        ("7 m/s/s", 7.0),
        ("5 1/s", 5.0),
        ("5 /s", 5.0),
        ("6.6743e-11 m^3/(kg s^2)", 6.6743e-11),
        ("4 N/(mm (s))", 4000.0),
        ("2 dag", 0.02),
        ("0.7 kHz", 700.0),
        ("1 mrad/ms", 1.0),
        ("1.5 l", 0.0015),
    ] {
        assert_eq!(value(text).to_bits(), f64::to_bits(expected), "{text}");
    }
}

/// Units against the sources in the table of units, with one rounding allowed.
#[test]
fn other_units() {
    use std::f64::consts::PI;
    for (text, expected) in [
        ("1 in", 0.0254),
        ("10 ft", 3.048),
        ("1 lb", 0.45359237),
        ("2 min", 120.0),
        ("0.5 h", 1800.0),
        ("1 d", 86400.0),
        ("36 km/h", 10.0),
        ("90 deg", PI / 2.0),
        ("90°", PI / 2.0),
        ("30 rpm", PI),
        ("0.25 rev", PI / 2.0),
        ("2 rev/s", 4.0 * PI),
        ("180 deg/s", PI),
        ("1 atm", 101_325.0),
        // NIST SP 811, B.8: 6.894 757 E+03, from the exact pound-force and inch.
        ("1 psi", 4.4482216152605 / (0.0254 * 0.0254)),
        ("1 ksi", 4448.2216152605 / (0.0254 * 0.0254)),
        ("1 lbf", 4.4482216152605),
        ("2 lb/in^3", 2.0 * 0.45359237 / (0.0254 * 0.0254 * 0.0254)),
    ] {
        let relative = (value(text) / expected - 1.0).abs();
        assert!(relative <= 4.0 * f64::EPSILON, "{text}: {} instead of {expected}", value(text));
    }
    assert_eq!((value("1 in"), value("90 deg")), (0.0254, PI / 2.0));
}

#[test]
fn a_wrong_dimension_names_both() {
    for (kind, text, message) in [
        (Kind::PRESSURE, "3 m", "`3 m` is a length [m], not a pressure [Pa]"),
        (Kind::TIME, " 2 Hz ", "`2 Hz` is a rate [1/s], not a time [s]"),
        (Kind::ANGULAR_VELOCITY, "2 Hz", "`2 Hz` is a rate [1/s], not an angular velocity [rad/s]"),
        (Kind::LENGTH, "2 kg^2 m/s", "`2 kg^2 m/s` is in [m kg^2/s], not a length [m]"),
        (Kind::LENGTH, "2 m/m", "`2 m/m` is a number without a unit, not a length [m]"),
        (Kind::MASS, "2 s^-1 m^-2", "`2 s^-1 m^-2` is in [1/(m^2 s)], not a mass [kg]"),
    ] {
        assert_eq!(kind.parse(text).unwrap_err().to_string(), message);
    }
    let densities = [Kind::DENSITY, Kind::AREA_DENSITY];
    assert_eq!(Kind::parse_any(&densities, "2 kg/m^2").unwrap().dimension, Some(densities[1].dimension));
    assert_eq!(
        Kind::parse_any(&densities, "2 kg").unwrap_err().to_string(),
        "`2 kg` is a mass [kg], not a density [kg/m^3] or a mass per area [kg/m^2]"
    );
}

#[test]
fn unknown_units_are_placed_and_explained() {
    for (text, place, help) in [
        ("3 mpa", 2..5, "did you mean `MPa` or `mPa`?"),
        ("3 Mpaa", 2..6, ""),
        ("3 MPas", 2..6, "did you mean `MPa`?"),
        ("3 kg/metre^3", 5..10, "did you mean `m`?"),
        ("3 kilograms", 2..11, "did you mean `kg`?"),
        ("3 Sec", 2..5, "did you mean `s`?"),
        ("3 hours", 2..7, "did you mean `h`?"),
        ("3 µ m", 2..4, ""),
        ("3 xyz", 2..5, ""),
        // An `e` without digits is a unit, not an exponent.
        ("3 e", 2..3, ""),
        ("3 degree/s", 2..8, "did you mean `deg`?"),
        ("3 kmin", 2..6, "did you mean `min`?"),
        ("3 turns", 2..7, "did you mean `rev`?"),
    ] {
        let error = refused(text);
        assert!(matches!(error, QuantityError::UnknownUnit { .. }), "{text}: {error}");
        assert_eq!((error.place(), error.help().unwrap_or_default().as_str()), (Some(place), help), "{text}");
    }
}

#[test]
fn what_is_no_quantity() {
    for (text, place, message) in [
        ("", None, "`` is not a number"),
        ("abc", None, "`abc` is not a number"),
        ("MPa 3", None, "`MPa 3` is not a number"),
        ("1e400 m", None, "`1e400 m` is too large"),
        ("1e999999999999999999999 m", None, "`1e999999999999999999999 m` is too large"),
        ("1 m^9 km^9", Some(6..10), "powers of units are from -9 to 9"),
        ("1 m^2000000000", Some(2..14), "powers of units are from -9 to 9"),
        ("3 m^", Some(4..4), "expected a whole power after the number, found the end"),
        ("3 m^0.5", Some(6..7), "expected a unit after the number, found `5`"),
        ("3 m^99999999999", Some(15..15), "expected a whole power after the number, found the end"),
        ("3 (m", Some(4..4), "expected `)` after the number, found the end"),
        ("3 m2.5", Some(5..6), "expected a unit after the number, found `5`"),
        ("3 (m)2", Some(5..6), "expected a unit after the number, found `2`"),
        ("3 m99", Some(2..5), "powers of units are from -9 to 9"),
        ("3 m)", Some(3..4), "expected a unit after the number, found `)`"),
        ("3 m /", Some(5..5), "expected a unit after the number, found the end"),
        ("3 * 4", Some(2..3), "expected a unit after the number, found `*`"),
        ("3,5 m", Some(1..2), "expected a unit after the number, found `,`"),
        ("3 m/s kg", Some(6..8), "a product after `/` can be read in two ways"),
    ] {
        let error = refused(text);
        assert_eq!((error.to_string().as_str(), error.place()), (message, place), "{text}");
    }
    assert!(refused(&format!("1 {}m", "(".repeat(100_000))).to_string().contains("fewer parentheses"));
    assert_eq!(value("1e-400 m"), 0.0);
}

#[test]
fn quantities_and_formulas_are_told_apart() {
    for text in ["3", " -9.81 m/s^2 ", "3 m", "3m", "2 t", "5 1/s", "1e3", "1 °", "2µm"] {
        assert!(is_quantity(text), "{text}");
    }
    for text in
        ["", "t", "-t", "3*4", "3 * t", "sin(t)", "3/4", "-9.81 * (1 - exp(-t/0.1))", "(3)", "2^3", "- 3"]
    {
        assert!(!is_quantity(text), "{text}");
    }
}

/// The parser checks a power before it multiplies, and stops nested powers at the range of integers.
#[test]
fn powers_beyond_the_range_are_refused_at_once() {
    for power in ["-2147483648", "2147483647", "10", "-10", "(-10)"] {
        let error = refused(&format!("1 (Mm/m)^{power}"));
        assert!(matches!(error, QuantityError::LargePower { .. }), "{power}");
    }
    assert_eq!(refused("1 (Mm/m)^-2147483648").to_string(), "powers of units are from -9 to 9");
    assert_eq!(value("1 (Mm/m)^-9"), 1e-54);
    // 9^12 is more than 2^31: 10^(6 9^12).
    let nested = |power: i32| format!("1 {}Mm/m{}", "(".repeat(12), format!(")^{power}").repeat(12));
    assert!(matches!(refused(&nested(9)), QuantityError::TooLarge { .. }));
    assert_eq!(value(&nested(-1)), 1e6);
}
