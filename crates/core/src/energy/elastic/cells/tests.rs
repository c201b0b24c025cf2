//! One-point cells against differences of their energy, for every material, and against theory.

use super::*;
use crate::algebra::tests::sample::Random;
use crate::element::{CellKind, CellVisitor, HEXAHEDRON};
use crate::material::{
    DispersedFibres, EnergyExpression, MaterialSpec, MaterialVisitor, Parameters, material_axes,
};

/// Returns a grid of distorted cells: reference positions, flat, and the cells.
fn bent<const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    counts: [usize; D],
) -> (Vec<f64>, Vec<[u32; N]>) {
    let stride = |axis: usize| counts[axis + 1..].iter().map(|n| n + 1).product::<usize>();
    let mut random = Random(21);
    let mut rest = vec![];
    for vertex in 0..counts.iter().map(|n| n + 1).product() {
        for axis in 0..D {
            let i = vertex / stride(axis) % (counts[axis] + 1);
            rest.push(0.1 * (i as f64 + random.uniform(-0.15, 0.15)));
        }
    }
    let mut cells = vec![];
    for lower in 0..counts.iter().product() {
        let mut places = [0; D];
        let mut left: usize = lower;
        for axis in (0..D).rev() {
            (places[axis], left) = (left % counts[axis], left / counts[axis]);
        }
        let vertex = |corner: &[f64; D]| {
            let at = |axis: usize| stride(axis) * (places[axis] + usize::from(corner[axis] > 0.0));
            (0..D).map(at).sum::<usize>() as u32
        };
        let mut vertices = [0; N];
        vertices.iter_mut().zip(cell.nodes).for_each(|(v, corner)| *v = vertex(corner));
        cells.push(vertices);
    }
    (rest, cells)
}

/// Returns a deformation with `J > 0` that is not a polynomial of the cell.
fn deformed<const D: usize>(rest: &[f64], size: f64) -> Vec<f64> {
    let mut random = Random(6);
    let mut x = vec![];
    for row in rest.chunks_exact(D) {
        for c in 0..D {
            let other = row[(c + 1) % D];
            let smooth = 0.2 * row[c] + 0.3 * other + 0.8 * row[c] * other + 0.4;
            x.push(row[c] + size * (smooth + random.uniform(-0.004, 0.004)));
        }
    }
    x
}

struct Made<'a, const D: usize, const N: usize> {
    cell: &'static Isoparametric<D, N>,
    how: (Stress, PullBack),
    cells: &'a [[u32; N]],
    rest: &'a [f64],
}

impl<const D: usize, const N: usize> MaterialVisitor<D> for Made<'_, D, N> {
    type Output = OnePointCells<D, N>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        OnePointCells::new("block", material, self.how, self.cell, self.cells, self.rest)
    }
}

fn made<const D: usize, const N: usize>(
    cell: &'static Isoparametric<D, N>,
    spec: &MaterialSpec,
    stress: Stress,
    cells: &[[u32; N]],
    rest: &[f64],
) -> OnePointCells<D, N> {
    let how = (stress, PullBack::of(spec));
    spec.visit::<D, _>(Made { cell, how, cells, rest })
}

/// Returns every registered material with its example parameters.
fn materials() -> Vec<MaterialSpec> {
    MaterialSpec::examples()
}

pub(in crate::energy::elastic) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

pub(in crate::energy::elastic) fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

pub(in crate::energy::elastic) fn gradient(term: &mut dyn EnergyTerm, x: &[f64]) -> Vec<f64> {
    let mut g = vec![0.0; x.len()];
    term.add_gradient(x, &mut g);
    g
}

/// Returns the Hessian of stencils times a direction, and the least energy of one along it.
pub(in crate::energy::elastic) fn by_stencils(
    term: &mut dyn EnergyTerm,
    x: &[f64],
    p: &[f64],
    psd: Psd,
    d: usize,
) -> (Vec<f64>, f64) {
    times(term, p, d, |term, stencils, out| term.stencil_hessians(stencils, x, psd, out))
}

/// Returns predicted Hessians times a direction, and the least energy of one along it.
fn by_prediction(
    term: &mut dyn EnergyTerm,
    (from, x): (&[f64], &[f64]),
    p: &[f64],
    d: usize,
) -> (Vec<f64>, f64) {
    times(term, p, d, |term, stencils, out| {
        term.predicted().unwrap().predicted_hessians(stencils, from, x, out);
    })
}

fn times(
    term: &mut dyn EnergyTerm,
    p: &[f64],
    d: usize,
    fill: impl Fn(&dyn EnergyTerm, Range<usize>, &mut [f64]),
) -> (Vec<f64>, f64) {
    let stencils = term.stencils();
    let (size, count) = (stencils.size, stencils.vertices.len() / stencils.size);
    let per_stencil = size * (size + 1) / 2 * d * d;
    let mut blocks = vec![0.0; count * per_stencil];
    fill(term, 0..count, &mut blocks);
    let (mut y, mut least) = (vec![0.0; p.len()], 0.0f64);
    for (vertices, blocks) in stencils.vertices.chunks_exact(size).zip(blocks.chunks_exact(per_stencil)) {
        let mut work = 0.0;
        let mut blocks = blocks.chunks_exact(d * d);
        for (a, b) in (0..size).flat_map(|a| (a..size).map(move |b| (a, b))) {
            let block = blocks.next().unwrap();
            for (i, k) in (0..d).flat_map(|i| (0..d).map(move |k| (i, k))) {
                let (u, v) = (vertices[a] as usize * d + i, vertices[b] as usize * d + k);
                y[u] += block[i * d + k] * p[v];
                work += p[u] * block[i * d + k] * p[v];
                if a != b {
                    y[v] += block[i * d + k] * p[u];
                    work += p[u] * block[i * d + k] * p[v];
                }
            }
        }
        least = least.min(work);
    }
    (y, least)
}

/// Checks predicted Hessians of a nearly incompressible term. They are exact at the positions they are
/// predicted from and differ by second order further away. After a rotation to first order, whose growth
/// of volume makes the exact ones indefinite, they stay positive.
pub(in crate::energy::elastic) fn check_prediction(term: &mut dyn EnergyTerm, rest: &[f64], d: usize) {
    let mut random = Random(5);
    let p: Vec<f64> = rest.iter().map(|_| random.uniform(-1.0, 1.0)).collect();
    let way: Vec<f64> = rest.iter().map(|_| random.uniform(-1e-3, 1e-3)).collect();
    let at = |part: f64| -> Vec<f64> { rest.iter().zip(&way).map(|(x, w)| 1.01 * x + part * w).collect() };
    let mut off = |part: f64| {
        let (exact, _) = by_stencils(term, &at(part), &p, Psd::Exact, d);
        let (predicted, _) = by_prediction(term, (&at(0.0), &at(part)), &p, d);
        difference(&exact, &predicted) / largest(&exact)
    };
    assert!(off(0.0) < 1e-12, "{:e}", off(0.0));
    let ratio = off(1.0) / off(0.5);
    assert!(off(1.0) > 1e-6 && (ratio - 4.0).abs() < 0.3, "{:e}, {ratio}", off(1.0));

    let turn = |x: &[f64]| -> Vec<f64> {
        let by = [-0.3 * x[1], 0.3 * x[0], 0.0];
        x.iter().zip(by).map(|(x, by)| x + by).collect()
    };
    let turned: Vec<f64> = rest.chunks_exact(d).flat_map(turn).collect();
    let mut negative = false;
    for _ in 0..50 {
        let p: Vec<f64> = rest.iter().map(|_| random.uniform(-1.0, 1.0)).collect();
        let (y, least) = by_prediction(term, (rest, &turned), &p, d);
        assert!(least > -1e-9 * largest(&y), "{least:e}, {:e}", largest(&y));
        negative |= by_stencils(term, &turned, &p, Psd::Exact, d).1 < -1e-3 * largest(&y);
    }
    assert!(negative, "nothing to predict better");
}

/// Returns Richardson's extrapolation of central differences, with error `O(step^4)`.
pub(in crate::energy::elastic) fn derivative(f: impl Fn(f64) -> Vec<f64>, step: f64) -> Vec<f64> {
    let central = |h: f64| -> Vec<f64> {
        f(h).iter().zip(f(-h)).map(|(ahead, behind)| (ahead - behind) / (2.0 * h)).collect()
    };
    central(step).iter().zip(central(2.0 * step)).map(|(near, far)| (4.0 * near - far) / 3.0).collect()
}

struct Derivatives;

impl CellVisitor for Derivatives {
    type Output = ();

    /// Errors of differences: of truncation `1e-12`, of rounding `1e-16 / 1e-3` times the energy of
    /// volumes over that of the change, a hundred for these materials.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (rest, cells) = bent(cell, [2; D]);
        let x = deformed::<D>(&rest, 1.0);
        let mut random = Random(4);
        let p: Vec<f64> = x.iter().map(|_| random.uniform(-0.1, 0.1)).collect();
        let moved = |t: f64| -> Vec<f64> { x.iter().zip(&p).map(|(x, p)| x + t * p).collect() };
        for spec in materials() {
            for stress in [Stress::Analytic, Stress::Autodiff] {
                let what = format!("{}, {}, {stress:?}", cell.kind.name, spec.name());
                let term = std::cell::RefCell::new(made(cell, &spec, stress, &cells, &rest));
                let g = gradient(&mut *term.borrow_mut(), &x);
                let power: f64 = g.iter().zip(&p).map(|(g, p)| g * p).sum();
                let energy = |t: f64| vec![term.borrow_mut().energy(&moved(t))];
                let found = derivative(energy, 1e-3)[0];
                let scale: f64 = g.iter().zip(&p).map(|(g, p)| (g * p).abs()).sum();
                assert!((power - found).abs() < 1e-9 * scale, "{what}: {power} is not {found}");
                let expected = derivative(|t| gradient(&mut *term.borrow_mut(), &moved(t)), 1e-3);
                let mut product = vec![0.0; x.len()];
                term.borrow_mut().add_hessian_product(&x, &p, &mut product);
                let scale = largest(&expected);
                let error = difference(&product, &expected) / scale;
                assert!(error < 1e-8, "{what}: product off by {error:e}");
                let (by_stencils, _) = by_stencils(&mut *term.borrow_mut(), &x, &p, Psd::Exact, D);
                let error = difference(&product, &by_stencils) / scale;
                assert!(error < 1e-11, "{what}: stencils off by {error:e}");
            }
        }
    }
}

#[test]
fn forces_and_hessians_are_derivatives_of_the_energy_for_every_material() {
    every(|kind| kind.visit_first(Derivatives));
}

fn every(work: impl Fn(&'static CellKind)) {
    crate::element::CELL_KINDS.iter().filter(|kind| kind.order() == 1).for_each(|kind| work(kind));
}

struct Affine;

impl CellVisitor for Affine {
    type Output = ();

    /// In an affine motion the hourglass energy vanishes, and a rotation costs no energy.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (rest, cells) = bent(cell, [3, 2, 2][..D].try_into().unwrap());
        let g = [[0.1, 0.2, -0.1], [-0.15, 0.3, 0.05], [0.2, -0.1, -0.2]];
        let mut f = Mat::<f64, D>::identity();
        (0..D).for_each(|i| (0..D).for_each(|j| f[i][j] += g[i][j]));
        let image = |f: &Mat<f64, D>| -> Vec<f64> {
            rest.as_chunks::<D>().0.iter().flat_map(|row| f.mul_vec(row).map(|y| y + 0.3)).collect()
        };
        let volume: f64 = cells.iter().map(|c| cell.volume(&points_of(&rest, c))).sum();
        let turn = Random(9).rotation::<D>();
        for spec in materials() {
            let mut term = made(cell, &spec, Stress::Analytic, &cells, &rest);
            let density = term.material.state(&f).energy_density;
            let energy = term.energy(&image(&f));
            assert!((energy / (volume * density) - 1.0).abs() < 1e-11, "{}: {energy}", spec.name());
            for state in term.element_states(&image(&f)) {
                assert!((state.j() - f.determinant()).abs() < 1e-12);
            }
            let stiffness = largest(&gradient(&mut term, &image(&f)));
            if spec.about().frame_indifferent && spec.about().has_rest_shape {
                let error = largest(&gradient(&mut term, &image(&turn))) / stiffness;
                assert!(error < 1e-10, "{}: {error:e}", spec.name());
            }
            let extremes = term.deformation(&image(&f)).unwrap();
            assert!((extremes.min_j - f.determinant()).abs() < 1e-12 && extremes.inverted == 0);
        }
    }
}

#[test]
fn affine_motions_strain_cells_uniformly_and_rotations_not_at_all() {
    every(|kind| kind.visit_first(Affine));
}

struct Projected;

impl CellVisitor for Projected {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (rest, cells) = bent(cell, [2; D]);
        // Compressed to half the size, where matrices are indefinite.
        let x: Vec<f64> = deformed::<D>(&rest, 1.0).iter().map(|x| 0.5 * x).collect();
        let spec: MaterialSpec =
            serde_json::from_value(serde_json::json!({ "neo-hookean": { "young": 1e5, "poisson": 0.4 } }))
                .unwrap();
        let mut term = made(cell, &spec, Stress::Analytic, &cells, &rest);
        let mut random = Random(12);
        let mut negative = false;
        for _ in 0..50 {
            let p: Vec<f64> = x.iter().map(|_| random.uniform(-1.0, 1.0)).collect();
            let smooth: Vec<f64> = x.chunks_exact(D).flat_map(|x| [x[1], -x[0], 0.0][..D].to_vec()).collect();
            for p in [&p, &smooth] {
                let (_, exact) = by_stencils(&mut term, &x, p, Psd::Exact, D);
                negative |= exact < 0.0;
                let (y, least) = by_stencils(&mut term, &x, p, Psd::Projected, D);
                assert!(least > -1e-12 * largest(&y), "{}: {least:e}", cell.kind.name);
            }
        }
        assert!(negative, "nothing to project");
    }
}

#[test]
fn projected_hessians_of_cells_are_positive() {
    every(|kind| kind.visit_first(Projected));
}

struct Predicted;

impl CellVisitor for Predicted {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (rest, cells) = bent(cell, [2; D]);
        for name in ["neo-hookean", "stable-neo-hookean"] {
            let spec = serde_json::json!({ name: { "young": 1e5, "poisson": 0.4999 } });
            let spec: MaterialSpec = serde_json::from_value(spec).unwrap();
            check_prediction(&mut made(cell, &spec, Stress::Analytic, &cells, &rest), &rest, D);
        }
    }
}

#[test]
fn predicted_hessians_of_cells_are_positive_after_a_turn_and_exact_where_they_begin() {
    every(|kind| kind.visit_first(Predicted));
}

/// A cell drawn through itself: for materials that forbid inversion the energy is infinite, forces are
/// NaN, and the fault names the cell.
#[test]
fn folded_cells_have_no_energy_and_are_named() {
    let (rest, cells) = bent(&HEXAHEDRON, [1, 1, 1]);
    let specs = materials();
    let mut known = 0;
    for spec in specs.iter().filter(|spec| spec.about().domain == Domain::PositiveJ) {
        let mut term = made(&HEXAHEDRON, spec, Stress::Analytic, &cells, &rest);
        assert_eq!(term.fault(&rest), None);
        let x: Vec<f64> = rest.as_chunks::<3>().0.iter().flat_map(|[x, y, z]| [*x, *y, -0.3 * z]).collect();
        assert_eq!(term.energy(&x), f64::INFINITY, "{}", spec.name());
        assert!(!term.evaluate(&x));
        match term.fault(&x) {
            Some(Fault::Element { element: 0, j, .. }) => assert!(j < 0.0),
            other => panic!("{other:?}"),
        }
        let dx: Vec<f64> = x.iter().zip(&rest).map(|(x, rest)| x - rest).collect();
        let step = term.max_step(&rest, &dx);
        assert!(step > 0.6 && step < 0.9 / 1.3 + 1e-9, "{step}");
        let part: Vec<f64> = rest.iter().zip(&dx).map(|(x, dx)| x + step * dx).collect();
        assert!(term.energy(&part).is_finite());
        known += 1;
    }
    assert!(known > 3);
}

/// Returns the initial stiffness matrix of the cells of a term, by rows.
fn matrix<const D: usize, const N: usize>(term: &mut OnePointCells<D, N>, rest: &[f64]) -> Vec<Vec<f64>> {
    let column = |i: usize| {
        let (mut unit, mut y) = (vec![0.0; rest.len()], vec![0.0; rest.len()]);
        unit[i] = 1.0;
        term.add_hessian_product(rest, &unit, &mut y);
        y
    };
    (0..rest.len()).map(column).collect()
}

/// Returns the number of pivots of a symmetric positive matrix that exceed rounding.
fn rank(mut rows: Vec<Vec<f64>>) -> usize {
    let largest_of = |rows: &[Vec<f64>]| {
        let pivots = (0..rows.len()).map(|i| (i, rows[i][i]));
        pivots.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
    };
    let (_, scale) = largest_of(&rows);
    for found in 0..rows.len() {
        let (pivot, value) = largest_of(&rows);
        if value < 1e-9 * scale {
            return found;
        }
        let of_pivot = rows[pivot].clone();
        for row in &mut rows {
            let factor = row[pivot] / value;
            row.iter_mut().zip(&of_pivot).for_each(|(entry, of_pivot)| *entry -= factor * of_pivot);
        }
    }
    rows.len()
}

fn solid(name: &str, poisson: f64) -> MaterialSpec {
    serde_json::from_value(serde_json::json!({ name: { "young": 1.0, "poisson": poisson } })).unwrap()
}

struct Rigid;

impl CellVisitor for Rigid {
    type Output = ();

    /// Only rigid motions cost no energy, in cells of any shape.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (rest, cells) = bent(cell, [1; D]);
        for name in ["linear", "neo-hookean"] {
            for poisson in [0.0, 0.3, 0.4999] {
                let mut term = made(cell, &solid(name, poisson), Stress::Analytic, &cells, &rest);
                let free = N * D - rank(matrix(&mut term, &rest));
                assert_eq!(free, D * (D + 1) / 2, "{} {name} {poisson}", cell.kind.name);
            }
        }
    }
}

#[test]
fn only_rigid_motions_cost_no_energy() {
    every(|kind| kind.visit_first(Rigid));
}

/// Moduli of a fluid leave hourglass modes without stiffness, in cells of any shape.
#[test]
fn a_fluid_does_not_resist_hourglass_modes() {
    let (rest, cells) = bent(&HEXAHEDRON, [1, 1, 1]);
    let rest = CellRest::<f64, 3, 8>::new(&HEXAHEDRON, &points_of(&rest, &cells[0]));
    let largest_of = |mu: f64| {
        let moduli = RestModuli::new(&Tangent::isotropic(1.0, mu));
        largest(&hourglass::stiffness((rest.volume, &rest.inverse), &moduli))
    };
    assert!(largest_of(0.0) < 1e-14 * largest_of(1.0), "{:e}", largest_of(0.0));
}

struct Bending;

impl CellVisitor for Bending {
    type Output = ();

    /// Bending energy `M V eps^2 / 6` of beams up to twenty times longer than high, also nearly
    /// incompressible, with `M = E` in 3D and `E/(1 - nu^2)` in 2D. In 3D the transverse bending of the
    /// beam is free.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        for name in ["linear", "neo-hookean", "stable-neo-hookean"] {
            for poisson in [0.0, 0.3, 0.4999] {
                for length in [1.0, 2.0, 5.0, 10.0, 20.0] {
                    let stretch = [length, 1.0, 0.7];
                    let row = |row: &[f64; D]| -> Vec<f64> { (0..D).map(|k| stretch[k] * row[k]).collect() };
                    let rest: Vec<f64> = cell.nodes.iter().flat_map(row).collect();
                    let all: [u32; N] = std::array::from_fn(|a| a as u32);
                    let mut term = made(cell, &solid(name, poisson), Stress::Analytic, &[all], &rest);
                    let modulus = if D == 2 { 1.0 / (1.0 - poisson * poisson) } else { 1.0 };
                    let volume = cell.volume(&points_of(&rest, &all));
                    for (k, l) in (0..D).flat_map(|k| (0..D).map(move |l| (k, l))).filter(|(k, l)| k != l) {
                        let mode = |k: usize| -> Vec<f64> {
                            let moved = |node: &[f64; D]| {
                                let mut u = vec![0.0; D];
                                u[k] = stretch[k] * node[k] * node[l];
                                u
                            };
                            cell.nodes.iter().flat_map(moved).collect()
                        };
                        let mut product = |u: &[f64], v: &[f64]| -> f64 {
                            let mut y = vec![0.0; u.len()];
                            term.add_hessian_product(&rest, u, &mut y);
                            3.0 / volume * y.iter().zip(v).map(|(y, v)| y * v).sum::<f64>()
                        };
                        let along = mode(k);
                        let mut found = product(&along, &along);
                        if let Some(m) = (0..D).find(|m| *m != k && *m != l) {
                            let across = mode(m);
                            found -= product(&along, &across).powi(2) / product(&across, &across);
                        }
                        let ratio = found / modulus;
                        assert!((ratio - 1.0).abs() < 1e-9, "{name} {poisson} {length}, {k} {l}: {ratio}");
                    }
                }
            }
        }
    }
}

#[test]
fn boxes_bend_as_a_beam_does() {
    every(|kind| kind.visit_first(Bending));
}

/// Returns the energy of a box of these lengths in a motion `u(X)` from the reference configuration.
fn energy_of_motion(lengths: [f64; 3], spec: &MaterialSpec, motion: impl Fn([f64; 3]) -> [f64; 3]) -> f64 {
    let place = |node: &[f64; 3]| [0, 1, 2].map(|k| 0.5 * lengths[k] * node[k]);
    let rest: Vec<f64> = HEXAHEDRON.nodes.iter().flat_map(place).collect();
    let moved: Vec<f64> = HEXAHEDRON.nodes.iter().flat_map(|node| motion(place(node))).collect();
    let cell: [u32; 8] = std::array::from_fn(|a| a as u32);
    let mut term = made(&HEXAHEDRON, spec, Stress::Analytic, &[cell], &rest);
    let mut product = vec![0.0; rest.len()];
    term.add_hessian_product(&rest, &moved, &mut product);
    0.5 * product.iter().zip(&moved).map(|(force, u)| force * u).sum::<f64>()
}

/// Boxes from flat to long.
const BOXES: [[f64; 3]; 6] =
    [[1.0, 1.0, 1.0], [5.0, 1.0, 1.0], [0.05, 1.0, 1.0], [1.0, 1.0, 0.05], [1.0, 0.1, 2.0], [20.0, 3.0, 1.0]];

/// Twist about `x` with the warping `c y z` of least energy: `G/2 theta^2 l J` with
/// `J = b^3 t^3 / (3 (b^2 + t^2))`, in a thin section `b t^3 / 3`.
#[test]
fn boxes_of_any_lengths_twist_as_their_section_does() {
    for lengths @ [length, b, t] in BOXES {
        for poisson in [0.0, 0.3, 0.49] {
            let spec = solid("neo-hookean", poisson);
            let twist = |c: f64| energy_of_motion(lengths, &spec, |[x, y, z]| [c * y * z, -x * z, x * y]);
            let (at, one, other) = (twist(0.0), twist(1.0), twist(-1.0));
            let (slope, curvature) = (0.5 * (one - other), one + other - 2.0 * at);
            let least = at - 0.5 * slope * slope / curvature;
            let j = (b * t).powi(3) / (3.0 * (b * b + t * t));
            let theory = 0.5 * length * j / (2.0 * (1.0 + poisson));
            assert!((least / theory - 1.0).abs() < 1e-9, "{lengths:?} {poisson}: {}", least / theory);
        }
    }
}

/// Saddles of a plate of thickness `t` along `z`, along its sides and diagonally: `D (1 - nu) kappa^2`
/// per area, `D = E t^3 / (12 (1 - nu^2))`.
#[test]
fn boxes_of_any_lengths_bend_to_saddles_as_a_plate_does() {
    for lengths @ [a, b, t] in BOXES {
        for poisson in [0.0, 0.3, 0.49] {
            let spec = solid("neo-hookean", poisson);
            let along = energy_of_motion(lengths, &spec, |[x, y, z]| [-y * z, -x * z, x * y]);
            let across = energy_of_motion(lengths, &spec, |[x, y, z]| [-x * z, y * z, 0.5 * (x * x - y * y)]);
            let theory = a * b * t.powi(3) / (12.0 * (1.0 + poisson));
            for found in [along, across] {
                assert!((found / theory - 1.0).abs() < 1e-9, "{lengths:?} {poisson}: {}", found / theory);
            }
        }
    }
}

struct Excess;

impl CellVisitor for Excess {
    type Output = ();

    /// Parallelepipeds have no excess; trapezoids have more the longer they are.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let excess = |length: f64, slant: f64, taper: f64| {
            bending_excess(
                cell,
                &cell.nodes.map(|mut node| {
                    node[0] = length * node[0] + (slant + taper * node[0]) * node[1];
                    node
                }),
            )
        };
        for (length, slant) in [(1.0, 0.0), (5.0, 0.0), (1.0, 1.0), (10.0, -0.5)] {
            assert!((excess(length, slant, 0.0) - 1.0).abs() < 1e-9, "{length} {slant}");
        }
        let (little, much, most) = (excess(5.0, 0.0, 0.1), excess(5.0, 0.0, 1.0), excess(10.0, 0.0, 1.0));
        assert!(little > 1.1 && little < 3.0 && much > 10.0 && most > 2.0 * much, "{little} {much} {most}");
    }
}

#[test]
fn trapezoids_bend_more_stiffly_than_the_solid() {
    every(|kind| kind.visit_first(Excess));
}

struct Numberings;

impl CellVisitor for Numberings {
    type Output = ();

    /// Energies and forces of a distorted cell do not depend on the corner and axis at which its
    /// numbering starts.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (rest, cells) = bent(cell, [1; D]);
        let x = deformed::<D>(&rest, 1.0);
        let mut numberings = vec![];
        for turn in rotations_of_a_cube::<D>() {
            let place = |node: &[f64; D]| turn.mul_vec(node);
            let number = |node: &[f64; D]| cell.nodes.iter().position(|other| *other == place(node)).unwrap();
            numberings.push(cell.nodes.map(|node| cells[0][number(&node)]));
        }
        assert_eq!(numberings.len(), if D == 2 { 4 } else { 24 });
        for spec in [solid("linear", 0.3), solid("neo-hookean", 0.49)] {
            let results = numberings.iter().map(|numbering| {
                let mut term = made(cell, &spec, Stress::Analytic, &[*numbering], &rest);
                (term.energy(&x), gradient(&mut term, &x))
            });
            let results: Vec<(f64, Vec<f64>)> = results.collect();
            let (energy, force) = &results[0];
            for (other, others) in &results {
                assert!((other / energy - 1.0).abs() < 1e-12, "{other} {energy}");
                assert!(difference(others, force) < 1e-12 * largest(force), "{}", spec.name());
            }
        }
    }
}

/// Returns the rotations that map the reference cell to itself.
fn rotations_of_a_cube<const D: usize>() -> Vec<Mat<f64, D>> {
    let mut rotations = vec![];
    let entries = [-1.0, 0.0, 1.0];
    for code in 0..3usize.pow((D * D) as u32) {
        let mut turn = Mat::zero();
        (0..D * D).for_each(|i| turn[i / D][i % D] = entries[code / 3usize.pow(i as u32) % 3]);
        let is_orthogonal = turn.transpose_mul(&turn) == Mat::identity();
        if is_orthogonal && turn.determinant() == 1.0 {
            rotations.push(turn);
        }
    }
    rotations
}

#[test]
fn a_cell_is_the_same_whichever_of_its_corners_is_first() {
    every(|kind| kind.visit_first(Numberings));
}

struct Apart;

impl CellVisitor for Apart {
    type Output = ();

    /// Two rows of cells of one body have the forces of two bodies of one row each.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (rest, cells) = bent(cell, [3, 2, 1][..D].try_into().unwrap());
        let x = deformed::<D>(&rest, 1.0);
        let spec = solid("neo-hookean", 0.45);
        let mut together = made(cell, &spec, Stress::Analytic, &cells, &rest);
        let (rows, mut apart) = (cells.as_chunks::<2>().0, vec![0.0; rest.len()]);
        for row in [0, 1] {
            let of_row: Vec<[u32; N]> = rows.iter().map(|pair| pair[row]).collect();
            let mut term = made(cell, &spec, Stress::Analytic, &of_row, &rest);
            term.add_gradient(&x, &mut apart);
        }
        let whole = gradient(&mut together, &x);
        assert!(difference(&whole, &apart) < 1e-13 * largest(&whole), "{}", cell.kind.name);
    }
}

#[test]
fn cells_know_no_neighbours() {
    every(|kind| kind.visit_first(Apart));
}

/// The least `J` and the count of inverted cells include all cells, also in a last pack that is not full.
#[test]
fn the_least_volume_is_that_of_all_cells() {
    let (rest, cells) = bent(&HEXAHEDRON, [3, 3, 2]);
    let mut term = made(&HEXAHEDRON, &materials()[0], Stress::Analytic, &cells, &rest);
    let mut x = deformed::<3>(&rest, 1.0);
    for folded in [false, true] {
        if folded {
            (0..9).for_each(|c| x[c] = x[x.len() - 3 + c % 3]);
        }
        let of_cells: Vec<f64> = term
            .patches
            .stencils()
            .map(|(_, vertices, pack, lane)| term.deformation_of(&x, &vertices, (pack, lane)).determinant())
            .collect();
        let least = of_cells.iter().fold(f64::INFINITY, |m: f64, j| m.min(*j));
        let inverted = of_cells.iter().filter(|j| **j <= 0.0).count() as u64;
        assert_eq!((of_cells.len(), inverted > 0), (cells.len(), folded), "{least}");
        let found = term.deformation(&x).unwrap();
        assert!((found.min_j - least).abs() < 1e-12 * least.abs().max(1.0), "{found:?}, not {least}");
        assert_eq!(found.inverted, inverted);
    }
}

struct TurnedAxes;

impl CellVisitor for TurnedAxes {
    type Output = ();

    /// Fibres along material axes, which cells rotate, equal the same fibres given in space: energies,
    /// forces, products, Hessians and states. The initial moduli of the formula depend on its fibres, and
    /// so does the stiffness of hourglass modes.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (mut rest, cells) = bent(cell, [2; D]);
        // Longer than high.
        rest.chunks_exact_mut(D).for_each(|row| row[0] *= 2.0);
        let axes = match D {
            2 => material_axes(&[-0.6, 0.7, 0.0], None),
            _ => material_axes(&[-0.6, 0.7, 0.4], Some(&[0.2, 0.5, 1.0])),
        };
        let families = [[0.8, 0.6, 0.0], [0.8, -0.6, 0.0]];
        let dispersed = |families: [[f64; 3]; 2]| {
            let fibres = families.map(|fibre| fibre.to_vec()).to_vec();
            MaterialSpec::HolzapfelGasserOgden(DispersedFibres { fibres, ..DispersedFibres::example() })
        };
        let expressed = |families: [[f64; 3]; 2]| {
            let psi = "mu/2*(I1 - 3) - mu*log(J) + k/2*log(J)^2 + 3*k*(I4 - 1)^2 + k*(I6 - 1)^2";
            let fibres = families.map(|fibre| fibre[..D].to_vec());
            MaterialSpec::ExpressedEnergy(EnergyExpression::new(psi, [("mu", 4e5), ("k", 3e5)], &fibres))
        };
        let (x, p) = (deformed::<D>(&rest, 1.0), rest.iter().map(|x| (50.0 * x).sin()).collect::<Vec<_>>());
        let rows = |term: &mut OnePointCells<D, N>| {
            let mut product = vec![0.0; x.len()];
            term.add_hessian_product(&x, &p, &mut product);
            let mut states = vec![];
            term.each_state(&x, &mut |_, state: ElementState| {
                states.extend(state.deformation_gradient.0.as_flattened().iter().copied());
                states.extend(state.first_piola.0.as_flattened().iter().map(|p| 1e-6 * p));
            });
            let within = term.state_at(&x, 1, &[0.5, 0.2, 0.2, 0.1]).unwrap();
            states.extend(within.first_piola.0.as_flattened().iter().map(|p| 1e-6 * p));
            let (by_stencils, _) = by_stencils(term, &x, &p, Psd::Exact, D);
            [vec![term.energy(&x)], gradient(term, &x), product, by_stencils, states]
        };
        for of in [&dispersed as &dyn Fn([[f64; 3]; 2]) -> MaterialSpec, &expressed] {
            let of = |families| made(cell, &of(families), Stress::Analytic, &cells, &rest);
            let turned = of(families).with_axes(&vec![axes; cells.len()], &rest);
            let [found, expected, other] =
                [turned, of(families.map(|fibre| axes.mul_vec(&fibre))), of(families)]
                    .map(|mut term| rows(&mut term));
            for ((found, expected), other) in found.iter().zip(&expected).zip(&other) {
                let (scale, off) = (largest(expected), difference(found, expected));
                assert!(off < 1e-12 * scale, "{}: {off:e} of {scale:e}", cell.kind.name);
                assert!(difference(other, expected) > 1e-4 * scale, "{}", cell.kind.name);
            }
        }
    }
}

#[test]
fn fibres_in_cells_turn_with_the_axes_of_the_material() {
    every(|kind| kind.visit_first(TurnedAxes));
}
