//! Evaluation of timings: from times to a figure.

use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, Metric, Workload};

/// Time budget of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Total time of all rounds of a case.
    pub total: Duration,
    /// Time of one timing of one part: as many repetitions as fit, at least one.
    pub sample: Duration,
    /// Number of rounds that run even beyond the budget.
    pub fewest_rounds: usize,
}

impl Budget {
    /// Budget for published figures.
    pub const FULL: Budget =
        Budget { total: Duration::from_millis(2500), sample: Duration::from_millis(25), fewest_rounds: 7 };
    /// Budget for a smoke test.
    #[cfg(test)]
    pub(super) const ONCE: Budget =
        Budget { total: Duration::ZERO, sample: Duration::ZERO, fewest_rounds: 1 };
    /// Budget for a quick look.
    pub const QUICK: Budget =
        Budget { total: Duration::from_millis(150), sample: Duration::from_millis(5), fewest_rounds: 3 };
}

/// Measurement of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Median over the rounds.
    pub median: f64,
    /// Value of the best round.
    pub best: f64,
    /// Number of rounds; each times every part.
    pub rounds: usize,
    /// Median over the rounds for each part: the seconds of a repetition, or the quantity that the
    /// workload measures instead.
    pub seconds: Vec<f64>,
    /// Memory traffic of a repetition of the first part, about [bytes]; 0 if not counted.
    pub bytes: usize,
    /// Share of contact in the time of the first part, if known.
    pub share_of_contact: Option<f64>,
}

impl Measurement {
    fn new(figure: Metric, rounds: &[Vec<f64>], first: Option<&dyn Workload>) -> Measurement {
        let values: Vec<f64> = rounds.iter().map(|seconds| figure.value(seconds)).collect();
        let better = if figure.more_is_better() { f64::max } else { f64::min };
        let parts = rounds.first().map_or(0, Vec::len);
        Measurement {
            median: median(values.iter().copied()),
            best: values.iter().copied().fold(f64::NAN, better),
            rounds: rounds.len(),
            seconds: (0..parts).map(|part| median(rounds.iter().map(|seconds| seconds[part]))).collect(),
            bytes: first.map_or(0, Workload::bytes),
            share_of_contact: first.and_then(Workload::share_of_contact),
        }
    }
}

/// Median: the middle value, or the mean of the middle two; NaN for no values.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => f64::NAN,
        _ => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

/// A workload with its thread pool.
pub struct TimedPart {
    pool: ThreadPool,
    workload: Box<dyn Workload>,
}

impl TimedPart {
    /// Starts the threads and builds the workload in them.
    ///
    /// # Errors
    /// The threads cannot be started or the workload cannot be built.
    pub fn new(part: &BenchmarkPart) -> Result<TimedPart, BenchmarkError> {
        let threads = part.threads;
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|source| BenchmarkError::Threads { threads, source })?;
        let workload = pool.install(|| (part.build)())?;
        Ok(TimedPart { pool, workload })
    }

    /// Times `repetitions`, each from the same state.
    ///
    /// # Errors
    /// The workload fails.
    pub fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let workload = &mut self.workload;
        self.pool.install(|| workload.time(repetitions))
    }

    /// Seconds of a repetition, or the quantity that the workload measures instead.
    fn seconds(&mut self, repetitions: u64) -> Result<f64, BenchmarkError> {
        let seconds = self.time(repetitions)?.as_secs_f64() / repetitions as f64;
        Ok(self.workload.quantity(seconds))
    }

    /// Warms up, and determines how many repetitions fill `sample`.
    fn repetitions(&mut self, sample: Duration) -> Result<u64, BenchmarkError> {
        let mut repetitions = 1;
        loop {
            let took = self.time(repetitions)?;
            if took >= sample {
                return Ok(repetitions);
            }
            // At most a tenfold increase: the first times are unreliable.
            let wanted = sample.as_secs_f64() / took.as_secs_f64().max(1e-9);
            repetitions = (repetitions as f64 * (1.1 * wanted).clamp(1.5, 10.0)).ceil() as u64;
        }
    }
}

/// Measures one case: its parts in turn, round after round, until the budget is used up. Returns `None`
/// if `stop` ended it before the first round was complete.
///
/// # Errors
/// A workload cannot be built or run.
pub fn measure(
    case: &BenchmarkCase,
    budget: &Budget,
    stop: &dyn Fn() -> bool,
) -> Result<Option<Measurement>, BenchmarkError> {
    let mut parts = case.parts.iter().map(TimedPart::new).collect::<Result<Vec<_>, _>>()?;
    let mut repetitions = vec![];
    for part in &mut parts {
        if stop() {
            return Ok(None);
        }
        repetitions.push(part.repetitions(budget.sample)?);
    }
    let mut rounds: Vec<Vec<f64>> = vec![];
    let started = Instant::now();
    while (rounds.len() < budget.fewest_rounds || started.elapsed() < budget.total) && !stop() {
        let timed = parts.iter_mut().zip(&repetitions).map(|(part, &n)| part.seconds(n));
        rounds.push(timed.collect::<Result<_, _>>()?);
    }
    if rounds.is_empty() {
        return Ok(None);
    }
    let first = parts.first().map(|part| &*part.workload);
    Ok(Some(Measurement::new(case.figure, &rounds, first)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_and_the_best_are_those_of_the_figure() {
        let rounds = [vec![2.0, 1.0], vec![9.0, 3.0], vec![4.0, 4.0], vec![5.0, 2.0]];
        // The rounds give 2, 3, 1 and 2.5.
        let speedup = Measurement::new(Metric::Speedup, &rounds, None);
        assert_eq!((speedup.median, speedup.best, speedup.rounds), (2.25, 3.0, 4));
        assert_eq!(speedup.seconds, [4.5, 2.5]);
        assert_eq!(Measurement::new(Metric::Slowdown, &rounds, None).best, 1.0);
        // The rounds give 50 %, 200/3 %, 0 and 60 %.
        let share = Measurement::new(Metric::Share, &rounds, None);
        assert!((share.median - 55.0).abs() < 1e-12 && share.best == 0.0, "{share:?}");
        let rate = Metric::Rate { per_repetition: 8.0, scale: 0.5, unit: "" };
        // The rounds give 2, 4/9, 1 and 0.8.
        assert_eq!(Measurement::new(rate, &rounds, None).median, 0.9);
        assert_eq!(Measurement::new(Metric::StepTime, &rounds, None).median, 4.5e6);
    }

    struct Sleepless {
        calls: Vec<u64>,
    }
    impl Workload for Sleepless {
        fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
            self.calls.push(repetitions);
            Ok(Duration::from_micros(10) * repetitions as u32)
        }
    }

    #[test]
    fn a_sample_has_as_many_repetitions_as_fill_it() {
        let build = || Ok(Sleepless { calls: vec![] });
        let mut part = TimedPart::new(&BenchmarkPart::new("", 1, build)).unwrap();
        let n = part.repetitions(Duration::from_millis(5)).unwrap();
        assert!((500..=600).contains(&n), "{n}");
        assert!((part.seconds(n).unwrap() - 1e-5).abs() < 1e-20);
    }

    #[test]
    fn who_is_told_to_stop_stops() {
        let case = BenchmarkCase {
            size: 1,
            items: "",
            case: String::new(),
            figure: Metric::StepTime,
            parts: vec![BenchmarkPart::new("", 1, || Ok(Sleepless { calls: vec![] }))],
            reference: None,
        };
        assert_eq!(measure(&case, &Budget::QUICK, &|| true).unwrap(), None);
        let some = measure(&case, &Budget { total: Duration::ZERO, ..Budget::QUICK }, &|| false).unwrap();
        let some = some.unwrap();
        assert!((some.median - 10.0).abs() < 1e-12 && some.rounds == 3, "{some:?}");
    }
}
