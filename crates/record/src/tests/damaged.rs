//! Numbers in a recording that its bytes do not bear out.

use std::path::Path;

use super::{ALL, Moment, options, topology};
use crate::McapRecorder;
use crate::Options;
use crate::RecordError;
use crate::export::Export;
use crate::read::{Trajectory, info};

/// Two frames of nine vertices whose metadata say something else.
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
    // Without rest positions a frame tells, once it is read.
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
