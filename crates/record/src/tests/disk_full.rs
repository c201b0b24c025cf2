//! A full disk loses the frame that did not fit, and no other.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use super::{ALL, Moment, options, remains, topology};
use crate::McapRecorder;
use crate::Options;
use crate::RecordError;
use crate::paths::{part_of, tail_of};
use crate::read::{Trajectory, recover};
use crate::sink::{Sink, Tail};

/// File on a disk of limited size, shared with other files.
#[derive(Debug)]
struct SmallDisk {
    file: File,
    room: Arc<AtomicU64>,
    used: u64,
}

impl SmallDisk {
    fn new(file: File, room: u64) -> Self {
        SmallDisk { file, room: Arc::new(room.into()), used: 0 }
    }
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let fits = self.room.load(Ordering::Relaxed).min(bytes.len() as u64);
        if fits == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.room.fetch_sub(fits, Ordering::Relaxed);
        self.used += fits;
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

impl Tail for SmallDisk {
    fn empty(&mut self) -> io::Result<()> {
        self.room.fetch_add(std::mem::take(&mut self.used), Ordering::Relaxed);
        Tail::empty(&mut self.file)
    }

    fn sync(&mut self) -> io::Result<()> {
        Tail::sync(&mut self.file)
    }
}

/// Records until the disk is full, and checks that all frames before the error are found.
fn fill(room: u64, vertex_count: u32, max_loss: Duration) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(format!("{room}.mcap"));
    let disk = SmallDisk::new(File::create(part_of(&path)).unwrap(), room);
    let tail = File::create(tail_of(&part_of(&path))).unwrap();
    let (sink, options) = (Box::new(BufWriter::new(disk)), Options { max_loss, ..options(&ALL) });
    let topology = topology(vertex_count);
    let mut recorder = McapRecorder::with_sinks(&path, &options, &topology, sink, Box::new(tail)).unwrap();
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

    // Refused even if there is room again: the file has a hole.
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
    // 6,000 vertices take 144 kB at the beginning and 270 kB per frame.
    for room in [1_000_000, 6_000_000] {
        for (vertex_count, max_loss) in [(1000, Duration::MAX), (6000, Duration::MAX), (6000, Duration::ZERO)]
        {
            fill(room, vertex_count, max_loss);
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
    for max_loss in [Duration::ZERO, Duration::MAX] {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        let sink = BufWriter::new(SmallDisk::new(File::create(part_of(&path)).unwrap(), 100_000));
        let tail = File::create(tail_of(&part_of(&path))).unwrap();
        let (topology, options) = (topology(1000), Options { max_loss, ..options(&ALL) });
        let (sink, tail) = (Box::new(sink), Box::new(tail));
        let mut recorder = McapRecorder::with_sinks(&path, &options, &topology, sink, tail).unwrap();
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

/// The tail is on the same disk: the frames promised by a message are there, and the message promises all
/// of them.
#[test]
fn no_more_frames_are_promised_than_a_full_disk_holds() {
    for room in [100_000, 200_000, 500_000, 1_000_000, 4_000_000, 6_000_000, 9_000_000] {
        for (vertex_count, max_loss) in [(1000, Duration::ZERO), (1000, Duration::MAX), (6000, Duration::MAX)]
        {
            let directory = tempfile::tempdir().unwrap();
            let path = directory.path().join("a.mcap");
            let disk = SmallDisk::new(File::create(part_of(&path)).unwrap(), room);
            let (file, left) = (File::create(tail_of(&part_of(&path))).unwrap(), disk.room.clone());
            let (sink, tail) = (BufWriter::new(disk), SmallDisk { file, room: left, used: 0 });
            let (topology, options) = (topology(vertex_count), Options { max_loss, ..options(&ALL) });
            let (sink, tail) = (Box::new(sink), Box::new(tail));
            let Ok(mut recorder) = McapRecorder::with_sinks(&path, &options, &topology, sink, tail) else {
                continue;
            };
            let recorded = (0..40).try_for_each(|i| recorder.record(&Moment::new(i, vertex_count).frame()));
            let (lost, case) = match recorded {
                Err(RecordError::Write { frame: Some(lost), .. }) => (lost, "while recording"),
                Err(error) => panic!("{room}: {error}"),
                Ok(()) => match recorder.finish() {
                    Ok(_) => continue,
                    Err(RecordError::Write { frame, .. }) => (frame.unwrap_or(40), "at the end"),
                    Err(error) => panic!("{room}: {error}"),
                },
            };
            let part = remains(&path, "after");
            let kept = recover(&part, &part.with_extension(""), false).unwrap().frames;
            // The frame of the failed call may be safe, too.
            let promised = (lost..=lost + 1).contains(&kept);
            assert!(
                promised,
                "{kept} of {lost}: {room} bytes, {vertex_count} vertices, {max_loss:?}, {case}"
            );
        }
    }
}
