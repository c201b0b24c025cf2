//! Bodies that cannot be simulated are refused with the place, the element or vertex, and the value;
//! nothing of it becomes a NaN.

use pliant_scene::Source;
use pliant_scene::assembly::UnstableStep;

const TRIANGLE: &str = "{ inline = { points = [[0, 0], [1, 0], [0, 1]], triangles = [[0, 1, 2]] } }";

/// The message for one body of `mesh`, with `young`, `poisson`, density and time step.
fn refused(dimension: usize, mesh: &str, [young, poisson, density, step]: [f64; 4]) -> String {
    let text = format!(
        "dimension = {dimension}\ntime = {{ integrator = 'velocity-verlet', step = {step:?}, duration = \
         0.01 }}\n[[body]]\n\
         mesh = {mesh}\nelastic = {{ stvk = {{ young = {young:?}, poisson = {poisson:?} }} }}\nmass = {{ \
         density = {density:?} }}\n"
    );
    let source = Source::new("scene.toml", text);
    let error = match source.scene() {
        Err(error) => error,
        Ok(scene) => match scene.assemble(UnstableStep::Refuse) {
            Err(problems) => source.error(problems),
            Ok(_) => panic!("{mesh} is accepted"),
        },
    };
    assert_eq!(error.problems().len(), 1, "{error}");
    error.to_string()
}

const SOUND: [f64; 4] = [1e5, 0.3, 1.0, 1e-6];

// D8: zero and negative area and volume.
#[test]
fn elements_without_a_volume_are_named_with_their_volume() {
    let inline = |points: &str, cells: &str| format!("{{ inline = {{ points = {points}, {cells} }} }}");
    let two = "triangles = [[0, 1, 2], [1, 3, 2]]";
    for (dimension, points, cells, says) in [
        (2, "[[0, 0], [1, 0], [0, 1], [1, 0]]", two, "triangle 1 is degenerate: its area is 0 m^2"),
        (2, "[[0, 0], [1, 0], [0, 1], [0.5, 0.5]]", two, "triangle 1 is degenerate: its area is 0 m^2"),
        (2, "[[0, 0], [1, 0], [0, 1], [0.25, 0.25]]", two, "triangle 1 is inverted: its area is -0.25 m^2"),
        (
            3,
            "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]",
            "tetrahedra = [[0, 1, 2, 3]]",
            "tetrahedron 0 is degenerate: its volume is 0 m^3",
        ),
        (
            3,
            "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            "tetrahedra = [[0, 2, 1, 3]]",
            "tetrahedron 0 is inverted: its volume is -0.1667 m^3",
        ),
    ] {
        let message = refused(dimension, &inline(points, cells), SOUND);
        assert!(message.contains(says) && message.contains("scene.toml:4:8"), "{message}");
    }
}

// D10: numbers that no material, mesh or time step has.
#[test]
fn numbers_that_cannot_be_are_named_each_by_its_own_message() {
    let inline = |points: &str| format!("{{ inline = {{ points = {points}, triangles = [[0, 1, 2]] }} }}");
    let of = |i: usize, value: f64| {
        let mut numbers = SOUND;
        numbers[i] = value;
        numbers
    };
    let triangle = TRIANGLE.to_owned();
    let cases = [
        (inline("[[0, nan], [1, 0], [0, 1]]"), SOUND, "4:35", "`points` must be finite, got NaN [m]"),
        (inline("[[0, 0], [inf, 0], [0, 1]]"), SOUND, "4:40", "`points` must be finite, got inf [m]"),
        (triangle.clone(), of(1, 0.5), "5:", "`poisson` = 0.5: makes the bulk modulus infinite"),
        (
            triangle.clone(),
            of(1, -1.01),
            "5:",
            "`poisson` = -1.01: makes the shear modulus infinite or negative",
        ),
        (triangle.clone(), of(0, 0.0), "5:", "`young` = 0.0: must be positive [Pa]"),
        (triangle.clone(), of(0, -1e5), "5:", "`young` = -100000.0: must be positive [Pa]"),
        (triangle.clone(), of(2, 0.0), "6:", "`density` must be positive and finite, got 0.0 [kg/m^2]"),
        (triangle.clone(), of(3, 0.0), "2:", "`step` must be positive and finite, got 0.0 [s]"),
        (triangle, of(3, -1e-3), "2:", "`step` must be positive and finite, got -0.001 [s]"),
        (
            "{ inline = { points = [[0, 0], [1, 0], [0, 1], [5, 5]], triangles = [[0, 1, 2]] } }".to_owned(),
            SOUND,
            "4:8",
            "1 vertex belongs to no element and no edge, the first is vertex 3",
        ),
    ];
    for (mesh, numbers, place, says) in cases {
        let message = refused(2, &mesh, numbers);
        assert!(message.contains(says) && message.contains(&format!("scene.toml:{place}")), "{message}");
    }
}
