//! Axes of materials in scenes: fibres by element and by body, mistakes that show once the mesh is there.

use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError};

/// A block of fibres that is stretched and let go, its material of these fibres, with these axes; of
/// simplices of an order, of other cells where that is 0.
fn block((dimension, order): (usize, u32), fibres: &str, axes: &str) -> Scene {
    let element = match (order, dimension) {
        (0, 2) => ", element = \"quadrilateral\" } }".to_owned(),
        (0, _) => ", element = \"hexahedron\" } }".to_owned(),
        _ => format!(" }} }}\norder = {order}"),
    };
    let (cells, size) = (&[3, 2, 1][..dimension], &[0.3, 0.2, 0.2][..dimension]);
    let start = match dimension {
        2 => "[[1.2, 0.1], [-0.1, 1.1]]",
        _ => "[[1.2, 0.1, 0], [-0.1, 1.1, 0.1], [0.1, 0, 0.9]]",
    };
    let text = format!(
        "dimension = {dimension}
         time = {{ integrator = \"velocity-verlet\", step = 1e-4, duration = 1.0 }}
         [[body]]
         mesh = {{ grid = {{ cells = {cells:?}, size = {size:?}{element}
         mass = {{ density = 1000.0 }}
         position = {{ affine = {{ matrix = {start} }} }}
         {axes}
         [body.elastic.holzapfel-gasser-ogden]
         shear = 1e4
         bulk = 1e5
         k1 = 2e4
         k2 = 1.3
         fibres = {fibres}"
    );
    Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Positions after twenty steps [m].
fn moved(scene: &Scene) -> Vec<f64> {
    let mut simulation = scene.assemble(UnstableStep::Refuse).map_err(SceneError::new).unwrap().simulation;
    (0..20).for_each(|_| simulation.step().unwrap());
    simulation.positions().into_owned()
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |off: f64, (a, b)| off.max((a - b).abs()))
}

#[test]
fn fibres_along_turned_axes_are_those_in_the_same_directions() {
    for element in [(2, 1), (2, 2), (2, 0), (3, 1), (3, 2), (3, 0)] {
        let axes = match element.0 {
            2 => "first = { direction = [3, 4] }",
            _ => "first = { direction = [3, 4, 0] }, second = { direction = [1, 2, 0] }",
        };
        let turned = moved(&block(element, "[[1.0, 1.0]]", &format!("elastic_axes = {{ {axes} }}")));
        // (0.6, 0.8) + (-0.8, 0.6).
        let plain = moved(&block(element, "[[-0.2, 1.4]]", ""));
        assert!(off(&turned, &plain) < 1e-14, "{element:?}: {:e}", off(&turned, &plain));
        assert!(off(&turned, &moved(&block(element, "[[1.0, 1.0]]", ""))) > 1e-6, "{element:?}");
    }
}

#[test]
fn lists_and_formulas_of_axes_mean_the_same() {
    let mesh = block((2, 1), "[[1.0, 0.0]]", "").body[0].body_mesh().shape.clone();
    let mesh = pliant_mesh::build(&mesh, 2, ".".as_ref()).unwrap();
    let centre =
        |t: &[u32; 3]| [0, 1].map(|c| t.iter().map(|v| mesh.point(*v as usize)[c]).sum::<f64>() / 3.0);
    let listed: Vec<[f64; 2]> = mesh.triangles.iter().map(centre).map(|[x, y]| [-5.0 * y, 5.0 * x]).collect();
    let of = |first: &str| {
        moved(&block((2, 1), "[[1.0, 0.0]]", &format!("elastic_axes = {{ first = {{ {first} }} }}")))
    };
    let [listed, ring] =
        [format!("per_element = {listed:?}"), "direction = ['-Y', 'X']".to_owned()].map(|a| of(&a));
    assert!(off(&listed, &ring) < 1e-14);
    assert!(off(&ring, &of("direction = [0, 1]")) > 1e-6);
}

#[test]
fn axes_that_no_element_can_have_are_mistakes() {
    let problem = |scene: &Scene| {
        let problems = scene.assemble(UnstableStep::Accept).err().unwrap();
        format!("{}: {}", problems[0].path, problems[0].message)
    };
    let of = |d: usize, axes: &str| block((d, 1), "[[1.0, 0.0]]", &format!("elastic_axes = {{ {axes} }}"));
    assert_eq!(
        problem(&of(2, "first = { per_element = [[1, 0]] }")),
        "body.0.elastic_axes.first.per_element: the list has 1 direction, the body has 12 elements"
    );
    let parallel = "first = { direction = [1, 2, 0] }, second = { direction = [-2, -4, 0] }";
    let parallel = problem(&of(3, parallel));
    assert!(
        parallel.starts_with("body.0.elastic_axes.second: axes of element 0, whose centre"),
        "{parallel}"
    );
    let cells = block((2, 0), "[[1.0, 0.0]]", "elastic_axes = { first = { per_element = [[1, 0]] } }");
    assert_eq!(
        problem(&cells),
        "body.0.elastic_axes.first.per_element: the list has 1 direction, the body has 6 elements"
    );
}
