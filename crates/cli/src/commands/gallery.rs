//! `pliant gallery`: a page with every scene of a folder, a short animation, its command and first comment.

mod page;

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use pliant_view::drawing::{Colouring, Drawing};
use pliant_view::picture::{Animation, Film, Fit, RenderOptions, Style, Theme, ViewDirection, write_gif};
use serde_json::json;

use self::page::{GROUPS, GalleryCard, GalleryGroup, groups, page};
use super::render::{cannot_draw, open, refuse_existing, write};
use crate::arguments::{Command, CommandLine, GalleryArguments};
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;
use crate::text::{bytes, counted};

/// How long an animation shows each frame and the last one [ms].
const DELAY: u16 = 80;
const PAUSE: u16 = 700;

pub(crate) fn execute(arguments: &GalleryArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    refuse_existing(&arguments.output, arguments.force)?;
    let scenes = scenes(&arguments.scenes)?;
    let groups = groups_beside(&scenes)?;
    let folder = pictures(&arguments.output);
    crate::output::folder(&folder)?;
    let mut cards = Vec::new();
    let mut total = 0;
    for scene in &scenes {
        let entry = GalleryEntry::of(scene, arguments, terminal)?;
        let content = entry.picture;
        total += content.len();
        terminal.note(&format!("{}: {}", scene.display(), bytes(content.len() as u64)));
        write(&folder.join(format!("{}.gif", entry.card.name)), &content)?;
        cards.push(entry.card);
    }
    let pictures = folder.file_name().unwrap_or_default().to_string_lossy();
    write(&arguments.output, page(&cards, &groups, &pictures).as_bytes())?;
    let count = counted(scenes.len() as u64, "scene", "scenes");
    let place = arguments.output.display();
    terminal.report(&format!("drew {count} into {place}, {} of pictures", bytes(total as u64)))?;
    let drawn = json!({ "file": arguments.output, "scenes": scenes, "bytes": total });
    terminal.document(&json!({ "status": ExitStatus::Done, "gallery": drawn }))?;
    Ok(ExitStatus::Done)
}

/// The scenes asked for; of folders all that end in `.toml`, by name.
fn scenes(places: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut scenes = Vec::new();
    for place in places {
        if place.is_dir() {
            let entries = fs::read_dir(place).map_err(|error| cannot_read(place, &error))?;
            let files = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
            let mut found: Vec<PathBuf> =
                files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
            found.sort();
            scenes.append(&mut found);
        } else {
            scenes.push(place.clone());
        }
    }
    if scenes.is_empty() {
        return Err(Failure::usage("there is no scene (.toml) in the folder; name one that has some"));
    }
    Ok(scenes)
}

/// Groups that the folders of the scenes put them into.
fn groups_beside(scenes: &[PathBuf]) -> Result<Vec<GalleryGroup>, Failure> {
    let mut files: Vec<PathBuf> = scenes.iter().map(|scene| scene.with_file_name(GROUPS)).collect();
    files.dedup();
    let mut found = Vec::new();
    for file in files.iter().filter(|file| file.exists()) {
        let text = fs::read_to_string(file).map_err(|error| cannot_read(file, &error))?;
        found.append(&mut groups(&text));
    }
    Ok(found)
}

fn cannot_read(path: &Path, error: &std::io::Error) -> Failure {
    Failure::usage(format!("cannot read {}: {error}", path.display()))
}

/// `docs/gallery` for the page `docs/gallery.md`.
fn pictures(page: &Path) -> PathBuf {
    page.with_extension("")
}

/// A scene of the page and its animation.
struct GalleryEntry {
    card: GalleryCard,
    picture: Vec<u8>,
}

impl GalleryEntry {
    fn of(scene: &Path, arguments: &GalleryArguments, terminal: Terminal) -> Result<GalleryEntry, Failure> {
        let text = fs::read_to_string(scene).map_err(|error| cannot_read(scene, &error))?;
        let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let recording = recording(scene, &name, arguments, terminal)?;
        let mut drawing = open(&recording.path)?;
        let picture = animation(&mut drawing, arguments)?;
        let scene = scene.display().to_string();
        let card =
            GalleryCard { title: drawing.title().to_owned(), name, scene, comment: first_comment(&text) };
        Ok(GalleryEntry { card, picture })
    }
}

/// The recording of a scene; one that was made for the gallery goes with it.
struct SceneRecording {
    path: PathBuf,
    temporary: bool,
}

impl Drop for SceneRecording {
    fn drop(&mut self) {
        if self.temporary {
            // A file that stays does no harm.
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn recording(
    scene: &Path,
    name: &str,
    arguments: &GalleryArguments,
    terminal: Terminal,
) -> Result<SceneRecording, Failure> {
    let made = arguments.recordings.as_ref().map(|folder| folder.join(format!("{name}.mcap")));
    if let Some(path) = made.filter(|path| path.exists()) {
        return Ok(SceneRecording { path, temporary: false });
    }
    // Beside the page, where there is room for it.
    let path = arguments.output.with_extension(format!("{name}.mcap"));
    let line: [OsString; 7] = [
        "pliant".into(),
        "run".into(),
        scene.into(),
        "--output".into(),
        (&path).into(),
        "--force".into(),
        "--quiet".into(),
    ];
    match CommandLine::read(&line) {
        Ok((Command::Run(run), _)) => {
            super::run::execute(&run, Terminal { quiet: true, json: false, ..terminal })?
        }
        _ => return Err(Failure::usage(format!("{} cannot be run", scene.display()))),
    };
    Ok(SceneRecording { path, temporary: true })
}

fn animation(drawing: &mut Drawing, arguments: &GalleryArguments) -> Result<Vec<u8>, Failure> {
    let last = drawing.times().len() - 1;
    let count = usize::from(arguments.frames.get()).min(last + 1);
    let frames: Vec<usize> = (0..count).map(|i| i * last / (count - 1).max(1)).collect();
    let options = RenderOptions {
        style: Style { size: arguments.size.0, theme: Theme::Light, transparent: false },
        direction: ViewDirection::default(),
        fit: Fit::Auto,
        colouring: Colouring::Body,
        range: None,
        labels: false,
    };
    let film = Film::read(drawing, &frames, options).map_err(|error| cannot_draw(&error))?;
    let images = film.draw();
    let delays = (1..images.len()).map(|_| DELAY).chain([PAUSE]).collect();
    let mut content = Vec::new();
    write_gif(&Animation { frames: images, delays }, &mut content)
        .map_err(|error| Failure::failed("output", error.to_string()))?;
    Ok(content)
}

/// The comment that a scene begins with, without its marks.
fn first_comment(text: &str) -> String {
    let lines = text.lines().take_while(|line| line.starts_with('#'));
    // `#:schema` is for editors.
    let lines = lines.filter(|line| !line.starts_with("#:"));
    let words: Vec<&str> = lines.map(|line| line.trim_start_matches('#').trim()).collect();
    words.join("\n").trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_end_where_the_scene_begins() {
        let scene = "# A beam.\n# It falls.\n\ntitle = \"x\" # no\n# neither\n";
        assert_eq!(first_comment(scene), "A beam.\nIt falls.");
        assert_eq!(first_comment("title = 1\n"), "");
    }
}
