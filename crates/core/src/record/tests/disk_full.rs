//! A full disk costs the frame that did not fit, and no other.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::time::Duration;

use super::{ALL, Moment, options, remains, topology};
use crate::record::read::{Trajectory, recover};
use crate::record::sink::Sink;
use crate::record::{McapRecorder, Options, RecordError};

/// A file on a disk with room for so many bytes.
struct SmallDisk {
    file: File,
    room: u64,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let fits = self.room.min(bytes.len() as u64);
        if fits == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.room -= fits;
        self.file.write(&bytes[..fits as usize])
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for SmallDisk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

impl Sink for BufWriter<SmallDisk> {
    fn sync(&mut self) -> io::Result<()> {
        self.flush()
    }
}

/// Records until the disk is full, and finds all frames that came before the error.
fn fill(room: u64, vertex_count: u32, patience: Duration) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(format!("{room}.mcap"));
    let file = File::create(path.with_extension("mcap.part")).unwrap();
    let sink = Box::new(BufWriter::new(SmallDisk { file, room }));
    let options = Options { patience, ..options(&ALL) };
    let mut recorder = McapRecorder::with_sink(&path, &options, &topology(vertex_count), sink).unwrap();
    let mut frame = 0;
    let error = loop {
        match recorder.record(&Moment::new(frame, vertex_count).frame()) {
            Ok(()) => frame += 1,
            Err(error) => break error,
        }
        assert!(frame < 1000, "the disk is never full");
    };
    let text = error.to_string();
    assert!(matches!(error, RecordError::Write { frame: Some(at), .. } if at == frame), "{text}");
    assert!(text.contains(&format!("{room}.mcap.part at frame {frame}: ")), "{text}");
    assert!(text.contains("pliant recover"), "{text}");

    // Not even if there is room again: the file has a hole.
    let again = recorder.record(&Moment::new(frame, vertex_count).frame());
    assert!(matches!(again, Err(RecordError::Incomplete { frame: at, .. }) if at == frame));
    assert!(matches!(recorder.finish(), Err(RecordError::Incomplete { frame: at, .. }) if at == frame));
    assert!(!path.exists());

    let part = remains(&path, "after");
    let out = part.with_extension("");
    assert_eq!(recover(&part, &out, false).unwrap().frames, frame, "room for {room} bytes");
    let mut trajectory = Trajectory::open(&out).unwrap();
    for index in 0..frame {
        assert_eq!(trajectory.positions(index as usize).unwrap(), Moment::new(index, vertex_count).x);
    }
}

#[test]
fn frames_before_the_disk_was_full_are_recovered() {
    // 1,000 vertices take about 45 kB per frame on the disk.
    for room in [100_000, 1_000_000, 5_000_000, 6_000_000] {
        fill(room, 1000, Duration::ZERO);
    }
}

#[test]
fn a_thread_that_finds_the_disk_full_loses_nothing() {
    // 6,000 vertices take 144 kB at the beginning, and 270 kB per frame.
    for room in [1_000_000, 6_000_000] {
        for (vertex_count, patience) in [(1000, Duration::MAX), (6000, Duration::MAX), (6000, Duration::ZERO)]
        {
            fill(room, vertex_count, patience);
        }
    }
}

#[test]
fn a_frame_as_large_as_a_chunk_is_not_lost_where_it_does_not_fit() {
    // 2.4 MB at the beginning.
    fill(3_000_000, 100_000, Duration::ZERO);
    fill(12_000_000, 100_000, Duration::ZERO);
}

#[test]
fn a_disk_that_the_last_frames_fill_is_told_at_the_end() {
    for patience in [Duration::ZERO, Duration::MAX] {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        let file = File::create(path.with_extension("mcap.part")).unwrap();
        let sink = Box::new(BufWriter::new(SmallDisk { file, room: 100_000 }));
        let options = Options { patience, ..options(&ALL) };
        let mut recorder = McapRecorder::with_sink(&path, &options, &topology(1000), sink).unwrap();
        for index in 0..3 {
            recorder.record(&Moment::new(index, 1000).frame()).unwrap();
        }
        let error = recorder.finish().unwrap_err();
        assert!(matches!(error, RecordError::Write { .. }), "{error}");
        assert!(!path.exists());
        let part = remains(&path, "after");
        assert_eq!(recover(&part, &part.with_extension(""), false).unwrap().frames, 3, "{error}");
    }
}
