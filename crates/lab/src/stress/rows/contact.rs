//! K18: contact far from its intended range: steps of a second, a barrier too soft and too stiff, an
//! activation distance far below and far above a gap, bodies of different masses and stiffnesses.

use pliant::quantity::Rounded;
use pliant::simulation::Simulation;

use super::CaseDescription;
use crate::stress::scenes::{self, assemble};
use crate::stress::{Case, CaseResult, CaseVerdict};

/// Limit on Newton iterations, as a multiple of those of an independent program.
const BAR: f64 = 3.0;
/// Remaining fraction of the activation distance below which the barrier is nearly exhausted.
const OVERLOAD: f64 = 0.05;

/// Notes the least gap of a case as a fraction of its activation distance; one almost used up is flagged.
pub(super) fn note_gap(findings: &mut CaseResult, gap: f64) {
    let told = format!("least gap {} % of its distance", Rounded::<3>(100.0 * gap));
    match gap < OVERLOAD {
        true => findings.note(CaseVerdict::Flagged, format!("overload: {told}")),
        false => findings.note(CaseVerdict::Pass, told),
    }
}

/// A block of 0.2 m that falls at 3 m/s on a layer of 0.5 m x 0.1 m.
#[derive(Clone, Copy)]
struct Fall {
    /// Contact stiffness `kappa / E`, with `E` of the softer body.
    stiffness: f64,
    /// Activation distance `dhat` [m].
    distance: f64,
    step: f64,
    steps: u64,
    /// Density and Young's modulus of the block relative to the layer.
    ratios: [f64; 2],
    friction: f64,
    /// Newton iterations per step of an independent program; `None` if it was not run, or failed.
    known: Option<f64>,
}

const USUAL: Fall = Fall {
    stiffness: 1.0,
    distance: 1e-3,
    step: 0.01,
    steps: 30,
    ratios: [1.0, 1.0],
    friction: 0.0,
    known: Some(5.5),
};

/// Two stacked blocks on a floor, from the lowest: density [kg/m^3] and Young's modulus [Pa].
const STACKS: [(&str, [[f64; 2]; 2]); 4] = [
    ("a stack, a millionth of the mass above", [[1e3, 1e5], [1e-3, 1e5]]),
    ("a stack, a millionth of the mass below", [[1e-3, 1e5], [1e3, 1e5]]),
    ("a stack, a million times as stiff above", [[1e3, 1e5], [1e3, 1e11]]),
    ("a stack, a million times as stiff below", [[1e3, 1e11], [1e3, 1e5]]),
];
/// Newton iterations per step of the independent program in the hardest fall that it completed.
const KNOWN_OF_RATIOS: f64 = 11.0;

pub(super) fn add(cases: &mut Vec<Case>) {
    let mut falls = vec![];
    for (stiffness, known) in
        [(1e-3, 5.4), (1e-2, 5.4), (0.1, 5.2), (1.0, 5.5), (10.0, 6.1), (100.0, 7.6), (1e3, 7.6)]
    {
        let fall = Fall { stiffness, known: Some(known), ..USUAL };
        falls.push((format!("a block falls, kappa / E = {stiffness}"), fall));
    }
    for (distance, known) in [(1e-5, 13.0), (1e-4, 7.0), (1e-2, 4.9), (0.0125, 4.9)] {
        // Relative to cells of 0.05 m: from 2e-4 to a quarter of an edge.
        let fall = Fall { distance, known: Some(known), ..USUAL };
        falls.push((format!("a block falls, dhat = {distance} m"), fall));
    }
    // Without friction the block slides off within a step.
    falls.push((
        "a block falls, step 1 s".into(),
        Fall { step: 1.0, steps: 4, friction: 0.4, known: None, ..USUAL },
    ));
    for (name, ratios, known) in [
        ("a block falls, 1000 times as heavy", [1e3, 1.0], 11.0),
        ("a block falls, 10,000 times as stiff", [1.0, 1e4], 5.5),
    ] {
        falls.push((name.into(), Fall { ratios, known: Some(known), ..USUAL }));
    }
    for (name, fall) in falls {
        cases.push(described(&name).case(move || run_fall(&fall)));
    }
    for (name, blocks) in &STACKS {
        cases.push(described(name).case(move || run_stack(blocks)));
    }
}

fn described(name: &str) -> CaseDescription<'_> {
    CaseDescription {
        row: "K18",
        name,
        dimension: 2,
        material: "neo-hookean",
        poisson: Some(0.3),
        integrator: "implicit-euler",
        quick: true,
    }
}

fn block(name: &str, cells: [usize; 2], at: [[f64; 2]; 2], [density, young]: [f64; 2], keys: &str) -> String {
    let [origin, size] = at;
    format!(
        "[[body]]\nname = '{name}'\nmesh = {{ grid = {{ cells = {cells:?}, size = {size:?}, origin = \
         {origin:?} }} }}\n\
         elastic = {{ neo-hookean = {{ young = {young:?}, poisson = 0.3 }} }}\nmass = {{ density = \
         {density:?} }}\n{keys}\n"
    )
}

fn run_fall(fall: &Fall) -> CaseResult {
    let Fall { stiffness, distance, step, steps, ratios, friction, known } = *fall;
    let young = 1e5 * ratios[1].min(1.0);
    let text = format!(
        "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = {step:?}, duration = 10.0, solver = \
         {{ tolerance = 1e-8 }} }}\n\
         world = {{ gravity = [0, -9.81] }}\ncontact = {{ distance = {distance:?}, stiffness = {:?}, \
         friction = {friction:?} }}\n{}{}",
        stiffness * young,
        block(
            "layer",
            [5, 2],
            [[0.0, 0.0], [0.5, 0.1]],
            [1e3, 1e5],
            "pin = [{ half_space = { normal = [0, 1], offset = 0 } }]"
        ),
        block(
            "block",
            [4, 4],
            [[0.12, 0.12], [0.2, 0.2]],
            [1e3 * ratios[0], 1e5 * ratios[1]],
            "velocity = { rigid = { linear = [0, -3] } }"
        ),
    );
    run(&text, steps, known, |simulation, findings| {
        let x = simulation.positions();
        // The block stays above the bottom of the layer, however compressed that is.
        let lowest = x[36..].chunks(2).map(|x| x[1]).fold(f64::INFINITY, f64::min);
        findings.demand(lowest > 0.0, || format!("the block is {:.3e} m below the layer", -lowest));
    })
}

fn run_stack(blocks: &[[f64; 2]; 2]) -> CaseResult {
    let distance = 1e-3;
    let bodies: Vec<String> = blocks
        .iter()
        .enumerate()
        .map(|(i, constants)| {
            let origin = [0.013 * i as f64, 0.9 * distance + i as f64 * (0.2 + 0.9 * distance)];
            block(["low", "high"][i], [3, 3], [origin, [0.2, 0.2]], *constants, "")
        })
        .collect();
    let text = format!(
        "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 10.0, solver = {{ \
         tolerance = 1e-8 }} }}\n\
         world = {{ gravity = [0, -9.81] }}\ncontact = {{ distance = {distance:?}, friction = 0.5 }}\n{}\
         [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n",
        bodies.concat()
    );
    run(&text, 100, Some(KNOWN_OF_RATIOS), |simulation, findings| {
        // The compression is less than that of the softer block under the weight of both, doubled for its
        // lower corners: `2 rho g H^2 / E`.
        let soft = blocks.iter().map(|[_, young]| *young).fold(f64::INFINITY, f64::min);
        let weight = blocks.iter().map(|[density, _]| density * 9.81 * 0.2).sum::<f64>();
        let x = simulation.positions();
        let mean = x[32..64].chunks(2).map(|x| x[1]).sum::<f64>() / 16.0;
        let sunk = 0.3 + 1.8 * distance - mean;
        let most = 2.0 * 0.4 * weight / soft + distance;
        findings.demand(sunk.abs() < most, || {
            format!("the upper block sank by {sunk:.3e} m, more than {most:.1e} m")
        });
        let fastest = simulation.state().v().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        findings.demand(fastest < 0.01, || format!("it still moves at {fastest:.1e} m/s after a second"));
    })
}

/// Runs the case: each step must be solved without contact or crossing; less than a twentieth of an
/// activation distance left is flagged.
fn run(
    text: &str,
    steps: u64,
    known: Option<f64>,
    check: impl Fn(&Simulation, &mut CaseResult),
) -> CaseResult {
    let mut assembly = assemble(text);
    let mut findings = CaseResult::default();
    let outlines: Vec<Vec<[u32; 2]>> =
        assembly.topology.bodies.iter().map(|body| outline(&body.triangles)).collect();
    let simulation = &mut assembly.simulation;
    let mut least: (f64, f64) = (f64::INFINITY, f64::INFINITY);
    // Steps, with the smallest gap and a test for crossings.
    for _ in 0..steps {
        if let Err(error) = simulation.step() {
            findings.note(CaseVerdict::Fail, error.to_string());
            break;
        }
        for contact in simulation.contacts() {
            if contact.relative_gap < least.0 {
                least = (contact.relative_gap, contact.gap);
            }
        }
        let x = simulation.positions();
        findings.demand(!crosses(&outlines, &x), || "two bodies cross each other".into());
        if findings.verdict == CaseVerdict::Fail {
            break;
        }
    }
    let solver = simulation.work().solver.unwrap_or_default();
    let bar = known.map(|known| (BAR * known * steps as f64) as u64);
    if solver.unsettled > 0 {
        // A run would warn of this; its result is not reliable.
        findings.count(solver.newton_iterations, None);
        let told = format!("unsettled: friction still changed at the end of {} solves", solver.unsettled);
        findings.note(CaseVerdict::Flagged, told);
    } else {
        findings.count(solver.newton_iterations, bar);
    }
    // Gaps, energy and the case's own criterion.
    findings.demand(least.1 > 0.0, || format!("a gap of {:.3e} m", least.1));
    findings.demand(least.1.is_finite(), || "nothing touched".into());
    note_gap(&mut findings, least.0);
    let diagnostics = simulation.diagnostics();
    findings.demand(diagnostics.total.is_finite(), || "the energy is not finite".into());
    findings.note_inversion(&diagnostics);
    if solver.unsettled == 0 {
        check(simulation, &mut findings);
    }
    findings.picture = Some(scenes::picture(simulation, &assembly.topology));
    findings
}

/// Edges of a single triangle.
fn outline(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    sides.sort_unstable();
    sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

/// True if edges of two bodies cross, by the signs of areas.
fn crosses(outlines: &[Vec<[u32; 2]>], x: &[f64]) -> bool {
    let at = |v: u32| [x[2 * v as usize], x[2 * v as usize + 1]];
    let side = |a: u32, b: u32, c: u32| {
        let ([ax, ay], [bx, by], [cx, cy]) = (at(a), at(b), at(c));
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    };
    let cross = |[a, b]: [u32; 2], [c, d]: [u32; 2]| {
        side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
    };
    outlines.iter().enumerate().any(|(i, own)| {
        let others = outlines[i + 1..].iter().flatten();
        others.into_iter().any(|other| own.iter().any(|edge| cross(*edge, *other)))
    })
}
