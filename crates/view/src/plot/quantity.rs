//! Selection of the columns that a chart shows.

use std::path::{Path, PathBuf};

use pliant::diagnostics::Balance;
use pliant_record::RecordError;
use pliant_record::read::{Column, Trajectory, info};

use super::chart::{Series, TimeChart};

/// Quantity of a chart over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotQuantity {
    /// Kinetic, elastic and other energies, and their sum [J].
    Energy,
    /// Work and dissipation since the start, and the error of the energy balance [J].
    Balance,
    /// Components of the linear momentum [kg m/s].
    Momentum,
    /// Components of the angular momentum about the origin [kg m^2/s].
    AngularMomentum,
    /// Smallest `det F` of any element.
    MinJ,
    /// Components of the forces of pins and walls [N].
    Reactions,
    /// Components of the positions of probes [m].
    Probes,
}

/// Error of drawing a chart.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ChartError {
    /// The recording could not be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The recording lacks the data.
    #[error("{} has no {what}; {hint}", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
        /// Name of the data.
        what: &'static str,
        /// Advice on how to record them.
        hint: &'static str,
    },
}

/// Columns of `/energy` that are energies of the bodies.
const ENERGIES: [&str; 5] = ["total", "kinetic", "elastic", "gravitational", "loads"];

/// Prefix of probe topics.
const PROBE: &str = "/probe/";

impl PlotQuantity {
    /// Builds the chart of a recording.
    ///
    /// # Errors
    /// A recording that cannot be read; [`ChartError::Missing`] if it lacks the data.
    pub fn chart(self, path: &Path) -> Result<TimeChart, ChartError> {
        let mut trajectory = Trajectory::open(path)?;
        let info = info(path)?;
        let topics: Vec<&str> = info.topics.iter().map(|topic| topic.topic.as_str()).collect();
        let series = self.series(&mut trajectory, &topics)?;
        if !series.iter().flat_map(|series| &series.points).any(|point| point[1].is_finite()) {
            let (what, hint) = self.absence();
            return Err(ChartError::Missing { path: path.to_owned(), what, hint });
        }
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(TimeChart { title: info.title.unwrap_or(stem), name: self.name().to_owned(), series })
    }

    /// Builds one chart of several recordings; each line is labelled with its file name. For energies,
    /// only the totals are shown.
    ///
    /// # Errors
    /// The errors of [`chart`](Self::chart) for the first recording that fails.
    pub fn chart_of_all(self, paths: &[PathBuf]) -> Result<TimeChart, ChartError> {
        if let [path] = paths {
            return self.chart(path);
        }
        let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let title = paths.iter().map(stem).collect::<Vec<_>>().join(", ");
        let mut all = TimeChart { title, name: self.name().to_owned(), series: vec![] };
        for path in paths {
            let TimeChart { series, .. } = self.chart(path)?;
            let name = stem(path);
            let compared =
                series.into_iter().filter(|one| self != PlotQuantity::Energy || one.name == ENERGIES[0]);
            all.series.extend(compared.map(|one| Series { name: format!("{name}: {}", one.name), ..one }));
        }
        Ok(all)
    }

    fn series(self, trajectory: &mut Trajectory, topics: &[&str]) -> Result<Vec<Series>, RecordError> {
        match self {
            PlotQuantity::Reactions if topics.contains(&"/reactions") => {
                Ok(chosen(&trajectory.reactions()?, "", |name| name.contains(".force[")))
            }
            PlotQuantity::Reactions => Ok(vec![]),
            PlotQuantity::Probes => {
                let probes = topics.iter().filter(|topic| topic.starts_with(PROBE));
                let topics: Vec<&str> = probes.copied().collect();
                let tables = trajectory.tables(&topics)?;
                let of = |name: &str| name.starts_with("position[");
                let series = topics.iter().zip(&tables).flat_map(|(topic, columns)| {
                    chosen(columns, &format!("{} ", topic.trim_start_matches(PROBE)), of)
                });
                Ok(series.collect())
            }
            _ if !topics.contains(&"/energy") => Ok(vec![]),
            PlotQuantity::Energy => {
                let columns = trajectory.energy()?;
                let one = |name: &&str| chosen(&columns, "", |column| column == *name);
                Ok(ENERGIES.iter().flat_map(one).collect())
            }
            PlotQuantity::Balance => Ok(balance(&trajectory.energy()?)),
            PlotQuantity::Momentum => {
                Ok(chosen(&trajectory.energy()?, "", |name| name.starts_with("linear_momentum[")))
            }
            PlotQuantity::AngularMomentum => {
                Ok(chosen(&trajectory.energy()?, "", |name| name.starts_with("angular_momentum[")))
            }
            PlotQuantity::MinJ => Ok(chosen(&trajectory.energy()?, "", |name| name == "min_j")),
        }
    }

    fn name(self) -> &'static str {
        match self {
            PlotQuantity::Energy => "energy [J]",
            PlotQuantity::Balance => "energy brought in since the start [J]",
            PlotQuantity::Momentum => "linear momentum [kg·m/s]",
            PlotQuantity::AngularMomentum => "angular momentum [kg·m²/s]",
            PlotQuantity::MinJ => "smallest J of all elements",
            PlotQuantity::Reactions => "force [N]",
            PlotQuantity::Probes => "position [m]",
        }
    }

    fn absence(self) -> (&'static str, &'static str) {
        match self {
            PlotQuantity::MinJ => ("numbers of elements", "bodies of springs and particles have no J"),
            PlotQuantity::Reactions => ("reactions", "record them with the channel `reactions`"),
            PlotQuantity::Probes => ("probes", "name some in the scene with [[probe]]"),
            _ => ("energies", "record them with the channel `energy`"),
        }
    }
}

/// Energy brought in by each contribution, and `total - total(0) - sum`: the error of the integrator.
fn balance(columns: &[Column]) -> Vec<Series> {
    let mut series = chosen(columns, "", |name| name.starts_with("balance."));
    for one in &mut series {
        one.name = one.name.replace("balance.", "");
        // Recordings store losses as positive numbers.
        if Balance::LOSSES.iter().any(|loss| spoken(loss) == one.name) {
            one.points.iter_mut().for_each(|point| point[1] = -point[1]);
        }
    }
    let total = chosen(columns, "", |name| name == "total");
    let error = total.first().map(|total| {
        let points = total.points.iter().enumerate().map(|(i, [time, value])| {
            let brought = series.iter().map(|one| one.points[i][1]).filter(|value| value.is_finite());
            [*time, value - total.points[0][1] - brought.sum::<f64>()]
        });
        Series { name: "error of the sum".to_owned(), points: points.collect() }
    });
    series.extend(error);
    series
}

/// Series of the columns with matching names, over the column `time`.
fn chosen(columns: &[Column], before: &str, wanted: impl Fn(&str) -> bool) -> Vec<Series> {
    let Some(times) = columns.iter().find(|column| column.name == "time") else { return vec![] };
    let found = columns.iter().filter(|column| wanted(&column.name));
    found
        .map(|column| Series {
            name: format!("{before}{}", spoken(&column.name)),
            points: times.values.iter().zip(&column.values).map(|(time, value)| [*time, *value]).collect(),
        })
        .collect()
}

/// Converts `linear_momentum[0]` to `linear momentum x`.
fn spoken(name: &str) -> String {
    let axes = [("[0]", " x"), ("[1]", " y"), ("[2]", " z")];
    axes.iter().fold(name.replace('_', " "), |name, (index, axis)| name.replace(index, axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed balance leaves no error: motion brought 5 J in, damping and friction took 2 J and 1 J
    /// out.
    #[test]
    fn losses_are_taken_off_in_the_balance() {
        let column = |name: &str, end: f64| Column { name: name.to_owned(), values: vec![0.0, end] };
        let columns = [
            column("time", 1.0),
            column("total", 2.0),
            column("balance.motion", 5.0),
            column("balance.damping", 2.0),
            column("balance.friction", 1.0),
        ];
        let ends: Vec<(String, f64)> =
            balance(&columns).into_iter().map(|one| (one.name, one.points[1][1])).collect();
        let expected = [("motion", 5.0), ("damping", -2.0), ("friction", -1.0), ("error of the sum", 0.0)];
        assert_eq!(ends, expected.map(|(name, end)| (name.to_owned(), end)));
    }
}
