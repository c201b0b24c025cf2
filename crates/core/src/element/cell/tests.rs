use super::*;
use crate::algebra::tests::sample::Random;
use crate::element::{interpolation, quadrature_count};

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
        // Larger sums round more.
        let rounding = if cell.kind.order() == 1 { 1e-15 } else { 1e-14 };
        let mut random = Random(2);
        for _ in 0..20 {
            let mut xi = [0.0; D];
            xi.iter_mut().for_each(|x| *x = random.uniform(-1.0, 1.0));
            assert!(((cell.shape)(&xi).iter().sum::<f64>() - 1.0).abs() < rounding);
            for k in 0..D {
                // Differences are exact for functions linear or quadratic in each coordinate.
                let moved = |step: f64| {
                    let mut at = xi;
                    at[k] += step;
                    (cell.shape)(&at)
                };
                let (ahead, behind, slopes) = (moved(0.25), moved(-0.25), (cell.slopes)(&xi));
                let bound = if cell.kind.order() == 1 { 1e-14 } else { 2e-14 };
                assert!((0..N).all(|a| (slopes[a][k] - 2.0 * (ahead[a] - behind[a])).abs() < bound));
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

    /// Outward sides enclose the volume (divergence theorem), also in mirrored cells.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        // Between corners alone flat, and those in the middle of edges nearly so.
        let nodes = mapped(cell, if cell.kind.order() == 1 { 0.05 } else { 1e-3 });
        let mut flux = 0.0;
        for side in cell.kind.sides {
            let x = |a: usize| nodes[side[a]];
            flux += if D == 2 {
                let (a, b) = (x(0), x(1));
                0.5 * ((a[0] + b[0]) * (b[1] - a[1])) / 1.0
            } else {
                // The flux of a bilinear side is taken from four triangles about its centre.
                let mut centre = [0.0; 3];
                (0..3).for_each(|c| centre[c] = 0.25 * (0..4).map(|a| x(a)[c]).sum::<f64>());
                let corner = |a: usize| [x(a % 4)[0], x(a % 4)[1], x(a % 4)[2]];
                (0..4).map(|a| flux_through([centre, corner(a), corner(a + 1)])).sum::<f64>()
            };
        }
        let volume = cell.volume(&nodes);
        // Bilinear sides differ from these triangles by the square of the bend.
        assert!((flux / volume - 1.0).abs() < 1e-2, "{}: {flux} {volume}", cell.kind.name);
        let flat = mapped(cell, 0.0);
        let mut mirrored = flat;
        for (a, node) in cell.kind.mirror.iter().enumerate() {
            mirrored[a] = flat[*node];
            mirrored[a][0] = -mirrored[a][0];
        }
        let rounding = if cell.kind.order() == 1 { 1e-14 } else { 1e-13 };
        assert!((cell.volume(&mirrored) / cell.volume(&flat) - 1.0).abs() < rounding);
        assert!((cell.least_jacobian(&mirrored) - 1.0).abs() < rounding);
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

/// Returns `integral of x n_x` over a triangle.
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
        // In a unit cell `integral of N_a N_b` is (1/3)^s (1/6)^(D - s) for corners with s equal
        // coordinates.
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

struct Middles;

impl CellVisitor for Middles {
    type Output = ();

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
        let kind = cell.kind;
        let mean = |nodes: &[usize]| -> [f64; D] {
            std::array::from_fn(|c| nodes.iter().map(|a| cell.nodes[*a][c]).sum::<f64>() / nodes.len() as f64)
        };
        for (edge, node) in kind.edges.iter().zip(kind.corners..) {
            assert_eq!(mean(edge), cell.nodes[node], "{} {edge:?}", kind.name);
        }
        for (side, node) in kind.sides.iter().zip(kind.face_nodes()) {
            assert_eq!(mean(side), cell.nodes[node], "{} {side:?}", kind.name);
        }
        let first = kind.of_first_order().unwrap();
        assert_eq!((first.corners, first.dimension), (kind.corners, kind.dimension));
        assert!([true, false].map(|few| first.of_second_order(few)).contains(&Some(kind)));
        let of_points = cell.points.iter().zip(cell.slopes_at_points);
        assert!(of_points.clone().all(|((xi, _), slopes)| (cell.slopes)(xi) == *slopes));
        assert_eq!(of_points.count(), quadrature_count::<D, N>());
        let mut gmsh = kind.gmsh_nodes.to_vec();
        gmsh.sort_unstable();
        assert!(gmsh.is_empty() || gmsh.iter().copied().eq(0..N));
        // With full integration the values at the points give `dx/dxi` anywhere.
        let nodes = mapped(cell, 0.05);
        let at = [0.3, -0.7, 0.9];
        let mut xi = [0.0; D];
        xi.copy_from_slice(&at[..D]);
        let place = [0.3, -0.7, if D == 3 { 0.9 } else { 0.0 }, 0.0];
        let mut found = Mat::zero();
        for ((point, _), weight) in cell.points.iter().zip(interpolation::<D, N>(&place)) {
            found = cell.jacobian(&nodes, point).scale_add(weight, &found);
        }
        let error = (found - cell.jacobian(&nodes, &xi)).norm_squared().sqrt();
        let is_full = cell.points.len() == 3usize.pow(D as u32);
        assert!(if is_full { error < 1e-13 } else { error < 0.3 }, "{}: {error:e}", kind.name);
        assert_eq!(
            cell.locate(&nodes, &mean_place(&nodes)).map(|xi| xi.map(|x| x.abs() < 0.5)),
            Some([true; D])
        );
    }
}

fn mean_place<const D: usize, const N: usize>(nodes: &[[f64; D]; N]) -> Vec<f64> {
    (0..D).map(|c| nodes.iter().map(|x| x[c]).sum::<f64>() / N as f64).collect()
}

#[test]
fn nodes_of_second_order_are_in_the_middle_and_points_give_what_is_between_them() {
    CELL_KINDS.iter().filter(|kind| kind.order() == 2).for_each(|kind| kind.visit_second(Middles));
}

#[test]
fn masses_add_up_and_places_are_found_again() {
    CELL_KINDS.iter().filter(|kind| kind.order() == 1).for_each(|kind| kind.visit_first(Masses));
}
