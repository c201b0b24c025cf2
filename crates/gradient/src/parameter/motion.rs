//! Parameters of prescribed motion.

use pliant::system::System;
use pliant_scene::OverTime;

use super::{ForceUse, HeldChange, HeldUse, ModeUse, Parameter, ParameterNeeds};

/// True if the constraint with this name has not been released.
fn acts(system: &System, name: &str) -> bool {
    system.constraints().iter().any(|hold| hold.name() == name)
}

/// Factor of the prescribed motion of a pin, 1 in the scene: positions `x(0) + f u(t)`, velocities `f
/// u'(t)`.
#[derive(Clone, Debug)]
pub struct MotionFactor {
    hold: String,
    /// Moved coordinates with their positions without motion [m], once looked up.
    starts: Option<Vec<(usize, f64)>>,
}

impl MotionFactor {
    /// Factor for the [constraint](pliant::constraint::Hold) with this name.
    pub fn new(hold: String) -> Self {
        MotionFactor { hold, starts: None }
    }

    /// Moved coordinates with their start positions; empty after the release.
    fn starts(&mut self, system: &System) -> &[(usize, f64)] {
        if !acts(system, &self.hold) {
            return &[];
        }
        self.starts.get_or_insert_with(|| {
            let (d, n) = (system.dimension(), system.inverse_mass().len());
            let (mut x, mut v) = (vec![0.0; n], vec![0.0; n]);
            // All motion starts from these positions.
            system.prescribe(0.0, &mut x, &mut v);
            let holds = system.constraints().iter().filter(|hold| hold.name() == self.hold);
            holds.flat_map(|hold| hold.coordinates(d)).map(|i| (i, x[i])).collect()
        })
    }
}

impl Parameter for MotionFactor {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { held: true, ..ParameterNeeds::default() }
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (i, start) in self.starts(of.system) {
            derivative[0] -= of.by_positions[*i] * (of.x[*i] - start) + of.by_velocities[*i] * of.v[*i];
        }
    }

    /// Adds nothing: forces depend on the factor through positions and velocities only.
    fn add_change(&mut self, _: &ForceUse<'_>, _: &[f64], _: &mut [f64]) -> bool {
        true
    }

    fn add_held_change(&mut self, system: &System, time: f64, change: &[f64], place: HeldChange<'_>) {
        let n = place.x.len();
        let (mut x, mut v) = (vec![0.0; n], vec![0.0; n]);
        system.prescribe(time, &mut x, &mut v);
        for (i, start) in self.starts(system) {
            place.x[*i] += change[0] * (x[*i] - start);
            place.v[*i] += change[0] * v[*i];
        }
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        for (i, start) in self.starts(of.system) {
            derivative[0] += of.x_bar[*i] * (of.x[*i] - start) + of.v_bar[*i] * of.v[*i];
        }
    }
}

/// Reference positions of a body's vertices, on which the prescribed displacement of a pin depends: a
/// fixed coordinate is at `x(0) + u(X, t)` and has the velocity `du/dt`; its start `x(0)` does not
/// change.
#[derive(Clone, Debug)]
pub struct MotionShape {
    hold: String,
    /// Components of the displacement [m].
    formulas: Vec<OverTime>,
    /// Indices of the body's vertices in the simulation.
    vertices: Vec<u32>,
    /// Reference positions of all vertices, flat, in the order of the simulation [m].
    rest: Vec<f64>,
    /// Fixed coordinates with the indices of their vertices in the body, once looked up.
    coordinates: Option<Vec<(usize, usize)>>,
}

impl MotionShape {
    /// Shape parameter for the displacement of the [constraint](pliant::constraint::Hold) `hold`, on a
    /// body with these vertices, by index in the simulation; `rest`, flat, are the reference positions of
    /// all vertices, likewise [m].
    pub fn new(hold: String, formulas: Vec<OverTime>, vertices: Vec<u32>, rest: Vec<f64>) -> Self {
        MotionShape { hold, formulas, vertices, rest, coordinates: None }
    }

    /// Calls `visit` with the fixed coordinates, the indices of the reference position of their vertex,
    /// and the gradients of their positions and velocities.
    fn each(
        &mut self,
        system: &System,
        time: f64,
        mut visit: impl FnMut(usize, std::ops::Range<usize>, [[f64; 3]; 2]),
    ) {
        let MotionShape { hold, formulas, vertices, rest, coordinates } = self;
        if !acts(system, hold) {
            return;
        }
        let d = system.dimension();
        let coordinates = coordinates.get_or_insert_with(|| {
            let holds = system.constraints().iter().filter(|held| held.name() == *hold);
            let mut numbers = vec![None; rest.len() / d];
            (0..).zip(&*vertices).for_each(|(number, vertex)| numbers[*vertex as usize] = Some(number));
            let of_body = |i: usize| Some((i, numbers[i / d]?));
            holds.flat_map(|held| held.coordinates(d)).filter_map(of_body).collect()
        });
        for (i, number) in coordinates {
            let mut place = [0.0; 3];
            place[..d].copy_from_slice(&rest[*i / d * d..][..d]);
            let formula = &formulas[*i % d];
            let slopes = [formula.slope(place, time), formula.rate_slope(place, time)];
            visit(*i, *number * d..(*number + 1) * d, slopes);
        }
    }

    /// Adds to the derivatives the sum over fixed coordinates of those by position and by velocity,
    /// `by(i)`, times the gradients of these.
    fn add_by(&mut self, system: &System, time: f64, by: impl Fn(usize) -> [f64; 2], derivative: &mut [f64]) {
        self.each(system, time, |i, numbers, [place, velocity]| {
            let [by_place, by_velocity] = by(i);
            for (k, derivative) in derivative[numbers].iter_mut().enumerate() {
                *derivative += by_place * place[k] + by_velocity * velocity[k];
            }
        });
    }
}

impl Parameter for MotionShape {
    fn len(&self) -> usize {
        self.vertices.len() * self.formulas.len()
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { held: true, ..ParameterNeeds::default() }
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        self.add_by(of.system, of.time, |i| [-of.by_positions[i], -of.by_velocities[i]], derivative);
    }

    /// Adds nothing: forces depend on the shape through positions and velocities only.
    fn add_change(&mut self, _: &ForceUse<'_>, _: &[f64], _: &mut [f64]) -> bool {
        true
    }

    /// Adds nothing: fixed coordinates have no part in a mode.
    fn add_mode(&mut self, _: &ModeUse<'_>, _: &mut [f64]) -> bool {
        true
    }

    fn add_held_change(&mut self, system: &System, time: f64, change: &[f64], place: HeldChange<'_>) {
        self.each(system, time, |i, numbers, [by_place, by_velocity]| {
            for (k, change) in change[numbers].iter().enumerate() {
                place.x[i] += change * by_place[k];
                place.v[i] += change * by_velocity[k];
            }
        });
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        self.add_by(of.system, of.time, |i| [of.x_bar[i], of.v_bar[i]], derivative);
    }
}

/// Parameter of the formulas of a pin's prescribed displacement, named after `where`; common to all
/// components that use it. A fixed coordinate is at `x(0) + u(X, t)` and has the velocity `du/dt`:
/// derivatives by `A` use `du/dA` and `d2u/dt dA`.
#[derive(Clone, Debug)]
pub struct MotionNumber {
    hold: String,
    /// Components of the displacement [m].
    formulas: Vec<OverTime>,
    name: String,
    /// Reference positions of all vertices, flat, in the order of the simulation [m].
    rest: Vec<f64>,
    /// Fixed coordinates, once looked up.
    coordinates: Option<Vec<usize>>,
}

impl MotionNumber {
    /// Parameter with this name in the components of the displacement of the
    /// [constraint](pliant::constraint::Hold) `hold`; `rest`, flat, are the reference positions of all
    /// vertices, in the order of the simulation [m].
    pub fn new(hold: String, formulas: Vec<OverTime>, name: String, rest: Vec<f64>) -> Self {
        MotionNumber { hold, formulas, name, rest, coordinates: None }
    }

    /// Calls `visit` with the fixed coordinates and the derivatives of their positions and velocities by
    /// the parameter.
    fn each(&mut self, system: &System, time: f64, mut visit: impl FnMut(usize, [f64; 2])) {
        let MotionNumber { hold, formulas, name, rest, coordinates } = self;
        if !acts(system, hold) {
            return;
        }
        let d = system.dimension();
        let coordinates = coordinates.get_or_insert_with(|| {
            let holds = system.constraints().iter().filter(|held| held.name() == *hold);
            holds.flat_map(|held| held.coordinates(d)).collect()
        });
        for i in coordinates {
            let (vertex, axis) = (*i / d, *i % d);
            let mut place = [0.0; 3];
            place[..d].copy_from_slice(&rest[vertex * d..][..d]);
            let formula = &formulas[axis];
            visit(*i, [formula.derivative(name, place, time), formula.rate_derivative(name, place, time)]);
        }
    }

    /// Sum over fixed coordinates of the derivatives by position and by velocity, `by(i)`, times those of
    /// position and velocity by the parameter.
    fn sum(&mut self, system: &System, time: f64, by: impl Fn(usize) -> [f64; 2]) -> f64 {
        let mut sum = 0.0;
        self.each(system, time, |i, [place, velocity]| {
            let [by_place, by_velocity] = by(i);
            sum += by_place * place + by_velocity * velocity;
        });
        sum
    }
}

impl Parameter for MotionNumber {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { held: true, ..ParameterNeeds::default() }
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        derivative[0] -= self.sum(of.system, of.time, |i| [of.by_positions[i], of.by_velocities[i]]);
    }

    /// Adds nothing: forces depend on the parameter through positions and velocities only.
    fn add_change(&mut self, _: &ForceUse<'_>, _: &[f64], _: &mut [f64]) -> bool {
        true
    }

    fn add_held_change(&mut self, system: &System, time: f64, change: &[f64], place: HeldChange<'_>) {
        self.each(system, time, |i, [by_place, by_velocity]| {
            place.x[i] += change[0] * by_place;
            place.v[i] += change[0] * by_velocity;
        });
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        derivative[0] += self.sum(of.system, of.time, |i| [of.x_bar[i], of.v_bar[i]]);
    }
}
