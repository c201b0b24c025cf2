//! Positions of every scene of `scenes/`, for `tests/tools/web/bits.mjs` to compare the browser's with.

use std::path::Path;
use std::time::{Duration, Instant};

use pliant_scene::Source;
use pliant_scene::experiment::Experiment;

/// Steps of a scene.
const STEPS: u64 = 50;
/// Time after which no more steps of a scene are taken.
const LONGEST: Duration = Duration::from_secs(2);

/// Writes `<scene>.f64`, the positions after each step, one step after the other, and `<scene>.fault` with
/// the message of a step that was not taken.
#[test]
#[ignore = "writes files for tests/tools/web/check.sh into the folder PLIANT_BITS"]
fn positions_are_written_for_the_browser_to_compare() {
    let folder = std::env::var("PLIANT_BITS").unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut scenes: Vec<_> = scenes.read_dir().unwrap().map(|file| file.unwrap().path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    scenes.sort();
    for path in scenes {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let file = |ending: &str| Path::new(&folder).join(format!("{name}.{ending}"));
        let mut experiment = Experiment::new(Source::from_path(&path).unwrap()).unwrap();
        let mut positions: Vec<u8> = vec![];
        let begun = Instant::now();
        for _ in 0..STEPS {
            experiment.step();
            if let Some(failure) = experiment.failure() {
                std::fs::write(file("fault"), &failure.message).unwrap();
                break;
            }
            positions.extend(experiment.simulation().positions().iter().flat_map(|x| x.to_le_bytes()));
            if begun.elapsed() > LONGEST {
                break;
            }
        }
        std::fs::write(file("f64"), positions).unwrap();
    }
}
