//! Impulses of walls at the end of a step.
//!
//! A wall changes velocities instantly, and changes the momentum of a step in no other way: its impulse
//! is `m (v' - v*)` with any integrator. Moving positions back carries no momentum.

use crate::constraint::Wall;

/// A vertex stopped by a wall.
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
    /// Step size [s].
    pub(crate) h: f64,
    /// Impulse [N s], and its moment about the [foot](Wall::foot) [N m s].
    pub(crate) walls: Vec<[[f64; 3]; 2]>,
    /// Parts carried by pins: coordinates and impulses [N s].
    pub(crate) held: Vec<(usize, f64)>,
}

impl Clone for WallImpulses {
    fn clone(&self) -> Self {
        WallImpulses { h: self.h, walls: self.walls.clone(), held: self.held.clone() }
    }

    /// Reuses memory, so that steps do not allocate.
    fn clone_from(&mut self, source: &Self) {
        self.h = source.h;
        self.walls.clone_from(&source.walls);
        self.held.clone_from(&source.held);
    }
}

impl WallImpulses {
    /// Starts a step of `h` [s] with this number of walls.
    pub(super) fn begin(&mut self, walls: usize, h: f64) {
        self.h = h;
        self.walls.clear();
        self.walls.resize(walls, [[0.0; 3]; 2]);
        self.held.clear();
    }

    /// Adds the impulse of `wall` on a vertex of this mass [kg] at the position `x`; coordinates with
    /// zero inverse mass are constrained.
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
