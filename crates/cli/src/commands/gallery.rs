//! `pliant gallery`: a page with every scene of a folder, its first comment and a short animation.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use pliant_view::drawing::{Colouring, Drawing};
use pliant_view::picture::{Animation, Film, Fit, RenderOptions, Style, Theme, ViewDirection, write_gif};
use serde_json::json;

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
    let folder = pictures(&arguments.output);
    crate::output::folder(&folder)?;
    let mut entries = Vec::new();
    let mut total = 0;
    for scene in &scenes {
        let entry = GalleryEntry::of(scene, arguments, terminal)?;
        let content = entry.picture;
        total += content.len();
        terminal.note(&format!("{}: {}", scene.display(), bytes(content.len() as u64)));
        write(&folder.join(format!("{}.gif", entry.name)), &content)?;
        entries.push((entry.name, entry.title, entry.comment));
    }
    write(&arguments.output, page(&entries, &folder).as_bytes())?;
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

fn cannot_read(path: &Path, error: &std::io::Error) -> Failure {
    Failure::usage(format!("cannot read {}: {error}", path.display()))
}

/// `docs/gallery` for the page `docs/gallery.md`.
fn pictures(page: &Path) -> PathBuf {
    page.with_extension("")
}

/// A scene of the page.
struct GalleryEntry {
    name: String,
    title: String,
    comment: String,
    picture: Vec<u8>,
}

impl GalleryEntry {
    fn of(scene: &Path, arguments: &GalleryArguments, terminal: Terminal) -> Result<GalleryEntry, Failure> {
        let text = fs::read_to_string(scene).map_err(|error| cannot_read(scene, &error))?;
        let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let recording = recording(scene, &name, arguments, terminal)?;
        let mut drawing = open(&recording.path)?;
        let picture = animation(&mut drawing, arguments)?;
        Ok(GalleryEntry { title: drawing.title().to_owned(), name, comment: first_comment(&text), picture })
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

fn page(entries: &[(String, String, String)], folder: &Path) -> String {
    let mut page =
        "# Gallery\n\nEvery scene of `scenes/`; `pliant SCENE` runs one. `pliant gallery --force` makes \
         this page\n\
         and its pictures again.\n"
            .to_owned();
    let folder = folder.file_name().unwrap_or_default().to_string_lossy();
    for (name, title, comment) in entries {
        let (title, comment) = (escaped(title), escaped(comment));
        page += &format!("\n## {title}\n`{name}.toml`\n\n![{title}]({folder}/{name}.gif)\n\n{comment}\n");
    }
    page
}

/// Text in Markdown: what a scene says is no markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('[', "\\[")
        .replace('*', "\\*")
        .replace('_', "\\_")
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

    #[test]
    fn markup_in_titles_is_text() {
        let entries = [("a".to_owned(), "<b>_x_[y](z)".to_owned(), String::new())];
        let page = page(&entries, Path::new("docs/gallery"));
        assert!(page.contains("## &lt;b>\\_x\\_\\[y](z)\n") && page.contains("(gallery/a.gif)"), "{page}");
    }
}
