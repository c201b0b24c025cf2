//! Terms whose stencils change in every step: two bodies that slide along each other, by a penalty between
//! their sides.

use pliant::constraint::{Hold, Motion};
use pliant::energy::Fault;
use pliant::energy::spring::Springs;
use pliant::integrator::{IntegratorSpec, Method};
use pliant::simulation::{Simulation, StepError};
use pliant::solver::{LinearSolver, SolverOptions, SolverWork};
use pliant::state::State;
use pliant::system::System;

use crate::support::penalty::{Penalty, Rubbing};
use crate::support::{advance, largest_difference, method};

/// Distance of neighbours in the lower and in the upper body [m].
const SPACING: [f64; 2] = [0.2, 0.23];
/// Columns and rows of each body.
const SIZE: [u32; 2] = [9, 2];
/// Stiffness [N/m] and reach [m] of the penalty.
const PENALTY: [f64; 2] = [600.0, 0.2];
/// Speed of the upper body [m/s].
const SPEED: f64 = 4.0;
/// Step [s]: the bodies slide by a fifth of the distance of neighbours.
const STEP: f64 = 0.01;

/// A lattice of masses and springs `spacing` apart, its first row from `left` on along y = `bottom`.
fn lattice(
    [columns, rows]: [u32; 2],
    spacing: f64,
    [left, bottom]: [f64; 2],
    points: &mut Vec<f64>,
) -> Vec<[u32; 2]> {
    let first = points.len() as u32 / 2;
    let mut edges = vec![];
    for j in 0..rows {
        for i in 0..columns {
            let at = first + j * columns + i;
            points.extend([left + spacing * f64::from(i), bottom + spacing * f64::from(j)]);
            edges.extend((i + 1 < columns).then_some([at, at + 1]));
            edges.extend((j + 1 < rows).then_some([at, at + columns]));
            edges.extend((i + 1 < columns && j + 1 < rows).then_some([at, at + columns + 1]));
            edges.extend((i > 0 && j + 1 < rows).then_some([at, at + columns - 1]));
        }
    }
    edges
}

/// A penalty of points against segments.
type NewPenalty = fn(&[u32], &[[u32; 2]], [f64; 2]) -> Penalty;

/// Two lattices, one above the other, within the reach of the penalty.
struct Bodies {
    size: [u32; 2],
    x: Vec<f64>,
    edges: Vec<[u32; 2]>,
}

impl Bodies {
    fn new(size: [u32; 2]) -> Self {
        let mut x = vec![];
        let height = SPACING[0] * f64::from(size[1] - 1);
        let mut edges = lattice(size, SPACING[0], [0.0, -height], &mut x);
        edges.extend(lattice(size, SPACING[1], [0.07, 0.8 * PENALTY[1]], &mut x));
        Bodies { size, x, edges }
    }

    fn count(&self) -> u32 {
        self.x.len() as u32 / 2
    }

    /// The sides that face each other, each from left to right.
    fn sides(&self) -> [Vec<u32>; 2] {
        let [columns, rows] = self.size;
        let first = |body: u32| body * columns * rows;
        [((rows - 1) * columns..rows * columns).collect(), (first(1)..first(1) + columns).collect()]
    }

    /// Penalties of points of each body against segments of the other.
    fn penalties(&self, new: NewPenalty) -> [Penalty; 2] {
        let [lower, upper] = &self.sides();
        let segments = |side: &[u32]| side.windows(2).map(|ends| [ends[0], ends[1]]).collect::<Vec<_>>();
        [new(lower, &segments(upper), PENALTY), new(upper, &segments(lower), PENALTY)]
    }

    /// Candidates of the stencils at `x` that are not zero.
    fn stencils_at(&self, x: &[f64]) -> [[Vec<usize>; 2]; 2] {
        self.penalties(Penalty::changing).map(|penalty| penalty.stencils_at(x).0)
    }

    /// Springs and penalties.
    fn system(&self, new: NewPenalty) -> System {
        let count = self.count() as usize;
        let mut system = System::new(2, vec![0.1; count]);
        let far = |[a, b]: &[u32; 2]| {
            let [a, b] = [a, b].map(|v| 2 * *v as usize);
            (self.x[a] - self.x[b]).hypot(self.x[a + 1] - self.x[b + 1])
        };
        let rest: Vec<f64> = self.edges.iter().map(far).collect();
        system.add_term(Box::new(Springs::<2>::new(
            "both",
            &self.edges,
            &vec![300.0; rest.len()],
            &rest,
            count,
        )));
        for penalty in self.penalties(new) {
            system.add_term(Box::new(penalty));
        }
        system
    }

    /// The lowest row of the lower body is held, the highest one of the upper body moved along.
    fn slide(&self, new: NewPenalty, method: Method, options: SolverOptions) -> Simulation {
        self.pulled(self.system(new), method, options)
    }

    /// The same with bodies that rub.
    fn rub(&self, new: NewPenalty, method: Method, options: SolverOptions) -> Simulation {
        let mut system = self.system(new);
        for pairs in self.penalties(new) {
            system.add_dissipation(Box::new(Rubbing::new(pairs, 5.0)));
        }
        self.pulled(system, method, options)
    }

    fn pulled(&self, mut system: System, method: Method, options: SolverOptions) -> Simulation {
        let columns = self.size[0];
        system.pin(&(0..columns).collect::<Vec<u32>>());
        let motion = Motion::new().along(|t| ([SPEED * t, -0.5 * t, 0.0], [SPEED, -0.5, 0.0]));
        let top = Hold::new("top", (self.count() - columns..self.count()).collect());
        system.hold(top.moving(motion, &self.x, &self.x, 2));
        let mut v = vec![0.0; self.x.len()];
        for v in v[self.x.len() / 2..].chunks_exact_mut(2) {
            v[0] = SPEED;
        }
        let mut simulation = Simulation::new(system, State::new(self.x.clone(), v), method, STEP);
        simulation.set_solver(options);
        simulation
    }
}

fn to_rounding(linear: LinearSolver) -> SolverOptions {
    SolverOptions { tolerance: Some(1e-11), linear, ..SolverOptions::default() }
}

/// Every scheme that solves equations.
fn implicit() -> impl Iterator<Item = Method> {
    IntegratorSpec::ALL.iter().map(|spec| spec.method()).filter(|method| method.documentation.solves > 0)
}

fn work(simulation: &Simulation) -> SolverWork {
    simulation.work().solver.unwrap()
}

/// Steps of every implicit scheme with changing stencils, and with all of them from the beginning:
/// `simulation` makes either.
fn check_every_scheme(simulation: impl Fn(NewPenalty, Method, SolverOptions) -> Simulation) {
    let bodies = Bodies::new(SIZE);
    for method in implicit() {
        let name = method.documentation.name;
        let options = to_rounding(LinearSolver::Cholesky);
        let mut changing = simulation(Penalty::changing, method, options);
        let mut fixed = simulation(Penalty::with_all, method, options);
        let mut changes = 0;
        for step in 1..=8 {
            let before = bodies.stencils_at(changing.state().x());
            advance(&mut changing, 1);
            advance(&mut fixed, 1);
            changes += u32::from(bodies.stencils_at(changing.state().x()) != before);
            let difference = largest_difference(changing.state().x(), fixed.state().x());
            assert!(difference < 1e-10, "{name}, step {step}: {difference:e} m apart");
        }
        assert!(changes >= 5, "{name}: other stencils in {changes} of 8 steps");
        let [changing, fixed] = [&changing, &fixed].map(work);
        assert_eq!(changing.newton_iterations, fixed.newton_iterations, "{name}: Newton iterations");
        let analysed = 1..=changing.factorizations;
        assert!(analysed.contains(&changing.analyses) && fixed.analyses == 0, "{name}: {changing:?}");
    }
}

// A block that the matrix has no room for, or has in another place, would cost iterations: Newton's method
// would converge linearly.
#[test]
fn every_implicit_scheme_takes_the_steps_that_it_takes_with_all_stencils_from_the_beginning() {
    check_every_scheme(|new, method, options| Bodies::new(SIZE).slide(new, method, options));
}

#[test]
fn the_same_holds_for_dissipation_between_the_bodies() {
    check_every_scheme(|new, method, options| Bodies::new(SIZE).rub(new, method, options));
}

#[test]
fn every_linear_solver_finds_the_same_minimum_while_stencils_change() {
    let bodies = Bodies::new([17, 10]);
    let solvers =
        [LinearSolver::Cholesky, LinearSolver::Multigrid, LinearSolver::Cg, LinearSolver::MatrixFree];
    let run = |new: NewPenalty, linear| {
        let mut simulation = bodies.slide(new, method("implicit-euler"), to_rounding(linear));
        advance(&mut simulation, 5);
        (simulation.state().x().to_vec(), work(&simulation))
    };
    let found = solvers.map(|linear| run(Penalty::changing, linear));
    for (linear, (x, work)) in solvers.iter().zip(&found) {
        let difference = largest_difference(x, &found[0].0);
        assert!(difference < 1e-9, "{linear:?}: {difference:e} m apart");
        let (_, with_all) = run(Penalty::with_all, *linear);
        // Multigrid solves the vertices of stencils that change exactly, which it does not where it knows
        // all stencils from the beginning: loose solves of another preconditioner lead Newton's method
        // another way.
        if *linear != LinearSolver::Multigrid {
            assert_eq!(work.newton_iterations, with_all.newton_iterations, "{linear:?}: Newton iterations");
        }
        // Coarse levels of multigrid do not see stencils that change.
        let per_solve = |work: &SolverWork| work.cg_iterations as f64 / work.newton_iterations as f64;
        let (found, most) = (per_solve(work), 1.25 * per_solve(&with_all));
        assert!(found <= most, "{linear:?}: {found} iterations a solve, {most} at most");
        assert_eq!(work.fallbacks, 0, "{linear:?}");
        assert_eq!(work.factorizations == 0, *linear != LinearSolver::Cholesky, "{linear:?}");
    }
}

#[test]
fn stencils_that_change_keep_momentum() {
    let bodies = Bodies::new(SIZE);
    for name in ["implicit-euler", "tr-bdf2", "gauss2"] {
        let mut v = vec![0.0; bodies.x.len()];
        v[bodies.x.len() / 2..].chunks_exact_mut(2).for_each(|v| (v[0], v[1]) = (SPEED, -0.5));
        let state = State::new(bodies.x.clone(), v.clone());
        let mut simulation = Simulation::new(bodies.system(Penalty::changing), state, method(name), STEP);
        simulation.set_solver(to_rounding(LinearSolver::Cholesky));
        advance(&mut simulation, 10);
        let sum = |v: &[f64]| v.chunks_exact(2).fold([0.0; 2], |sum, v| [sum[0] + v[0], sum[1] + v[1]]);
        let (before, after) = (sum(&v), sum(simulation.state().v()));
        let drift = largest_difference(&before, &after);
        // Of 36 velocities, each known to the tolerance over the step.
        assert!(drift < 36.0 * 1e-11 / STEP, "{name}: {drift:e}");
        assert!(bodies.stencils_at(simulation.state().x()) != bodies.stencils_at(&bodies.x), "{name}");
    }
}

// The product goes from term to term, the matrix through stencils.
#[test]
fn the_stiffness_matrix_has_the_blocks_of_stencils_that_change() {
    let bodies = Bodies::new(SIZE);
    let options = to_rounding(LinearSolver::Cholesky);
    let mut simulation = bodies.slide(Penalty::changing, method("implicit-euler"), options);
    advance(&mut simulation, 3);
    let matrix = simulation.stiffness_matrix().unwrap();
    let x = simulation.state().x().to_vec();
    let p: Vec<f64> = (0..x.len()).map(|i| (0.7 * i as f64).sin()).collect();
    let mut exact = vec![0.0; x.len()];
    simulation.system_mut().hessian_product(&x, &p, &mut exact);
    let row = |i: usize| {
        let range = matrix.row_start[i]..matrix.row_start[i + 1];
        range.map(|at| matrix.value[at] * p[matrix.column[at]]).sum::<f64>()
    };
    let product: Vec<f64> = (0..x.len()).map(row).collect();
    assert!(largest_difference(&product, &exact) < 1e-11 * PENALTY[0]);
}

/// A particle of 1 kg at a height of 0.15 m over a held segment, on its way down.
fn falling(method: Method, speed: f64, h: f64) -> Simulation {
    let mut system = System::new(2, vec![1.0; 3]);
    system.add_term(Box::new(Penalty::changing(&[2], &[[0, 1]], [1e5, 0.1])));
    system.pin(&[0, 1]);
    let state = State::new(vec![-1.0, 0.0, 1.0, 0.0, 0.1, 0.15], vec![0.0, 0.0, 0.0, 0.0, 0.0, -speed]);
    Simulation::new(system, state, method, h)
}

/// True if a step ended because its way is not free, which it says.
fn is_refused(error: &StepError) -> bool {
    let refused = matches!(error.fault(), Some(Fault::Way { .. }));
    assert!(
        !refused || ["step 1 ", "penalty"].iter().all(|part| error.to_string().contains(part)),
        "{error}"
    );
    refused
}

// The kinetic energy of 50 J does not bring it through 500 J; but the energy behind the segment is zero, and
// without force the particle would be half a metre below. Starts of solves must not look there.
#[test]
fn no_implicit_scheme_passes_through_what_a_term_guards() {
    for method in implicit().filter(|method| !method.is_static()) {
        let (name, mut simulation) = (method.documentation.name, falling(method, 10.0, 0.05));
        match simulation.step() {
            Ok(()) => assert!(simulation.state().x()[5] > 0.0, "{name}: {}", simulation.state().x()[5]),
            Err(error) => {
                let unsolved = matches!(error, StepError::Unsolved { .. });
                assert!((is_refused(&error) || unsolved) && !method.ends_at_solution(), "{name}: {error}");
                assert_eq!(simulation.state().x()[5], 0.15, "{name} leaves the state as it was");
            }
        }
    }
}

#[test]
fn an_explicit_step_through_what_a_term_guards_is_an_error() {
    let explicit = IntegratorSpec::ALL.iter().map(|spec| spec.method());
    for method in explicit.filter(|method| method.documentation.solves == 0) {
        let (name, mut simulation) = (method.documentation.name, falling(method, 10.0, 0.05));
        let error = simulation.step().unwrap_err();
        assert!(is_refused(&error) || method.iterates(), "{name}: {error}");
        assert_eq!(simulation.state().x()[5], 0.15, "{name} leaves the state as it was");
        // Where the way is free, nothing is refused.
        advance(&mut falling(method, 10.0, 1e-4), 100);
    }
}

// Half a metre along the segment, five centimetres above it: each correction goes nine tenths of the
// distance. The tolerance would admit the first, and the end of the step is 0.5 m on, where nothing acts
// along the segment.
#[test]
fn a_solve_does_not_end_where_its_way_was_cut_short() {
    let mut system = System::new(2, vec![1.0; 3]);
    system.add_term(Box::new(Penalty::changing(&[2], &[[0, 1]], [10.0, 0.1])));
    system.pin(&[0, 1]);
    let state = State::new(vec![-1.0, 0.0, 1.0, 0.0, 0.1, 0.05], vec![0.0, 0.0, 0.0, 0.0, 10.0, 0.0]);
    let mut simulation = Simulation::new(system, state, method("implicit-euler"), 0.05);
    simulation.set_solver(SolverOptions { tolerance: Some(0.6), ..SolverOptions::default() });
    simulation.step().unwrap();
    assert!((simulation.state().x()[4] - 0.6).abs() < 1e-9, "{}", simulation.state().x()[4]);
}

// A plate that is driven through a vertex in one step takes it along, where a scheme holds contact. Others
// are refused, or do as well.
#[test]
fn prescribed_motion_takes_along_what_a_term_guards() {
    for method in implicit() {
        let mut system = System::new(2, vec![1.0; 3]);
        system.add_term(Box::new(Penalty::changing(&[2], &[[0, 1]], [1e5, 0.1])));
        let x = vec![-1.0, 0.0, 1.0, 0.0, 0.1, 0.15];
        let motion = Motion::new().along(|t| ([0.0, 10.0 * t, 0.0], [0.0, 10.0, 0.0]));
        system.hold(Hold::new("plate", vec![0, 1]).moving(motion, &x, &x, 2));
        let mut simulation = Simulation::new(system, State::new(x, vec![0.0; 6]), method, 0.05);
        let name = method.documentation.name;
        match simulation.step() {
            Ok(()) => {
                let x = simulation.state().x();
                assert!((x[1] - 0.5).abs() < 1e-12 && x[3] == x[1], "{name}: the plate is at {} m", x[1]);
                assert!(x[5] > x[1], "{name}: the vertex at {} m is below the plate", x[5]);
            }
            // In statics nothing holds the vertex once it is out of reach.
            Err(_) if method.is_static() => {}
            Err(error) => assert!(is_refused(&error) && !method.holds_contact(), "{name}: {error}"),
        }
    }
}
