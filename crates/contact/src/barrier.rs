//! Contact energy of one pair of primitives as a function of its distance.
//!
//! The barrier grows without bound as the distance falls to the sum of the radii. The cubic form has
//! finite forces, for explicit steps.

use pliant::scalar::Scalar;

/// Iteration limit of [`Barrier::gap_of_force`].
const INVERSIONS: u32 = 40;
/// Relative tolerance on the last update of the gap; the remaining relative error is its square.
const INVERTED: f64 = 1e-6;

/// Contact energy of a pair as a function of its distance `d`, twice continuously differentiable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PotentialForm {
    /// Barrier `E = kappa w dhat B(q)`, infinite where the radii overlap.
    ///
    /// `B(q) = -(q - 1)^2 ln q` for `0 < q < 1` and 0 beyond, `q = (d^2 - xi^2) / Dh`,
    /// `Dh = dhat^2 + 2 xi dhat`.
    ///
    /// Li et al. 2020, *Incremental potential contact*, ACM Transactions on Graphics 39(4), in squared
    /// distances; scaled so that `kappa` is a pressure and energies converge as meshes are refined, Li et al.
    /// 2023, arXiv 2307.15908.
    #[default]
    Barrier,
    /// Penalty `E = 2/3 kappa w dhat (1 - s)^3`, finite where the radii overlap (`s < 0`).
    ///
    /// `s = (d - xi) / dhat` for `s < 1`, and 0 energy beyond. The second derivative is
    /// `4 kappa w / dhat (1 - s)`.
    Cubic,
}

/// Contact energy of a pair with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barrier {
    /// Form of the energy.
    pub form: PotentialForm,
    /// `kappa` [Pa].
    pub stiffness: f64,
    /// `dhat`: activation distance, the gap below which bodies repel each other [m].
    pub reach: f64,
    /// `xi`: sum of the radii of the two sides [m].
    pub offset: f64,
}

/// An energy as a function of a squared distance `D`, with its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyOfDistance<S> {
    /// `E` [J].
    pub energy: S,
    /// `dE/dD` [J/m^2].
    pub slope: S,
    /// `d2E/dD2` [J/m^4].
    pub curvature: S,
}

/// An energy as a function of a distance `d`, with its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyOfGap<S = f64> {
    /// `E` [J].
    pub energy: S,
    /// `dE/dd` [N].
    pub slope: S,
    /// `d2E/dd2` [N/m].
    pub curvature: S,
}

impl Barrier {
    /// Squared activation distance `(dhat + xi)^2` [m^2]: closer pairs have an energy.
    pub fn squared_reach(&self) -> f64 {
        (self.reach + self.offset) * (self.reach + self.offset)
    }

    /// `Dh` [m^2].
    fn scale(&self) -> f64 {
        self.reach * (self.reach + 2.0 * self.offset)
    }

    /// Energy of a pair of weight `w` [m^2] at the squared distance `D` [m^2].
    ///
    /// Where the radii overlap, the barrier energy is infinite and its derivatives are zero.
    #[inline(always)]
    pub fn at<S: Scalar>(&self, squared_distance: S, weight: S) -> EnergyOfDistance<S> {
        match self.form {
            PotentialForm::Barrier => self.logarithmic_at(squared_distance, weight),
            PotentialForm::Cubic => self.cubic_at(squared_distance, weight),
        }
    }

    #[inline(always)]
    fn logarithmic_at<S: Scalar>(&self, squared_distance: S, weight: S) -> EnergyOfDistance<S> {
        let c = S::splat;
        let inverse = c(1.0 / self.scale());
        let b = barrier(
            (squared_distance - c(self.offset * self.offset)) * inverse,
            (squared_distance - c(self.squared_reach())) * inverse,
        );
        let energy = weight * c(self.stiffness * self.reach);
        let slope = energy * inverse;
        EnergyOfDistance {
            energy: energy * b.energy,
            slope: slope * b.slope,
            curvature: slope * inverse * b.curvature,
        }
    }

    /// `dE/dD = E'/(2 d)`, `d2E/dD2 = (E'' - E'/d)/(4 d^2)`; zero at `d = 0`, where the direction is
    /// undefined.
    #[inline(always)]
    fn cubic_at<S: Scalar>(&self, squared_distance: S, weight: S) -> EnergyOfDistance<S> {
        let c = S::splat;
        let zero = S::zero();
        let d = squared_distance.sqrt();
        let left = (c(self.reach + self.offset) - d) * c(1.0 / self.reach);
        let left = S::select(zero.lt(left), left, zero);
        let apart = zero.lt(d);
        let inverse = S::one() / S::select(apart, d, S::one());
        let inverse = S::select(apart, inverse, zero);
        let force = weight * c(2.0 * self.stiffness) * (left * left);
        let stiffness = weight * c(4.0 * self.stiffness / self.reach) * left;
        EnergyOfDistance {
            energy: force * left * c(self.reach / 3.0),
            slope: -(force * inverse * c(0.5)),
            curvature: (stiffness + force * inverse) * (inverse * inverse) * c(0.25),
        }
    }

    /// Energy of a pair of weight `w` [m^2] at the signed distance `d` [m], negative inside an obstacle.
    ///
    /// Inside, the barrier energy is infinite and its derivatives are zero.
    pub fn at_signed(&self, distance: f64, weight: f64) -> EnergyOfGap {
        if self.form == PotentialForm::Cubic {
            let left = ((self.reach + self.offset - distance) / self.reach).max(0.0);
            let force = 2.0 * self.stiffness * weight * left * left;
            return EnergyOfGap {
                energy: force * left * self.reach / 3.0,
                slope: -force,
                curvature: 4.0 * self.stiffness * weight / self.reach * left,
            };
        }
        if distance <= 0.0 {
            return EnergyOfGap { energy: f64::INFINITY, slope: 0.0, curvature: 0.0 };
        }
        self.by_gap(distance, weight)
    }

    /// Energy of a pair of weight `w` [m^2] with its derivatives by the distance `d > 0` [m]: `dE/dd = 2
    /// d dE/dD`, `d2E/dd2 = 4 d^2 d2E/dD2 + 2 dE/dD`.
    #[inline(always)]
    pub(crate) fn by_gap<S: Scalar>(&self, distance: S, weight: S) -> EnergyOfGap<S> {
        let c = S::splat;
        let law = self.at(distance * distance, weight);
        EnergyOfGap {
            energy: law.energy,
            slope: c(2.0) * law.slope * distance,
            // The energy of a barrier is convex in the distance.
            curvature: c(4.0) * law.curvature * distance * distance + c(2.0) * law.slope,
        }
    }

    /// Gap [m] at which a pair of weight `w > 0` [m^2] has the normal force `f` [N]; the activation
    /// distance if `f` is not positive.
    ///
    /// Solves for the square root of the force, which is nearly linear near the activation distance, with
    /// Newton's method from the gap `near`; bisects where an iterate leaves its bracket.
    pub fn gap_of_force(&self, force: f64, weight: f64, near: f64) -> f64 {
        if force.is_nan() || force <= 0.0 {
            return self.reach;
        }
        let (mut low, mut high) = (0.0, self.reach);
        let mut gap = if near > 0.0 && near < self.reach { near } else { 0.5 * self.reach };
        for _ in 0..INVERSIONS {
            let law = self.at_signed(gap + self.offset, weight);
            let root = (-law.slope / force).sqrt();
            if root > 1.0 {
                low = gap
            } else {
                high = gap
            }
            let next = gap + (root - 1.0) * 2.0 * root * force / law.curvature;
            if (next - gap).abs() <= INVERTED * gap {
                return next;
            }
            gap = if low < next && next < high { next } else { 0.5 * (low + high) };
        }
        gap
    }

    /// Energy [J] of a pair of weight 1 m^2 in the cubic form at zero gap: `2/3 kappa dhat`.
    pub fn closing_energy(&self) -> f64 {
        self.stiffness * self.reach * 2.0 / 3.0
    }

    /// Largest approach speed [m/s] that the cubic form stops before the gap closes, for a mass `m` [kg]
    /// on an area of 1 m^2: `sqrt(4 kappa dhat / (3 m))`.
    pub fn stopped_speed(&self, mass: f64) -> f64 {
        (2.0 * self.closing_energy() / mass).sqrt()
    }

    /// Pressure between flat surfaces at the distance `d` [m], relative to `kappa`: `-2 s B'(s^2)` with
    /// `s = d / dhat` for `xi = 0`.
    pub fn relative_pressure(&self, distance: f64) -> f64 {
        let slope = self.at(distance * distance, 1.0).slope;
        -2.0 * distance * slope / self.stiffness
    }
}

/// Barrier `B` with `B'` and `B''` at `q`; `z = q - 1` keeps the digits that `q` loses near 1.
///
/// `B' = -z (2 ln q + z/q)`, `B'' = -(z/q)(1/q + 3) - 2 ln q`: all terms have one sign, so nothing
/// cancels.
#[inline(always)]
pub fn barrier<S: Scalar>(q: S, z: S) -> EnergyOfDistance<S> {
    let (zero, one) = (S::zero(), S::one());
    let touching = zero.lt(q);
    let active = z.lt(zero) & touching;
    // Inactive lanes are evaluated at `q = 1`, `z = 0`, where everything is finite.
    let (q, z) = (S::select(active, q, one), S::select(active, z, zero));
    let log = log_near_one(q, z);
    let zq = z / q;
    let energy = -(z * z * log);
    let slope = -(z * (log + log + zq));
    let curvature = -(zq * (one / q + S::splat(3.0))) - (log + log);
    EnergyOfDistance { energy: S::select(touching, energy, S::splat(f64::INFINITY)), slope, curvature }
}

/// `ln q` for `0 < q <= 1`, where `z = q - 1` is more accurate than `q`: `ln u * z / (u - 1)` with `u`
/// the rounded sum `1 + z` (Kahan; Goldberg 1991, theorem 4).
#[inline(always)]
fn log_near_one<S: Scalar>(q: S, z: S) -> S {
    let far = q.lt(S::splat(0.5));
    let u = S::select(far, q, S::one() + z);
    let w = u - S::one();
    let log = u.ln();
    let rounded_away = w.abs().lt(S::splat(f64::MIN_POSITIVE));
    let near = log * (z / S::select(rounded_away, S::one(), w));
    S::select(far, log, S::select(rounded_away, z, near))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, expected: f64) -> bool {
        (found - expected).abs() <= 1e-14 * expected.abs()
    }

    /// Closed form: `E = 2/3 kappa w dhat (1 - s)^3` with `1 - s = (dhat + xi - d)/dhat`.
    #[test]
    fn the_cubic_law_is_its_formula() {
        let law = Barrier { form: PotentialForm::Cubic, stiffness: 3.0, reach: 0.2, offset: 0.1 };
        let half = law.at(0.2 * 0.2, 0.5);
        assert!(close(half.energy, 0.025), "{half:?}");
        assert!(close(half.slope, -0.75 / 0.4), "{half:?}");
        assert!(close(half.curvature, (15.0 + 0.75 / 0.2) / 0.16), "{half:?}");
        let touching = law.at(0.0, 0.5);
        assert!(close(touching.energy, 0.675) && touching.slope == 0.0, "{touching:?}");
        let apart = law.at(0.31 * 0.31, 0.5);
        assert_eq!((apart.energy, apart.curvature), (0.0, 0.0));
        let inside = law.at_signed(-0.1, 0.5);
        assert!(close(inside.energy, 1.6) && close(inside.slope, -12.0), "{inside:?}");
        assert!(close(inside.curvature, 60.0), "{inside:?}");
        let outside = law.at_signed(0.2, 0.5);
        assert!(close(outside.energy, 0.025) && close(outside.slope, -0.75), "{outside:?}");
        assert!(close(outside.curvature, 15.0), "{outside:?}");
        assert_eq!(law.at_signed(0.4, 0.5).slope, 0.0);
    }

    /// The chain rule relates the derivatives by the gap to those by the squared distance.
    #[test]
    fn a_barrier_by_its_gap_is_that_by_its_square() {
        let law = Barrier { form: PotentialForm::Barrier, stiffness: 3.0, reach: 0.2, offset: 0.1 };
        let (d, h) = (0.17, 1e-5);
        let [below, there, above] = [d - h, d, d + h].map(|d| law.at_signed(d, 0.5));
        let slope = (above.energy - below.energy) / (2.0 * h);
        let curvature = (above.slope - below.slope) / (2.0 * h);
        assert!((there.slope / slope - 1.0).abs() < 1e-6, "{there:?}, {slope}");
        assert!((there.curvature / curvature - 1.0).abs() < 1e-6, "{there:?}, {curvature}");
        assert_eq!(law.at_signed(-0.01, 0.5).energy, f64::INFINITY);
    }
}
