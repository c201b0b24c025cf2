//! Bending stiffness of bodies: hinges of sheets, joints of strands.

use super::body::{BodyAssembly, distance, renumbered, spread};
use crate::BendingRest;
use crate::BendingSpec;
use crate::KeyPath;
use crate::Problem;
use pliant::energy::elastic::points_of;
use pliant::energy::measure::{Curvature, HingeAngle, ScalarStrain, StencilConstants};
use pliant::numbering::Numbering;
use pliant::quantity::Kind;
use pliant::system::System;
use pliant_mesh::Mesh;
use pliant_terms::{hinge_dashpots, joint_dashpots};

/// Curvature below which a joint counts as straight: smaller values are rounding errors.
const STRAIGHT: f64 = 1e-6;

/// The hinges of a sheet, the joints of a strand.
#[derive(Default)]
pub(super) struct BendingPlan {
    /// Edge, then the opposite vertices; numbered from 0 in the body.
    hinges: Vec<[u32; 4]>,
    /// A vertex between its two neighbours.
    joints: Vec<[u32; 3]>,
    /// Constants of each hinge or joint.
    constants: Vec<StencilConstants>,
}

impl BendingPlan {
    pub(super) fn new(
        spec: &BendingSpec,
        mesh: &Mesh,
        springs: &[[u32; 2]],
        path: &KeyPath,
        problems: &mut Vec<Problem>,
    ) -> Self {
        let mut bends = BendingPlan::default();
        let sheet = mesh.element_dimension() == 2 && mesh.dimension == 3;
        let strand = mesh.element_dimension() < 2;
        if sheet {
            match mesh.hinges() {
                Ok(hinges) => bends.hinges = hinges,
                Err(message) => problems.push(Problem::semantic(path.clone(), message)),
            }
        } else if strand {
            bends.joints = joints(mesh.vertex_count(), springs);
        }
        // Checks of the stencils and of the units.
        if bends.count() == 0 {
            let message = "`bending` acts between two triangles of a sheet in 3D, or between two edges in a \
                           row; this body has neither";
            problems.push(Problem::semantic(path.clone(), message));
            return bends;
        }
        let kind = if sheet || mesh.dimension == 2 { Kind::PLATE_STIFFNESS } else { Kind::BEAM_STIFFNESS };
        if let Some(said) = spec.stiffness.and_then(|s| s.dimension)
            && said != kind.dimension
        {
            let message = format!("`stiffness` is in [{said}], but here it is {}", kind.described());
            problems.push(Problem::semantic(path.key("stiffness"), message));
        }
        if spec.poisson.is_some() && !sheet {
            let message = "`poisson` is for sheets: a strand is free to change its thickness";
            problems.push(Problem::semantic(path.key("poisson"), message));
        }
        let stiffness = stiffness(spec, sheet, mesh.dimension);
        let what = if sheet { ["hinge", "hinges"] } else { ["joint", "joints"] };
        let count = bends.count();
        // Angles in the reference configuration, and the constants of each hinge or joint.
        let angles = match &spec.rest {
            Some(BendingRest::Angle(angles)) => {
                Some(spread(angles, count, what, path.key("rest").key("angle"), problems))
            }
            Some(BendingRest::Flat) => Some(vec![0.0; count]),
            Some(BendingRest::Mesh) | None => None,
        };
        let angle = |i: usize| angles.as_ref().map(|angles| angles[i]);
        if sheet {
            bends.constants =
                bends.hinges.iter().enumerate().map(|(i, h)| hinge(mesh, h, stiffness, angle(i))).collect();
        } else {
            if mesh.dimension == 3
                && let Some(angle) = angles.iter().flatten().find(|angle| **angle < 0.0)
            {
                let message = format!("in 3D the angle of a joint has no sign, got {angle:?} [rad]");
                problems.push(Problem::semantic(path.key("rest").key("angle"), message));
            }
            bends.constants =
                bends.joints.iter().enumerate().map(|(i, j)| joint(mesh, j, stiffness, angle(i))).collect();
        }
        bends
    }

    /// Number of hinges and joints.
    pub(super) fn count(&self) -> usize {
        self.hinges.len() + self.joints.len()
    }

    /// Adds the energies to `system`.
    pub(super) fn add_terms(
        &self,
        body: &BodyAssembly,
        rest: &[f64],
        numbering: &Numbering,
        system: &mut System,
    ) {
        let BendingPlan { hinges, joints, constants } = self;
        if !hinges.is_empty() {
            let hinges = global(hinges, body, numbering);
            system.add_term(pliant_terms::hinges(&body.name, &hinges, constants, rest));
        }
        if !joints.is_empty() {
            let joints = global(joints, body, numbering);
            system.add_term(pliant_terms::joints(system.dimension(), &body.name, &joints, constants, rest));
        }
    }

    /// Adds stiffness-proportional damping with the factor `beta` [s].
    pub(super) fn add_damping(
        &self,
        beta: f64,
        body: &BodyAssembly,
        rest: &[f64],
        numbering: &Numbering,
        system: &mut System,
    ) {
        let damped = |c: &StencilConstants| StencilConstants { stiffness: beta * c.stiffness, ..*c };
        let constants: Vec<StencilConstants> = self.constants.iter().map(damped).collect();
        if !self.hinges.is_empty() {
            let hinges = global(&self.hinges, body, numbering);
            system.add_dissipation(hinge_dashpots(&body.name, &hinges, &constants, rest));
        }
        if !self.joints.is_empty() {
            let joints = global(&self.joints, body, numbering);
            let dimension = system.dimension();
            system.add_dissipation(joint_dashpots(dimension, &body.name, &joints, &constants, rest));
        }
    }
}

fn global<const N: usize>(cells: &[[u32; N]], body: &BodyAssembly, numbering: &Numbering) -> Vec<[u32; N]> {
    cells.iter().map(|cell| renumbered(cell, body.first_vertex, numbering)).collect()
}

/// Vertices with exactly two edges, each with the other ends. The first edge leads to the vertex, so that
/// the joints of a strand with consecutive edges follow the strand.
fn joints(vertices: usize, edges: &[[u32; 2]]) -> Vec<[u32; 3]> {
    let mut ends = vec![vec![]; vertices];
    for &[a, b] in edges {
        ends[a as usize].push(b);
        ends[b as usize].push(a);
    }
    let joint = |(v, ends): (usize, &Vec<u32>)| match ends[..] {
        [a, b] => Some([a, v as u32, b]),
        _ => None,
    };
    ends.iter().enumerate().filter_map(joint).collect()
}

/// Bending stiffness: moment per curvature [N m, N m^2].
fn stiffness(spec: &BendingSpec, sheet: bool, dimension: usize) -> f64 {
    if let Some(stiffness) = spec.stiffness {
        return stiffness.value;
    }
    let (young, h) = (spec.young.unwrap_or(0.0), spec.thickness.unwrap_or(0.0));
    match (sheet, dimension) {
        (true, _) => young * h.powi(3) / (12.0 * (1.0 - spec.poisson.unwrap_or(0.0).powi(2))),
        (false, 2) => young * h.powi(3) / 12.0,
        (false, _) => young * std::f64::consts::PI * h.powi(4) / 64.0,
    }
}

/// Constants of a hinge: `k = D |e|^2 / (A_1 + A_2)` [J].
fn hinge(mesh: &Mesh, hinge: &[u32; 4], stiffness: f64, angle: Option<f64>) -> StencilConstants {
    let x: [[f64; 3]; 4] = points_of(&mesh.points, hinge);
    // Twice the area of a triangle: the length of its normal.
    let area = |a: usize| {
        let edge = |b: usize| [0, 1, 2].map(|c| x[b][c] - x[0][c]);
        let (e, f) = (edge(1), edge(a));
        let component = |c: usize| e[(c + 1) % 3] * f[(c + 2) % 3] - e[(c + 2) % 3] * f[(c + 1) % 3];
        0.5 * (0..3).map(|c| component(c).powi(2)).sum::<f64>().sqrt()
    };
    let angle = angle.unwrap_or_else(|| HingeAngle::deviation(&x, &[1.0, 0.0]).0);
    StencilConstants {
        stiffness: stiffness * distance(&x[0], &x[1]).powi(2) / (area(2) + area(3)),
        rest: [libm::cos(angle), libm::sin(angle)],
    }
}

/// Constants of a joint: `k = 2 B / (l_1 + l_2)` [J].
fn joint(mesh: &Mesh, joint: &[u32; 3], stiffness: f64, angle: Option<f64>) -> StencilConstants {
    let point = |i: usize| mesh.point(joint[i] as usize);
    let measured = || {
        let curvature = if mesh.dimension == 2 {
            <Curvature as ScalarStrain<2, 3>>::deviation(&points_of(&mesh.points, joint), &[0.0; 2]).0
        } else {
            <Curvature as ScalarStrain<3, 3>>::deviation(&points_of(&mesh.points, joint), &[0.0; 2]).0
        };
        if curvature.abs() < STRAIGHT { 0.0 } else { curvature }
    };
    StencilConstants {
        stiffness: 2.0 * stiffness / (distance(point(0), point(1)) + distance(point(1), point(2))),
        rest: [angle.map_or_else(measured, |angle| 2.0 * libm::tan(0.5 * angle)), 0.0],
    }
}
