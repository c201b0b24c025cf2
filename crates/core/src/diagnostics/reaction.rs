//! Reaction forces of pins and walls.

use super::wall_reaction::WallForces;
use crate::constraint::Hold;
use crate::system::{System, WallImpulses};

/// The force with which a pin holds its vertices or a wall pushes, now.
///
/// Of a pin it is `sum m a + dE/dx + dR/dv + c m v` over its coordinates, which is what is left for it to
/// carry of the equations of motion (`c` the ether drag), less what walls push at them. In statics it is
/// `sum dE/dx + dR/dv`, with the velocities of the way to the equilibrium.
///
/// Of a wall it is the mean over the last step, `sum m (v' - v*) / h` and what drag has taken from the
/// velocities that it takes back: its impulse on the vertices that it has stopped, along its normal alone,
/// over the size of the step. Times `h`, summed over all steps, it is the change of momentum less the
/// impulse of all other forces; a blow is in the step in which it falls. A step that was taken in parts has
/// that of the last part. By forward Euler, which moves by old velocities, what rests on a wall falls for a
/// step before it is put back: twice its weight and nothing, in turn. Before any step, after the state was
/// changed by hand, and in statics, a wall carries `n . (dE/dx + dR/dv + c m v)` of each vertex that touches
/// it and is pressed against it now.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Reaction {
    /// `body/pin`, or `wall0`, `wall1`, ... in the order of the scene.
    pub name: String,
    /// Force [N]; third component 0 in 2D.
    pub force: [f64; 3],
    /// Moment [N m] about `about`; in 2D only the third component.
    pub moment: [f64; 3],
    /// The point that the pin turns about, or else the mean position of its vertices now; of a wall the
    /// point nearest to the origin [m].
    pub about: [f64; 3],
}

/// A part of a step that is short beside all that a step resolves, and long beside the rounding of
/// velocities.
const SPAN: f64 = 1e-3;

/// State that reactions are of.
#[derive(Clone, Copy)]
pub(crate) struct ReactionInputs<'a> {
    /// [s]
    pub(crate) time: f64,
    /// Size of the last step [s].
    pub(crate) h: f64,
    /// Positions, flat [m].
    pub(crate) x: &'a [f64],
    /// Velocities, flat [m/s].
    pub(crate) v: &'a [f64],
    /// Velocities that what dissipates sees, flat [m/s].
    pub(crate) seen: &'a [f64],
    /// False in statics: neither accelerations nor drag count.
    pub(crate) has_inertia: bool,
    /// Impulses of walls in the last step, where they are known.
    pub(crate) last_step: Option<&'a WallImpulses>,
}

/// The reactions of the pins and then of the walls of `system`, which holds the force at `x`; accelerations
/// of prescribed motion are central differences of its exact velocities. A coordinate in several pins counts
/// for the first.
pub(crate) fn reactions(system: &mut System, inputs: ReactionInputs<'_>) -> Vec<Reaction> {
    let ReactionInputs { time, h, x, v, seen, has_inertia, last_step } = inputs;
    if system.is_damped() {
        system.evaluate_dissipation(x, seen);
    }
    let span = SPAN * h;
    let walls = (!system.walls().is_empty()).then(|| match last_step {
        Some(impulses) => WallForces::of_last_step(system, impulses, x.len()),
        None => WallForces::new(system, h, x, v),
    });
    let acceleration = if has_inertia { accelerations(system, time, span, x, v) } else { None };
    let drag = if has_inertia { system.ether_drag() } else { 0.0 };
    let mut counted = vec![false; x.len()];
    let pushed = walls.as_ref().map(|walls| &walls.at_vertices[..]);
    let held = system.constraints().iter();
    let pins =
        held.map(|hold| reaction(system, hold, (x, v, drag), acceleration.as_deref(), pushed, &mut counted));
    let pins: Vec<Reaction> = pins.collect();
    pins.into_iter().chain(walls.into_iter().flat_map(|walls| walls.reactions)).collect()
}

/// Of the moving coordinates [m/s^2]; `None` where nothing moves.
fn accelerations(system: &System, time: f64, span: f64, x: &[f64], v: &[f64]) -> Option<Vec<f64>> {
    if !system.has_prescribed_motion() {
        return None;
    }
    let (mut scratch, mut before, mut after) = (x.to_vec(), v.to_vec(), v.to_vec());
    // A motion without a value shows in the next step.
    system.prescribe(time - 0.5 * span, &mut scratch, &mut before);
    system.prescribe(time + 0.5 * span, &mut scratch, &mut after);
    Some(after.iter().zip(&before).map(|(after, before)| (after - before) / span).collect())
}

fn reaction(
    system: &System,
    hold: &Hold,
    (x, v, drag): (&[f64], &[f64], f64),
    acceleration: Option<&[f64]>,
    pushed: Option<&[f64]>,
    counted: &mut [bool],
) -> Reaction {
    let (d, axes) = (system.dimension(), hold.axes());
    let point = |vertex: usize| {
        let mut point = [0.0; 3];
        point[..d].copy_from_slice(&x[vertex * d..][..d]);
        point
    };
    let about = hold.motion().and_then(|motion| motion.rotation()).map_or_else(
        || {
            let mut mean = [0.0; 3];
            for vertex in hold.vertices() {
                let share = point(*vertex as usize).map(|x| x / hold.vertices().len() as f64);
                (0..3).for_each(|c| mean[c] += share[c]);
            }
            mean
        },
        |rotation| rotation.point(),
    );
    let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
    system.visit_gradient(hold.vertices(), |vertex, gradient| {
        let m = system.mass()[vertex];
        let mut f = [0.0; 3];
        for c in (0..d).filter(|c| axes[*c]) {
            let i = vertex * d + c;
            if !std::mem::replace(&mut counted[i], true) {
                f[c] = gradient[c] + m * (drag * v[i] + acceleration.map_or(0.0, |a| a[i]))
                    - pushed.map_or(0.0, |f| f[i]);
            }
        }
        let at = point(vertex);
        let turn = crate::element::cross([0, 1, 2].map(|c| at[c] - about[c]), f);
        for c in 0..3 {
            force[c] += f[c];
            moment[c] += turn[c];
        }
    });
    Reaction { name: hold.name().to_owned(), force, moment, about }
}
