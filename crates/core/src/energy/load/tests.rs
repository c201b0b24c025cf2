//! Loads against closed forms and differences.

use super::*;
use crate::energy::{Driven, EnergyTerm, Measurements};
use crate::material::Psd;
use pliant_mesh::Mesh;
use pliant_mesh::spec::{GridSpec, MeshSpec, WholeCell};

/// Returns a number in (-1, 1) without a pattern.
fn scattered(i: usize) -> f64 {
    2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
}

/// Cells of 0.5 m.
fn grid(cells: &[usize], element: Option<WholeCell>) -> Mesh {
    let grid = GridSpec { cells: cells.to_vec(), spacing: Some(0.5), element, ..GridSpec::default() };
    pliant_mesh::build(&MeshSpec::Grid(grid), cells.len(), ".".as_ref()).unwrap()
}

fn block<const D: usize>() -> (Mesh, Vec<f64>) {
    let mesh = grid(&[2, 3, 2][..D], None);
    let x = mesh.points.iter().enumerate().map(|(i, x)| 1.1 * x + 0.1 * scattered(i)).collect();
    (mesh, x)
}

/// Returns a second-order block with sides that are curved in the reference configuration.
fn curved_block<const D: usize>() -> (Mesh, Vec<f64>) {
    let mut mesh = block::<D>().0.promoted_to_quadratic().unwrap();
    mesh.points.iter_mut().enumerate().for_each(|(i, x)| *x += 0.03 * scattered(i + 11));
    let x = mesh.points.iter().enumerate().map(|(i, x)| 1.1 * x + 0.1 * scattered(i)).collect();
    (mesh, x)
}

/// Returns a block of hexahedra with moved vertices.
fn block_of_cells() -> (Mesh, Vec<f64>) {
    let mesh = grid(&[2, 3, 2], Some(WholeCell::Hexahedron));
    let x = mesh.points.iter().enumerate().map(|(i, x)| 1.1 * x + 0.1 * scattered(i)).collect();
    (mesh, x)
}

fn faces<const D: usize, const N: usize>(mesh: &Mesh) -> Vec<[u32; N]> {
    if mesh.block().is_some() {
        let array = |face: [u32; 4]| {
            let mut nodes = [0; N];
            nodes.copy_from_slice(&face);
            nodes
        };
        return mesh.select_quadrilaterals(None).unwrap().into_iter().map(array).collect();
    }
    let corners = mesh.faces::<D>();
    if N > D {
        return mesh.quadratic_faces(&corners);
    }
    let face = |face: &[u32; D]| {
        let mut nodes = [0; N];
        nodes.copy_from_slice(face);
        nodes
    };
    corners.iter().map(face).collect()
}

fn steady(p: f64) -> PressureField {
    let slope = Box::new(|_, _| [0.0; 3]);
    PressureField { field: Box::new(move |_, _| p), slope, changes: false, varies: false }
}

fn varying() -> PressureField {
    let field = |x: [f64; 3], t: f64| (1.0 + x[0]) * (2.0 + x[1] * x[1]) + t;
    let slope = |x: [f64; 3], _: f64| [2.0 + x[1] * x[1], (1.0 + x[0]) * 2.0 * x[1], 0.0];
    PressureField { field: Box::new(field), slope: Box::new(slope), changes: true, varies: true }
}

/// `term` must have the gradient of its energy, if it has one.
fn gradient<const D: usize>(term: &mut dyn EnergyTerm, x: &[f64]) -> Vec<f64> {
    let mut g = vec![0.0; x.len()];
    assert!(term.evaluate(x));
    // In pieces, as in a step.
    let (left, right) = g.split_at_mut(2 * D);
    term.add_rows(0, left);
    term.add_rows(2, right);
    g
}

/// Closed surface: no net force and moment, the gradient of `p V`, a symmetric and exact Hessian.
fn closed_surface<const D: usize, const N: usize>() {
    let (mesh, x) = match (D, N) {
        (3, 4) => block_of_cells(),
        _ if N == D => block::<D>(),
        _ => curved_block::<D>(),
    };
    let faces = faces::<D, N>(&mesh);
    assert!(rim::<D, N>(&faces).is_empty());
    let mut term = Pressure::<D, N>::new("p".into(), &faces, &mesh.points, true, steady(3.0));
    assert_eq!(term.energy(&mesh.points), 0.0);
    let g = gradient::<D>(&mut term, &x);
    let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
    for (g, x) in g.chunks(D).zip(x.chunks(D)) {
        let (mut a, mut b) = ([0.0; 3], [0.0; 3]);
        a[..D].copy_from_slice(x);
        b[..D].copy_from_slice(g);
        let turn = crate::algebra::cross(&a, &b);
        (0..3).for_each(|c| (force[c] += b[c], moment[c] += turn[c]).0);
    }
    let zero = |v: &[f64]| v.iter().all(|c| c.abs() < 1e-14 * 3.0 * 12.0);
    assert!(zero(&force) && zero(&moment), "{force:?} {moment:?}");
    // Bodies of any shape: x . g of p V is D p V.
    let volume = term.energy(&x) / 3.0 + term.volume_at_rest();
    if N == D || N == 4 {
        assert!((term.volume_at_rest() - mesh.lumped_measure().iter().sum::<f64>()).abs() < 1e-13);
    }
    let work: f64 = g.iter().zip(&x).map(|(g, x)| g * x).sum();
    assert!((work - D as f64 * 3.0 * volume).abs() < 1e-12, "{work} {volume}");
    let h = 1e-5;
    for i in 0..x.len() {
        let energy = |term: &mut Pressure<D, N>, h: f64| {
            let mut x = x.clone();
            x[i] += h;
            term.energy(&x)
        };
        let difference = (energy(&mut term, h) - energy(&mut term, -h)) / (2.0 * h);
        // The volume is a polynomial of degree one in each coordinate: only rounding is left.
        assert!((difference - g[i]).abs() < 1e-9, "{i}: {difference} {}", g[i]);
    }
}

#[test]
fn pressure_on_a_closed_surface_is_the_gradient_of_its_volume_and_has_no_net_force() {
    closed_surface::<2, 2>();
    closed_surface::<3, 3>();
    closed_surface::<2, 3>();
    closed_surface::<3, 6>();
    closed_surface::<3, 4>();
}

/// Returns the product with `p` of the matrix of all faces, block by block, exact or projected.
fn by_blocks<const D: usize>(term: &mut dyn EnergyTerm, x: &[f64], p: &[f64], psd: Psd) -> Vec<f64> {
    let stencils = term.stencils();
    let (n, count) = (stencils.size, stencils.vertices.len() / stencils.size);
    let per_face = n * (n + 1) / 2 * D * D;
    let mut out = vec![f64::NAN; count * per_face];
    // In pieces, as in an assembly.
    let (left, right) = out.split_at_mut(per_face);
    term.stencil_hessians(0..1, x, psd, left);
    term.stencil_hessians(1..count, x, psd, right);
    let mut y = vec![0.0; x.len()];
    for (face, blocks) in stencils.vertices.chunks(n).zip(out.chunks(per_face)) {
        let mut blocks = blocks.chunks(D * D);
        for i in 0..n {
            for j in i..n {
                let block = blocks.next().unwrap();
                let (a, b) = (face[i] as usize * D, face[j] as usize * D);
                for r in 0..D {
                    for c in 0..D {
                        y[a + r] += block[r * D + c] * p[b + c];
                        if i != j {
                            y[b + c] += block[r * D + c] * p[a + r];
                        }
                    }
                }
            }
        }
    }
    y
}

/// Products with the Hessian are differences of forces, with and without a potential; those of the stability
/// limit are of its symmetric part.
fn products<const D: usize, const N: usize>() {
    let (mesh, x) = if N == D { block::<D>() } else { curved_block::<D>() };
    let faces = faces::<D, N>(&mesh);
    let open = &faces[..faces.len() / 2];
    for (faces, closed, pressure) in
        [(&faces[..], true, steady(-2.0)), (open, false, steady(2.0)), (open, false, varying())]
    {
        let mut term = Pressure::<D, N>::new("p".into(), faces, &mesh.points, closed, pressure);
        assert_eq!(term.properties().is_conservative, closed);
        let p: Vec<f64> = (0..x.len()).map(|i| scattered(3 * i + 7)).collect();
        let q: Vec<f64> = (0..x.len()).map(|i| scattered(5 * i + 2)).collect();
        let product = |term: &mut Pressure<D, N>, p: &[f64], symmetric: bool| {
            let mut y = vec![0.0; x.len()];
            match symmetric {
                true => assert!(!term.add_stiffness_product(&x, p, &mut y)),
                false => term.add_hessian_product(&x, p, &mut y),
            }
            y
        };
        let moved = |h: f64| -> Vec<f64> { x.iter().zip(&p).map(|(x, p)| x + h * p).collect() };
        let (ahead, behind) =
            (gradient::<D>(&mut term, &moved(1e-3)), gradient::<D>(&mut term, &moved(-1e-3)));
        let exact = product(&mut term, &p, false);
        for i in 0..x.len() {
            // Forces are quadratic in the positions: central differences are exact.
            let difference = (ahead[i] - behind[i]) / 2e-3;
            assert!((difference - exact[i]).abs() < 1e-10, "{i}: {difference} {}", exact[i]);
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (pq, qp) = (dot(&q, &exact), dot(&p, &product(&mut term, &q, false)));
        assert_eq!((pq - qp).abs() < 1e-13, closed, "{pq} {qp}");
        let (stiffness, blocks) =
            (product(&mut term, &p, true), by_blocks::<D>(&mut term, &x, &p, Psd::Exact));
        for (a, b) in stiffness.iter().zip(&blocks) {
            assert!((a - b).abs() < 1e-13, "{a} {b}");
        }
        if closed {
            assert!(exact.iter().zip(&blocks).all(|(a, b)| (a - b).abs() < 1e-13));
        }
        assert!(by_blocks::<D>(&mut term, &x, &p, Psd::Projected).iter().all(|y| *y == 0.0));
        let symmetric = dot(&q, &stiffness);
        assert!((symmetric - 0.5 * (pq + qp)).abs() < 1e-13, "{symmetric} {pq} {qp}");
    }
}

#[test]
fn pressure_has_exact_hessian_products() {
    products::<2, 2>();
    products::<3, 3>();
    products::<2, 3>();
    products::<3, 6>();
}

/// Uniform pressure on one curved face of second order: its force and moment are those of any other surface
/// with the same rim, here a circular arc's chord, and Simpson's weights on a straight one.
#[test]
fn pressure_on_a_curved_edge_has_the_force_and_moment_of_its_chord() {
    // From (1, 0) to (0, 1) by way of a point off the chord; in 2D the force depends on the ends alone.
    let rest = [1.0, 0.0, 0.0, 1.0, 0.8, 0.9];
    let mut term = Pressure::<2, 3>::new("p".into(), &[[0, 1, 2]], &rest, false, steady(6.0));
    let g = gradient::<2>(&mut term, &rest);
    let total = [g[0] + g[2] + g[4], g[1] + g[3] + g[5]];
    // g = -f = p n: (dy, -dx) times p.
    assert!((total[0] - 6.0).abs() < 1e-14 && (total[1] - 6.0).abs() < 1e-14, "{total:?}");
    // The moment of p n about the origin is p/2 (|a|^2 - |b|^2) of its ends: here none.
    let moment: f64 = (0..3).map(|i| rest[2 * i] * g[2 * i + 1] - rest[2 * i + 1] * g[2 * i]).sum();
    assert!(moment.abs() < 1e-14, "{moment}");
    let straight = [0.0, 0.0, 3.0, 0.0, 1.5, 0.0];
    let mut term = Pressure::<2, 3>::new("p".into(), &[[0, 1, 2]], &straight, false, steady(6.0));
    let g = gradient::<2>(&mut term, &straight);
    for (found, share) in [(g[1], 1.0 / 6.0), (g[3], 1.0 / 6.0), (g[5], 4.0 / 6.0)] {
        assert!((found + 18.0 * share).abs() < 1e-14, "{g:?}");
    }
}

/// Pressure that varies in space, in the reference configuration: the total force is the integral of
/// `-p n` over the face at x = 1.
#[test]
fn varying_pressure_has_the_force_of_its_integral() {
    let (mesh, _) = block::<3>();
    let right = |face: &[u32; 3]| face.iter().all(|v| mesh.point(*v as usize)[0] == 1.0);
    let faces: Vec<[u32; 3]> = mesh.faces::<3>().into_iter().filter(right).collect();
    assert_eq!(rim::<3, 3>(&faces).len(), 10);
    let mut term = Pressure::<3, 3>::new("p".into(), &faces, &mesh.points, false, varying());
    term.set_time(0.5);
    let g = gradient::<3>(&mut term, &mesh.points);
    let total: f64 = g.iter().step_by(3).sum();
    // Of 2 (2 + Y^2) + t over 0 < Y < 1.5, 0 < Z < 1.
    let exact = 2.0 * (3.0 + 1.125) + 0.75;
    assert!((total - exact).abs() < 1e-13, "{total} {exact}");
    // The power of moving along x is that of the force.
    let v: Vec<f64> = (0..g.len()).map(|i| if i % 3 == 0 { -2.0 } else { 0.0 }).collect();
    assert!((term.power(&mesh.points, &v) - 2.0 * exact).abs() < 1e-13);
}

/// A dead load is the gradient of `-f . u`, is sampled once if it is constant, and keeps the force of the
/// last evaluation when its time advances.
#[test]
fn a_dead_load_has_the_potential_of_its_forces() {
    let rest: Vec<f64> = (0..12).map(|i| scattered(i + 3)).collect();
    let x: Vec<f64> = rest.iter().enumerate().map(|(i, x)| x + scattered(i)).collect();
    let field: VectorField = Box::new(|x, t| [x[0] * t, 2.0 + t, 0.0]);
    let sample = |point: [f64; 3], shares: &[(u32, f64)]| Sample { point, shares: shares.to_vec() };
    let samples = vec![sample([3.0, 0.0, 0.0], &[(0, 0.5), (1, 0.25)]), sample([1.0, 0.0, 0.0], &[(1, 1.0)])];
    let mut load = DeadLoad::new("load".into(), 2, vec![2, 5], &rest, samples, field, true);
    load.set_time(2.0);
    let g = gradient::<2>(&mut load, &x);
    let expected = [0.0, 0.0, 0.0, 0.0, -3.0, -2.0, 0.0, 0.0, 0.0, 0.0, -3.5, -5.0];
    assert_eq!(g, expected);
    let energy = |load: &mut DeadLoad| load.energy(&x);
    let displaced: f64 = (0..12).map(|i| expected[i] * (x[i] - rest[i])).sum();
    assert!((energy(&mut load) - displaced).abs() < 1e-15);
    let v: Vec<f64> = (0..12).map(|i| scattered(7 * i)).collect();
    let power: f64 = -expected.iter().zip(&v).map(|(g, v)| g * v).sum::<f64>();
    assert!((load.power(&x, &v) - power).abs() < 1e-14);
    load.set_time(2.0 + 1e-3);
    let (mut later, mut held) = (vec![0.0; 12], vec![0.0; 12]);
    load.add_rows(0, &mut held);
    assert_eq!(held, expected);
    load.evaluate(&x);
    load.add_rows(0, &mut later);
    assert_ne!(later, expected);
}
