//! Plane problems of linear elasticity on mapped rectangles of cells, solved by conjugate gradients.

use super::super::cells::{Point, interpolated};
use super::super::estimate::{PointsOfCell, distance};
use super::super::reference::ShapeValues;
use super::super::{NodalStress, Recovery, StressError};
use crate::element::{HEX20, HEX27, HEXAHEDRON, QUAD8, QUAD9, QUADRILATERAL};
use crate::energy::EnergyTerm;
use crate::energy::elastic::{Elastic, OnePointCells, PullBack};
use crate::integrator::IntegratorSpec;
use crate::material::{Isotropic, Linear, Material, Model, Plane, PlaneIsotropic, Stress};
use crate::simulation::Simulation;
use crate::state::State;
use crate::system::System;
use crate::topology::Topology;

/// Returns elements of any kind of the registry, by dimension and number of nodes.
pub(super) fn term<M: Material<2> + Material<3> + Clone>(
    (dimension, nodes): (usize, usize),
    material: M,
    pull_back: PullBack,
    cells: &[u32],
    rest: &[f64],
) -> Box<dyn EnergyTerm> {
    let how = Stress::Analytic;
    macro_rules! of {
        ($make:ident, $D:literal, $N:literal) => {
            Box::new(Elastic::<$D, $N>::$make("b", material, how, cells.as_chunks().0, rest))
        };
        ($cell:expr) => {
            Box::new(OnePointCells::new("b", material, (how, pull_back), &$cell, cells.as_chunks().0, rest))
        };
    }
    match (dimension, nodes) {
        (2, 3) => of!(linear, 2, 3),
        (2, 6) => of!(quadratic, 2, 6),
        (3, 4) => of!(linear, 3, 4),
        (3, 10) => of!(quadratic, 3, 10),
        (2, 4) => of!(QUADRILATERAL),
        (3, 8) => of!(HEXAHEDRON),
        (2, 8) if QUAD8.points.len() == 4 => of!(quadratic, 2, 8),
        (2, 9) if QUAD9.points.len() == 9 => of!(quadratic, 2, 9),
        (3, 20) if HEX20.points.len() == 8 => of!(quadratic, 3, 20),
        (3, 27) if HEX27.points.len() == 27 => of!(quadratic, 3, 27),
        _ => panic!("an element of {nodes} nodes in {dimension} dimensions is new"),
    }
}

/// Returns the topology and a simulation of terms whose vertices have the reference positions `rest` and
/// are at `x`.
pub(super) fn simulated(
    dimension: usize,
    terms: Vec<Box<dyn EnergyTerm>>,
    rest: &[f64],
    x: Vec<f64>,
) -> (Topology, Simulation) {
    let count = rest.len() / dimension;
    let mut system = System::new(dimension, vec![1.0; count]);
    terms.into_iter().for_each(|term| {
        system.add_term(term);
    });
    let state = State::new(x, vec![0.0; rest.len()]);
    let simulation = Simulation::new(system, state, IntegratorSpec::VelocityVerlet.method(), 1.0);
    let (rest_positions, masses, bodies) = (rest.to_vec(), vec![], vec![]);
    (Topology { dimension, vertex_count: count, rest_positions, masses, bodies }, simulation)
}

/// Side of a rectangle of cells.
pub(super) enum Side {
    /// `s = 0`.
    Left,
    /// `s = 1`.
    Right,
}

/// Linear elasticity on a mapped rectangle of cells.
pub(super) struct PlaneProblem {
    pub(super) rest: Vec<f64>,
    cells: Vec<u32>,
    nodes: usize,
    /// Numbers of the points of the lattice, row by row; `u32::MAX` where there is no vertex.
    lattice: Vec<Vec<u32>>,
    material: Linear,
    fixed: Vec<Option<f64>>,
    force: Vec<f64>,
}

/// Corners, middles of sides and centre of a cell, in the lattice of half cells.
const AROUND: [[usize; 2]; 9] = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]];
/// Both halves of a cell, corners first, then the middles of their sides.
const HALVES: [[usize; 6]; 2] = [[0, 1, 2, 4, 5, 8], [0, 2, 3, 8, 6, 7]];

/// Gauss points and weights on (0, 1), exact to degree 5.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

impl PlaneProblem {
    /// Creates a mesh of cells `[n0, n1]` with so many `nodes` whose points `(s, t)` in the unit square
    /// are mapped by `point`; diagonals from `(0, 0)` to `(1, 1)`.
    pub(super) fn new(
        (nodes, [n0, n1]): (usize, [usize; 2]),
        (young, poisson, plane): (f64, f64, Plane),
        point: impl Fn(f64, f64) -> [f64; 2],
    ) -> Self {
        let mut lattice = vec![vec![u32::MAX; 2 * n1 + 1]; 2 * n0 + 1];
        let mut rest = vec![];
        for i in 0..=2 * n0 {
            for j in 0..=2 * n1 {
                let odd = i % 2 + j % 2;
                if odd == 0 || nodes >= 6 && (odd == 1 || nodes != 8) {
                    lattice[i][j] = (rest.len() / 2) as u32;
                    rest.extend(point(i as f64 / (2 * n0) as f64, j as f64 / (2 * n1) as f64));
                }
            }
        }
        let mut cells = vec![];
        for (i, j) in (0..n0).flat_map(|i| (0..n1).map(move |j| (i, j))) {
            let node = |k: usize| lattice[2 * i + AROUND[k][0]][2 * j + AROUND[k][1]];
            if nodes % 3 == 0 && nodes < 9 {
                HALVES.iter().for_each(|half| cells.extend(half[..nodes].iter().map(|k| node(*k))));
            } else {
                cells.extend((0..nodes).map(node));
            }
        }
        let solid = Isotropic { young, poisson, preset: None };
        let material = Linear::new(&PlaneIsotropic { solid, plane: Some(plane) });
        let (fixed, force) = (vec![None; rest.len()], vec![0.0; rest.len()]);
        PlaneProblem { rest, cells, nodes, lattice, material, fixed, force }
    }

    /// Fixes displacements [m]: `value(x)` gives those of the coordinates that are held.
    pub(super) fn hold(&mut self, value: impl Fn([f64; 2]) -> [Option<f64>; 2]) {
        for (i, point) in self.rest.as_chunks::<2>().0.iter().enumerate() {
            for (c, value) in value(*point).into_iter().enumerate() {
                self.fixed[2 * i + c] = self.fixed[2 * i + c].or(value);
            }
        }
    }

    /// Adds the force of a traction `(position, outer normal)` on a side.
    pub(super) fn pull(&mut self, side: &Side, traction: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) {
        // In the direction in which the outer normal is to the right.
        let line: Vec<u32> = match side {
            Side::Left => self.lattice[0].iter().rev().copied().collect(),
            Side::Right => self.lattice[self.lattice.len() - 1].clone(),
        };
        for nodes in line.windows(3).step_by(2) {
            let nodes: Vec<u32> = nodes.iter().copied().filter(|node| *node != u32::MAX).collect();
            for (u, weight) in GAUSS {
                let (shape, slope) = match nodes.len() {
                    2 => (vec![1.0 - u, u], vec![-1.0, 1.0]),
                    _ => (
                        vec![(1.0 - u) * (1.0 - 2.0 * u), 4.0 * u * (1.0 - u), u * (2.0 * u - 1.0)],
                        vec![4.0 * u - 3.0, 4.0 - 8.0 * u, 4.0 * u - 1.0],
                    ),
                };
                let sum = |by: &[f64]| {
                    [0, 1].map(|c| {
                        nodes.iter().zip(by).map(|(v, n)| n * self.rest[2 * *v as usize + c]).sum::<f64>()
                    })
                };
                let (at, tangent) = (sum(&shape), sum(&slope));
                let length = tangent[0].hypot(tangent[1]);
                let pull = traction(at, [tangent[1] / length, -tangent[0] / length]);
                for (node, n) in nodes.iter().zip(&shape) {
                    (0..2).for_each(|c| self.force[2 * *node as usize + c] += weight * length * n * pull[c]);
                }
            }
        }
    }

    /// Solves for the displacement, flat [m].
    fn displacement(&self) -> Vec<f64> {
        let mut term = self.term();
        let mut product = |p: &[f64]| {
            let mut y = vec![0.0; p.len()];
            term.add_hessian_product(&self.rest, p, &mut y);
            for (y, _) in y.iter_mut().zip(&self.fixed).filter(|(_, fixed)| fixed.is_some()) {
                *y = 0.0;
            }
            y
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut u: Vec<f64> = self.fixed.iter().map(|fixed| fixed.unwrap_or(0.0)).collect();
        let applied = self.force.iter().zip(&self.fixed);
        let mut r: Vec<f64> = applied.map(|(f, fixed)| if fixed.is_some() { 0.0 } else { *f }).collect();
        r.iter_mut().zip(product(&u)).for_each(|(r, k)| *r -= k);
        let (mut p, mut square) = (r.clone(), dot(&r, &r));
        let first = square;
        while square > 1e-24 * first {
            let kp = product(&p);
            let step = square / dot(&p, &kp);
            u.iter_mut().zip(&p).for_each(|(u, p)| *u += step * p);
            r.iter_mut().zip(&kp).for_each(|(r, k)| *r -= step * k);
            let next = dot(&r, &r);
            p.iter_mut().zip(&r).for_each(|(p, r)| *p = r + next / square * *p);
            square = next;
        }
        u
    }

    fn term(&self) -> Box<dyn EnergyTerm> {
        term((2, self.nodes), self.material, PullBack::None, &self.cells, &self.rest)
    }

    /// Solves the problem with its loads multiplied by `scale`, which makes strains so small that the
    /// Cauchy stress is that of linear elasticity.
    pub(super) fn solved(&self, scale: f64) -> Solved {
        let u = self.displacement();
        let x = self.rest.iter().zip(&u).map(|(x, u)| x + scale * u).collect();
        let (topology, simulation) = simulated(2, vec![self.term()], &self.rest, x);
        Solved { topology, simulation, u, scale }
    }
}

/// Solution of a problem.
pub(super) struct Solved {
    topology: Topology,
    simulation: Simulation,
    pub(super) u: Vec<f64>,
    scale: f64,
}

impl Solved {
    /// Returns the vertex at a position.
    pub(super) fn vertex(&self, at: [f64; 2]) -> usize {
        let is_near = |x: &[f64; 2]| (x[0] - at[0]).hypot(x[1] - at[1]) < 1e-9;
        self.topology.rest_positions.as_chunks().0.iter().position(is_near).unwrap()
    }

    /// Returns component `(i, i)` of the stress at a position, for the loads of the problem [Pa].
    pub(super) fn normal_stress(&self, recovery: Recovery, at: [f64; 2], i: usize) -> f64 {
        let stress: NodalStress = self.simulation.nodal_stress(&self.topology, recovery);
        let found: Vec<f64> =
            stress.at(self.vertex(at) as u32).map(|stress| stress[i][i] / self.scale).collect();
        let [found] = found[..] else { panic!("one value at {at:?}: {found:?}") };
        found
    }

    /// Returns the error, for the loads of the problem, if this is the exact stress `[xx, yy, xy]` [Pa].
    pub(super) fn true_error(&self, exact: impl Fn([f64; 2]) -> [f64; 3]) -> f64 {
        let at = self.simulation.sampled(&self.topology);
        let exact = |points: &PointsOfCell<'_>| {
            let tensor = |at: &Point| {
                let [xx, yy, xy] = exact([at[0], at[1]]).map(|stress| self.scale * stress);
                [xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, 0.0]
            };
            let position = |shape: &ShapeValues| interpolated(&shape.values, points.vertices, at);
            points.shapes.iter().map(|shape| tensor(&position(shape))).collect()
        };
        let terms = self.simulation.element_terms();
        distance(terms, at, |_| &exact).unwrap().total / self.scale
    }

    /// Returns the estimated error, for the loads of the problem.
    pub(super) fn error(&self, recovery: Recovery) -> StressError {
        let mut error = self.simulation.stress_error(&self.topology, recovery).unwrap();
        error.elements.iter_mut().for_each(|eta| *eta /= self.scale);
        error.total /= self.scale;
        error.norm /= self.scale;
        error
    }
}
