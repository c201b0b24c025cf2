//! Shapes at rest of quadrilaterals and hexahedra: distorted and elongated ones along a direction, squares
//! and cubes, in which slopes and stiffness in bending have their kinks, by each coordinate.

use pliant_scene::Scene;

use crate::by_parameters::compare;
use crate::differences::{compare_coordinates, compare_numbers, compare_shape};
use crate::solid::{assembled, rows};
use crate::support::{scattered, scene};

/// A block of cells at rest.
#[derive(Clone, Copy)]
struct Cells {
    dimension: usize,
    /// Along each axis.
    count: [usize; 3],
    /// Size of one [m].
    size: [f64; 3],
    /// How far nodes are from the places of a grid [m].
    distortion: f64,
}

impl Cells {
    /// Places of the nodes, flat [m].
    fn nodes(&self) -> Vec<f64> {
        let d = self.dimension;
        let nodes =
            self.numbers(1).into_iter().flat_map(|at| (0..d).map(move |k| at[k] as f64 * self.size[k]));
        let nodes: Vec<f64> = nodes.collect();
        nodes.iter().zip(scattered(nodes.len(), 5.0)).map(|(x, d)| x + self.distortion * d).collect()
    }

    /// Numbers along each axis of all cells, or with one more of all nodes.
    fn numbers(&self, more: usize) -> Vec<[usize; 3]> {
        let [nx, ny, nz] = self.count.map(|count| count + more);
        let nz = if self.dimension == 2 { 1 } else { nz };
        let each = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        each.collect()
    }

    /// Nodes of each cell.
    fn cells(&self) -> String {
        let [nx, ny, _] = self.count.map(|count| count + 1);
        let of_cell = |[x, y, z]: [usize; 3]| -> Vec<usize> {
            let at = |i: usize, j: usize, k: usize| x + i + nx * (y + j + ny * (z + k));
            let layer = |k| [at(0, 0, k), at(1, 0, k), at(1, 1, k), at(0, 1, k)];
            if self.dimension == 2 { layer(0).to_vec() } else { [layer(0), layer(1)].concat() }
        };
        format!("{:?}", self.numbers(0).into_iter().map(of_cell).collect::<Vec<_>>())
    }

    /// The block with these nodes at rest, held at those of least `x`.
    fn scene(&self, scheme: &str, nodes: &[f64], further: &str) -> Scene {
        let (key, gravity) = match self.dimension {
            2 => ("quadrilaterals", "[2.7, -9.81]"),
            _ => ("hexahedra", "[2.7, -9.81, 2.0]"),
        };
        let numbers = self.numbers(1);
        let held: Vec<usize> = (0..numbers.len()).filter(|i| numbers[*i][0] == 0).collect();
        let text = format!(
            "[world]
             gravity = {gravity}
             [[body]]
             name = \"block\"
             mesh = {{ inline = {{ points = {}, {key} = {} }} }}
             pin = [{{ vertices = {held:?} }}]
             {further}",
            rows(nodes, self.dimension),
            self.cells(),
        );
        scene(scheme, self.dimension, [0.01, 1e-3], &text)
    }

    /// Compares derivatives by the shape at rest with differences along a direction, and tangents with them.
    fn compare(&self, what: &str, (scheme, steps): (&str, u64), further: &str) {
        let nodes = self.nodes();
        let direction = scattered(nodes.len(), 7.0);
        let of = |h: f64| {
            let moved: Vec<f64> = nodes.iter().zip(&direction).map(|(x, d)| x + h * d).collect();
            self.scene(scheme, &moved, further)
        };
        compare_shape(what, of, ("block", 0.02), (steps, 1e-6));
        let steps = if scheme == "quasi-static" { 1 } else { steps };
        compare(what, &of(0.0), &["body.block.rest"], steps);
    }
}

/// Distorted cells: nearly square and long, of one row and of two.
const DISTORTED: [Cells; 4] = [
    Cells { dimension: 2, count: [3, 2, 0], size: [0.2, 0.2, 0.0], distortion: 0.02 },
    Cells { dimension: 2, count: [3, 1, 0], size: [0.3, 0.12, 0.0], distortion: 0.01 },
    Cells { dimension: 3, count: [2, 2, 1], size: [0.2, 0.2, 0.2], distortion: 0.02 },
    Cells { dimension: 3, count: [2, 1, 1], size: [0.15, 0.3, 0.2], distortion: 0.015 },
];

const RUNS: [(&str, u64); 4] =
    [("velocity-verlet", 60), ("implicit-euler", 8), ("generalised-alpha", 8), ("quasi-static", 2)];

const MASS: &str = "mass = { density = 1000.0 }";

/// Cells and schemes.
fn all(cells: &[Cells]) -> impl Iterator<Item = (&Cells, (&'static str, u64))> {
    cells.iter().flat_map(|cells| RUNS.map(|run| (cells, run)))
}

fn described(cells: &Cells, (scheme, _): (&str, u64), more: &str) -> String {
    format!("{scheme}, {:?} cells of {:?}, {more}", &cells.count[..cells.dimension], cells.size)
}

/// A material of these moduli and further keys.
fn filled(material: &str, poisson: f64, more: &str) -> String {
    let moduli = if material == "dirichlet" {
        "stiffness = 4e4".to_owned()
    } else {
        format!("young = 4e4, poisson = {poisson}")
    };
    format!("elastic = {{ {material} = {{ {moduli} }} }}\n{more}")
}

#[test]
fn shapes_of_cells_have_derivatives() {
    for (cells, run) in all(&DISTORTED) {
        for (material, poisson, more) in [
            ("neo-hookean", 0.45, MASS),
            ("linear", 0.3, MASS),
            ("dirichlet", 0.0, MASS),
            ("corotated", 0.35, "mass = { total = 50.0 }"),
        ] {
            cells.compare(&described(cells, run, material), run, &filled(material, poisson, more));
        }
    }
}

#[test]
fn shapes_of_damped_cells_have_derivatives() {
    for (cells, run) in all(&DISTORTED).filter(|(_, (scheme, _))| *scheme != "quasi-static") {
        let velocity = match cells.dimension {
            2 => "velocity = { rigid = { linear = [0.5, 0.2], angular = 2.0 } }",
            _ => "velocity = { rigid = { linear = [0.5, 0.2, 0.1], angular = [0.5, 1.0, 2.0] } }",
        };
        for (material, damping) in [
            ("neo-hookean", "strain_rate = { shear = 30.0, second = 20.0 }, mass_proportional = 0.5"),
            ("neo-hookean", "stiffness_proportional = 5e-3"),
            ("linear", "strain_rate = { shear = 30.0, second = 20.0 }"),
            ("neo-hookean", "strain_rate = { shear = 0.0, second = 20.0 }"),
        ] {
            let more = filled(material, 0.4, &format!("{MASS}\ndamping = {{ {damping} }}\n{velocity}"));
            cells.compare(&described(cells, run, damping), run, &more);
        }
    }
}

/// Squares and cubes by each coordinate: of one row, which lack stiffness, and of two.
#[test]
fn shapes_of_squares_and_cubes_have_the_mean_of_the_derivatives_of_both_sides() {
    for cells in [
        Cells { dimension: 2, count: [2, 1, 0], size: [0.2, 0.2, 0.0], distortion: 0.0 },
        Cells { dimension: 2, count: [2, 2, 0], size: [0.2, 0.2, 0.0], distortion: 0.0 },
        Cells { dimension: 3, count: [2, 1, 1], size: [0.2, 0.2, 0.2], distortion: 0.0 },
        Cells { dimension: 3, count: [2, 2, 1], size: [0.2, 0.2, 0.2], distortion: 0.0 },
    ] {
        let damped =
            "mass = { density = 1000.0 }\ndamping = { strain_rate = { shear = 30.0, second = 20.0 } }";
        // Of a material with fibres stiffness that no cell lacks comes and goes with shear, too.
        let fibres = if cells.dimension == 2 { "[[1, 0.5]]" } else { "[[1, 0.5, 0.3]]" };
        let with_fibres = format!(
            "mass = {{ density = 1000.0 }}
             [body.elastic.expression]
             psi = 'mu/2*(I1 - 3) - mu*log(J) + k/2*(I4 - 1)^2'
             parameters = {{ mu = 2e4, k = 9e3 }}
             fibres = {fibres}"
        );
        for (scheme, steps, further) in [
            ("implicit-euler", 4, filled("neo-hookean", 0.3, damped)),
            ("quasi-static", 1, filled("neo-hookean", 0.3, MASS)),
            ("implicit-euler", 4, with_fibres),
        ] {
            let (nodes, what) = (cells.nodes(), described(&cells, (scheme, steps), "alike"));
            let of = |nodes: &[f64]| cells.scene(scheme, nodes, &further);
            // All of squares; of cubes every fifth.
            let some = (0..nodes.len()).filter(|i| cells.dimension == 2 || i % 5 == 1);
            compare_coordinates(&what, of, ("block", &nodes, 0.01), some, (steps, 1e-6));
            compare(&what, &of(&nodes), &["body.block.rest"], steps);
        }
    }
}

/// Loads on volumes, areas and places; muscles; axes of the material that go by the place.
#[test]
fn shapes_of_cells_with_loads_muscles_and_axes_have_derivatives() {
    let plane = "mass = { density = 1000.0 }
        load = [
            { body_force = ['2e3*X*Y', '900*sin(3*X)'] },
            { body_force = ['900*cos(30*t)', '-400 - 3e4*t'], half_space = END },
            { traction = ['900*cos(30*t) + 2e3*X*Y', -400.0], half_space = END },
            { force = ['30*X^2', '20*sin(4*X*Y)'] },
            { pressure = '600*X^2*(1 + 10*t) + 300*Y' },
        ]
        muscle = [{ fibre = { direction = [2, 1] }, tension = '3e3*(1 + sin(20*t))' }]
        elastic_axes = { first = { direction = ['cos(X + Y)', 'sin(2*X)'] } }
        [body.elastic.expression]
        psi = 'mu/2*(I1 - 3) - mu*log(J) + k/2*(I4 - 1)^2 + 2*k*E12^2'
        parameters = { mu = 2e4, k = 9e3 }
        fibres = [[1, 0.5]]";
    let space = plane
        .replace("'900*sin(3*X)']", "'900*sin(3*X)', '1e3*Z^2']")
        .replace("3e4*t']", "3e4*t', 500]")
        .replace("-400.0]", "-400.0, '600*Z']")
        .replace("'20*sin(4*X*Y)'", "'20*sin(4*X*Z)', 3.0")
        .replace("[2, 1]", "[2, 1, 0.5]")
        .replace("'sin(2*X)'] }", "'sin(2*X)', 'Z'] }, second = { direction = ['Y', 1, 'X*Z'] }");
    for (cells, run) in all(&DISTORTED) {
        let further = if cells.dimension == 2 { plane } else { &space };
        // Nodes of the last column.
        let first = cells.count[0] as f64 * cells.size[0] - 0.05;
        let normal = if cells.dimension == 2 { "[-1, 0]" } else { "[-1, 0, 0]" };
        let end = format!("{{ normal = {normal}, offset = {:?} }}", -first);
        let further = further.replace("END", &end);
        cells.compare(&described(cells, run, "loads"), run, &further);
    }
}

/// Cells whose free end falls on a wall.
#[test]
fn shapes_of_cells_that_touch_have_derivatives() {
    for cells in [DISTORTED[0], DISTORTED[2]] {
        let normal = if cells.dimension == 2 { "[0, 1]" } else { "[0, 1, 0]" };
        let more = format!(
            "{MASS}
             [contact]
             distance = 1e-3
             stiffness = 1e5
             friction = 0.3
             threshold_speed = 0.1
             [[obstacle]]
             name = \"floor\"
             shape = {{ half_space = {{ normal = {normal}, offset = -0.03 }} }}"
        );
        let further = filled("neo-hookean", 0.3, &more);
        let mut simulation = assembled(&cells.scene("implicit-euler", &cells.nodes(), &further)).0;
        (0..12).for_each(|_| simulation.step().unwrap());
        let (x, v) = (simulation.state().x(), simulation.state().v());
        let terms = simulation.system().terms().iter().filter_map(|term| term.touching());
        assert!(terms.map(|term| term.contacts(x, v).len()).sum::<usize>() > 0, "nothing touches");
        cells.compare(&described(&cells, ("", 0), "touching"), ("implicit-euler", 12), &further);
    }
}

/// Tensions and directions by the places of points and by the middles of cells.
#[test]
fn shapes_of_cells_whose_muscles_go_by_places_have_derivatives() {
    for (cells, run) in all(&DISTORTED) {
        let direction = match cells.dimension {
            2 => "['X + 0.3', 'sin(2*Y) + 0.2']",
            _ => "['X + 0.3', 'sin(2*Y) + 0.2', 'Z - X']",
        };
        let muscles = format!(
            "{MASS}
             muscle = [
                 {{ fibre = {{ direction = {direction} }}, tension = '3e3*(1 + X*Y)*(1 + sin(20*t))' }},
                 {{ fibre = {{ direction = {direction} }}, tension = 2e3 }},
             ]"
        );
        cells.compare(&described(cells, run, "muscles"), run, &filled("neo-hookean", 0.3, &muscles));
    }
}

/// Directions of any length, one for each cell.
#[test]
fn directions_of_fibres_in_each_cell_have_derivatives() {
    for cells in [DISTORTED[0], DISTORTED[3]] {
        let (d, count) = (cells.dimension, cells.numbers(0).len());
        let directions: Vec<f64> = scattered(count * d, 3.0).iter().map(|c| 1.0 + 1.5 * c).collect();
        for (scheme, steps) in RUNS {
            let of = |directions: &[f64]| {
                let muscle = format!(
                    "{MASS}
                     muscle = [{{ fibre = {{ per_element = {} }}, tension = '6e3*(1 + Y)*cos(9*t)' }}]",
                    rows(directions, d)
                );
                cells.scene(scheme, &cells.nodes(), &filled("neo-hookean", 0.3, &muscle))
            };
            let name = "body.block.muscle.0.fibre.per_element";
            compare_numbers(scheme, of, (name, &directions, &vec![1.0; count * d]), (steps, 1e-6));
            compare(scheme, &of(&directions), &[name], if scheme == "quasi-static" { 1 } else { steps });
        }
    }
}

/// All their nodes, or those of edges alone; what a scene has beside moduli.
#[test]
fn shapes_of_cells_of_second_order_have_derivatives() {
    let cells = [
        Cells { dimension: 2, count: [2, 1, 0], size: [0.2, 0.2, 0.0], distortion: 0.02 },
        Cells { dimension: 3, count: [1, 1, 1], size: [0.2, 0.2, 0.2], distortion: 0.02 },
    ];
    for (cells, run) in all(&cells) {
        for serendipity in [false, true] {
            let direction = if cells.dimension == 2 { "[2, 1]" } else { "[2, 1, 0.5]" };
            let damping = if run.0 == "quasi-static" {
                ""
            } else {
                "damping = { strain_rate = { shear = 30.0, second = 20.0 } }"
            };
            let more = format!(
                "{MASS}\n{damping}\norder = 2\nserendipity = {serendipity}\nload = [{{ pressure = 50.0 }}]\n\
                 muscle = [{{ fibre = {{ direction = {direction} }}, tension = '3e2*(1 + sin(20*t))' }}]"
            );
            let what = described(cells, run, &format!("second order, serendipity {serendipity}"));
            cells.compare(&what, run, &filled("neo-hookean", 0.35, &more));
        }
    }
}
