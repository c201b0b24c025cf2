//! Parameters of springs.

use super::{ForceUse, ModeUse, Parameter};

/// Spring with the energy `E = 1/2 k (l - l0)^2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TunedSpring {
    /// Ends, by index in the simulation.
    pub ends: [u32; 2],
    /// Stiffness `k` [N/m].
    pub stiffness: f64,
    /// Rest length `l0` [m].
    pub rest_length: f64,
}

impl TunedSpring {
    /// Length `l` [m], and its rate along `p`, `(p_1 - p_2) . (x_1 - x_2) / l`. A spring of length zero
    /// has no direction, and rate zero.
    fn stretch(&self, (x, p): (&[f64], &[f64]), d: usize) -> (f64, f64) {
        let [a, b] = self.ends.map(|end| end as usize * d);
        let (mut squared, mut along) = (0.0, 0.0);
        for c in 0..d {
            let difference = x[a + c] - x[b + c];
            squared += difference * difference;
            along += (p[a + c] - p[b + c]) * difference;
        }
        let length = f64::sqrt(squared);
        (length, if length > 0.0 { along / length } else { 0.0 })
    }
}

/// Adds tensions of springs, one for each; a positive one draws its ends together [N].
fn add_tensions(
    springs: &[TunedSpring],
    of: &ForceUse<'_>,
    tension: impl Fn(usize, f64) -> f64,
    force: &mut [f64],
) {
    let d = of.system.dimension();
    for (i, spring) in springs.iter().enumerate() {
        let [a, b] = spring.ends.map(|end| end as usize * d);
        let apart = |c: usize| of.x[a + c] - of.x[b + c];
        let length = (0..d).map(|c| apart(c) * apart(c)).sum::<f64>().sqrt();
        if length > 0.0 {
            let pull = tension(i, length) / length;
            (0..d).for_each(|c| {
                force[a + c] -= pull * apart(c);
                force[b + c] += pull * apart(c);
            });
        }
    }
}

/// Stiffness `k` of each of the springs [N/m].
#[derive(Clone, Debug)]
pub struct SpringStiffness {
    springs: Vec<TunedSpring>,
    /// Parallel dashpots `beta k`, with `beta` [s].
    beta: f64,
}

impl SpringStiffness {
    /// Stiffness of these springs.
    pub fn new(springs: Vec<TunedSpring>) -> Self {
        SpringStiffness { springs, beta: 0.0 }
    }

    /// Adds parallel dashpots `beta k` to the springs, `beta` [s].
    #[must_use]
    pub fn damped(self, beta: f64) -> Self {
        SpringStiffness { beta, ..self }
    }
}

impl Parameter for SpringStiffness {
    fn len(&self) -> usize {
        self.springs.len()
    }

    /// Springs at their rest length have no transverse stiffness.
    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        for (derivative, spring) in derivative.iter_mut().zip(&self.springs) {
            *derivative += spring.stretch((of.x, of.shape), of.system.dimension()).1.powi(2);
        }
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let d = of.system.dimension();
        let tension = |i: usize, length: f64| {
            let rate = self.springs[i].stretch((of.x, of.v), d).1;
            change[i] * (length - self.springs[i].rest_length + self.beta * rate)
        };
        add_tensions(&self.springs, of, tension, force);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (derivative, spring) in derivative.iter_mut().zip(&self.springs) {
            let (length, growth) = spring.stretch((of.x, of.p), of.system.dimension());
            let rate = spring.stretch((of.x, of.v), of.system.dimension()).1;
            *derivative -= (length - spring.rest_length + self.beta * rate) * growth;
        }
    }
}

/// Rest length `l0` of each of the springs [m].
#[derive(Clone, Debug)]
pub struct RestLengths {
    springs: Vec<TunedSpring>,
}

impl RestLengths {
    /// Rest lengths of these springs.
    pub fn new(springs: Vec<TunedSpring>) -> Self {
        RestLengths { springs }
    }
}

impl Parameter for RestLengths {
    fn len(&self) -> usize {
        self.springs.len()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        add_tensions(&self.springs, of, |i, _| -self.springs[i].stiffness * change[i], force);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (derivative, spring) in derivative.iter_mut().zip(&self.springs) {
            *derivative += spring.stiffness * spring.stretch((of.x, of.p), of.system.dimension()).1;
        }
    }
}
