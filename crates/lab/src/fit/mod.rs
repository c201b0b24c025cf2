//! Fits: parameters of a scene from measured data: a trajectory, curves of a material or frequencies.
//!
//! The method is nonlinear least squares by Levenberg-Marquardt, between bounds, from one start or several.
//! Derivatives of predictions are central differences: two runs per parameter, in parallel on the available
//! cores. An adjoint sweep ([`pliant_gradient::gradient`]) would give one residual's derivatives with respect
//! to all parameters, and there are many more residuals than parameters. It would also exclude features
//! without an adjoint, such as paths by arc length. Central differences are accurate enough: errors of
//! derivatives lengthen the iteration slightly and do not worsen the fit.
//!
//! ```
//! use std::sync::{Arc, atomic::AtomicBool};
//! use pliant_lab::fit::{SceneFit, FitOptions};
//! use pliant_scene::Source;
//!
//! let source = Source::new("rubber", "dimension = 3
//!     time = { integrator = 'velocity-verlet', step = 1e-5, duration = 0 }
//!     [[body]]
//!     mesh = { grid = { cells = [1, 1, 1], spacing = 1 } }
//!     elastic = { hencky = { young = '1 MPa', poisson = 0.3 } }
//!     mass = { density = 1000 }");
//! // P = E ln(l)/l with E = 2 MPa.
//! let data = "stretch,uniaxial [MPa]\n1.1,0.17329\n1.5,0.54062\n2,0.69315\n";
//! let options = FitOptions::of(&["body.0.elastic.young"]);
//! let stop = Arc::new(AtomicBool::new(false));
//! let fit = SceneFit::of(&source, ("data.csv", data), &options, &stop, &mut |_| {})?;
//! assert!((fit.parameters[0].value - 2e6).abs() < 100.0);
//! # Ok::<(), pliant_lab::fit::FitError>(())
//! ```

mod chart;
mod curves;
mod data;
mod keys;
mod least_squares;
mod student;
mod table;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::DMatrix;
use pliant_scene::{KeySegment, SceneError, Source};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use crate::study::plot::PlotError;
use data::{FitData, Refusal};
use keys::FittedKey;
use least_squares::{LeastSquares, Minimum};
use table::MeasuredTable;

/// Probability that a confidence interval contains the parameter.
const CONFIDENCE: f64 = 0.95;
/// Correlation above which parameters can hardly be distinguished.
const CORRELATED: f64 = 0.98;
/// Maximum number of draws for a start that can be simulated.
const DRAWS: u32 = 20;
/// Relative tolerance of the sum of squares within which starts count as reaching the best minimum.
const SAME_MINIMUM: f64 = 1e-6;

/// Options of a fit: its parameters and its method.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitOptions {
    /// Keys of the parameters, `body.0.elastic.young`: bodies by name or number, the model may be omitted.
    pub parameters: Vec<String>,
    /// Bounds of some parameters, by key, in SI units.
    pub bounds: Vec<(String, [f64; 2])>,
    /// Number of starts: the values of the scene, then random ones. 0 counts as 1.
    pub starts: u32,
    /// Seed of the random starts.
    pub seed: u64,
    /// Columns of a trajectory to fit; all if empty.
    pub columns: Vec<String>,
    /// Reference length [m] of a piece whose displacement was measured.
    pub length: Option<f64>,
    /// Reference area [m^2] of a piece on which a force was measured.
    pub area: Option<f64>,
}

impl FitOptions {
    /// Options to fit these parameters, from the values of the scene.
    pub fn of(parameters: &[&str]) -> FitOptions {
        FitOptions { parameters: parameters.iter().map(|&key| key.to_owned()).collect(), ..Self::default() }
    }
}

/// Error of a fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The scene cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The table of measurements is invalid, or does not fit the scene.
    #[error("{name}: {message}")]
    Data {
        /// Name of the table.
        name: String,
        /// The mistake, its position, and the remedy.
        message: String,
    },
    /// An unknown parameter, or one that cannot be fitted.
    #[error("`{name}` {problem}; these can be fitted: {}", known.join(", "))]
    Key {
        /// Name of the parameter.
        name: String,
        /// The mistake.
        problem: String,
        /// Names of parameters that can be fitted.
        known: Vec<String>,
    },
    /// Options that contradict each other or the scene.
    #[error("{0}")]
    Options(String),
    /// The original scene does not run to the end of the measurements.
    #[error("there is nothing to compare with: {0}")]
    Run(String),
    /// The fit was stopped.
    #[error("stopped")]
    Stopped,
}

/// Progress of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitProgress<'a> {
    /// Number of the start, from 0.
    pub start: u32,
    /// Number of steps from that start.
    pub steps: u32,
    /// Weighted sum of squares of the residuals.
    pub sum_of_squares: f64,
    /// Current parameters, in order, in SI units.
    pub parameters: &'a [f64],
}

/// A fitted parameter.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FittedParameter {
    /// Key in the text of the scene.
    pub path: String,
    /// Best value, in SI units like all values here.
    pub value: f64,
    /// Value in the scene.
    pub start: f64,
    /// Standard deviation by the linear theory of least squares; `None` if the measurements do not
    /// determine the parameter, or at a bound.
    pub standard_deviation: Option<f64>,
    /// Confidence interval of 95 %, by Student's t; `None` as for the standard deviation.
    pub interval: Option<[f64; 2]>,
    /// True if the best value is at a bound.
    pub at_bound: bool,
}

/// Measured and predicted values of one column.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MeasuredSeries {
    /// Name of the column.
    pub name: String,
    /// SI unit of the values.
    pub unit: String,
    /// Time [s], stretch, or number of the mode.
    pub at: Vec<f64>,
    /// Measured values.
    pub measured: Vec<f64>,
    /// Predictions with the fitted parameters.
    pub fitted: Vec<f64>,
    /// Root mean square of the differences.
    pub rms: f64,
}

impl MeasuredSeries {
    fn new(name: String, unit: &str) -> Self {
        let unit = unit.to_owned();
        MeasuredSeries { name, unit, at: vec![], measured: vec![], fitted: vec![], rms: 0.0 }
    }
}

/// Result of one start.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FitStart {
    /// Start values.
    pub from: Vec<f64>,
    /// Final values, in the order of the parameters; `None` if no start was found that runs.
    pub to: Option<Vec<f64>>,
    /// Weighted sum of squares of the residuals at the final values.
    pub sum_of_squares: Option<f64>,
}

/// Result of a fit.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SceneFit {
    /// Fitted parameters, in the requested order.
    pub parameters: Vec<FittedParameter>,
    /// Correlation matrix of their errors, by rows; `None` for a parameter that is undetermined or at a
    /// bound.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Weighted sum of squares of the residuals: in SI units; dimensionless for data of several units and
    /// for frequencies.
    pub sum_of_squares: f64,
    /// Number of measured values.
    pub measured: usize,
    /// Number of measured values minus the number of free parameters.
    pub degrees_of_freedom: usize,
    /// Number of steps from the best start.
    pub steps: u32,
    /// Total number of runs or other predictions.
    pub runs: u64,
    /// Result of each start.
    pub starts: Vec<FitStart>,
    /// Warnings, a sentence each.
    pub warnings: Vec<String>,
    /// Keys with their fitted values, as TOML for the scene.
    pub toml: String,
    /// Columns of measurements with their predictions.
    pub series: Vec<MeasuredSeries>,
    /// Quantity of the first axis of a chart.
    pub axis: &'static str,
    /// Scene with the fitted values.
    #[serde(skip)]
    pub scene: Source,
}

impl SceneFit {
    /// Fits parameters of a scene to a table, given by name and text; `watch` receives every step, `stop`
    /// ends the fit.
    ///
    /// A table with a column `time` is a trajectory: its columns are those of `run --probes`. With `mode`
    /// it contains frequencies (`frequency [Hz]`). With `stretch`, `strain` or `displacement` it contains
    /// curves of the material: `uniaxial`, `equibiaxial`, `pure-shear`, nominal stress or force.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn of(
        source: &Source,
        (name, text): (&str, &str),
        options: &FitOptions,
        stop: &Arc<AtomicBool>,
        watch: &mut dyn FnMut(FitProgress<'_>),
    ) -> Result<SceneFit, FitError> {
        let scene = source.scene()?;
        let keys = chosen(source, &scene, options)?;
        let bounds = bounds(source, &scene, &keys, options)?;
        let table = MeasuredTable::read(name, text)?;
        let body = body_of(&keys);
        let data = FitData::read(&table, source, &scene, body, options)?;
        let (measured, count) = (data.observations.len(), keys.len());
        if measured <= count {
            let (numbers, of) = (words(measured, "number"), words(count, "parameter"));
            return Err(table.wrong(format!(
                "{numbers} cannot settle {of}: at least {} are needed, and more tell how well",
                count + 1
            )));
        }
        let sizes = sizes(&keys, &bounds)?;
        let search = FitSearch { source, keys: &keys, bounds: &bounds, sizes: &sizes, data: &data, stop };
        let found = search.all(options, data.difference(&scene), watch)?;
        search.describe(found, data.difference(&scene))
    }

    /// Draws the fit and its residuals as one SVG.
    ///
    /// # Errors
    /// The drawing library fails.
    pub fn svg(&self, title: &str) -> Result<String, PlotError> {
        chart::svg(self, title)
    }
}

/// Path in the text of a scene of the number with this name, in the notation of
/// [`FitOptions::parameters`].
///
/// # Errors
/// [`FitError::Key`].
pub fn key_path(source: &Source, scene: &pliant_scene::Scene, name: &str) -> Result<String, FitError> {
    FittedKey::find(source, scene, name).map(|key| key.path.to_string())
}

/// Formats a count with its noun: `1 number`, `3 numbers`.
fn words(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Resolves the keys of the parameters.
fn chosen(
    source: &Source,
    scene: &pliant_scene::Scene,
    options: &FitOptions,
) -> Result<Vec<FittedKey>, FitError> {
    if options.parameters.is_empty() {
        return Err(FitError::Options("no parameter is to be fitted".into()));
    }
    let mut keys: Vec<FittedKey> = vec![];
    for name in &options.parameters {
        let key = FittedKey::find(source, scene, name)?;
        if keys.iter().any(|other| other.path == key.path) {
            return Err(FitError::Options(format!("`{name}` is asked for twice")));
        }
        keys.push(key);
    }
    Ok(keys)
}

/// The body whose material all keys belong to.
fn body_of(keys: &[FittedKey]) -> Option<usize> {
    let body = keys[0].body;
    let is_elastic = |key: &FittedKey| {
        key.body == body && key.path.segments().get(2) == Some(&KeySegment::Key("elastic".into()))
    };
    body.filter(|_| keys.iter().all(is_elastic))
}

/// Bounds of each key; infinite for none.
fn bounds(
    source: &Source,
    scene: &pliant_scene::Scene,
    keys: &[FittedKey],
    options: &FitOptions,
) -> Result<Vec<[f64; 2]>, FitError> {
    let mut bounds = vec![[f64::NEG_INFINITY, f64::INFINITY]; keys.len()];
    for (name, [low, high]) in &options.bounds {
        let path = FittedKey::find(source, scene, name)?.path;
        let Some(i) = keys.iter().position(|key| key.path == path) else {
            return Err(FitError::Options(format!("`{name}` has bounds but is not to be fitted")));
        };
        if low >= high {
            return Err(FitError::Options(format!(
                "the bounds of `{name}`, {low} and {high}, leave nothing between them"
            )));
        }
        let value = keys[i].value;
        if !(*low..=*high).contains(&value) {
            return Err(FitError::Options(format!(
                "`{name}` is {value} in the scene, outside of its bounds {low} and {high}; the fit starts \
                 there"
            )));
        }
        bounds[i] = [*low, *high];
    }
    Ok(bounds)
}

/// Sizes of the parameters, which scale differences and random starts.
fn sizes(keys: &[FittedKey], bounds: &[[f64; 2]]) -> Result<Vec<f64>, FitError> {
    let size = |(key, [low, high]): (&FittedKey, &[f64; 2])| match (key.value.abs(), 0.5 * (high - low)) {
        (size, _) if size > 0.0 => Ok(size),
        (_, width) if width.is_finite() => Ok(width),
        _ => Err(FitError::Options(format!(
            "`{}` is 0 in the scene, which says nothing of its size; give it a value or bounds",
            key.path
        ))),
    };
    keys.iter().zip(bounds).map(size).collect()
}

/// Search for the best parameters.
struct FitSearch<'a> {
    source: &'a Source,
    keys: &'a [FittedKey],
    bounds: &'a [[f64; 2]],
    sizes: &'a [f64],
    data: &'a FitData,
    stop: &'a Arc<AtomicBool>,
}

/// Best minimum, results of all starts, and number of predictions.
struct SearchResult {
    best: Minimum,
    starts: Vec<FitStart>,
    runs: u64,
}

impl FitSearch<'_> {
    /// Scene with these parameters.
    fn scene(&self, parameters: &[f64]) -> Result<Source, SceneError> {
        let changes: Vec<_> = self.keys.iter().zip(parameters).map(|(key, value)| key.set(*value)).collect();
        self.source.varied(&changes)
    }

    fn predict(&self, parameters: &[f64]) -> Result<Vec<f64>, Refusal> {
        self.data.predict(&self.scene(parameters).map_err(Refusal::Scene)?, self.stop)
    }

    fn residuals(&self, parameters: &[f64]) -> Result<Vec<f64>, Refusal> {
        let predicted = self.predict(parameters)?;
        let observed = self.data.observations.iter().zip(&predicted);
        let residuals: Vec<f64> = observed.map(|(one, value)| one.weight * (value - one.value)).collect();
        match residuals.iter().all(|residual| residual.is_finite()) {
            true => Ok(residuals),
            false => Err(Refusal::Failed("a number that is predicted is not finite".into())),
        }
    }

    /// Minimises from the scene's values, then from random starts.
    fn all(
        &self,
        options: &FitOptions,
        difference: f64,
        watch: &mut dyn FnMut(FitProgress<'_>),
    ) -> Result<SearchResult, FitError> {
        let residuals = |parameters: &[f64]| self.residuals(parameters);
        let problem =
            LeastSquares { residuals: &residuals, bounds: self.bounds, sizes: self.sizes, difference };
        let mut minimum = |start: u32, from: &[f64]| {
            problem.minimum(from, &mut |steps, sum_of_squares, parameters| {
                watch(FitProgress { start, steps, sum_of_squares, parameters });
                !self.stop.load(Ordering::Relaxed)
            })
        };
        let own: Vec<f64> = self.keys.iter().map(|key| key.value).collect();
        let best = minimum(0, &own)?;
        let mut found = SearchResult { runs: best.evaluations, starts: vec![reached(own, &best)], best };
        let mut random = Pcg64::new(options.seed.into(), 1);
        for start in 1..options.starts {
            let mut from = self.drawn(&mut random);
            let mut next = minimum(start, &from);
            for _ in 1..DRAWS {
                if next.is_ok() || self.stop.load(Ordering::Relaxed) {
                    break;
                }
                from = self.drawn(&mut random);
                next = minimum(start, &from);
            }
            match next {
                Err(Refusal::Stopped) => return Err(FitError::Stopped),
                Err(_) => found.starts.push(FitStart { from, to: None, sum_of_squares: None }),
                Ok(next) => {
                    found.runs += next.evaluations;
                    found.starts.push(reached(from, &next));
                    if next.sum_of_squares() < found.best.sum_of_squares() {
                        found.best = next;
                    }
                }
            }
        }
        match self.stop.load(Ordering::Relaxed) {
            true => Err(FitError::Stopped),
            false => Ok(found),
        }
    }

    /// Random parameters: between their bounds; without bounds within a factor of `sqrt(10)` of the
    /// scene's value.
    fn drawn(&self, random: &mut Pcg64) -> Vec<f64> {
        let mut part = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let one = |(key, [low, high]): (&FittedKey, &[f64; 2])| {
            let part = part();
            if low.is_finite() && high.is_finite() {
                // Logarithmic over several decades.
                return match *low > 0.0 && *high > 10.0 * low {
                    true => low * (high / low).powf(part),
                    false => low + part * (high - low),
                };
            }
            (key.value * 10.0_f64.powf(part - 0.5)).clamp(*low, *high)
        };
        self.keys.iter().zip(self.bounds).map(one).collect()
    }

    /// Result of the fit, with errors of the parameters.
    fn describe(&self, found: SearchResult, difference: f64) -> Result<SceneFit, FitError> {
        let SearchResult { best, starts, runs } = found;
        let at_bound: Vec<bool> = (best.parameters.iter().zip(self.bounds))
            .map(|(value, [low, high])| value <= low || value >= high)
            .collect();
        let free: Vec<usize> = (0..self.keys.len()).filter(|&j| !at_bound[j]).collect();
        let degrees_of_freedom = self.data.observations.len() - free.len();
        let theory = LinearTheory::of(&best, &free, degrees_of_freedom, difference);
        let t = student::two_sided(CONFIDENCE, degrees_of_freedom);
        let parameter = |j: usize| {
            let (key, value) = (&self.keys[j], best.parameters[j]);
            let standard_deviation = theory.deviations[j];
            let interval = standard_deviation.map(|deviation| [value - t * deviation, value + t * deviation]);
            let (path, start, at_bound) = (key.path.to_string(), key.value, at_bound[j]);
            FittedParameter { path, value, start, standard_deviation, interval, at_bound }
        };
        let parameters: Vec<FittedParameter> = (0..self.keys.len()).map(parameter).collect();
        let scene = self.scene(&best.parameters)?;
        let warnings = self.warnings(&best, &parameters, &theory, &starts);
        Ok(SceneFit {
            correlation: theory.correlation,
            sum_of_squares: best.sum_of_squares(),
            measured: self.data.observations.len(),
            degrees_of_freedom,
            steps: best.steps,
            runs: runs + 1,
            starts,
            warnings,
            toml: self.toml(&scene),
            series: self.series(&best)?,
            axis: self.data.axis(),
            parameters,
            scene,
        })
    }

    /// Measured columns with the predictions of the best parameters.
    fn series(&self, best: &Minimum) -> Result<Vec<MeasuredSeries>, FitError> {
        let predicted = self.predict(&best.parameters)?;
        let mut series = self.data.series.clone();
        for (one, value) in self.data.observations.iter().zip(predicted) {
            let MeasuredSeries { at, measured, fitted, .. } = &mut series[one.series];
            at.push(one.at);
            measured.push(one.value);
            fitted.push(value);
        }
        for series in &mut series {
            let squares = series.measured.iter().zip(&series.fitted).map(|(a, b)| (a - b) * (a - b));
            series.rms = (squares.sum::<f64>() / series.at.len().max(1) as f64).sqrt();
        }
        Ok(series)
    }

    fn warnings(
        &self,
        best: &Minimum,
        parameters: &[FittedParameter],
        theory: &LinearTheory,
        starts: &[FitStart],
    ) -> Vec<String> {
        let mut warnings = vec![];
        if !best.converged {
            warnings.push(format!("it went on getting better after {} steps; start nearer", best.steps));
        }
        for (j, parameter) in parameters.iter().enumerate() {
            let path = &parameter.path;
            if best.jacobian.column(j).norm() == 0.0 {
                warnings.push(format!("`{path}` changes nothing that was measured"));
            } else if parameter.at_bound {
                warnings.push(format!(
                    "`{path}` is at a bound: the measurements ask for more or less than it allows"
                ));
            }
        }
        if let Some(alike) = &theory.alike {
            let paths: Vec<String> = alike.iter().map(|&j| format!("`{}`", parameters[j].path)).collect();
            warnings.push(format!(
                "{} cannot be told apart by these measurements: together they can change without any \
                 difference; fix all but one, or measure something else",
                paths.join(", ")
            ));
        }
        for i in 0..parameters.len() {
            for j in 0..i {
                let correlation = theory.correlation[i][j].filter(|r| r.abs() > CORRELATED);
                if let (Some(r), None) = (correlation, &theory.alike) {
                    warnings.push(format!(
                        "`{}` and `{}` can hardly be told apart: the correlation of their errors is {r:.4}",
                        parameters[j].path, parameters[i].path
                    ));
                }
            }
        }
        let least = best.sum_of_squares();
        let same = |start: &&FitStart| {
            start.sum_of_squares.is_some_and(|sum| sum <= least * (1.0 + SAME_MINIMUM) + f64::MIN_POSITIVE)
        };
        let reached = starts.iter().filter(same).count();
        // The sums of squares of perfect fits are rounding errors, and differ.
        let is_perfect = theory.is_perfect;
        if starts.len() > 1 && reached < starts.len() && !is_perfect {
            warnings.push(format!(
                "{reached} of {} starts reached the best fit: there are other minima",
                starts.len()
            ));
        }
        if !self.data.left_out.is_empty() {
            let columns = self.data.left_out.join(", ");
            warnings.push(format!("columns not used, since the positions imply them: {columns}"));
        }
        warnings
    }

    /// Keys with their new values, as TOML.
    fn toml(&self, scene: &Source) -> String {
        let Ok(document) = scene.text().parse::<toml::Table>() else { return String::new() };
        let document = toml::Value::Table(document);
        let (mut lines, mut said, mut heading): (Vec<String>, Vec<String>, String) = Default::default();
        for key in self.keys {
            let segments = key.path.segments();
            // The whole value of a key, which replaces the scene's.
            let depth = if key.body.is_some() { 3 } else { 2 }.min(segments.len());
            let path: pliant_scene::KeyPath = segments[..depth].iter().cloned().collect();
            let value = segments[..depth].iter().try_fold(&document, |value, segment| match segment {
                KeySegment::Key(key) => value.get(key),
                KeySegment::Index(index) => value.get(*index),
            });
            let (Some(value), false) = (value, said.contains(&path.to_string())) else { continue };
            let above = match key.body {
                Some(body) => format!("[[body]] # number {body}"),
                None => segments.first().map(|first| format!("[{}]", name(first))).unwrap_or_default(),
            };
            if above != heading {
                lines.push(above.clone());
                heading = above;
            }
            let last = segments[..depth].last().map(name).unwrap_or_default();
            lines.push(format!("{last} = {}", inline(value)));
            said.push(path.to_string());
        }
        lines.join("\n") + "\n"
    }
}

/// Formats a value on one line.
fn inline(value: &toml::Value) -> String {
    match value {
        toml::Value::Table(table) => {
            let entries: Vec<String> =
                table.iter().map(|(key, value)| format!("{key} = {}", inline(value))).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        toml::Value::Array(list) => {
            format!("[{}]", list.iter().map(inline).collect::<Vec<_>>().join(", "))
        }
        value => value.to_string(),
    }
}

fn name(segment: &KeySegment) -> String {
    match segment {
        KeySegment::Key(key) => key.clone(),
        KeySegment::Index(index) => index.to_string(),
    }
}

fn reached(from: Vec<f64>, minimum: &Minimum) -> FitStart {
    let sum_of_squares = Some(minimum.sum_of_squares());
    FitStart { from, to: Some(minimum.parameters.clone()), sum_of_squares }
}

/// Errors of the parameters by the linear theory: covariance `s^2 (J^T J)^-1`, `s^2 = |r|^2 / (N - n)`.
struct LinearTheory {
    deviations: Vec<Option<f64>>,
    correlation: Vec<Vec<Option<f64>>>,
    /// Parameters that the measurements cannot distinguish.
    alike: Option<Vec<usize>>,
    /// True if the residuals are rounding errors.
    is_perfect: bool,
}

impl LinearTheory {
    fn of(best: &Minimum, free: &[usize], degrees_of_freedom: usize, difference: f64) -> LinearTheory {
        let count = best.parameters.len();
        let mut theory = LinearTheory {
            deviations: vec![None; count],
            correlation: vec![vec![None; count]; count],
            alike: None,
            is_perfect: best.residuals.norm() <= 1e-10 * best.jacobian.norm(),
        };
        let moving: Vec<usize> =
            free.iter().copied().filter(|&j| best.jacobian.column(j).norm() > 0.0).collect();
        if moving.is_empty() {
            return theory;
        }
        // Columns are normalised, because parameters have different units.
        let lengths: Vec<f64> = moving.iter().map(|&j| best.jacobian.column(j).norm()).collect();
        let scaled = DMatrix::from_fn(best.residuals.len(), moving.len(), |row, column| {
            best.jacobian[(row, moving[column])] / lengths[column]
        });
        let decomposed = scaled.svd(false, true);
        let Some(right) = decomposed.v_t else { return theory };
        let values = &decomposed.singular_values;
        // Singular values below the error of the differences carry no information.
        let floor = (10.0 * difference * difference).max(1e-8) * values.max();
        if values.min() <= floor {
            let direction = right.row(values.imin());
            let takes_part = |i: &usize| direction[*i].abs() > 0.1;
            theory.alike = Some((0..moving.len()).filter(takes_part).map(|i| moving[i]).collect());
            return theory;
        }
        let variance = best.residuals.norm_squared() / degrees_of_freedom as f64;
        let inverse = DMatrix::from_fn(moving.len(), moving.len(), |i, j| {
            (0..values.len()).map(|k| right[(k, i)] * right[(k, j)] / (values[k] * values[k])).sum::<f64>()
        });
        for (i, &p) in moving.iter().enumerate() {
            theory.deviations[p] = Some((variance * inverse[(i, i)]).sqrt() / lengths[i]);
            for (j, &q) in moving.iter().enumerate() {
                let correlation = inverse[(i, j)] / (inverse[(i, i)] * inverse[(j, j)]).sqrt();
                theory.correlation[p][q] = Some(correlation.clamp(-1.0, 1.0));
            }
        }
        theory
    }
}
