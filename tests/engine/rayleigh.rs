//! Damping in proportion to the stiffness.

/// `i`-th number of a sequence without pattern in (-1, 1).
fn number(i: usize) -> f64 {
    2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
}

fn scattered(count: usize, seed: usize) -> Vec<f64> {
    (0..count).map(|i| number(i + 1000 * seed)).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `C p` and `K p` of a scene, stretched and bent by 20 %.
fn damping_and_stiffness(dimension: usize, order: &str, material: &str, beta: f64) -> [Vec<f64>; 2] {
    let (cells, size) =
        if dimension == 2 { ("[3, 2]", "[1.0, 0.4]") } else { ("[2, 2, 1]", "[1.0, 0.4, 0.3]") };
    let text = format!(
        "dimension = {dimension}\ntime = {{ integrator = 'rk4', step = 1e-5, duration = 1.0, allow_unstable \
         = true }}\n\
         [[body]]\nmesh = {{ grid = {{ cells = {cells}, size = {size}{order}\nelastic = {{ {material} }}\n\
         mass = {{ density = 100.0 }}\ndamping = {{ stiffness_proportional = {beta:?} }}\n"
    );
    let scene = pliant_scene::Scene::from_toml(&text).unwrap();
    let mut simulation = scene.assemble(pliant_scene::assembly::UnstableStep::Accept).unwrap().simulation;
    let rest = simulation.state().x().to_vec();
    let x: Vec<f64> = rest.iter().enumerate().map(|(i, x)| 1.2 * x + 0.05 * number(i)).collect();
    let (v, p) = (scattered(x.len(), 4), scattered(x.len(), 5));
    let system = simulation.system_mut();
    let (mut c, mut k) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    system.damping_product(&x, &v, &p, &mut c);
    system.hessian_product(&x, &p, &mut k);
    // The force and its power are those of the same matrix.
    let mut force = vec![0.0; x.len()];
    system.dissipative_force(&x, &p, &mut force);
    assert_eq!(force, c);
    assert!((system.dissipated_power(&x, &p) / dot(&c, &p) - 1.0).abs() < 1e-13);
    [c, k]
}

// Rayleigh's C = beta K, wherever the vertices are: the stiffness of `linear` is constant. Elements of both
// orders have both viscosities right.
#[test]
fn damping_in_proportion_to_a_constant_stiffness_is_constant() {
    for (dimension, plane) in [(2, ""), (2, ", plane = 'stress'"), (3, "")] {
        let whole = if dimension == 2 { "quadrilateral" } else { "hexahedron" };
        for order in [" } }", " } }\norder = 2", &format!(", element = '{whole}' }} }}")] {
            let (beta, young) = (0.02, 1e4);
            let material = format!("linear = {{ young = {young:?}, poisson = 0.3{plane} }}");
            let [c, k] = damping_and_stiffness(dimension, order, &material, beta);
            let largest = k.iter().fold(0.0, |m: f64, k| m.max(k.abs()));
            for (c, k) in c.iter().zip(&k) {
                let error = (c - beta * k).abs();
                assert!(error < 1e-13 * beta * largest, "{dimension}D, order {order}: {c} and {}", beta * k);
            }
        }
    }
}
