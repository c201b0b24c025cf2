use std::path::Path;

use super::format::{FORMAT, MAGIC, decode, encode, encode_as};
use super::*;
use pliant_scene::Source;
use pliant_scene::assembly::UnstableStep;

const SCENE: &str = "dimension = 2
time = { integrator = 'implicit-euler', step = 1e-3, duration = 1.0 }
world = { gravity = [0.0, -9.8] }
[[body]]
mesh = { file = { path = 'plate.obj' } }
springs = { stiffness = 100.0 }
mass = { per_vertex = 1.0 }
pin = [{ vertices = [0] }]
";
const PLATE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A checkpoint after three steps in a directory of its own.
fn written() -> (tempfile::TempDir, CheckpointFile) {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("plate.obj"), PLATE).unwrap();
    let source = Source::new("plate.toml", SCENE).in_directory(directory.path());
    let scene = source.scene().unwrap();
    let mut simulation = scene.assemble(UnstableStep::Accept).ok().unwrap().simulation;
    (0..3).for_each(|_| simulation.step().unwrap());
    let scene = SavedScene::new(&source, &scene).unwrap();
    let notes = Notes::from([("who".to_owned(), vec![0, 255, 7])]);
    let file = CheckpointFile { scene, simulation: simulation.checkpoint(), run: None, notes };
    content(&file).write(&directory.path().join("plate.checkpoint")).unwrap();
    (directory, file)
}

fn content(file: &CheckpointFile) -> CheckpointContent<'_> {
    let CheckpointFile { scene, simulation, run, notes } = file;
    CheckpointContent { scene, simulation, run: run.as_ref(), notes }
}

fn refusal(path: &Path) -> String {
    CheckpointFile::read(path).unwrap_err().to_string()
}

#[test]
fn what_was_written_is_read() {
    let (directory, file) = written();
    let path = directory.path().join("plate.checkpoint");
    assert_eq!(CheckpointFile::read(&path).unwrap(), file);
    assert_eq!(file.scene.files.len(), 1);
    assert_eq!(file.scene.source().scene().unwrap().body.len(), 1);
    // Besides the mesh; temporary files are gone.
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
}

/// Every bit pattern survives.
#[test]
fn every_number_survives() {
    let numbers = [0.1, -0.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, f64::MIN_POSITIVE / 3.0, 65504.0];
    let bytes = encode(&numbers.to_vec()).unwrap();
    let read: Vec<f64> = decode(Path::new("a"), &bytes).unwrap();
    let bits = |numbers: &[f64]| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&read), bits(&numbers));
}

#[test]
fn a_file_cut_or_changed_anywhere_is_refused() {
    let (directory, _) = written();
    let path = directory.path().join("plate.checkpoint");
    let whole = std::fs::read(&path).unwrap();
    let read = |bytes: &[u8]| CheckpointFile::from_bytes(&path, bytes);
    assert!(read(&whole).is_ok());
    for cut in 0..whole.len() {
        assert!(read(&whole[..cut]).is_err(), "cut at {cut}");
    }
    for place in 0..whole.len() {
        let mut other = whole.clone();
        other[place] ^= 0x20;
        assert!(read(&other).is_err(), "byte {place}");
    }
    assert!(read(&[&whole[..], &[0]].concat()).is_err());
    let said = read(&whole[..whole.len() - 1]).unwrap_err().to_string();
    assert!(said.contains("plate.checkpoint is damaged") && said.contains("checksum"), "{said}");
    assert!(read(b"[time]\n").unwrap_err().to_string().contains("is not a checkpoint"));
}

#[test]
fn other_formats_and_versions_are_refused_with_the_reason() {
    let (directory, file) = written();
    let path = directory.path().join("other");
    for (format, version, said) in [
        (FORMAT - 1, "0.1.0", "has format 0 of checkpoints, this program reads format 1"),
        (FORMAT + 1, "7.0.0", "has format 2 of checkpoints, this program reads format 1"),
        (FORMAT, "0.0.9", concat!("was written by pliant 0.0.9, this is ", env!("CARGO_PKG_VERSION"))),
    ] {
        std::fs::write(&path, encode_as(format, version, &content(&file)).unwrap()).unwrap();
        assert!(refusal(&path).contains(said), "{}", refusal(&path));
    }
    assert!(std::fs::read(&path).unwrap().starts_with(&MAGIC));
}

#[test]
fn a_changed_mesh_is_refused() {
    let (directory, _) = written();
    let (path, mesh) = (directory.path().join("plate.checkpoint"), directory.path().join("plate.obj"));
    std::fs::write(&mesh, PLATE.replace("v 1 0 0", "v 2 0 0")).unwrap();
    let said = refusal(&path);
    assert!(said.contains("plate.obj has changed since"), "{said}");
    std::fs::remove_file(&mesh).unwrap();
    assert!(refusal(&path).contains("plate.obj cannot be read: "), "{}", refusal(&path));
    std::fs::write(&mesh, PLATE).unwrap();
    CheckpointFile::read(&path).unwrap();
}

#[test]
fn what_is_no_regular_file_is_neither_read_nor_replaced() {
    let (directory, file) = written();
    assert!(refusal(directory.path()).contains("it is a directory, not a regular file"));
    let said = content(&file).write(directory.path()).unwrap_err().to_string();
    assert!(said.contains("it is a directory, not a regular file"), "{said}");
    #[cfg(unix)]
    {
        assert!(refusal(Path::new("/dev/zero")).contains("it is a device, not a regular file"));
        let said = content(&file).write(Path::new("/dev/null")).unwrap_err().to_string();
        assert!(said.contains("it is a device, not a regular file"), "{said}");
    }
}
