use super::*;
use crate::algebra::tests::sample::Random;

/// The reference cell, mapped by a matrix with a positive determinant and bent by up to `amplitude`.
fn mapped<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, amplitude: f64) -> [[f64; D]; N] {
    let mut random = Random(5);
    let mut nodes = *cell.nodes;
    for node in &mut nodes {
        let at = *node;
        for i in 0..D {
            node[i] = 7.0 + 0.5 * (at[i] * (1.0 + i as f64) + 0.2 * at[(i + 1) % D]);
            node[i] += random.uniform(-amplitude, amplitude);
        }
    }
    nodes
}

struct Basis;

impl CellVisitor for Basis {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        assert_eq!((cell.kind.dimension, cell.kind.nodes), (D, N));
        for (a, node) in cell.nodes.iter().enumerate() {
            let shape = (cell.shape)(node);
            assert!((0..N).all(|b| shape[b] == f64::from(u8::from(a == b))), "{a}: {shape:?}");
        }
        let mut random = Random(2);
        for _ in 0..20 {
            let mut xi = [0.0; D];
            xi.iter_mut().for_each(|x| *x = random.uniform(-1.0, 1.0));
            assert!(((cell.shape)(&xi).iter().sum::<f64>() - 1.0).abs() < 1e-15);
            for k in 0..D {
                // Of functions linear in each coordinate differences are exact.
                let moved = |step: f64| {
                    let mut at = xi;
                    at[k] += step;
                    (cell.shape)(&at)
                };
                let (ahead, behind, slopes) = (moved(0.25), moved(-0.25), (cell.slopes)(&xi));
                assert!((0..N).all(|a| (slopes[a][k] - 2.0 * (ahead[a] - behind[a])).abs() < 1e-14));
            }
        }
    }
}

#[test]
fn shape_functions_are_one_at_their_node_and_zero_at_the_others_and_have_these_slopes() {
    CELL_KINDS.iter().for_each(|kind| kind.visit(Basis));
}

struct Sides;

impl CellVisitor for Sides {
    type Output = ();

    /// By the divergence theorem sides that point outwards enclose the volume; mirrored cells have it too.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let nodes = mapped(cell, 0.05);
        let mut flux = 0.0;
        for side in cell.kind.sides {
            let x = |a: usize| nodes[side[a]];
            flux += if D == 2 {
                let (a, b) = (x(0), x(1));
                0.5 * ((a[0] + b[0]) * (b[1] - a[1])) / 1.0
            } else {
                // A bilinear side about its centre has the flux of four triangles.
                let mut centre = [0.0; 3];
                (0..3).for_each(|c| centre[c] = 0.25 * (0..4).map(|a| x(a)[c]).sum::<f64>());
                let corner = |a: usize| [x(a % 4)[0], x(a % 4)[1], x(a % 4)[2]];
                (0..4).map(|a| flux_through([centre, corner(a), corner(a + 1)])).sum::<f64>()
            };
        }
        let volume = cell.volume(&nodes);
        // Bilinear sides are not those triangles: off by the square of the bend.
        assert!((flux / volume - 1.0).abs() < 1e-2, "{}: {flux} {volume}", cell.kind.name);
        let flat = mapped(cell, 0.0);
        let mut mirrored = flat;
        for (a, node) in cell.kind.mirror.iter().enumerate() {
            mirrored[a] = flat[*node];
            mirrored[a][0] = -mirrored[a][0];
        }
        assert!((cell.volume(&mirrored) / cell.volume(&flat) - 1.0).abs() < 1e-14);
        assert!((cell.least_jacobian(&mirrored) - 1.0).abs() < 1e-14);
        let mut ends: Vec<[usize; 2]> = vec![];
        for side in cell.kind.sides {
            (0..side.len()).for_each(|i| {
                let (a, b) = (side[i], side[(i + 1) % side.len()]);
                ends.push([a.min(b), a.max(b)]);
            });
        }
        ends.sort_unstable();
        ends.dedup();
        let mut edges: Vec<[usize; 2]> =
            cell.kind.edges.iter().map(|[a, b]| [*a.min(b), *a.max(b)]).collect();
        edges.sort_unstable();
        assert_eq!(ends, edges, "the edges are those of the sides");
    }
}

/// `integral of x n_x` over a triangle.
fn flux_through([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (u, v) = ([b[1] - a[1], b[2] - a[2]], [c[1] - a[1], c[2] - a[2]]);
    0.5 * (u[0] * v[1] - u[1] * v[0]) * (a[0] + b[0] + c[0]) / 3.0
}

#[test]
fn sides_point_outwards_and_mirrored_cells_are_positive() {
    CELL_KINDS.iter().for_each(|kind| kind.visit(Sides));
}

struct Masses;

impl CellVisitor for Masses {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        for amplitude in [0.0, 0.1] {
            let nodes = mapped(cell, amplitude);
            let (consistent, lumped) = (cell.consistent(&nodes), cell.lumped(&nodes));
            assert!((lumped.iter().sum::<f64>() / cell.volume(&nodes) - 1.0).abs() < 1e-14);
            for (row, lumped) in consistent.iter().zip(&lumped) {
                assert!(*lumped > 0.0 && (row.iter().sum::<f64>() / lumped - 1.0).abs() < 1e-14);
            }
            let xi = [0.3, -0.7, 0.9];
            let mut place = [0.0; D];
            place.copy_from_slice(&xi[..D]);
            let mut at = [0.0; D];
            for (shape, node) in (cell.shape)(&place).iter().zip(&nodes) {
                (0..D).for_each(|c| at[c] += shape * node[c]);
            }
            let found = cell.locate(&nodes, &at).unwrap();
            assert!((0..D).all(|c| (found[c] - xi[c]).abs() < 1e-9), "{found:?}");
        }
        // Of a unit cell `integral of N_a N_b` is (1/3)^s (1/6)^(D - s) for corners with s coordinates alike.
        let unit = cell.nodes.map(|node| node.map(|x| 0.5 * (x + 1.0)));
        let consistent = cell.consistent(&unit);
        for (a, b) in (0..N).flat_map(|a| (0..N).map(move |b| (a, b))) {
            let alike = (0..D).filter(|k| cell.nodes[a][*k] == cell.nodes[b][*k]).count() as i32;
            let exact = 3f64.powi(-alike) * 6f64.powi(alike - D as i32);
            assert!((consistent[a][b] - exact).abs() < 1e-15);
        }
        assert!((cell.mean_ratio(&unit) - 1.0).abs() < 1e-14);
        let mut flat = unit;
        flat.iter_mut().for_each(|node| node[0] *= 1e-3);
        assert!(cell.mean_ratio(&flat) < 0.1);
        let mut folded = unit;
        folded[0] = folded[2].map(|x| 1.5 * x);
        assert!(cell.least_jacobian(&folded) < 0.0);
    }
}

#[test]
fn masses_add_up_and_places_are_found_again() {
    CELL_KINDS.iter().for_each(|kind| kind.visit(Masses));
}
