//! Solids of linear and quadratic elements, assembled from scenes as a user would.

use nalgebra::DMatrix;
use pliant::integrator::{IntegratorSpec, Method};
use pliant::material::MaterialSpec;
use pliant::simulation::Simulation;
use pliant_mesh::{Mesh, build};
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{MeshSpec, Scene};
use serde_json::{Value, json};

/// A body of one material, and the world around it.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub(crate) dimension: usize,
    /// As in a scene.
    pub(crate) mesh: Value,
    /// As in a scene.
    pub(crate) elastic: Value,
    /// Of the elements.
    pub(crate) order: u8,
    /// As in a scene.
    pub(crate) serendipity: bool,
    /// `analytic` or `autodiff`.
    pub(crate) stress: &'static str,
    /// As in a scene.
    pub(crate) mass: Value,
    /// As in a scene.
    pub(crate) pin: Value,
    pub(crate) gravity: Option<Vec<f64>>,
    /// As in a scene.
    pub(crate) load: Value,
}

/// An isotropic material.
pub(crate) fn isotropic(name: &str, young: f64, poisson: f64) -> Value {
    json!({ name: { "young": young, "poisson": poisson } })
}

/// Selects the vertices with coordinate `axis` at zero.
pub(crate) fn at_zero(dimension: usize, axis: usize) -> Value {
    let mut normal = vec![0.0; dimension];
    normal[axis] = 1.0;
    json!([{ "half_space": { "normal": normal, "offset": 0.0 } }])
}

impl Solid {
    /// A free grid of these cells and size with its lower corner at the origin, density 1000.
    pub(crate) fn grid(cells: &[usize], size: &[f64], elastic: Value) -> Self {
        Solid {
            dimension: cells.len(),
            mesh: json!({ "grid": { "cells": cells, "size": size } }),
            elastic,
            order: 1,
            serendipity: false,
            stress: "analytic",
            mass: json!({ "density": 1000.0 }),
            pin: json!([]),
            gravity: None,
            load: json!([]),
        }
    }

    /// A free body of these vertices and elements.
    pub(crate) fn inline(mesh: &Mesh, elastic: Value) -> Self {
        let points: Vec<&[f64]> = mesh.points.chunks_exact(mesh.dimension).collect();
        let (cells, key) = match (mesh.block(), mesh.dimension) {
            (Some(block), _) => (json!(block.cells().collect::<Vec<_>>()), block.kind.plural),
            (None, 2) => (json!(mesh.triangles), "triangles"),
            (None, _) => (json!(mesh.tetrahedra), "tetrahedra"),
        };
        let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], elastic);
        solid.dimension = mesh.dimension;
        solid.mesh = json!({ "inline": { "points": points, key: cells } });
        solid
    }

    /// The same of elements of this order.
    pub(crate) fn of_order(self, order: u8) -> Self {
        Solid { order, ..self }
    }

    /// The same of elements of this kind.
    pub(crate) fn of_kind(self, kind: Kind) -> Self {
        match kind {
            Kind::Order(order) => self.of_order(order),
            Kind::Whole => self.of_whole_cells(),
            Kind::Lagrange => self.of_whole_cells().of_order(2),
            Kind::Serendipity => Solid { serendipity: true, ..self.of_whole_cells().of_order(2) },
        }
    }

    /// The same of quadrilaterals or hexahedra, if it is a grid.
    pub(crate) fn of_whole_cells(mut self) -> Self {
        if let Some(grid) = self.mesh.get_mut("grid") {
            grid["element"] = json!(if self.dimension == 2 { "quadrilateral" } else { "hexahedron" });
        }
        self
    }

    /// The mesh with its nodes in the middle of edges, faces and cells, as the scene numbers them.
    pub(crate) fn whole_mesh(&self) -> Mesh {
        let mesh = self.mesh();
        match (self.order, self.serendipity) {
            (1, _) => mesh,
            (_, false) => mesh.promoted_to_quadratic().unwrap(),
            (_, true) => mesh.promoted_to_serendipity().unwrap(),
        }
    }

    /// The mesh, without the nodes in the middle of edges.
    pub(crate) fn mesh(&self) -> Mesh {
        let spec: MeshSpec = serde_json::from_value(self.mesh.clone()).unwrap();
        build(&spec, self.dimension, ".".as_ref()).unwrap()
    }

    /// At rest, to be advanced by `method` with steps of `h`.
    pub(crate) fn simulation(&self, method: Method, h: f64) -> Simulation {
        let spec = IntegratorSpec::ALL.iter().find(|spec| spec.method() == method).expect("registered");
        let scene: Scene = serde_json::from_value(json!({
            "dimension": self.dimension,
            "time": { "integrator": spec, "step": h, "duration": 1.0 },
            "world": { "gravity": self.gravity },
            "body": [{
                "mesh": self.mesh,
                "elastic": self.elastic,
                "order": self.order,
                "serendipity": self.serendipity,
                "stress": self.stress,
                "mass": self.mass,
                "pin": self.pin,
                "load": self.load,
            }],
        }))
        .unwrap();
        scene.assemble(UnstableStep::Accept).map_err(|problems| format!("{problems:?}")).unwrap().simulation
    }

    /// At rest, to be asked for forces.
    pub(crate) fn probe(&self) -> Probe {
        Probe(self.simulation(IntegratorSpec::ForwardEuler.method(), 1.0))
    }
}

/// Every element: dimension and order.
pub(crate) const ELEMENTS: [(usize, u8); 4] = [(2, 1), (3, 1), (2, 2), (3, 2)];

/// How elements are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Order(u8),
    /// Quadrilaterals and hexahedra.
    Whole,
    /// Quadrilaterals and hexahedra of second order with all their nodes.
    Lagrange,
    /// Quadrilaterals and hexahedra of second order with nodes in the middle of edges alone.
    Serendipity,
}

impl Kind {
    /// 1 or 2.
    pub(crate) fn order(self) -> u8 {
        match self {
            Kind::Order(order) => order,
            Kind::Whole => 1,
            Kind::Lagrange | Kind::Serendipity => 2,
        }
    }
}

/// Every kind of element: dimension and kind.
pub(crate) const KINDS: [(usize, Kind); 10] = [
    (2, Kind::Order(1)),
    (3, Kind::Order(1)),
    (2, Kind::Order(2)),
    (3, Kind::Order(2)),
    (2, Kind::Whole),
    (3, Kind::Whole),
    (2, Kind::Lagrange),
    (3, Kind::Lagrange),
    (2, Kind::Serendipity),
    (3, Kind::Serendipity),
];

/// Every registered material with its example parameters, as in a scene.
pub(crate) fn every_material() -> Vec<(MaterialSpec, Value)> {
    MaterialSpec::examples().into_iter().map(|m| (m.clone(), serde_json::to_value(m).unwrap())).collect()
}

/// Measures energies and forces of a solid at any positions: one step of 1 s of forward Euler from rest
/// leaves the positions where they are and makes the velocities the accelerations.
pub(crate) struct Probe(pub(crate) Simulation);

impl Probe {
    /// `-dE/dx` [N], zero at pinned vertices.
    pub(crate) fn forces(&mut self, x: &[f64]) -> Vec<f64> {
        let (mut y, mut a) = (x.to_vec(), vec![0.0; x.len()]);
        self.0.advance(&mut y, &mut a).unwrap();
        assert_eq!(y, x);
        let d = self.0.system().dimension();
        for (a, m) in a.chunks_exact_mut(d).zip(self.0.system().mass()) {
            a.iter_mut().for_each(|a| *a *= m);
        }
        a
    }

    /// Potential energy [J].
    pub(crate) fn energy(&mut self, x: &[f64]) -> f64 {
        self.0.state_mut().x_mut().copy_from_slice(x);
        let d = self.0.diagnostics();
        d.elastic + d.gravitational
    }

    /// `d2E/dx2` [N/m], column by column.
    pub(crate) fn stiffness(&mut self, x: &[f64]) -> DMatrix<f64> {
        self.stiffness_between(x, &(0..x.len()).collect::<Vec<_>>())
    }

    /// The rows and columns `of` these unknowns of the stiffness.
    pub(crate) fn stiffness_between(&mut self, x: &[f64], of: &[usize]) -> DMatrix<f64> {
        let mut k = DMatrix::zeros(of.len(), of.len());
        let (mut unit, mut column) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        for (j, &unknown) in of.iter().enumerate() {
            unit[unknown] = 1.0;
            self.0.system_mut().hessian_product(x, &unit, &mut column);
            unit[unknown] = 0.0;
            for (i, &row) in of.iter().enumerate() {
                k[(i, j)] = column[row];
            }
        }
        k
    }

    /// Positions at rest.
    pub(crate) fn rest(&self) -> Vec<f64> {
        self.0.state().x().to_vec()
    }
}

/// The same displacement gradient plus one everywhere: `x = F X + t`.
pub(crate) fn affine(rest: &[f64], f: &[&[f64]], translation: &[f64]) -> Vec<f64> {
    let d = translation.len();
    let row = |x: &[f64], i: usize| f[i].iter().zip(x).map(|(f, x)| f * x).sum::<f64>() + translation[i];
    rest.chunks_exact(d).flat_map(|x| (0..d).map(move |i| row(x, i))).collect()
}

/// `k`-th number in (-1, 1) of a sequence without pattern (additive recurrence by the plastic number).
pub(crate) fn scattered(k: usize) -> f64 {
    2.0 * (0.5 + (k as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
}

/// `x` with every coordinate moved by up to `amplitude`.
pub(crate) fn shaken(x: &[f64], amplitude: f64) -> Vec<f64> {
    x.iter().enumerate().map(|(k, x)| x + amplitude * scattered(k)).collect()
}
