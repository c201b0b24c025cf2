//! `pliant bench`: how fast this machine takes steps.

mod machine;
mod table;

use std::sync::atomic::{AtomicBool, Ordering};

use pliant_lab::benchmark::{self, BenchmarkCase, BenchmarkRow, Budget, Measurement};
use serde_json::{Value, json};

use crate::arguments::BenchArguments;
use crate::failure::{ExitStatus, Failure};
use crate::interrupt;
use crate::terminal::Terminal;

use machine::Machine;

/// One line of the table.
struct MeasuredCase {
    row: &'static str,
    case: BenchmarkCase,
    measurement: Measurement,
    /// Bytes that the work passes through, per second, over what the memory delivers to as many threads.
    share_of_stream: Option<f64>,
}

/// Below this, work may stay in caches and the bandwidth of memory says nothing.
const LARGER_THAN_CACHES: usize = 64 << 20;

pub(crate) fn execute(arguments: &BenchArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let rows = chosen(&arguments.row)?;
    let interrupted = interrupt::flag()?;
    let budget = if arguments.quick { Budget::QUICK } else { Budget::FULL };
    let threads = arguments.threads.map(|n| usize::from(n.get()));
    if cfg!(debug_assertions) {
        terminal.warn("this is a debug build, which is slower: for numbers that count, build with --release");
    }
    let mut machine = Machine::measured();
    if !arguments.quick {
        machine.bandwidth(1)?;
    }
    let mut measured = vec![];
    'rows: for row in rows {
        let mut cases = (row.cases)(threads);
        if arguments.quick {
            let smallest = cases.first().map(|case| case.size);
            cases.retain(|case| Some(case.size) == smallest);
        }
        for case in cases {
            if interrupted.load(Ordering::Relaxed) {
                break 'rows;
            }
            terminal.note(&format!("measuring {}: {}", row.name, table::on_threads(&case)));
            let Some(measurement) = measure(&case, &budget, interrupted)? else { break 'rows };
            measured.push(MeasuredCase {
                share_of_stream: share_of_stream(&mut machine, &case, &measurement)?,
                row: row.name,
                case,
                measurement,
            });
        }
    }
    terminal.report(&table::render(&machine, &measured, terminal.width()))?;
    terminal.document(&document(&machine, &measured))?;
    if interrupted.load(Ordering::Relaxed) {
        terminal.complain("interrupted: these are the rows so far");
        return Ok(ExitStatus::Interrupted);
    }
    Ok(ExitStatus::Done)
}

/// The rows of these names, in the order of the table; all without names.
fn chosen(names: &[String]) -> Result<Vec<BenchmarkRow>, Failure> {
    let mut rows = benchmark::rows();
    if let Some(unknown) = names.iter().find(|name| rows.iter().all(|row| row.name != name.as_str())) {
        let known: Vec<&str> = rows.iter().map(|row| row.name).collect();
        return Err(Failure::usage(format!(
            "there is no row `{unknown}`; the rows are {}",
            known.join(", ")
        )));
    }
    rows.retain(|row| names.is_empty() || names.iter().any(|name| name == row.name));
    Ok(rows)
}

fn measure(
    case: &BenchmarkCase,
    budget: &Budget,
    interrupted: &'static AtomicBool,
) -> Result<Option<Measurement>, Failure> {
    benchmark::measure(case, budget, &|| interrupted.load(Ordering::Relaxed)).map_err(|error| failure(&error))
}

fn failure(error: &benchmark::BenchmarkError) -> Failure {
    Failure::failed("bench", error.to_string())
}

fn share_of_stream(
    machine: &mut Machine,
    case: &BenchmarkCase,
    measurement: &Measurement,
) -> Result<Option<f64>, Failure> {
    if measurement.bytes < LARGER_THAN_CACHES {
        return Ok(None);
    }
    let bandwidth = machine.bandwidth(case.threads())?;
    Ok(Some(measurement.bytes as f64 / measurement.seconds[0] / bandwidth))
}

fn document(machine: &Machine, measured: &[MeasuredCase]) -> Value {
    let row = |m: &MeasuredCase| {
        let reference = m.case.reference.map(|r| json!({ "value": r.value, "source": r.source }));
        let parts = m.case.parts.iter().zip(&m.measurement.seconds);
        let seconds: Vec<Value> = parts
            .map(|(part, s)| json!({ "part": part.name, "threads": part.threads, "seconds": s }))
            .collect();
        json!({
            "name": m.row,
            "size": m.case.size,
            "items": m.case.items,
            "case": m.case.case,
            "threads": m.case.threads(),
            "value": m.measurement.median,
            "unit": m.case.figure.unit(),
            "best": m.measurement.best,
            "rounds": m.measurement.rounds,
            "repetitions": seconds,
            "share_of_stream": m.share_of_stream,
            "share_of_contact": m.measurement.share_of_contact,
            "reference": reference,
        })
    };
    json!({ "machine": machine, "rows": measured.iter().map(row).collect::<Vec<_>>() })
}
