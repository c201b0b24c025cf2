//! Energy flows into and out of the system.

use super::System;
use crate::energy::{EnergyKind, EnergyTerm};

/// Current energy flows except prescribed motion [W]: the power of time-dependent loads and gravity, and
/// the losses; zero if a scene has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Powers {
    pub(crate) loads: f64,
    pub(crate) gravity: f64,
    pub(crate) ether_drag: f64,
    pub(crate) damping: f64,
    pub(crate) friction: f64,
}

/// Selection of flows to compute.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct PowerSelection {
    pub(crate) loads: bool,
    pub(crate) gravity: bool,
    pub(crate) losses: bool,
}

impl PowerSelection {
    pub(crate) const ALL: PowerSelection = PowerSelection { loads: true, gravity: true, losses: true };
}

/// True if the term is gravity that supplies energy from outside its own potential.
pub(crate) fn is_changing_gravity(term: &dyn EnergyTerm) -> bool {
    let term = term.properties();
    term.kind == EnergyKind::Gravitational && term.supplies()
}

/// True if the term supplies energy from outside its own potential and is not gravity.
pub(crate) fn feeds(term: &dyn EnergyTerm) -> bool {
    let term = term.properties();
    term.kind != EnergyKind::Gravitational && term.supplies()
}

impl Powers {
    /// Computes the flows at `x`, `v` and the time last set. Overwrites the last dissipative force.
    pub(crate) fn of(system: &mut System, looked: PowerSelection, x: &[f64], v: &[f64]) -> Self {
        let mut flows = Powers::default();
        if looked.loads {
            flows.loads = system.power(feeds, x, v);
        }
        if looked.gravity {
            flows.gravity = system.power(is_changing_gravity, x, v);
        }
        if looked.losses && system.ether_drag() != 0.0 {
            flows.ether_drag = 2.0 * system.ether_drag() * system.kinetic(v);
        }
        if looked.losses && system.is_damped() {
            [flows.damping, flows.friction] = system.dissipated_powers(x, v);
        }
        if looked.losses && system.remembers() {
            flows.damping += system.forgotten_power(x);
        }
        flows
    }

    /// Computes the work of forces at `x` along the displacement `way` [J] instead of powers: those of
    /// loads and gravity, with the given losses.
    pub(crate) fn along(
        system: &mut System,
        x: &[f64],
        way: &[f64],
        ether_drag: f64,
        [damping, friction]: [f64; 2],
    ) -> Self {
        Powers {
            loads: system.power(feeds, x, way),
            gravity: system.power(is_changing_gravity, x, way),
            ether_drag,
            damping,
            friction,
        }
    }
}

/// Returns the power of prescribed motion at `x` and `v` [W], without the rate of its kinetic energy, and
/// this kinetic energy [J]. `system` must hold the force at `x`.
pub(crate) fn power_of_motion(system: &mut System, x: &[f64], v: &[f64]) -> (f64, f64) {
    let (mut power, mut kinetic) = (0.0, 0.0);
    let (d, drag) = (system.dimension(), system.ether_drag());
    if system.has_prescribed_motion() && system.is_damped() {
        // Moving coordinates carry their part of the dissipative forces.
        system.evaluate_dissipation(x, v);
    }
    for hold in system.constraints().iter().filter(|hold| hold.moves()) {
        let axes = hold.axes();
        system.visit_gradient(hold.vertices(), |vertex, gradient| {
            let m = system.mass()[vertex];
            for c in (0..d).filter(|c| axes[*c]) {
                let v = v[vertex * d + c];
                power += (gradient[c] + drag * m * v) * v;
                kinetic += 0.5 * m * v * v;
            }
        });
    }
    (power, kinetic)
}
