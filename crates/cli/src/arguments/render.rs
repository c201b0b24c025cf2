//! `pliant render`.

use std::num::NonZeroU16;
use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use pliant_view::picture::{Fit, Theme, ViewDirection};

use super::values::{positive_seconds, time_span};

/// `pliant render`.
#[derive(Args, Clone, Debug)]
pub(crate) struct RenderArguments {
    /// Recording (.mcap)
    pub(crate) file: PathBuf,
    /// Picture: .png, .gif or .svg
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Draw only the frame nearest to this time [default: .png and .svg: the last frame; else an animation]
    #[arg(long, value_name = "TIME", value_parser = moment, conflicts_with = "frames")]
    pub(crate) at: Option<f64>,
    /// Number of evenly spaced frames: side by side in a .png, one after the other in an animation
    #[arg(long, value_name = "N")]
    pub(crate) frames: Option<NonZeroU16>,
    /// Frames per second of an animation, which plays in real time [default: 20]
    #[arg(long, value_name = "N")]
    pub(crate) fps: Option<NonZeroU16>,
    /// Speed of an animation relative to real time, for example 0.25
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = positive_seconds)]
    pub(crate) speed: f64,
    /// Width and height in pixels [default: 960x720, animations 480x360, frames side by side 480x360 each]
    #[arg(long, value_name = "WxH")]
    pub(crate) size: Option<PictureSize>,
    /// Colours: body, speed, displacement, or a recorded measure of elements
    #[arg(long, value_name = "NAME", default_value = "body")]
    pub(crate) colour_by: String,
    /// Limits of the colour scale [default: smallest and largest value]
    #[arg(long, value_name = "A,B", allow_hyphen_values = true)]
    pub(crate) range: Option<ValueRange>,
    /// Angle from the front towards +x, angle above the horizon [degrees], and magnification
    #[arg(long, value_name = "AZIMUTH,ELEVATION[,ZOOM]", allow_hyphen_values = true)]
    pub(crate) camera: Option<CameraArgument>,
    /// Frames that the camera fits: auto, all, first, or follow (the largest, following the bodies)
    #[arg(long, value_name = "WHAT", default_value = "auto", hide_possible_values = true)]
    pub(crate) fit: FitArgument,
    /// Transparent background
    #[arg(long)]
    pub(crate) transparent: bool,
    /// Theme: light or dark
    #[arg(long, value_name = "THEME", default_value = "light", hide_possible_values = true)]
    pub(crate) theme: ThemeArgument,
    /// Draw no title, time or colour scale
    #[arg(long)]
    pub(crate) bare: bool,
    /// Replace the picture if it exists
    #[arg(long)]
    pub(crate) force: bool,
}

/// What the camera is fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum FitArgument {
    /// All frames, or following bodies that fly far
    Auto,
    /// All frames
    All,
    /// The first frame
    First,
    /// The largest frame, following the bodies
    Follow,
}

impl From<FitArgument> for Fit {
    fn from(fit: FitArgument) -> Fit {
        match fit {
            FitArgument::Auto => Fit::Auto,
            FitArgument::All => Fit::All,
            FitArgument::First => Fit::First,
            FitArgument::Follow => Fit::Follow,
        }
    }
}

/// Colours of everything but bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ThemeArgument {
    /// Dark on white
    Light,
    /// Light on black
    Dark,
}

impl From<ThemeArgument> for Theme {
    fn from(theme: ThemeArgument) -> Theme {
        match theme {
            ThemeArgument::Light => Theme::Light,
            ThemeArgument::Dark => Theme::Dark,
        }
    }
}

/// Width and height [pixel].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PictureSize(pub(crate) [usize; 2]);

/// Sides of pictures, in pixels.
const SIDES: std::ops::RangeInclusive<usize> = 32..=4096;

impl FromStr for PictureSize {
    type Err = String;

    fn from_str(text: &str) -> Result<PictureSize, String> {
        let side = |word: &str| word.parse().ok().filter(|side| SIDES.contains(side));
        let sides = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
        let what = || format!("it must be like 640x480, both sides {} to {}", SIDES.start(), SIDES.end());
        sides.map(PictureSize).ok_or_else(what)
    }
}

/// Two numbers, the lower first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ValueRange(pub(crate) (f64, f64));

impl FromStr for ValueRange {
    type Err = String;

    fn from_str(text: &str) -> Result<ValueRange, String> {
        match numbers(text).as_deref() {
            Some([low, high]) if low < high => Ok(ValueRange((*low, *high))),
            _ => Err("it must be two numbers, the lower first, like 0,1e5".to_owned()),
        }
    }
}

/// Where the camera stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraArgument(pub(crate) ViewDirection);

impl FromStr for CameraArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<CameraArgument, String> {
        let direction = |azimuth: f64, elevation: f64, zoom: f64| ViewDirection {
            azimuth: azimuth as f32,
            elevation: elevation as f32,
            zoom: zoom as f32,
        };
        let given = match numbers(text).as_deref() {
            Some([azimuth, elevation]) => Some(direction(*azimuth, *elevation, 1.0)),
            Some([azimuth, elevation, zoom]) => Some(direction(*azimuth, *elevation, *zoom)),
            _ => None,
        };
        let given = given.filter(|d| d.elevation.abs() <= 90.0 && (0.01..=100.0).contains(&d.zoom));
        given.map(CameraArgument).ok_or_else(|| {
            "it must be like 25,15 or 25,15,1.5: degrees, the second -90 to 90, and a factor 0.01 to 100"
                .into()
        })
    }
}

/// Finite numbers between commas.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |word: &str| word.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    text.split(',').map(number).collect()
}

/// A time from 0, with or without its unit.
fn moment(text: &str) -> Result<f64, String> {
    if text.parse() == Ok(0.0) || text == "0s" { Ok(0.0) } else { time_span(text) }
}

/// `pliant plot`.
#[derive(Args, Clone, Debug)]
pub(crate) struct PlotArguments {
    /// Recordings (.mcap); several share one chart, with total energies only
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Chart: .svg or .png [default: in the terminal]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Quantity: energy, balance, momentum, angular-momentum, min-J, reactions or probes
    #[arg(long, value_name = "NAME", default_value = "energy", hide_possible_values = true)]
    pub(crate) quantity: QuantityArgument,
    /// Theme of a .png: light or dark
    #[arg(long, value_name = "THEME", default_value = "light", hide_possible_values = true)]
    pub(crate) theme: ThemeArgument,
    /// Replace the chart if it exists
    #[arg(long)]
    pub(crate) force: bool,
}

/// What is drawn over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum QuantityArgument {
    /// Energies
    Energy,
    /// Error of the energy balance
    Balance,
    /// Linear momentum
    Momentum,
    /// Angular momentum
    AngularMomentum,
    /// Smallest J of all elements
    #[value(name = "min-J", alias = "min-j")]
    MinJ,
    /// Forces of pins and walls
    Reactions,
    /// Positions of probes
    Probes,
}
