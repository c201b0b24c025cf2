//! Modes of the linearised system, as far as stability depends on them.

use super::lanczos::{LanczosGoal, largest_eigenvalue, norm, rayleigh_quotient, scale};
use crate::system::System;

/// Tolerance of boundary points, relative to the largest values.
const BOUNDARY_TOLERANCE: f64 = 1e-3;
/// Most boundary points.
const MAX_POINTS: usize = 16;

/// Upper end of the spectrum of `K u = omega^2 M u`, with the energy Hessian `K`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct HighestFrequency {
    /// Highest angular frequency [rad/s]; 0 if nothing oscillates.
    pub frequency: f64,
    /// Bound of its relative error, from the residual of the eigenpair.
    pub relative_error: f64,
    /// Number of Hessian products.
    pub products: usize,
}

/// Finds the highest natural frequency of `system` linearised at `x`, by Lanczos iteration on
/// `M^-1/2 K M^-1/2`, without pinned vertices.
///
/// If a term approximates its products (mutual gravity of many particles), the basis is kept, and the
/// eigenvector found takes one exact product: its Rayleigh quotient is the eigenvalue, and the residual
/// the bound.
pub fn largest_frequency(system: &mut System, x: &[f64]) -> HighestFrequency {
    let mut stiffness = |system: &mut System, p: &[f64], y: &mut [f64]| system.stiffness_product(x, p, y);
    let mut top = largest_eigenvalue(system, LanczosGoal::VALUE, &mut stiffness);
    system.end_stiffness_products();
    if top.approximate {
        let scale = scale(system);
        let exact = |system: &mut System, p: &[f64], y: &mut [f64]| system.hessian_product(x, p, y);
        (top.value, top.error) = rayleigh_quotient(system, &scale, &top.vector, exact);
        top.products += 1;
    }
    if top.value.is_nan() || top.value <= 0.0 {
        return HighestFrequency { frequency: 0.0, relative_error: 0.0, products: top.products };
    }
    HighestFrequency {
        frequency: top.value.sqrt(),
        relative_error: 0.5 * top.error / top.value,
        products: top.products,
    }
}

/// Mode of `x'' + c x' + k x = 0`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DampedMode {
    /// Stiffness `k`, the square of the undamped angular frequency [1/s^2].
    pub stiffness: f64,
    /// Damping `c` [1/s].
    pub damping: f64,
}

/// Range of the modes of `M x'' + C x' + K x = 0`.
///
/// A mode `u exp(lambda t)` is a root of `lambda^2 + c lambda + k = 0` with `k = u* K u / u* M u` and
/// `c = u* C u / u* M u`; Tisseur, Meerbergen 2001, *The quadratic eigenvalue problem*, SIAM Review 43,
/// 235, section 3. These pairs lie in the joint numerical range of both matrices, a convex set: no mode
/// is more damped, or faster, than some on its boundary. With `C = alpha M + beta K` all modes lie on the
/// line `c = alpha + beta k`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModeRange {
    /// Highest angular frequency [rad/s]; 0 if nothing oscillates.
    pub frequency: f64,
    /// Largest damping rate [1/s]; 0 without damping.
    pub damping: f64,
    /// Boundary points, from slow, strongly damped modes over fast ones to weakly damped ones.
    pub boundary: Vec<DampedMode>,
}

/// Computes the modes of `system` linearised at `(x, v)`. If forces alone keep surfaces apart, includes
/// an upper bound of the contact stiffness as long as no gap closes, whatever is in contact at `x`; also
/// includes the largest later stiffness of muscles.
pub fn mode_range(system: &mut System, x: &[f64], v: &[f64]) -> ModeRange {
    let mut modes = linearised_modes(system, x, v);
    let stiffening = system.stiffening();
    if stiffening > 0.0 {
        // The largest eigenvalue of a sum is at most the sum of the largest ones.
        modes.frequency = (modes.frequency * modes.frequency + stiffening).sqrt();
        modes.boundary.iter_mut().for_each(|mode| mode.stiffness += stiffening);
    }
    modes
}

fn linearised_modes(system: &mut System, x: &[f64], v: &[f64]) -> ModeRange {
    let frequency = largest_frequency(system, x).frequency;
    let undamped = DampedMode { stiffness: frequency * frequency, damping: 0.0 };
    let free = ModeRange { frequency, damping: 0.0, boundary: vec![undamped] };
    if !system.is_damped() {
        return free;
    }
    let mut product = |system: &mut System, p: &[f64], y: &mut [f64]| {
        system.damping_product(x, v, p, y);
        false
    };
    let damping = largest_eigenvalue(system, LanczosGoal::VALUE, &mut product).value;
    if damping.is_nan() || damping <= 0.0 {
        return free;
    }
    let largest = DampedMode { stiffness: undamped.stiffness, damping };
    let scale = scale(system);
    let boundary = Boundary { system, x, v, scale, largest, count: 0 }.points();
    ModeRange { frequency, damping, boundary }
}

/// Upper right part of the boundary of a joint numerical range, in units of the largest `k` and `c`.
struct Boundary<'a> {
    system: &'a mut System,
    x: &'a [f64],
    v: &'a [f64],
    /// `M^-1/2`.
    scale: Vec<f64>,
    largest: DampedMode,
    /// Points found so far.
    count: usize,
}

/// `(k, c)` relative to the largest values.
type Point = [f64; 2];

impl Boundary<'_> {
    /// Returns points from slow, strongly damped modes, clockwise.
    fn points(mut self) -> Vec<DampedMode> {
        let directions = [[-1.0, 1.0], [0.0, 1.0], [1.0, 0.0], [1.0, -1.0], [0.0, -1.0]];
        let mut corners: Vec<Point> =
            directions.into_iter().filter_map(|normal| self.corner(normal)).collect();
        corners.dedup();
        let mut points: Vec<Point> = vec![];
        for corner in corners {
            if let Some(&before) = points.last() {
                self.refine(before, corner, &mut points);
            }
            points.push(corner);
        }
        let DampedMode { stiffness, damping } = self.largest;
        // Negative stiffness is an instability of the system itself.
        let mode =
            |[k, c]: Point| DampedMode { stiffness: stiffness * k.max(0.0), damping: damping * c.max(0.0) };
        points.into_iter().map(mode).collect()
    }

    /// Returns the point farthest along `normal`; the largest values are known exactly.
    fn corner(&mut self, normal: Point) -> Option<Point> {
        let [k, c] = self.touch(normal)?;
        Some([if normal == [1.0, 0.0] { 1.0 } else { k }, if normal == [0.0, 1.0] { 1.0 } else { c }])
    }

    /// Adds points between `p` and `q` where the boundary is beyond their connecting line: sandwich
    /// algorithm, Rote 1992, *The convergence rate of the sandwich algorithm for approximating convex
    /// functions*, Computing 48, 337.
    fn refine(&mut self, p: Point, q: Point, points: &mut Vec<Point>) {
        let edge = [q[0] - p[0], q[1] - p[1]];
        let length = edge[0].hypot(edge[1]);
        if length < BOUNDARY_TOLERANCE || self.count >= MAX_POINTS {
            return;
        }
        let normal = [-edge[1] / length, edge[0] / length];
        let height = |r: Point| normal[0] * (r[0] - p[0]) + normal[1] * (r[1] - p[1]);
        let Some(beyond) = self.touch(normal).filter(|r| height(*r) > 2.0 * BOUNDARY_TOLERANCE) else {
            return;
        };
        self.refine(p, beyond, points);
        points.push(beyond);
        self.refine(beyond, q, points);
    }

    /// Returns a point farthest along `normal`; `None` if derivatives are not finite.
    fn touch(&mut self, normal: Point) -> Option<Point> {
        self.count += 1;
        let (x, v, largest) = (self.x, self.v, self.largest);
        // Without any stiffness the divisor is zero.
        let weight = |normal: f64, largest: f64| if largest > 0.0 { normal / largest } else { 0.0 };
        let weights = [weight(normal[0], largest.stiffness), weight(normal[1], largest.damping)];
        let mut damped = vec![0.0; self.scale.len()];
        let mut product = |system: &mut System, p: &[f64], y: &mut [f64]| {
            system.hessian_product(x, p, y);
            system.damping_product(x, v, p, &mut damped);
            y.iter_mut().zip(&damped).for_each(|(y, c)| *y = weights[0] * *y + weights[1] * c);
            false
        };
        let wanted = LanczosGoal { vector: true, norm: 1.0, tolerance: BOUNDARY_TOLERANCE };
        let top = largest_eigenvalue(self.system, wanted, &mut product);
        if !(top.value.is_finite() && norm(&top.vector) > 0.0) {
            return None;
        }
        let stiffness = |system: &mut System, p: &[f64], y: &mut [f64]| system.hessian_product(x, p, y);
        let damping = |system: &mut System, p: &[f64], y: &mut [f64]| system.damping_product(x, v, p, y);
        let k = rayleigh_quotient(self.system, &self.scale, &top.vector, stiffness).0;
        let c = rayleigh_quotient(self.system, &self.scale, &top.vector, damping).0;
        let over = |value: f64, largest: f64| if largest > 0.0 { value / largest } else { 0.0 };
        Some([over(k, largest.stiffness), over(c, largest.damping)])
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    use crate::energy::{EnergyKind, EnergyTerm, Fault, Measurements, TermProperties, TermViews};

    /// Springs to the origin of `1, 2, 3, .. N/m`, whose products count as approximate and are counted.
    struct Counted(Arc<AtomicUsize>);

    impl EnergyTerm for Counted {
        fn name(&self) -> String {
            "springs to the origin".to_owned()
        }
        fn properties(&self) -> TermProperties {
            TermProperties::of(EnergyKind::Elastic)
        }
        fn energy(&mut self, x: &[f64]) -> f64 {
            x.iter().enumerate().map(|(i, x)| 0.5 * (i + 1) as f64 * x * x).sum()
        }
        fn evaluate(&mut self, _x: &[f64]) -> bool {
            true
        }
        fn add_rows(&self, _first: usize, _g: &mut [f64]) {}
        fn add_hessian_product(&mut self, _x: &[f64], p: &[f64], y: &mut [f64]) {
            self.0.fetch_add(1, Ordering::Relaxed);
            y.iter_mut().zip(p).enumerate().for_each(|(i, (y, p))| *y += (i + 1) as f64 * p);
        }
        fn fault(&self, _x: &[f64]) -> Option<Fault> {
            None
        }
    }

    impl TermViews for Counted {
        fn measurements(&mut self) -> Option<&mut dyn Measurements> {
            Some(self)
        }
    }

    impl Measurements for Counted {
        fn add_stiffness_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> bool {
            self.add_hessian_product(x, p, y);
            true
        }
    }

    /// The number of products reported includes the exact one at the end.
    #[test]
    fn products_are_counted() {
        let made = Arc::new(AtomicUsize::new(0));
        let mut system = System::new(2, vec![1.0; 3]);
        system.add_term(Box::new(Counted(Arc::clone(&made))));
        let found = largest_frequency(&mut system, &[0.0; 6]);
        assert!((found.frequency - 6f64.sqrt()).abs() < 1e-6, "{found:?}");
        assert_eq!(found.products, made.load(Ordering::Relaxed));
    }
}
