//! Whole runs with contact: a cloth on a ball, two colliding bars, a stack of cubes, a bunny on a floor; and
//! a run with contact enabled in which nothing touches.

use std::time::{Duration, Instant};

use super::contact_share::ContactClock;
use super::stepping::{SavedState, assemble};
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, Workload, goal};
use pliant::simulation::Simulation;
use pliant_scene::Scene;

pub(super) const CLOTH: BenchmarkRow = BenchmarkRow {
    name: "contact-cloth",
    summary: "the first 40 steps of 0.01 s of a membrane of 64 x 64 cells that falls on a ball, with \
              friction",
    cases: |threads| cases(threads, 12_675, "unknowns", 40, 660.0, cloth),
};

pub(super) const BARS: BenchmarkRow = BenchmarkRow {
    name: "contact-bars",
    summary: "the first 100 steps of 2 ms of two bars of 12,288 tetrahedra each that collide at right angles",
    cases: |threads| {
        let mut cases = cases(threads, 24_576, "tets", 100, f64::NAN, bars);
        let part = |name: &'static str, contact: &'static str| {
            let text = bars().replace(CONTACT_OF_BARS, contact);
            BenchmarkPart::new(name, threads.unwrap_or(1), move || {
                FirstSteps::new(&text, 100).map(PerIteration)
            })
        };
        cases.push(BenchmarkCase {
            size: 24_576,
            items: "tets",
            case: "a Newton iteration, over one without contact".into(),
            figure: Metric::Slowdown,
            parts: vec![part("with contact", CONTACT_OF_BARS), part("without", "")],
            reference: goal(1.5),
        });
        cases
    },
};

pub(super) const STACK: BenchmarkRow = BenchmarkRow {
    name: "contact-stack",
    summary: "the first 60 steps of 0.01 s of five cubes of 3,072 tetrahedra that settle on each other, \
              with friction",
    cases: |threads| cases(threads, 15_360, "tets", 60, 47.0, stack),
};

pub(super) const BUNNY: BenchmarkRow = BenchmarkRow {
    name: "contact-bunny",
    summary: "the first 100 steps of 0.01 s of a bunny of 8,061 tetrahedra that falls on a floor, with \
              friction",
    cases: |threads| cases(threads, 8_061, "tets", 100, 40.0, bunny),
};

/// Cost of contact in a scene without contacts: a ratio of at most 1.05 on any machine.
pub(super) const APART: BenchmarkRow = BenchmarkRow {
    name: "contact-apart",
    summary: "20 steps of 2 ms of two bars of 1,536 tetrahedra each that bend far apart, over the same \
              without contact",
    cases: |threads| {
        let part = |name: &'static str, contact: &'static str| {
            BenchmarkPart::new(name, threads.unwrap_or(1), move || FirstSteps::new(&apart(contact), 20))
        };
        vec![BenchmarkCase {
            size: 3_072,
            items: "tets",
            case: "20 steps".into(),
            figure: Metric::Slowdown,
            parts: vec![part("with contact", "contact = { distance = 2e-4 }"), part("without", "")],
            reference: goal(1.05),
        }]
    },
};

/// One case: milliseconds for `steps` steps, with a target of `reach` milliseconds per step, if known.
fn cases(
    threads: Option<usize>,
    size: u64,
    items: &'static str,
    steps: u32,
    reach: f64,
    text: fn() -> String,
) -> Vec<BenchmarkCase> {
    let new = move || FirstSteps::new(&text(), steps);
    vec![BenchmarkCase {
        size,
        items,
        case: format!("{steps} steps"),
        figure: Metric::Time,
        parts: vec![BenchmarkPart::new("", threads.unwrap_or(1), new)],
        reference: if reach.is_nan() { None } else { goal(reach * f64::from(steps)) },
    }]
}

/// Contact parameters of the two bars.
const CONTACT_OF_BARS: &str = "contact = { distance = 2e-4 }";

/// First steps of a run, with the time of a Newton iteration as figure.
struct PerIteration(FirstSteps);

impl Workload for PerIteration {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        self.0.time(repetitions)
    }

    fn quantity(&self, seconds: f64) -> f64 {
        seconds / self.0.iterations as f64
    }
}

/// First steps of a run, restarted for each repetition.
struct FirstSteps {
    simulation: Simulation,
    start: SavedState,
    steps: u32,
    /// Newton iterations of the last repetition.
    iterations: u64,
    /// Clock of contact, and its share of the last time.
    contact: Option<(ContactClock, f64)>,
}

impl FirstSteps {
    fn new(text: &str, steps: u32) -> Result<FirstSteps, BenchmarkError> {
        let mut simulation = assemble(&Scene::from_toml(text)?)?.simulation;
        simulation.count_losses(false);
        let start = SavedState::of(&simulation);
        let contact = ContactClock::of(&mut simulation).map(|clock| (clock, 0.0));
        Ok(FirstSteps { simulation, start, steps, iterations: 0, contact })
    }

    fn newton_iterations(&self) -> u64 {
        self.simulation.work().solver.map_or(0, |work| work.newton_iterations)
    }
}

impl Workload for FirstSteps {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let (mut elapsed, mut of_contact) = (Duration::ZERO, Duration::ZERO);
        for _ in 0..repetitions {
            self.start.restore(&mut self.simulation);
            self.contact.iter().for_each(|(clock, _)| clock.reset());
            let before = self.newton_iterations();
            let start = Instant::now();
            for _ in 0..self.steps {
                self.simulation.step()?;
            }
            elapsed += start.elapsed();
            self.iterations = self.newton_iterations() - before;
            self.contact.iter().for_each(|(clock, _)| of_contact += clock.elapsed());
        }
        if let Some((_, share)) = &mut self.contact {
            *share = of_contact.as_secs_f64() / elapsed.as_secs_f64();
        }
        Ok(elapsed)
    }

    fn share_of_contact(&self) -> Option<f64> {
        self.contact.as_ref().map(|(_, share)| *share)
    }
}

/// Newton tolerance [m], that of the program for comparison.
const SOLVER: &str = "solver = { tolerance = 1e-5 }";

fn cloth() -> String {
    format!(
        "dimension = 3
        time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0, {SOLVER} }}
        world = {{ gravity = [0, 0, -9.81] }}
        contact = {{ distance = 1e-3, friction = 0.3 }}
        [[body]]
        mesh = {{ cloth = {{ cells = [64, 64], origin = [-0.5, -0.5, 0.31], u = [1, 0, 0], v = [0, 1, 0] }} }}
        elastic = {{ stable-neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
        membrane = {{ thickness = 1e-3 }}
        bending = {{ stiffness = 1e-5 }}
        mass = {{ density = '0.2 kg/m^2' }}
        [[obstacle]]
        shape = {{ ball = {{ centre = [0, 0, 0], radius = 0.3 }} }}"
    )
}

fn bars() -> String {
    let bar = |cells: &str, size: &str, origin: &str, speed: f64| {
        format!(
            "[[body]]
            mesh = {{ grid = {{ cells = {cells}, size = {size}, origin = {origin} }} }}
            elastic = {{ neo-hookean = {{ young = 5e5, poisson = 0.4 }} }}
            mass = {{ density = 1000 }}
            velocity = {{ rigid = {{ linear = [0, 0, {speed}] }} }}
            "
        )
    };
    format!(
        "dimension = 3
        time = {{ integrator = 'implicit-euler', step = 2e-3, duration = 1.0, {SOLVER} }}
        {CONTACT_OF_BARS}
        {}{}",
        bar("[32, 8, 8]", "[0.4, 0.1, 0.1]", "[-0.2, -0.05, 0.0004]", -1.0),
        bar("[8, 32, 8]", "[0.1, 0.4, 0.1]", "[-0.05, -0.2, -0.1]", 1.0),
    )
}

fn stack() -> String {
    let cube = |k: u32| {
        let (x, y) = (0.01 * f64::from(k % 2), 0.007 * f64::from(k % 3));
        let z = 1e-3 + 0.201 * f64::from(k);
        format!(
            "[[body]]
            mesh = {{ grid = {{ cells = [8, 8, 8], size = [0.2, 0.2, 0.2], origin = [{x}, {y}, {z}] }} }}
            elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
            mass = {{ density = 1000 }}
            "
        )
    };
    let cubes: String = (0..5).map(cube).collect();
    format!(
        "dimension = 3
        time = {{ integrator = 'implicit-euler', step = 0.01, duration = 2.0, {SOLVER} }}
        world = {{ gravity = [0, 0, -9.81] }}
        contact = {{ distance = 1e-3, friction = 0.5 }}
        {cubes}
        [[obstacle]]
        shape = {{ half_space = {{ normal = [0, 0, 1], offset = 0 }} }}"
    )
}

/// The mesh of `scenes/bunny_drop.toml`, in the format of Gmsh 2.2: a link to it within the crate.
const MESH: &str = include_str!("../../scenes/bunny.msh");

/// Lines of a section of [`MESH`], after the line with their count.
fn section(name: &str) -> impl Iterator<Item = &'static str> {
    let lines = MESH.lines().skip_while(move |line| *line != name).skip(2);
    lines.take_while(|line| !line.starts_with('$'))
}

/// Points and tetrahedra of [`MESH`] in a scene's notation: a row needs no files next to the program.
fn inline_mesh() -> String {
    let points: Vec<String> = section("$Nodes")
        .map(|line| format!("[{}]", line.split(' ').skip(1).collect::<Vec<_>>().join(", ")))
        .collect();
    // Number, kind, number of tags, tags, then the four corners, numbered from 1.
    let tetrahedra: Vec<Vec<u32>> = section("$Elements")
        .map(|line| {
            let numbers: Vec<u32> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
            numbers[numbers.len() - 4..].iter().map(|vertex| vertex - 1).collect()
        })
        .collect();
    format!("inline = {{ points = [{}], tetrahedra = {tetrahedra:?} }}", points.join(", "))
}

/// Bunny 5 cm above a floor. After a second the mean height of its vertices is 0.1079 m, by volume 0.1009
/// m. Half the step and a Newton tolerance of 1e-9 m change this by the remaining wobble (0.1084 m,
/// 0.1079 m). After four seconds it rests at 0.1075 m. Linear elasticity with a unilateral floor (scipy),
/// without the gap of 0.5 mm, gives 0.1070 m at rest.
fn bunny() -> String {
    format!(
        "dimension = 3
        time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0, {SOLVER} }}
        world = {{ gravity = [0, 0, -9.81] }}
        contact = {{ friction = 0.5 }}
        [[body]]
        mesh = {{ {} }}
        elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.4 }} }}
        mass = {{ density = 1000 }}
        [[obstacle]]
        shape = {{ half_space = {{ normal = [0, 0, 1], offset = -0.05 }} }}",
        inline_mesh()
    )
}

/// Two bars a tenth of a metre apart, each fixed at one end, bending under their weight.
fn apart(contact: &str) -> String {
    let bar = |z: f64| {
        format!(
            "[[body]]
            mesh = {{ grid = {{ cells = [16, 4, 4], size = [0.4, 0.1, 0.1], origin = [0, 0, {z}] }} }}
            elastic = {{ neo-hookean = {{ young = 5e5, poisson = 0.4 }} }}
            mass = {{ density = 1000 }}
            pin = [{{ half_space = {{ normal = [1, 0, 0], offset = 0 }} }}]
            "
        )
    };
    format!(
        "dimension = 3
        time = {{ integrator = 'implicit-euler', step = 2e-3, duration = 1.0, {SOLVER} }}
        world = {{ gravity = [0, 0, -9.81] }}
        {contact}
        {}{}",
        bar(0.0),
        bar(0.2)
    )
}

#[cfg(test)]
mod tests {
    use super::super::Workload;

    /// The scenes are valid, and bodies start apart.
    #[test]
    fn bodies_of_contact_start_apart() {
        for text in
            [super::cloth(), super::bars(), super::stack(), super::bunny(), super::apart("contact = {}")]
        {
            super::FirstSteps::new(&text, 1).unwrap();
        }
    }

    #[test]
    fn the_bunny_has_its_vertices_and_its_volume() {
        let mesh = super::FirstSteps::new(&super::bunny(), 1).unwrap().simulation;
        // The additional vertex is the floor's, without mass.
        assert_eq!(mesh.system().mass().len(), 2_353 + 1);
        let volume = mesh.system().mass().iter().sum::<f64>() / 1000.0;
        assert!((volume - 5.818e-3).abs() < 1e-6, "{volume} m^3");
    }

    /// Contact takes a share of a step's time, zero without contact; its clock changes no bit.
    #[test]
    fn the_share_of_contact_is_measured_and_changes_nothing() {
        let share = |text: &str| {
            let mut run = super::FirstSteps::new(text, 2).unwrap();
            run.time(1).unwrap();
            (run.share_of_contact(), run.simulation.state().x().to_vec())
        };
        let (resting, x) = share(&super::stack());
        assert!(resting.unwrap() > 0.0);
        assert_eq!(share(&super::apart("")).0, None);
        let mut untimed = super::assemble(&super::Scene::from_toml(&super::stack()).unwrap()).unwrap();
        (0..2).for_each(|_| untimed.simulation.step().unwrap());
        assert_eq!(untimed.simulation.state().x(), x);
    }

    /// The bars never touch, as the ratio requires.
    #[test]
    fn bars_far_apart_never_touch() {
        let mut run = super::FirstSteps::new(&super::apart("contact = {}"), 20).unwrap();
        for _ in 0..20 {
            run.simulation.step().unwrap();
            assert!(run.simulation.contacts().is_empty());
        }
    }
}
