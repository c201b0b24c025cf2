//! Scenes that come with the program.

use std::path::Path;

use pliant_gradient::{LossFrame, ParameterSelection, UNLIMITED, check, gradient, names};
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// Larger ones take long.
const MOST_COORDINATES: usize = 3000;

#[test]
fn names_that_are_offered_have_derivatives() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let (mut compared, mut refused) = (0, vec![]);
    for file in files.filter(|file| file.extension().is_some_and(|ending| ending == "toml")) {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let scene = Scene::from_path(&file).unwrap_or_else(|error| panic!("{name}: {error}"));
        let assembly =
            scene.assemble(UnstableStep::Accept).unwrap_or_else(|fault| panic!("{name}: {fault:?}"));
        let (mut simulation, topology) = (assembly.simulation, assembly.topology);
        if simulation.state().x().len() > MOST_COORDINATES {
            continue;
        }
        if check(&mut simulation).is_err() {
            refused.push(name);
            continue;
        }
        let offered = names(&scene, &topology);
        let mut selection = ParameterSelection::new(&scene, &topology, simulation.numbering(), &offered)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
            x_bar.fill(1.0);
            frame.x.iter().sum()
        };
        match gradient(&mut simulation, 2, &mut loss, selection.parameters(), UNLIMITED) {
            Ok(found) => {
                for (key, part) in offered.iter().zip(selection.parts(&found)) {
                    assert!(!part.is_empty() && part.iter().all(|by| by.is_finite()), "{name}: {key}");
                }
                compared += 1;
            }
            Err(error) => panic!("{name}: {error}"),
        }
    }
    refused.sort();
    assert_eq!(refused, ["falling_jelly_2d", "lees_frame_2d", "snap_through_2d"]);
    assert!(compared > 45, "{compared}");
}
