//! Formulas against the models in closed form, and the errors of invalid formulas.

use super::super::tests::lanes::same_bits;
use super::super::tests::{difference, samples};
use super::*;
use crate::algebra::tests::sample::largest;
use crate::material::{
    EnergyExpression, EnergyMistake, Hencky, Isotropic, Lame, Model, MooneyRivlin, NeoHookean, Ogden,
    OgdenTerms, Parameters, Psd, StableNeoHookean, StableNeoHookeanLog, Stvk, TwoConstants, autodiff_hessian,
    autodiff_stress,
};

const LAME: Lame = Lame { lambda: 576_923.076_923_076_9, mu: 384_615.384_615_384_6 };
const SOLID: Isotropic = Isotropic::new(1e6, 0.3);

fn formula(psi: &str) -> EnergyExpression {
    let names = [("mu", LAME.mu), ("lambda", LAME.lambda), ("kappa", LAME.lambda + 2.0 / 3.0 * LAME.mu)];
    let names = names.into_iter().filter(|(name, _)| psi.contains(name));
    EnergyExpression::new(psi, names, &[])
}

fn material(psi: &str) -> ExpressedEnergy {
    let formula = formula(psi);
    assert_eq!(formula.check(), Ok(()), "{psi}");
    ExpressedEnergy::new(&formula)
}

/// Compares energy, stress and Hessians with those of `model`, relative to their scale.
fn compare<M: Material<D>, const D: usize>(psi: &str, model: &M) {
    let formula = material(psi);
    assert_eq!(Material::<D>::domain(&formula), model.domain(), "{psi}");
    let stiffness = LAME.lambda + 2.0 * LAME.mu;
    for f in samples::<D>(model.domain() == Domain::Everywhere) {
        let scale = stiffness * f.norm_squared().max(1.0).powi(2);
        let error = (formula.psi(&f) - model.psi(&f)).abs() / (scale + model.psi(&f).abs());
        assert!(error < 1e-13, "{psi} {D}D: psi {error:e} {f:?}");
        let stress = model.pk1(&f);
        let error = largest(&(formula.pk1(&f) - stress)) / (scale + largest(&stress));
        assert!(error < 1e-13, "{psi} {D}D: P {error:e} {f:?}");
        for psd in [Psd::Exact, Psd::Projected] {
            let expected = model.hessian(&f, psd);
            let found = formula.hessian(&f, psd);
            let error = difference(&expected, &found);
            // A projection may leave nothing of either Hessian.
            let is_fine = error < 1e-9 || expected == found;
            assert!(is_fine, "{psi} {D}D: {psd:?} {error:e} {f:?}");
        }
    }
}

/// Compares a formula with a model in both dimensions.
macro_rules! equals {
    ($psi:expr, $model:expr) => {
        let model = $model;
        compare::<_, 2>($psi, &model);
        compare::<_, 3>($psi, &model);
    };
}

#[test]
fn invariants_give_the_models_that_are_written_by_hand() {
    equals!("mu/2*(I1 - 3) - mu*log(J) + lambda/2*log(J)^2", NeoHookean::new(&SOLID));
    equals!("mu/2*(I1 - 3) - mu*(J - 1) + (lambda + mu)/2*(J - 1)^2", StableNeoHookean::new(&SOLID));
    equals!(
        "2*mu/3*(I1 - 3 - ln((I1 + 1)/4)) + (lambda + 5*mu/6)/2*(J - 1)^2 - mu*(J - 1)",
        StableNeoHookeanLog::new(&SOLID)
    );
    // tr E^2 = (tr C^2 - 2 tr C + 3)/4, tr C^2 = I1^2 - 2 I2: not linear in I1.
    equals!("mu/4*(I1^2 - 2*I2 - 2*I1 + 3) + lambda/8*(I1 - 3)^2", Stvk::new(&SOLID));
    let rubber = TwoConstants { young: Some(1e6), poisson: 0.3, c10: 0.4, c01: 0.1, d1: None };
    equals!(
        "0.8*mu/2*(J^(-2/3)*I1 - 3) + 0.2*mu/2*(I3^(-2/3)*I2 - 3) + kappa/2*(sqrt(I3) - 1)^2",
        MooneyRivlin::new(&rubber)
    );
}

#[test]
fn stretches_give_the_models_that_are_written_by_hand() {
    equals!("mu*(ln(l1)^2 + ln(l2)^2 + ln(l3)^2) + lambda/2*ln(l1*l2*l3)^2", Hencky::new(&SOLID));
    equals!(
        "mu/2*(l1^2 + l2^2 + l3^2 - 3) - mu*(J - 1) + (lambda + mu)/2*(J - 1)^2",
        StableNeoHookean::new(&SOLID)
    );
    let terms = OgdenTerms { young: None, poisson: 0.3, mu: vec![LAME.mu, LAME.mu], alpha: vec![3.0, -1.0] };
    // mu = (3 mu - mu)/2
    assert!((terms.lame().unwrap().mu / LAME.mu - 1.0).abs() < 1e-14);
    equals!(
        "mu/3*((l1^3 + l2^3 + l3^3)/J - 3) - mu*(J^(1/3)*(1/l1 + 1/l2 + 1/l3) - 3) + kappa/2*(J - 1)^2",
        Ogden::new(&terms)
    );
}

#[test]
fn components_give_the_models_that_are_written_by_hand() {
    let shear = "E11^2 + E22^2 + E33^2 + 2*E12^2 + 2*E13^2 + 2*E32^2";
    equals!(&format!("mu*({shear}) + lambda/2*(E11 + E22 + E33)^2"), Stvk::new(&SOLID));
    let square = "F11^2+F12^2+F13^2+F21^2+F22^2+F23^2+F31^2+F32^2+F33^2";
    equals!(
        &format!("mu/2*({square} - 3) - mu*(J - 1) + (lambda + mu)/2*(J - 1)^2"),
        StableNeoHookean::new(&SOLID)
    );
    // I1 is written in components, so that the formula is one of components.
    equals!("mu/4*(I1^2 - 2*I2 - 2*C11 - 2*C22 - 2*C33 + 3) + lambda/8*(I1 - 3)^2", Stvk::new(&SOLID));
}

/// Fibres at 30 degrees, in one family and in two, with directions of any length.
fn fibred() -> EnergyExpression {
    let psi = "mu/2*(I1 - 3) - mu*ln(J) + lambda/2*ln(J)^2 + k1/2*max(I4 - 1, 0)^3 + k1/(2*k2)*(exp(k2*(I6 \
               - 1)^2) - 1)";
    let numbers = [("mu", LAME.mu), ("lambda", LAME.lambda), ("k1", 2e5), ("k2", 1.5)];
    let angle = std::f64::consts::FRAC_PI_6;
    EnergyExpression::new(psi, numbers, &[vec![3.0 * angle.cos(), 3.0 * angle.sin()], vec![0.0, -2.0, 0.0]])
}

#[test]
fn fibres_are_the_squares_of_their_stretches() {
    let formula = fibred();
    for dimension in [2, 3] {
        assert_eq!(formula.check_at_rest(dimension), Ok(()));
    }
    assert_eq!((formula.check(), formula.lame()), (Ok(()), None));
    let material = ExpressedEnergy::new(&formula);
    let f = Mat([[1.3, 0.2, 0.1], [-0.1, 1.15, 0.0], [0.05, 0.1, 0.8]]);
    let a = [(0.75f64).sqrt(), 0.5, 0.0];
    let length = |a: [f64; 3]| f.mul_vec(&a).iter().map(|x| x * x).sum::<f64>();
    let (i4, i6) = (length(a), length([0.0, 1.0, 0.0]));
    assert!(i4 > 1.0 && i6 > 1.0);
    let fibres = 1e5 * (i4 - 1.0).powi(3) + 2e5 / 3.0 * ((1.5 * (i6 - 1.0).powi(2)).exp() - 1.0);
    let expected = NeoHookean::new(&SOLID).psi(&f) + fibres;
    assert!((material.psi(&f) / expected - 1.0).abs() < 1e-13);
    fn derivatives<const D: usize>(material: &ExpressedEnergy) {
        for f in samples::<D>(false) {
            if f.norm_squared() > 6.0 {
                continue;
            }
            let (p, derived) = (material.pk1(&f), autodiff_stress(material, &f));
            assert!(largest(&(p - derived)) < 1e-12 * largest(&p).max(LAME.mu), "{p:?} {derived:?}");
            let exact = material.hessian(&f, Psd::Exact);
            // Differences of the stress.
            let h = 1e-6;
            let moved = |sign: f64| {
                let mut f = f;
                f[0][1] += sign * h;
                material.pk1(&f)
            };
            let rate = (moved(1.0) - moved(-1.0)).scale(0.5 / h);
            for i in 0..D {
                for j in 0..D {
                    let error = (exact.0[i][j][0][1] - rate[i][j]).abs();
                    assert!(error < 1e-5 * largest(&rate).max(LAME.mu), "{error}");
                }
            }
        }
    }
    derivatives::<2>(&material);
    derivatives::<3>(&material);
}

/// Second derivatives of the program agree with dual numbers.
#[test]
fn curvatures_are_derivatives_of_slopes() {
    for psi in [
        "mu/2*(I1 - 3) - mu*log(J) + lambda/2*log(J)^2",
        "mu/4*(I1^2 - 2*I2 - 2*I1 + 3) + lambda/8*(I1 - 3)^2 + mu*(I1 - 3)*(I2 - 3)*(J - 1)",
        "mu*(tanh(l1 - 1)^2 + tanh(l2 - 1)^2 + tanh(l3 - 1)^2) + lambda/2*(l1 + l2 + l3 - 3)^2",
        "mu*(cosh(l1 - 1) + cosh(l2 - 1) + cosh(l3 - 1) - 3) + lambda/2*(abs(J)^1.5/1.5 - J + 1/3)",
    ] {
        let material = material(psi);
        for f in samples::<3>(false) {
            let exact = material.hessian(&f, Psd::Exact);
            let error = difference(&exact, &autodiff_hessian(&material, &f, Psd::Exact));
            assert!(error < 1e-9, "{psi}: {error:e} {f:?}");
            let error = largest(&(material.pk1(&f) - autodiff_stress(&material, &f)));
            assert!(
                error < 1e-12 * LAME.lambda * f.norm_squared().powi(3).max(1.0),
                "{psi}: {error:e} {f:?}"
            );
        }
    }
}

#[test]
fn stress_has_the_same_bits_in_packs_and_alone() {
    let of_stretches = material("mu*(ln(l1)^2 + ln(l2)^2 + ln(l3)^2) + lambda/2*ln(J)^2");
    same_bits::<_, 2>("stretches", &of_stretches);
    same_bits::<_, 3>("stretches", &of_stretches);
    let everything = "+F12-F12+F13-F13+F21-F21+F23-F23+F31-F31+F32-F32+F11-F11+F22-F22";
    let psi = format!(
        "mu*(E11^2 + E22^2 + E33^2 + 2*E12^2 + 2*E13^2 + 2*E32^2) + lambda/2*(I1 - 3)^2/4 {everything}"
    );
    let of_components = material(&psi);
    same_bits::<_, 2>("components", &of_components);
    same_bits::<_, 3>("components", &of_components);
}

/// The energy is infinite and the stress is not finite where a formula has no value.
#[test]
fn domains_are_found() {
    for (psi, domain) in [
        ("mu/2*(I1 - 3) - mu*(J - 1) + (lambda + mu)/2*(J - 1)^2", Domain::Everywhere),
        ("mu/2*(I1 - 3) - mu*log(J) + lambda/2*log(J)^2", Domain::PositiveJ),
        ("mu/2*(I1 - 3) - mu/2*log(I3) + lambda/8*log(I3)^2", Domain::PositiveJ),
        ("mu/2*(I1/I3^(1/3) - 3) + kappa/2*(J - 1)^2", Domain::PositiveJ),
        ("mu*(ln(l1)^2 + ln(l2)^2 + ln(l3)^2) + lambda/2*ln(J)^2", Domain::PositiveJ),
    ] {
        let material = material(psi);
        assert_eq!(Material::<3>::domain(&material), domain, "{psi}");
        let inverted = Mat::diagonal(&[1.0, 1.2, -0.9]);
        assert_eq!(material.psi(&inverted).is_finite(), domain == Domain::Everywhere, "{psi}");
        if domain == Domain::PositiveJ {
            assert_eq!(material.psi(&inverted), f64::INFINITY, "{psi}");
            assert!(material.pk1(&inverted).norm_squared().is_nan(), "{psi}");
        }
    }
    // Gent's limiting stretch.
    let gent = material("-mu*0.5/2*log(1 - (I1 - 3)/0.5) - mu*log(J) + lambda/2*log(J)^2");
    assert!(gent.psi(&Mat::diagonal(&[1.2, 1.0, 1.0])).is_finite());
    let beyond = Mat::diagonal(&[1.5, 1.0, 1.0]);
    assert_eq!(gent.psi(&beyond), f64::INFINITY);
    assert!(gent.pk1(&beyond).norm_squared().is_nan(), "the slope of a logarithm that has no value");
}

#[test]
fn lame_parameters_are_found() {
    let Lame { lambda, mu } = formula("mu/2*(I1 - 3) - mu*log(J) + lambda/2*log(J)^2").lame().unwrap();
    assert!((lambda / LAME.lambda - 1.0).abs() < 1e-14 && (mu / LAME.mu - 1.0).abs() < 1e-14);
    assert_eq!(formula("mu*(E11^2 + E22^2 + 2*E12^2)").lame(), None);
}

#[test]
fn mistakes_are_named() {
    let message = |formula: EnergyExpression| formula.check().expect_err(formula.text()).to_string();
    for (psi, expected) in [
        ("mu/2*(I1 - 3)", "psi = 384615.3846153846: is the stress at rest [Pa], which must be 0"),
        ("mu/2*I1 - mu*log(J)", "psi = 576923.07692307"),
        ("0*mu", "psi = 0: is the stiffness at rest [Pa]"),
        ("log(J - 1)*mu", "psi = "),
        ("-mu/2*(I1 - 3) + mu*log(J)", "psi = -"),
        ("mu/2*(I1 - 3) - mu*log(J) - 0.8*mu*(J-1)^2/2", "psi = -"),
        ("mu*(l1^2 + l2^2 + l3^2 - 3)/2 - mu*log(J) + mu*(l1 - 1)^2*(l2-1)^2*l3", "psi = "),
        ("mu*(l1 + I4)", "fibres = 0: is the number of directions, and `psi` has I4"),
        ("mu*(l1 + C12)", "psi = NaN: has both l1 and C12"),
        ("mu*(J - K)", "psi = NaN: is not a valid energy: unknown name `K` (at byte 8)"),
        ("mu*sin(J)", "psi = NaN: is not a valid energy: `sin` of something that changes is not available"),
    ] {
        let message = message(formula(psi));
        assert!(message.starts_with(expected), "{psi}: {message}");
    }
    let named = |name: &str, value: f64| message(EnergyExpression::new("I1 - 3", [(name, value)], &[]));
    assert!(named("J", 1.0).contains("`J` has a meaning of its own"));
    assert!(named("log", 1.0).contains("`log` has a meaning of its own"));
    assert!(named("2a", 1.0).contains("cannot be a name"));
    assert!(named("a", f64::NAN).contains("`a` must be a finite number"));
    assert!(named("mu", 1.0).contains("`mu` is not in `psi`"));
    let fibres = |fibres: &[Vec<f64>]| message(EnergyExpression::new("I4 - 1", [], fibres));
    assert!(fibres(&[vec![0.0, 0.0, 0.0]]).starts_with("fibres[0] = 0: is the length"));
    assert!(fibres(&[vec![1.0, 0.0], vec![1.0]]).starts_with("fibres[1] = 1: is the number of components"));
    // Valid in 2D only: in 3D some deformations meet no resistance.
    let flat = formula("mu*(E11^2 + E22^2 + 2*E12^2)");
    assert_eq!(flat.check_at_rest(2), Ok(()));
    let EnergyMistake::Parameter(error) = flat.check_at_rest(3).expect_err("not elliptic") else {
        panic!("a number")
    };
    assert!(error.to_string().contains("weakest plane wave"), "{error}");
}

/// A formula that needs too many intermediate results is refused; a long one is compiled.
#[test]
fn long_formulas_are_compiled() {
    let of_terms = |terms: usize| {
        let sum: Vec<String> = (2..terms).map(|k| format!("mu/{k}*(I1 - 3)^{k}/(1 + I2)")).collect();
        formula(&format!("mu/2*(I1 - 3) - mu*log(J) + lambda/2*log(J)^2 + 1e-3*({})", sum.join(" + ")))
    };
    let long = of_terms(40);
    assert_eq!(long.check(), Ok(()));
    let f = Mat([[1.1, 0.1, 0.0], [0.0, 0.9, 0.1], [0.05, 0.0, 1.05]]);
    let material = ExpressedEnergy::new(&long);
    let error = largest(&(material.pk1(&f) - autodiff_stress(&material, &f)));
    assert!(error < 1e-12 * LAME.lambda, "{error:e}");
    let message = of_terms(250).check().expect_err("too long").to_string();
    assert!(message.contains("intermediate numbers at once, and there is room for 128"), "{message}");
}

/// Derivatives with respect to parameters agree with differences of the energy.
#[test]
fn derivatives_by_parameters() {
    let f = Mat([[1.2, 0.1, 0.0], [0.0, 0.9, 0.1], [0.05, 0.0, 1.05]]);
    let of = |k: f64, psi: &str| EnergyExpression::new(psi, [("k", k), ("mu", 2e5)], &[vec![1.0, 2.0]]);
    for psi in [
        "mu/2*(I1 - 3 - 2*ln(J)) + mu/k^2*(J - 1)^2",
        "mu*(l1^k + l2^k + l3^k - 3 - k*ln(J))",
        "mu/2*(I1 - 3 - 2*ln(J)) + mu/k*(exp(k*(I4 - 1)^2) - 1)",
    ] {
        let derivative = ExpressedEnergy::new(&of(1.7, psi).derivative("k").unwrap());
        let h = 1e-4;
        let [up, down] = [1.7 + h, 1.7 - h].map(|k| ExpressedEnergy::new(&of(k, psi)));
        let expected = (up.psi(&f) - down.psi(&f)) / (2.0 * h);
        assert!((derivative.psi(&f) / expected - 1.0).abs() < 1e-6, "{psi}: {expected}");
        let expected = (up.pk1(&f) - down.pk1(&f)).scale(0.5 / h);
        let error = largest(&(derivative.pk1(&f) - expected)) / largest(&expected);
        assert!(error < 1e-6, "{psi}: {error:e}");
        assert!(of(1.7, psi).derivative("lambda").is_none());
    }
}
