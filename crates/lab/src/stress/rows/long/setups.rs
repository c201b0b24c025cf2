//! Scenes that challenge contact solvers, in any size.

use std::f64::consts::PI;
use std::fmt::Write;

/// Solid of the usual material; `mesh` is in a scene's notation.
pub(crate) fn solid(name: &str, mesh: &str, young: f64, density: f64, more: &str) -> String {
    format!(
        "[[body]]\nname = '{name}'\nmesh = {{ {mesh} }}\n\
         elastic = {{ neo-hookean = {{ young = {young:?}, poisson = 0.4 }} }}\n\
         mass = {{ density = {density:?} }}\n{more}\n"
    )
}

pub(crate) fn grid(cells: [usize; 3], size: [f64; 3], origin: [f64; 3]) -> String {
    format!("grid = {{ cells = {cells:?}, size = {size:?}, origin = {origin:?} }}")
}

pub(crate) fn head(step: f64, gravity: f64, contact: &str) -> String {
    format!(
        "dimension = 3\ntime = {{ integrator = 'implicit-euler', step = {step:?}, duration = 100.0 }}\n\
         world = {{ gravity = [0, 0, {gravity:?}] }}\ncontact = {{ {contact} }}\n"
    )
}

pub(crate) const FLOOR: &str =
    "[[obstacle]]\nname = 'floor'\nshape = { half_space = { normal = [0, 0, 1], offset = 0 } }\n";

/// Radius of the compressed ball [m].
pub(crate) const PRESSED_RADIUS: f64 = 0.1;

/// A ball on a floor under a plate that descends for half a second and rises again; then they separate.
pub(crate) fn press(cells: usize, step: f64) -> String {
    let ball = format!("ball = {{ cells = {cells}, radius = {PRESSED_RADIUS:?}, centre = [0, 0, 0.101] }}");
    let moves = |down: f64, away: f64| {
        format!(
            "motion = {{ keyframes = {{ times = [0, 0.5, 1.0, 1.3], smooth = true, \
             displacements = [[0, 0, 0], [0, 0, {down:?}], [0, 0, 0], [0, 0, {away:?}]] }} }}\n"
        )
    };
    let plate = "[[obstacle]]\nname = 'plate'\n\
        shape = { box = { min = [-0.6, -0.6, 0.202], max = [0.6, 0.6, 0.25] } }\n";
    let ball = solid("ball", &ball, 1e5, 1000.0, "");
    head(step, 0.0, "distance = 1e-3") + FLOOR + &moves(0.0, -1.0) + &ball + plate + &moves(-0.182, 1.0)
}

/// Number of stones of the arch.
pub(crate) const STONES: usize = 25;
/// Radii of the arch [m].
const RADII: [f64; 2] = [0.85, 1.15];

/// A semicircle of stones on a floor, with faces just within the activation distance `distance` [m].
pub(crate) fn arch(distance: f64, friction: f64) -> String {
    let gap = 0.999 * distance;
    let turn = PI / STONES as f64;
    // The stones are moved outwards by this much, which leaves the gap between their faces.
    let out = 0.5 * gap / (0.5 * turn).sin();
    let mut text = format!(
        "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 100.0 }}\n\
         world = {{ gravity = [0, -9.81] }}\n\
         contact = {{ distance = {distance:?}, friction = {friction:?}, threshold_speed = 1e-4 }}\n\
         [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
    );
    for k in 0..STONES {
        let (sin, cos) = ((k as f64 + 0.5) * turn).sin_cos();
        let corner = |radius: f64, angle: f64| {
            let (s, c) = angle.sin_cos();
            [radius * c + out * cos, radius * s + out * sin + 0.5 * gap]
        };
        let (from, to) = (k as f64 * turn, (k + 1) as f64 * turn);
        let points =
            [corner(RADII[0], from), corner(RADII[1], from), corner(RADII[1], to), corner(RADII[0], to)];
        let _ = write!(
            text,
            "[[body]]\nname = 'stone{k}'\n\
             mesh = {{ inline = {{ points = {points:?}, triangles = [[0, 1, 2], [0, 2, 3]] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 2e10, poisson = 0.2 }} }}\nmass = {{ density = 2300 }}\n"
        );
    }
    text
}

/// A hundred points in a plane, 2 cm apart.
pub(crate) fn needles() -> Vec<[f64; 3]> {
    (0..100).map(|i| [f64::from(i / 10) * 0.02 - 0.09, f64::from(i % 10) * 0.02 - 0.09, 0.0]).collect()
}

/// A ball of radius 0.1 m that falls on these points at 1 m/s.
pub(crate) fn ball_on_needles(cells: usize) -> String {
    let needles = format!(
        "[[body]]\nname = 'needles'\nmesh = {{ inline = {{ points = {:?} }} }}\nmass = {{ per_vertex = 1.0 \
         }}\n\
         contact = {{ self = false }}\npin = [{{ box = {{ min = [-1, -1, -1], max = [1, 1, 0.001] }} }}]\n",
        needles()
    );
    let ball = format!("ball = {{ cells = {cells}, radius = 0.1, centre = [0.003, 0.004, 0.12] }}");
    head(0.01, -9.81, "distance = 2e-3, friction = 0.3")
        + &solid("ball", &ball, 2e4, 1000.0, "velocity = { rigid = { linear = [0, 0, -1] } }")
        + &needles
}

/// True if a tetrahedron of positive volume contains a point.
pub(crate) fn holds([a, b, c, d]: [[f64; 3]; 4], p: [f64; 3]) -> bool {
    let minus = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| a[k] - b[k]);
    let volume = |a, b, c, d| {
        let [u, v, w] = [minus(b, a), minus(c, a), minus(d, a)];
        u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
            + u[2] * (v[0] * w[1] - v[1] * w[0])
    };
    volume(p, b, c, d) > 0.0
        && volume(a, p, c, d) > 0.0
        && volume(a, b, p, d) > 0.0
        && volume(a, b, c, p) > 0.0
}

/// A sheet of 1 m that falls on nine upright triangles with tips 0.2 m high.
pub(crate) fn sheet_on_knives(cells: usize) -> String {
    let (mut points, mut triangles) = (vec![], vec![]);
    for k in 0..9 {
        let x = 0.1 * f64::from(k) - 0.4;
        points.extend([[x, -0.3, 0.0], [x, 0.3, 0.0], [x, 0.05 * f64::from(k % 3), 0.2]]);
        triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
    }
    let knives = format!(
        "[[obstacle]]\nname = 'knives'\n\
         shape = {{ mesh = {{ inline = {{ points = {points:?}, triangles = {triangles:?} }} }} }}\n"
    );
    let sheet = format!(
        "[[body]]\nname = 'sheet'\n\
         mesh = {{ cloth = {{ cells = [{cells}, {cells}], origin = [-0.5, -0.5, 0.21], u = [1, 0, 0], v = \
         [0, 1, 0] }} }}\n\
         membrane = {{ thickness = 1e-3 }}\nelastic = {{ stable-neo-hookean = {{ young = 2e4, poisson = 0.3 \
         }} }}\n\
         mass = {{ density = 1000 }}\n"
    );
    head(0.01, -9.81, "distance = 1e-3, friction = 0.2") + &sheet + &knives
}

/// A sheet of 0.3 m that flies at another at 100 m/s, a metre per step; `radius` is half of their contact
/// thickness [m].
pub(crate) fn sheet_at_sheet(cells: usize, radius: f64) -> String {
    let sheet = |name: &str, z: f64, turn: &str, velocity: f64| {
        format!(
            "[[body]]\nname = '{name}'\n\
             mesh = {{ cloth = {{ cells = [{cells}, {cells}], origin = [-0.15, -0.15, {z:?}], u = [0.3, 0, \
             0], v = [0, 0.3, 0] }} }}\n\
             {turn}\nmembrane = {{ thickness = 1e-3 }}\ncontact = {{ radius = {radius:?} }}\n\
             elastic = {{ stable-neo-hookean = {{ young = 1e6, poisson = 0.3 }} }}\nmass = {{ density = 1.0 \
             }}\n\
             velocity = {{ rigid = {{ linear = [0, 0, {velocity:?}] }} }}\n"
        )
    };
    let turn = "transform = { rotate = { axis = [0, 0, 1], angle = 0.3 } }";
    head(0.01, 0.0, "distance = 1e-3")
        .replace("duration = 100.0", "duration = 100.0, solver = { retries = 8 }")
        + &sheet("still", 0.0, "", 0.0)
        + &sheet("flies", 0.45, turn, -100.0)
}
