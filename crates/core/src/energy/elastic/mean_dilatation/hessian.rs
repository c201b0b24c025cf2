//! The exact Hessian of a cell. With `b_a` of [`packs`](super::packs) at a point, `C = dP/dF` at `Fb`,
//! `s^D = theta / J`, `g = (cof F b_a)_a = dJ/dx`, `G` its mean by the weights and
//! `l = G / theta - g / J`,
//!
//! ```text
//! dFb = s (dF + F (l . dx) / D)
//! K   = sum_q w_q { dFb : C : dFb + p (l l^T / D + g g^T / J^2) + s/D (l t^T + t l^T)
//!                   + (pm / theta - p / J) d2J }  -  V pm G G^T / theta^2,     t_a = P b_a,
//! d2J_ab = [F (b_a x b_b)]_x
//! ```
//!
//! For materials linear in `F` only the first term is left, with `s F = I` beside `l` and
//! `l = sum_q w_q b / V - b`.

use std::ops::Range;

use super::pack_hessian::{self, PackBlocks};
use super::{Dilatation, MeanDilatation, PointPack, Points, gradient_of_lane, in_lanes};
use crate::algebra::{Mat, TURNS, project_positive};
use crate::element::cross;
use crate::energy::elastic::block::stresses;
use crate::energy::elastic::points_of;
use crate::energy::elastic::predicted::Stressed;
use crate::lanes::WIDTH;
use crate::material::{Psd, Tangent};

/// A quadrature point of one cell.
struct CellPoint<const D: usize, const N: usize> {
    /// Its part of the volume.
    part: f64,
    /// `b` of every node.
    gradient: [[f64; D]; N],
    f: Mat<f64, D>,
    j: f64,
    /// `dJ/dx`, or of the trace.
    slope: [[f64; D]; N],
}

/// Writes the Hessians of `stencils`, whole packs of them; with a place `from`, with the stresses that are
/// predicted from it.
pub(super) fn fill<const D: usize, const N: usize>(
    term: &MeanDilatation<D, N>,
    stencils: Range<usize>,
    x: &[f64],
    (psd, from): (Psd, Option<&[f64]>),
    out: &mut [f64],
) {
    let n = N * D;
    let mut matrix = vec![0.0; n * n];
    let pairs = N * (N + 1) / 2;
    let has_spectrum = term.material.spectrum(&[1.0; D]).is_some();
    let on_lanes = from.is_none() && term.dilatation != Dilatation::Small && has_spectrum;
    let mut of_pack = PackBlocks::ZERO;
    let packs = stencils.start / WIDTH..stencils.end / WIDTH;
    let out = out.chunks_exact_mut(WIDTH * pairs * D * D);
    let mut lanes = term.patches.lanes_in(stencils);
    for (pack, out) in packs.zip(out) {
        let cells: Vec<[u32; N]> = lanes.by_ref().take(WIDTH).map(|(vertices, ..)| vertices).collect();
        if on_lanes {
            let points = Points {
                rest: term.packs.rest(pack),
                volume: &term.packs.volume[pack],
                index: &term.patches.index[pack],
                dilatation: term.dilatation,
            };
            pack_hessian::blocks((&*term.material, term.stress), points, &in_lanes(x, &cells), &mut of_pack);
        }
        for ((lane, vertices), out) in cells.iter().enumerate().zip(out.chunks_exact_mut(pairs * D * D)) {
            let volume = term.packs.volume[pack][lane];
            if volume == 0.0 {
                out.fill(0.0);
                continue;
            }
            if on_lanes && term.bending.is_none() && psd == Psd::Exact {
                of_pack.write_lane(lane, out);
                continue;
            }
            if on_lanes {
                of_pack.expand_lane::<N>(lane, &mut matrix);
            } else {
                matrix.fill(0.0);
                let points = points(term, x, vertices, pack, lane);
                let before = from.map(|from| self::points(term, from, vertices, pack, lane));
                let predicted = before.map(|before| predict(term, &before, &points));
                add(term, (&points, volume), predicted, &mut matrix);
            }
            if let Some(bending) = &term.bending {
                let turns = term.dilatation != Dilatation::Small;
                bending.add_hessian(&points_of(x, vertices), (pack, lane), turns, &mut matrix);
            }
            if psd == Psd::Projected {
                project_positive(&mut matrix, n);
            }
            let blocks = (0..N).flat_map(|a| (a..N).map(move |b| (a, b))).zip(out.chunks_exact_mut(D * D));
            for ((a, b), block) in blocks {
                for (i, row) in block.chunks_exact_mut(D).enumerate() {
                    row.copy_from_slice(&matrix[(a * D + i) * n + b * D..][..D]);
                }
            }
        }
    }
}

fn points<const D: usize, const N: usize>(
    term: &MeanDilatation<D, N>,
    x: &[f64],
    vertices: &[u32; N],
    pack: usize,
    lane: usize,
) -> Vec<CellPoint<D, N>> {
    let nodes = points_of::<D, N>(x, vertices);
    let point = |rest: &PointPack<D, N>| {
        let (gradient, part) = rest.lane(lane);
        let f = gradient_of_lane(&nodes, &gradient);
        let cofactor = if term.dilatation == Dilatation::Small { Mat::identity() } else { f.cofactor() };
        let slope = gradient.map(|b| cofactor.mul_vec(&b));
        CellPoint { part, gradient, f, j: f.determinant(), slope }
    };
    term.packs.rest(pack).iter().map(point).collect()
}

/// The mean over the volume.
fn mean<const D: usize, const N: usize>(
    points: &[CellPoint<D, N>],
    of: impl Fn(&CellPoint<D, N>) -> f64,
) -> f64 {
    points.iter().map(|point| point.part * of(point)).sum()
}

/// Stresses of a cell that turn with its nodes, in the words of
/// [`predicted`](crate::energy::elastic::predicted).
struct Turning<const D: usize> {
    /// `pm / theta`.
    pressure: f64,
    /// `S` of each point.
    stress: Vec<Mat<f64, D>>,
}

/// Stresses that turn in a cell deformed as at the points `to`, as the linearisation at the points `from` has
/// them.
///
/// Of `Fb` the change is `dFb = s (dF + F (dtheta / theta - dJ / J) / D)`.
fn predict<const D: usize, const N: usize>(
    term: &MeanDilatation<D, N>,
    from: &[CellPoint<D, N>],
    to: &[CellPoint<D, N>],
) -> Turning<D> {
    let theta = mean(from, |point| point.j);
    let dilated = dilate(from, theta, term.dilatation);
    let p = stresses(&*term.material, term.stress, &dilated);
    let dj = |q: usize| from[q].f.cofactor().dot(&(to[q].f - from[q].f));
    let dtheta: f64 = (0..from.len()).map(|q| from[q].part * dj(q)).sum();
    let mut turning = Turning { pressure: 0.0, stress: vec![] };
    for (q, point) in from.iter().enumerate() {
        let old = Stressed { f: point.f, s: scale::<D>(point.j, theta, true), p: p.lane(q) };
        let (df, ds) = (to[q].f - old.f, old.s * (dtheta / theta - dj(q) / point.j) / D as f64);
        let df_dilated = df.scale(old.s) + old.f.scale(ds);
        let dp = term.material.tangent(&dilated[q], Psd::Exact).apply(&df_dilated);
        let (parts, change) = (old.parts(), old.change(&Stressed { f: df, s: ds, p: dp }));
        let pressure = parts.pressure + change.pressure - parts.pressure * dtheta / theta;
        turning.pressure += point.part * pressure / theta;
        turning.stress.push(parts.turning + change.turning);
    }
    turning
}

/// Adds the Hessian of a cell of this volume; with `predicted` stresses where they turn with the nodes.
fn add<const D: usize, const N: usize>(
    term: &MeanDilatation<D, N>,
    (points, volume): (&[CellPoint<D, N>], f64),
    predicted: Option<Turning<D>>,
    matrix: &mut [f64],
) {
    let (small, finite) = (term.dilatation == Dilatation::Small, term.dilatation == Dilatation::Finite);
    let theta = if small { mean(points, |point| point.f.trace()) } else { mean(points, |point| point.j) };
    let mut mean_slope = [[0.0; D]; N];
    for a in 0..N {
        (0..D).for_each(|i| mean_slope[a][i] = mean(points, |point| point.slope[a][i]));
    }
    let dilated = dilate(points, theta, term.dilatation);
    let stress = stresses(&*term.material, term.stress, &dilated);
    let pressure = |q: usize| stress.lane(q).dot(&dilated[q]) / D as f64;
    let mean_pressure: f64 = (0..points.len()).map(|q| points[q].part * pressure(q)).sum();
    let turning = predicted.as_ref().map_or(mean_pressure / theta, |predicted| predicted.pressure);
    for (q, point) in points.iter().enumerate() {
        let tangent = term.material.tangent(&dilated[q], Psd::Exact);
        let w = volume * point.part;
        let s = scale::<D>(point.j, theta, finite);
        let mut with_turning = tangent;
        if let Some(predicted) = &predicted {
            let now = Stressed { f: point.f, s, p: stress.lane(q) }.parts().turning;
            with_turning.add_turning(&(predicted.stress[q] - now).scale(1.0 / (s * s)));
        }
        // Without a mean only this is left.
        add_tangent(&with_turning, w * (s * s), &point.gradient, matrix);
        if term.dilatation == Dilatation::Own {
            continue;
        }
        let (f, l) = if small {
            (Mat::identity(), combined(&mean_slope, 1.0, &point.slope, -1.0))
        } else {
            let l = combined(&mean_slope, 1.0 / theta, &point.slope, -1.0 / point.j);
            (point.f, l)
        };
        let along = tangent.apply(&f);
        let (p, d) = (if small { 0.0 } else { pressure(q) }, D as f64);
        let with_stress = if small { along } else { along.scale(s * s) + stress.lane(q).scale(s) };
        let v = point.gradient.map(|b| with_stress.mul_vec(&b));
        add_product(&v, &l, w / d, matrix);
        add_product(&l, &v, w / d, matrix);
        add_product(&l, &l, w * (s * s * along.dot(&f) / (d * d) + p / d), matrix);
        if finite {
            add_product(&point.slope, &point.slope, w * p / (point.j * point.j), matrix);
            add_second(point, w * (turning - p / point.j), matrix);
        }
    }
    if finite {
        add_product(&mean_slope, &mean_slope, -volume * mean_pressure / (theta * theta), matrix);
    }
}

/// `s` of a point.
fn scale<const D: usize>(j: f64, theta: f64, finite: bool) -> f64 {
    if finite { super::kernels::root::<f64, D>(theta, j) } else { 1.0 }
}

/// `Fb` of every point.
fn dilate<const D: usize, const N: usize>(
    points: &[CellPoint<D, N>],
    theta: f64,
    how: Dilatation,
) -> Vec<Mat<f64, D>> {
    let of_point = |point: &CellPoint<D, N>| match how {
        Dilatation::Finite => point.f.scale(scale::<D>(point.j, theta, true)),
        Dilatation::Small => point.f + Mat::scalar((theta - point.f.trace()) / D as f64),
        Dilatation::Own => point.f,
    };
    points.iter().map(of_point).collect()
}

/// `alpha u + beta v`.
fn combined<const D: usize, const N: usize>(
    u: &[[f64; D]; N],
    alpha: f64,
    v: &[[f64; D]; N],
    beta: f64,
) -> [[f64; D]; N] {
    let mut sum = [[0.0; D]; N];
    for a in 0..N {
        (0..D).for_each(|i| sum[a][i] = alpha * u[a][i] + beta * v[a][i]);
    }
    sum
}

/// Adds `factor u v^T`.
pub(super) fn add_product<const D: usize, const N: usize>(
    u: &[[f64; D]; N],
    v: &[[f64; D]; N],
    factor: f64,
    matrix: &mut [f64],
) {
    for (u, row) in u.as_flattened().iter().zip(matrix.chunks_exact_mut(N * D)) {
        row.iter_mut().zip(v.as_flattened()).for_each(|(entry, v)| *entry += factor * u * v);
    }
}

/// Adds `w C_ijkl (grad N_a)_j (grad N_b)_l`.
fn add_tangent<const D: usize, const N: usize>(
    tangent: &Tangent<D>,
    weight: f64,
    gradient: &[[f64; D]; N],
    matrix: &mut [f64],
) {
    for a in 0..N {
        for i in 0..D {
            let row = &mut matrix[(a * D + i) * N * D..][..N * D];
            for k in 0..D {
                for l in 0..D {
                    let sum: f64 = (0..D).map(|j| gradient[a][j] * tangent.0[i][j][k][l]).sum();
                    (0..N).for_each(|b| row[b * D + k] += weight * sum * gradient[b][l]);
                }
            }
        }
    }
}

/// Adds `factor d2J/dx2`.
fn add_second<const D: usize, const N: usize>(point: &CellPoint<D, N>, factor: f64, matrix: &mut [f64]) {
    let padded = |b: &[f64; D]| {
        let mut padded = [0.0; 3];
        padded[..D].copy_from_slice(b);
        padded
    };
    for a in 0..N {
        for b in 0..N {
            let normal = cross(padded(&point.gradient[a]), padded(&point.gradient[b]));
            // Its cross product is the block; in the plane it is along z.
            let mut axis = [0.0, 0.0, normal[2]];
            if D == 3 {
                (0..3).for_each(|m| axis[m] = (0..3).map(|n| point.f[m][n] * normal[n]).sum());
            }
            for (i, k, m, sign) in TURNS.into_iter().filter(|(i, k, ..)| *i < D && *k < D) {
                matrix[(a * D + i) * N * D + b * D + k] += factor * sign * axis[m];
            }
        }
    }
}
