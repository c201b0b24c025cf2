//! A record of numbers: what every element and every other local term gives, law by law.
//!
//! `tests/data/element_record.txt` has a line for each kind of term, element, law and state, recorded from
//! this program. It says nothing about what is right, which the other tests do: it says that a change of the
//! code which was to change no result has changed none.
//! `PLIANT_RECORD_ELEMENTS=1 cargo test --test pliant element_record` records all numbers anew.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use pliant::material::{MaterialSpec, Psd};
use pliant::simulation::Simulation;
use pliant::solver::block_matrix::BlockMatrix;
use pliant::solver::hessian::{Assembler, At, Weights};
use pliant::system::System;
use pliant_mesh::build;
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{MeshSpec, Scene};
use serde_json::{Value, json};

use crate::support::solid::{Solid, every_material};

/// Largest difference of a number from its record, relative to the number where it stands alone, and to the
/// norm of the vector or matrix that it was taken from.
///
/// Sums of a few hundred products in another order differ by some 1e-14 of their terms, and what comes before
/// them, strains of a few percent and eigenvalues near to each other, loses two or three digits more. Twelve
/// digits are recorded, half a unit of the last is 5e-12 at most. A mistake in a formula changes more, and so
/// does one in an entry that is worth anything beside the others.
const TOLERANCE: f64 = 1e-9;

/// Faults that are shown; the rest is counted.
const MOST_FAULTS: usize = 20;

const HOW_TO_RECORD: &str = "if the numbers were meant to change, record them anew: \
                             PLIANT_RECORD_ELEMENTS=1 cargo test --test pliant element_record";

/// The numbers of every line of one kind: one that stands alone, then three of each vector.
#[derive(Debug)]
struct Columns {
    /// First word of a line.
    kind: &'static str,
    alone: &'static str,
    vectors: &'static [&'static str],
    measure: fn(&mut System, &Place) -> Vec<f64>,
}

/// Calls what is generic over the dimension.
macro_rules! by_dimension {
    ($measure:ident($system:ident, $at:ident)) => {
        if $system.dimension() == 2 { $measure::<2>($system, $at) } else { $measure::<3>($system, $at) }
    };
}

static ENERGY: Columns = Columns {
    kind: "energy",
    alone: "energy",
    vectors: &["gradient", "hessian_product", "matrix", "projected_matrix"],
    measure: |system, at| by_dimension!(energies(system, at)),
};

/// Forces that need not have a potential, so that the Hessian need not be symmetric.
static LOAD: Columns = Columns {
    kind: "load",
    alone: "energy",
    vectors: &["gradient", "hessian_product", "matrix", "projected_matrix", "transposed_product"],
    measure: |system, at| {
        let mut numbers = by_dimension!(energies(system, at));
        let mut product = vec![0.0; at.x.len()];
        system.transposed_product(&at.x, &at.p, &mut product, &mut vec![]);
        numbers.extend(of_vector(&product));
        numbers
    },
};

/// Matrices at the stresses that the last step predicts, of materials that are nearly incompressible.
static PREDICTION: Columns = Columns {
    kind: "prediction",
    alone: "energy",
    vectors: &["matrix", "predicted_matrix"],
    measure: |system, at| by_dimension!(predictions(system, at)),
};

static DAMPING: Columns = Columns {
    kind: "damping",
    alone: "power",
    vectors: &["force", "damping_product", "matrix", "position_product", "position_change"],
    measure: |system, at| by_dimension!(dissipations(system, at)),
};

/// Positions and velocities to look at, and a direction to look along, flat.
struct Place {
    x: Vec<f64>,
    v: Vec<f64>,
    p: Vec<f64>,
}

/// How a body is deformed: the linear part of the motion, by rows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Deformation {
    name: &'static str,
    rows: [[f64; 3]; 3],
}

const SHAKEN: Deformation =
    Deformation { name: "shaken", rows: [[0.95, -0.25, 0.1], [0.3, 1.0, -0.15], [0.05, 0.2, 1.05]] };
const STRETCHED: Deformation =
    Deformation { name: "stretched", rows: [[1.6, 0.3, -0.2], [-0.2, 0.65, 0.1], [0.15, -0.1, 1.2]] };
/// Barriers do not bear it. No singular value is near the negative of another, where rotations jump.
const INVERTED: Deformation =
    Deformation { name: "inverted", rows: [[-0.4, 0.2, 0.1], [0.3, 1.2, -0.1], [0.1, 0.2, 0.95]] };

impl Deformation {
    /// Linear, wavy and noisy.
    fn of(&self, rest: &[f64], dimension: usize) -> Place {
        let point = |i: usize| &rest[i / dimension * dimension..][..dimension];
        let moved = |i: usize| {
            let (point, c) = (point(i), i % dimension);
            let linear: f64 = self.rows[c].iter().zip(point).map(|(f, x)| f * x).sum();
            let wave = (2.0 * point[(c + 1) % dimension] + 1.3 * point[c] + c as f64).sin();
            linear + 0.04 * wave + 0.012 * noise(3, i, 0)
        };
        let random = |seed| (0..rest.len()).map(|i| noise(seed, i, 0)).collect();
        Place { x: (0..rest.len()).map(moved).collect(), v: random(4), p: random(5) }
    }
}

/// A number in (-1, 1) without any pattern: sums with numbers of a lattice would let some mistakes cancel.
/// Steele, Lea, Flood 2014, *Fast splittable pseudorandom number generators*: the last step of `SplitMix64`.
fn noise(seed: u64, row: usize, column: usize) -> f64 {
    let mut bits = ((seed << 48) | ((row as u64) << 24) | column as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    for (shift, factor) in [(30, 0xBF58_476D_1CE4_E5B9), (27, 0x94D0_49BB_1331_11EB)] {
        bits = (bits ^ (bits >> shift)).wrapping_mul(factor);
    }
    ((bits ^ (bits >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Factors of the entries of a matrix, or of a vector in column 0: none of them is small, so that no entry
/// goes unseen.
fn weight(seed: u64, row: usize, column: usize) -> f64 {
    let number = noise(seed, row, column);
    0.5 * (number + number.signum())
}

/// Norm, and products with two vectors.
fn three_numbers(entries: impl Iterator<Item = (usize, usize, f64)>) -> [f64; 3] {
    let [mut squares, mut a, mut b] = [0.0; 3];
    for (row, column, entry) in entries {
        squares += entry * entry;
        a += weight(1, row, column) * entry;
        b += weight(2, row, column) * entry;
    }
    [squares.sqrt(), a, b]
}

fn of_vector(vector: &[f64]) -> [f64; 3] {
    three_numbers(vector.iter().enumerate().map(|(row, entry)| (row, 0, *entry)))
}

fn of_matrix<const D: usize>(matrix: &BlockMatrix<D>) -> [f64; 3] {
    three_numbers((0..matrix.rows()).flat_map(|i| {
        matrix.row(i).flat_map(move |(j, block)| {
            (0..D * D).map(move |e| (i * D + e / D, j * D + e % D, block[e / D][e % D]))
        })
    }))
}

/// The matrix of these terms alone.
fn assembled<const D: usize>(
    system: &mut System,
    at: &Place,
    (stiffness, damping): (f64, f64),
    (psd, predicted_from): (Psd, Option<&[f64]>),
) -> [f64; 3] {
    let mut assembler = Assembler::<D>::new(system);
    let weights = Weights { inertia: 0.0, stiffness, damping };
    assembler.assemble(system, At { x: &at.x, v: &at.v, psd, predicted_from }, weights);
    of_matrix(assembler.matrix())
}

fn energies<const D: usize>(system: &mut System, at: &Place) -> Vec<f64> {
    let mut vector = vec![0.0; at.x.len()];
    let mut numbers = vec![system.potential_energy(&at.x)];
    system.gradient(&at.x, &mut vector);
    numbers.extend(of_vector(&vector));
    system.hessian_product(&at.x, &at.p, &mut vector);
    numbers.extend(of_vector(&vector));
    for psd in [Psd::Exact, Psd::Projected] {
        numbers.extend(assembled::<D>(system, at, (1.0, 0.0), (psd, None)));
    }
    numbers
}

fn predictions<const D: usize>(system: &mut System, at: &Place) -> Vec<f64> {
    let from: Vec<f64> = at.x.iter().zip(&at.p).map(|(x, p)| x + 0.02 * p).collect();
    let mut numbers = vec![system.potential_energy(&at.x)];
    for from in [None, Some(&from[..])] {
        numbers.extend(assembled::<D>(system, at, (1.0, 0.0), (Psd::Exact, from)));
    }
    numbers
}

fn dissipations<const D: usize>(system: &mut System, at: &Place) -> Vec<f64> {
    let mut vector = vec![0.0; at.x.len()];
    let mut numbers = vec![system.dissipated_power(&at.x, &at.v)];
    system.dissipative_force(&at.x, &at.v, &mut vector);
    numbers.extend(of_vector(&vector));
    system.damping_product(&at.x, &at.v, &at.p, &mut vector);
    numbers.extend(of_vector(&vector));
    numbers.extend(assembled::<D>(system, at, (0.0, 1.0), (Psd::Exact, None)));
    assert!(system.position_product(&at.x, &at.v, &at.p, &mut vector));
    numbers.extend(of_vector(&vector));
    assert!(system.position_change(&at.x, &at.v, &at.p, &mut vector));
    numbers.extend(of_vector(&vector));
    numbers
}

/// A scene without its `[time]`, and what is recorded of it.
struct Case {
    columns: &'static Columns,
    element: String,
    law: String,
    scene: Value,
    deformations: &'static [Deformation],
}

impl Case {
    fn simulation(&self) -> Simulation {
        let mut scene = self.scene.clone();
        scene["time"] = json!({ "integrator": "implicit-euler", "step": 0.01, "duration": 1.0 });
        let what = format!("{} of {}", self.law, self.element);
        let scene: Scene = serde_json::from_value(scene).unwrap_or_else(|e| panic!("{what}: {e}"));
        let assembly = scene.assemble(UnstableStep::Accept);
        let simulation = assembly.unwrap_or_else(|problems| panic!("{what}: {problems:?}")).simulation;
        assert!(simulation.numbering().is_identity());
        simulation
    }

    /// A line for each state. States without a finite energy, as inverted ones of barriers, have none.
    fn lines(&self) -> Vec<(String, Vec<f64>)> {
        let mut simulation = self.simulation();
        let system = simulation.system_mut();
        system.set_time(0.3);
        let rest = system.rest_positions().unwrap().to_vec();
        let states = self.deformations.iter().filter_map(|deformation| {
            let at = deformation.of(&rest, system.dimension());
            let numbers =
                system.potential_energy(&at.x).is_finite().then(|| (self.columns.measure)(system, &at));
            let key = [self.columns.kind, &self.element, &self.law, deformation.name].join(" ");
            Some((key, numbers?))
        });
        states.collect()
    }
}

/// A body without elasticity.
struct Shape {
    name: &'static str,
    dimension: usize,
    body: Value,
}

impl Shape {
    /// A case of this body with these keys more.
    fn case(
        &self,
        columns: &'static Columns,
        law: &str,
        keys: Value,
        deformations: &'static [Deformation],
    ) -> Case {
        let scene = json!({ "dimension": self.dimension, "body": [with(&self.body, keys)] });
        Case { columns, element: self.name.to_owned(), law: law.to_owned(), scene, deformations }
    }
}

/// This table with these keys more.
fn with(table: &Value, keys: Value) -> Value {
    let mut table = table.clone();
    for (key, value) in keys.as_object().unwrap() {
        table[key] = value.clone();
    }
    table
}

/// A generated mesh whose vertices were moved: no cell is a box, no side has a direction of its own.
fn distorted(mesh: Value, dimension: usize) -> Value {
    let spec: MeshSpec = serde_json::from_value(mesh).unwrap();
    let mut mesh = build(&spec, dimension, ".".as_ref()).unwrap();
    mesh.points.iter_mut().enumerate().for_each(|(i, x)| *x += 0.05 * noise(6, i, 0));
    // The last pack of numbers is not full.
    mesh.tetrahedra.pop();
    if mesh.edges.is_empty() {
        return Solid::inline(&mesh, Value::Null).mesh;
    }
    let points: Vec<&[f64]> = mesh.points.chunks_exact(dimension).collect();
    json!({ "inline": { "points": points, "edges": mesh.edges, "triangles": mesh.triangles } })
}

/// A grid of cells of half a metre.
fn grid(cells: &[usize], element: Option<&str>) -> Value {
    distorted(json!({ "grid": { "cells": cells, "spacing": 0.5, "element": element } }), cells.len())
}

fn cloth() -> Value {
    let cloth = json!({ "cells": [3, 2], "origin": [0, 0, 0], "u": [1.5, 0, 0], "v": [0, 1, 0] });
    distorted(json!({ "cloth": cloth }), 3)
}

fn strand(dimension: usize) -> Value {
    let end = [3.0, 0.3, -0.2];
    let ends = json!({ "segments": 10, "start": ([0.0; 3][..dimension]), "end": (end[..dimension]) });
    distorted(json!({ "strand": ends }), dimension)
}

fn shape(name: &'static str, dimension: usize, keys: Value) -> Shape {
    Shape { name, dimension, body: with(&json!({ "mass": { "density": 1000.0 } }), keys) }
}

/// Every element of solids. Those of second order have curved sides and straight ones.
fn solids() -> Vec<Shape> {
    let annulus = json!({ "inner_radius": 0.5, "outer_radius": 1.0, "cells": [1, 5] });
    let ball = json!({ "radius": 1.0, "cells": 1 });
    let whole = with(&annulus, json!({ "element": "quadrilateral" }));
    let curved = json!({ "mesh": { "annulus": whole }, "order": 2, "transform": { "scale": [1.1, 0.8] } });
    let solid = json!({ "mesh": grid(&[2, 1, 1], Some("hexahedron")), "order": 2 });
    vec![
        shape("triangle", 2, json!({ "mesh": grid(&[3, 2], None) })),
        shape(
            "quadratic-triangle",
            2,
            json!({ "mesh": { "annulus": annulus }, "order": 2, "transform": { "scale": [1.1, 0.8] } }),
        ),
        shape("quadrilateral", 2, json!({ "mesh": grid(&[3, 2], Some("quadrilateral")) })),
        shape("quad8", 2, with(&curved, json!({ "serendipity": true }))),
        shape("quad9", 2, curved),
        shape("tetrahedron", 3, json!({ "mesh": grid(&[2, 2, 1], None) })),
        shape(
            "quadratic-tetrahedron",
            3,
            json!({ "mesh": { "ball": ball }, "order": 2, "transform": { "scale": [1.1, 0.8, 0.95] } }),
        ),
        shape("hexahedron", 3, json!({ "mesh": grid(&[2, 2, 1], Some("hexahedron")) })),
        shape("hex20", 3, with(&solid, json!({ "serendipity": true }))),
        shape("hex27", 3, solid),
    ]
}

fn membranes() -> [Shape; 2] {
    let membrane =
        |plane: &str| json!({ "mesh": cloth(), "membrane": { "thickness": 0.02, "plane": plane } });
    [shape("membrane", 3, membrane("stress")), shape("membrane-of-plane-strain", 3, membrane("strain"))]
}

/// A mesh of springs.
fn nets() -> [Shape; 5] {
    [
        shape("strand-2d", 2, json!({ "mesh": strand(2) })),
        shape("strand-3d", 3, json!({ "mesh": strand(3) })),
        shape("edges-of-triangles", 2, json!({ "mesh": grid(&[3, 2], None) })),
        shape("edges-of-tetrahedra", 3, json!({ "mesh": grid(&[2, 2, 1], None) })),
        shape("cloth", 3, json!({ "mesh": cloth() })),
    ]
}

/// Neo-Hookean, of this Poisson's ratio.
fn rubber(poisson: f64) -> Value {
    json!({ "neo-hookean": { "young": 1e6, "poisson": poisson } })
}

/// Elasticity where something else is looked at: 1e-4 of it or less, but no freedom is without any.
fn weak() -> Value {
    json!({ "displacement-gradient": { "stiffness": 1.0 } })
}

/// Energy densities as formulas: of everything that there are names for.
fn formulas() -> Vec<(&'static str, Value)> {
    let formula = |name, psi: &str, fibres: Value| {
        let parameters = json!({ "a": 4e5, "b": 1e5, "c": 6e5 });
        (name, json!({ "expression": { "psi": psi, "parameters": parameters, "fibres": fibres } }))
    };
    vec![
        formula(
            "formula-of-invariants",
            "a*(I1 - 3) + b*(I2 - 3) - (a + 2*b)*ln(I3) + c*(J - 1)^2",
            json!([]),
        ),
        formula(
            "formula-of-stretches",
            "a*(ln(l1)^2 + ln(l2)^2 + ln(l3)^2) + c/2*ln(l1*l2*l3)^2 + b*(l1 + l2 + l3 - 3 - ln(l1*l2*l3))",
            json!([]),
        ),
        formula(
            "formula-of-gradient",
            "a/2*((F11 - 1)^2 + 2*F12^2 + F13^2 + F21^2 + (F22 - 1)^2 + F23^2 + F31^2 + 3*F32^2 \
             + (F33 - 1)^2) + b*(F11 - 1)*F12 + c/2*(F11 + F22 + F33 - 3)^2",
            json!([]),
        ),
        formula(
            "formula-of-strain",
            "a*(E11^2 + E22^2 + E33^2 + 2*E12^2 + 2*E23^2 + 2*E13^2) + c/2*(E11 + E22 + E33)^2 + b*E11^2 \
             + b*E11*E22",
            json!([]),
        ),
        formula(
            "formula-of-fibres",
            "a/2*(I1 - 3) - a*ln(J) + c/2*ln(J)^2 + b/4*(I4 - 1)^2 + b/8*(I6 - 1)^2",
            json!([[1.0, 0.5, 0.2], [-0.3, 1.0, 0.0]]),
        ),
    ]
}

/// Every registered law in every element.
fn laws() -> Vec<Case> {
    let mut cases = vec![];
    for shape in solids() {
        for (material, elastic) in every_material() {
            let states = &[SHAKEN, STRETCHED, INVERTED];
            cases.push(shape.case(&ENERGY, material.name(), json!({ "elastic": elastic }), states));
        }
    }
    for shape in membranes() {
        // Free faces find their thickness from the one at rest.
        let takes = |material: &MaterialSpec| {
            material.is_isotropic() && (shape.name != "membrane" || material.about().has_rest_shape)
        };
        for (material, elastic) in every_material().into_iter().filter(|(material, _)| takes(material)) {
            cases.push(shape.case(&ENERGY, material.name(), json!({ "elastic": elastic }), &[STRETCHED]));
        }
    }
    cases
}

/// Formulas, directions, and everything else that may be said of elements.
fn variants() -> Vec<Case> {
    let mut cases = vec![];
    let formulas = formulas();
    let tissue = every_material().into_iter().filter(|(material, _)| material.has_axes());
    let tissue: Vec<_> = tissue.map(|(material, elastic)| (material.name(), elastic)).collect();
    for shape in solids() {
        let mut case = |law: &str, keys| cases.push(shape.case(&ENERGY, law, keys, &[SHAKEN]));
        for (name, elastic) in &formulas {
            case(name, json!({ "elastic": elastic }));
        }
        let axes = if shape.dimension == 2 {
            json!({ "first": { "direction": ["1", "0.5 + Y"] } })
        } else {
            json!({ "first": { "direction": ["1", "Y", "-X"] }, "second": { "direction": ["0", "1", "X"] } })
        };
        let directed =
            formulas.iter().filter(|(name, _)| name.ends_with("strain") || name.ends_with("fibres"));
        for (name, elastic) in directed.chain(&tissue) {
            case(&format!("{name}+axes"), json!({ "elastic": elastic, "elastic_axes": axes }));
        }
        case("neo-hookean+autodiff", json!({ "elastic": rubber(0.3), "stress": "autodiff" }));
        if shape.dimension == 2 {
            let linear = json!({ "linear": { "young": 1e6, "poisson": 0.3, "plane": "stress" } });
            case("linear+plane-stress", json!({ "elastic": linear }));
        }
    }
    let straight = [
        shape("triangle", 2, json!({ "mesh": grid(&[3, 2], None) })),
        shape("tetrahedron", 3, json!({ "mesh": grid(&[2, 2, 1], None) })),
        shape("straight-quadratic-triangle", 2, json!({ "mesh": grid(&[3, 2], None), "order": 2 })),
        shape("straight-quadratic-tetrahedron", 3, json!({ "mesh": grid(&[2, 2, 1], None), "order": 2 })),
    ];
    for shape in straight {
        let elements = if shape.dimension == 2 { 12 } else { 23 };
        let factors: Vec<f64> = (0..elements).map(|e| 1.0 + 0.5 * noise(7, e, 0)).collect();
        let keys = json!({ "elastic": rubber(0.3), "elastic_factor": factors });
        cases.push(shape.case(&ENERGY, "neo-hookean+factors", keys, &[SHAKEN]));
    }
    for shape in solids() {
        let keys = json!({ "elastic": rubber(0.48) });
        cases.push(shape.case(&PREDICTION, "neo-hookean", keys, &[SHAKEN]));
    }
    cases
}

/// Muscles, pressure, loads.
fn loads() -> Vec<Case> {
    let mut cases = vec![];
    for shape in solids() {
        let d = shape.dimension;
        let muscle = json!([
            { "fibre": { "direction": (["1", "Y", "-X"][..d]) }, "tension": "5e4 * (1 + X) * cos(t)" },
            { "fibre": { "direction": (["0.3", "1", "0.2"][..d]) }, "tension": -2e4 },
        ]);
        let keys = json!({ "elastic": weak(), "muscle": muscle });
        cases.push(shape.case(&ENERGY, "muscles", keys, &[SHAKEN]));
        let part = json!({ "normal": ([1.0, 0.0, 0.0][..d]), "offset": 0.1 });
        let force = ["1e5 * X", "2e4 * (1 + Y) * cos(t)", "-3e4 * X * Y"];
        let mut loads = vec![
            ("pressure", json!({ "pressure": 1e5 })),
            ("pressure-that-varies", json!({ "pressure": "1e5 * (1 + X - 0.5 * Y^2) * cos(2*t)" })),
            ("pressure-on-a-part", json!({ "pressure": 1e5, "half_space": part })),
            ("traction", json!({ "traction": force[..d], "half_space": part })),
            ("body-force", json!({ "body_force": force[..d] })),
        ];
        // These do not look at elements.
        let has_all = shape.name == "triangle" || shape.name == "tetrahedron";
        if has_all {
            loads.push(("force", json!({ "force": force[..d], "half_space": part })));
            loads
                .push(("force-per-vertex", json!({ "force_per_vertex": force[..d], "vertices": [1, 2, 4] })));
        }
        for (law, load) in loads {
            let keys = json!({ "elastic": weak(), "load": [load] });
            cases.push(shape.case(&LOAD, law, keys, &[SHAKEN]));
        }
        let over_time = ["1", "-9.81 * (1 - exp(-t))", "2"];
        let gravities =
            [("gravity", json!([1.0, -9.81, 2.0][..d])), ("gravity-over-time", json!(over_time[..d]))];
        for (law, gravity) in gravities.into_iter().filter(|_| has_all) {
            let mut case = shape.case(&LOAD, law, json!({ "elastic": weak() }), &[SHAKEN]);
            case.scene["world"] = json!({ "gravity": gravity });
            cases.push(case);
        }
    }
    let sheet = shape("membrane", 3, json!({ "mesh": cloth(), "membrane": { "thickness": 0.02 } }));
    for (law, pressure) in [("pressure", json!(1e5)), ("pressure-that-varies", json!("1e5 * (1 + X)"))] {
        let elastic = json!({ "stvk": { "young": 1.0, "poisson": 0.3 } });
        let keys = json!({ "elastic": elastic, "load": [{ "pressure": pressure }] });
        cases.push(sheet.case(&LOAD, law, keys, &[SHAKEN]));
    }
    cases
}

/// How a sheet or a strand may be bent.
fn bendings(dimension: usize, is_sheet: bool) -> Vec<(&'static str, Value)> {
    let mut bendings = vec![
        ("bending", json!({ "stiffness": 0.3 })),
        ("bending-of-flat", json!({ "stiffness": 0.3, "rest": "flat" })),
        ("bending-of-angle", json!({ "stiffness": 0.3, "rest": { "angle": 0.4 } })),
        ("bending-by-young", json!({ "young": 1e6, "thickness": 0.02 })),
    ];
    if is_sheet && dimension == 3 {
        let plate = json!({ "young": 1e6, "thickness": 0.02, "poisson": 0.3 });
        bendings.push(("bending-by-poisson", plate));
    }
    bendings
}

/// Springs, hinges and joints.
fn springs() -> Vec<Case> {
    let mut cases = vec![];
    for net in nets() {
        let formula = "k/2*(l - l0)^2 + c/4*(l - l0)^4/l0^2";
        let parameters = json!({ "k": 100.0, "c": 300.0 });
        for (law, springs) in [
            ("spring", json!({ "stiffness": 100.0 })),
            ("spring-of-length", json!({ "stiffness": 100.0, "rest_length": 0.4 })),
            ("spring-by-young", json!({ "young": 50.0 })),
            ("spring-formula", json!({ "expression": formula, "parameters": parameters })),
        ] {
            cases.push(net.case(&ENERGY, law, json!({ "springs": springs }), &[STRETCHED]));
        }
        if net.name.starts_with("edges") {
            continue;
        }
        for (law, bending) in bendings(net.dimension, net.name == "cloth") {
            let keys = json!({ "springs": { "stiffness": 1e-6 }, "bending": bending });
            cases.push(net.case(&ENERGY, law, keys, &[STRETCHED]));
        }
    }
    cases
}

/// Particles that are tied to places and to a body, with these constants.
fn ties(columns: &'static Columns, ties: &Value) -> Vec<Case> {
    let mut cases = vec![];
    for d in [2, 3] {
        let mesh = if d == 2 { grid(&[3, 2], None) } else { grid(&[2, 2, 1], None) };
        let block = json!({ "name": "block", "mesh": mesh, "elastic": weak(), "mass": { "density": 1e3 } });
        // Above the block, whose nearest points are within its sides.
        let point = |i: usize| -> Vec<f64> {
            let noise = (0..d).map(|c| 0.5 * noise(8, i, c));
            noise.zip([0.6, 1.6, 0.6]).map(|(noise, x)| noise + x).collect()
        };
        let points: Vec<_> = (0..3).map(point).collect();
        let places: Vec<_> = (3..6).map(point).collect();
        let particles = json!({
            "name": "particles", "mesh": { "inline": { "points": points } }, "mass": { "total": 3.0 },
        });
        for (law, keys) in [
            ("tie-to-start", json!({})),
            ("tie-to-places", json!({ "points": places, "rest_length": 0.2 })),
            ("tie-to-vertices", json!({ "target": { "body": "block", "vertices": [1, 5, 6] } })),
            ("tie-to-nearest-vertex", json!({ "target": { "body": "block", "nearest_vertex": 9.0 } })),
            (
                "tie-to-nearest-point",
                json!({ "target": { "body": "block", "nearest_point": 9.0 }, "rest_length": 0.3 }),
            ),
        ] {
            let tie = with(&json!({ "body": "particles", "vertices": [0, 1, 2] }), keys);
            cases.push(Case {
                columns,
                element: format!("attachment-{d}d"),
                law: law.to_owned(),
                scene: json!({
                    "dimension": d, "body": [particles, block], "attachment": [with(&tie, ties.clone())],
                }),
                deformations: &[SHAKEN],
            });
        }
    }
    cases
}

/// Everything that takes energy away.
fn dampings() -> Vec<Case> {
    let mut cases = ties(&DAMPING, &json!({ "stiffness": 1.0, "dashpot": 20.0 }));
    let mut elements = solids();
    elements.extend(membranes());
    for shape in elements {
        let linear = json!({ "linear": { "young": 1e6, "poisson": 0.3 } });
        let proportional = json!({ "stiffness_proportional": 0.01 });
        let mut dampings = vec![
            ("strain_rate-shear", rubber(0.3), json!({ "strain_rate": { "shear": 50.0 } })),
            ("strain_rate-second", rubber(0.3), json!({ "strain_rate": { "shear": 0.0, "second": 30.0 } })),
            ("mass_proportional", rubber(0.3), json!({ "mass_proportional": 3.0 })),
            ("stiffness_proportional", rubber(0.3), proportional.clone()),
        ];
        if shape.name == "triangle" || shape.name == "tetrahedron" {
            dampings.push(("stiffness_proportional-of-linear", linear, proportional));
        }
        for (law, elastic, damping) in dampings {
            let keys = json!({ "elastic": elastic, "damping": damping });
            cases.push(shape.case(&DAMPING, law, keys, &[SHAKEN]));
        }
    }
    for net in nets() {
        let formula = json!({
            "dissipation": "c/2*rate^2 + d/4*rate^4*l/l0", "parameters": { "c": 20.0, "d": 3.0 },
        });
        for (law, damping) in [
            ("dashpot", json!({ "dashpot": 20.0 })),
            ("dashpot-formula", json!({ "expression": formula })),
            ("stiffness_proportional", json!({ "stiffness_proportional": 0.1 })),
        ] {
            let keys = json!({ "springs": { "stiffness": 100.0 }, "damping": damping });
            cases.push(net.case(&DAMPING, law, keys, &[SHAKEN]));
        }
        if net.name.starts_with("edges") {
            continue;
        }
        for (law, bending) in bendings(net.dimension, net.name == "cloth") {
            let damping = json!({ "stiffness_proportional": 1.0 });
            let springs = json!({ "stiffness": 1e-6 });
            let keys = json!({ "springs": springs, "bending": bending, "damping": damping });
            let law = format!("stiffness_proportional-of-{law}");
            cases.push(net.case(&DAMPING, &law, keys, &[SHAKEN]));
        }
    }
    cases
}

/// All lines, in the order in which they are recorded.
fn lines() -> Vec<(String, Vec<f64>)> {
    let tied = ties(&ENERGY, &json!({ "stiffness": 1e5 }));
    let cases = [laws(), variants(), loads(), springs(), tied, dampings()];
    let lines: Vec<_> = cases.iter().flatten().flat_map(Case::lines).collect();
    let keys: std::collections::BTreeSet<&String> = lines.iter().map(|(key, _)| key).collect();
    assert_eq!(keys.len(), lines.len(), "every line has a key of its own");
    lines
}

fn columns(key: &str) -> &'static Columns {
    let all = [&ENERGY, &LOAD, &PREDICTION, &DAMPING];
    let kind = key.split(' ').next();
    all.into_iter()
        .find(|columns| kind == Some(columns.kind))
        .unwrap_or_else(|| panic!("{key}: no such kind"))
}

fn text(lines: &[(String, Vec<f64>)]) -> String {
    let mut text = "# What every element and term gives; `tests/element_record.rs` compares it.\n\
                    # Vectors and matrices: the norm, and products with two seeded ones.\n"
        .to_owned();
    for columns in [&ENERGY, &LOAD, &PREDICTION, &DAMPING] {
        let vectors = columns.vectors.join(" ");
        writeln!(text, "# {} element law state {} {vectors}", columns.kind, columns.alone).unwrap();
    }
    for (key, numbers) in lines {
        text.push_str(key);
        numbers.iter().for_each(|number| write!(text, " {number:.11e}").unwrap());
        text.push('\n');
    }
    text
}

/// The recorded numbers of every line, by its words.
fn recorded(text: &str) -> BTreeMap<String, Vec<f64>> {
    let rows = text.lines().filter(|line| !line.starts_with('#')).map(|line| {
        let words: Vec<&str> = line.split(' ').collect();
        let (key, numbers) = words.split_at(4);
        (key.join(" "), numbers.iter().map(|number| number.parse().unwrap()).collect())
    });
    rows.collect()
}

/// The difference of a line from its record: the first number that differs, and the names of the others.
fn difference(columns: &Columns, numbers: &[f64], record: &[f64]) -> Option<String> {
    let count = 1 + 3 * columns.vectors.len();
    if [numbers.len(), record.len()] != [count; 2] {
        return Some(format!("{} numbers, recorded {}, of {count}", numbers.len(), record.len()));
    }
    let differs = |i: usize| {
        // Numbers of a vector are compared on the scale of its norm.
        let scale = if i == 0 { record[0].abs() } else { record[1 + (i - 1) / 3 * 3] };
        let difference = (numbers[i] - record[i]).abs();
        difference.is_nan() || difference > TOLERANCE * scale
    };
    let name = |i: usize| if i == 0 { columns.alone } else { columns.vectors[(i - 1) / 3] };
    let which = |i: usize| match i.checked_sub(1).map(|i| i % 3) {
        None => "",
        Some(0) => "norm of ",
        Some(1) => "first product with ",
        Some(_) => "second product with ",
    };
    let differing: Vec<usize> = (0..count).filter(|i| differs(*i)).collect();
    let first = *differing.first()?;
    let numbers = format!("{:.11e}, recorded {:.11e}", numbers[first], record[first]);
    let mut others: Vec<&str> = differing.iter().map(|i| name(*i)).filter(|of| *of != name(first)).collect();
    others.dedup();
    let others = others.iter().fold(String::new(), |text, other| text + ", " + other);
    Some(format!("{}{} {numbers}{others}", which(first), name(first)))
}

/// Lines that differ from the record, with their differences.
fn faults(found: &[(String, Vec<f64>)], mut recorded: BTreeMap<String, Vec<f64>>) -> Vec<String> {
    let mut faults = vec![];
    for (key, numbers) in found {
        let fault = match recorded.remove(key) {
            None => Some("has no record".to_owned()),
            Some(record) => difference(columns(key), numbers, &record),
        };
        faults.extend(fault.map(|fault| format!("{key}: {fault}")));
    }
    faults.extend(recorded.keys().map(|key| format!("{key}: is recorded, and no longer there")));
    faults
}

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/element_record.txt")
}

#[test]
fn every_element_and_term_gives_the_numbers_that_were_recorded() {
    let found = lines();
    if std::env::var_os("PLIANT_RECORD_ELEMENTS").is_some() {
        std::fs::write(file(), text(&found)).unwrap();
    }
    let faults = faults(&found, recorded(&std::fs::read_to_string(file()).unwrap()));
    let shown = faults[..faults.len().min(MOST_FAULTS)].join("\n");
    assert!(faults.is_empty(), "{} lines differ; {HOW_TO_RECORD}\n{shown}", faults.len());
}

#[test]
fn a_record_catches_a_wrong_digit_and_lets_rounding_pass() {
    let key = "prediction triangle law shaken".to_owned();
    let numbers = vec![2.0, 5.0, 3.0, 1e-12, 4.0, 0.5, -2.0];
    let record = || recorded(&text(&[(key.clone(), numbers.clone())]));
    let of = |numbers: Vec<f64>| faults(&[(key.clone(), numbers)], record());
    assert_eq!(of(numbers.iter().map(|number| number + 5e-13).collect()), [] as [&str; 0]);
    for i in 0..numbers.len() {
        let mut wrong = numbers.clone();
        wrong[i] += 1e-8;
        assert_eq!(of(wrong).len(), 1, "{i}");
    }
    let other = vec![("energy triangle law shaken".to_owned(), vec![0.0; 13])];
    assert_eq!(faults(&other, record()).len(), 2, "a line too many and one too few");
}
