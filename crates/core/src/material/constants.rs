//! Isotropic elastic constants of a scene: Young's modulus and Poisson's ratio, or another pair.

use serde::de::Error;

use super::parameters::{check_positive, or_preset};
use super::preset::Preset;
use super::{Isotropic, Lame, ParameterError};

/// Elastic constants as a scene's table gives them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GivenConstants {
    /// Young's modulus E [Pa].
    pub(super) young: Option<f64>,
    /// Poisson's ratio nu.
    pub(super) poisson: Option<f64>,
    /// Bulk modulus K [Pa].
    pub(super) bulk: Option<f64>,
    /// Shear modulus G [Pa].
    pub(super) shear: Option<f64>,
    /// First Lame parameter [Pa].
    pub(super) lambda: Option<f64>,
    /// Second Lame parameter [Pa], the shear modulus.
    pub(super) mu: Option<f64>,
    /// Material that provides `young` and `poisson` if the table does not give them.
    pub(super) preset: Option<Preset>,
}

impl GivenConstants {
    /// Converts to Young's modulus and Poisson's ratio, from `K` and `G`
    ///
    /// ```text
    /// E = 9 K G / (3 K + G),                       nu = (3 K - 2 G) / (2 (3 K + G))
    /// ```
    ///
    /// or from `lambda` and `mu`
    ///
    /// ```text
    /// E = mu (3 lambda + 2 mu) / (lambda + mu),    nu = lambda / (2 (lambda + mu))
    /// ```
    ///
    /// # Errors
    /// If constants are missing or redundant, or the solid is unstable: `K`, `G` or `mu` not positive,
    /// `lambda` not above `-2/3 mu`.
    pub(super) fn isotropic<E: Error>(self) -> Result<Isotropic, E> {
        match self {
            Self { bulk: None, shear: None, lambda: None, mu: None, .. } => self.young_and_poisson(),
            Self {
                bulk: Some(bulk),
                shear: Some(shear),
                young: None,
                poisson: None,
                lambda: None,
                mu: None,
                preset: None,
            } => by_bulk_and_shear(bulk, shear).map_err(E::custom),
            Self {
                lambda: Some(lambda),
                mu: Some(mu),
                young: None,
                poisson: None,
                bulk: None,
                shear: None,
                preset: None,
            } => by_lame(Lame { lambda, mu }).map_err(E::custom),
            _ => Err(E::custom(self.mismatch())),
        }
    }

    fn young_and_poisson<E: Error>(self) -> Result<Isotropic, E> {
        let GivenConstants { preset, .. } = self;
        let young = or_preset(self.young, preset, "young", |about| about.young)?;
        let poisson = or_preset(self.poisson, preset, "poisson", |about| about.poisson)?;
        Ok(Isotropic { young, poisson, preset })
    }

    /// Returns the message that names the missing partner of a single constant or the keys that form no
    /// pair.
    fn mismatch(&self) -> String {
        let named = self.named();
        let pair = [["bulk", "shear"], ["lambda", "mu"]].into_iter().find(|pair| pair.contains(&named[0]));
        let found = match (named.as_slice(), pair) {
            ([one], Some([a, b])) => format!("`{one}` is given without `{}`", if *one == a { b } else { a }),
            _ => format!("{} are given together", list(&named)),
        };
        let right = "`young` and `poisson`, `bulk` and `shear`, or `lambda` and `mu`";
        format!("{found}; isotropic elasticity takes {right}")
    }

    /// Returns the keys that are given.
    fn named(&self) -> Vec<&'static str> {
        let numbers = [
            ("young", self.young),
            ("poisson", self.poisson),
            ("bulk", self.bulk),
            ("shear", self.shear),
            ("lambda", self.lambda),
            ("mu", self.mu),
        ];
        let named = numbers.into_iter().filter_map(|(name, value)| value.map(|_| name));
        named.chain(self.preset.map(|_| "preset")).collect()
    }
}

/// Formats names as `` `a`, `b` and `c` ``.
fn list(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => quoted.concat(),
    }
}

/// Converts from bulk and shear modulus [Pa].
fn by_bulk_and_shear(bulk: f64, shear: f64) -> Result<Isotropic, ParameterError> {
    check_positive("bulk", bulk)?;
    check_positive("shear", shear)?;
    let sum = 3.0 * bulk + shear;
    Ok(Isotropic::new(9.0 * bulk * shear / sum, poisson_of(bulk, shear)))
}

/// Returns Poisson's ratio `(3 K - 2 G) / (2 (3 K + G))` from bulk and shear modulus [Pa].
pub(super) fn poisson_of(bulk: f64, shear: f64) -> f64 {
    (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
}

/// Converts from the Lame parameters [Pa].
fn by_lame(lame: Lame) -> Result<Isotropic, ParameterError> {
    check_positive("mu", lame.mu)?;
    if !lame.lambda.is_finite() || lame.bulk() <= 0.0 {
        let problem =
            "must be a finite number above -2/3 mu [Pa]: the bulk modulus lambda + 2/3 mu is positive";
        return Err(ParameterError::new("lambda", lame.lambda, problem));
    }
    let (young, poisson) = lame.young_and_poisson();
    Ok(Isotropic::new(young, poisson))
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use crate::material::{Lame, MaterialSpec};

    fn read(text: &str) -> Result<MaterialSpec, String> {
        let table = format!("material = {text}").parse::<toml::Table>().unwrap();
        MaterialSpec::deserialize(table["material"].clone()).map_err(|error| error.to_string())
    }

    /// Every pair gives the solid with `E = 2.6 MPa`, `nu = 0.3`, `mu = 1 MPa`, `lambda = 1.5 MPa` and
    /// `K = 1.5 + 2/3 MPa`, within a few roundings.
    #[test]
    fn other_constants_say_the_same_solid() {
        let expected = Lame::new(2.6e6, 0.3);
        for text in [
            "{ stvk = { bulk = 2166666.6666666665, shear = '1 MPa' } }",
            "{ stvk = { lambda = '1.5 MPa', mu = 1e6 } }",
            "{ linear = { lambda = 1.5e6, mu = 1e6, plane = 'stress' } }",
            // mu = 2 (C10 + C01), K = 2 / D1.
            "{ mooney-rivlin = { c10 = '0.4 MPa', c01 = '0.1 MPa', d1 = '0.9230769230769231 1/MPa' } }",
        ] {
            let spec = read(text).unwrap();
            let lame = spec.lame().unwrap();
            let errors = [lame.lambda / expected.lambda - 1.0, lame.mu / expected.mu - 1.0];
            assert!(errors.iter().all(|error| error.abs() < 8.0 * f64::EPSILON), "{text}: {errors:?}");
            assert_eq!(spec.check(), Ok(()), "{text}");
        }
        // Negative and positive Poisson's ratio: nu = -0.5 and 0.25.
        let poisson = |text: &str| {
            let Lame { lambda, mu } = read(text).unwrap().lame().unwrap();
            0.5 * lambda / (lambda + mu)
        };
        assert!((poisson("{ stvk = { lambda = -5e5, mu = 1e6 } }") + 0.5).abs() < 1e-15);
        assert!((poisson("{ stvk = { bulk = 5.0, shear = 3.0 } }") - 0.25).abs() < 1e-15);
    }

    #[test]
    fn too_few_too_many_and_impossible_constants_are_named() {
        for (text, message) in [
            ("{ stvk = { bulk = 1e6 } }", "`bulk` is given without `shear`"),
            ("{ stvk = { mu = 1e6 } }", "`mu` is given without `lambda`"),
            ("{ stvk = { bulk = 1e6, mu = 1e6 } }", "`bulk` and `mu` are given together"),
            (
                "{ stvk = { young = 1e6, bulk = 1e6, shear = 1.0 } }",
                "`young`, `bulk` and `shear` are given together",
            ),
            ("{ stvk = { preset = 'steel', shear = 1.0 } }", "`shear` and `preset` are given together"),
            ("{ stvk = { young = 1e6 } }", "missing field `poisson`"),
            ("{ stvk = { bulk = -1e6, shear = 1e6 } }", "bulk = -1000000: must be positive"),
            (
                "{ stvk = { lambda = -1e6, mu = 1e6 } }",
                "lambda = -1000000: must be a finite number above -2/3 mu",
            ),
            ("{ mooney-rivlin = { c10 = 1.0, c01 = 1.0, d1 = 1.0, poisson = 0.3 } }", "`poisson` and `d1`"),
            (
                "{ mooney-rivlin = { c10 = 1.0, c01 = 1.0, d1 = 1.0, young = 1.0 } }",
                "give `poisson` with `young`",
            ),
            ("{ mooney-rivlin = { c10 = 1.0, c01 = 1.0, d1 = 0.0 } }", "d1 = 0: must be positive [1/Pa]"),
            ("{ mooney-rivlin = { c10 = 1.0, c01 = 1.0 } }", "missing field `poisson`"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(message), "{text}: {error}");
        }
    }
}
