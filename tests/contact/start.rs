//! Starts that are none, and scenes that contact cannot take.

const BODIES: &str = "dimension = 2\ntime = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }\n";

fn two_boxes(origin: &str) -> String {
    format!(
        "{BODIES}contact = {{}}\n\
         [[body]]\nname = 'low'\nmesh = {{ grid = {{ cells = [2, 2], size = [0.2, 0.2] }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
         [[body]]\nname = 'high'\nmesh = {{ grid = {{ cells = [2, 2], size = [0.2, 0.2], origin = {origin} }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n"
    )
}

#[test]
fn bodies_that_cross_at_the_start_are_told_with_the_place() {
    let told = super::problems(&two_boxes("[0.05, 0.1999]"));
    assert!(told.contains("crosses") && told.contains("`low`") && told.contains("`high`"), "{told}");
    assert!(told.contains("edge ") && told.contains("(0."), "{told}");
}

#[test]
fn bodies_that_touch_at_no_distance_overlap() {
    let told = super::problems(&two_boxes("[0.05, 0.2]"));
    assert!(told.contains("overlap") || told.contains("crosses"), "{told}");
}

#[test]
fn bodies_apart_are_assembled_and_their_distance_is_told() {
    let report = super::assembled(&two_boxes("[0.05, 0.21]")).report;
    let contact = report.contact.unwrap();
    // A thousandth of the diagonal of 0.2 sqrt(2).
    assert!((contact.distance - 0.2e-3 * 2f64.sqrt()).abs() < 1e-12, "{contact:?}");
    assert_eq!(contact.pairs.len(), 3, "{contact:?}");
}

#[test]
fn a_body_below_a_floor_is_told() {
    let text = format!(
        "{BODIES}contact = {{}}\n\
         [[body]]\nname = 'block'\nmesh = {{ grid = {{ cells = [2, 2], size = [0.2, 0.2], origin = [0, -0.1] }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
         [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
    );
    let told = super::problems(&text);
    assert!(told.contains("overlap by 1.000e-1 m") && told.contains("`floor`"), "{told}");
}

/// Scenes that are refused by validation, with what is said.
#[test]
fn schemes_and_tables_that_contact_cannot_take_are_refused() {
    let scene = two_boxes("[0.05, 0.21]");
    let midpoint = scene.replace("'implicit-euler'", "'implicit-midpoint'");
    let pair = scene
        .replace("contact = {}", "contact = { pairs = [{ between = ['low', 'hihg'], friction = 0.1 }] }");
    let empty = scene.replace("contact = {}", "contact = { pairs = [{ between = ['low', 'high'] }] }");
    let friction = scene.replace("contact = {}", "contact = { friction = -0.1 }");
    let without = scene.replace("contact = {}\n", "")
        + "[[obstacle]]\nname = 'floor'\nshape = { half_space = { normal = [0, 1], offset = -1 } }\n";
    let cases = [
        (midpoint, "end elsewhere"),
        (pair, "did you mean `high`"),
        (empty, "says nothing"),
        (friction, "0 or more"),
        (without, "has no `[contact]`"),
    ];
    for (text, expected) in cases {
        let told = match pliant_scene::Scene::from_toml(&text) {
            Ok(_) => panic!("accepted: {text}"),
            Err(error) => error.to_string(),
        };
        assert!(told.contains(expected), "{told}");
    }
}
