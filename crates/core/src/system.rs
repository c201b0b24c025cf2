//! The equations of motion `M x'' = -dE/dx`: masses, energy terms, constraints.

use crate::constraint::Wall;
use crate::energy::{DeformationExtremes, EnergyKind, EnergyTerm, Fault};

/// Masses, energies and constraints of all bodies together. Generic types end here: terms are boxed.
pub struct System {
    dimension: usize,
    mass: Vec<f64>,
    /// `1 / m`, zero where pinned.
    inverse_mass: Vec<f64>,
    terms: Vec<Box<dyn EnergyTerm>>,
    walls: Vec<Wall>,
    ether_drag: f64,
    gradient: Vec<f64>,
    force_evaluations: u64,
}

impl System {
    /// A system of free vertices of these masses [kg] in `dimension` dimensions, without forces.
    pub fn new(dimension: usize, mass: Vec<f64>) -> Self {
        System {
            inverse_mass: mass.iter().map(|m| 1.0 / m).collect(),
            gradient: vec![0.0; mass.len() * dimension],
            dimension,
            mass,
            terms: vec![],
            walls: vec![],
            ether_drag: 0.0,
            force_evaluations: 0,
        }
    }

    /// Adds a potential.
    pub fn add_term(&mut self, term: Box<dyn EnergyTerm>) {
        self.terms.push(term);
    }

    /// Adds a wall.
    pub fn add_wall(&mut self, wall: Wall) {
        self.walls.push(wall);
    }

    /// Holds these vertices where they are.
    pub fn pin(&mut self, vertices: &[u32]) {
        for &v in vertices {
            self.inverse_mass[v as usize] = 0.0;
        }
    }

    /// Sets the ether drag [1/s]: velocities decay as `exp(-ether_drag t)`.
    pub fn set_ether_drag(&mut self, ether_drag: f64) {
        self.ether_drag = ether_drag;
    }

    /// 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Lumped mass of every vertex [kg].
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// `1 / m` of every vertex [1/kg], zero where pinned.
    pub fn inverse_mass(&self) -> &[f64] {
        &self.inverse_mass
    }

    /// Whether vertex `i` is pinned.
    pub fn is_pinned(&self, i: usize) -> bool {
        self.inverse_mass[i] == 0.0
    }

    /// The potentials.
    pub fn terms(&self) -> &[Box<dyn EnergyTerm>] {
        &self.terms
    }

    /// The walls.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// Ether drag [1/s].
    pub fn ether_drag(&self) -> f64 {
        self.ether_drag
    }

    /// Evaluations of the total force so far.
    pub fn force_evaluations(&self) -> u64 {
        self.force_evaluations
    }

    /// Potential energy of one kind [J].
    pub fn potential(&mut self, kind: EnergyKind, x: &[f64]) -> f64 {
        self.terms.iter_mut().filter(|t| t.kind() == kind).map(|t| t.energy(x)).sum()
    }

    /// Sum of what each term can be expected to turn over from `x` on [J].
    pub fn potential_scale(&mut self, x: &[f64]) -> f64 {
        self.terms.iter_mut().map(|t| t.scale(x)).sum()
    }

    /// Kinetic energy `sum 1/2 m |v|^2` [J].
    pub fn kinetic(&self, v: &[f64]) -> f64 {
        let speeds = v.chunks_exact(self.dimension).map(|v| v.iter().map(|c| c * c).sum::<f64>());
        speeds.zip(&self.mass).map(|(v2, m)| 0.5 * m * v2).sum()
    }

    /// `a = -M^-1 dE/dx` [m/s^2], zero at pinned vertices.
    pub fn acceleration(&mut self, x: &[f64], a: &mut [f64]) {
        self.gradient.fill(0.0);
        for term in &mut self.terms {
            term.add_gradient(x, &mut self.gradient);
        }
        self.force_evaluations += 1;
        let rows = a.chunks_exact_mut(self.dimension).zip(self.gradient.chunks_exact(self.dimension));
        for ((a, g), w) in rows.zip(&self.inverse_mass) {
            for (a, g) in a.iter_mut().zip(g) {
                // A pinned vertex stays at rest even where its force is not finite.
                *a = if *w == 0.0 { 0.0 } else { -w * g };
            }
        }
    }

    /// `dE/dx` [N], written over `g`; pinned vertices included.
    pub fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        g.fill(0.0);
        for term in &mut self.terms {
            term.add_gradient(x, g);
        }
    }

    /// `y = d2E/dx2 p` [N], written over `y`; pinned vertices included.
    pub fn hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for term in &mut self.terms {
            term.add_hessian_product(x, p, y);
        }
    }

    /// Extremes of `det F` over all elements; `None` without elements.
    pub fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        self.terms.iter_mut().filter_map(|t| t.deformation(x)).reduce(DeformationExtremes::merge)
    }

    /// Why `x` has no finite energy or force.
    pub fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.terms.iter().find_map(|t| t.fault(x))
    }

    /// Bytes held by masses and terms.
    pub fn bytes(&self) -> usize {
        8 * (2 * self.mass.len() + self.gradient.len()) + self.terms.iter().map(|t| t.bytes()).sum::<usize>()
    }
}
