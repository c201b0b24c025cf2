//! Memory that a run takes, and what is said of it beforehand.

use super::{Bench, PLIANT};

/// A block in `dimension` dimensions, of `cells`, by these keys of `[time]`; three steps.
fn block(dimension: usize, cells: &str, order: usize, time: &str) -> String {
    let (gravity, size) = match dimension {
        2 => ("[0, -9.81]", "[3, 2]"),
        _ => ("[0, 0, -9.81]", "[1.6, 1.2, 1.2]"),
    };
    format!(
        "dimension = {dimension}\nworld = {{ gravity = {gravity} }}\n\
         time = {{ {time}, step = 1e-5, duration = 3e-5 }}\noutput = {{ rate = 1e5, channels = ['energy'] }}\n\
         [[body]]\norder = {order}\nmesh = {{ grid = {{ cells = {cells}, size = {size} }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e4, poisson = 0.3 }} }}\nmass = {{ density = 10.0 }}\n"
    )
}

/// Bytes that `check` promises for a scene, and the most that a run of it has in use.
fn promised_and_taken(scene: &str) -> (f64, f64) {
    let bench = Bench::new(scene);
    let check = bench.pliant(["check", "scene.toml", "--json"]).succeeded().json();
    let run = bench.pliant(["run", "scene.toml", "--json", "--threads", "2"]).succeeded().json();
    let promised = check["report"]["bytes"].as_f64().unwrap();
    // Where `check` looked for contact, lists of it are held.
    let at_start = run["summary"]["predicted_memory_bytes"].as_f64().unwrap();
    assert!(at_start == promised || (scene.contains("[contact]") && at_start < promised));
    (promised, run["summary"]["peak_memory_bytes"].as_f64().unwrap())
}

/// The memory that implicit steps take lies within 20 % of what is promised, apart from the program's own:
/// that of a scene of four triangles.
#[cfg(target_os = "linux")]
#[test]
fn implicit_steps_take_the_memory_that_check_promises() {
    let cholesky = "integrator = 'implicit-euler'";
    let by = |linear: &str| format!("{cholesky}, solver = {{ linear = '{linear}' }}");
    let (_, own) = promised_and_taken(&block(2, "[2, 1]", 1, cholesky));
    for (dimension, cells, order, time) in [
        (2, "[200, 130]", 1, cholesky),
        (2, "[200, 130]", 1, &by("cg")),
        (2, "[200, 130]", 1, &by("multigrid")),
        (2, "[200, 130]", 1, "integrator = 'sdirk4'"),
        (2, "[200, 130]", 1, "integrator = 'bdf2'"),
        (2, "[80, 60]", 2, cholesky),
        (3, "[24, 20, 20]", 1, cholesky),
        (3, "[24, 20, 20]", 1, &by("cg")),
        (2, "[60, 40]", 1, "integrator = 'gauss2'"),
        (2, "[60, 40]", 1, "integrator = 'radau-iia3'"),
        (3, "[8, 6, 6]", 1, "integrator = 'radau-iia2'"),
    ] {
        let (promised, peak) = promised_and_taken(&block(dimension, cells, order, time));
        let taken = peak - own;
        assert!(
            promised > own && taken > 0.8 * promised && taken < 1.2 * promised,
            "{dimension}D, order {order}, {time}: {promised:e} B promised, {taken:e} B taken"
        );
    }
}

/// A block that comes to lie on a table. Its matrix gets blocks of contact on the way, so that it is analysed
/// anew: the factor of before is given back first, where two of them took twice the memory promised.
#[cfg(target_os = "linux")]
#[test]
fn contact_takes_the_memory_that_check_promises() {
    let time = "integrator = 'implicit-euler'";
    let (_, own) = promised_and_taken(&block(2, "[2, 1]", 1, time));
    let falling = "velocity = { rigid = { linear = [0, -10] } }\n[contact]\ndistance = 1e-3\n[[obstacle]]\n\
                   name = 'table'\nshape = { half_space = { normal = [0, 1], offset = -2.5e-3 } }\n";
    let scene = block(2, "[200, 130]", 1, time).replace("e-5", "e-4").replace("rate = 1e5", "rate = 1e4");
    let (promised, peak) = promised_and_taken(&(scene + falling));
    let taken = peak - own;
    assert!(taken > 0.8 * promised && taken < 1.2 * promised, "{promised:e} B promised, {taken:e} B taken");
}

/// A run that does not fit is refused before it is allocated: in a shell with a limit, in words, not by an
/// abort.
#[cfg(target_os = "linux")]
#[test]
fn a_solve_that_does_not_fit_is_refused_beforehand() {
    let bench = Bench::new(&block(
        3,
        "[24, 20, 20]",
        1,
        "integrator = 'implicit-euler', solver = { linear = 'cholesky' }",
    ));
    let command = format!("ulimit -v 400000; exec {PLIANT} run scene.toml --threads 1");
    let mut shell = assert_cmd::Command::new("sh");
    let ended: super::Ended =
        shell.current_dir(bench.directory.path()).args(["-c", &command]).output().unwrap().into();
    ended.ended_with(2).says(&["for their matrices", "are available", "multigrid", "scene.toml:"]);
    assert!(bench.files().is_empty(), "{:?}", bench.files());
}
