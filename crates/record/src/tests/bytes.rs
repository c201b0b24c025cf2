//! The same frames, the same bytes.

use std::fs;
use std::time::Duration;

use super::{ALL, Moment, options, record, topology};
use crate::Level;
use crate::McapRecorder;
use crate::Options;

#[test]
fn the_same_frames_give_the_same_bytes_at_any_speed() {
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str, pause: u64| {
        let path = directory.path().join(name);
        let mut recorder = record(&path, &ALL, 9, 3);
        std::thread::sleep(Duration::from_millis(pause));
        recorder.log(Level::Warning, "the step is close to the limit", 0.04).unwrap();
        recorder.record(&Moment::new(3, 9).frame()).unwrap();
        recorder.finish().unwrap();
        fs::read(path).unwrap()
    };
    let fast = file("fast.mcap", 0);
    assert!(fast == file("slow.mcap", 1100), "the clock has left a trace");
}

#[test]
fn chunks_end_where_the_frames_say() {
    // 48 kB of state per frame: a chunk of 4 MiB takes 87 of them.
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    record(&path, &ALL, 1000, 200).finish().unwrap();
    let bytes = fs::read(path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.chunk_indexes.len(), 3);
    assert!(summary.chunk_indexes.iter().all(|chunk| chunk.compression == "zstd"));
    let sizes: Vec<u64> = summary.chunk_indexes.iter().map(|chunk| chunk.uncompressed_size).collect();
    assert!(sizes[..2].iter().all(|size| (4 << 20..(4 << 20) + 100_000).contains(size)), "{sizes:?}");
}

#[test]
fn a_thread_beside_the_run_leaves_the_same_bytes() {
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str, patience| {
        let path = directory.path().join(name);
        let options = Options { patience, ..options(&ALL) };
        let mut recorder = McapRecorder::create(&path, &options, &topology(200)).unwrap();
        // Three chunks; the warning is where a batch is being filled.
        for index in 0..1000 {
            recorder.record(&Moment::new(index, 200).frame()).unwrap();
            if index == 333 {
                recorder.log(Level::Warning, "the step is close to the limit", 5.5).unwrap();
            }
        }
        recorder.finish().unwrap();
        fs::read(path).unwrap()
    };
    assert!(file("beside.mcap", Duration::from_secs(3600)) == file("here.mcap", Duration::ZERO));
}
