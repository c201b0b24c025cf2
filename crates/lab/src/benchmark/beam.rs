//! Beams of tetrahedra: 0.4 x 0.1 x 0.1 m, E = 5e5 Pa, nu = 0.4, 1000 kg/m^3, fixed at x = 0, symplectic
//! Euler.

use super::scatter::Scatter;
use super::stepping::displaced;
use super::{BenchmarkError, Metric};
use pliant_scene::Scene;

/// Cells of the smaller beam, 98,304 tets.
pub(super) const SMALL: [usize; 3] = [64, 16, 16];
/// Cells of the larger beam, 983,040 tets.
pub(super) const LARGE: [usize; 3] = [160, 32, 32];

/// Number of tetrahedra: six per cell.
pub(super) fn tets(cells: [usize; 3]) -> u64 {
    6 * cells.iter().product::<usize>() as u64
}

/// Rate in millions of tetrahedra per second.
pub(super) fn rate(cells: [usize; 3]) -> Metric {
    Metric::Rate { per_repetition: tets(cells) as f64, scale: 1e-6, unit: "M tet-steps/s" }
}

/// Material of this name, in TOML.
fn named(material: &str) -> String {
    format!("{material} = {{ young = 5e5, poisson = 0.4 }}")
}

fn text(cells: [usize; 3], elastic: &str, stress: &str, step: f64) -> String {
    format!(
        "dimension = 3
        time = {{ integrator = 'symplectic-euler', step = {step:?}, duration = 1.0 }}
        world = {{ gravity = [0.0, 0.0, -9.81] }}
        [[body]]
        mesh = {{ grid = {{ cells = {cells:?}, size = [0.4, 0.1, 0.1] }} }}
        elastic = {{ {elastic} }}
        stress = '{stress}'
        mass = {{ density = 1000.0 }}
        pin = [{{ half_space = {{ normal = [1.0, 0.0, 0.0], offset = 0.0 }} }}]"
    )
}

/// Beam stretched and compressed by up to 5 % in waves: `x_c = X_c (1 + 0.05 sin(40 X_(c+1) + c))`. It
/// moves freely in steps of 1e-6 s; no branch depends on the motion so far.
pub(super) fn wavy(cells: [usize; 3], stress: &str) -> Result<Scene, BenchmarkError> {
    wavy_of(cells, &named("stable-neo-hookean-log"), stress)
}

/// Wavy beam of another material.
pub(super) fn wavy_of(cells: [usize; 3], elastic: &str, stress: &str) -> Result<Scene, BenchmarkError> {
    displaced(&text(cells, elastic, stress, 1e-6), |x| {
        let X = [x[0], x[1], x[2]];
        for c in 0..3 {
            x[c] = X[c] * (1.0 + 0.05 * (40.0 * X[(c + 1) % 3] + c as f64).sin());
        }
    })
}

/// Corotated beam with cross-sections turned by 40 degrees at x = 0 to 130 degrees at the free end, and
/// every vertex then moved by up to `noise` cell widths along each axis.
///
/// The number of Halley steps of a rotation and the need for its fallback depend on the deformation,
/// which must therefore not change: steps are 1e-9 s, and elements move by less than 1e-3 cell widths in
/// the thousands of steps of a repetition.
pub(super) fn noisy(cells: [usize; 3], noise: f64) -> Result<Scene, BenchmarkError> {
    let (mut random, width) = (Scatter::new(3), 0.1 / cells[1] as f64);
    displaced(&text(cells, &named("corotated"), "analytic", 1e-9), |x| {
        let (sin, cos) = (0.7 + x[0] / 0.4 * std::f64::consts::FRAC_PI_2).sin_cos();
        let (y, z) = (x[1] - 0.05, x[2] - 0.05);
        (x[1], x[2]) = (cos * y - sin * z, sin * y + cos * z);
        for c in 0..3 {
            x[c] += noise * width * random.symmetric();
        }
    })
}

/// Tolerance of Newton's method [m]: the heights of the tip are then within 1e-7 of the values converged
/// to rounding, relative (`tests/solids/falling.rs`). The programs behind the target figure stop at a
/// velocity change of 1e-3 m/s, which is 1e-5 m.
const TOLERANCE: &str = "1e-7";

/// Beam released from rest: `4n x n x n` cells, steps of 0.01 s with implicit Euler.
pub(super) fn falling(n: usize) -> Result<Scene, BenchmarkError> {
    falling_of(n, &named("stable-neo-hookean-log"))
}

/// Falling beam of another material.
pub(super) fn falling_of(n: usize, elastic: &str) -> Result<Scene, BenchmarkError> {
    let text = text([4 * n, n, n], elastic, "analytic", 0.01);
    let integrator = format!("'implicit-euler', solver = {{ tolerance = {TOLERANCE} }}");
    Ok(Scene::from_toml(&text.replace("'symplectic-euler'", &integrator))?)
}
