//! Cells with a mean dilatation against differences of their energy, for every material.

use super::*;
use crate::algebra::tests::sample::Random;
use crate::element::{CellKind, CellVisitor, HEXAHEDRON};
use crate::material::{
    DispersedFibres, EnergyExpression, MaterialSpec, MaterialVisitor, Parameters, material_axes,
};

/// A grid of bent cells: rest positions, flat, and the cells.
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

/// A deformation with `J > 0` that is no polynomial of the cell.
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
    how: (Stress, Dilatation),
    cells: &'a [[u32; N]],
    rest: &'a [f64],
}

impl<const D: usize, const N: usize> MaterialVisitor<D> for Made<'_, D, N> {
    type Output = MeanDilatation<D, N>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        MeanDilatation::new("block", material, self.how, self.cell, self.cells, self.rest)
    }
}

fn made<const D: usize, const N: usize>(
    cell: &'static Isoparametric<D, N>,
    spec: &MaterialSpec,
    stress: Stress,
    cells: &[[u32; N]],
    rest: &[f64],
) -> MeanDilatation<D, N> {
    let how = (stress, Dilatation::of(spec));
    spec.visit::<D, _>(Made { cell, how, cells, rest })
}

/// Every registered material with its example parameters.
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

/// The Hessian of stencils, times a direction, and the least energy of one along it.
pub(in crate::energy::elastic) fn by_stencils(
    term: &mut dyn EnergyTerm,
    x: &[f64],
    p: &[f64],
    psd: Psd,
    d: usize,
) -> (Vec<f64>, f64) {
    times(term, p, d, |term, stencils, out| term.stencil_hessians(stencils, x, psd, out))
}

/// Hessians predicted from another place, times a direction, and the least energy of one along it.
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

/// Predicted Hessians of a nearly incompressible term: those at the place where they are predicted from are
/// exact, further away they differ by second order; after a rotation that is one to first order only, whose
/// growth of volume makes the exact ones indefinite, they stay positive.
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

/// Richardson's extrapolation of central differences, of error `O(step^4)`.
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
    every(|kind| kind.visit(Derivatives));
}

fn every(work: impl Fn(&'static CellKind)) {
    crate::element::CELL_KINDS.iter().for_each(|kind| work(kind));
}

struct Affine;

impl CellVisitor for Affine {
    type Output = ();

    /// Under an affine motion the cells are plain ones, and a rotation costs nothing.
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
    every(|kind| kind.visit(Affine));
}

struct Projected;

impl CellVisitor for Projected {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (rest, cells) = bent(cell, [2; D]);
        // Half as large: compressed, where matrices are indefinite.
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
    every(|kind| kind.visit(Projected));
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
    every(|kind| kind.visit(Predicted));
}

/// A node drawn through its cell: the energy is infinite, forces are no numbers, and the cell is named. Also
/// of materials that know inversion.
#[test]
fn folded_cells_have_no_energy_and_are_named() {
    let (rest, cells) = bent(&HEXAHEDRON, [2, 2, 2]);
    for spec in materials().iter().filter(|spec| Dilatation::of(spec) == Dilatation::Finite) {
        let mut term = made(&HEXAHEDRON, spec, Stress::Analytic, &cells, &rest);
        assert_eq!(term.fault(&rest), None);
        let mut x = rest.clone();
        (0..3).for_each(|c| x[c] = 0.25);
        assert_eq!(term.energy(&x), f64::INFINITY, "{}", spec.name());
        assert!(!term.evaluate(&x));
        match term.fault(&x) {
            Some(Fault::Element { element: 0, j, .. }) => assert!(j < 0.0),
            other => panic!("{other:?}"),
        }
        let dx: Vec<f64> = x.iter().zip(&rest).map(|(x, rest)| x - rest).collect();
        let step = term.max_step(&rest, &dx);
        assert!(step > 0.0 && step < 1.0);
        let part: Vec<f64> = rest.iter().zip(&dx).map(|(x, dx)| x + step * dx).collect();
        assert!(term.energy(&part).is_finite());
    }
}

struct Bending;

impl CellVisitor for Bending {
    type Output = ();

    /// The energy `M V eps^2 / 6` of a beam that bends, of boxes of any lengths, also by a tangent of `M`,
    /// `E` in space and `E/(1 - nu^2)` in the plane, nearly incompressible ones too. In space the bending
    /// across the beam is free; of the shear that stiffens cubes of `nu = 0` nothing is taken away.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let most = if D == 2 { 1.0 } else { 7.0 / 6.0 };
        for name in ["linear", "neo-hookean", "stable-neo-hookean"] {
            for poisson in [0.0, 0.3, 0.4999] {
                for stretch in [[1.0, 1.0, 1.0], [1.0, 4.0, 1.0], [4.0, 1.0, 1.0], [0.25, 1.0, 3.0]] {
                    let spec = serde_json::json!({ name: { "young": 1.0, "poisson": poisson } });
                    let spec: MaterialSpec = serde_json::from_value(spec).unwrap();
                    let row = |row: &[f64; D]| -> Vec<f64> { (0..D).map(|k| stretch[k] * row[k]).collect() };
                    let rest: Vec<f64> = cell.nodes.iter().flat_map(row).collect();
                    let all: [u32; N] = std::array::from_fn(|a| a as u32);
                    let mut term = made(cell, &spec, Stress::Analytic, &[all], &rest);
                    let modulus = if D == 2 { 1.0 / (1.0 - poisson * poisson) } else { 1.0 };
                    let volume = cell.volume(&points_of(&rest, &all));
                    for k in 0..D {
                        for l in (0..D).filter(|l| *l != k) {
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
                            assert!(
                                ratio > 1.0 - 1e-9 && ratio < most + 1e-9,
                                "{} {name} {poisson} {stretch:?}, {k} {l}: {ratio}",
                                cell.kind.name
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn boxes_bend_as_a_beam_does() {
    every(|kind| kind.visit(Bending));
}

/// The least `J` and the count of inverted cells are those of all points of all cells, also of a last pack
/// that is not full.
#[test]
fn the_least_volume_is_that_of_all_points() {
    let (rest, cells) = bent(&HEXAHEDRON, [3, 3, 2]);
    let mut term = made(&HEXAHEDRON, &materials()[0], Stress::Analytic, &cells, &rest);
    let mut x = deformed::<3>(&rest, 1.0);
    for folded in [false, true] {
        if folded {
            (0..3).for_each(|c| x[c] = x[x.len() - 3 + c]);
        }
        let of_cells: Vec<f64> = term
            .patches
            .stencils()
            .map(|(_, vertices, pack, lane)| {
                let nodes: [[f64; 3]; 8] = points_of(&x, &vertices);
                let of_points = term.packs.rest(pack).iter().map(|point| {
                    let mut f = Mat::<f64, 3>::zero();
                    for (node, slope) in nodes.iter().zip(point.lane(lane).0) {
                        (0..9).for_each(|i| f[i / 3][i % 3] += node[i / 3] * slope[i % 3]);
                    }
                    f.determinant()
                });
                of_points.fold(f64::INFINITY, f64::min)
            })
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

    /// Fibres along the axes of the material, which cells turn, and the same fibres by their directions in
    /// space: energies, forces, products, Hessians and states. The formula has moduli at rest that go by its
    /// fibres, and so has its stiffness in bending.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let (mut rest, cells) = bent(cell, [2; D]);
        // Longer than high: cells lack stiffness in bending.
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
        let rows = |term: &mut MeanDilatation<D, N>| {
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
            assert!(turned.bending.is_some(), "{}", cell.kind.name);
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
    every(|kind| kind.visit(TurnedAxes));
}
