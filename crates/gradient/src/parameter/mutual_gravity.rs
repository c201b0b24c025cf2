//! Parameters of mutual gravity.

use super::{ForceUse, Parameter};

/// Masses as sources of mutual gravity between all pairs [kg]. The derivative of `p . dE/dx` by `m_k` is
/// `sum_i m_i (p_i - p_k) . g_ik`, `g_ik = G (x_i - x_k) / (|x_i - x_k|^2 + softening^2)^(3/2)`. For
/// inertia see [`Masses`](super::Masses).
#[derive(Clone, Debug)]
pub struct AttractingMasses {
    /// Vertices whose masses are the parameters.
    numbers: Vec<u32>,
    /// All attracting vertices.
    vertices: Vec<u32>,
    constant: f64,
    softening: f64,
}

impl AttractingMasses {
    /// Masses of the vertices `numbers`, a subset of the `vertices` that attract each other with the
    /// gravitational `constant` [m^3/(kg s^2)] and this `softening` [m].
    pub fn new(numbers: Vec<u32>, vertices: Vec<u32>, constant: f64, softening: f64) -> Self {
        AttractingMasses { numbers, vertices, constant, softening }
    }

    /// Calls `visit(number, i, k, m_i g_ik)` with the coordinates of every attracting vertex `i` and
    /// every other vertex `k` whose mass is a parameter.
    fn each(&self, of: &ForceUse<'_>, mut visit: impl FnMut(usize, usize, usize, [f64; 3])) {
        let d = of.system.dimension();
        for (number, k) in self.numbers.iter().enumerate() {
            for i in self.vertices.iter().filter(|i| *i != k) {
                let (row, other) = (*i as usize * d, *k as usize * d);
                let mut apart = [0.0; 3];
                (0..d).for_each(|c| apart[c] = of.x[row + c] - of.x[other + c]);
                let square = apart.iter().map(|a| a * a).sum::<f64>() + self.softening * self.softening;
                let factor = of.system.mass()[*i as usize] * self.constant / (square * square.sqrt());
                visit(number, row, other, apart.map(|a| factor * a));
            }
        }
    }
}

impl Parameter for AttractingMasses {
    fn len(&self) -> usize {
        self.numbers.len()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let d = of.system.dimension();
        self.each(of, |number, row, other, pull| {
            for c in 0..d {
                force[row + c] -= change[number] * pull[c];
                force[other + c] += change[number] * pull[c];
            }
        });
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let d = of.system.dimension();
        self.each(of, |number, row, other, pull| {
            derivative[number] -= (0..d).map(|c| (of.p[row + c] - of.p[other + c]) * pull[c]).sum::<f64>();
        });
    }
}

/// Plummer softening `s` [m] of mutual gravity. The derivative of `p . dE/dx` by it is `-3 s G sum_{i<k}
/// m_i m_k (p_i - p_k) . (x_i - x_k) / (|x_i - x_k|^2 + s^2)^(5/2)`.
#[derive(Clone, Debug)]
pub struct Softening {
    /// All attracting vertices.
    vertices: Vec<u32>,
    constant: f64,
    softening: f64,
}

impl Softening {
    /// Softening of the `vertices` that attract each other with the gravitational `constant` [m^3/(kg
    /// s^2)] and this `softening` [m].
    pub fn new(vertices: Vec<u32>, constant: f64, softening: f64) -> Self {
        Softening { vertices, constant, softening }
    }

    /// Calls `visit(i, k, f)` with the coordinates of each pair and the derivative `f` of the force on
    /// `i`.
    fn each(&self, of: &ForceUse<'_>, mut visit: impl FnMut(usize, usize, [f64; 3])) {
        let (d, mass) = (of.system.dimension(), of.system.mass());
        for (n, i) in self.vertices.iter().enumerate() {
            for k in &self.vertices[..n] {
                let (row, other) = (*i as usize * d, *k as usize * d);
                let mut apart = [0.0; 3];
                (0..d).for_each(|c| apart[c] = of.x[row + c] - of.x[other + c]);
                let square = apart.iter().map(|a| a * a).sum::<f64>() + self.softening * self.softening;
                let both = mass[*i as usize] * mass[*k as usize];
                let factor = 3.0 * self.softening * self.constant * both / (square * square * square.sqrt());
                visit(row, other, apart.map(|a| factor * a));
            }
        }
    }
}

impl Parameter for Softening {
    fn len(&self) -> usize {
        1
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let d = of.system.dimension();
        self.each(of, |row, other, by| {
            for c in 0..d {
                force[row + c] += change[0] * by[c];
                force[other + c] -= change[0] * by[c];
            }
        });
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let d = of.system.dimension();
        self.each(of, |row, other, by| {
            derivative[0] += (0..d).map(|c| (of.p[row + c] - of.p[other + c]) * by[c]).sum::<f64>();
        });
    }
}
