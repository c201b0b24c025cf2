//! `pliant render`: pictures of a recording.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::Path;

use pliant_view::drawing::{Colouring, DrawError, Drawing};
use pliant_view::picture::{
    Animation, Film, PictureError, RenderOptions, Style, write_gif, write_png, write_svg,
};
use serde_json::json;

use crate::arguments::RenderArguments;
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;
use crate::text::{bytes, counted};

/// Frames a second of animations.
const FPS: u16 = 20;
/// Frames of an animation, at most.
const MOST: usize = 600;

pub(crate) fn execute(arguments: &RenderArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let format = PictureFormat::of(&arguments.output)?;
    refuse_pattern(&arguments.output)?;
    refuse_existing(&arguments.output, arguments.force)?;
    let mut drawing = open(&arguments.file)?;
    let frames = frames(arguments, format, drawing.times());
    if format == PictureFormat::Svg && frames.len() > 1 {
        return Err(Failure::usage("an .svg holds one frame; choose it with `--at TIME`, or name a .png"));
    }
    let options = options(arguments, format, &drawing, frames.len())?;
    let film = Film::read(&mut drawing, &frames, options).map_err(|error| cannot_draw(&error))?;
    let content = encode(&film, format, arguments).map_err(|error| cannot_write(&error))?;
    write(&arguments.output, &content)?;
    let path = arguments.output.display();
    let count = counted(frames.len() as u64, "frame", "frames");
    terminal.report(&format!("wrote {count} to {path}, {}", bytes(content.len() as u64)))?;
    let rendered = json!({ "file": arguments.output, "frames": frames.len(), "bytes": content.len() });
    terminal.document(&json!({ "status": ExitStatus::Done, "rendered": rendered }))?;
    Ok(ExitStatus::Done)
}

/// File formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PictureFormat {
    Png,
    Gif,
    Svg,
}

impl PictureFormat {
    fn of(path: &Path) -> Result<PictureFormat, Failure> {
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or("").to_ascii_lowercase();
        Ok(match extension.as_str() {
            "png" => PictureFormat::Png,
            "gif" => PictureFormat::Gif,
            "svg" => PictureFormat::Svg,
            _ => {
                let message = format!("{} does not say which format it has", path.display());
                return Err(Failure::usage(format!("{message}; end it in .png, .gif or .svg")));
            }
        })
    }

    fn moves(self) -> bool {
        self == PictureFormat::Gif
    }
}

/// Refuses a pattern of names, as programs have it that write a file for each frame: `f%04d.png`.
fn refuse_pattern(path: &Path) -> Result<(), Failure> {
    let name = path.file_name().and_then(OsStr::to_str).unwrap_or("");
    let is_number = |rest: &str| rest.trim_start_matches(|c: char| c.is_ascii_digit()).starts_with('d');
    if !name.split('%').skip(1).any(is_number) {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "{} names a file for each frame; all frames go into one: `--frames N` puts N side by side into a \
         .png, one after the other into a .gif, and `--at TIME` draws a single one",
        path.display()
    )))
}

/// Opens a recording to be drawn.
///
/// # Errors
/// It is no recording, or has no frames.
pub(super) fn open(file: &Path) -> Result<Drawing, Failure> {
    Failure::unless_file(file)?;
    Drawing::open(file).map_err(|error| cannot_draw(&error))
}

pub(super) fn cannot_draw(error: &DrawError) -> Failure {
    match error {
        DrawError::Record(error) => Failure::recording(error),
        error => Failure::usage(error.to_string()),
    }
}

fn cannot_write(error: &PictureError) -> Failure {
    Failure::usage(error.to_string())
}

/// Refuses to replace a file without `--force`.
///
/// # Errors
/// The file is there, or is a directory.
pub(super) fn refuse_existing(path: &Path, force: bool) -> Result<(), Failure> {
    Failure::unless_file(path)?;
    if path.exists() && !force {
        let message = format!("{} exists; choose another path, or replace it with `--force`", path.display());
        return Err(Failure::usage(message));
    }
    Ok(())
}

/// Writes a file whole or not at all.
///
/// # Errors
/// The system refuses it.
pub(super) fn write(path: &Path, content: &[u8]) -> Result<(), Failure> {
    pliant_files::durable_file::replace(path, content)
        .map_err(|error| Failure::failed("output", format!("cannot write {}: {error}", path.display())))
}

fn frames(arguments: &RenderArguments, format: PictureFormat, times: &[f64]) -> Vec<usize> {
    let last = times.len() - 1;
    if let Some(at) = arguments.at {
        return vec![nearest(times, at)];
    }
    let spread = |count: usize| -> Vec<usize> {
        let at = |i: usize| if count == 1 { last } else { (i * last + (count - 1) / 2) / (count - 1) };
        (0..count).map(at).collect::<BTreeSet<_>>().into_iter().collect()
    };
    match arguments.frames {
        Some(count) => spread(usize::from(count.get()).min(times.len())),
        None if format.moves() => {
            let rate = f64::from(arguments.fps.map_or(FPS, std::num::NonZero::get));
            let shown = (times[last] - times[0]) / arguments.speed;
            spread(((shown * rate).round() as usize + 1).clamp(1, times.len().min(MOST)))
        }
        None => vec![last],
    }
}

fn nearest(times: &[f64], at: f64) -> usize {
    let distance = |i: &usize| (times[*i] - at).abs();
    (0..times.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

fn options(
    arguments: &RenderArguments,
    format: PictureFormat,
    drawing: &Drawing,
    frames: usize,
) -> Result<RenderOptions, Failure> {
    let small = format.moves() || frames > 1;
    let size = arguments.size.map_or(if small { [480, 360] } else { [960, 720] }, |size| size.0);
    let style = Style { size, theme: arguments.theme.into(), transparent: arguments.transparent };
    Ok(RenderOptions {
        style,
        direction: arguments.camera.map(|camera| camera.0).unwrap_or_default(),
        fit: arguments.fit.into(),
        colouring: colouring(drawing, &arguments.colour_by)?,
        range: arguments.range.map(|range| range.0),
        labels: !arguments.bare,
    })
}

/// The colouring of this name, spaces or dashes between words.
fn colouring(drawing: &Drawing, name: &str) -> Result<Colouring, Failure> {
    let plain = |name: &str| name.to_ascii_lowercase().replace([' ', '_'], "-");
    let possible = drawing.colourings();
    let found = possible.iter().find(|colouring| plain(&colouring.to_string()) == plain(name));
    found.copied().ok_or_else(|| {
        let names: Vec<String> = possible.iter().map(ToString::to_string).collect();
        let file = drawing.path().display();
        let parts: Vec<String> = names
            .iter()
            .filter(|part| plain(part).strip_prefix(&plain(name)).is_some_and(|rest| rest.starts_with('-')))
            .map(|part| format!("`{part}`"))
            .collect();
        if !parts.is_empty() {
            let parts = parts.join(", ");
            let message = format!("`{name}` of {file} is more than one number: colour by {parts}");
            return Failure::usage(message);
        }
        Failure::usage(format!(
            "{file} cannot be coloured by `{name}`, only by {}; measures of elements are drawn that the run \
             recorded: [output] `channels`",
            names.join(", ")
        ))
    })
}

fn encode(film: &Film, format: PictureFormat, arguments: &RenderArguments) -> Result<Vec<u8>, PictureError> {
    let mut content = Vec::new();
    match format {
        PictureFormat::Png if film.len() > 1 => write_png(&film.contact_sheet(), &mut content)?,
        PictureFormat::Png => write_png(&film.draw()[0], &mut content)?,
        PictureFormat::Gif => write_gif(&animation(film, arguments), &mut content)?,
        PictureFormat::Svg => write_svg(film, &mut content)?,
    }
    Ok(content)
}

/// Each frame is shown until the next one is due; the last one for a while.
fn animation(film: &Film, arguments: &RenderArguments) -> Animation {
    let times: Vec<f64> = film.times().collect();
    let milliseconds = |seconds: f64| (1e3 * seconds).round().clamp(20.0, 10_000.0) as u16;
    let shown = |pair: &[f64]| match arguments.fps {
        Some(fps) => milliseconds(1.0 / f64::from(fps.get())),
        None => milliseconds((pair[1] - pair[0]) / arguments.speed),
    };
    let delays = times.windows(2).map(shown).chain([700]).collect();
    Animation { frames: film.draw(), delays }
}
