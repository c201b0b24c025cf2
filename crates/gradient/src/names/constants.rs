//! Constants of materials whose energies are not linear in the Lame parameters: the energy is written as
//! a formula of the constants and differentiated by each.

use pliant::material::{DispersedFibres, EnergyExpression, MaterialSpec, OgdenTerms, TwoConstants};

/// Constants of a material, with its energy as a formula of them.
pub(super) struct MaterialConstants {
    /// Energy density.
    formula: EnergyExpression,
    /// Keys after `elastic.`, with the names of their numbers in the formula.
    keys: Vec<(String, Vec<String>)>,
}

impl MaterialConstants {
    /// Constants of a material; `None` if its constants are handled elsewhere.
    pub(super) fn of(material: &MaterialSpec) -> Option<Self> {
        match material {
            MaterialSpec::MooneyRivlin(constants) => Some(mooney_rivlin(constants)),
            MaterialSpec::Ogden(terms) => Some(ogden(terms)),
            MaterialSpec::HolzapfelGasserOgden(fibres) => Some(holzapfel_gasser_ogden(fibres)),
            MaterialSpec::ExpressedEnergy(energy) => {
                let key = |name: &String| (format!("parameters.{name}"), vec![name.clone()]);
                let keys = energy.parameters().keys().map(key).collect();
                Some(MaterialConstants { formula: energy.clone(), keys })
            }
            _ => None,
        }
    }

    /// Keys of the constants after `elastic.`.
    pub(super) fn keys(&self) -> impl Iterator<Item = &str> {
        self.keys.iter().map(|(key, _)| &key[..])
    }

    /// Derivatives of the energy density by the numbers of a key, as energy densities.
    pub(super) fn derivatives(&self, key: &str) -> Option<Vec<MaterialSpec>> {
        let (_, names) = self.keys.iter().find(|(known, _)| known == key)?;
        let by = |name: &String| Some(MaterialSpec::ExpressedEnergy(self.formula.derivative(name)?));
        names.iter().map(by).collect()
    }

    /// Constants given by key, name in the formula and value.
    fn new(psi: &str, numbers: &[(&str, String, f64)]) -> Self {
        let mut keys: Vec<(String, Vec<String>)> = vec![];
        for (key, name, _) in numbers {
            match keys.iter_mut().find(|(known, _)| known == key) {
                Some((_, names)) => names.push(name.clone()),
                None => keys.push(((*key).to_owned(), vec![name.clone()])),
            }
        }
        let values = numbers.iter().map(|(_, name, value)| (&name[..], *value));
        MaterialConstants { formula: EnergyExpression::new(psi, values, &[]), keys }
    }
}

/// Constant whose key is its name in the formula.
fn named(key: &'static str, value: f64) -> (&'static str, String, f64) {
    (key, key.to_owned(), value)
}

/// Mooney-Rivlin energy by the constants given: the compressibility, or Poisson's ratio. If `young` is
/// not given, it is `4 (1 + nu) (c10 + c01)`.
fn mooney_rivlin(constants: &TwoConstants) -> MaterialConstants {
    let TwoConstants { young, poisson, c10, c01, d1 } = *constants;
    if let Some(d1) = d1 {
        let psi = "c10*(J^(-2/3)*I1 - 3) + c01*(J^(-4/3)*I2 - 3) + (J - 1)^2/d1";
        return MaterialConstants::new(psi, &[named("d1", d1), named("c10", c10), named("c01", c01)]);
    }
    let (modulus, scale) = match young {
        Some(_) => ("young", "young/(4*(1 + poisson)*(c10 + c01))"),
        None => ("4*(1 + poisson)*(c10 + c01)", "1"),
    };
    let psi = format!(
        "{scale}*(c10*(J^(-2/3)*I1 - 3) + c01*(J^(-4/3)*I2 - 3)) + {modulus}/(6*(1 - 2*poisson))*(J - 1)^2"
    );
    let numbers = [named("poisson", poisson), named("c10", c10), named("c01", c01)];
    let young = young.map(|young| named("young", young));
    MaterialConstants::new(&psi, &young.into_iter().chain(numbers).collect::<Vec<_>>())
}

/// Ogden energy; if `young` is not given, it is `(1 + nu) sum mu alpha`.
fn ogden(terms: &OgdenTerms) -> MaterialConstants {
    let OgdenTerms { young, poisson, mu, alpha } = terms;
    let each = |term: &dyn Fn(usize) -> String| (0..mu.len()).map(term).collect::<Vec<_>>().join(" + ");
    let shear = each(&|p| format!("mu{p}*alpha{p}"));
    let given = format!("(1 + poisson)*({shear})");
    let (modulus, scale) = match young {
        Some(_) => ("young", format!("young/({given})")),
        None => (&given[..], "1".to_owned()),
    };
    let series = each(&|p| {
        let powers = format!("l1^alpha{p} + l2^alpha{p} + l3^alpha{p}");
        format!("mu{p}/alpha{p}*(J^(-alpha{p}/3)*({powers}) - 3)")
    });
    let psi = format!("{scale}*({series}) + {modulus}/(6*(1 - 2*poisson))*(J - 1)^2");
    let mut numbers: Vec<_> = young.map(|young| named("young", young)).into_iter().collect();
    numbers.push(named("poisson", *poisson));
    numbers.extend(mu.iter().enumerate().map(|(p, mu)| ("mu", format!("mu{p}"), *mu)));
    numbers.extend(alpha.iter().enumerate().map(|(p, alpha)| ("alpha", format!("alpha{p}"), *alpha)));
    MaterialConstants::new(&psi, &numbers)
}

/// Holzapfel-Gasser-Ogden energy. Fibre directions are numbers of any length, as given. Fibres that are
/// slack by rounding only, as in the reference configuration, count as stretched, as in the model.
fn holzapfel_gasser_ogden(fibres: &DispersedFibres) -> MaterialConstants {
    let DispersedFibres { shear, bulk, k1, k2, dispersion, fibres } = fibres;
    let mut psi = "shear/2*(J^(-2/3)*(C11 + C22 + C33) - 3) + bulk/2*(J - 1)^2".to_owned();
    let mut numbers = vec![
        named("shear", *shear),
        named("bulk", *bulk),
        named("k1", *k1),
        named("k2", *k2),
        named("dispersion", *dispersion),
    ];
    for (family, fibre) in fibres.iter().enumerate() {
        let name = |axis: usize| format!("a{family}{axis}");
        let axes = 0..fibre.len();
        let pairs = axes.clone().flat_map(|i| (i..fibre.len()).map(move |j| (i, j)));
        let pair = |(i, j)| {
            let factor = if i == j { 1 } else { 2 };
            format!("{factor}*{}*{}*C{}{}", name(i), name(j), i + 1, j + 1)
        };
        let stretched = pairs.map(pair).collect::<Vec<_>>().join(" + ");
        let length = axes.clone().map(|i| format!("{}^2", name(i))).collect::<Vec<_>>().join(" + ");
        let strain = format!(
            "dispersion*(J^(-2/3)*(C11 + C22 + C33) - 3) \
             + (1 - 3*dispersion)*(J^(-2/3)*({stretched})/({length}) - 1)"
        );
        psi += &format!(" + k1/(2*k2)*(exp(k2*max({strain}, -1e-12)^2) - 1)");
        numbers.extend(axes.map(|i| ("fibres", name(i), fibre[i])));
    }
    MaterialConstants::new(&psi, &numbers)
}

#[cfg(test)]
mod tests {
    use pliant::algebra::Mat;
    use pliant::material::{Material, MaterialVisitor, Parameters};

    use super::*;

    /// Energy density of any material at these deformations.
    struct EnergyAt([Mat<f64, 2>; 2], [Mat<f64, 3>; 2]);

    impl MaterialVisitor<2> for EnergyAt {
        type Output = Vec<f64>;

        fn visit<M: Material<2> + Material<3> + Clone>(self, material: M) -> Vec<f64> {
            let in_plane = self.0.iter().map(|f| Material::<2>::psi(&material, f));
            in_plane.chain(self.1.iter().map(|f| Material::<3>::psi(&material, f))).collect()
        }
    }

    #[test]
    fn formulas_are_the_energies_of_the_models() {
        let two = TwoConstants::example();
        let ogden = OgdenTerms::example();
        let fibres = DispersedFibres::example();
        let spatial = vec![vec![1.0, 0.4, -0.3], vec![0.2, -1.0, 0.5]];
        for material in [
            MaterialSpec::MooneyRivlin(two),
            MaterialSpec::MooneyRivlin(TwoConstants { young: None, ..two }),
            serde_json::from_str(r#"{ "mooney-rivlin": { "c10": 3e5, "c01": 1e5, "d1": 2e-6 } }"#).unwrap(),
            MaterialSpec::Ogden(OgdenTerms { young: None, mu: vec![2e5, 3e3, -1e4], ..ogden.clone() }),
            MaterialSpec::Ogden(ogden),
            MaterialSpec::HolzapfelGasserOgden(DispersedFibres { fibres: spatial, ..fibres.clone() }),
            MaterialSpec::HolzapfelGasserOgden(fibres),
        ] {
            let at = || {
                EnergyAt(
                    [Mat([[1.3, 0.2], [-0.1, 0.9]]), Mat([[0.8, -0.1], [0.3, 1.4]])],
                    [
                        Mat([[1.2, 0.1, 0.2], [-0.2, 0.9, 0.1], [0.1, 0.3, 1.1]]),
                        Mat([[0.9, 0.2, -0.1], [0.1, 1.3, 0.0], [0.2, -0.1, 0.8]]),
                    ],
                )
            };
            let formula = MaterialConstants::of(&material).unwrap().formula;
            formula.check().unwrap();
            let found = MaterialSpec::ExpressedEnergy(formula).visit::<2, _>(at());
            for (found, expected) in found.iter().zip(material.visit::<2, _>(at())) {
                assert!(
                    (found - expected).abs() < 1e-13 * expected.abs(),
                    "{material:?}: {found} {expected}"
                );
            }
        }
    }
}
