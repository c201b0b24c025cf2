//! Quantities of interest: numbers of a run whose errors are asked for; and runs of a scene on other meshes,
//! with other schemes and steps, which give their values.

mod cells;
#[cfg(test)]
pub(crate) mod problems;
mod runs;

pub use cells::{CellMeshes, CellScale, ElementFamily, RunKey};
pub(crate) use runs::run_until;
pub use runs::{FRAMES, NoValues, QuantityRun, QuantityRuns};

use std::str::FromStr;

use pliant::observer::{Frame, Observer, ObserverError, Quantities};
use pliant::probe::Probe;
use pliant::quantity::Rounded;
use pliant_scene::assembly::Assembly;

/// Components of a stress.
const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];
/// Growth of a stress with each of two finer meshes from which on it has no limit.
const SINGULAR: f64 = 1.25;
/// Turns of a series from which on it oscillates: a period has two.
const OSCILLATES: usize = 2;

/// A number of a run: `tip.y`, `tip.y max`, `tip.y reaches -0.5`, `left.force.x mean`, `corner.von-mises`,
/// `energy.elastic`, `frequency.1`.
#[derive(Clone, Debug, PartialEq)]
pub struct QuantityOfInterest {
    of: QuantitySource,
    statistic: TimeStatistic,
}

/// Source of a quantity in each frame.
#[derive(Clone, Debug, PartialEq)]
enum QuantitySource {
    /// Displacement of a probe along an axis [m].
    Displacement { probe: String, axis: usize },
    /// Cauchy stress at a probe, recovered at vertices and interpolated: a component of xx, yy, zz, xy, yz,
    /// xz, or von Mises' [Pa].
    Stress { probe: String, component: Option<usize> },
    /// Reaction force of a pin along an axis [N]: the name, or its end after a slash.
    Force { pin: String, axis: usize },
    /// An energy [J].
    Energy(EnergyPart),
    /// A natural frequency about the start by its number from 1, the lowest first [Hz].
    Frequency(usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum EnergyPart {
    Elastic,
    Kinetic,
    Total,
}

/// Statistic that makes one number of the values over time.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TimeStatistic {
    End,
    Max,
    Min,
    Mean,
    Rms,
    /// Time of arrival at a value, in the unit of the source.
    Reaches(f64),
}

/// Error of a text that is no quantity of interest.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no quantity: it is PROBE.x, PROBE.von-mises, PROBE.stress.xx, PIN.force.x, frequency.1 or \
     energy.elastic, energy.kinetic, energy.total, and then nothing or one of end, max, min, mean, rms, or \
     reaches and a number, for example \"tip.y max\", \"tip.y reaches -0.5\" (the time when it does)"
)]
pub struct NoQuantity(String);

impl FromStr for QuantityOfInterest {
    type Err = NoQuantity;

    fn from_str(text: &str) -> Result<Self, NoQuantity> {
        let error = || NoQuantity(text.to_owned());
        let mut words = text.split_whitespace();
        let name = words.next().ok_or_else(error)?;
        let statistic = match words.next() {
            None | Some("end") => TimeStatistic::End,
            Some("max") => TimeStatistic::Max,
            Some("min") => TimeStatistic::Min,
            Some("mean") => TimeStatistic::Mean,
            Some("rms") => TimeStatistic::Rms,
            Some("reaches") => {
                let level = words.next().and_then(|number| number.parse().ok());
                TimeStatistic::Reaches(level.filter(|level: &f64| level.is_finite()).ok_or_else(error)?)
            }
            Some(_) => return Err(error()),
        };
        let (of, last) = name.rsplit_once('.').ok_or_else(error)?;
        if words.next().is_some() || of.is_empty() {
            return Err(error());
        }
        let axis = || ["x", "y", "z"].iter().position(|axis| *axis == last).ok_or_else(error);
        let of = match (of, last) {
            ("energy", "elastic") => QuantitySource::Energy(EnergyPart::Elastic),
            ("energy", "kinetic") => QuantitySource::Energy(EnergyPart::Kinetic),
            ("energy", "total") => QuantitySource::Energy(EnergyPart::Total),
            ("frequency", number) => {
                let number = number.parse().ok().filter(|number| *number > 0);
                QuantitySource::Frequency(number.ok_or_else(error)?)
            }
            (probe, "von-mises") => QuantitySource::Stress { probe: probe.to_owned(), component: None },
            _ if of.ends_with(".stress") => {
                let component = COMPONENTS.iter().position(|name| *name == last).ok_or_else(error)?;
                let probe = of.trim_end_matches(".stress").to_owned();
                QuantitySource::Stress { probe, component: Some(component) }
            }
            _ => match (of.strip_suffix(".force"), of.strip_suffix(".displacement")) {
                (Some(pin), _) => QuantitySource::Force { pin: pin.to_owned(), axis: axis()? },
                (_, Some(probe)) => QuantitySource::Displacement { probe: probe.to_owned(), axis: axis()? },
                _ => QuantitySource::Displacement { probe: of.to_owned(), axis: axis()? },
            },
        };
        Ok(QuantityOfInterest { of, statistic })
    }
}

impl std::fmt::Display for QuantityOfInterest {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let axes = ["x", "y", "z"];
        match &self.of {
            QuantitySource::Displacement { probe, axis } => write!(formatter, "{probe}.{}", axes[*axis]),
            QuantitySource::Stress { probe, component: None } => write!(formatter, "{probe}.von-mises"),
            QuantitySource::Stress { probe, component: Some(component) } => {
                write!(formatter, "{probe}.stress.{}", COMPONENTS[*component])
            }
            QuantitySource::Force { pin, axis } => write!(formatter, "{pin}.force.{}", axes[*axis]),
            QuantitySource::Frequency(number) => write!(formatter, "frequency.{number}"),
            QuantitySource::Energy(part) => {
                let name = ["elastic", "kinetic", "total"][*part as usize];
                write!(formatter, "energy.{name}")
            }
        }?;
        match self.statistic {
            TimeStatistic::End => Ok(()),
            TimeStatistic::Max => formatter.write_str(" max"),
            TimeStatistic::Min => formatter.write_str(" min"),
            TimeStatistic::Mean => formatter.write_str(" mean"),
            TimeStatistic::Rms => formatter.write_str(" rms"),
            TimeStatistic::Reaches(level) => write!(formatter, " reaches {level}"),
        }
    }
}

impl QuantityOfInterest {
    /// Displacements of every probe along every axis at the end.
    pub fn of_probes(probes: &[Probe], dimension: usize) -> Vec<Self> {
        let of_probe = |probe: &Probe| -> Vec<Self> {
            let at = |axis| QuantitySource::Displacement { probe: probe.name.clone(), axis };
            (0..dimension)
                .map(|axis| QuantityOfInterest { of: at(axis), statistic: TimeStatistic::End })
                .collect()
        };
        probes.iter().flat_map(of_probe).collect()
    }

    /// True if a scene has the probe or the pin that the quantity names, and its axis.
    pub fn is_of(&self, assembly: &Assembly) -> bool {
        let dimension = assembly.simulation.system().dimension();
        match &self.of {
            QuantitySource::Displacement { probe, axis } => {
                *axis < dimension && assembly.probes.iter().any(|own| own.name == *probe)
            }
            QuantitySource::Stress { probe, .. } => assembly.probes.iter().any(|own| own.name == *probe),
            QuantitySource::Force { pin, axis } => {
                let names = assembly.simulation.reaction_names();
                *axis < dimension && names.iter().filter(|name| is_named(name, pin)).count() == 1
            }
            QuantitySource::Energy(_) | QuantitySource::Frequency(_) => true,
        }
    }

    /// Unit of the quantity.
    pub fn unit(&self) -> &'static str {
        match self.of {
            _ if self.is_arrival() => "s",
            QuantitySource::Displacement { .. } => "m",
            QuantitySource::Stress { .. } => "Pa",
            QuantitySource::Force { .. } => "N",
            QuantitySource::Energy(_) => "J",
            QuantitySource::Frequency(_) => "Hz",
        }
    }

    /// Formal order of its error in space for elements of order `q`. In statics with exact loads: `q + 1` of
    /// displacements and of recovered stresses, `2 q` of energies and of whole reactions. In dynamics, where
    /// masses are lumped: 2. Frequencies, whose masses are consistent: `2 q`.
    pub fn order_in_space(&self, q: u32, is_static: bool) -> f64 {
        f64::from(match self.of {
            QuantitySource::Frequency(_) => 2 * q,
            _ if !is_static => 2,
            QuantitySource::Displacement { .. } | QuantitySource::Stress { .. } => q + 1,
            _ => 2 * q,
        })
    }

    /// True if the value is that of the last moment.
    pub fn is_at_the_end(&self) -> bool {
        self.statistic == TimeStatistic::End
    }

    /// True if the value is a time.
    pub(super) fn is_arrival(&self) -> bool {
        matches!(self.statistic, TimeStatistic::Reaches(_))
    }

    /// Number of the natural frequency that it is, from 1.
    pub fn frequency(&self) -> Option<usize> {
        match self.of {
            QuantitySource::Frequency(number) => Some(number),
            _ => None,
        }
    }

    /// Probe whose recovered stress it reads.
    pub(super) fn stressed_probe(&self) -> Option<&str> {
        match &self.of {
            QuantitySource::Stress { probe, .. } => Some(probe),
            _ => None,
        }
    }

    /// Reason for which values on finer and finer meshes have no limit: a stress that grows with each of
    /// two, as at a corner that points inwards.
    pub fn without_limit(&self, values: &[f64]) -> Option<String> {
        let (probe, [.., first, second, third]) = (self.stressed_probe()?, values) else { return None };
        let growths = [second / first, third / second];
        growths.iter().all(|growth| *growth > SINGULAR).then(|| {
            format!(
                "stress at `{probe}` grows by {} with half the cell size (h^-{}), as at a corner that points \
                 inwards: round it, or ask at a distance",
                Rounded::<3>(growths[1]),
                Rounded::<2>(growths[1].log2())
            )
        })
    }

    /// Reads a frame; `None` if it has no such probe or pin.
    fn read(&self, frame: &Frame<'_>, probes: &[Probe]) -> Option<f64> {
        match &self.of {
            QuantitySource::Displacement { probe, axis } => {
                let probe = probes.iter().find(|own| own.name == *probe)?;
                (*axis < frame.dimension).then(|| probe.read(frame).displacement[*axis])
            }
            QuantitySource::Stress { probe, component } => {
                let reading = probes.iter().find(|own| own.name == *probe)?.read(frame);
                match component {
                    Some(component) => reading.nodal_stress.map(|stress| stress[*component]),
                    None => reading.nodal_von_mises,
                }
            }
            QuantitySource::Force { pin, axis } => {
                let mut named = frame.reactions?.iter().filter(|reaction| is_named(&reaction.name, pin));
                let (first, second) = (named.next()?, named.next());
                (second.is_none() && *axis < frame.dimension).then_some(first.force[*axis])
            }
            // No series: the value is that of the modes.
            QuantitySource::Frequency(_) => None,
            QuantitySource::Energy(part) => {
                let diagnostics = frame.diagnostics?;
                Some(match part {
                    EnergyPart::Elastic => diagnostics.elastic,
                    EnergyPart::Kinetic => diagnostics.kinetic,
                    EnergyPart::Total => diagnostics.total,
                })
            }
        }
    }
}

/// True if `pin` is the name of a reaction, `body/pin`, or its end after the slash.
fn is_named(name: &str, pin: &str) -> bool {
    name == pin || name.rsplit_once('/').is_some_and(|(_, last)| last == pin)
}

/// Value of a quantity in a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuantityValue {
    /// The value.
    pub value: f64,
    /// Half the range over time; infinite if the quantity does not oscillate, and so has no phase.
    pub half_range: f64,
    /// Largest magnitude over time.
    pub largest: f64,
}

impl QuantityValue {
    /// Value of a quantity that does not change over time.
    fn steady(value: f64) -> QuantityValue {
        QuantityValue { value, half_range: f64::INFINITY, largest: value.abs() }
    }
}

/// Time at which a series first reaches a level [s]; `None` if it never does. Between two frames the series
/// is the cubic through four frames, whose error is of order four in their distance.
fn arrival(times: &[f64], series: &[f64], level: f64) -> Option<f64> {
    let is_between = |pair: &[f64]| (pair[0] - level) * (pair[1] - level) <= 0.0;
    let at = series.windows(2).position(is_between)?;
    let first = at.saturating_sub(1).min(series.len().saturating_sub(4));
    let nodes = first..(first + 4).min(series.len());
    let value = |t: f64| -> f64 {
        let weight = |i: usize| -> f64 {
            let others = nodes.clone().filter(|j| *j != i);
            others.map(|j| (t - times[j]) / (times[i] - times[j])).product()
        };
        nodes.clone().map(|i| series[i] * weight(i)).sum()
    };
    // Bisection between the two frames, to rounding.
    let (mut before, mut after) = (times[at], times[at + 1]);
    let is_before = |t: f64| (value(t) - level) * (series[at] - level) > 0.0;
    if series[at] == level {
        return Some(before);
    }
    loop {
        let middle = 0.5 * (before + after);
        if middle <= before || middle >= after {
            return Some(after);
        }
        *(if is_before(middle) { &mut before } else { &mut after }) = middle;
    }
}

/// Values of quantities at the frames of a run.
pub(super) struct QuantityObserver<'a> {
    quantities: &'a [QuantityOfInterest],
    probes: &'a [Probe],
    /// Times of the frames [s].
    times: Vec<f64>,
    /// Values by quantity and frame.
    series: Vec<Vec<f64>>,
}

impl<'a> QuantityObserver<'a> {
    pub(super) fn new(quantities: &'a [QuantityOfInterest], probes: &'a [Probe]) -> Self {
        QuantityObserver { quantities, probes, times: vec![], series: vec![vec![]; quantities.len()] }
    }

    /// Number of times that the series of a quantity turns back.
    fn turns(&self, quantity: usize) -> usize {
        let ways = self.series[quantity].windows(2).map(|pair| pair[1] - pair[0]);
        let signs: Vec<f64> = ways.filter(|way| *way != 0.0).map(f64::signum).collect();
        signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
    }

    /// Value of a quantity.
    pub(super) fn value(&self, quantity: usize) -> QuantityValue {
        let series = &self.series[quantity];
        let (low, high) = series.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        });
        let mean =
            |of: fn(f64) -> f64| series.iter().map(|value| of(*value)).sum::<f64>() / series.len() as f64;
        let value = match self.quantities[quantity].statistic {
            TimeStatistic::End => series.last().copied().unwrap_or(f64::NAN),
            TimeStatistic::Max => high,
            TimeStatistic::Min => low,
            TimeStatistic::Mean => mean(|value| value),
            TimeStatistic::Rms => mean(|value| value * value).sqrt(),
            TimeStatistic::Reaches(level) => {
                return QuantityValue::steady(arrival(&self.times, series, level).unwrap_or(f64::NAN));
            }
        };
        let half_range = if self.turns(quantity) < OSCILLATES { f64::INFINITY } else { 0.5 * (high - low) };
        QuantityValue { value, half_range, largest: low.abs().max(high.abs()) }
    }
}

impl Observer for QuantityObserver<'_> {
    fn quantities(&self) -> Quantities {
        let any = |of: fn(&QuantitySource) -> bool| self.quantities.iter().any(|quantity| of(&quantity.of));
        Quantities::NODAL_STRESS.only_if(any(|of| matches!(of, QuantitySource::Stress { .. })))
            | Quantities::REACTIONS.only_if(any(|of| matches!(of, QuantitySource::Force { .. })))
            | Quantities::DIAGNOSTICS.only_if(any(|of| matches!(of, QuantitySource::Energy(_))))
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.times.push(frame.time);
        for (i, quantity) in self.quantities.iter().enumerate() {
            // A pin that let go carries nothing.
            self.series[i].push(quantity.read(frame, self.probes).unwrap_or(0.0));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrival_is_exact_for_a_cubic_and_of_order_four_otherwise() {
        let times: Vec<f64> = (0..6).map(|i| 0.2 * f64::from(i)).collect();
        let series = |of: fn(f64) -> f64| times.iter().map(|t| of(*t)).collect::<Vec<_>>();
        // t^3 - 2 t at t = 0.5 and in the last interval.
        let cubic = series(|t| t * t * t - 2.0 * t);
        for t in [0.5_f64, 0.03, 0.7] {
            let found = arrival(&times, &cubic, t * t * t - 2.0 * t).unwrap();
            assert!((found - t).abs() < 1e-14, "{found} for {t}");
        }
        let wave = arrival(&times, &series(f64::sin), 0.5).unwrap();
        assert!((wave - 0.5_f64.asin()).abs() < 1e-4 && wave != 0.5_f64.asin(), "{wave}");
        assert_eq!(arrival(&times, &cubic, 0.0), Some(0.0));
        assert_eq!(arrival(&times, &cubic, 1.0), None);
    }

    #[test]
    fn a_time_of_arrival_is_read_and_printed() {
        let quantity: QuantityOfInterest = "tip.y reaches -0.5".parse().unwrap();
        assert_eq!((quantity.unit(), quantity.to_string()), ("s", "tip.y reaches -0.5".to_owned()));
        for wrong in ["tip.y reaches", "tip.y reaches far", "tip.y reaches 1 2", "tip.y reaches inf"] {
            assert!(wrong.parse::<QuantityOfInterest>().is_err(), "{wrong}");
        }
    }
}
