//! Derivatives of friction by positions, through normal forces, normals and closest points.
//!
//! The force of one contact along a direction `p` is `g = p . dR/dv = l phi(y) q . v_T` with the limit `l
//! = mu lambda(d)`, `phi = f1 / y`, `u = sum c_i v_i`, `q = sum c_i p_i`, `v_T = (I - n n^T) u`, `y =
//! |v_T|`.
//! With `s = q . v_T`
//!
//! ```text
//! dg = mu lambda' phi s dd + B . dn + sum_i C_i dc_i
//! B = -l [(phi'/y) s (n.u) v_T + phi ((n.u) q_T + (n.q) v_T)]
//! C_i = l [(phi'/y) s v_T.v_i + phi (v_T.p_i + q_T.v_i)]
//! ```
//!
//! The closest points minimise the distance. With the derivatives `c~_b` of the coefficients along the
//! orthonormal tangents `e_b`, and `P` the projector on the complement of normal and tangents,
//!
//! ```text
//! dd = sum_i c_i n.dx_i        e_b.dn = -sum_i c~_b,i n.dx_i        P dn = P sum_i c_i dx_i / d
//! dc_k = -sum_b c~_b,k sum_i (d c~_b,i n + c_i e_b).dx_i
//! ```

use crate::closest::InnerKind;
use crate::friction::{f1_over_y, f1_over_y_slope};
use crate::model::ContactLaw;
use crate::mollifier::{MollifiedPair, mollifier_of_edges};
use crate::pair::{EdgeEdge, PairGeometry, PointEdge, PointPoint};
use crate::vector::{along, dot, inverse_or_zero, mixture, rows, scaled};
use crate::visit::{ContactVisitor, PlaneGeometry};

/// Geometry and normal force of a contact with friction, and their derivatives by positions.
#[derive(Clone, Copy, Debug)]
struct RubbingPlace<const D: usize> {
    coefficients: [f64; 4],
    /// `c~_b` [1/m], and `e_b`, one for each parameter of the closest points.
    slopes: [[f64; 4]; 2],
    tangents: [[f64; D]; 2],
    parameters: usize,
    normal: [f64; D],
    /// Zero if the normal is fixed, as for a half-space [1/m].
    inverse_distance: f64,
    distance: f64,
    /// Normal force `lambda` [N], and its derivative by the distance [N/m].
    force: f64,
    force_slope: f64,
    /// Derivatives of `lambda` by the vertices, in addition to that by the distance [N/m].
    force_gradient: [[f64; D]; 4],
}

impl<const D: usize> RubbingPlace<D> {
    /// Geometry of a pair whose vertices are at these slots of a contact; `slope` and `curvature` are the
    /// first two derivatives of its energy by the squared distance.
    fn of_pair<const N: usize, const P: usize>(
        pair: &PairGeometry<f64, D, N, P>,
        slots: &[usize; N],
        (slope, curvature): (f64, f64),
    ) -> Self {
        let spread = |numbers: &[f64; N]| {
            let mut all = [0.0; 4];
            slots.iter().zip(numbers).for_each(|(slot, number)| all[*slot] = *number);
            all
        };
        let mut place = RubbingPlace {
            coefficients: spread(&pair.coefficients),
            slopes: [[0.0; 4]; 2],
            tangents: [[0.0; D]; 2],
            parameters: P,
            normal: pair.normal,
            inverse_distance: inverse_or_zero(pair.distance),
            distance: pair.distance,
            force: -2.0 * pair.distance * slope,
            force_slope: -2.0 * slope - 4.0 * pair.squared_distance * curvature,
            force_gradient: [[0.0; D]; 4],
        };
        for b in 0..P {
            (place.slopes[b], place.tangents[b]) = (spread(&pair.slopes[b]), pair.tangents[b]);
        }
        place
    }

    /// Converts to `E` dimensions; drops further components.
    fn in_dimension<const E: usize>(&self) -> RubbingPlace<E> {
        let row = |row: &[f64; D]| std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0));
        RubbingPlace {
            coefficients: self.coefficients,
            slopes: self.slopes,
            tangents: self.tangents.each_ref().map(row),
            parameters: self.parameters,
            normal: row(&self.normal),
            inverse_distance: self.inverse_distance,
            distance: self.distance,
            force: self.force,
            force_slope: self.force_slope,
            force_gradient: self.force_gradient.each_ref().map(row),
        }
    }

    /// Gradient `dg/dx_i` [N s/m times the unit of `p`] for the velocities `v` and the direction `p` of
    /// the vertices.
    fn gradient(
        &self,
        (friction, threshold): (f64, f64),
        v: &[[f64; D]; 4],
        p: &[[f64; D]; 4],
    ) -> [[f64; D]; 4] {
        let RubbingPlace { coefficients: c, slopes, tangents, normal: n, distance, .. } = self;
        // Slip of velocities and direction; derivatives of `g` by the normal and by the coefficients.
        let (u, q) = (mixture(c, v), mixture(c, p));
        let (u_n, q_n) = (dot(&u, n), dot(&q, n));
        let (v_t, q_t) = (along(&u, -u_n, n), along(&q, -q_n, n));
        let (y, s, limit) = (dot(&v_t, &v_t).sqrt(), dot(&q_t, &v_t), friction * self.force);
        let phi = f1_over_y(y, threshold);
        let turning = limit * f1_over_y_slope(y, threshold) * inverse_or_zero(y) * s;
        let mut by_normal = scaled(-turning * u_n, &v_t);
        by_normal = along(&by_normal, -limit * phi * u_n, &q_t);
        by_normal = along(&by_normal, -limit * phi * q_n, &v_t);
        let by_coefficient =
            |i: usize| turning * dot(&v_t, &v[i]) + limit * phi * (dot(&v_t, &p[i]) + dot(&q_t, &v[i]));
        // Factors of `c_i`, and of the derivatives `c~_b`, in the rows of the vertices.
        let mut of_coefficients = scaled(friction * self.force_slope * phi * s, n);
        let mut rest = by_normal;
        let mut of_slopes = [[0.0; D]; 2];
        for b in 0..self.parameters {
            let along_tangent = dot(&by_normal, &tangents[b]);
            let by_parameter: f64 = (0..4).map(|i| slopes[b][i] * by_coefficient(i)).sum();
            of_slopes[b] = scaled(-along_tangent - by_parameter * distance, n);
            of_coefficients = along(&of_coefficients, -by_parameter, &tangents[b]);
            rest = along(&rest, -along_tangent, &tangents[b]);
        }
        of_coefficients = along(&of_coefficients, self.inverse_distance, &rest);
        // Rows of the vertices.
        let mut gradient = [[0.0; D]; 4];
        for i in 0..4 {
            gradient[i] = scaled(friction * phi * s, &self.force_gradient[i]);
            gradient[i] = along(&gradient[i], c[i], &of_coefficients);
            for b in 0..self.parameters {
                gradient[i] = along(&gradient[i], slopes[b][i], &of_slopes[b]);
            }
        }
        gradient
    }
}

impl<const D: usize> RubbingPlace<D> {
    /// Changes of the forces on the first `count` vertices [N s/m times the unit of `u`] if the vertices
    /// move along `u`: each component is the gradient for a unit direction, times `u`.
    fn change(&self, law: (f64, f64), count: usize, v: &[[f64; D]; 4], u: &[[f64; D]; 4]) -> [[f64; D]; 4] {
        let mut change = [[0.0; D]; 4];
        for (i, row) in change.iter_mut().enumerate().take(count) {
            for (k, entry) in row.iter_mut().enumerate() {
                let mut unit = [[0.0; D]; 4];
                unit[i][k] = 1.0;
                let gradient = self.gradient(law, v, &unit);
                // Slots without a vertex of their own repeat the first and are skipped.
                *entry = (0..count).map(|j| dot(&gradient[j], &u[j])).sum();
            }
        }
        change
    }
}

/// Product with the derivative of friction forces by positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SlopeProduct {
    /// `(d2R/dx dv)^T p`.
    Transposed,
    /// `d2R/dx dv p`: change of the forces along `p`.
    Change,
}

/// Visitor that adds the product of every contact visited.
pub(crate) struct FrictionSlopes<'a> {
    pub(crate) product: SlopeProduct,
    /// Regularisation velocity [m/s].
    pub(crate) threshold: f64,
    /// Velocities, flat [m/s].
    pub(crate) v: &'a [f64],
    /// Direction of the product, flat.
    pub(crate) p: &'a [f64],
    /// Sum of the products, flat.
    pub(crate) y: &'a mut [f64],
}

impl FrictionSlopes<'_> {
    fn add<const D: usize>(&mut self, vertices: &[u32], place: &RubbingPlace<D>, friction: f64) {
        // Pairs with a tensile force have no friction.
        if !(friction > 0.0 && place.force > 0.0) {
            return;
        }
        let mut all = [vertices[0]; 4];
        all[..vertices.len()].copy_from_slice(vertices);
        let (v, p) = (rows::<D, 4>(self.v, &all), rows::<D, 4>(self.p, &all));
        let law = (friction, self.threshold);
        let product = match self.product {
            SlopeProduct::Transposed => place.gradient(law, &v, &p),
            SlopeProduct::Change => place.change(law, vertices.len(), &v, &p),
        };
        for (vertex, product) in vertices.iter().zip(product) {
            let row = &mut self.y[*vertex as usize * D..][..D];
            row.iter_mut().zip(product).for_each(|(y, g)| *y += g);
        }
    }
}

impl<const D: usize> ContactVisitor<D> for FrictionSlopes<'_> {
    fn pair<const N: usize, const P: usize>(
        &mut self,
        vertices: &[u32; N],
        pair: &PairGeometry<f64, D, N, P>,
        law: &ContactLaw,
        weight: f64,
    ) {
        let energy = law.barrier.at(pair.squared_distance, weight);
        let slots = std::array::from_fn(|i| i);
        let place = RubbingPlace::of_pair(pair, &slots, (energy.slope, energy.curvature));
        self.add(vertices, &place, law.friction);
    }

    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64) {
        let energy = law.barrier.at_signed(plane.distance, weight);
        let place = RubbingPlace {
            coefficients: [1.0, -1.0, 0.0, 0.0],
            slopes: [[0.0; 4]; 2],
            tangents: [[0.0; D]; 2],
            parameters: 0,
            normal: plane.normal,
            inverse_distance: 0.0,
            distance: plane.distance,
            force: -energy.slope,
            force_slope: -energy.curvature,
            force_gradient: [[0.0; D]; 4],
        };
        self.add(vertices, &place, law.friction);
    }

    fn mollified(&mut self, pair: &MollifiedPair, x: &[[f64; 3]; 4], law: &ContactLaw) {
        let [p, q, r, s] = pair.inner.slots;
        let of = |squared_distance: f64| {
            let energy = law.barrier.at(squared_distance, pair.weight);
            (energy.slope, energy.curvature)
        };
        let inner = match pair.inner.kind {
            InnerKind::PointPoint => {
                let inner = PairGeometry::of::<PointPoint>(&[x[p], x[q]]);
                RubbingPlace::of_pair(&inner, &[p, q], of(inner.squared_distance))
            }
            InnerKind::PointEdge => {
                let inner = PairGeometry::of::<PointEdge>(&[x[p], x[q], x[r]]);
                RubbingPlace::of_pair(&inner, &[p, q, r], of(inner.squared_distance))
            }
            _ => {
                let inner = PairGeometry::of::<EdgeEdge>(&[x[p], x[q], x[r], x[s]]);
                RubbingPlace::of_pair(&inner, &[p, q, r, s], of(inner.squared_distance))
            }
        };
        let mollifier = mollifier_of_edges(x, pair.limit);
        let mut place = inner;
        place.force *= mollifier.value;
        place.force_slope *= mollifier.value;
        place.force_gradient = mollifier.gradient.map(|gradient| scaled(inner.force, &gradient));
        self.add(&pair.vertices, &place.in_dimension::<D>(), law.friction);
    }
}
