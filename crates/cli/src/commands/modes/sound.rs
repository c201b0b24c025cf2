//! The sound of a blow as a WAV file.

use std::path::{Path, PathBuf};

use pliant::modes::{Silent, Sound, SoundError, Strike};
use pliant_files::durable_file;
use pliant_scene::assembly::Assembly;
use serde_json::{Value, json};

use crate::arguments::{ModesArguments, VertexChoice};
use crate::failure::Failure;
use crate::text::{counted, number};

use super::wav;

/// [Hz].
const SAMPLE_RATE: u32 = 48_000;
/// The largest sample, as a part of what a file can hold: one decibel is left.
const PEAK: f64 = 0.891_250_938;

/// Result of writing.
pub(super) struct WrittenSound {
    path: PathBuf,
    sound: Sound,
    vertex: usize,
    listen: usize,
    seconds: f64,
    bits: u16,
    samples: usize,
}

/// Writes the sound of `assembly` to `path`.
pub(super) fn write(
    path: &Path,
    arguments: &ModesArguments,
    assembly: &mut Assembly,
) -> Result<WrittenSound, Failure> {
    let options = &arguments.sound;
    let asked = "the command line asks for both with a sound";
    let vertex = vertex_at(options.strike.as_ref().expect(asked), "--strike", assembly)?;
    let listen = options.listen.as_ref().map(|at| vertex_at(at, "--listen", assembly)).transpose()?;
    let direction = options.direction.clone().expect(asked).0;
    let strike = Strike { vertex, direction, listen, rayleigh: options.rayleigh };
    let sound = assembly
        .simulation
        .sound(arguments.count.get().into(), &strike, SAMPLE_RATE.into())
        .map_err(|error| match error {
            SoundError::Modes(_) | SoundError::Silence { .. } => Failure::failed("sound", error.to_string()),
            error => Failure::usage(error.to_string()),
        })?;
    let samples = sound.samples(options.seconds, PEAK);
    let bytes = wav::encode(&samples, SAMPLE_RATE, options.bits)
        .map_err(|error| cannot_write(path, &error.to_string()))?;
    durable_file::replace(path, &bytes).map_err(|error| cannot_write(path, &error.to_string()))?;
    Ok(WrittenSound {
        path: path.to_owned(),
        sound,
        vertex,
        listen: listen.unwrap_or(vertex),
        seconds: options.seconds,
        bits: options.bits,
        samples: samples.len(),
    })
}

/// The number of a vertex of the scene.
fn vertex_at(place: &VertexChoice, option: &str, assembly: &Assembly) -> Result<usize, Failure> {
    let d = assembly.topology.dimension;
    match place {
        VertexChoice::Vertex(vertex) => Ok(*vertex),
        VertexChoice::Point(point) if point.len() != d => Err(Failure::usage(format!(
            "the point of `{option}` has {}; the scene is in {d}D",
            counted(point.len() as u64, "coordinate", "coordinates")
        ))),
        VertexChoice::Point(point) => {
            let distance =
                |x: &[f64]| x.iter().zip(point).map(|(x, p)| (x - p) * (x - p)).sum::<f64>().sqrt();
            let rows = assembly.topology.rest_positions.chunks_exact(d).map(distance).enumerate();
            let Some((vertex, away)) = rows.min_by(|a, b| a.1.total_cmp(&b.1)) else {
                return Err(Failure::usage("the scene has no vertices"));
            };
            let size = assembly.simulation.length_scale();
            if away > 0.1 * size {
                return Err(Failure::usage(format!(
                    "the point of `{option}` is {} m from the nearest vertex, {vertex}, of a scene of {} m: \
                     strike the body",
                    number(away),
                    number(size)
                )));
            }
            Ok(vertex)
        }
    }
}

fn cannot_write(path: &Path, error: &str) -> Failure {
    Failure::failed("sound", format!("cannot write {}: {error}", path.display()))
}

impl WrittenSound {
    pub(super) fn describe(&self) -> String {
        let tones: Vec<String> = self.sound.partials.iter().map(|p| number(p.frequency)).collect();
        format!(
            "wrote {} s of sound, {} bits at {} kHz, to {}: vertex {} struck, {}, {} Hz",
            number(self.seconds),
            self.bits,
            number(f64::from(SAMPLE_RATE) / 1e3),
            self.path.display(),
            self.vertex,
            counted(self.sound.partials.len() as u64, "tone", "tones"),
            tones.join(", ")
        )
    }

    /// Remarks for the listener.
    pub(super) fn warnings(&self) -> Vec<String> {
        let Silent { above_nyquist, overdamped, .. } = self.sound.silent;
        let mut warnings = vec![];
        let modes = |n: usize| counted(n as u64, "mode", "modes");
        if above_nyquist > 0 {
            let nyquist = SAMPLE_RATE / 2000;
            warnings.push(format!(
                "{} at {nyquist} kHz or above omitted: sampled at {} kHz they would sound lower",
                modes(above_nyquist),
                SAMPLE_RATE / 1000
            ));
        }
        if overdamped > 0 {
            warnings.push(format!("{} omitted, which are overdamped", modes(overdamped)));
        }
        if self.sound.partials.iter().all(|p| p.decay == 0.0) {
            warnings.push(
                "nothing damps the tones: they do not decay; see `--rayleigh` or the damping of bodies"
                    .into(),
            );
        }
        warnings
    }

    pub(super) fn document(&self) -> Value {
        json!({
            "path": self.path,
            "sample_rate": SAMPLE_RATE,
            "bits": self.bits,
            "samples": self.samples,
            "vertex": self.vertex,
            "listen": self.listen,
            "partials": self.sound.partials,
            "silent": self.sound.silent,
        })
    }
}
