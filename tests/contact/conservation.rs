//! Quantities that contact may not change: momenta to rounding, and angular momentum with friction by no
//! more than the couple of forces that act a gap apart.

use pliant::simulation::Simulation;

use super::scenes::crossings;
use super::setups::{FLOOR, head, solid};

/// Largest component of a difference.
fn change(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).fold(0.0, |most: f64, k| most.max((a[k] - b[k]).abs()))
}

/// Two soft bodies that collide with friction, by the law of explicit steps.
fn rubbing(friction: f64, step: f64) -> Simulation {
    let keys = format!("stiffness = 2e5, friction = {friction:?}, threshold_speed = 0.1");
    let text = super::collision::scaled("'symplectic-euler'", step, [1.0, 1.0], &keys);
    super::assembled(&text.replace(", solver = { tolerance = 1e-12 }", "")).simulation
}

/// Friction acts on two points a gap apart: angular momentum changes by its couple, at most `mu lambda dhat`,
/// and linear momentum not at all.
#[test]
fn friction_changes_angular_momentum_by_its_couple_at_most() {
    let (friction, step, distance) = (0.3, 5e-5, 0.02);
    let mut simulation = rubbing(friction, step);
    let first = simulation.diagnostics();
    let mut most = 0.0;
    for _ in 0..4000 {
        let before: f64 = simulation.contacts().iter().map(|contact| contact.force).sum();
        super::advance(&mut simulation, 1);
        let after: f64 = simulation.contacts().iter().map(|contact| contact.force).sum();
        // Forces within a step are those at one of its ends.
        most += friction * before.max(after) * distance * step;
    }
    let end = simulation.diagnostics();
    let turned = change(end.angular_momentum, first.angular_momentum);
    let drift = change(end.linear_momentum, first.linear_momentum);
    assert!(drift < 47e-12, "{drift:e} of 47 kg m/s");
    // There is a couple, and it is bounded.
    assert!(turned < most && turned > 1e-6, "{turned:e} kg m^2/s, at most {most:e}");
    // Friction goes by what was, so that the books close by the first power of the step.
    let off = (end.conserved() / first.conserved() - 1.0).abs();
    assert!(off < 2e-3, "energy is off by {off:e}");
}

/// A sheet with the section of a hairpin, whose legs fly at each other: they meet, and momenta stay those
/// of the start. Nothing outside holds it.
#[test]
fn a_sheet_that_closes_on_itself_keeps_its_momenta() {
    let section =
        [[0.0, 0.03], [0.04, 0.03], [0.08, 0.03], [0.1, 0.015], [0.08, 0.0], [0.04, 0.001], [0.0, 0.0]];
    let (mut points, mut velocities, mut triangles) = (vec![], vec![], vec![]);
    for row in 0..4u32 {
        for (i, [x, z]) in section.iter().enumerate() {
            let along = f64::from(row);
            // Vertices of one leg are not above those of the other.
            points.push([x + 0.003 * along, 0.03 * along + 0.05 * z, *z]);
            let closing = [-1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 1.1][i];
            velocities.push([0.2, -0.1 * along, closing]);
        }
    }
    for row in 0..3 {
        for i in 0..6 {
            let a = 7 * row + i;
            triangles.extend([[a, a + 1, a + 8], [a, a + 8, a + 7]]);
        }
    }
    let text = format!(
        "dimension = 3\ntime = {{ integrator = 'velocity-verlet', step = 2e-5, duration = 0.06 }}\n\
         contact = {{ distance = 2e-3 }}\n\
         [[body]]\nname = 'sheet'\nmesh = {{ inline = {{ points = {points:?}, triangles = {triangles:?} }} \
         }}\n\
         membrane = {{ thickness = 1e-3 }}\nmass = {{ density = 1000 }}\n\
         elastic = {{ stable-neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\n\
         velocity = {{ per_vertex = {velocities:?} }}\n"
    );
    let mut assembly = super::assembled(&text);
    let first = assembly.simulation.diagnostics();
    for _ in 0..30 {
        super::advance(&mut assembly.simulation, 100);
        let found = crossings(&assembly);
        assert!(found.is_empty(), "{found:?} at {} s", assembly.simulation.state().time);
    }
    assert!(assembly.simulation.contact_extremes().hardest.is_some(), "the legs meet");
    let end = assembly.simulation.diagnostics();
    let mass: f64 = assembly.simulation.system().mass().iter().sum();
    let drift = change(end.linear_momentum, first.linear_momentum);
    let turned = change(end.angular_momentum, first.angular_momentum);
    // Of a metre a second, and of that a tenth of a metre from the middle.
    assert!(drift < 1e-12 * mass && turned < 1e-13 * mass, "{drift:e} and {turned:e} of {mass} kg");
    let off = (end.conserved() - first.conserved()).abs() / first.conserved();
    assert!(off < 1e-3, "energy is off by {off:e}");
}

/// The corners of a face share its area evenly, whatever the diagonal that splits it: what lands flat on all
/// of its lower face does not begin to turn.
#[test]
fn a_box_of_hexahedra_that_lands_flat_does_not_turn() {
    let mesh = "grid = { cells = [1, 1, 1], size = [0.1, 0.1, 0.1], origin = [-0.05, -0.05, 0.011], element \
                = 'hexahedron' }";
    let text = head(1e-3, -9.81, "distance = 1e-3") + FLOOR + &solid("box", mesh, 1e5, 1000.0, "");
    let mut simulation = super::assembled(&text).simulation;
    let (mut fastest, mut turned) = (0.0_f64, 0.0_f64);
    for _ in 0..150 {
        super::advance(&mut simulation, 1);
        let now = simulation.diagnostics();
        fastest = fastest.max(now.linear_momentum[2]);
        turned = turned.max(change(now.angular_momentum, [0.0; 3]));
    }
    assert!(fastest > 0.1, "it bounces: {fastest} kg m/s");
    assert!(turned < 1e-10, "{turned:e} kg m^2/s beside {fastest} kg m/s");
}
