//! Hyperelastic elements: the energy `sum_e w_e Psi(F_e)`.

use super::patch::{Patch, Patches, Scratch};
use super::{DeformationExtremes, EnergyKind, EnergyTerm, Fault};
use crate::algebra::Mat;
use crate::element::{SimplexPack, edge_matrix, simplex_rest, vertex_gradients};
use crate::lanes::{Kernel, Lanes, Pair, WIDTH, dispatch, dispatch_compact};
use crate::material::{Domain, Material, Psd, autodiff_stress};
use crate::scalar::Scalar;
use crate::scene::Stress;

/// Linear simplices of `N = D + 1` vertices filled with one material.
pub struct Elastic<M, const D: usize, const N: usize> {
    body: String,
    material: M,
    stress: Stress,
    patches: Patches<N>,
    packs: Vec<SimplexPack<D>>,
    scratch: Vec<Scratch<D>>,
    sums: Vec<f64>,
    /// One number per patch.
    parts: Vec<f64>,
}

impl<M: Material<D>, const D: usize, const N: usize> Elastic<M, D, N> {
    /// Elements `elements` (global vertex indices) of `body`, at rest at `rest` (flat, all vertices of the system) [m], their
    /// stress computed as `stress` says.
    ///
    /// # Panics
    /// If `N` is not `D + 1`, or an element has no positive area or volume: meshes are checked before.
    pub fn new(body: &str, material: M, stress: Stress, elements: &[[u32; N]], rest: &[f64]) -> Self {
        assert_eq!(N, D + 1, "a simplex has one vertex more than dimensions");
        let patches = Patches::new::<D>(elements, rest.len() / D);
        let mut packs = vec![SimplexPack::new(); patches.index.len()];
        for (element, pack, lane) in patches.stencils() {
            let (inverse_rest, weight) = simplex_rest(&points_of(rest, &elements[element as usize]));
            assert!(weight > 0.0, "element {element} of {body} has volume {weight}");
            packs[pack].set(lane, &inverse_rest, weight);
        }
        for (pack, stencils) in packs.iter_mut().zip(&patches.stencil) {
            pack.fill_up(stencils.iter().flatten().count());
        }
        Elastic {
            body: body.into(),
            material,
            stress,
            scratch: patches.scratch(),
            sums: patches.sums::<D>(),
            parts: vec![0.0; patches.patches.len()],
            patches,
            packs,
        }
    }

    /// The elements with their global vertices and rest data, in the order of the patches, one at a time.
    fn elements(&self) -> impl Iterator<Item = (usize, [u32; N], Mat<f64, D>, f64)> {
        self.patches.patches.iter().flat_map(move |patch| {
            let vertices = &self.patches.vertices[patch.vertices.clone()];
            patch.packs.clone().flat_map(move |pack| {
                let lanes = self.patches.stencil[pack].iter().enumerate();
                lanes.filter_map(move |(lane, element)| {
                    let mut global = [0; N];
                    for node in 0..N {
                        global[node] = vertices[self.patches.index[pack][node][lane] as usize];
                    }
                    let (inverse_rest, weight) = self.packs[pack].lane(lane);
                    element.map(|e| (e as usize, global, inverse_rest, weight))
                })
            })
        })
    }
}

/// The rows of `vertices` in a flat array.
fn points_of<const D: usize, const N: usize>(x: &[f64], vertices: &[u32; N]) -> [[f64; D]; N] {
    let mut points = [[0.0; D]; N];
    for (point, &v) in points.iter_mut().zip(vertices) {
        point.copy_from_slice(&x[v as usize * D..v as usize * D + D]);
    }
    points
}

impl<M: Material<D>, const D: usize, const N: usize> EnergyTerm for Elastic<M, D, N> {
    fn name(&self) -> String {
        format!("elements of `{}`", self.body)
    }

    fn kind(&self) -> EnergyKind {
        EnergyKind::Elastic
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let (patches, packs, material) = (&self.patches, &self.packs, &self.material);
        patches.for_each(&mut self.scratch, &mut self.parts, 1, |patch, scratch, out| {
            scratch.position.load_vertices(x, &patches.vertices[patch.vertices.clone()]);
            out[0] = dispatch_compact(EnergyKernel { material, patches, packs, patch, scratch });
        });
        self.parts.iter().sum()
    }

    fn add_gradient(&mut self, x: &[f64], g: &mut [f64]) {
        let (patches, packs, material, stress) = (&self.patches, &self.packs, &self.material, self.stress);
        patches.for_each(
            &mut self.scratch,
            &mut self.sums,
            patches.per_patch::<D>(),
            |patch, scratch, out| {
                let vertices = &patches.vertices[patch.vertices.clone()];
                scratch.position.load_vertices(x, vertices);
                scratch.gradient.clear(vertices.len());
                match stress {
                    Stress::Analytic => {
                        dispatch(GradientKernel::<_, D, N, false> {
                            material,
                            patches,
                            packs,
                            patch,
                            scratch,
                        });
                    }
                    Stress::Autodiff => {
                        dispatch_compact(GradientKernel::<_, D, N, true> {
                            material,
                            patches,
                            packs,
                            patch,
                            scratch,
                        });
                    }
                }
                out.copy_from_slice(&scratch.gradient.as_slice()[..out.len()]);
            },
        );
        patches.gather::<D>(&self.sums, g);
    }

    fn add_hessian_product(&self, x: &[f64], p: &[f64], y: &mut [f64]) {
        for (_, vertices, inverse_rest, weight) in self.elements() {
            let f = edge_matrix(&points_of(x, &vertices)).mul(&inverse_rest);
            let df = edge_matrix(&points_of(p, &vertices)).mul(&inverse_rest);
            let dp = self.material.hessian(&f, Psd::Exact).apply(&df);
            let gradients: [[f64; D]; N] = vertex_gradients(&dp.scale(weight).mul_transpose(&inverse_rest));
            for (gradient, v) in gradients.iter().zip(vertices) {
                for (y, g) in y[v as usize * D..].iter_mut().zip(gradient) {
                    *y += g;
                }
            }
        }
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.elements().find_map(|(element, vertices, inverse_rest, _)| {
            let f = edge_matrix(&points_of(x, &vertices)).mul(&inverse_rest);
            let j = f.determinant();
            let outside = self.material.domain() == Domain::PositiveJ && j.is_nan() | (j <= 0.0);
            let finite = self.material.pk1(&f).norm_squared().is_finite();
            (outside || !finite).then(|| Fault::Element { body: self.body.clone(), element, j })
        })
    }

    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let (patches, packs) = (&self.patches, &self.packs);
        let mut parts =
            vec![DeformationExtremes { min_j: f64::INFINITY, inverted: 0 }; patches.patches.len()];
        patches.for_each(&mut self.scratch, &mut parts, 1, |patch, scratch, out| {
            scratch.position.load_vertices(x, &patches.vertices[patch.vertices.clone()]);
            out[0] = dispatch_compact(DeformationKernel { patches, packs, patch, scratch });
        });
        parts.into_iter().reduce(DeformationExtremes::merge)
    }

    fn bytes(&self) -> usize {
        self.patches.bytes()
            + size_of_val(&self.packs[..])
            + 8 * (self.sums.len() + self.parts.len())
            + self.scratch.len() * Scratch::<D>::BYTES
    }
}

/// Deformation gradient and rest data of the elements of one pack.
#[inline(always)]
fn deformation_gradient<L: Lanes, const D: usize, const N: usize>(
    scratch: &Scratch<D>,
    index: &[[u16; WIDTH]; N],
    inverse_rest: &Mat<L, D>,
) -> Mat<L, D> {
    let mut x = [[L::zero(); D]; N];
    for node in 0..N {
        x[node] = L::gather(&scratch.position, &index[node]);
    }
    edge_matrix(&x).mul(inverse_rest)
}

struct GradientKernel<'a, M, const D: usize, const N: usize, const AUTODIFF: bool> {
    material: &'a M,
    patches: &'a Patches<N>,
    packs: &'a [SimplexPack<D>],
    patch: &'a Patch,
    scratch: &'a mut Scratch<D>,
}

impl<M: Material<D>, const D: usize, const N: usize, const AUTODIFF: bool>
    GradientKernel<'_, M, D, N, AUTODIFF>
{
    /// `H = w P D_m^-T`.
    #[inline(always)]
    fn weighted_stress<S: Scalar>(&self, f: &Mat<S, D>, inverse_rest: &Mat<S, D>, weight: S) -> Mat<S, D> {
        let p = if AUTODIFF { autodiff_stress(self.material, f) } else { self.material.pk1(f) };
        p.scale(weight).mul_transpose(inverse_rest)
    }

    /// Adds the vertex gradients of one pack.
    #[inline(always)]
    fn scatter<L: Lanes>(&mut self, pack: usize, h: &Mat<L, D>) {
        let gradients: [[L; D]; N] = vertex_gradients(h);
        for node in 0..N {
            L::scatter_add(&mut self.scratch.gradient, &self.patches.index[pack][node], gradients[node]);
        }
    }

    #[inline(always)]
    fn one_pack<L: Lanes>(&mut self, pack: usize) {
        let rest = self.packs[pack].inverse_rest::<L>();
        let f = deformation_gradient(self.scratch, &self.patches.index[pack], &rest);
        let weight = self.packs[pack].weight::<L>();
        if !L::BY_LANE {
            let h = self.weighted_stress(&f, &rest, weight);
            return self.scatter(pack, &h);
        }
        let mut h = [[[0.0; WIDTH]; D]; D];
        for l in 0..WIDTH {
            let of_lane = self.weighted_stress_of_lane(&lane(&f, l), &lane(&rest, l), weight.to_array()[l]);
            for i in 0..D {
                for j in 0..D {
                    h[i][j][l] = of_lane[i][j];
                }
            }
        }
        self.scatter(pack, &load_matrix::<L, D>(&h));
    }

    #[inline(never)]
    fn weighted_stress_of_lane(
        &self,
        f: &Mat<f64, D>,
        inverse_rest: &Mat<f64, D>,
        weight: f64,
    ) -> Mat<f64, D> {
        self.weighted_stress(f, inverse_rest, weight)
    }

    /// Two packs a turn: the latency of divisions and roots in one hides behind the other. They are added one after the
    /// other, so that the sums are those of one pack a turn.
    #[inline(always)]
    fn two_packs<L: Lanes>(&mut self, first: usize) {
        // The last pack of an odd number goes with itself, and is added once.
        let second = if first + 1 < self.patch.packs.end { first + 1 } else { first };
        let (a, b) = (&self.packs[first], &self.packs[second]);
        let (rest_a, rest_b) = (a.inverse_rest::<L>(), b.inverse_rest::<L>());
        let f_a = deformation_gradient(self.scratch, &self.patches.index[first], &rest_a);
        let f_b = deformation_gradient(self.scratch, &self.patches.index[second], &rest_b);
        let weight = Pair(a.weight::<L>(), b.weight::<L>());
        let h = self.weighted_stress(&both(&f_a, &f_b), &both(&rest_a, &rest_b), weight);
        let (h_a, h_b) = Pair::unzip_rows(&h.0);
        self.scatter(first, &Mat(h_a));
        if second != first {
            self.scatter(second, &Mat(h_b));
        }
    }
}

impl<M: Material<D>, const D: usize, const N: usize, const AUTODIFF: bool> Kernel
    for GradientKernel<'_, M, D, N, AUTODIFF>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        // One of the two loops is compiled, so that a material's stress is inlined once. Dual numbers are many registers
        // already: pairs of them only spill.
        if L::PAIRS_PAY && !AUTODIFF {
            for pack in self.patch.packs.clone().step_by(2) {
                self.two_packs::<L>(pack);
            }
        } else {
            for pack in self.patch.packs.clone() {
                self.one_pack::<L>(pack);
            }
        }
    }
}

/// The matrix of pairs `(a, b)`.
#[inline(always)]
fn both<S: Scalar, const D: usize>(a: &Mat<S, D>, b: &Mat<S, D>) -> Mat<Pair<S>, D> {
    Mat(Pair::zip_rows(&a.0, &b.0))
}

/// The matrix of one lane.
#[inline(always)]
fn lane<L: Lanes, const D: usize>(m: &Mat<L, D>, lane: usize) -> Mat<f64, D> {
    let mut r = Mat::zero();
    for i in 0..D {
        for j in 0..D {
            r[i][j] = m[i][j].to_array()[lane];
        }
    }
    r
}

#[inline(always)]
fn load_matrix<L: Lanes, const D: usize>(m: &[[[f64; WIDTH]; D]; D]) -> Mat<L, D> {
    let mut r = Mat::zero();
    for i in 0..D {
        for j in 0..D {
            r[i][j] = L::load(&m[i][j]);
        }
    }
    r
}

struct EnergyKernel<'a, M, const D: usize, const N: usize> {
    material: &'a M,
    patches: &'a Patches<N>,
    packs: &'a [SimplexPack<D>],
    patch: &'a Patch,
    scratch: &'a Scratch<D>,
}

impl<M: Material<D>, const D: usize, const N: usize> EnergyKernel<'_, M, D, N> {
    #[inline(always)]
    fn density<L: Lanes>(&self, f: &Mat<L, D>) -> L {
        if !L::BY_LANE {
            return self.material.psi(f);
        }
        let mut psi = [0.0; WIDTH];
        for (l, psi) in psi.iter_mut().enumerate() {
            *psi = self.density_of_lane(&lane(f, l));
        }
        L::load(&psi)
    }

    #[inline(never)]
    fn density_of_lane(&self, f: &Mat<f64, D>) -> f64 {
        self.material.psi(f)
    }
}

impl<M: Material<D>, const D: usize, const N: usize> Kernel for EnergyKernel<'_, M, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let rest = self.packs[pack].inverse_rest::<L>();
            let f = deformation_gradient(self.scratch, &self.patches.index[pack], &rest);
            let weight = self.packs[pack].weight::<L>();
            let energy = weight * self.density(&f);
            // Zero times infinity in an empty lane is not zero.
            sum += L::select(L::zero().lt(weight), energy, L::zero());
        }
        sum.horizontal_sum()
    }
}

struct DeformationKernel<'a, const D: usize, const N: usize> {
    patches: &'a Patches<N>,
    packs: &'a [SimplexPack<D>],
    patch: &'a Patch,
    scratch: &'a Scratch<D>,
}

impl<const D: usize, const N: usize> Kernel for DeformationKernel<'_, D, N> {
    type Output = DeformationExtremes;

    #[inline(always)]
    fn run<L: Lanes>(self) -> DeformationExtremes {
        let mut min_j = L::splat(f64::INFINITY);
        let mut inverted = 0;
        for pack in self.patch.packs.clone() {
            let rest = self.packs[pack].inverse_rest::<L>();
            let j = deformation_gradient(self.scratch, &self.patches.index[pack], &rest).determinant();
            // Lanes that fill up repeat an element: they cannot change the minimum, but they must not be counted.
            let real = L::mask_to_bits(L::zero().lt(self.packs[pack].weight::<L>()));
            let upright = L::mask_to_bits(L::zero().lt(j));
            inverted += u64::from((real & !upright).count_ones());
            min_j = L::select(min_j.lt(j), min_j, j);
        }
        DeformationExtremes { min_j: min_j.horizontal_min(), inverted }
    }
}
