//! Reaction forces of pins and walls.

use super::wall_reaction::WallForces;
use crate::constraint::Hold;
use crate::system::{System, WallImpulses};

/// Current reaction force of a pin or a wall.
///
/// For a pin it is `sum m a + dE/dx + dR/dv + c m v` over its coordinates, the residual of the equations
/// of motion (`c` is the ether drag), minus wall forces on them. In statics it is `sum dE/dx + dR/dv`,
/// with the velocities of the increment.
///
/// For a wall it is the mean over the last step: its impulse on the vertices it stopped, along its normal
/// alone, divided by the step size, `sum m (v' - v*) / h` plus a correction for drag. Times `h` and
/// summed over all steps, it is the change of momentum minus the impulse of all other forces; an impact
/// counts in its step. A subdivided step has the value of its last substep. With forward Euler, which
/// moves by old velocities, a resting vertex falls for one step before it is moved back: the force
/// alternates between twice the weight and zero. Before any step, after a manual change of the state, and
/// in statics, a wall carries `n . (dE/dx + dR/dv + c m v)` of each vertex that touches it and is
/// currently pressed against it.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Reaction {
    /// `body/pin`, or `wall0`, `wall1`, ... in the order of the scene.
    pub name: String,
    /// Force [N]; third component 0 in 2D.
    pub force: [f64; 3],
    /// Moment [N m] about `about`; in 2D only the third component.
    pub moment: [f64; 3],
    /// Centre of rotation of the pin, or else the current mean position of its vertices; for a wall the
    /// point nearest to the origin [m].
    pub about: [f64; 3],
}

/// Difference step, as a fraction of the time step: short compared with all resolved motion, long
/// compared with the rounding of velocities.
const SPAN: f64 = 1e-3;

/// State for which reactions are computed.
#[derive(Clone, Copy)]
pub(crate) struct ReactionInputs<'a> {
    /// Time [s].
    pub(crate) time: f64,
    /// Step size [s]; the next one to try if steps are adaptive.
    pub(crate) h: f64,
    /// Positions, flat [m].
    pub(crate) x: &'a [f64],
    /// Velocities, flat [m/s].
    pub(crate) v: &'a [f64],
    /// Velocities that dissipative terms see, flat [m/s].
    pub(crate) seen: &'a [f64],
    /// False in statics: accelerations and drag do not count.
    pub(crate) has_inertia: bool,
    /// Wall impulses of the last step, if known.
    pub(crate) last_step: Option<&'a WallImpulses>,
}

/// Computes the reactions of the pins and then of the walls; `system` holds the force at `x`.
/// Accelerations of prescribed motion are central differences of its exact velocities. A coordinate in
/// several pins counts for the first.
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

/// Accelerations of the prescribed coordinates [m/s^2]; `None` without prescribed motion.
fn accelerations(system: &System, time: f64, span: f64, x: &[f64], v: &[f64]) -> Option<Vec<f64>> {
    if !system.has_prescribed_motion() {
        return None;
    }
    let (mut scratch, mut before, mut after) = (x.to_vec(), v.to_vec(), v.to_vec());
    // A motion without a finite value is reported by the next step.
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
    // Reference point of the moment.
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
    // Sum of forces and moments over the constrained coordinates.
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
        let turn = crate::algebra::cross(&[0, 1, 2].map(|c| at[c] - about[c]), &f);
        for c in 0..3 {
            force[c] += f[c];
            moment[c] += turn[c];
        }
    });
    Reaction { name: hold.name().to_owned(), force, moment, about }
}
