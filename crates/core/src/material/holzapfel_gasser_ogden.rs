use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

use super::barrier::{admissible, infinite_outside};
use super::parameters::check_positive;
use super::spectrum::out_of_plane;
use super::{Domain, Lame, Material, MaterialDescription, Model, ParameterError, Parameters};
use crate::algebra::{Mat, direction};
use crate::scalar::Scalar;
use crate::value::{Angle, As, KeyRange, Pressure};

/// Valid range of the dispersion, from parallel fibres to a uniform distribution.
const DISPERSION: KeyRange = KeyRange::of(&[("minimum", 0.0), ("maximum", 1.0 / 3.0)]);

/// Holzapfel-Gasser-Ogden model of arterial walls: a soft matrix with one or two families of fibres whose
/// directions are dispersed.
///
/// With `J = det F`, `I1 = tr C` and `I4_i = a_i . C a_i` of `C = F^T F` (in 2D with `F_33 = 1`), the
/// unit directions `a_i` of the families in the reference configuration, the shear modulus `c` and the
/// bulk modulus `K` of the matrix:
///
/// ```text
/// psi = c/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2 + k1/(2 k2) sum_i (exp(k2 <E_i>^2) - 1)     [J/m^3]
/// E_i = kappa (J^(-2/3) I1 - 3) + (1 - 3 kappa) (J^(-2/3) I4_i - 1)
/// P   = 2 J^(-2/3) (s F + sum_i t_i (F a_i) a_i^T)
///       + (K (J - 1) - 2/3 J^(-2/3) (s I1 + sum_i t_i I4_i) / J) cof F                    [Pa]
/// T_i = k1 <E_i> exp(k2 <E_i>^2),  s = c/2 + kappa sum_i T_i,  t_i = (1 - 3 kappa) T_i    [Pa]
/// ```
///
/// `<E>` is `E` if it is positive, else 0: fibres resist tension only. If `E` is zero to rounding
/// (above -1e-12), as in the reference configuration, fibres count as stretched, so that the initial
/// stiffness and the critical step include them. The stiffness is discontinuous where a fibre goes slack.
/// The model is defined for `J > 0` only.
///
/// The paper has `J = 1`; the split of shape and volume follows Holzapfel, "Nonlinear solid mechanics", 2000.
///
/// Source: Gasser, Ogden and Holzapfel, "Hyperelastic modelling of arterial layers with distributed collagen
/// fibre orientations", Journal of the Royal Society Interface 3, 15-35, 2006.
#[derive(Clone, Debug, PartialEq)]
pub struct HolzapfelGasserOgden {
    shear: f64,
    bulk: f64,
    k1: f64,
    k2: f64,
    dispersion: f64,
    /// Unit vectors.
    families: Vec<[f64; 3]>,
}

/// Strain `E` above which a fibre counts as stretched, below zero by more than round-off in the reference
/// configuration.
const SLACK: f64 = -1e-12;

/// Holzapfel-Gasser-Ogden parameters: constants and fibre directions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DispersedFibres {
    /// Shear modulus `c` of the matrix [Pa], positive.
    pub shear: f64,
    /// Bulk modulus `K` of the matrix [Pa], positive.
    pub bulk: f64,
    /// Stiffness `k1` of the fibres [Pa], positive.
    pub k1: f64,
    /// Exponent `k2` of the fibres, positive.
    pub k2: f64,
    /// Dispersion `kappa` in [0, 1/3]: 0 for parallel fibres in each family, 1/3 for all directions alike.
    pub dispersion: f64,
    /// Directions of the families in the reference configuration: one or two, each of two or three
    /// components and any length.
    pub fibres: Vec<Vec<f64>>,
}

/// Table of a scene that [`DispersedFibres`] is read from.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct DispersedFibresTable {
    /// Shear modulus `c` of the matrix [Pa], positive.
    #[serde(with = "As::<Pressure>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    shear: f64,
    /// Bulk modulus `K` of the matrix [Pa], positive; in 2D in plane strain.
    #[serde(with = "As::<Pressure>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    bulk: f64,
    /// Stiffness `k1` of the fibres [Pa], positive.
    #[serde(with = "As::<Pressure>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    k1: f64,
    /// Exponent `k2` of the fibres, positive: how soon they stiffen.
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    k2: f64,
    /// Dispersion `kappa` of the directions in a family, 0 to 1/3: 0 for parallel fibres, 1/3 for all
    /// directions alike.
    #[serde(default)]
    #[schemars(transform = DISPERSION.in_schema())]
    dispersion: f64,
    /// Directions of the families at rest, one or two, of two or three components and any length; in 2D a
    /// third component points out of the plane.
    #[serde(default)]
    #[schemars(length(max = 2))]
    fibres: Vec<Vec<f64>>,
    /// Angle [rad] of two families `(cos, sin, 0)` and `(cos, -sin, 0)` to the first axis; without `fibres`.
    #[serde(default, with = "As::<Option<Angle>>")]
    angle: Option<f64>,
}

impl<'de> Deserialize<'de> for DispersedFibres {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let DispersedFibresTable { shear, bulk, k1, k2, dispersion, fibres, angle } =
            DispersedFibresTable::deserialize(deserializer)?;
        let fibres = match angle {
            None => fibres,
            Some(_) if !fibres.is_empty() => {
                let problem = "`fibres` and `angle` both say where fibres point: give one of them";
                return Err(D::Error::custom(problem));
            }
            Some(angle) => DispersedFibres::pair(angle),
        };
        Ok(DispersedFibres { shear, bulk, k1, k2, dispersion, fibres })
    }
}

impl JsonSchema for DispersedFibres {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "DispersedFibres".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = DispersedFibresTable::json_schema(generator);
        let about = "Constants of Holzapfel, Gasser and Ogden, and the directions of the families.";
        schema.insert("description".into(), about.into());
        schema
    }
}

impl DispersedFibres {
    /// Returns two directions at `angle` [rad] to either side of the first axis, in the plane of the
    /// first two.
    pub fn pair(angle: f64) -> Vec<Vec<f64>> {
        let (sin, cos) = libm::sincos(angle);
        vec![vec![cos, sin, 0.0], vec![cos, -sin, 0.0]]
    }

    /// Returns the small-strain Lame parameters of the matrix.
    pub fn matrix(&self) -> Lame {
        Lame { lambda: self.bulk - 2.0 / 3.0 * self.shear, mu: self.shear }
    }

    /// Returns Young's modulus [Pa] at small strains along family `index`, with all fibres stretched.
    ///
    /// The initial stiffness is that of the matrix plus `k1 M_i M_i^T` of each family, with the deviators
    /// `M_i = 2 (1 - 3 kappa) (a_i a_i^T - I/3)`. The compliance `S` of the matrix is `1/(2 c)` on
    /// deviators. The Woodbury formula gives
    ///
    /// ```text
    /// 1/E_a = 1/E - b . (N^-1 b),  b_i = a a^T : S : M_i,  N_ij = delta_ij/k1 + M_i : S : M_j
    /// ```
    ///
    /// # Panics
    /// If there is no such family.
    pub fn young_along(&self, index: usize) -> f64 {
        let families = self.directions();
        let weight = 2.0 * (1.0 - 3.0 * self.dispersion);
        let overlap = |a: &[f64; 3], b: &[f64; 3]| {
            let cosine: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            (cosine * cosine - 1.0 / 3.0) / (2.0 * self.shear)
        };
        let b: Vec<f64> = families.iter().map(|family| weight * overlap(&families[index], family)).collect();
        let n = |i: usize, j: usize| {
            weight * weight * overlap(&families[i], &families[j]) + if i == j { 1.0 / self.k1 } else { 0.0 }
        };
        let softer = match b.as_slice() {
            [one] => one * one / n(0, 0),
            [first, second] => {
                let mixed = n(0, 1);
                (first * first * n(1, 1) - 2.0 * first * second * mixed + second * second * n(0, 0))
                    / (n(0, 0) * n(1, 1) - mixed * mixed)
            }
            _ => 0.0,
        };
        1.0 / (1.0 / self.matrix().young_and_poisson().0 - softer)
    }

    /// Returns unit vectors along the families.
    fn directions(&self) -> Vec<[f64; 3]> {
        self.fibres.iter().filter_map(|fibre| direction(fibre)).collect()
    }
}

impl Parameters for DispersedFibres {
    fn check(&self) -> Result<(), ParameterError> {
        for (field, value) in [("shear", self.shear), ("bulk", self.bulk), ("k1", self.k1)] {
            check_positive(field, value)?;
        }
        if !KeyRange::POSITIVE.contains(self.k2) {
            let problem = "must be positive and finite; 0.8 is the middle layer of an artery";
            return Err(ParameterError::new("k2", self.k2, problem));
        }
        if !DISPERSION.contains(self.dispersion) {
            let problem = "must be between 0, parallel fibres, and 1/3, all directions alike";
            return Err(ParameterError::new("dispersion", self.dispersion, problem));
        }
        if !(1..=2).contains(&self.fibres.len()) {
            let problem = "is the number of families: give one or two directions, or `angle` for a pair";
            return Err(ParameterError::new("fibres", self.fibres.len() as f64, problem));
        }
        for (index, fibre) in self.fibres.iter().enumerate() {
            if !(2..=3).contains(&fibre.len()) {
                let problem = "is the number of components: a direction has two or three";
                return Err(ParameterError::new("fibres", fibre.len() as f64, problem).at(index));
            }
            if direction(fibre).is_none() {
                let length = fibre.iter().map(|x| x.abs()).sum();
                let problem = "is the length of the direction, which must be finite and not zero";
                return Err(ParameterError::new("fibres", length, problem).at(index));
            }
        }
        Ok(())
    }

    /// Returns `None`, because the initial stiffness depends on the direction.
    fn lame(&self) -> Option<Lame> {
        None
    }

    fn is_isotropic(&self) -> bool {
        false
    }

    fn has_axes(&self) -> bool {
        true
    }

    fn example() -> Self {
        let fibres = vec![vec![0.8, 0.6, 0.0], vec![0.8, -0.6, 0.0]];
        DispersedFibres { shear: 4e5, bulk: 8e5, k1: 2e5, k2: 0.1, dispersion: 0.1, fibres }
    }
}

impl Model for HolzapfelGasserOgden {
    type Parameters = DispersedFibres;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Holzapfel-Gasser-Ogden: soft tissue with one or two families of fibres that resist \
                  tension, forbids inversion.",
        formula: "c/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2 + k1/(2 k2) sum_i (exp(k2 <E_i>^2) - 1), \
                  E_i = kappa (J^(-2/3) I1 - 3) + (1 - 3 kappa) (J^(-2/3) I4_i - 1), J = det F",
        source: "Gasser, Ogden and Holzapfel 2006",
        domain: Domain::PositiveJ,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &DispersedFibres) -> Self {
        let DispersedFibres { shear, bulk, k1, k2, dispersion, .. } = *parameters;
        HolzapfelGasserOgden { shear, bulk, k1, k2, dispersion, families: parameters.directions() }
    }
}

/// Returns `F a` and `|F a|^2` for the direction `a`, with `F_33 = 1` in 2D.
#[inline(always)]
fn stretched<S: Scalar, const D: usize>(f: &Mat<S, D>, family: &[f64; 3]) -> ([S; D], S) {
    let mut image = [S::zero(); D];
    let mut square = S::splat(if D == 2 { family[2] * family[2] } else { 0.0 });
    for i in 0..D {
        for j in 0..D {
            image[i] = f[i][j].mul_add(S::splat(family[j]), image[i]);
        }
        square = image[i].mul_add(image[i], square);
    }
    (image, square)
}

impl HolzapfelGasserOgden {
    /// Returns `<E>` from `J^(-2/3) I1` and `J^(-2/3) I4`; NaN stays NaN.
    #[inline(always)]
    fn strain<S: Scalar>(&self, i1: S, i4: S) -> S {
        let of_all = S::splat(self.dispersion) * (i1 - S::splat(3.0));
        let strain = S::splat(1.0 - 3.0 * self.dispersion).mul_add(i4 - S::one(), of_all);
        S::select(strain.lt(S::splat(SLACK)), S::zero(), strain)
    }
}

impl<const D: usize> Material<D> for HolzapfelGasserOgden {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let stretch = f.norm_squared() + S::splat(out_of_plane::<D>());
        let j = f.determinant();
        let shape = j.powf(S::splat(-2.0 / 3.0));
        let i1 = shape * stretch;
        let volume = j - S::one();
        let volumetric = S::splat(0.5 * self.bulk) * volume * volume;
        let mut psi = S::splat(0.5 * self.shear).mul_add(i1 - S::splat(3.0), volumetric);
        for family in &self.families {
            let strain = self.strain(i1, shape * stretched(f, family).1);
            let stiffened = (S::splat(self.k2) * strain * strain).exp() - S::one();
            psi = S::splat(0.5 * self.k1 / self.k2).mul_add(stiffened, psi);
        }
        infinite_outside(j, stretch, psi)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let stretch = f.norm_squared() + S::splat(out_of_plane::<D>());
        let cofactor = f.cofactor();
        let j = admissible(f.determinant_with(&cofactor));
        let shape = j.powf(S::splat(-2.0 / 3.0));
        let i1 = shape * stretch;
        let mut all = S::splat(0.5 * self.shear);
        let mut of_shape = S::zero();
        let mut along = Mat::<S, D>::zero();
        for family in &self.families {
            let (image, square) = stretched(f, family);
            let i4 = shape * square;
            let strain = self.strain(i1, i4);
            let tension = S::splat(self.k1) * strain * (S::splat(self.k2) * strain * strain).exp();
            all = S::splat(self.dispersion).mul_add(tension, all);
            let tension = S::splat(1.0 - 3.0 * self.dispersion) * tension;
            of_shape = tension.mul_add(i4, of_shape);
            for i in 0..D {
                let pull = tension * image[i];
                for k in 0..D {
                    along[i][k] = pull.mul_add(S::splat(family[k]), along[i][k]);
                }
            }
        }
        let of_shape = all.mul_add(i1, of_shape);
        let pressure = S::splat(self.bulk).mul_add(j - S::one(), -(S::splat(2.0 / 3.0) * of_shape / j));
        let both = f.scale_add(all, &along);
        both.scale_add(shape + shape, &cofactor.scale(pressure))
    }

    fn domain(&self) -> Domain {
        Self::ABOUT.domain
    }
}
