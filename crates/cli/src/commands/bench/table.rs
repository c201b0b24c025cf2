//! The table for people.

use pliant_lab::benchmark::{BenchmarkCase, REFERENCE_MACHINE};

use super::MeasuredCase;
use super::machine::Machine;
use crate::text::{count, counted, table, wrap};

pub(super) fn render(machine: &Machine, measured: &[MeasuredCase], width: usize) -> String {
    let mut out = format!(
        "{}, {}, kernels on {}, pliant {}\n",
        machine.processor,
        counted(machine.cores as u64, "core", "cores"),
        machine.instruction_set,
        machine.version,
    );
    for (threads, bandwidth) in &machine.stream_triad {
        let threads = counted(*threads as u64, "thread", "threads");
        out += &format!("memory delivers {:.1} GB/s to {threads} (triad)\n", 1e-9 * bandwidth);
    }
    out.push('\n');
    let header = ["", "median", "best", "unit", "threads", "reference", "of it", "memory", "contact"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    let mut last = "";
    for m in measured {
        if m.row != last {
            rows.push(vec![m.row.to_owned()]);
            last = m.row;
        }
        rows.push(line(m));
    }
    out += &table(&rows, 0);
    out.push('\n');
    out += &wrap(
        &format!(
            "Rates and times are of full steps. References are goals, or results, on {REFERENCE_MACHINE}; \
             \"of it\" is the median over the reference. \"memory\", for work larger than caches, is the \
             allocated memory over the time of a step, as a fraction of the triad's bandwidth. \
             \"contact\" is the fraction of the time spent on contact (search, forces, matrix blocks, time \
             of impact) of all threads together."
        ),
        0,
        width,
    );
    out
}

fn line(m: &MeasuredCase) -> Vec<String> {
    let reference = m.case.reference;
    vec![
        format!("  {}", work(&m.case)),
        short(m.measurement.median),
        short(m.measurement.best),
        m.case.figure.unit().to_owned(),
        m.case.threads().to_string(),
        reference.map_or_else(String::new, |r| short(r.value)),
        reference.map_or_else(String::new, |r| format!("{:.2}", m.measurement.median / r.value)),
        percent(m.share_of_stream),
        percent(m.measurement.share_of_contact),
    ]
}

/// A part in percent; nothing where it is not known.
fn percent(share: Option<f64>) -> String {
    share.map_or_else(String::new, |share| format!("{:.0}%", 100.0 * share))
}

/// `98,304 tets, mild`.
pub(super) fn work(case: &BenchmarkCase) -> String {
    let gap = if case.case.is_empty() { "" } else { ", " };
    format!("{} {}{gap}{}", count(case.size), case.items, case.case)
}

/// The same, with the threads.
pub(super) fn on_threads(case: &BenchmarkCase) -> String {
    format!("{} on {}", work(case), counted(case.threads() as u64, "thread", "threads"))
}

/// Three digits: more is noise.
fn short(x: f64) -> String {
    match x.abs() {
        size if size >= 99.95 => format!("{x:.0}"),
        size if size >= 9.995 => format!("{x:.1}"),
        size if size >= 0.9995 => format!("{x:.2}"),
        _ => format!("{x:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases = [(0.4567, "0.457"), (1.0, "1.00"), (12.345, "12.3"), (99.96, "100"), (1234.5, "1234")];
        for (x, text) in cases {
            assert_eq!(short(x), text);
        }
    }
}
