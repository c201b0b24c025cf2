//! The rows of `pliant bench` as criterion benchmarks: `cargo bench -p pliant-lab --bench rows -- svd`.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use pliant_lab::benchmark::{BenchmarkPart, Metric, TimedPart, rows};

fn all(criterion: &mut Criterion) {
    for row in rows() {
        let mut group = criterion.benchmark_group(row.name);
        // A step of the largest beam takes tens of milliseconds.
        group
            .sample_size(10)
            .warm_up_time(Duration::from_millis(500))
            .measurement_time(Duration::from_secs(2));
        for case in (row.cases)(None) {
            if let Metric::Rate { per_repetition, .. } = case.figure {
                group.throughput(Throughput::Elements(per_repetition as u64));
            }
            for part in &case.parts {
                let threads = if part.threads == 1 {
                    "1 thread".to_owned()
                } else {
                    format!("{} threads", part.threads)
                };
                let words = [
                    case.size.to_string(),
                    case.items.to_owned(),
                    case.case.clone(),
                    part.name.to_owned(),
                    threads,
                ];
                let words: Vec<String> = words.into_iter().filter(|word| !word.is_empty()).collect();
                bench(&mut group, &BenchmarkId::from_parameter(words.join(" ")), part);
            }
        }
    }
}

type Group<'a> = criterion::BenchmarkGroup<'a, criterion::measurement::WallTime>;

fn bench(group: &mut Group<'_>, id: &BenchmarkId, part: &BenchmarkPart) {
    // Built when it is first run: what is filtered out costs nothing.
    let mut timed = None;
    group.bench_function(id.clone(), |bencher| {
        let timed =
            timed.get_or_insert_with(|| TimedPart::new(part).expect("a workload of the table can be built"));
        bencher
            .iter_custom(|repetitions| timed.time(repetitions).expect("a workload of the table can be run"));
    });
}

criterion_group!(benches, all);
criterion_main!(benches);
