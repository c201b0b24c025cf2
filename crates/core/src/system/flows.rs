//! Energy that flows into the equations and out of them.

use super::System;
use crate::energy::{EnergyKind, EnergyTerm};

/// Energy that flows at each moment, other than by prescribed motion [W]: the power of the forces of loads
/// and gravity that change with time, and what is lost; zero where a scene has no such thing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Powers {
    pub(crate) loads: f64,
    pub(crate) gravity: f64,
    pub(crate) ether_drag: f64,
    pub(crate) damping: f64,
    pub(crate) friction: f64,
}

/// Which flows are looked at.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct PowerSelection {
    pub(crate) loads: bool,
    pub(crate) gravity: bool,
    pub(crate) losses: bool,
}

impl PowerSelection {
    pub(crate) const ALL: PowerSelection = PowerSelection { loads: true, gravity: true, losses: true };
}

/// True if energy comes in through this term otherwise than from its own store, and it is gravity.
pub(crate) fn is_changing_gravity(term: &dyn EnergyTerm) -> bool {
    let term = term.properties();
    term.kind == EnergyKind::Gravitational && term.supplies()
}

/// The same, and it is not.
pub(crate) fn feeds(term: &dyn EnergyTerm) -> bool {
    let term = term.properties();
    term.kind != EnergyKind::Gravitational && term.supplies()
}

impl Powers {
    /// Of the state `x`, `v`, at the time last said. The dissipative force last evaluated is lost.
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

    /// Work of forces at `x` along the `way` [J], not at a rate: those of loads and gravity, and what was
    /// dragged, and damped and rubbed.
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

/// The power of prescribed motion at `x`, at which `system` holds the force, and `v` [W], but for what it
/// gives to the kinetic energy of what moves; and that [J].
pub(crate) fn power_of_motion(system: &mut System, x: &[f64], v: &[f64]) -> (f64, f64) {
    let (mut power, mut kinetic) = (0.0, 0.0);
    let (d, drag) = (system.dimension(), system.ether_drag());
    if system.has_prescribed_motion() && system.is_damped() {
        // What moves carries its part of these forces, as they are now.
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
