//! Linear springs.

use super::patch::{Patch, Patches, Scratch, Workspace};
use super::{EnergyKind, EnergyTerm, Fault};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::scalar::Scalar;

/// `E = 1/2 k (l - l0)^2` with `l = |x_1 - x_2|`; the gradient on `x_1` is `k (l - l0) (x_1 - x_2) / l` (lecture 9).
///
/// In the language of elements: `F = (x_1 - x_2) / l0`, `Psi = mu (|F| - 1)^2`, `E = l0 Psi`, so `k = 2 mu / l0`
/// (lecture 10). A spring of length zero has no direction and pulls with no force.
pub struct Springs<const D: usize> {
    body: String,
    patches: Patches<2>,
    packs: Vec<SpringPack>,
    workspace: Workspace<D>,
}

/// Constants of `WIDTH` springs; zero stiffness in lanes without a spring of their own.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct SpringPack {
    stiffness: [f64; WIDTH],
    rest_length: [f64; WIDTH],
}

/// Keeps the reciprocal of a length finite; no spring of the scale of things is as short.
const TINY: f64 = 1e-300;

impl<const D: usize> Springs<D> {
    /// Springs of `body` along `edges` (global vertex indices) of `vertex_count` vertices; stiffness [N/m] and rest length
    /// [m] of each.
    pub fn new(
        body: &str,
        edges: &[[u32; 2]],
        stiffness: &[f64],
        rest_length: &[f64],
        vertex_count: usize,
    ) -> Self {
        let order: Vec<u32> = (0..edges.len() as u32).collect();
        let patches = Patches::new::<D>(edges, &order, vertex_count);
        let empty = SpringPack { stiffness: [0.0; WIDTH], rest_length: [0.0; WIDTH] };
        let mut packs = vec![empty; patches.index.len()];
        for (spring, _, pack, lane) in patches.stencils() {
            packs[pack].stiffness[lane] = stiffness[spring];
            packs[pack].rest_length[lane] = rest_length[spring];
        }
        Springs { body: body.into(), workspace: Workspace::new(&patches), patches, packs }
    }

    /// Every spring with its ends (global), stiffness and rest length.
    fn springs(&self) -> impl Iterator<Item = (usize, [usize; 2], f64, f64)> {
        self.patches.stencils().map(|(spring, ends, pack, lane)| {
            let SpringPack { stiffness, rest_length } = &self.packs[pack];
            (spring, ends.map(|v| v as usize), stiffness[lane], rest_length[lane])
        })
    }
}

impl<const D: usize> EnergyTerm for Springs<D> {
    fn name(&self) -> String {
        format!("springs of `{}`", self.body)
    }

    fn kind(&self) -> EnergyKind {
        EnergyKind::Elastic
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let Springs { patches, packs, workspace, .. } = self;
        patches.sum(workspace, x, |patch, scratch| dispatch(EnergyKernel { patches, packs, patch, scratch }))
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let Springs { patches, packs, workspace, .. } = self;
        patches.evaluate(workspace, x, None, |patch, scratch| {
            dispatch(GradientKernel { patches, packs, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.patches.add_rows(&self.workspace, first, g);
    }

    /// `H = k [n n^T + (1 - l0/l) (I - n n^T)]` on the difference of the two ends (verified against differences).
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        for (_, [a, b], k, rest) in self.springs() {
            let (mut d, mut dp, mut l2) = ([0.0; D], [0.0; D], 0.0);
            for c in 0..D {
                d[c] = x[a * D + c] - x[b * D + c];
                dp[c] = p[a * D + c] - p[b * D + c];
                l2 += d[c] * d[c];
            }
            let l = f64::max(l2, TINY).sqrt();
            let mut along = 0.0;
            for c in 0..D {
                along += d[c] / l * dp[c];
            }
            let across = 1.0 - rest / l;
            for c in 0..D {
                let n = d[c] / l;
                let q = k * (n * along + across * (dp[c] - n * along));
                y[a * D + c] += q;
                y[b * D + c] -= q;
            }
        }
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.springs().find_map(|(spring, [a, b], k, rest)| {
            let l2: f64 = (0..D).map(|c| (x[a * D + c] - x[b * D + c]).powi(2)).sum();
            let length = l2.sqrt();
            let finite = (k * (length - rest)).is_finite();
            (!finite).then(|| Fault::Spring { body: self.body.clone(), spring, length })
        })
    }

    fn bytes(&self) -> usize {
        self.patches.bytes() + size_of_val(&self.packs[..]) + self.workspace.bytes()
    }
}

/// Difference of the two ends and its squared length, in every lane.
#[inline(always)]
fn separation<L: Lanes, const D: usize>(scratch: &Scratch<D>, index: &[[u16; WIDTH]; 2]) -> ([L; D], L) {
    let a: [L; D] = L::gather(&scratch.position, &index[0]);
    let b: [L; D] = L::gather(&scratch.position, &index[1]);
    let mut d = a;
    let mut l2 = L::zero();
    for c in 0..D {
        d[c] = a[c] - b[c];
        l2 = if c == 0 { d[0] * d[0] } else { d[c].mul_add(d[c], l2) };
    }
    (d, l2)
}

struct GradientKernel<'a, const D: usize> {
    patches: &'a Patches<2>,
    packs: &'a [SpringPack],
    patch: &'a Patch,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize> Kernel for GradientKernel<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for pack in self.patch.packs.clone() {
            let index = &self.patches.index[pack];
            let (d, l2) = separation::<L, D>(self.scratch, index);
            let l = Scalar::max(l2, L::splat(TINY)).sqrt();
            // k (l - l0) / l
            let k = L::load(&self.packs[pack].stiffness);
            let s = k * ((l - L::load(&self.packs[pack].rest_length)) / l);
            let (mut on_a, mut on_b) = (d, d);
            for c in 0..D {
                on_a[c] = s * d[c];
                on_b[c] = -on_a[c];
            }
            L::scatter_add(&mut self.scratch.gradient, &index[0], on_a);
            L::scatter_add(&mut self.scratch.gradient, &index[1], on_b);
        }
    }
}

struct EnergyKernel<'a, const D: usize> {
    patches: &'a Patches<2>,
    packs: &'a [SpringPack],
    patch: &'a Patch,
    scratch: &'a Scratch<D>,
}

impl<const D: usize> Kernel for EnergyKernel<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let (_, l2) = separation::<L, D>(self.scratch, &self.patches.index[pack]);
            let stretch = l2.sqrt() - L::load(&self.packs[pack].rest_length);
            let k = L::load(&self.packs[pack].stiffness);
            sum = (k * stretch).mul_add(stretch, sum);
        }
        0.5 * sum.horizontal_sum()
    }
}
