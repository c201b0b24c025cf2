//! Uniform gravity that depends on time.

use super::gravity::UniformGravity;
use super::{Driven, EnergyKind, EnergyTerm, Fault, ForceLayout, Measurements, TermProperties, TermViews};

/// Potential energy of time-dependent gravity: `E = -sum_i m_i g(t) . x_i`, zero at the origin.
///
/// Energy is not conserved: it changes at the rate `dE/dt = -sum_i m_i g'(t) . x_i`.
pub struct GravityOverTime {
    acceleration: Box<dyn Fn(f64) -> [f64; 3] + Send + Sync>,
    /// Largest expected `|g|` [m/s^2].
    largest: f64,
    time: f64,
    /// Gravity at `time` [m/s^2], with which energies are measured.
    now: [f64; 3],
    /// Field with the gravity of the last force evaluation.
    field: UniformGravity,
}

impl GravityOverTime {
    /// Creates gravity `acceleration(t)` [m/s^2], third component 0 in 2D, on the vertices of `field`,
    /// whose own acceleration is ignored; `largest` [m/s^2] is the largest expected magnitude.
    pub fn new(
        acceleration: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static,
        largest: f64,
        field: UniformGravity,
    ) -> Self {
        let now = acceleration(0.0);
        GravityOverTime { acceleration: Box::new(acceleration), largest, time: 0.0, now, field }
    }

    fn dimension(&self) -> usize {
        self.field.components().len()
    }
}

impl EnergyTerm for GravityOverTime {
    fn name(&self) -> String {
        "uniform gravity that changes with time".into()
    }

    fn properties(&self) -> TermProperties {
        TermProperties { changes_with_time: true, ..TermProperties::of(EnergyKind::Gravitational) }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let d = self.dimension();
        let mut held = [0.0; 3];
        held[..d].copy_from_slice(self.field.components());
        self.field.set_acceleration(&self.now[..d]);
        let energy = self.field.energy(x);
        self.field.set_acceleration(&held[..d]);
        energy
    }

    fn evaluate(&mut self, _x: &[f64]) -> bool {
        let d = self.dimension();
        self.field.set_acceleration(&self.now[..d]);
        self.now.iter().all(|g| g.is_finite())
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.field.add_rows(first, g);
    }

    fn add_hessian_product(&mut self, _x: &[f64], _p: &[f64], _y: &mut [f64]) {}

    fn fault(&self, _x: &[f64]) -> Option<Fault> {
        let finite = self.now.iter().all(|g| g.is_finite());
        (!finite).then_some(Fault::Gravity { time: self.time })
    }
}

impl TermViews for GravityOverTime {
    fn layout(&self) -> Option<&dyn ForceLayout> {
        Some(self)
    }

    fn driven(&mut self) -> Option<&mut dyn Driven> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl ForceLayout for GravityOverTime {
    fn acceleration(&self) -> Option<&[f64]> {
        self.field.acceleration()
    }
}

impl Driven for GravityOverTime {
    fn set_time(&mut self, time: f64) {
        self.time = time;
        self.now = (self.acceleration)(time);
    }

    /// Returns `sum_i m_i g(t) . v_i`.
    fn power(&mut self, _x: &[f64], v: &[f64]) -> f64 {
        // Minus the energy, with velocities in place of positions.
        -self.energy(v)
    }
}

impl Measurements for GravityOverTime {
    /// Uses the largest gravity, because it may begin at zero.
    fn scale(&mut self, x: &[f64]) -> f64 {
        self.field.total_mass() * self.largest * crate::algebra::scene_size(x, self.dimension())
    }
}
