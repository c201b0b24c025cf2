//! `pliant fit`.

use std::num::NonZeroU32;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use pliant::quantity::{Kind, Quantity};

/// `pliant fit`.
#[derive(Args, Clone, Debug)]
pub(crate) struct FitArguments {
    /// Scene file (TOML); the fit starts from its values
    pub(crate) scene: PathBuf,
    /// Measurements (CSV): probes over `time`; `uniaxial`, `equibiaxial` or `pure-shear` over `stretch`,
    /// `strain` or `displacement`; or `frequency` over `mode`
    #[arg(long, value_name = "FILE")]
    pub(crate) to: PathBuf,
    /// Parameters to fit, for example body.0.elastic.young,body.0.elastic.poisson
    #[arg(long, value_name = "KEY,...", value_delimiter = ',', required = true)]
    pub(crate) parameters: Vec<String>,
    /// Change a value of the scene first, for example body.0.elastic.young=1e5; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// Keep a parameter between two values, for example body.0.elastic.poisson=0..0.49; repeatable
    #[arg(long, value_name = "KEY=LOW..HIGH", allow_hyphen_values = true)]
    pub(crate) bounds: Vec<KeyBounds>,
    /// Number of starting points, the scene's and random ones; the best fit is kept
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) starts: NonZeroU32,
    /// Seed of the random starting points
    #[arg(long, value_name = "SEED", default_value = "0")]
    pub(crate) seed: u64,
    /// Columns of a trajectory to fit [default: all]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) columns: Vec<String>,
    /// Reference length of the specimen whose `displacement` was measured, for example 20mm
    #[arg(long, value_name = "LENGTH", value_parser = |text: &str| positive(text, Kind::LENGTH))]
    pub(crate) length: Option<f64>,
    /// Reference cross-section under a measured force, for example 4mm^2
    #[arg(long, value_name = "AREA", value_parser = |text: &str| positive(text, Kind::AREA))]
    pub(crate) area: Option<f64>,
    /// Also plot fit and residuals (.svg)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also write the scene with the fitted values (.toml)
    #[arg(long, value_name = "FILE")]
    pub(crate) fitted: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
}

/// Bounds of a parameter in SI units.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct KeyBounds {
    /// Its key.
    pub(crate) key: String,
    /// Lower and upper.
    pub(crate) ends: [f64; 2],
}

impl FromStr for KeyBounds {
    type Err = String;

    fn from_str(text: &str) -> Result<KeyBounds, String> {
        let form = "write KEY=LOW..HIGH, like body.0.elastic.young=\"10 kPa..1 MPa\"";
        let (key, ends) = text.split_once('=').ok_or_else(|| format!("bounds are missing; {form}"))?;
        let (low, high) = ends.split_once("..").ok_or_else(|| format!("`{ends}` are not bounds; {form}"))?;
        let end = |word: &str| match word.parse::<Quantity>() {
            Ok(quantity) => Ok(quantity.value),
            Err(error) => Err(format!("{error}; {form}")),
        };
        Ok(KeyBounds { key: key.trim().to_owned(), ends: [end(low.trim())?, end(high.trim())?] })
    }
}

/// A positive quantity of this kind.
fn positive(text: &str, kind: Kind) -> Result<f64, String> {
    match kind.parse(text) {
        Ok(value) if value > 0.0 => Ok(value),
        Ok(_) => Err(format!("it must be positive, like {}", kind.example)),
        Err(error) => Err(error.to_string()),
    }
}
