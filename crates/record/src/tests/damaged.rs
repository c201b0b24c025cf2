//! Recordings whose metadata contradict their data.

use std::fs;
use std::path::Path;

use super::{ALL, Moment, options, record, topology};
use crate::McapRecorder;
use crate::Options;
use crate::RecordError;
use crate::export::Export;
use crate::read::{FileState, Trajectory, info, recover};

/// Two frames of nine vertices with contradicting metadata.
fn claiming(path: &Path, key: &str, value: &str, rest: bool) {
    let mut topology = topology(9);
    if !rest {
        topology.rest_positions.clear();
    }
    let metadata = [(key.to_owned(), value.to_owned())].into();
    let options = Options { metadata, overwrite: true, ..options(&ALL) };
    let mut recorder = McapRecorder::create(path, &options, &topology).unwrap();
    for index in 0..2 {
        recorder.record(&Moment::new(index, 9).frame()).unwrap();
    }
    recorder.finish().unwrap();
}

#[test]
fn counts_in_metadata_are_compared_with_what_is_there() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    let counts = [0, 1, 8, 10, u64::from(u32::MAX), 1 << 32, (1 << 61) + 1, (1 << 63) - 1, u64::MAX];
    for count in counts.map(|count| count.to_string()) {
        claiming(&path, "vertex_count", &count, true);
        assert!(info(&path).is_ok(), "what is there can be looked at");
        for error in [Trajectory::open(&path).err(), Export::open(&path).err()] {
            let error = error.unwrap();
            assert!(matches!(error, RecordError::Unexpected { .. }), "{count}: {error}");
        }
    }
    // Without reference positions, the contradiction shows once a frame is read.
    for count in counts.into_iter().filter(|count| *count > 9).map(|count| count.to_string()) {
        claiming(&path, "vertex_count", &count, false);
        let frame = Trajectory::open(&path).and_then(|mut trajectory| trajectory.positions(0));
        let error = frame.unwrap_err();
        assert!(
            matches!(error, RecordError::Unexpected { .. } | RecordError::Damaged { .. }),
            "{count}: {error}"
        );
    }
    claiming(&path, "vertex_count", "9", true);
    assert_eq!(Trajectory::open(&path).unwrap().positions(1).unwrap(), Moment::new(1, 9).x);
}

/// Two chunks and a damaged attachment: its checksum is wrong, or its length leads into other records.
#[test]
fn recovery_takes_by_the_index_what_is_whole() {
    let directory = tempfile::tempdir().unwrap();
    let (path, out) = (directory.path().join("a.mcap"), directory.path().join("b.mcap"));
    record(&path, &ALL, 1000, 100).finish().unwrap();
    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let rest = summary.attachment_indexes.iter().find(|index| index.name == "rest.f64").unwrap();
    let (start, length) = (rest.offset as usize, rest.length as usize);
    for (at, lost) in [(start + 3, 0), (start + 8, 1), (start + length - 1, 1), (start + length - 100, 1)] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        fs::write(&path, &damaged).unwrap();
        let recovered = recover(&path, &out, true).unwrap();
        assert_eq!((recovered.frames, recovered.skipped.len()), (100, lost), "byte {at}: {recovered:?}");
        assert!(recovered.skipped.iter().all(|one| one.contains("`rest.f64`")), "{recovered:?}");
        let found = info(&out).unwrap();
        assert_eq!(found.state, FileState::Complete);
        assert_eq!(found.attachments.len() + lost, summary.attachment_indexes.len());
        let mut trajectory = Trajectory::open(&out).unwrap();
        assert_eq!(trajectory.positions(99).unwrap(), Moment::new(99, 1000).x);
    }
}

/// An unfinished file with a frame, whose last chunk states and holds far more than its bytes.
#[test]
fn a_chunk_that_unpacks_to_more_than_its_limit_is_not_unpacked() {
    let directory = tempfile::tempdir().unwrap();
    let (path, out) = (directory.path().join("a.mcap"), directory.path().join("b.mcap"));
    record(&path, &ALL, 9, 2).finish().unwrap();
    let mut bytes = fs::read(&path).unwrap();
    let chunk = &mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes[0];
    let end = (chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length) as usize;
    bytes.truncate(end);
    let packed = zstd::bulk::compress(&vec![0; 1 << 20], 1).unwrap();
    // Two times, size, checksum, compression.
    let mut body = [0; 16].to_vec();
    body.extend(u64::from(u32::MAX).to_le_bytes());
    body.extend([&[0; 4][..], &4_u32.to_le_bytes(), b"zstd", &(packed.len() as u64).to_le_bytes()].concat());
    body.extend(packed);
    bytes.push(mcap::records::op::CHUNK);
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
    fs::write(&path, &bytes).unwrap();
    let found = info(&path).unwrap();
    assert_eq!((found.state, found.frames), (FileState::Unfinished, 2));
    let recovered = recover(&path, &out, true).unwrap();
    assert_eq!(recovered.frames, 2);
    assert!(matches!(&recovered.skipped[..], [one] if one.contains("limit")), "{recovered:?}");
}

#[test]
fn channels_are_read_together_as_they_are_one_by_one() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    record(&path, &ALL, 1000, 100).finish().unwrap();
    let mut trajectory = Trajectory::open(&path).unwrap();
    let energy = trajectory.energy().unwrap();
    assert!(energy.iter().all(|column| column.values.len() == 100));
    assert_eq!(
        trajectory.tables(&["/energy", "/none", "/energy"]).unwrap(),
        [energy.clone(), vec![], energy]
    );
    // Frames can be read in any order.
    for frame in [99, 0, 86, 87, 3] {
        assert_eq!(trajectory.positions(frame).unwrap(), Moment::new(frame as u64, 1000).x);
    }
}
