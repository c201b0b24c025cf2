//! Scenes that read well and cannot be simulated.

use super::*;
use crate::ProblemKind;

/// The problems of `GOOD` with a text replaced by another, for each row of a table.
fn check(table: &[(&str, &str, &[&str])]) {
    for (old, new, expected) in table {
        let failed = error(&changed(old, new));
        assert_eq!(briefly(&failed), *expected, "{new}");
        assert!(failed.problems().iter().all(|problem| problem.kind == ProblemKind::Semantic));
    }
}

#[test]
fn surroundings() {
    check(&[
        ("dimension = 2", "dimension = 4", &["1:13 dimension: `dimension` must be 2 or 3, got 4"]),
        ("1e-3", "0.0", &["5:8 time.step: `step` must be positive and finite, got 0.0 [s]"]),
        ("1e-3", "-1", &["5:8 time.step: `step` must be positive and finite, got -1.0 [s]"]),
        ("1e-3", "nan", &["5:8 time.step: `step` must be positive and finite, got NaN [s]"]),
        (
            "1e-3",
            "1e-300",
            &["5:8 time.step: 1.0 [s] in steps of 1e-300 [s] are 1.0e300 steps, more than can be counted \
                 (2^53)"],
        ),
        (
            "duration = 1.0",
            "duration = -1.0",
            &["6:12 time.duration: `duration` must be 0 or more, and finite, got -1.0 [s]"],
        ),
        (
            "duration = 1.0",
            "duration = inf",
            &["6:12 time.duration: `duration` must be 0 or more, and finite, got inf [s]"],
        ),
        (
            "[0.0, -9.8]",
            "[0, 0, -9.8]",
            &["9:11 world.gravity: `gravity` has 3 numbers, but `dimension` is 2: 2 are needed"],
        ),
        ("[0.0, -9.8]", "[0, nan]", &["9:15 world.gravity.1: `gravity` must be finite, got NaN [m/s^2]"]),
        (
            "[0.0, -9.8]",
            "[0, 0]\nwalls = [{ normal = [0, 0], offset = 1 }]",
            &["10:21 world.walls.0.normal: `normal` is zero: it needs a direction"],
        ),
        (
            "[0.0, -9.8]",
            "[0, 0]\nwalls = [{ normal = [0, 1], offset = 1 }, { normal = [1], offset = inf }]",
            &[
                "10:54 world.walls.1.normal: `normal` has 1 number, but `dimension` is 2: 2 are needed",
                "10:68 world.walls.1.offset: `offset` must be finite, got inf [m]",
            ],
        ),
        (
            "[0.0, -9.8]",
            "[0, 0]\nether_drag = -1",
            &["10:14 world.ether_drag: `ether_drag` must be 0 or more, and finite, got -1.0 [1/s]"],
        ),
        (
            "[0.0, -9.8]",
            "[0, 0]\nnbody = { constant = 0.0, softening = -1 }",
            &[
                "10:9 world.nbody: `nbody` acts on nothing",
                "10:22 world.nbody.constant: `constant` must be positive and finite, got 0.0 [m^3/(kg s^2)]",
                "10:39 world.nbody.softening: `softening` must be 0 or more, and finite, got -1.0 [m]",
            ],
        ),
        (
            "[0.0, -9.8]",
            "[0, 0]\nnbody = { constant = 1.0, tree = { opening_angle = 1.5 } }",
            &[
                "10:9 world.nbody: `nbody` acts on nothing",
                "10:52 world.nbody.tree.opening_angle: `opening_angle` must be above 0 and at most 1, got \
                 1.5 [rad]",
            ],
        ),
        (
            "[0.0, -9.8]",
            "[0, 0]\nnbody = { constant = 1.0, tree = { opening_angle = 0 } }",
            &[
                "10:9 world.nbody: `nbody` acts on nothing",
                "10:52 world.nbody.tree.opening_angle: `opening_angle` must be above 0 and at most 1, got \
                 0.0 [rad]",
            ],
        ),
        (
            "rate = 60.0",
            "rate = 0",
            &["19:8 output.rate: `rate` must be positive and finite, got 0.0 [frames/s]"],
        ),
        (
            "rate = 60.0",
            "rate = 1e12",
            &["19:8 output.rate: 1000000000000.0 [frames/s] for 1.0 [s] are 1.0e12 frames"],
        ),
        (
            r#"["state"]"#,
            "['state', 'mesh', 'state']",
            &["20:30 output.channels.2: channel `state` is listed twice"],
        ),
        (
            r#"["state"]"#,
            "['von-mises', 'state', 'von-mises']",
            &[
                "20:13 output.channels.0: channel `von-mises` is about finite elements, and no body is \
                 `elastic`",
                "20:35 output.channels.2: channel `von-mises` is listed twice",
                "20:35 output.channels.2: channel `von-mises` is about finite elements, and no body is \
                 `elastic`",
            ],
        ),
        (
            r#"["state"]"#,
            "['state']\nrecovery = 'average'",
            &["21:12 output.recovery: `recovery` has no effect: nothing reads its stress"],
        ),
    ]);
}

#[test]
fn a_density_has_the_unit_of_what_the_mesh_is_made_of() {
    let unit = |dimension: usize, mesh: &str, made_of: &str| {
        let text = format!(
            "dimension = {dimension}\ntime = {{ integrator = 'rk4', step = 1e-3, duration = 1.0 \
             }}\n[[body]]\nmesh = {mesh}\n\
             {made_of}\nmass = {{ density = -1.0 }}\n"
        );
        let problems = briefly(&error(&text)).join("\n");
        problems
            .split_once("got -1.0 [")
            .unwrap_or_else(|| panic!("{problems}"))
            .1
            .split(']')
            .next()
            .unwrap()
            .to_owned()
    };
    let (springs, solid) = ("springs = { stiffness = 1.0 }", "elastic = { stvk = { preset = 'rubber' } }");
    assert_eq!(
        unit(3, "{ cloth = { cells = [1, 1], origin = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0] } }", springs),
        "kg/m^2"
    );
    assert_eq!(unit(3, "{ sphere = { radius = 1.0, cells = 1 } }", springs), "kg/m^2");
    assert_eq!(unit(3, "{ strand = { segments = 1, start = [0, 0, 0], end = [1, 0, 0] } }", springs), "kg/m");
    assert_eq!(unit(3, "{ grid = { cells = [1, 1, 1], spacing = 1.0 } }", solid), "kg/m^3");
    assert_eq!(unit(2, "{ grid = { cells = [1, 1], spacing = 1.0 } }", solid), "kg/m^2");
}

#[test]
fn meshes() {
    check(&[
        (
            MESH,
            "{ grid = { cells = [2], spacing = 0.1 } }",
            &["13:27 body.0.mesh.grid.cells: `cells` has 1 number, but `dimension` is 2: 2 are needed"],
        ),
        (
            MESH,
            "{ grid = { cells = [2, 0], spacing = 0.1 } }",
            &["13:31 body.0.mesh.grid.cells.1: `cells` must be 1 or more, got 0"],
        ),
        (
            MESH,
            "{ grid = { cells = [2, 1] } }",
            &["13:10 body.0.mesh.grid: a grid takes exactly one of `spacing` [m] and `size` [m], neither \
                 is given"],
        ),
        (
            MESH,
            "{ grid = { cells = [2, 1], spacing = 1, size = [1, 1] } }",
            &["13:10 body.0.mesh.grid: a grid takes exactly one of `spacing` [m] and `size` [m], both are \
                 given"],
        ),
        (
            MESH,
            "{ grid = { cells = [2, 1], spacing = -1 } }",
            &["13:45 body.0.mesh.grid.spacing: `spacing` must be positive and finite, got -1.0 [m]"],
        ),
        (
            MESH,
            "{ grid = { cells = [2, 1], size = [1, -1] } }",
            &["13:46 body.0.mesh.grid.size.1: `size` must be positive and finite, got -1.0 [m]"],
        ),
        (
            MESH,
            "{ grid = { cells = [2, 1], spacing = 1, origin = [1] } }",
            &["13:57 body.0.mesh.grid.origin: `origin` has 1 number, but `dimension` is 2: 2 are needed"],
        ),
        (
            MESH,
            "{ grid = { cells = [200000, 100000], spacing = 1 } }",
            &["13:10 body.0.mesh.grid: this grid has more than 4294967295 vertices"],
        ),
        (
            MESH,
            "{ grid = { cells = [9000000000000000000, 9000000000000000000], spacing = 1 } }",
            &["13:10 body.0.mesh.grid: this grid has more than 4294967295 vertices"],
        ),
        (
            MESH,
            "{ cloth = { cells = [0, 1], origin = [0, 0], u = [1, 0], v = [0, 1] } }",
            &["13:29 body.0.mesh.cloth.cells.0: `cells` must be 1 or more, got 0"],
        ),
        (
            MESH,
            "{ cloth = { cells = [2, 1], origin = [0, 0], u = [1e200, 0], v = [-1e200, 0] } }",
            &["13:73 body.0.mesh.cloth.v: `u` and `v` are parallel: they span no sheet"],
        ),
        (
            MESH,
            "{ cloth = { cells = [2, 1], origin = [0, 0], u = [1, 0], v = [0, -1] } }",
            &["13:69 body.0.mesh.cloth.v: in 2D `v` must be counter-clockwise from `u`, else every \
                 triangle is inverted"],
        ),
        (
            MESH,
            "{ cloth = { cells = [2, 1], origin = [0, 0], u = [1, 0], v = [0, 0] } }",
            &["13:69 body.0.mesh.cloth.v: `v` is zero: it needs a direction"],
        ),
        (
            MESH,
            "{ strand = { segments = 0, start = [0, 0], end = [1, 0] } }",
            &["13:32 body.0.mesh.strand.segments: `segments` must be 1 or more, got 0"],
        ),
        (
            MESH,
            "{ strand = { segments = 2, start = [1, 0], end = [1, 0] } }",
            &["13:57 body.0.mesh.strand.end: `start` and `end` are the same point: the strand has no length"],
        ),
        (MESH, "{ file = { path = '' } }", &["13:26 body.0.mesh.file.path: `path` is empty"]),
        (
            MESH,
            "{ inline = { points = [[0, 0], [1, 0, 0]], edges = [[0, 1]] } }",
            &["13:39 body.0.mesh.inline.points.1: `points` has 3 numbers, but `dimension` is 2: 2 are \
                 needed"],
        ),
        (
            MESH,
            "{ inline = { points = [[0, 0], [1, 0]], edges = [[0, 1], [1, 2]] } }",
            &["13:69 body.0.mesh.inline.edges.1.1: there is no vertex 2: the body has 2"],
        ),
        (
            MESH,
            "{ inline = { points = [[0, 0], [1, 0]], edges = [[0, 1], [1, 1]] } }",
            &["13:69 body.0.mesh.inline.edges.1.1: vertex 1 occurs twice in this cell"],
        ),
        (
            MESH,
            "{ inline = { points = [[0, 0], [1, 0], [0, 1], [1, 1]], tetrahedra = [[0, 1, 2, 3]] } }",
            &["13:64 body.0.mesh.inline.tetrahedra: `tetrahedra` are for 3D only, and `dimension` is 2"],
        ),
    ]);
}

#[test]
fn bodies() {
    check(&[
        (r#""net""#, "'a b'", &[r#"12:8 body.0.name: "a b" cannot be the name of a body"#]),
        (r#""net""#, "''", &[r#"12:8 body.0.name: "" cannot be the name of a body"#]),
        (
            "[output]",
            "[[body]]\nname = 'net'\nmesh = { disk = { count = 1, radius = 1 } }\nmass = { total = 1 \
             }\n[output]",
            &[r#"19:8 body.1.name: bodies 0 and 1 are both named "net""#],
        ),
        (
            r#""net""#,
            "\"net\"\nstress = 'analytic'",
            &["13:10 body.0.stress: `stress` needs `elastic`, which this body does not have"],
        ),
        (
            SPRINGS,
            "{}",
            &["14:1 body.0.springs: `springs` take exactly one of `stiffness` [N/m], `young` [N/m^2] and \
                 `expression` [J], none is given"],
        ),
        (
            SPRINGS,
            "{ stiffness = 1, young = 1 }",
            &["14:1 body.0.springs: `springs` take exactly one of `stiffness` [N/m], `young` [N/m^2] and \
                 `expression` [J], two are given"],
        ),
        (
            SPRINGS,
            "{ stiffness = -1 }",
            &["14:25 body.0.springs.stiffness: `stiffness` must be positive and finite, got -1.0 [N/m]"],
        ),
        (
            SPRINGS,
            "{ young = 0 }",
            &["14:21 body.0.springs.young: `young` must be positive and finite, got 0.0 [N/m^2]"],
        ),
        (
            SPRINGS,
            "{ stiffness = [1, 2, 0] }",
            &["14:32 body.0.springs.stiffness.2: `stiffness` must be positive and finite, got 0.0 [N/m]"],
        ),
        (
            SPRINGS,
            "{ stiffness = 1, rest_length = -1 }",
            &["14:42 body.0.springs.rest_length: `rest_length` must be positive and finite, got -1.0 [m]"],
        ),
        (
            MASS,
            "{ per_vertex = [1, 2] }",
            &["15:23 body.0.mass.per_vertex: `per_vertex` lists 2 numbers, but the body has 12 vertices"],
        ),
        (
            MASS,
            "{ density = 0 }",
            &["15:20 body.0.mass.density: `density` must be positive and finite, got 0.0 [kg/m^2]"],
        ),
        (
            MASS,
            "{ total = inf }",
            &["15:18 body.0.mass.total: `total` must be positive and finite, got inf [kg]"],
        ),
    ]);
}

#[test]
fn pins() {
    let moved = |motion: &str| format!("[{{ vertices = [0], motion = {{ {motion} }} }}]");
    let case = |new: &str, underlined: &str, expected: &str| {
        let text = changed(PIN, new);
        let error = error(&text);
        let [problem] = error.problems() else { panic!("{new}: {error}") };
        assert_eq!(format!("{}: {}", problem.path, problem.message), expected, "{new}");
        assert_eq!(&text[problem.span.clone().unwrap()], underlined, "{new}");
    };
    case("[{ axes = ['x'] }]", "{ axes = ['x'] }", "body.0.pin.0: this does not select vertices");
    case(
        "[{ vertices = [0], group = 'a' }]",
        "{ vertices = [0], group = 'a' }",
        "body.0.pin.0: this selects vertices by `vertices` and `group` at once",
    );
    case(
        "[{ vertices = [0], name = 'a b' }]",
        "'a b'",
        "body.0.pin.0.name: \"a b\" cannot be the name of a pin",
    );
    case(
        "[{ vertices = [0], name = 'pin1' }, { vertices = [1] }]",
        "{ vertices = [1] }",
        "body.0.pin.1.name: pins 0 and 1 of this body are both named \"pin1\"",
    );
    case("[{ vertices = [0], axes = [] }]", "[]", "body.0.pin.0.axes: `axes` is empty: nothing is pinned");
    case(
        "[{ vertices = [0], axes = ['x', 'z'] }]",
        "'z'",
        "body.0.pin.0.axes.1: there is no z in two dimensions",
    );
    case("[{ vertices = [0], axes = ['x', 'x'] }]", "'x'", "body.0.pin.0.axes.1: this axis is listed twice");
    case(
        "[{ vertices = [0], until = -1 }]",
        "-1",
        "body.0.pin.0.until: `until` must be 0 or more, and finite, got -1.0 [s]",
    );
    case(&moved(""), "motion", "body.0.pin.0.motion: `motion` says nothing");
    case(
        &moved("velocity = [1]"),
        "[1]",
        "body.0.pin.0.motion.velocity: `velocity` has 1 number, but `dimension` is 2: 2 are needed",
    );
    case(
        &moved("displacement = [0, 'ln(t)']"),
        "'ln(t)'",
        "body.0.pin.0.motion.displacement.1: `displacement` is -inf [m] at t = 0.0 s",
    );
    case(
        &moved("displacement = [0, 'x * t']"),
        "x",
        "body.0.pin.0.motion.displacement.1: `displacement`: unknown name `x`",
    );
    case(
        &moved("rotation = { point = [0, 0] }"),
        "rotation",
        "body.0.pin.0.motion.rotation: a rotation needs `speed` or `angle`",
    );
    case(
        &moved("rotation = { speed = 1, angle = 't' }"),
        "rotation",
        "body.0.pin.0.motion.rotation: a rotation has `speed` or `angle`, not both",
    );
    case(
        &moved("rotation = { speed = '1 Hz' }"),
        "'1 Hz'",
        "body.0.pin.0.motion.rotation.speed: `speed`: `1 Hz` is a rate [1/s], not an angular velocity \
         [rad/s]",
    );
    case(
        &moved("rotation = { axis = [0, 0, 1], speed = 1 }"),
        "axis",
        "body.0.pin.0.motion.rotation.axis: `axis` is for 3D only, and `dimension` is 2",
    );
    case(
        &moved("keyframes = { times = [1, 1], displacements = [[0, 0], [1, 0]] }"),
        "1",
        "body.0.pin.0.motion.keyframes.times.1: `times` must ascend, got 1.0 after 1.0 [s]",
    );
    case(
        &moved("keyframes = { times = [0, 1], displacements = [[0, 0]] }"),
        "[[0, 0]]",
        "body.0.pin.0.motion.keyframes.displacements: `displacements` lists 1, but there are 2 times",
    );
    case(
        "[{ vertices = [0], axes = ['x'], motion = { velocity = [1, 2] } }]",
        "2",
        "body.0.pin.0.motion.velocity.1: this moves along y, which `axes` leaves free",
    );
}

#[test]
fn loads() {
    let case = |load: &str, underlined: &str, expected: &str| {
        let text = changed(PIN, &format!("[]\nload = [{{ {load} }}]"));
        let error = error(&text);
        let [problem] = error.problems() else { panic!("{load}: {error}") };
        assert_eq!(format!("{}: {}", problem.path, problem.message), expected, "{load}");
        assert_eq!(&text[problem.span.clone().unwrap()], underlined, "{load}");
    };
    case("group = 'a'", "{ group = 'a' }", "body.0.load.0: a load is one force, this one has none");
    case(
        "force = [1, 0], pressure = 1",
        "{ force = [1, 0], pressure = 1 }",
        "body.0.load.0: a load is one force, this one has `force` and `pressure`",
    );
    case(
        "vertices = [0], group = 'a', force = [1, 0]",
        "{ vertices = [0], group = 'a', force = [1, 0] }",
        "body.0.load.0: this selects vertices by `vertices` and `group` at once",
    );
    case(
        "force = [1]",
        "[1]",
        "body.0.load.0.force: `force` has 1 number, but `dimension` is 2: 2 are needed",
    );
    case(
        "traction = [0, '3 N']",
        "'3 N'",
        "body.0.load.0.traction.1: `traction`: `3 N` is a force [N], not a pressure [Pa]",
    );
    case(
        "body_force = [nan, 0]",
        "nan",
        "body.0.load.0.body_force.0: `body_force` must be finite, got NaN [N/m^3]",
    );
    case("pressure = '1/t'", "'1/t'", "body.0.load.0.pressure: `pressure` is inf [Pa] at t = 0.0 s");
    case("pressure = '2 * x'", "x", "body.0.load.0.pressure: `pressure`: unknown name `x`");
}

#[test]
fn axes_of_materials() {
    let fibres = "holzapfel-gasser-ogden = { shear = 1e4, bulk = 1e5, k1 = 1e4, k2 = 1, fibres = [[1, 0]] }";
    let case = |material: &str, axes: &str, underlined: &str, expected: &str| {
        let text = changed(PIN, &format!("[]\nelastic = {{ {material} }}\nelastic_axes = {{ {axes} }}"));
        let error = error(&text);
        let [problem] = error.problems() else { panic!("{axes}: {error}") };
        assert_eq!(format!("{}: {}", problem.path, problem.message), expected, "{axes}");
        assert_eq!(&text[problem.span.clone().unwrap()], underlined, "{axes}");
    };
    let along = "first = { direction = [1, 0] }";
    case(
        "corotated = { young = 1e5, poisson = 0.3 }",
        along,
        "elastic_axes",
        "body.0.elastic_axes: `elastic_axes` has no effect on a material without directions, and none is \
         known on one of `F11 ..`",
    );
    case(
        "expression = { psi = '3e4*(F11 - 1)^2 + 3e4*(I1 - 3) - 6e4*log(J)' }",
        along,
        "elastic_axes",
        "body.0.elastic_axes: `elastic_axes` has no effect on a material without directions, and none is \
         known on one of `F11 ..`",
    );
    case(
        fibres,
        "first = { per_element = [[1, 0], [0, 0]] }",
        "[0, 0]",
        "body.0.elastic_axes.first.per_element.1: `per_element` is zero: it needs a direction",
    );
    case(
        fibres,
        &format!("{along}, second = {{ direction = [0, 1] }}"),
        "second",
        "body.0.elastic_axes.second: in two dimensions the second axis is across the first",
    );
}

#[test]
fn muscles() {
    let case = |muscle: &str, underlined: &str, expected: &str| {
        let elastic = "elastic = { corotated = { young = 1e5, poisson = 0.3 } }";
        let text = changed(PIN, &format!("[]\n{elastic}\nmuscle = [{{ {muscle} }}]"));
        let error = error(&text);
        let [problem] = error.problems() else { panic!("{muscle}: {error}") };
        assert_eq!(format!("{}: {}", problem.path, problem.message), expected, "{muscle}");
        assert_eq!(&text[problem.span.clone().unwrap()], underlined, "{muscle}");
    };
    let along = "fibre = { direction = [1, 0] }";
    case(
        "fibre = { direction = [1, 0, 0] }, tension = 1",
        "[1, 0, 0]",
        "body.0.muscle.0.fibre.direction: `direction` has 3 numbers, but `dimension` is 2: 2 are needed",
    );
    case(
        "fibre = { direction = [0, 0] }, tension = 1",
        "[0, 0]",
        "body.0.muscle.0.fibre.direction: `direction` is zero: it needs a direction",
    );
    case(
        "fibre = { direction = ['X', 't'] }, tension = 1",
        "'t'",
        "body.0.muscle.0.fibre.direction.1: this changes with time, and the direction is one of the body at \
         rest",
    );
    case(
        "fibre = { per_element = [[1, 0], [0, 0]] }, tension = 1",
        "[0, 0]",
        "body.0.muscle.0.fibre.per_element.1: `per_element` is zero: it needs a direction",
    );
    case(
        &format!("{along}, tension = '3 N'"),
        "'3 N'",
        "body.0.muscle.0.tension: `tension`: `3 N` is a force [N], not a pressure [Pa]",
    );
    case(
        &format!("{along}, tension = '1/t'"),
        "'1/t'",
        "body.0.muscle.0.tension: `tension` is inf [Pa] at t = 0.0 s",
    );
    let failed = error(&changed(PIN, &format!("[]\nmuscle = [{{ {along}, tension = 1 }}]")));
    let message = "17:1 body.0.muscle: `muscle` is in finite elements, and this body has no `elastic`";
    assert_eq!(briefly(&failed), [message]);
}

/// Mistakes that only show once the vertices are known.
#[test]
fn a_coordinate_that_moves_is_held_by_one_pin_only() {
    let problems = |pin: &str| {
        let assembled = read(&changed(PIN, pin)).unwrap().assemble(crate::assembly::UnstableStep::Accept);
        assembled
            .err()
            .into_iter()
            .flatten()
            .map(|p| format!("{}: {}", p.path, p.message))
            .collect::<Vec<_>>()
    };
    let moving = "motion = { velocity = [1, 0] }";
    let none: [&str; 0] = [];
    assert_eq!(problems("[{ vertices = [0, 1] }, { vertices = [1, 2], until = 0.5 }]"), none);
    assert_eq!(problems(&format!("[{{ vertices = [0] }}, {{ vertices = [1], {moving} }}]")), none);
    assert_eq!(
        problems(&format!("[{{ vertices = [0, 1], {moving} }}, {{ vertices = [1, 2], axes = ['y'] }}]")),
        ["body.0.pin.1: `pin0` and `pin1` both pin the y of vertex 1, and one of them moves it"]
    );
}

#[test]
fn motion() {
    check(&[
        (
            PIN,
            "[{ box = { min = [0.0], max = [0.0, 1.0] } }]",
            &["16:24 body.0.pin.0.box.min: `min` has 1 number, but `dimension` is 2: 2 are needed"],
        ),
        (
            PIN,
            "[{ box = { min = [0.0, 2.0], max = [0.0, 1.0] } }]",
            &["16:30 body.0.pin.0.box.min.1: `min` must not exceed `max`, got 2.0 and 1.0 [m]: the box is \
                 empty"],
        ),
        (
            PIN,
            "[{ box = { min = [0.0, nan], max = [0.0, 1.0] } }]",
            &["16:30 body.0.pin.0.box.min.1: `min` must be a number or infinite, got NaN [m]"],
        ),
        (
            PIN,
            "[{ half_space = { normal = [0.0, 0.0], offset = 0 } }]",
            &["16:34 body.0.pin.0.half_space.normal: `normal` is zero: it needs a direction"],
        ),
        (
            PIN,
            "[{ vertices = [] }]",
            &["16:21 body.0.pin.0.vertices: `vertices` is empty: it selects nothing"],
        ),
        (
            PIN,
            "[{ vertices = [0, 11, 12] }]",
            &["16:29 body.0.pin.0.vertices.2: there is no vertex 12: the body has 12"],
        ),
        (PIN, "[{ group = '' }]", &["16:18 body.0.pin.0.group: `group` is empty: name a group of the mesh"]),
        (PIN, "[]\nvelocity = 'rigid'", &["17:12 body.0.velocity.rigid: `rigid` says nothing"]),
        (
            PIN,
            "[]\nvelocity = { rigid = { linear = [1] } }",
            &["17:33 body.0.velocity.rigid.linear: `linear` has 1 number, but `dimension` is 2: 2 are \
                 needed"],
        ),
        (
            PIN,
            "[]\nvelocity = { rigid = { angular = [1, 2, 3] } }",
            &["17:34 body.0.velocity.rigid.angular: `angular` takes one number in 2D, counter-clockwise \
                 positive, got 3"],
        ),
        (
            PIN,
            "[]\nvelocity = { rigid = { angular = nan } }",
            &["17:34 body.0.velocity.rigid.angular: `angular` must be finite, got NaN [rad/s]"],
        ),
        (
            PIN,
            "[]\nvelocity = { per_vertex = [[1, 2]] }",
            &["17:27 body.0.velocity.per_vertex: `per_vertex` lists 1 velocities, but the body has 12 \
                 vertices"],
        ),
        (
            PIN,
            "[]\nvelocity = { tangential = { speed = nan, centre = [0] } }",
            &[
                "17:37 body.0.velocity.tangential.speed: `speed` must be finite, got NaN [m/s]",
                "17:51 body.0.velocity.tangential.centre: `centre` has 1 number, but `dimension` is 2: 2 \
                 are needed",
            ],
        ),
    ]);
}

/// The material knows what its parameters may be; the scene knows where they stand.
#[test]
fn materials() {
    let elastic = |young: &str, poisson: &str| {
        changed(
            &format!("springs = {SPRINGS}"),
            &format!("elastic = {{ corotated = {{ young = {young}, poisson = {poisson} }} }}"),
        )
    };
    assert!(read(&elastic("1e5", "0.3")).is_ok());
    let failed = error(&elastic("1e5", "0.5"));
    assert_eq!(
        briefly(&failed),
        ["14:50 body.0.elastic.corotated.poisson: `poisson` = 0.5: makes the bulk modulus infinite"]
    );
    assert_eq!(failed.problems()[0].help, ["use at most 0.4999, or 0.45 for rubber"]);
    assert_eq!(
        briefly(&error(&elastic("0", "0.3"))),
        ["14:35 body.0.elastic.corotated.young: `young` = 0.0: must be positive [Pa]"]
    );
    assert_eq!(
        briefly(&error(&changed(&format!("springs = {SPRINGS}"), "elastic = \"corotated\""))),
        ["14:11 body.0.elastic.corotated.young: missing field `young` in `corotated`"]
    );
    let rubber = "elastic = { ogden = { poisson = 0.45, mu = [1e5, 2e3], alpha = [2.0, 0.0] } }";
    assert_eq!(
        briefly(&error(&changed(&format!("springs = {SPRINGS}"), rubber))),
        ["14:70 body.0.elastic.ogden.alpha.1: `alpha` = 0.0: must be a finite number that is not zero"]
    );
    let sheet = "elastic = { linear = { young = 1e5, poisson = 0.3, plane = \"stress\" } }";
    let sheet = changed(&format!("springs = {SPRINGS}"), sheet);
    assert!(read(&sheet).is_ok());
    let mistyped = error(&sheet.replace("\"stress\"", "\"stres\""));
    assert_eq!(mistyped.problems()[0].help[0], "did you mean `stress`?");
}

#[test]
fn damping_and_bending() {
    const SPRINGS: &str = "springs = { stiffness = 100.0 }";
    let with = |line: &str| format!("{SPRINGS}\n{line}");
    for (line, expected) in [
        ("damping = {}", &["15:1 body.0.damping: `damping` names no kind of damping"][..]),
        (
            "damping = { dashpot = -1.0 }",
            &["15:23 body.0.damping.dashpot: `dashpot` must be 0 or more, and finite, got -1.0 [N s/m]"],
        ),
        (
            "damping = { expression = { dissipation = 'c*rate', parameters = { c = 2.0 } } }",
            &["15:42 body.0.damping.expression.dissipation: `dissipation` is 2.0 N as the force, which \
                 must be 0, at rate = 0.0 m/s, l = l0 = 1.0 m"],
        ),
        (
            "damping = { expression = { dissipation = 'rate^2', parameters = { c = 2.0 } } }",
            &["15:71 body.0.damping.expression.parameters.c: `c` is not in the formula: remove it, or use \
                 it there"],
        ),
        (
            "damping = { strain_rate = { shear = 1.0 } }",
            &["15:13 body.0.damping.strain_rate: `strain_rate` damps finite elements, and this body does \
                 not have `elastic`"],
        ),
        (
            "bending = { young = 1e6 }",
            &["15:1 body.0.bending: `bending` takes either `stiffness`, or `young` [Pa] and `thickness` [m]"],
        ),
        (
            "bending = { stiffness = 1.0, rest = { angle = 4.0 } }",
            &["15:47 body.0.bending.rest.angle: a rest angle must be between -pi and pi, got 4.0 [rad]"],
        ),
        (
            "bending = { young = 1e6, thickness = 0.1, poisson = 0.7 }",
            &["15:53 body.0.bending.poisson: `poisson` must be above -1 and at most 0.5, got 0.7"],
        ),
    ] {
        let failed = error(&changed(SPRINGS, &with(line)));
        assert_eq!(briefly(&failed), *expected, "{line}");
    }
}

// What only the mesh shows: a plane has no hinges.
#[test]
fn bending_of_what_cannot_bend() {
    const SPRINGS: &str = "springs = { stiffness = 100.0 }";
    let scene = read(&changed(SPRINGS, &format!("{SPRINGS}\nbending = {{ stiffness = 1.0 }}"))).unwrap();
    let problems = scene.assemble(crate::assembly::UnstableStep::Accept).err().unwrap();
    assert!(problems[0].message.starts_with("`bending` acts between two triangles"), "{problems:?}");
}

/// Only finite elements have an order, and it is 1 or 2.
#[test]
fn orders() {
    let springs = format!("springs = {SPRINGS}");
    let elastic = "elastic = { corotated = { young = 1e5, poisson = 0.3 } }";
    assert!(read(&changed(&springs, &format!("{elastic}\norder = 1"))).is_ok());
    let quadratic = read(&changed(&springs, &format!("{elastic}\norder = 2"))).unwrap();
    assert!(quadratic.body[0].is_quadratic());
    let table = [
        (format!("{elastic}\norder = 3"), "15:9 body.0.order: `order` must be 1 or 2, got 3"),
        (
            format!("{springs}\norder = 2"),
            "15:9 body.0.order: `order` is that of finite elements: it needs `elastic`, which this body \
             does not have",
        ),
        (
            format!("{elastic}\n{springs}\norder = 2"),
            "16:9 body.0.order: `springs` connect corners and do not support mid-edge nodes: a body of \
             `order` 2 cannot have them",
        ),
    ];
    for (text, expected) in table {
        assert_eq!(briefly(&error(&changed(&springs, &text))), [expected]);
    }
    let damped =
        format!("{elastic}\norder = 2\ndamping = {{ strain_rate = {{ shear = 1.0, second = 0.0 }} }}");
    assert!(read(&changed(&springs, &damped)).is_ok());
}

/// Sheets of finite elements: what they are made of, and where.
#[test]
fn membranes() {
    let cloth = "mesh = { cloth = { cells = [2, 2], origin = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0] } }";
    let grid = "mesh = { grid = { cells = [2, 2, 2], spacing = 0.1 } }";
    let stvk = "elastic = { stvk = { young = 1e5, poisson = 0.3 } }";
    let membrane = "membrane = { thickness = 1e-3 }";
    let scene = |lines: &[&str]| {
        let lines = lines.join("\n");
        format!(
            "dimension = 3\ntime = {{ integrator = 'rk4', step = 1e-6, duration = 1 \
             }}\n[[body]]\n{lines}\nmass = {{ density = 1 }}\n"
        )
    };
    assert!(read(&scene(&[cloth, stvk, membrane])).is_ok());
    let bending = "bending = { stiffness = 1 }";
    assert!(read(&scene(&[cloth, stvk, membrane, bending])).is_ok());
    let help = error(&scene(&[cloth, stvk])).problems()[0].help.join("; ");
    assert!(
        help.contains("add `membrane = { thickness = \"1 mm\" }`") && help.contains("`springs`"),
        "{help}"
    );
    let table: [(&[&str], &str); 8] = [
        (
            &[cloth, stvk, "membrane = { thickness = 0 }"],
            "6:26 body.0.membrane.thickness: `thickness` must be positive and finite, got 0.0 [m]",
        ),
        (
            &[cloth, stvk, "membrane = { thickness = '1 kg' }"],
            "6:26 body.0.membrane.thickness: `thickness`: `1 kg` is a mass [kg], not a length [m]",
        ),
        (
            &[cloth, "springs = { stiffness = 1 }", membrane],
            "6:1 body.0.membrane: `membrane` needs `elastic`, which this body does not have",
        ),
        (
            &[cloth, "elastic = { linear = { young = 1e5, poisson = 0.3 } }", membrane],
            "5:13 body.0.elastic.linear: `linear` depends on the rotation of an element, but triangles of \
             a membrane have no reference direction",
        ),
        (
            &[cloth, "elastic = { dirichlet = { stiffness = 1e5 } }", membrane],
            "6:1 body.0.membrane: `dirichlet` has no rest shape: nothing keeps a sheet of it from becoming \
             infinitely thin",
        ),
        (
            &[cloth, stvk, membrane, "order = 2"],
            "7:1 body.0.order: elements of a `membrane` are linear, and this body is of `order` 2",
        ),
        (
            &[cloth, stvk, membrane, "muscle = [{ fibre = { direction = [1, 0, 0] }, tension = 1 }]"],
            "7:1 body.0.muscle: `muscle` is for solids: triangles of a `membrane` have no reference \
             direction",
        ),
        (
            &[grid, stvk, membrane],
            "6:1 body.0.membrane: `membrane` is made of triangles in 3D, and this grid has none of its own",
        ),
    ];
    for (lines, expected) in table {
        let failed = error(&scene(lines));
        assert!(briefly(&failed).contains(&expected.to_owned()), "{expected}:\n{:?}", briefly(&failed));
    }
    let flat = "elastic = { corotated = { young = 1e5, poisson = 0.3 } }\nmembrane = { thickness = 1e-3 }";
    let failed = error(&changed(&format!("springs = {SPRINGS}"), flat));
    let message = "15:1 body.0.membrane: `membrane` is for sheets in three dimensions, and `dimension` is 2";
    assert_eq!(briefly(&failed), [message]);
}

/// Attachments and their targets.
#[test]
fn attachments() {
    let scene = |line: &str| {
        let body = |name: &str, x: f64| {
            format!(
                "[[body]]\nname = '{name}'\nmesh = {{ grid = {{ cells = [2, 2], spacing = 0.1, origin = \
                 [{x:?}, 0] }} }}\n\
                 elastic = {{ corotated = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n"
            )
        };
        format!(
            "dimension = 2\ntime = {{ integrator = 'rk4', step = 1e-6, duration = 1 }}\nattachment = [{{ \
             {line} }}]\n"
        ) + &body("a", 0.0)
            + &body("b", 0.2)
    };
    let side = "body = 'a', half_space = { normal = [-1, 0], offset = -0.2 }, stiffness = 10";
    let assembled = |line: &str| {
        let scene = read(&scene(line)).map_err(|e| briefly(&e).join("; "))?;
        let assembly = scene.assemble(crate::assembly::UnstableStep::Accept);
        assembly.map(|a| a.report.uses.join("; ")).map_err(|p| format!("{}: {}", p[0].path, p[0].message))
    };
    let uses = assembled(&format!("{side}, target = {{ body = 'b', nearest_vertex = 0 }}")).unwrap();
    assert!(uses.contains("`attachment0`: 3 vertices of `a` to `b`, 10 N/m each"), "{uses}");
    let total = side.replace("stiffness", "dashpot = '1 N s/m', total_stiffness")
        + ", points = [[0, 0], [1, 0], [2, 0]]";
    let uses = assembled(&total).unwrap();
    assert!(
        uses.contains("3 vertices of `a` to given points, 3.333333")
            && uses.contains("damping of attachment"),
        "{uses}"
    );
    for (line, expected) in [
        (
            "vertices = [0], stiffness = 1".to_owned(),
            "3:15 attachment.0: there are several bodies, and this names none",
        ),
        (
            "body = 'c', vertices = [0], stiffness = 1".to_owned(),
            "3:24 attachment.0.body: there is no body \"c\"",
        ),
        (
            "body = 'a', vertices = [0]".to_owned(),
            "3:15 attachment.0: an attachment takes exactly one of `stiffness` [N/m], of each tie, and \
             `total_stiffness` [N/m]",
        ),
        ("body = 'a', stiffness = 1".to_owned(), "3:15 attachment.0: this does not select vertices"),
        (
            format!("{side}, target = {{ body = 'a', nearest_vertex = 1 }}"),
            "attachment.0.target.body: `target` must be a different body: here each vertex is nearest to \
             itself",
        ),
        (
            format!("{side}, target = {{ body = 'b' }}"),
            "attachment.0.target: a `target` takes exactly one of `vertices`, `nearest_vertex` and \
             `nearest_point`",
        ),
        (format!("{side}, points = [[0, 0]]"), "attachment.0.points: `points` lists 1 point for 3 vertices"),
        (
            format!("{side}, target = {{ body = 'b', vertices = [0, 1, 9] }}"),
            "attachment.0.target.vertices: `b` has no vertex 9: it has 9, from 0",
        ),
        (
            format!("{side}, target = {{ body = 'a', vertices = [8, 7, 6] }}"),
            "attachment.0.target.vertices: vertex 7 of `a` is tied to itself",
        ),
        (
            "body = 'a', vertices = [0, 8], stiffness = 1, target = { body = 'b', nearest_point = '1 mm' }"
                .to_owned(),
            "attachment.0.target.nearest_point: vertex 0 of `a`, at [0.0, 0.0] at rest, is 0.2 m away from \
             the nearest point of `b`, more than 0.001 m",
        ),
    ] {
        let message = assembled(&line).unwrap_err();
        assert!(message.contains(expected), "{line}:\n{message}\n{expected}");
    }
}

#[test]
fn retries_of_steps() {
    let text = |steps: &str, solver: &str| {
        changed("step = 1e-3", &format!("{steps}\nsolver = {{ {solver} }}"))
            .replace("symplectic-euler", "tr-bdf2")
    };
    assert!(read(&text("step = 1e-3", "retries = 20")).is_ok());
    assert!(read(&text("adaptive = {}", "retries = 0")).is_ok());
    for (steps, solver, expected) in [
        ("step = 1e-3", "retries = 21", "6:22 time.solver.retries: `retries` must be 0 to 20, got 21"),
        ("adaptive = {}", "retries = 3", "6:12 time.solver.retries: `retries` are for steps of a fixed size"),
    ] {
        assert_eq!(briefly(&error(&text(steps, solver))), [expected], "{steps} {solver}");
    }
    let failed = error(&changed("step = 1e-3", "step = 1e-3\nsolver = { retries = 2 }"));
    assert_eq!(briefly(&failed), ["6:10 time.solver: `solver` has no effect: symplectic-euler is explicit"]);
}

#[test]
fn adaptive_steps() {
    let steps = |text: &str| changed("step = 1e-3", text).replace("symplectic-euler", "dormand-prince5");
    for (text, expected) in [
        ("step = 1e-3\nadaptive = {}", "5:1 time.step: `step` and `adaptive` are both given"),
        (
            "adaptive = { tolerance = 1.0 }",
            "5:26 time.adaptive.tolerance: `tolerance` must be at least 1e-14 and below 1, got 1.0",
        ),
        (
            "adaptive = { tolerance = 1e-15 }",
            "5:26 time.adaptive.tolerance: `tolerance` must be at least 1e-14 and below 1, got 1e-15",
        ),
        (
            "adaptive = { tolerance = nan }",
            "5:26 time.adaptive.tolerance: `tolerance` must be at least 1e-14 and below 1, got NaN",
        ),
        (
            "adaptive = { position = 0.0 }",
            "5:25 time.adaptive.position: `position` must be positive and finite, got 0.0 [m]",
        ),
        (
            "adaptive = { velocity = -1.0 }",
            "5:25 time.adaptive.velocity: `velocity` must be positive and finite, got -1.0 [m/s]",
        ),
        (
            "adaptive = { smallest = '1 ms', largest = 1e-4 }",
            "5:25 time.adaptive.smallest: `smallest` is 0.001 [s], more than `largest`, 0.0001 [s]",
        ),
        (
            "adaptive = { first = '1 s', largest = '0.5 s' }",
            "5:22 time.adaptive.first: `first` is 1.0 [s], more than `largest`, 0.5 [s]",
        ),
    ] {
        assert_eq!(briefly(&error(&steps(text))), [expected], "{text}");
    }
    assert!(read(&steps("adaptive = { tolerance = 1e-8, first = '1 us' }")).is_ok());

    let failed = error(&changed("step = 1e-3", "adaptive = {}"));
    assert_eq!(
        briefly(&failed),
        ["5:1 time.adaptive: symplectic-euler does not estimate its error, and its steps cannot follow it"]
    );
    assert!(failed.problems()[0].help[0].contains("dormand-prince5"), "{:?}", failed.problems()[0].help);
}
