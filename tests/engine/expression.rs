//! Energies that a scene writes as formulas, against the same models by hand.

use pliant_scene::Scene;
use pliant_scene::assembly::{Assembly, UnstableStep};

/// Formulas of registered models, with `mu` and `lambda` of E = 1e5 Pa and nu = 0.3.
const MODELS: [(&str, &str); 4] = [
    ("stable-neo-hookean", "mu/2*(I1 - 3) - mu*(J - 1) + (lambda + mu)/2*(J - 1)^2"),
    ("neo-hookean", "mu/2*(I1 - 3) - mu*log(J) + lambda/2*log(J)^2"),
    ("hencky", "mu*(ln(l1)^2 + ln(l2)^2 + ln(l3)^2) + lambda/2*ln(J)^2"),
    ("stvk", "mu*(E11^2 + E22^2 + E33^2 + 2*E12^2 + 2*E13^2 + 2*E23^2) + lambda/2*(E11 + E22 + E33)^2"),
];

fn formula(psi: &str) -> String {
    let (mu, lambda) = (1e5 / 2.6, 3e4 / (1.3 * 0.4));
    format!("expression = {{ psi = '{psi}', parameters = {{ mu = {mu:?}, lambda = '{lambda:?} Pa' }} }}")
}

/// A clamped beam that starts bent and falls.
fn beam(dimension: usize, elastic: &str, time: &str, keys: &str) -> String {
    let (cells, gravity, normal, start) = if dimension == 2 {
        ("[4, 2]", "[0.0, -9.8]", "[1.0, 0.0]", "[[1.1, 0.1], [0.05, 0.95]]")
    } else {
        let start = "[[1.1, 0.1, 0.0], [0.05, 0.95, 0.1], [0.0, -0.05, 1.05]]";
        ("[4, 2, 1]", "[0.0, -9.8, 1.0]", "[1.0, 0.0, 0.0]", start)
    };
    format!(
        "dimension = {dimension}\ntime = {{ {time}, duration = 1.0 }}\nworld = {{ gravity = {gravity} }}\n\
         [[body]]\nname = 'beam'\nmesh = {{ grid = {{ cells = {cells}, spacing = 0.1 }} }}\n\
         elastic = {{ {elastic} }}\n\
         mass = {{ density = 1000.0 }}\npin = [{{ half_space = {{ normal = {normal}, offset = 0.0 }} }}]\n\
         position = {{ affine = {{ matrix = {start} }} }}\n{keys}"
    )
}

fn assemble(text: &str) -> Assembly {
    Scene::from_toml(text)
        .unwrap_or_else(|error| panic!("{error}\n{text}"))
        .assemble(UnstableStep::Refuse)
        .ok()
        .unwrap()
}

/// Positions after so many steps [m].
fn positions(text: &str, steps: usize) -> Vec<f64> {
    let mut simulation = assemble(text).simulation;
    for _ in 0..steps {
        simulation.step().unwrap();
    }
    simulation.state().x().to_vec()
}

/// Runs a model by hand and by its formula; the difference in parts of the beam.
fn compare(dimension: usize, time: &str, keys: &str, steps: usize) {
    for (name, psi) in MODELS {
        let by_hand = format!("{name} = {{ young = 1e5, poisson = 0.3 }}");
        let expected = positions(&beam(dimension, &by_hand, time, keys), steps);
        let start = positions(&beam(dimension, &by_hand, time, keys), 0);
        let found = positions(&beam(dimension, &formula(psi), time, keys), steps);
        let largest = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(largest(&expected, &start) > 1e-3, "{name}: it does not move");
        let error = largest(&expected, &found) / 0.4;
        assert!(error < 1e-12, "{name} {dimension}D, {time} {keys}: {error:e}");
    }
}

#[test]
fn explicit_trajectories_are_those_of_the_models_by_hand() {
    for dimension in [2, 3] {
        compare(dimension, "integrator = 'symplectic-euler', step = 2e-4", "", 100);
        compare(dimension, "integrator = 'symplectic-euler', step = 1e-4", "order = 2", 100);
        compare(dimension, "integrator = 'symplectic-euler', step = 2e-4", "stress = 'autodiff'", 50);
    }
}

#[test]
fn implicit_trajectories_are_those_of_the_models_by_hand() {
    let time = "integrator = 'implicit-euler', step = 5e-3, solver = { tolerance = 1e-13 }";
    for dimension in [2, 3] {
        compare(dimension, time, "", 6);
        compare(dimension, time, "order = 2", 4);
    }
}

/// Cells of one point, and sheets, whose thickness follows.
#[test]
fn other_elements_take_formulas_too() {
    let (name, psi) = MODELS[0];
    let models = [format!("{name} = {{ young = 1e5, poisson = 0.3 }}"), formula(psi)];
    let scenes = |elastic: &str| {
        let cells = beam(3, elastic, "integrator = 'symplectic-euler', step = 2e-4", "")
            .replace("spacing = 0.1", "spacing = 0.1, element = 'hexahedron'");
        let sheet = format!(
            "dimension = 3\ntime = {{ integrator = 'symplectic-euler', step = 1e-4, duration = 1.0 }}\n\
             world = {{ gravity = [0.0, 0.0, -9.8] }}\n[[body]]\nname = 'sheet'\n\
             mesh = {{ cloth = {{ cells = [4, 4], origin = [0, 0, 0], u = [0.4, 0, 0], v = [0, 0.4, 0] }} \
             }}\n\
             elastic = {{ {elastic} }}\n\
             membrane = {{ thickness = 0.01 }}\nmass = {{ density = 1000.0 }}\npin = [{{ vertices = [0, 4] \
             }}]\n"
        );
        [cells, sheet]
    };
    let [by_hand, found] = models.each_ref().map(|elastic| scenes(elastic));
    for (by_hand, found) in by_hand.iter().zip(&found) {
        let (expected, found) = (positions(by_hand, 50), positions(found, 50));
        let error = expected.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-12, "{error:e}\n{by_hand}");
    }
}

/// What `pliant check` says about a scene with this energy.
fn refused(elastic: &str, keys: &str) -> String {
    let text = beam(2, elastic, "integrator = 'symplectic-euler', step = 1e-4", keys);
    Scene::from_toml(&text).expect_err("a mistake").to_string()
}

#[test]
fn mistakes_are_told_with_their_place() {
    for (elastic, keys, expected) in [
        (
            "expression = { psi = 'mu/2*(I1 - 3) - mu*log(K)', parameters = { mu = 1e5 } }",
            "",
            &["<scene>:7:58", "unknown name `K`", "`I1`"][..],
        ),
        (
            "expression = { psi = 'mu/2*(I1 - 3)', parameters = { mu = '1 MPa' } }",
            "",
            &["`psi` = 1000000.0: is the stress at rest [Pa], which must be 0", "-mu*log(J)"],
        ),
        (
            "expression = { psi = 'mu/2*(I1 - 3) - mu*log(J)', parameters = { mu = '1 m' } }",
            "",
            &["<scene>:7:83", "`1 m` is a length [m], not a pressure [Pa]"],
        ),
        (
            "expression = { psi = 'mu/2*(I1 - 3) - mu*log(J)', parameters = { mu = 1e5 }, nu = 0.3 }",
            "",
            &["unknown field `nu`", "`parameters`"],
        ),
        (
            "expression = { psi = 'k*E11^2', parameters = { k = 1e5 } }",
            "",
            &["against the weakest plane wave [Pa], which must be positive"],
        ),
        (
            "expression = { psi = 'mu*(l1 + C12)', parameters = { mu = 1e5 } }",
            "",
            &["`psi` has both l1 and C12", "help: write the isotropic part with I1, I2 and J"],
        ),
    ] {
        let message = refused(elastic, keys);
        for part in expected {
            assert!(message.contains(part), "{part} is not in:\n{message}");
        }
    }
}

/// Fibres along the beam: it is stiffer along them, in proportion, and `check` says that it is not
/// isotropic.
#[test]
fn fibres_stiffen_their_direction() {
    let stretch = |direction: &str| {
        let elastic = format!(
            "expression = {{ psi = 'mu/2*(I1 - 3) - mu*log(J) + k/8*(I4 - 1)^2', fibres = [{direction}], \
             parameters = {{ mu = '50 kPa', k = '300 kPa' }} }}"
        );
        let text = beam(2, &elastic, "integrator = 'quasi-static', step = 1.0", "")
            .replace("gravity = [0.0, -9.8]", "gravity = [2.0, 0.0]")
            .replace("[[1.1, 0.1], [0.05, 0.95]]", "[[1.0, 0.0], [0.0, 1.0]]");
        let x = positions(&text, 1);
        x.chunks(2).map(|x| x[0]).fold(0.0, f64::max) / 0.4 - 1.0
    };
    let (along, across) = (stretch("[1.0, 0.0]"), stretch("[0.0, 2.0]"));
    // Of small strains: the mean stress rho g L / 2 over 2 mu + k along, 2 mu across where the sides are
    // held by fibres.
    assert!(along > 0.0 && across / along > 2.5, "{along} {across}");
}

/// A net of springs, hung at two corners.
fn net(springs: &str, time: &str) -> String {
    format!(
        "dimension = 3\ntime = {{ {time}, duration = 1.0 }}\nworld = {{ gravity = [0.0, 0.0, -9.8] \
         }}\n[[body]]\n\
         mesh = {{ cloth = {{ cells = [4, 3], origin = [0, 0, 0], u = [0.4, 0, 0], v = [0, 0.3, 0] }} }}\n\
         springs = {{ {springs} }}\nmass = {{ per_vertex = 0.01 }}\npin = [{{ vertices = [0, 4] }}]\n"
    )
}

#[test]
fn springs_by_their_formula_are_springs() {
    let implicit = "integrator = 'implicit-euler', step = 5e-3, solver = { tolerance = 1e-13 }";
    for (time, steps) in [("integrator = 'symplectic-euler', step = 5e-4", 200), (implicit, 10)] {
        for lengths in ["", ", rest_length = 0.11"] {
            let by_hand = positions(&net(&format!("stiffness = 200.0{lengths}"), time), steps);
            let formula =
                format!("expression = 'k/2*(l - l0)^2', parameters = {{ k = '0.2 N/mm' }}{lengths}");
            let found = positions(&net(&formula, time), steps);
            assert!(by_hand.iter().any(|z| *z < -1e-3), "it does not fall");
            let error = by_hand.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < 1e-12, "{time}{lengths}: {error:e}");
        }
    }
}

#[test]
fn mistakes_in_the_formula_of_springs_are_told_with_their_place() {
    for (springs, expected) in [
        (
            "expression = 'k/2*(l - L)^2', parameters = { k = 9.0 }",
            &["<scene>:6:36", "unknown name `L`", "`l0`"][..],
        ),
        (
            "expression = 'k/2*l^2', parameters = { k = 9.0 }",
            &["`expression` is 9.0 N as the tension, which must be 0"],
        ),
        ("expression = '(l - l0)^2', parameters = { k = 9.0 }", &["`k` is not in the formula"]),
        (
            "expression = '(l - l0)^2', young = 9.0",
            &["exactly one of `stiffness` [N/m], `young`", "two are given"],
        ),
        ("stiffness = 1.0, parameters = { k = 9.0 }", &["`parameters` are those of `expression`"]),
    ] {
        let message = Scene::from_toml(&net(springs, "integrator = 'symplectic-euler', step = 1e-4"))
            .expect_err("a mistake")
            .to_string();
        for part in expected {
            assert!(message.contains(part), "{part} is not in:\n{message}");
        }
    }
}
