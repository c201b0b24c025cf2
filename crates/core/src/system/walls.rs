//! Walls at the end of a step.

use std::sync::{Mutex, PoisonError};

use super::wall_drag::WalledStep;
use super::{System, WallStop};
use crate::state::State;

impl System {
    /// True if a [pass](Self::pass) can apply walls: vertices reach their final positions in it, and no
    /// losses are counted. Discards the stops of a failed step; call [`book_walls`](Self::book_walls)
    /// after the pass.
    pub(crate) fn begin_walls_in_pass(&mut self) -> bool {
        exclusive(&mut self.books.wall_stops).clear();
        !(self.walls.is_empty() || self.books.wall_losses.is_some() || self.pins.move_any())
    }

    /// Applies walls to the end `x`, `v` of a step of `h` [s] from the state `from`, and records it;
    /// returns whether any position changed. `response` is that of [`book_walls`](Self::book_walls).
    pub(crate) fn apply_walls(
        &mut self,
        from: &State,
        h: f64,
        (x, v): (&mut [f64], &mut [f64]),
        response: &dyn Fn(f64) -> f64,
    ) -> bool {
        self.put_back = false;
        if self.walls.is_empty() {
            return false;
        }
        // Record the state before walls act, if losses are counted.
        let mut losses = self.books.wall_losses.take();
        if let Some(losses) = &mut losses {
            losses.forget();
        }
        let crossed = self.walls.iter().any(|wall| wall.is_crossed(self.inverse_mass.numbers(), x));
        if let (true, Some(losses)) = (crossed, &mut losses) {
            self.set_time(from.time + h);
            losses.before(self, x, v);
        }
        // Apply the walls one after another.
        let stops = exclusive(&mut self.books.wall_stops);
        stops.clear();
        for (wall, plane) in self.walls.iter().enumerate().filter(|_| crossed) {
            let note = |vertex, speed| stops.push(WallStop { vertex, wall, speed });
            self.put_back |= plane.apply(self.inverse_mass.numbers(), x, v, note);
        }
        if let (true, Some(losses)) = (crossed, &mut losses) {
            losses.after(self, from, h, x, v);
        }
        self.books.wall_losses = losses;
        self.book_walls(from, h, (x, v), response);
        self.put_back
    }

    /// Records the wall impulses at the end `x`, `v` of a step of `h` [s] from the state `from`. Under
    /// drag at the rate `c`, a constant force has produced the fraction `response(c h)` of the velocity
    /// that it produces without drag.
    pub(crate) fn book_walls(
        &mut self,
        from: &State,
        h: f64,
        (x, v): (&[f64], &[f64]),
        response: &dyn Fn(f64) -> f64,
    ) {
        let (d, inverse_mass) = (self.dimension, self.inverse_mass.numbers());
        let (before, after) = ((from.x(), from.v()), (x, v));
        let step = WalledStep { walls: &self.walls, inverse_mass, h, before, after, response };
        let impulses = &mut self.books.wall_impulses;
        impulses.begin(self.walls.len(), h);
        let stops = exclusive(&mut self.books.wall_stops);
        // Sums have the same order on any number of threads.
        stops.sort_unstable_by_key(|stop| (stop.vertex, stop.wall));
        for stops in stops.chunk_by_mut(|a, b| a.vertex == b.vertex) {
            let vertex = stops[0].vertex;
            let (mass, rows) = (self.mass[vertex], vertex * d..(vertex + 1) * d);
            let drag: f64 = self
                .dissipation
                .iter()
                .filter_map(|term| term.vertex_drag())
                .map(|term| term.drag(vertex))
                .sum();
            let rate = self.ether_drag + drag / mass;
            if rate != 0.0 {
                step.add_drag(stops, d, rate);
            }
            // Moments refer to the final position of the vertex.
            for stop in stops {
                let (wall, x) = (&self.walls[stop.wall], &x[rows.clone()]);
                impulses.add(stop, wall, x, &inverse_mass[rows.clone()], mass);
            }
        }
    }

    /// True if the last [`apply_walls`](Self::apply_walls) moved any vertex: velocities then jumped, and
    /// no polynomial passes through states before and after.
    pub(crate) fn walls_have_acted(&self) -> bool {
        self.put_back
    }
}

/// Returns the stops; no pass may be running.
fn exclusive(stops: &mut Mutex<Vec<WallStop>>) -> &mut Vec<WallStop> {
    stops.get_mut().unwrap_or_else(PoisonError::into_inner)
}
