//! `pliant modes`.

use std::num::NonZeroU16;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use super::values::positive_seconds;

/// `pliant modes`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ModesArguments {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, for example body.0.order=2; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// Number of modes, from the lowest
    #[arg(long, value_name = "N", default_value = "10")]
    pub(crate) count: NonZeroU16,
    /// Linearise about the static equilibrium under the loads (prestress)
    #[arg(long)]
    pub(crate) equilibrium: bool,
    /// Record the mode shapes, one after the other, as an animation (.mcap)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Amplitude of the animation, as a fraction of the size of the scene
    #[arg(long, value_name = "SHARE", default_value = "0.1", value_parser = share, requires = "output")]
    pub(crate) amplitude: f64,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) sound: SoundArguments,
}

/// The sound of a blow.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Sound")]
pub(crate) struct SoundArguments {
    /// Write the sound of an impact on the body (.wav, 48 kHz)
    #[arg(long, value_name = "FILE", requires = "strike", requires = "direction")]
    pub(crate) sound: Option<PathBuf>,
    /// Point of impact: a vertex (12), or the vertex nearest to a reference position (0.1,0,0.2)
    #[arg(long, value_name = "VERTEX_OR_POINT", requires = "sound", allow_hyphen_values = true)]
    pub(crate) strike: Option<VertexChoice>,
    /// Direction of the impact (0,0,-1)
    #[arg(
        long, value_name = "X,Y,Z", requires = "sound", allow_hyphen_values = true,
        value_parser = NumberList::from_str
    )]
    pub(crate) direction: Option<NumberList>,
    /// Vertex whose motion is heard [default: the point of impact]
    #[arg(long, value_name = "VERTEX_OR_POINT", requires = "sound", allow_hyphen_values = true)]
    pub(crate) listen: Option<VertexChoice>,
    /// Damping alpha M + beta K [1/s, s] of the sound, instead of the scene's
    #[arg(long, value_name = "ALPHA,BETA", requires = "sound", value_parser = rayleigh)]
    pub(crate) rayleigh: Option<(f64, f64)>,
    /// Length of the sound
    #[arg(
        long, value_name = "SECONDS", default_value = "3", requires = "sound",
        value_parser = positive_seconds
    )]
    pub(crate) seconds: f64,
    /// Bits per sample: 16 or 24
    #[arg(long, value_name = "BITS", default_value = "16", requires = "sound", value_parser = bits)]
    pub(crate) bits: u16,
}

/// Numbers between commas.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NumberList(pub(crate) Vec<f64>);

impl FromStr for NumberList {
    type Err = String;

    fn from_str(text: &str) -> Result<NumberList, String> {
        let number = |word: &str| match word.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("`{word}` is not a number; it must be like 0,0,-1")),
        };
        text.split(',').map(number).collect::<Result<_, _>>().map(NumberList)
    }
}

/// A vertex, by its number or by where it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum VertexChoice {
    /// Number in the scene, from 0.
    Vertex(usize),
    /// [m].
    Point(Vec<f64>),
}

impl FromStr for VertexChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<VertexChoice, String> {
        if text.contains(',') {
            return text.parse::<NumberList>().map(|numbers| VertexChoice::Point(numbers.0));
        }
        text.parse()
            .map(VertexChoice::Vertex)
            .map_err(|_| format!("`{text}` is neither a vertex, like 12, nor a point, like 0.1,0,0.2"))
    }
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| *share > 0.0 && *share <= 1.0);
    share.ok_or_else(|| "it must be above 0 and at most 1".into())
}

fn bits(text: &str) -> Result<u16, String> {
    text.parse().ok().filter(|bits| matches!(bits, 16 | 24)).ok_or_else(|| "it must be 16 or 24".into())
}

fn rayleigh(text: &str) -> Result<(f64, f64), String> {
    match text.parse::<NumberList>()?.0[..] {
        [alpha, beta] if alpha >= 0.0 && beta >= 0.0 => Ok((alpha, beta)),
        _ => Err("it must be two numbers that are not negative, like 0.5,1e-7".into()),
    }
}
