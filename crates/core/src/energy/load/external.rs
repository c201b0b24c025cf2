//! External forces that are set while a simulation runs: by a controller, a user, or another program.

use crate::algebra::all_finite;
use crate::energy::{Driven, EnergyKind, EnergyTerm, Fault, Measurements, TermProperties, TermViews};
use crate::numbering::Numbering;

/// A function of the time [s] and the positions, flat [m], that writes forces, flat [N]; returns false if it
/// fails.
pub type ForceFunction = Box<dyn FnMut(f64, &[f64], &mut [f64]) -> bool + Send + Sync>;

/// Forces on all vertices, flat `(n, dimension)`, vertices in the order of the scene [N].
pub enum ExternalForce {
    /// Constant forces until they are set again.
    Constant(Vec<f64>),
    /// A function, called at every evaluation of the force.
    Function(ForceFunction),
}

/// [`ExternalForce`] as a term: a force without a potential, whose work is external.
///
/// The derivative is unknown and omitted from Newton's method, which converges more slowly if a force
/// depends strongly on positions.
pub struct ExternalForces {
    name: String,
    dimension: usize,
    numbering: Numbering,
    force: ExternalForce,
    time: f64,
    /// Force of the last evaluation, vertices in the order of the simulation.
    now: Vec<f64>,
}

impl ExternalForces {
    /// Applies `force` to the `vertices` vertices of a simulation that has them in this order.
    ///
    /// # Panics
    /// If the number of constant forces differs from the number of coordinates.
    pub fn new(
        name: &str,
        dimension: usize,
        vertices: usize,
        numbering: Numbering,
        force: ExternalForce,
    ) -> Self {
        let now = match &force {
            ExternalForce::Constant(force) => {
                assert_eq!(force.len(), vertices * dimension, "one row of components per vertex");
                numbering.to_internal(force, dimension).into_owned()
            }
            ExternalForce::Function(_) => vec![0.0; vertices * dimension],
        };
        ExternalForces { name: name.into(), dimension, numbering, force, time: 0.0, now }
    }
}

impl EnergyTerm for ExternalForces {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn properties(&self) -> TermProperties {
        TermProperties {
            changes_with_time: matches!(self.force, ExternalForce::Function(_)),
            is_conservative: false,
            ..TermProperties::of(EnergyKind::Load)
        }
    }

    /// Returns zero: there is no potential.
    fn energy(&mut self, _x: &[f64]) -> f64 {
        0.0
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let ExternalForces { dimension, numbering, force, time, now, .. } = self;
        let ExternalForce::Function(function) = force else { return all_finite(now) };
        let done = if numbering.is_identity() {
            function(*time, x, now)
        } else {
            let mut rows = vec![0.0; now.len()];
            let done = function(*time, &numbering.to_original(x, *dimension), &mut rows);
            now.copy_from_slice(&numbering.to_internal(&rows, *dimension));
            done
        };
        if !done {
            now.fill(f64::NAN);
        }
        all_finite(now)
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let rows = &self.now[first * self.dimension..];
        g.iter_mut().zip(rows).for_each(|(g, f)| *g -= f);
    }

    fn add_hessian_product(&mut self, _x: &[f64], _p: &[f64], _y: &mut [f64]) {}

    fn fault(&self, _x: &[f64]) -> Option<Fault> {
        (!all_finite(&self.now)).then(|| Fault::Load { load: self.name.clone(), time: self.time })
    }
}

impl TermViews for ExternalForces {
    fn driven(&mut self) -> Option<&mut dyn Driven> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl Driven for ExternalForces {
    fn set_time(&mut self, time: f64) {
        self.time = time;
    }

    /// Returns `sum_i f_i . v_i` of the last evaluated force.
    fn power(&mut self, _x: &[f64], v: &[f64]) -> f64 {
        self.now.iter().zip(v).map(|(f, v)| f * v).sum()
    }
}

impl Measurements for ExternalForces {
    /// Returns the sum of all force magnitudes times the size of the scene.
    fn scale(&mut self, x: &[f64]) -> f64 {
        let rows = self.now.chunks_exact(self.dimension);
        let lengths = rows.map(|f| f.iter().map(|c| c * c).sum::<f64>().sqrt());
        lengths.sum::<f64>() * crate::algebra::scene_size(x, self.dimension)
    }
}
