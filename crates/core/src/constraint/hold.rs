//! Pins: constraints on coordinates of vertices.

mod jump;

pub(crate) use jump::Jump;

use super::drive::mean;
use super::{Drive, Motion, Waypoint};

/// Positions closer than this fraction of their distance from the origin, and of the path at their
/// velocity over the elapsed time, coincide.
const SAME_PLACE: f64 = 1e-12;

/// A pin: fixes coordinates of some vertices, or gives them a prescribed motion.
///
/// ```
/// use pliant::constraint::{Hold, Motion};
///
/// // Two vertices, held in x and z alone, go up at 0.1 m/s for two seconds.
/// let (start, rest) = ([0.0; 6], [0.0; 6]);
/// let up = Motion::new().along(|t| ([0.0, 0.0, 0.1 * t], [0.0, 0.0, 0.1]));
/// let hold = Hold::new("clamp", vec![0, 1]).along([true, false, true]).until(2.0);
/// let hold = hold.moving(up, &start, &rest, 3);
/// assert_eq!((hold.axes(), hold.end(), hold.moves()), ([true, false, true], 2.0, true));
/// ```
#[derive(Debug)]
pub struct Hold {
    name: String,
    /// Number among all pins of a system, in the order added.
    rank: u32,
    /// Ascending.
    vertices: Vec<u32>,
    axes: [bool; 3],
    /// Release time [s].
    until: f64,
    motion: Option<PrescribedMotion>,
    /// Steering from outside, which replaces the motion.
    drive: Option<Drive>,
}

/// Motion of pinned vertices.
#[derive(Debug)]
struct PrescribedMotion {
    motion: Motion,
    /// Start of each vertex, and its reference position [m].
    start: Vec<[f64; 3]>,
    rest: Vec<[f64; 3]>,
}

impl Hold {
    /// Creates a pin that fixes all coordinates of these vertices permanently.
    pub fn new(name: impl Into<String>, mut vertices: Vec<u32>) -> Self {
        vertices.sort_unstable();
        vertices.dedup();
        Hold {
            name: name.into(),
            rank: 0,
            vertices,
            axes: [true; 3],
            until: f64::INFINITY,
            motion: None,
            drive: None,
        }
    }

    /// Restricts the pin to these of the axes x, y, z.
    #[must_use]
    pub fn along(mut self, axes: [bool; 3]) -> Self {
        self.axes = axes;
        self
    }

    /// Releases the pin at the time `until` [s]: at the step nearest to it.
    #[must_use]
    pub fn until(mut self, until: f64) -> Self {
        self.until = until;
        self
    }

    /// Adds a prescribed motion; `start` and `rest` are the flat start and reference positions of all
    /// vertices, in `dimension` dimensions [m].
    ///
    /// # Panics
    /// If a vertex of the pin is missing in either.
    #[must_use]
    pub fn moving(mut self, motion: Motion, start: &[f64], rest: &[f64], dimension: usize) -> Self {
        let points = |x: &[f64]| points_of(&self.vertices, x, dimension);
        let (start, rest) = (points(start), points(rest));
        self.motion = Some(PrescribedMotion { motion, start, rest });
        self
    }

    /// Returns the number among all pins of a system.
    pub(crate) fn rank(&self) -> u32 {
        self.rank
    }

    /// Returns the pin with the number `rank`.
    pub(crate) fn ranked(self, rank: u32) -> Self {
        Hold { rank, ..self }
    }

    /// Returns the start of each moving vertex [m]; empty without a motion.
    pub(crate) fn starts(&self) -> &[[f64; 3]] {
        self.motion.as_ref().map_or(&[], |moved| &moved.start)
    }

    /// Sets the starts [m], one per vertex.
    pub(crate) fn set_starts(&mut self, starts: &[[f64; 3]]) {
        if let Some(moved) = &mut self.motion {
            moved.start.copy_from_slice(starts);
        }
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the vertices, ascending.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Returns which of the coordinates x, y, z are constrained.
    pub fn axes(&self) -> [bool; 3] {
        self.axes
    }

    /// Returns the release time [s]; infinite without one.
    pub fn end(&self) -> f64 {
        self.until
    }

    /// True if the pin moves, by its own motion or steered.
    pub fn moves(&self) -> bool {
        self.motion.is_some() || self.drive.is_some()
    }

    /// Returns the motion by which the pin is steered from outside.
    pub fn drive(&self) -> Option<&Drive> {
        self.drive.as_ref()
    }

    /// Sets the steering; `None` returns to the own motion.
    pub(crate) fn set_drive(&mut self, drive: Option<Drive>) {
        self.drive = drive;
    }

    /// Returns the starts of the vertices [m] and the pose relative to them at `time` [s]. Fixed pins and
    /// non-rigid motions start at the positions in `x`.
    pub(crate) fn pose(&self, time: f64, dimension: usize, x: &[f64]) -> (Vec<[f64; 3]>, Waypoint) {
        if let Some(drive) = &self.drive {
            return (drive.starts().to_vec(), drive.at(time));
        }
        let places = points_of(&self.vertices, x, dimension);
        let still = Waypoint::at_rest(nalgebra::Isometry3::identity());
        let Some(PrescribedMotion { motion, start, rest }) = &self.motion else { return (places, still) };
        let moment = motion.at(time);
        if let Some(waypoint) = moment.rigid(mean(start)) {
            return (start.clone(), waypoint);
        }
        let rates: Vec<_> =
            start.iter().zip(rest).map(|(start, rest)| moment.place(*start, *rest).1).collect();
        (places, Waypoint { velocity: mean(&rates).coords, ..still })
    }

    /// Returns the first time after `time` at which the motion has a kink [s].
    pub(crate) fn next_break(&self, time: f64) -> Option<f64> {
        match &self.drive {
            Some(drive) => drive.times().into_iter().find(|at| *at > time),
            None => self.motion.as_ref()?.motion.next_break(time),
        }
    }

    /// Returns the own motion; `None` for a fixed pin.
    pub fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref().map(|moved| &moved.motion)
    }

    /// Returns the indices of the constrained coordinates in a flat array, ascending.
    pub fn coordinates(&self, dimension: usize) -> impl Iterator<Item = usize> + '_ {
        let axes = move || (0..dimension).filter(|c| self.axes[*c]);
        self.vertices.iter().flat_map(move |v| axes().map(move |c| *v as usize * dimension + c))
    }

    /// Writes the prescribed positions [m] and velocities [m/s] at `time` [s] into flat arrays; returns
    /// whether they are finite.
    pub(crate) fn prescribe(&self, time: f64, dimension: usize, x: &mut [f64], v: &mut [f64]) -> bool {
        if let Some(drive) = &self.drive {
            return self.put(drive.places(&drive.at(time)), dimension, x, v);
        }
        let Some(PrescribedMotion { motion, start, rest }) = &self.motion else { return true };
        let moment = motion.at(time);
        let places = start.iter().zip(rest).map(|(start, rest)| moment.place(*start, *rest));
        self.put(places, dimension, x, v)
    }

    /// Writes positions [m] and velocities [m/s] of the vertices into flat arrays; returns whether they
    /// are finite.
    fn put(
        &self,
        places: impl Iterator<Item = ([f64; 3], [f64; 3])>,
        dimension: usize,
        x: &mut [f64],
        v: &mut [f64],
    ) -> bool {
        let mut sum = 0.0;
        for (vertex, (position, velocity)) in self.vertices.iter().zip(places) {
            for c in (0..dimension).filter(|c| self.axes[*c]) {
                let i = *vertex as usize * dimension + c;
                (x[i], v[i]) = (position[c], velocity[c]);
                // Zero times a finite number is zero, times anything else NaN.
                sum += 0.0 * position[c] + 0.0 * velocity[c];
            }
        }
        sum == 0.0
    }

    /// Adds to `starts` the derivatives with respect to the starts of the vertices, given the derivatives
    /// `x` with respect to their positions at `time` [s] and `v` with respect to their velocities: the
    /// transpose of the motion. All arrays are flat; only constrained coordinates are used.
    pub fn add_by_starts(&self, time: f64, dimension: usize, (x, v): (&[f64], &[f64]), starts: &mut [f64]) {
        let moment = self.motion().map(|motion| motion.at(time));
        for vertex in &self.vertices {
            let row = |rows: &[f64]| {
                let held = |c: usize| c < dimension && self.axes[c];
                [0, 1, 2].map(|c| if held(c) { rows[*vertex as usize * dimension + c] } else { 0.0 })
            };
            let (x, v) = (row(x), row(v));
            let by_start = moment.as_ref().map_or(x, |moment| moment.by_start(x, v));
            let starts = &mut starts[*vertex as usize * dimension..][..dimension];
            starts.iter_mut().zip(by_start).for_each(|(sum, by)| *sum += by);
        }
    }

    /// Continues the motion from the vertex positions in `x` at `time` [s], flat `(n, dimension)` [m].
    /// Vertices that are where the motion puts them are unchanged.
    pub(crate) fn go_on_from(&mut self, time: f64, dimension: usize, x: &[f64]) {
        let Some(PrescribedMotion { motion, start, rest }) = &mut self.motion else { return };
        let moment = motion.at(time);
        for ((vertex, start), rest) in self.vertices.iter().zip(start).zip(rest) {
            let (prescribed, velocity) = moment.place(*start, *rest);
            let (mut place, mut is_there) = (prescribed, true);
            for c in (0..dimension).filter(|c| self.axes[*c]) {
                place[c] = x[*vertex as usize * dimension + c];
                let reach = place[c].abs() + velocity[c].abs() * time.abs();
                is_there &= (place[c] - prescribed[c]).abs() <= SAME_PLACE * reach;
            }
            if !is_there {
                *start = moment.start(place, *rest);
            }
        }
    }

    /// Returns the largest distance of a vertex coordinate at time 0 from its start [m]; zero without a
    /// motion, NaN if the motion has no finite value.
    pub fn jump_at_start(&self, dimension: usize) -> f64 {
        let Some(PrescribedMotion { motion, start, rest }) = &self.motion else { return 0.0 };
        let moment = motion.at(0.0);
        let mut farthest = 0.0;
        for (start, rest) in start.iter().zip(rest) {
            let place = moment.place(*start, *rest).0;
            for c in (0..dimension).filter(|c| self.axes[*c]) {
                let distance = (place[c] - start[c]).abs();
                farthest = if distance <= farthest { farthest } else { distance };
            }
        }
        farthest
    }
}

/// Positions of some vertices in a flat array.
fn points_of(vertices: &[u32], x: &[f64], dimension: usize) -> Vec<[f64; 3]> {
    let point = |v: &u32| {
        let mut point = [0.0; 3];
        point[..dimension].copy_from_slice(&x[*v as usize * dimension..][..dimension]);
        point
    };
    vertices.iter().map(point).collect()
}
