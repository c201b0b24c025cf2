//! Impulses that walls give at the end of a step.
//!
//! A wall changes velocities at once, and the momentum of a step by nothing else: `m (v' - v*)` is its
//! impulse, whatever the scheme. Positions that it puts back have no momentum.

use crate::constraint::Wall;

/// A vertex that a wall stops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallStop {
    pub(crate) vertex: usize,
    /// Number of the wall.
    pub(crate) wall: usize,
    /// Change of the velocity along the normal [m/s].
    pub(crate) speed: f64,
}

/// Impulses of all walls in one step, in their order.
#[derive(Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct WallImpulses {
    /// Size of the step [s].
    pub(crate) h: f64,
    /// Impulse [N s], and its moment about the [foot](Wall::foot) [N m s].
    pub(crate) walls: Vec<[[f64; 3]; 2]>,
    /// Parts that pins carry: coordinates and impulses [N s].
    pub(crate) held: Vec<(usize, f64)>,
}

impl Clone for WallImpulses {
    fn clone(&self) -> Self {
        WallImpulses { h: self.h, walls: self.walls.clone(), held: self.held.clone() }
    }

    /// Into memory that is there: a step allocates nothing.
    fn clone_from(&mut self, source: &Self) {
        self.h = source.h;
        self.walls.clone_from(&source.walls);
        self.held.clone_from(&source.held);
    }
}

impl WallImpulses {
    /// Begins with a step of `h` [s] of so many walls.
    pub(super) fn begin(&mut self, walls: usize, h: f64) {
        self.h = h;
        self.walls.clear();
        self.walls.resize(walls, [[0.0; 3]; 2]);
        self.held.clear();
    }

    /// Adds the impulse that `wall` gives a vertex of this mass [kg] at the place `x`, of which coordinates
    /// without inverse mass are held.
    #[inline]
    pub(super) fn add(&mut self, stop: &WallStop, wall: &Wall, x: &[f64], inverse_mass: &[f64], mass: f64) {
        let mut impulse = [0.0; 3];
        for (c, n) in wall.normal().iter().enumerate() {
            impulse[c] = mass * stop.speed * n;
            if inverse_mass[c] == 0.0 {
                self.held.push((stop.vertex * x.len() + c, impulse[c]));
            }
        }
        let moment = wall.moment(x, impulse);
        let [force_sum, moment_sum] = &mut self.walls[stop.wall];
        for c in 0..3 {
            force_sum[c] += impulse[c];
            moment_sum[c] += moment[c];
        }
    }
}
