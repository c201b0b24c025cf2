//! Wishes on problems with known answers.

use super::*;

const FALLING_BEAM: &str = "dimension = 2
    time = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }
    world = { gravity = [0.0, -9.81] }
    [[body]]
    mesh = { grid = { cells = [8, 2], size = [4.0, 1.0] } }
    elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
    mass = { density = 1000.0 }
    pin = [{ half_space = { normal = [1.0, 0.0], offset = 0.0 } }]
    [[probe]]
    name = 'tip'
    vertex = 17";

const COOK: &str = "dimension = 2
    time = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }
    [[body]]
    mesh = { cooks_membrane = { cells = [4, 4] } }
    elastic = { linear = { young = 1.0, poisson = 0.3333333333333333, plane = 'stress' } }
    mass = { density = 1.0 }
    pin = [{ group = 'left' }]
    load = [{ group = 'right', traction = ['0', '1/16'] }]
    [[probe]]
    name = 'middle'
    at = [48.0, 52.0]";

fn found(text: &str, of: &str, error: &str, budget: f64) -> Result<AccurateRun, AccuracyError> {
    let source = Source::new("scene", text);
    let quantity: QuantityOfInterest = of.parse().unwrap();
    let wish = WishedError::parse(error, &quantity).unwrap();
    let interrupt = AtomicBool::new(false);
    AccuracySearch { source: &source, quantity: &quantity, wish, budget, interrupt: &interrupt }
        .run(&mut |_| {})
}

#[test]
fn true_errors_are_below_the_wish() {
    // Independent programs: tip at the end (own uncertainty 7e-4 m), rise of the membrane (C9).
    let cases = [
        (FALLING_BEAM, "tip.y", -3.666_402_662_758_9, 7e-4, ["10 %", "3 %", "1 %", "2 cm"]),
        (COOK, "middle.y", 23.967_74, 1e-5, ["10 %", "1 %", "0.1 %", "5 mm"]),
    ];
    for (text, of, truth, known, wishes) in cases {
        for error in wishes {
            let run =
                found(text, of, error, 1e4).unwrap_or_else(|failure| panic!("{of}, {error}: {failure}"));
            let off = (run.proof.value - truth).abs();
            assert!(off <= run.wish + known, "{of}, {error}: off by {off}: {run:?}");
            assert!(run.proof.interval.unwrap() <= run.wish);
            // The keys make the scene that run, and give its value.
            let changes: Vec<(String, String)> =
                run.keys.iter().map(|key| (key.path.clone(), key.value.clone().unwrap())).collect();
            let scene = Source::new("scene", text.replace("vertex = 17", "at = [4.0, 0.5]"));
            let scene = scene.varied(&changes).unwrap().scene().unwrap();
            let quantity = [of.parse().unwrap()];
            let mut begun = |_| {};
            let again = budget_of_scene(&scene, &quantity, &AtomicBool::new(false), &mut begun).unwrap();
            assert_eq!(again.quantities[0].value, run.proof.value);
        }
    }
}

#[test]
fn wishes_that_cannot_be_proved_are_refused() {
    // A millisecond is not enough for any proof.
    let failure = found(FALLING_BEAM, "tip.y", "0.001 %", 1e-3).unwrap_err();
    assert!(matches!(&failure, AccuracyError::NotReached(_)), "{failure}");
    let failure = found(FALLING_BEAM, "top.y", "1 %", 1.0).unwrap_err();
    assert!(matches!(&failure, AccuracyError::Missing(_)), "{failure}");
    let contact = format!("{FALLING_BEAM}\n[contact]");
    assert!(matches!(found(&contact, "tip.y", "1 %", 1.0), Err(AccuracyError::Meshes(_))));
}

#[test]
fn wishes_are_parts_or_have_units() {
    let (tip, force): (QuantityOfInterest, QuantityOfInterest) =
        ("tip.y".parse().unwrap(), "left.force.y".parse().unwrap());
    let wish = |text, of| WishedError::parse(text, of);
    assert_eq!(wish("1 %", &tip), Ok(WishedError::Relative(0.01)));
    assert_eq!(wish("0.02", &tip), Ok(WishedError::Relative(0.02)));
    assert_eq!(wish("0.1 mm", &tip), Ok(WishedError::Absolute(1e-4)));
    assert_eq!(wish("2 kN", &force), Ok(WishedError::Absolute(2000.0)));
    for (text, of) in [("0 %", &tip), ("-1 %", &tip), ("1 N", &tip), ("much", &force), ("x %", &tip)] {
        let error = wish(text, of).unwrap_err().to_string();
        assert!(error.contains(text) && error.contains("1 %"), "{error}");
    }
}
