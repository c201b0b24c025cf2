//! Dead loads: their direction does not follow the deformation.

use super::{LoadedShape, VectorField, add_rows};
use crate::energy::{
    Driven, EnergyKind, EnergyTerm, Fault, LoadTerm, Measurements, TermProperties, TermViews,
};

/// Potential of dead loads (point loads, dead traction, body forces): `E = -sum_i f_i(t) . (x_i - X_i)`,
/// zero in the reference configuration. The force on a vertex is that of a field `f(X, t)` at sample
/// points of the reference configuration (quadrature points, or the vertices themselves), each of which
/// contributes to some vertices: `f_i = sum_s w_si f(X_s, t)`.
pub struct DeadLoad {
    name: String,
    dimension: usize,
    /// Ascending.
    vertices: Vec<u32>,
    /// Reference positions of `vertices`, flat [m].
    rest: Vec<f64>,
    samples: Vec<Sample>,
    /// Dependence on the reference configuration, if it is available.
    shape: Option<LoadedShape>,
    field: VectorField,
    changes: bool,
    time: f64,
    /// Force on each of `vertices` at `time`, flat [N].
    now: Vec<f64>,
    /// Forces of the last evaluation; empty if they do not change.
    held: Vec<f64>,
}

/// A point at which a field is sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Position in the reference configuration [m].
    pub point: [f64; 3],
    /// Index in the list of vertices, and the weight of the field's value for the vertex: 1 for a force,
    /// its fraction of an area [m^2] or a volume [m^3] for a density.
    pub shares: Vec<(u32, f64)>,
}

impl DeadLoad {
    /// Creates a load on `vertices`, ascending, of the whole system with the flat reference positions
    /// `rest` [m]; `changes` is true if `field` depends on time.
    pub fn new(
        name: String,
        dimension: usize,
        vertices: Vec<u32>,
        rest: &[f64],
        samples: Vec<Sample>,
        field: VectorField,
        changes: bool,
    ) -> Self {
        let rows = vertices.iter().flat_map(|v| &rest[*v as usize * dimension..][..dimension]);
        let rest: Vec<f64> = rows.copied().collect();
        let now = vec![0.0; rest.len()];
        let held = if changes { now.clone() } else { vec![] };
        let mut load = DeadLoad {
            name,
            dimension,
            vertices,
            rest,
            samples,
            shape: None,
            field,
            changes,
            time: 0.0,
            now,
            held,
        };
        load.sample(0.0);
        load
    }

    /// Adds the dependence on the reference configuration.
    #[must_use]
    pub fn with_shape(self, shape: LoadedShape) -> Self {
        DeadLoad { shape: Some(shape), ..self }
    }

    /// Samples the forces at the time `time` [s].
    fn sample(&mut self, time: f64) {
        let (d, DeadLoad { samples, field, now, .. }) = (self.dimension, self);
        now.fill(0.0);
        for Sample { point, shares } in &*samples {
            let force = field(*point, time);
            for (slot, share) in shares {
                for c in 0..d {
                    now[*slot as usize * d + c] += share * force[c];
                }
            }
        }
    }

    /// Returns component `c` of the displacement of a vertex of the load, by slot.
    fn displacement(&self, x: &[f64], slot: usize, c: usize) -> f64 {
        x[self.vertices[slot] as usize * self.dimension + c] - self.rest[slot * self.dimension + c]
    }
}

impl EnergyTerm for DeadLoad {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn properties(&self) -> TermProperties {
        TermProperties { changes_with_time: self.changes, ..TermProperties::of(EnergyKind::Load) }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let d = self.dimension;
        -(0..self.now.len()).map(|i| self.now[i] * self.displacement(x, i / d, i % d)).sum::<f64>()
    }

    fn evaluate(&mut self, _x: &[f64]) -> bool {
        self.held.copy_from_slice(if self.changes { &self.now } else { &[] });
        crate::algebra::all_finite(&self.now)
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let rows = if self.changes { &self.held } else { &self.now };
        add_rows(&self.vertices, rows, -1.0, first, g, self.dimension);
    }

    fn add_hessian_product(&mut self, _x: &[f64], _p: &[f64], _y: &mut [f64]) {}

    fn fault(&self, _x: &[f64]) -> Option<Fault> {
        let finite = crate::algebra::all_finite(&self.now);
        (!finite).then(|| Fault::Load { load: self.name.clone(), time: self.time })
    }
}

impl TermViews for DeadLoad {
    fn load(&self) -> Option<&dyn LoadTerm> {
        Some(self)
    }

    fn driven(&mut self) -> Option<&mut dyn Driven> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl Driven for DeadLoad {
    fn set_time(&mut self, time: f64) {
        if time != self.time {
            self.time = time;
            self.sample(time);
        }
    }

    /// Returns `sum_i f_i(t) . v_i`.
    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.work(x, v)
    }
}

impl LoadTerm for DeadLoad {
    fn components(&self) -> usize {
        self.dimension
    }

    fn work(&self, _x: &[f64], p: &[f64]) -> f64 {
        let rows = self.vertices.iter().flat_map(|i| &p[*i as usize * self.dimension..][..self.dimension]);
        self.now.iter().zip(rows).map(|(f, p)| f * p).sum()
    }

    fn add_unit_works(&self, _x: &[f64], p: &[f64], works: &mut [f64]) {
        for (slot, share) in self.samples.iter().flat_map(|sample| &sample.shares) {
            let row = &p[self.vertices[*slot as usize] as usize * self.dimension..];
            works.iter_mut().zip(row).for_each(|(work, p)| *work += share * p);
        }
    }

    fn add_force_of(&self, value: &dyn Fn([f64; 3], f64) -> [f64; 3], _x: &[f64], force: &mut [f64]) {
        for Sample { point, shares } in &self.samples {
            let value = value(*point, self.time);
            for (slot, share) in shares {
                let row = &mut force[self.vertices[*slot as usize] as usize * self.dimension..];
                row[..self.dimension].iter_mut().zip(value).for_each(|(f, value)| *f += share * value);
            }
        }
    }

    fn add_work_by_shape(&self, _x: &[f64], p: &[f64], rows: &mut [f64]) -> bool {
        self.shape.iter().for_each(|shape| shape.add_work(&self.field, self.time, p, rows));
        self.shape.is_some()
    }

    fn add_force_by_shape(&self, _x: &[f64], change: &[f64], force: &mut [f64]) -> bool {
        self.shape.iter().for_each(|shape| shape.add_force(&self.field, self.time, change, force));
        self.shape.is_some()
    }

    fn add_force(&self, _x: &[f64], force: &mut [f64]) {
        for (vertex, now) in self.vertices.iter().zip(self.now.chunks_exact(self.dimension)) {
            let row = &mut force[*vertex as usize * self.dimension..][..self.dimension];
            row.iter_mut().zip(now).for_each(|(f, now)| *f += now);
        }
    }
}

impl Measurements for DeadLoad {
    /// Returns the sum of all force magnitudes times the size of the scene.
    fn scale(&mut self, x: &[f64]) -> f64 {
        let lengths =
            self.now.chunks_exact(self.dimension).map(|f| f.iter().map(|c| c * c).sum::<f64>().sqrt());
        lengths.sum::<f64>() * crate::algebra::scene_size(x, self.dimension)
    }
}
