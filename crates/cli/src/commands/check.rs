//! `pliant check`: the assembled problem in numbers, without running it.

use pliant::available_memory;
use pliant::energy::nbody::ForceError;
use pliant::quantity::{Rounded, Seconds};
use pliant_mesh::{BlockCount, Cleaned, Contents, SurfaceReport};
use pliant_scene::assembly::{Assembly, BodyReport, Report, UnstableStep};
use serde_json::json;

use crate::arguments::CheckArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::recording;
use crate::terminal::Terminal;
use crate::text::{bytes, count, counted, number, percent, table, wrap};

pub(crate) fn execute(arguments: &CheckArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let input = Input::read(&arguments.scene, &arguments.set, None)?;
    // Also a scene that will not run is worth looking at: the numbers show why.
    let assembly = input.assemble(UnstableStep::Accept)?;
    let report = &assembly.report;
    let unstable = report.stability.as_ref().and_then(|stability| input.scene.unstable_step(stability));
    let problem = unstable.map(|p| Failure::from(input.locate(vec![p])));
    terminal.report(&describe(&input, &assembly, terminal.width()))?;
    report.warnings.iter().for_each(|warning| terminal.warn(warning));
    let status = if problem.is_some() { ExitStatus::Invalid } else { ExitStatus::Done };
    if let Some(failure) = &problem {
        terminal.complain(&format!("\n{}", failure.render(terminal.color)));
    }
    let problems = problem.as_ref().map_or_else(|| json!([]), Failure::problems);
    terminal.document(&json!({
        "status": status,
        "scene": input.source.name(),
        "report": report,
        "memory": RunMemory::of(&input, &assembly),
        "problems": problems,
    }))?;
    Ok(status)
}

/// Bytes that `pliant run` takes at its peak, about.
#[derive(serde::Serialize)]
struct RunMemory {
    /// What steps hold.
    simulation: usize,
    /// Encoders, frames that wait, the compressor.
    recording: usize,
    /// The program itself.
    program: usize,
    /// All of them.
    run: usize,
    /// True where a body may fold onto itself in steps that are solved: how many of its contacts a matrix
    /// will have depends on the motion, and none of them are counted.
    #[serde(skip)]
    may_fold: bool,
}

/// Bytes of the program's pages that a run reads after those that a check of the same scene has read: 1.1 to
/// 4 MB in runs of 8 kinds of scenes on Linux.
const FURTHER_PAGES: usize = 2_500_000;
/// Bytes of these pages altogether where the system does not say.
const ALL_PAGES: usize = 18_000_000;
/// Bytes that the program writes to, its threads, and what the allocator keeps: 0.5 to 4 MB in runs of 47
/// scenes without contact, after what [`RunMemory`] counts.
const PROGRAM_BYTES: usize = 2_000_000;

impl RunMemory {
    fn of(input: &Input, assembly: &Assembly) -> Self {
        let options = recording::options(input, assembly, false);
        let recording = pliant_record::predicted_bytes(&options, &assembly.topology, assembly.report.frames);
        let simulation = assembly.report.bytes;
        let pages = available_memory::of_files().map_or(ALL_PAGES, |read| read as usize + FURTHER_PAGES);
        let program = pages + PROGRAM_BYTES;
        let solved = assembly.report.contact.as_ref().filter(|contact| contact.explicit.is_none());
        let may_fold =
            solved.is_some_and(|contact| contact.pairs.iter().any(|pair| pair.bodies[0] == pair.bodies[1]));
        RunMemory { simulation, recording, program, run: simulation + recording + program, may_fold }
    }

    fn describe(&self) -> String {
        let [run, simulation, recording] =
            [self.run, self.simulation, self.recording].map(|n| bytes(n as u64));
        let more = if self.may_fold { "; more where a body folds onto itself" } else { "" };
        format!(
            "about {run} while running: {simulation} of the simulation, {recording} of the recording, the \
             program{more}"
        )
    }
}

/// The report for people.
pub(crate) fn describe(input: &Input, assembly: &Assembly, width: usize) -> String {
    let (report, memory) = (&assembly.report, RunMemory::of(input, assembly));
    let mut out = String::new();
    if let Some(title) = &report.title {
        out += &wrap(title, 0, width);
        out.push('\n');
    }
    let size: Vec<String> = report.size.iter().map(|s| number(*s)).collect();
    let mut line = |name: &str, text: String| {
        out += &crate::text::entry(name, &text, 0, 12, width);
    };
    line(
        "problem",
        format!(
            "{}D, {}, {} unknowns, {} kg, {} m",
            report.dimension,
            counted(report.vertices as u64, "vertex", "vertices"),
            count(report.free_coordinates as u64),
            number(report.mass),
            size.join(" x "),
        ),
    );
    line("time", format!("{}, {}", steps(report), counted(report.frames, "frame", "frames"),));
    line("stability", stability(report) + walls(report));
    if let Some(error) = &report.tree_force_error {
        line("tree", tree(error));
    }
    line("memory", memory.describe());
    line("kernels", report.instruction_set.to_owned());
    out.push('\n');
    out += &bodies(report);
    out += &meshes(report, width);
    let step = Some(report.step).filter(|_| report.steps.is_some());
    let of_contact = report.contact.as_ref().map_or(vec![], |contact| contact.facts(step));
    let lists = [("contact", &of_contact), ("uses", &report.uses), ("inactive", &report.left_out)];
    for (title, entries) in lists.into_iter().filter(|(_, entries)| !entries.is_empty()) {
        out += &format!("\n{title}\n");
        for entry in entries {
            out += &crate::text::entry("-", entry, 2, 2, width);
        }
    }
    out
}

/// Kinds of cells, pieces and cleaning of the bodies that have cells; nothing for clouds of particles.
fn meshes(report: &Report, width: usize) -> String {
    let with_cells: Vec<&BodyReport> = report.bodies.iter().filter(|body| body.contents.pieces > 0).collect();
    if with_cells.is_empty() {
        return String::new();
    }
    let mut out = "\nmeshes\n".to_owned();
    for body in with_cells {
        let mut text = format!("`{}`: {}", body.name, contents(&body.contents));
        text += &body.surface.as_ref().map_or(String::new(), |surface| format!("; {}", made_from(surface)));
        out += &crate::text::entry("-", &text, 2, 2, width);
    }
    out
}

fn contents(mesh: &Contents) -> String {
    let dimension = mesh.blocks.iter().map(|block| block.dimension).max().unwrap_or(0);
    let solid = mesh.tetrahedra > 0 || dimension == 3;
    let block = |b: &BlockCount| counted(b.count as u64, b.kind[0], b.kind[1]);
    let of_blocks = mesh.blocks.iter().find(|block| block.dimension == dimension).map(block);
    let sides_of_blocks = mesh.blocks.iter().filter(|block| block.dimension < dimension).map(block);
    let order = if mesh.order == 2 { " of second order" } else { "" };
    let plural = |n: usize, one: &str, many: &str| (n > 0).then(|| counted(n as u64, one, many));
    let triangles = plural(mesh.triangles, "triangle", "triangles");
    let elements =
        if solid { plural(mesh.tetrahedra, "tetrahedron", "tetrahedra") } else { triangles.clone() };
    let elements = of_blocks.or(elements);
    let edges = plural(mesh.edges, "edge", "edges");
    let kinds: Vec<String> = elements.map(|text| text + order).into_iter().chain(edges).collect();
    let sides = [triangles.filter(|_| solid), plural(mesh.lines, "line", "lines")];
    let sides: Vec<String> = sides.into_iter().flatten().chain(sides_of_blocks).collect();
    let mut parts = vec![format!(
        "{}{} in {}",
        kinds.join(" and "),
        if sides.is_empty() { String::new() } else { format!(" ({} for groups)", sides.join(", ")) },
        counted(mesh.pieces as u64, "piece", "unconnected pieces")
    )];
    if mesh.coincident_vertices > 0 {
        let places = counted(mesh.coincident_vertices as u64, "vertex", "vertices");
        parts.push(format!("{places} at the position of another, not joined (`merge` joins them in a file)"));
    }
    parts.extend(mesh.cleaned.iter().map(cleaned));
    // Of two steps that remove vertices the later one counts in the numbers that the earlier one left: the
    // least is right.
    if let Some(first) = mesh.cleaned.iter().filter_map(|step| step.first_vertex).min() {
        parts.push(format!("vertices from {} on are renumbered", count(first as u64)));
    }
    parts.join("; ")
}

/// The surface that a solid was made from, and how they differ.
fn made_from(surface: &SurfaceReport) -> String {
    let kind = if surface.fitted { "fitted to" } else { "whole cubes, not fitted, in" };
    let percent = 100.0 * (surface.solid_volume / surface.volume - 1.0);
    let dihedral = surface.dihedral.map_or(String::new(), |[least, most]| {
        format!("; angles between faces {least:.1} to {most:.1} degrees")
    });
    format!(
        "{kind} a closed surface of {} and {}, {} m^3, the solid {} m^3 ({percent:+.2}%), no farther than \
         {} m from it{dihedral}",
        counted(surface.triangles as u64, "triangle", "triangles"),
        counted(surface.vertices as u64, "vertex", "vertices"),
        number(surface.volume),
        number(surface.solid_volume),
        number(surface.distance),
    )
}

/// `oriented 1,203 of 1,203 tetrahedra`, `dropped 3 triangles without an area`.
fn cleaned(step: &Cleaned) -> String {
    let of = step.total.map_or(String::new(), |total| format!(" of {}", count(total as u64)));
    let why = if step.why.is_empty() { String::new() } else { format!(" {}", step.why) };
    format!("{} {}{of} {}{why}", step.verb, count(step.count as u64), step.noun())
}

/// The scheme and its steps.
fn steps(report: &Report) -> String {
    let (integrator, step) = (report.integrator, Seconds(report.step));
    match report.steps {
        Some(steps) => {
            format!("{integrator} with a step of {step}: {}", counted(steps, "step", "steps"))
        }
        None => format!("{integrator} with an adaptive step size, the first step {step}"),
    }
}

/// Walls are no part of a linearised scene.
fn walls(report: &Report) -> &'static str {
    match (report.walls, report.is_implicit) {
        (0, _) => "",
        (_, false) => "; walls are not included",
        (_, true) => {
            "; walls are not included: a step is solved without them, and vertices behind them are then \
             moved back, which can add energy"
        }
    }
}

fn stability(report: &Report) -> String {
    let Some(limit) = &report.stability else {
        return match report.step_control {
            Some(_) if report.is_static => "automatic increments: no limit is needed".into(),
            Some(_) => "adaptive step size: no limit is needed".into(),
            None => "stable at any step on a linear system".into(),
        };
    };
    if limit.frequency > 0.0 && !limit.step.is_finite() {
        return format!(
            "stable at any step on a linear system; highest natural frequency {} rad/s, {} rad per step",
            number(limit.frequency),
            number(limit.frequency * report.step)
        );
    }
    if !limit.step.is_finite() {
        return "no oscillation about the initial state: no limit on the step".into();
    }
    let ratio = report.step / limit.step;
    let mut fastest = format!("highest natural frequency {} rad/s", number(limit.frequency));
    if limit.damping > 0.0 {
        fastest += &format!(", damping rate up to {} 1/s", number(limit.damping));
    }
    let what = if limit.grows_at_any_step {
        format!(
            "{} gains energy at any step; at {} its highest mode would double by the end",
            report.integrator,
            Seconds(limit.step)
        )
    } else {
        format!("steps up to {} are stable", Seconds(limit.step))
    };
    let verdict = if report.step_control.is_some() {
        "the error control keeps them below".to_owned()
    } else if ratio > 1.0 {
        format!("your step is UNSTABLE, {} times that", Rounded::<3>(ratio))
    } else {
        format!("your step is {} of that", percent(ratio))
    };
    format!("{fastest}; {what}; {verdict}")
}

fn tree(error: &ForceError) -> String {
    format!(
        "forces of the tree at the start, for {} against the sum over all pairs: relative error {} (rms), {} \
         (largest)",
        counted(error.samples as u64, "particle", "particles"),
        number(error.relative_rms),
        number(error.relative_max),
    )
}

fn bodies(report: &Report) -> String {
    let header =
        ["body", "vertices", "elements", "springs", "pinned", "mass [kg]", "quality", "worst element"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for body in &report.bodies {
        let counts = [body.vertices, body.elements, body.springs, body.pinned];
        let mut row = vec![body.name.clone()];
        row.extend(counts.map(|n| count(n as u64)));
        row.push(number(body.mass));
        if let Some(quality) = body.quality.elements.as_ref().filter(|_| body.elements > 0) {
            row.push(number(quality.average_mean_ratio));
            row.push(format!("{} (number {})", number(quality.worst_mean_ratio), quality.worst));
        }
        rows.push(row);
    }
    // Without elements there is no quality to show.
    if rows.iter().skip(1).all(|row| row.len() < header.len()) {
        rows[0].truncate(header.len() - 2);
        return table(&rows, 0);
    }
    let mut out = table(&rows, 0);
    out += "(quality: mean ratio, 1 for a regular element, 0 for a flat one; average and worst)\n";
    out
}
