//! Walls at the end of a step.

use super::System;
use super::wall_drag::WalledStep;
use super::wall_impulse::WallStop;
use crate::state::State;

impl System {
    /// Lets walls act on the end `x`, `v` of a step of `h` [s] from the state `from`; whether any position
    /// changed. A force that acts throughout the step under drag at the rate `c` has made `response(c h)` of
    /// the velocity that it makes without drag.
    pub(crate) fn apply_walls(
        &mut self,
        from: &State,
        h: f64,
        (x, v): (&mut [f64], &mut [f64]),
        response: &dyn Fn(f64) -> f64,
    ) -> bool {
        self.put_back = false;
        self.books.wall_impulses.begin(self.walls.len(), h);
        if let Some(losses) = &mut self.books.wall_losses {
            losses.forget();
        }
        if !self.walls.iter().any(|wall| wall.is_crossed(self.inverse_mass.numbers(), x)) {
            return false;
        }
        let mut losses = self.books.wall_losses.take();
        let mut impulses = std::mem::take(&mut self.books.wall_impulses);
        let mut drag = self.is_dragged().then(|| self.books.wall_drag.take().unwrap_or_default());
        if let Some(losses) = &mut losses {
            self.set_time(from.time + h);
            losses.before(self, x, v);
        }
        if let Some(drag) = &mut drag {
            drag.begin((x, v), &self.mass, self.ether_drag, &mut self.dissipation);
        }
        let weights = self.inverse_mass.numbers();
        let mut stops = std::mem::take(&mut self.books.wall_stops);
        stops.clear();
        for (wall, plane) in self.walls.iter().enumerate() {
            let mut note = |vertex, speed| stops.push(WallStop { vertex, wall, speed });
            self.put_back |= plane.apply(weights, x, v, &mut note);
        }
        // At the places to which all of them together have put a vertex.
        stops.sort_unstable_by_key(|stop| (stop.vertex, stop.wall));
        for stop in &stops {
            let rows = stop.vertex * self.dimension..(stop.vertex + 1) * self.dimension;
            let size = self.mass[stop.vertex] * stop.speed;
            impulses.add(stop, &self.walls[stop.wall], &x[rows.clone()], &weights[rows], size);
        }
        if let Some(drag) = &drag {
            let (walls, mass, from) = (&self.walls[..], &self.mass[..], (from.x(), from.v()));
            let step = WalledStep { walls, mass, inverse_mass: weights, h, from, x, response };
            drag.add_to(&stops, &step, &mut impulses);
        }
        self.books.wall_stops = stops;
        if let Some(losses) = &mut losses {
            losses.after(self, from, h, x, v);
        }
        self.books.wall_losses = losses;
        self.books.wall_impulses = impulses;
        self.books.wall_drag = drag;
        self.put_back
    }

    /// True if drag slows velocities against what does not move.
    fn is_dragged(&self) -> bool {
        self.ether_drag != 0.0 || self.dissipation.iter().any(|term| term.scales_with_mass())
    }

    /// True if the last [`apply_walls`](Self::apply_walls) put any vertex back: velocities then jumped, and
    /// no polynomial goes through states before and after.
    pub(crate) fn walls_have_acted(&self) -> bool {
        self.put_back
    }
}
