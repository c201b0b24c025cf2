//! `pliant export`: frames of a recording as files of other programs.

mod whole;

use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use pliant_files::durable_file;
use pliant_record::export::{Export, ExportError, write_pvd};
use serde_json::json;

use crate::arguments::{ExportArguments, ExportFormat, FrameRange};
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;
use crate::text::counted;

pub(crate) fn execute(arguments: &ExportArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    if let Some(format) = whole::format(&arguments.to) {
        let written = whole::write(arguments, format)?;
        let to = &arguments.to;
        let frames = counted(written.frames as u64, "frame", "frames");
        let which = written.every.map_or_else(String::new, |every| {
            let most = Export::GLB_FRAMES;
            format!(", 1 of every {every} (a .glb holds at most {most}); choose others with `--frames`")
        });
        terminal.report(&format!("wrote {frames} to {}{which}", to.display()))?;
        let exported =
            json!({ "frames": written.frames, "every": written.every, "collection": null, "files": [to] });
        terminal.document(&json!({ "status": ExitStatus::Done, "exported": exported }))?;
        return Ok(ExitStatus::Done);
    }
    if is_page(arguments)? {
        super::view::show(&arguments.file, &arguments.to, false, terminal)?;
        let exported = json!({ "collection": null, "files": [arguments.to] });
        terminal.document(&json!({ "status": ExitStatus::Done, "exported": exported }))?;
        return Ok(ExitStatus::Done);
    }
    let plan = write(arguments)?;
    let shown = plan.collection.as_ref().or(plan.folder.as_ref()).unwrap_or(&plan.files[0].1);
    let frames = plan.files.len();
    terminal.report(&format!(
        "wrote {} to {}",
        counted(frames as u64, "frame", "frames"),
        shown.display()
    ))?;
    let files: Vec<_> = plan.files.iter().map(|(_, path)| path).collect();
    let exported = json!({ "frames": frames, "collection": plan.collection, "files": files });
    terminal.document(&json!({ "status": ExitStatus::Done, "exported": exported }))?;
    Ok(ExitStatus::Done)
}

/// `pliant export file --to to`: frames `start`, `start + step`, ... below `end`, all without them, to a
/// folder or to a file ending in `.html`, `.pvd`, `.vtu`, `.obj`, `.glb`, `.npz` or `.csv`. Returns the
/// files of the frames, and the collection last.
///
/// # Errors
/// The exit code that the command would have had, and what it would have said.
pub fn export(
    file: PathBuf,
    to: PathBuf,
    frames: Option<(usize, usize, usize)>,
    force: bool,
) -> Result<Vec<PathBuf>, (u8, String)> {
    let frames = frames.map(|(start, end, step)| FrameRange { start, end: Some(end), step });
    let arguments = ExportArguments { file, to, format: None, frames, quantised: false, force };
    let refused = |failure: Failure| (failure.status.code(), failure.message());
    if let Some(format) = whole::format(&arguments.to) {
        whole::write(&arguments, format).map_err(refused)?;
        return Ok(vec![arguments.to]);
    }
    if is_page(&arguments).map_err(refused)? {
        super::view::write(&arguments.file, &arguments.to).map_err(refused)?;
        return Ok(vec![arguments.to]);
    }
    let plan = write(&arguments).map_err(refused)?;
    Ok(plan.files.into_iter().map(|(_, path)| path).chain(plan.collection).collect())
}

/// Whether a page is asked for, which has all frames.
///
/// # Errors
/// The page exists, or `--frames` or `--format` was given.
fn is_page(arguments: &ExportArguments) -> Result<bool, Failure> {
    if ending(&arguments.to).as_deref() != Some("html") {
        return Ok(false);
    }
    if arguments.frames.is_some() || arguments.format.is_some() {
        let message = format!("{} plays the whole recording", arguments.to.display());
        return Err(Failure::usage(format!("{message}; leave out `--frames` and `--format`")));
    }
    super::view::refuse_existing(&arguments.to, arguments.force, "--to")?;
    Ok(true)
}

/// What a file is named after its last dot, in small letters; `None` of folders, which may be called
/// anything if they are there.
fn ending(to: &Path) -> Option<String> {
    let extension = to.extension().filter(|_| !to.is_dir())?;
    Some(extension.to_string_lossy().to_ascii_lowercase())
}

/// Writes all files.
fn write(arguments: &ExportArguments) -> Result<ExportPlan, Failure> {
    Failure::unless_file(&arguments.file)?;
    let mut export = Export::open(&arguments.file).map_err(|error| Failure::recording(&error))?;
    let frames = chosen(arguments.frames, export.times().len(), &arguments.file)?;
    let plan = ExportPlan::new(arguments, &frames, export.times().len())?;
    plan.refuse_existing(arguments.force)?;
    if let Some(folder) = &plan.folder {
        fs::create_dir_all(folder).map_err(|error| cannot_write(folder, &error))?;
    }
    for (frame, path) in &plan.files {
        replace(path, |out| match plan.format {
            ExportFormat::Vtu => export.write_vtu(*frame, out),
            ExportFormat::Obj => export.write_obj(*frame, out),
        })?;
    }
    if let Some(collection) = &plan.collection {
        let time = |frame: &usize| export.times()[*frame];
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let entries: Vec<_> = plan.files.iter().map(|(frame, path)| (time(frame), name(path))).collect();
        // Last: it names files that are there.
        replace(collection, |out| Ok(write_pvd(&entries, out)?))?;
    }
    Ok(plan)
}

/// The frames asked for, which must be there.
fn chosen(range: Option<FrameRange>, count: usize, file: &Path) -> Result<Vec<usize>, Failure> {
    let FrameRange { start, end, step } = range.unwrap_or(FrameRange { start: 0, end: None, step: 1 });
    let last = end.map_or(start, |end| end - 1);
    if last.max(start) >= count {
        let there = if count == 0 {
            "it has none".to_owned()
        } else {
            format!("it has {}, 0 to {}", counted(count as u64, "frame", "frames"), count - 1)
        };
        return Err(Failure::usage(format!("{} has no frame {}: {there}", file.display(), last.max(start))));
    }
    Ok((start..end.unwrap_or(count)).step_by(step).collect())
}

/// Advice for places that are none.
const POSSIBLE: &str = "name a file ending in .html, .pvd, .vtu, .obj, .glb, .npz or .csv, or a folder \
                        (one that exists, or a name without an ending); `pliant render` draws pictures";

/// Files to write, and their contents.
struct ExportPlan {
    format: ExportFormat,
    /// Frames and their files, at least one.
    files: Vec<(usize, PathBuf)>,
    collection: Option<PathBuf>,
    /// To be made if it is not there.
    folder: Option<PathBuf>,
}

impl ExportPlan {
    fn new(arguments: &ExportArguments, frames: &[usize], count: usize) -> Result<ExportPlan, Failure> {
        let to = &arguments.to;
        let extension = ending(to);
        let named = match extension.as_deref() {
            Some("vtu" | "pvd") => Some(ExportFormat::Vtu),
            Some("obj") => Some(ExportFormat::Obj),
            _ => None,
        };
        if let (Some(named), Some(format)) = (named, arguments.format)
            && named != format
        {
            let message = format!("{} is no name for what --format asks for", to.display());
            return Err(Failure::usage(message));
        }
        let format = named.or(arguments.format).unwrap_or(ExportFormat::Vtu);
        let width = (count.saturating_sub(1)).to_string().len().max(4);
        let suffix = if format == ExportFormat::Vtu { "vtu" } else { "obj" };
        let series = |folder: &Path, stem: &OsStr| {
            let name = |frame: usize| {
                let mut name = stem.to_owned();
                name.push(format!("_{frame:0width$}.{suffix}"));
                folder.join(name)
            };
            frames.iter().map(|&frame| (frame, name(frame))).collect::<Vec<_>>()
        };
        let stem = |path: &Path| path.file_stem().unwrap_or(OsStr::new("frame")).to_owned();
        match extension.as_deref() {
            Some("pvd") => {
                let folder = to.parent().unwrap_or(Path::new(""));
                Ok(ExportPlan {
                    format,
                    files: series(folder, &stem(to)),
                    collection: Some(to.clone()),
                    folder: None,
                })
            }
            Some("vtu" | "obj") => match frames {
                [frame] => {
                    let files = vec![(*frame, to.clone())];
                    Ok(ExportPlan { format, files, collection: None, folder: None })
                }
                _ => {
                    let frames = counted(frames.len() as u64, "frame", "frames");
                    let message = format!("{} holds one frame, not {frames}", to.display());
                    Err(Failure::usage(format!("{message}; choose one with `--frames N`, or name a folder")))
                }
            },
            Some(other) => {
                let message = format!("{} ends in .{other}, which is no format of exports", to.display());
                Err(Failure::usage(format!("{message}; {POSSIBLE}")))
            }
            None if to.exists() && !to.is_dir() => {
                Err(Failure::usage(format!("{} is a file; {POSSIBLE}", to.display())))
            }
            _ => {
                let stem = stem(&arguments.file);
                let mut collection = to.join(&stem);
                collection.as_mut_os_string().push(".pvd");
                let collection = (format == ExportFormat::Vtu).then_some(collection);
                Ok(ExportPlan { format, files: series(to, &stem), collection, folder: Some(to.clone()) })
            }
        }
    }

    /// Before anything is written: either all files are new, or all may be replaced.
    fn refuse_existing(&self, force: bool) -> Result<(), Failure> {
        for path in self.files.iter().map(|(_, path)| path).chain(&self.collection) {
            Failure::unless_file(path)?;
            if path.exists() && !force {
                let message =
                    format!("{} exists; choose another path, or replace it with `--force`", path.display());
                return Err(Failure::usage(message));
            }
        }
        Ok(())
    }
}

/// Writes a file beside its place and moves it there: what is there is whole.
pub(super) fn replace(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), ExportError>,
) -> Result<(), Failure> {
    let part = durable_file::with_suffix(path, ".part");
    let written = durable_file::create(&part).map_err(ExportError::from).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()?;
        Ok(fs::rename(&part, path)?)
    });
    written.map_err(|error| {
        // Half a file is of no use.
        let _ = fs::remove_file(&part);
        match error {
            ExportError::Record(error) => Failure::recording(&error),
            ExportError::Write(error) => cannot_write(path, &error),
            error @ (ExportError::TooManyFrames { .. } | ExportError::TooLarge { .. }) => {
                Failure::usage(error.to_string())
            }
            error => Failure::failed("export", error.to_string()),
        }
    })
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::failed("export", format!("cannot write {}: {error}", path.display()))
}
