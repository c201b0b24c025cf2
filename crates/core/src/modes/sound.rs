//! Modal sound synthesis: the sound of a struck body (lecture 2: the use of linear materials).

use super::ModesError;
use super::eigen::Eigen;
use crate::algebra::direction;
use crate::simulation::Simulation;

/// A strike, and the listening point.
#[derive(Clone, Debug, PartialEq)]
pub struct Strike {
    /// Struck vertex, in scene order.
    pub vertex: usize,
    /// Direction of the strike, one component per dimension, of any nonzero length.
    pub direction: Vec<f64>,
    /// Vertex to listen to, along the same direction; `None`: the struck one.
    pub listen: Option<usize>,
    /// Damping `(alpha, beta)` of `alpha M + beta K` [1/s, s], instead of that of the scene.
    pub rayleigh: Option<(f64, f64)>,
}

/// One tone of a [`Sound`]: `amplitude exp(-decay t) sin(2 pi frequency t)`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Partial {
    /// Mode number, from 0.
    pub mode: usize,
    /// Damped frequency, `sqrt(omega^2 - decay^2) / (2 pi)` [Hz].
    pub frequency: f64,
    /// Decay rate [1/s].
    pub decay: f64,
    /// Amplitude `(phi . n)(strike) (phi . n)(listen)` [1/kg]: velocity per impulse.
    pub amplitude: f64,
}

/// Numbers of inaudible modes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Silent {
    /// Rigid motions.
    pub rigid: usize,
    /// Modes at or above half the sample rate, which would alias to lower tones.
    pub above_nyquist: usize,
    /// Overdamped modes, which do not oscillate.
    pub overdamped: usize,
    /// Modes at rest at the struck or the listening vertex.
    pub not_struck: usize,
}

/// Sound of a struck body: the tones of its modes.
///
/// A strike of the impulse `I n` gives mode `j` the velocity `(phi_j . n) I`, and the listening point
/// moves with `v(t) = I sum_j a_j exp(-d_j t) cos(w_j t)`, `a_j = (phi_j . n)(strike) (phi_j .
/// n)(listen)`. The output uses sines instead, a quarter of a period later, so that it starts silently
/// instead of with a click; the ear does not hear the difference. van den Doel, Pai 1998, "The sounds of
/// physical shapes", Presence 7, 382.
#[derive(Clone, Debug, PartialEq)]
pub struct Sound {
    /// Tones, lowest first.
    pub partials: Vec<Partial>,
    /// Modes omitted from the tones.
    pub silent: Silent,
    sample_rate: f64,
}

/// Error of a sound synthesis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SoundError {
    /// The modes cannot be found.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// The vertex does not exist.
    #[error("there is no vertex {vertex}: the scene has {count}, 0 to {}", count - 1)]
    NoVertex {
        /// Vertex requested.
        vertex: usize,
        /// Number of vertices.
        count: usize,
    },
    /// The vertex cannot move along the strike.
    #[error("vertex {vertex} is pinned: an impact along ({}) does not move \
             it", direction.iter().map(f64::to_string).collect::<Vec<_>>().join(", "))]
    Held {
        /// Struck or listening vertex.
        vertex: usize,
        /// Direction of the strike.
        direction: Vec<f64>,
    },
    /// The direction is zero or has the wrong number of components.
    #[error(
        "the direction has {found} components with a length of {length}; it needs {expected}, not all zero"
    )]
    Direction {
        /// Components given.
        found: usize,
        /// Components needed.
        expected: usize,
        /// Length of the direction.
        length: f64,
    },
    /// No mode is audible.
    #[error(
        "nothing is heard: of {modes} modes {} are rigid motion, {} are above half the sample rate, {} are \
         overdamped and {} are at rest where the body is struck or listened to; ask for more modes, or \
         strike elsewhere",
        silent.rigid, silent.above_nyquist, silent.overdamped, silent.not_struck
    )]
    Silence {
        /// Number of modes examined.
        modes: usize,
        /// Reasons.
        silent: Silent,
    },
}

/// Amplitudes below this fraction of the largest are rounding.
const INAUDIBLE: f64 = 1e-10;

impl Simulation {
    /// Computes the sound of the body in the current state from its `count` lowest modes, to be sampled
    /// at `sample_rate` [Hz].
    ///
    /// If damping couples modes, only its effect on each mode alone is heard.
    ///
    /// # Errors
    /// [`SoundError`] if the strike is invalid or nothing is heard.
    pub fn sound(&mut self, count: usize, strike: &Strike, sample_rate: f64) -> Result<Sound, SoundError> {
        match self.system().dimension() {
            2 => sound::<2>(self, count, strike, sample_rate),
            _ => sound::<3>(self, count, strike, sample_rate),
        }
    }
}

fn sound<const D: usize>(
    simulation: &mut Simulation,
    count: usize,
    strike: &Strike,
    sample_rate: f64,
) -> Result<Sound, SoundError> {
    let found = strike.direction.len();
    let Some(normal) = direction(&strike.direction).filter(|_| found == D) else {
        let length = strike.direction.iter().map(|c| c.abs()).sum();
        return Err(SoundError::Direction { found, expected: D, length });
    };
    // Coordinates of a vertex, which must be able to move along the strike.
    let place = |vertex: usize| {
        let vertices = simulation.system().mass().len();
        if vertex >= vertices {
            return Err(SoundError::NoVertex { vertex, count: vertices });
        }
        let at = simulation.numbering().internal(vertex as u32) as usize * D;
        let moves = (0..D).any(|c| normal[c] != 0.0 && simulation.system().inverse_mass()[at + c] > 0.0);
        if moves { Ok(at) } else { Err(SoundError::Held { vertex, direction: strike.direction.clone() }) }
    };
    // Modes, their damping and amplitudes.
    let struck = place(strike.vertex)?;
    let heard = strike.listen.map_or(Ok(struck), place)?;
    let mut eigen = Eigen::<D>::about(simulation, Some(count))?;
    let rates = match strike.rayleigh {
        Some((alpha, beta)) => eigen.pairs.iter().map(|(square, _)| alpha + beta * square).collect(),
        None => eigen.damping(simulation.system()).0,
    };
    let along = |shape: &[f64], at: usize| (0..D).map(|c| normal[c] * shape[at + c]).sum::<f64>();
    let amplitudes: Vec<f64> =
        eigen.pairs.iter().map(|(_, p)| along(&p.vector, struck) * along(&p.vector, heard)).collect();
    let loudest = amplitudes.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
    // Sort out inaudible modes.
    let (mut partials, mut silent) = (vec![], Silent::default());
    for (mode, (((square, _), rate), amplitude)) in eigen.pairs.iter().zip(&rates).zip(amplitudes).enumerate()
    {
        let decay = 0.5 * rate;
        let frequency = (square - decay * decay).max(0.0).sqrt() / std::f64::consts::TAU;
        if *square == 0.0 {
            silent.rigid += 1;
        } else if square.sqrt() / std::f64::consts::TAU >= 0.5 * sample_rate {
            silent.above_nyquist += 1;
        } else if frequency == 0.0 {
            silent.overdamped += 1;
        } else if amplitude.abs() <= INAUDIBLE * loudest {
            silent.not_struck += 1;
        } else {
            partials.push(Partial { mode, frequency, decay, amplitude });
        }
    }
    if partials.is_empty() {
        return Err(SoundError::Silence { modes: eigen.pairs.len(), silent });
    }
    Ok(Sound { partials, silent, sample_rate })
}

impl Sound {
    /// Returns `seconds` of sound, scaled so that the largest sample is `peak`, at most 1. Each tone is
    /// advanced by a constant complex factor per sample, which is exact up to rounding.
    pub fn samples(&self, seconds: f64, peak: f64) -> Vec<f64> {
        let mut samples = vec![0.0; (seconds * self.sample_rate).round() as usize];
        for partial in &self.partials {
            let (sin, cos) = (std::f64::consts::TAU * partial.frequency / self.sample_rate).sin_cos();
            let decay = (-partial.decay / self.sample_rate).exp();
            let (re, im) = (decay * cos, decay * sin);
            let (mut x, mut y) = (partial.amplitude, 0.0);
            for sample in &mut samples {
                *sample += y;
                (x, y) = (re * x - im * y, im * x + re * y);
            }
        }
        let largest = samples.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
        if largest > 0.0 {
            samples.iter_mut().for_each(|s| *s *= peak / largest);
        }
        samples
    }
}
