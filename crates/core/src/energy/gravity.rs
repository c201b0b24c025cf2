//! Uniform gravity.

use super::{EnergyKind, EnergyTerm, Fault, ForceLayout, Measurements, TermProperties, TermViews};

/// Potential energy of uniform gravity: `E = -sum_i m_i g . x_i`, zero at the origin.
#[derive(Clone, Debug)]
pub struct UniformGravity {
    /// Acceleration [m/s^2], one component per dimension.
    acceleration: Vec<f64>,
    /// `-m_i` of every vertex [kg], pinned ones included: the pin carries their weight.
    negative_mass: Vec<f64>,
    /// True if gravity accelerates these masses, so that every vertex falls alike.
    accelerates: bool,
}

impl UniformGravity {
    /// Creates gravity `acceleration` [m/s^2] on vertices of these masses [kg].
    ///
    /// # Panics
    /// If `acceleration` has neither 2 nor 3 components.
    pub fn new(acceleration: &[f64], mass: &[f64]) -> Self {
        assert!(matches!(acceleration.len(), 2 | 3), "gravity in 2 or 3 dimensions");
        UniformGravity {
            acceleration: acceleration.to_vec(),
            negative_mass: mass.iter().map(|m| -m).collect(),
            accelerates: true,
        }
    }

    /// Creates gravity on weights [kg] that differ from the masses: a load, for statics. Weights may be
    /// zero or negative, like the consistent weights of second-order elements at corners.
    ///
    /// # Panics
    /// If `acceleration` has neither 2 nor 3 components.
    pub fn without_inertia(acceleration: &[f64], weight: &[f64]) -> Self {
        UniformGravity { accelerates: false, ..Self::new(acceleration, weight) }
    }
}

impl UniformGravity {
    /// Returns the acceleration [m/s^2], one component per dimension.
    pub(super) fn components(&self) -> &[f64] {
        &self.acceleration
    }

    /// Changes the acceleration [m/s^2].
    pub(super) fn set_acceleration(&mut self, acceleration: &[f64]) {
        self.acceleration.copy_from_slice(acceleration);
    }

    /// Returns the total mass [kg].
    pub(super) fn total_mass(&self) -> f64 {
        self.negative_mass.iter().map(|m| -m).sum()
    }
}

impl EnergyTerm for UniformGravity {
    fn name(&self) -> String {
        "uniform gravity".into()
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Gravitational)
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let rows = x.chunks_exact(self.acceleration.len());
        rows.zip(&self.negative_mass)
            .map(|(x, m)| m * x.iter().zip(&self.acceleration).map(|(x, g)| x * g).sum::<f64>())
            .sum()
    }

    fn evaluate(&mut self, _x: &[f64]) -> bool {
        true
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let masses = &self.negative_mass[first..];
        match self.acceleration[..] {
            [x, y] => add([x, y], masses, g),
            [x, y, z] => add([x, y, z], masses, g),
            _ => unreachable!("two or three components since `new`"),
        }
    }

    fn add_hessian_product(&mut self, _x: &[f64], _p: &[f64], _y: &mut [f64]) {}

    fn fault(&self, _x: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for UniformGravity {
    fn layout(&self) -> Option<&dyn ForceLayout> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl ForceLayout for UniformGravity {
    fn acceleration(&self) -> Option<&[f64]> {
        self.accelerates.then_some(&self.acceleration[..])
    }
}

impl Measurements for UniformGravity {
    /// Returns the energy scale `M |g| L`, with the size `L` of the scene: the origin of the potential is
    /// arbitrary.
    fn scale(&mut self, x: &[f64]) -> f64 {
        let g = self.acceleration.iter().map(|a| a * a).sum::<f64>().sqrt();
        self.total_mass() * g * crate::algebra::scene_size(x, self.acceleration.len())
    }
}

/// Adds `m a` to each row. The row length is known at compile time, which matters for short steps.
fn add<const D: usize>(acceleration: [f64; D], masses: &[f64], g: &mut [f64]) {
    for (g, m) in g.as_chunks_mut::<D>().0.iter_mut().zip(masses) {
        for c in 0..D {
            g[c] += m * acceleration[c];
        }
    }
}
