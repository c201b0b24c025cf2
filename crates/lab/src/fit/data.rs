//! Measured data, and their prediction by a scene.
//!
//! # How to add data
//! 1. A kind of data is a variant of `FitDataKind`: its first column, its columns and its prediction here.
//! 2. A test of a material is a variant of `MaterialTest` in `curves.rs`, with its name in `ALL` and its
//!    stretches.
//! 3. Compare a fit with known constants in `tests.rs`, and show the table in `docs/guide/how-to/fit.md`.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use pliant::observer::Frame;
use pliant::probe::{self, Probe, TableColumn};
use pliant::quantity::Kind;
use pliant::simulation::Simulation;
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Scene, SceneError, Source};

use super::curves::{MaterialTest, nominal_stress};
use super::table::MeasuredTable;
use super::{FitError, FitOptions, MeasuredSeries};

/// Tolerance for equal times, as a fraction of a step.
const SAME_TIME: f64 = 1e-6;
/// Relative change of a parameter for finite differences, if predictions are exact to rounding.
const DIFFERENCE: f64 = 1e-5;

/// A measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Observation {
    /// Index of the series.
    pub(super) series: usize,
    /// Time [s], stretch, or number of the mode.
    pub(super) at: f64,
    /// Value in SI units.
    pub(super) value: f64,
    /// Weight of the residual.
    pub(super) weight: f64,
}

/// Measured data.
pub(super) struct FitData {
    pub(super) kind: FitDataKind,
    pub(super) series: Vec<MeasuredSeries>,
    pub(super) observations: Vec<Observation>,
    /// Redundant columns of the table.
    pub(super) left_out: Vec<String>,
}

/// Kind of data, with what a prediction needs.
pub(super) enum FitDataKind {
    /// Trajectory: columns of the scene's probes, one for each series.
    Trajectory { columns: Vec<usize> },
    /// Curves: tests of a body's material, one for each series.
    Curves { tests: Vec<MaterialTest>, body: usize },
    /// Lowest natural frequencies.
    Frequencies,
}

/// Reason for a missing prediction.
#[derive(Debug)]
pub(super) enum Refusal {
    /// The scene cannot be simulated.
    Scene(SceneError),
    /// The run or another computation failed.
    Failed(String),
    /// The fit was told to stop.
    Stopped,
}

impl From<Refusal> for FitError {
    fn from(refusal: Refusal) -> FitError {
        match refusal {
            Refusal::Scene(error) => FitError::Scene(error),
            Refusal::Failed(reason) => FitError::Run(reason),
            Refusal::Stopped => FitError::Stopped,
        }
    }
}

impl FitData {
    /// Reads a table; the first column determines the kind of data.
    ///
    /// # Errors
    /// [`FitError::Data`]: unknown columns, columns with a wrong unit, columns without numbers.
    pub(super) fn read(
        table: &MeasuredTable,
        source: &Source,
        scene: &Scene,
        body: Option<usize>,
        options: &FitOptions,
    ) -> Result<FitData, FitError> {
        let named = |name| table.column(name).is_some();
        let mut data = if named("time") {
            trajectory(table, source, scene, options)?
        } else if named("mode") {
            frequencies(table)?
        } else if ["stretch", "strain", "displacement"].into_iter().any(named) {
            curves(table, scene, body, options)?
        } else {
            let names: Vec<String> = table.titles.iter().map(|title| format!("`{}`", title.name)).collect();
            return Err(table.wrong(format!(
                "the columns are {}; one must be `time` (a trajectory of probes), `mode` (frequencies), or \
                 `stretch`, `strain` or `displacement` (curves of a material)",
                names.join(", ")
            )));
        };
        if data.observations.is_empty() {
            return Err(table.wrong("no number was measured: there is no row, or all cells are empty"));
        }
        data.weigh();
        Ok(data)
    }

    /// Sets the weights of the residuals. Frequencies are weighted by the inverse of their value, because
    /// their errors are relative. Data with several units are weighted by the inverse rms of the values
    /// of each unit.
    fn weigh(&mut self) {
        if matches!(self.kind, FitDataKind::Frequencies) {
            self.observations.iter_mut().for_each(|one| one.weight = 1.0 / one.value);
            return;
        }
        let units: Vec<&str> = self.series.iter().map(|series| series.unit.as_str()).collect();
        if units.windows(2).all(|pair| pair[0] == pair[1]) {
            return;
        }
        let mean_square = |unit: &str| {
            let of_unit = self.observations.iter().filter(|one| units[one.series] == unit);
            let count = of_unit.clone().count().max(1) as f64;
            of_unit.map(|one| one.value * one.value).sum::<f64>() / count
        };
        let weight = |unit: &&str| match mean_square(unit).sqrt() {
            0.0 => 1.0,
            size => 1.0 / size,
        };
        let weights: Vec<f64> = units.iter().map(weight).collect();
        self.observations.iter_mut().for_each(|one| one.weight = weights[one.series]);
    }

    /// Quantity of the first axis of a chart.
    pub(super) fn axis(&self) -> &'static str {
        match self.kind {
            FitDataKind::Trajectory { .. } => "time [s]",
            FitDataKind::Curves { .. } => "stretch",
            FitDataKind::Frequencies => "mode",
        }
    }

    /// Relative change of a parameter for finite differences: with prediction errors of size `e`, the
    /// smallest possible error of central differences is of order `e^(2/3)`.
    pub(super) fn difference(&self, scene: &Scene) -> f64 {
        match self.kind {
            FitDataKind::Curves { .. } => DIFFERENCE,
            FitDataKind::Frequencies => 1e-4,
            FitDataKind::Trajectory { .. } => {
                let time = &scene.time;
                let tolerance = time.solver.as_ref().and_then(|solver| solver.tolerance);
                match (&time.adaptive, tolerance) {
                    (Some(adaptive), _) => adaptive.tolerance_or_default().cbrt().clamp(DIFFERENCE, 1e-2),
                    _ if !time.integrator.method().iterates() => DIFFERENCE,
                    // The default tolerance of a scene depends on the error of the integrator.
                    (None, None) => 1e-3,
                    // Scenes have sizes near one metre; the cube root makes the result insensitive to it.
                    (None, Some(tolerance)) => tolerance.cbrt().clamp(DIFFERENCE, 1e-2),
                }
            }
        }
    }

    /// Predicts every observation from the scene, in SI units.
    ///
    /// # Errors
    /// [`Refusal`].
    pub(super) fn predict(&self, source: &Source, stop: &Arc<AtomicBool>) -> Result<Vec<f64>, Refusal> {
        if stop.load(Ordering::Relaxed) {
            return Err(Refusal::Stopped);
        }
        let scene = source.scene().map_err(Refusal::Scene)?;
        let assembled = |unstable| {
            let mut assembly =
                scene.assemble(unstable).map_err(|problems| Refusal::Scene(source.error(problems)))?;
            assembly.simulation.set_stop(Some(Arc::clone(stop)));
            Ok(assembly)
        };
        let predicted = match &self.kind {
            FitDataKind::Trajectory { columns } => self.run(assembled(UnstableStep::Refuse)?, columns),
            FitDataKind::Frequencies => self.modes(assembled(UnstableStep::Accept)?),
            FitDataKind::Curves { tests, body } => self.stresses(&scene, tests, *body),
        };
        match predicted {
            Err(_) if stop.load(Ordering::Relaxed) => Err(Refusal::Stopped),
            predicted => predicted.map_err(Refusal::Failed),
        }
    }

    /// Values of probes at the times of all observations, from a single run.
    fn run(&self, assembly: Assembly, columns: &[usize]) -> Result<Vec<f64>, String> {
        let mut order: Vec<usize> = (0..self.observations.len()).collect();
        order.sort_by(|&a, &b| self.observations[a].at.total_cmp(&self.observations[b].at));
        let mut followed = FollowedRun::new(assembly);
        let mut predicted = vec![0.0; order.len()];
        for observations in order.chunk_by(|&a, &b| self.observations[a].at == self.observations[b].at) {
            let row = followed.row_at(self.observations[observations[0]].at)?;
            for &i in observations {
                predicted[i] = row[columns[self.observations[i].series]];
            }
        }
        Ok(predicted)
    }

    fn modes(&self, mut assembly: Assembly) -> Result<Vec<f64>, String> {
        let count = self.observations.iter().fold(0.0, |most: f64, one| most.max(one.at)) as usize;
        let found = assembly.simulation.modes(count).map_err(|error| error.to_string())?;
        let frequency = |mode: usize| {
            let there = found.modes.len();
            let mode_there = found.modes.get(mode - 1).map(|mode| mode.frequency);
            mode_there.ok_or_else(|| format!("the scene has {there} modes; mode {mode} was measured"))
        };
        self.observations.iter().map(|one| frequency(one.at as usize)).collect()
    }

    fn stresses(&self, scene: &Scene, tests: &[MaterialTest], body: usize) -> Result<Vec<f64>, String> {
        let material = scene.body[body].elastic.as_ref().ok_or("the body has no `elastic`")?;
        if !material.is_isotropic() {
            return Err(format!(
                "`{}` depends on directions, and a curve says nothing of them; fit forces of a run of \
                 the piece",
                material.name()
            ));
        }
        let stress = |one: &Observation| {
            nominal_stress(material, tests[one.series], one.at).ok_or_else(|| {
                format!("the material finds no rest across its axis at the stretch {}", one.at)
            })
        };
        self.observations.iter().map(stress).collect()
    }
}

/// A run whose probes are read during stepping.
struct FollowedRun {
    simulation: Simulation,
    probes: Vec<Probe>,
    dimension: usize,
    /// Step number and probe values of the last state before a time between two steps.
    before: (u64, Vec<f64>),
}

impl FollowedRun {
    fn new(assembly: Assembly) -> FollowedRun {
        let Assembly { simulation, probes, .. } = assembly;
        let dimension = simulation.system().dimension();
        let mut run = FollowedRun { simulation, probes, dimension, before: (0, vec![]) };
        run.before = (run.simulation.state().step, run.row());
        run
    }

    /// Current values of all columns of all probes.
    fn row(&mut self) -> Vec<f64> {
        let FollowedRun { simulation, probes, .. } = self;
        Frame::of_state(simulation, 0, probe::quantities(probes), None, |frame| probe::row(probes, frame))
    }

    /// Probe values at a time [s] not before the last one. Between two steps, positions follow cubic
    /// Hermite interpolation of positions and velocities, other values linear interpolation.
    fn row_at(&mut self, time: f64) -> Result<Vec<f64>, String> {
        if self.simulation.step_control().is_some() {
            while self.simulation.state().time < time {
                self.simulation.step_towards(time).map_err(|error| error.to_string())?;
            }
            return Ok(self.row());
        }
        let h = self.simulation.step_size();
        let steps = (time / h).max(0.0);
        let (step, is_step) = (steps.round(), (steps - steps.round()).abs() <= SAME_TIME);
        let (first, last) =
            if is_step { (step as u64, step as u64) } else { (steps as u64, steps as u64 + 1) };
        while self.simulation.state().step < last {
            if self.simulation.state().step == first {
                self.before = (first, self.row());
            }
            self.simulation.step().map_err(|error| error.to_string())?;
        }
        let after = self.row();
        if is_step {
            return Ok(after);
        }
        Ok(self.between(&after, steps - first as f64, h))
    }

    /// Values at the fraction `s` of the step between the previous state and `after`.
    fn between(&self, after: &[f64], s: f64, h: f64) -> Vec<f64> {
        let (before, d) = (&self.before.1, self.dimension);
        let mut row: Vec<f64> = before.iter().zip(after).map(|(a, b)| a + s * (b - a)).collect();
        let mut first = 0;
        for probe in &self.probes {
            for axis in 0..d {
                let [x, v, u] = [0, 1, 2].map(|block| first + block * d + axis);
                let (slope, change) = (after[x] - before[x], [before[v] * h, after[v] * h]);
                // Difference between the cubic and the linear interpolation.
                let bend = s * (1.0 - s) * ((1.0 - s) * (change[0] - slope) - s * (change[1] - slope));
                row[x] += bend;
                row[u] += bend;
            }
            first += probe::columns(std::slice::from_ref(probe), d).len();
        }
        row
    }
}

/// Data of probe columns over time.
fn trajectory(
    table: &MeasuredTable,
    source: &Source,
    scene: &Scene,
    options: &FitOptions,
) -> Result<FitData, FitError> {
    let assembly = scene.assemble(UnstableStep::Accept).map_err(|problems| source.error(problems))?;
    if assembly.probes.is_empty() {
        return Err(table.wrong(
            "it has a column `time`, of a trajectory, but the scene has no [[probe]] that it could be of",
        ));
    }
    // Columns of the probes, times, and the selected columns.
    let known = probe::columns(&assembly.probes, scene.dimension);
    let numbers: HashMap<&str, usize> =
        known.iter().enumerate().map(|(i, known)| (known.name.as_str(), i)).collect();
    let chosen: HashSet<&str> = options.columns.iter().map(String::as_str).collect();
    let axis = table.column("time").unwrap_or(0);
    let (factor, _) = table.factor(axis, &[Kind::TIME])?;
    if let Some((line, time)) = table.numbers(axis).find(|(_, time)| *time < 0.0) {
        return Err(table.wrong(format!("line {line}: the time {time} is before the start of the run, 0")));
    }
    let wanted = |name: &str| chosen.is_empty() || chosen.contains(name);
    if let Some(name) = options.columns.iter().find(|name| table.column(name).is_none()) {
        return Err(table.wrong(format!("there is no column `{name}`")));
    }
    let mut data =
        FitData { kind: FitDataKind::Frequencies, series: vec![], observations: vec![], left_out: vec![] };
    let mut columns = vec![];
    // Observations of each column.
    for (i, title) in table.titles.iter().enumerate().filter(|(i, title)| *i != axis && wanted(&title.name)) {
        let Some(column) = numbers.get(title.name.as_str()).copied() else {
            let names: Vec<&str> = known.iter().map(|known| known.name.as_str()).collect();
            return Err(table.wrong(format!(
                "column `{}` is none of a probe of the scene; those are {}",
                title.name,
                names.join(", ")
            )));
        };
        if options.columns.is_empty() && repeats_position(table, &title.name, &numbers) {
            data.left_out.push(title.name.clone());
            continue;
        }
        let TableColumn { name, unit } = known[column].clone();
        let (scale, _) = table.factor(i, &[kind_of(unit)])?;
        let series = data.series.len();
        let observed = table.beside(axis, i)?.into_iter();
        let observation =
            |(at, value)| Observation { series, at: factor * at, value: scale * value, weight: 1.0 };
        data.observations.extend(observed.map(observation));
        data.series.push(MeasuredSeries::new(name, unit));
        columns.push(column);
    }
    data.kind = FitDataKind::Trajectory { columns };
    Ok(data)
}

/// True for a displacement `NAME.ux` next to the position `NAME.x`, which it repeats.
fn repeats_position(table: &MeasuredTable, name: &str, known: &HashMap<&str, usize>) -> bool {
    let Some((probe, component)) = name.rsplit_once('.') else { return false };
    let axis = component.strip_prefix('u').filter(|axis| matches!(*axis, "x" | "y" | "z"));
    let position = axis.map(|axis| format!("{probe}.{axis}"));
    position.is_some_and(|name| table.column(&name).is_some() && known.contains_key(name.as_str()))
}

/// Kind of a probe column with this unit.
fn kind_of(unit: &str) -> Kind {
    Kind::ALL.iter().find(|kind| kind.unit == unit).copied().unwrap_or(match unit {
        "J/m^3" => Kind::PRESSURE,
        _ => Kind::NUMBER,
    })
}

/// Data of frequencies by mode number.
fn frequencies(table: &MeasuredTable) -> Result<FitData, FitError> {
    let axis = table.column("mode").unwrap_or(0);
    if let Some(title) =
        table.titles.iter().find(|title| !matches!(title.name.as_str(), "mode" | "frequency"))
    {
        return Err(table.wrong(format!(
            "column `{}` is none of frequencies; those are `mode`, from 1 as `pliant modes` counts, and \
             `frequency [Hz]`",
            title.name
        )));
    }
    let Some(column) = table.column("frequency") else {
        return Err(table.wrong("it has a column `mode` but no `frequency [Hz]`"));
    };
    let (factor, _) = table.factor(column, &[Kind::RATE])?;
    for (line, mode) in table.numbers(axis) {
        if mode < 1.0 || mode.fract() != 0.0 || mode > 1000.0 {
            return Err(table.wrong(format!(
                "line {line}: `mode` is {mode}; modes are counted from 1, rigid motions too, as \
                 `pliant modes` does"
            )));
        }
    }
    if let Some((line, value)) = table.numbers(column).find(|(_, value)| *value <= 0.0) {
        return Err(table
            .wrong(format!("line {line}: the frequency {value} is not positive; leave rigid motions out")));
    }
    let observed = table.beside(axis, column)?.into_iter();
    let observation =
        |(at, value): (f64, f64)| Observation { series: 0, at, value: factor * value, weight: 1.0 };
    Ok(FitData {
        kind: FitDataKind::Frequencies,
        series: vec![MeasuredSeries::new("frequency".into(), "Hz")],
        observations: observed.map(observation).collect(),
        left_out: vec![],
    })
}

/// Data of stress or force over stretch, strain or displacement, for one or several tests.
fn curves(
    table: &MeasuredTable,
    scene: &Scene,
    body: Option<usize>,
    options: &FitOptions,
) -> Result<FitData, FitError> {
    let Some(body) = body.filter(|body| scene.body[*body].elastic.is_some()) else {
        return Err(table.wrong(
            "curves are of the material of one body: all parameters must be of its `elastic`, like \
             `body.0.elastic.young`",
        ));
    };
    // The first axis, converted to a stretch.
    let axes = ["stretch", "strain", "displacement"];
    let found: Vec<(&str, usize)> =
        axes.into_iter().filter_map(|name| Some((name, table.column(name)?))).collect();
    let [(axis_name, axis)] = found[..] else {
        return Err(
            table.wrong("only one of the columns `stretch`, `strain` and `displacement` can be there")
        );
    };
    let stretch: Box<dyn Fn(f64) -> f64> = match axis_name {
        "displacement" => {
            let (factor, _) = table.factor(axis, &[Kind::LENGTH])?;
            let length = options.length.ok_or_else(|| {
                table.wrong("`displacement` needs the length of the piece at rest: `--length`, like 20mm")
            })?;
            Box::new(move |u| 1.0 + factor * u / length)
        }
        name => {
            let (factor, _) = table.factor(axis, &[Kind::NUMBER])?;
            let rest = if name == "strain" { 1.0 } else { 0.0 };
            Box::new(move |l| rest + factor * l)
        }
    };
    let mut data =
        FitData { kind: FitDataKind::Frequencies, series: vec![], observations: vec![], left_out: vec![] };
    let mut tests = vec![];
    // Observations of each test, converted to nominal stress.
    for (i, title) in table.titles.iter().enumerate().filter(|(i, _)| *i != axis) {
        let Some((name, test)) = MaterialTest::ALL.into_iter().find(|(name, _)| *name == title.name) else {
            let names = MaterialTest::ALL.map(|(name, _)| format!("`{name}`")).join(", ");
            return Err(table.wrong(format!("column `{}` is no test; tests are {names}", title.name)));
        };
        let (factor, kind) = table.factor(i, &[Kind::PRESSURE, Kind::FORCE])?;
        let factor = match (kind == &Kind::FORCE, options.area) {
            (false, _) => factor,
            (true, Some(area)) => factor / area,
            (true, None) => {
                return Err(table.wrong(format!(
                    "column `{name}` is a force: it needs the area at rest that it acts on, `--area`, like \
                     4mm^2"
                )));
            }
        };
        let series = data.series.len();
        for (at, value) in table.beside(axis, i)? {
            let l = stretch(at);
            if l <= 0.0 {
                return Err(
                    table.wrong(format!("`{axis_name}` {at} is a stretch of {l}; it must be positive"))
                );
            }
            data.observations.push(Observation { series, at: l, value: factor * value, weight: 1.0 });
        }
        data.series.push(MeasuredSeries::new(name.into(), "Pa"));
        tests.push(test);
    }
    data.kind = FitDataKind::Curves { tests, body };
    Ok(data)
}
