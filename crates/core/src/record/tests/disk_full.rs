//! A full disk costs the frame that did not fit, and no other.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};

use super::{ALL, Moment, options, remains, topology};
use crate::record::read::{Trajectory, recover};
use crate::record::sink::Sink;
use crate::record::{McapRecorder, RecordError};

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

#[test]
fn frames_before_the_disk_was_full_are_recovered() {
    let directory = tempfile::tempdir().unwrap();
    // 1,000 vertices take about 45 kB per frame on the disk.
    for room in [100_000, 1_000_000, 5_000_000, 6_000_000] {
        let path = directory.path().join(format!("{room}.mcap"));
        let file = File::create(path.with_extension("mcap.part")).unwrap();
        let sink = Box::new(BufWriter::new(SmallDisk { file, room }));
        let mut recorder = McapRecorder::with_sink(&path, &options(&ALL), &topology(1000), sink).unwrap();
        let mut frame = 0;
        let error = loop {
            match recorder.record(&Moment::new(frame, 1000).frame()) {
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
        let again = recorder.record(&Moment::new(frame, 1000).frame());
        assert!(matches!(again, Err(RecordError::Incomplete { frame: at, .. }) if at == frame));
        assert!(matches!(recorder.finish(), Err(RecordError::Incomplete { frame: at, .. }) if at == frame));
        assert!(!path.exists());

        let part = remains(&path, "after");
        let out = part.with_extension("");
        assert_eq!(recover(&part, &out, false).unwrap().frames, frame, "room for {room} bytes");
        let mut trajectory = Trajectory::open(&out).unwrap();
        for index in 0..frame {
            assert_eq!(trajectory.positions(index as usize).unwrap(), Moment::new(index, 1000).x);
        }
        fs::remove_file(out).unwrap();
    }
}
