use pliant::energy::load::ExternalForce;
use pliant::simulation::{Simulation, Snapshot, SnapshotError};
use pliant::solver::SolverOptions;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// A beam of 3 x 1 cells under gravity, pinned at its left, its top let go after 20 steps, with drag and a
/// wall: all that a ledger and holds can remember.
const BEAM: &str = "dimension = 2
time = { integrator = 'INTEGRATOR', step = 1e-3, duration = 1.0 }
world = { gravity = [0.0, -9.8], ether_drag = 0.5, walls = [{ normal = [0.0, 1.0], offset = -0.02 }] }
[[body]]
name = 'beam'
mesh = { grid = { cells = [3, 1], spacing = 0.1 } }
elastic = { corotated = { young = 1e5, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ name = 'left', vertices = [0] }, { name = 'top', vertices = [1], until = 0.02 }]
";

fn beam(integrator: &str) -> Simulation {
    let mut scene = Scene::from_toml(&BEAM.replace("INTEGRATOR", integrator)).unwrap();
    scene.world.puts_back = true;
    scene.assemble(UnstableStep::Refuse).ok().unwrap().simulation
}

fn go(simulation: &mut Simulation, steps: usize) {
    (0..steps).for_each(|_| simulation.step().unwrap());
}

// lecture 3: whoever writes a scheme of their own asks for forces, and gets the bits of a step.
#[test]
fn forces_are_those_that_a_step_has_to_the_bit() {
    let text = BEAM
        .replace("INTEGRATOR", "symplectic-euler")
        .replace(", ether_drag = 0.5, walls = [{ normal = [0.0, 1.0], offset = -0.02 }]", "")
        .replace("pin =", "damping = { strain_rate = { shear = 5.0 } }\npin =");
    let mut simulation =
        Scene::from_toml(&text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap().simulation;
    let h = simulation.step_size();
    let (mut x, mut v) = (simulation.positions().into_owned(), simulation.velocities().into_owned());
    for step in 0..15 {
        let forces = simulation.forces(Some(&x), Some(&v)).unwrap();
        // Neither asking elsewhere nor asking here changes where the simulation goes.
        let elsewhere: Vec<f64> = x.iter().map(|x| 1.01 * x).collect();
        simulation.forces(Some(&elsewhere), None).unwrap();
        assert_eq!(simulation.forces(None, None).unwrap(), forces, "step {step}");
        for i in 0..x.len() {
            v[i] += h * forces.accelerations[i];
            x[i] += h * v[i];
        }
        simulation.step().unwrap();
        assert_eq!(
            (&simulation.positions()[..], &simulation.velocities()[..]),
            (&x[..], &v[..]),
            "step {step}"
        );
    }
    let found = simulation.forces(None, None).unwrap();
    let mass = simulation.numbering().to_original(simulation.system().mass(), 1).into_owned();
    let names: Vec<&str> = found.terms.iter().map(|(name, _)| name.as_str()).collect();
    assert!(names.len() == 3 && names[..2].contains(&"elements of `beam`"), "{names:?}");
    // At free vertices they add up to mass times acceleration, but for rounding.
    for (i, a) in found.accelerations.iter().enumerate().skip(4) {
        let parts = found.terms.iter().map(|(_, rows)| rows[i]);
        let (sum, size) = parts.fold((0.0, 0.0), |(sum, size), f| (sum + f, size + f64::abs(f)));
        assert!((sum - mass[i / 2] * a).abs() <= 8.0 * f64::EPSILON * size, "{i}: {sum} {a}");
    }
    let elastic = |simulation: &mut Simulation, x: &[f64]| {
        let energies = simulation.potential_energies(Some(x));
        energies.iter().find(|(name, _)| name == "elements of `beam`").unwrap().1
    };
    // Forces are slopes of the energy.
    let force = &found.terms.iter().find(|(name, _)| name == "elements of `beam`").unwrap().1;
    let d = 1e-6;
    let [mut high, mut low] = [x.clone(), x.clone()];
    (high[14], low[14]) = (x[14] + d, x[14] - d);
    let slope = (elastic(&mut simulation, &high) - elastic(&mut simulation, &low)) / (2.0 * d);
    assert!((slope + force[14]).abs() < 1e-6 * force[14].abs().max(1.0), "{slope} {}", force[14]);
}

// lecture 21: reset. Before, at, and after the step at which a pin lets go.
#[test]
fn going_back_goes_on_with_the_same_bits() {
    for integrator in ["symplectic-euler", "rk4", "yoshida4", "ias15"] {
        for kept in [0, 5, 19, 20, 21, 30] {
            let mut simulation = beam(integrator);
            go(&mut simulation, kept);
            let snapshot = simulation.snapshot();
            go(&mut simulation, 40);
            let (end, measured) = (simulation.snapshot(), simulation.diagnostics());
            for mut again in [beam(integrator), simulation] {
                again.restore(&snapshot).unwrap();
                assert_eq!(again.snapshot(), snapshot, "{integrator} at {kept}");
                go(&mut again, 40);
                assert_eq!(again.snapshot(), end, "{integrator} from {kept}");
                assert_eq!(again.diagnostics(), measured, "{integrator} from {kept}");
            }
        }
    }
}

/// Step sizes that follow the error go on with what they have learnt, and land on the time at which a pin
/// lets go.
#[test]
fn going_back_knows_the_size_of_the_next_step() {
    let adaptive = || {
        let text = BEAM
            .replace("step = 1e-3", "adaptive = { tolerance = 1e-6 }")
            .replace("INTEGRATOR", "dormand-prince5");
        Scene::from_toml(&text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap().simulation
    };
    let mut simulation = adaptive();
    let (mut moments, mut sizes) = (vec![simulation.snapshot()], vec![simulation.step_size()]);
    while simulation.state().time < 0.04 {
        simulation.step().unwrap();
        moments.push(simulation.snapshot());
        sizes.push(simulation.step_size());
    }
    assert!(moments.iter().any(|moment| moment.time == 0.02), "no step landed on the end of the pin");
    let end = moments.last().unwrap();
    for (moment, size) in moments.iter().zip(&sizes) {
        for again in [&mut adaptive(), &mut simulation] {
            again.restore(moment).unwrap();
            assert_eq!((again.step_size(), &again.snapshot()), (*size, moment));
            let before = again.snapshot();
            again.advanced(&mut moment.x.clone(), &mut moment.v.clone()).unwrap();
            assert_eq!(again.snapshot(), before);
            go(again, (end.step - moment.step) as usize);
            assert_eq!(&again.snapshot(), end, "from {}", moment.time);
        }
    }
}

/// Schemes of two steps go on with what they remember: without it, the first step is another scheme's.
#[test]
fn implicit_schemes_go_back_to_the_tolerance_of_their_solver() {
    for integrator in ["bdf2", "generalised-alpha", "newmark"] {
        let mut simulation = beam(integrator);
        go(&mut simulation, 25);
        let snapshot = simulation.snapshot();
        go(&mut simulation, 10);
        let end = simulation.snapshot();
        let distance = |from: &Snapshot| {
            let mut again = beam(integrator);
            again.restore(from).unwrap();
            go(&mut again, 10);
            let x = again.positions().into_owned();
            x.iter().zip(&end.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let forgetful = Snapshot::new(snapshot.step, snapshot.time, snapshot.x.clone(), snapshot.v.clone());
        assert!(distance(&snapshot) < 1e-10, "{integrator}: {:e}", distance(&snapshot));
        if integrator == "bdf2" {
            assert!(distance(&forgetful) > 1e-8, "{:e}", distance(&forgetful));
        }
    }
}

/// After a step in parts, the last of which is shorter than a step: taken for one of a whole step, its memory
/// would make the next step another one.
#[test]
fn a_memory_knows_the_size_of_the_step_it_is_of() {
    let text = "dimension = 2
time = { integrator = 'INTEGRATOR', step = 0.5, duration = 2.0, solver = { retries = 4, tolerance = 1e-12 } }
[[body]]
name = 'block'
mesh = { grid = { cells = [4, 10], size = [0.08, 0.1] } }
elastic = { neo-hookean = { young = 1e6, poisson = 0.45 } }
mass = { density = 1100.0 }
pin = [
  { half_space = { normal = [0, 1], offset = 0 } },
  { half_space = { normal = [0, -1], offset = -0.1 }, motion = { displacement = ['0', '-0.05 * min(t, 1)'] \
  } },
]
";
    for integrator in ["bdf2", "generalised-alpha"] {
        let block = || {
            let scene = Scene::from_toml(&text.replace("INTEGRATOR", integrator)).unwrap();
            scene.assemble(UnstableStep::Accept).ok().unwrap().simulation
        };
        let mut simulation = block();
        while simulation.work().retried.unwrap().steps == 0 {
            simulation.step().unwrap();
        }
        let mut again = block();
        again.restore(&simulation.snapshot()).unwrap();
        go(&mut simulation, 1);
        go(&mut again, 1);
        let difference = simulation
            .positions()
            .iter()
            .zip(&again.positions()[..])
            .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(difference < 1e-10, "{integrator}: {difference:e}");
    }
}

/// Three bodies that attract each other, by steps that IAS15 chooses: coefficients, compensated sums and
/// the origin are remembered.
#[test]
fn three_bodies_go_on_with_the_same_bits() {
    let bodies = || {
        let text = "dimension = 2
time = { integrator = 'ias15', adaptive = {}, duration = 10.0 }
world = { nbody = { constant = 1.0 } }
[[body]]
name = 'bodies'
mesh = { inline = { points = [[1.0, 3.0], [-2.0, -1.0], [1.0, -1.0]] } }
mass = { per_vertex = [3.0, 4.0, 5.0] }
";
        Scene::from_toml(text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap().simulation
    };
    let mut simulation = bodies();
    go(&mut simulation, 60);
    let text = serde_json::to_string(&simulation.snapshot()).unwrap();
    let snapshot = serde_json::from_str(&text).unwrap();
    go(&mut simulation, 60);
    let end = simulation.snapshot();
    for mut again in [bodies(), simulation] {
        again.restore(&snapshot).unwrap();
        assert_eq!(again.snapshot(), snapshot);
        go(&mut again, 60);
        assert_eq!(again.snapshot(), end);
    }
}

/// Tolerances are those of the start: here of 1 m, while one vertex is taken nine hundred thousand
/// kilometres away before the restore.
#[test]
fn going_back_keeps_the_size_that_tolerances_go_by() {
    let scene = "dimension = 2
time = { integrator = 'quasi-static', step = 0.1, duration = 1.0 }
[[body]]
name = 'rope'
mesh = { strand = { segments = 4, start = [0.0, 0.0], end = [1.0, 0.0] } }
springs = { stiffness = 1e3 }
mass = { per_vertex = 1.0 }
pin = [{ vertices = [0] }]
load = [{ vertices = [4], force = ['20*t', '-10*t'] }]
[[body]]
name = 'far'
mesh = { inline = { points = [[0.0, 0.0]] } }
mass = { per_vertex = 1.0 }
pin = [{ vertices = [0], motion = { velocity = [1e9, 0.0] } }]
";
    let rope = || Scene::from_toml(scene).unwrap().assemble(UnstableStep::Refuse).ok().unwrap().simulation;
    let mut simulation = rope();
    go(&mut simulation, 9);
    let snapshot = simulation.snapshot();
    let solved = |tolerance: Option<f64>| {
        let mut again = rope();
        again.set_solver(SolverOptions { tolerance, ..SolverOptions::default() });
        again.restore(&snapshot).unwrap();
        again.step().unwrap();
        // A tolerance that is given is watched: the counts of that are no work.
        (again.positions().into_owned(), again.work().solver.unwrap().newton_iterations)
    };
    assert!(simulation.length_scale() > 500.0 * rope().length_scale());
    assert_eq!(solved(None), solved(Some(1e-9 * rope().length_scale())));
    assert_ne!(solved(None), solved(Some(1e-9 * simulation.length_scale())), "the scene shows no difference");
}

#[test]
fn a_snapshot_survives_json_to_the_last_bit() {
    let mut simulation = beam("bdf2");
    go(&mut simulation, 30);
    let snapshot = simulation.snapshot();
    let text = serde_json::to_string(&snapshot).unwrap();
    assert_eq!(serde_json::from_str::<Snapshot>(&text).unwrap(), snapshot);
}

#[test]
fn states_of_other_scenes_and_broken_ones_are_refused() {
    let mut simulation = beam("rk4");
    let before = simulation.snapshot();
    let error = simulation.restore(&Snapshot::new(3, 0.1, vec![0.0; 4], vec![0.0; 4])).unwrap_err();
    assert_eq!(error, SnapshotError::Size { found: 4, expected: 16 });
    let mut broken = before.clone();
    broken.v[5] = f64::NAN;
    assert_eq!(simulation.restore(&broken).unwrap_err(), SnapshotError::NotFinite { vertex: 2 });
    assert_eq!(simulation.snapshot(), before);
}

// lecture 3: the stepper as a black box.
#[test]
fn the_pure_step_leaves_the_simulation_alone() {
    for integrator in ["symplectic-euler", "bdf2"] {
        let (mut pure, mut plain) = (beam(integrator), beam(integrator));
        go(&mut pure, 19);
        go(&mut plain, 19);
        let before = pure.snapshot();
        let (mut x, mut v) = (before.x.clone(), before.v.clone());
        pure.advanced(&mut x, &mut v).unwrap();
        assert_eq!(pure.snapshot(), before);
        if integrator == "symplectic-euler" {
            plain.step().unwrap();
            assert_eq!((&x[..], &v[..]), (&plain.positions()[..], &plain.velocities()[..]));
        }
        // From elsewhere too: the same map twice.
        let (mut y, mut w) = (before.x.iter().map(|x| x + 0.1).collect::<Vec<_>>(), vec![0.5; 16]);
        let (mut z, mut u) = (y.clone(), w.clone());
        pure.advanced(&mut y, &mut w).unwrap();
        pure.advanced(&mut z, &mut u).unwrap();
        assert_eq!((&y, &w), (&z, &u));
        assert_eq!(pure.snapshot(), before);
        assert_eq!(w[..2], [0.0, 0.0], "a held vertex has no velocity");
    }
}

// lecture 21: E changes while it runs.
#[test]
fn other_parameters_are_those_of_a_simulation_that_had_them_from_here_on() {
    let stiffer = || {
        let text = BEAM.replace("INTEGRATOR", "symplectic-euler").replace("young = 1e5", "young = 2e5");
        Scene::from_toml(&text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap().simulation
    };
    let mut simulation = beam("symplectic-euler");
    go(&mut simulation, 30);
    let here = simulation.snapshot();
    simulation.adopt(stiffer()).unwrap();
    assert_eq!((simulation.positions(), simulation.velocities()), ((&here.x).into(), (&here.v).into()));
    assert_eq!(simulation.pin_names(), ["beam/left"], "the other has let go long ago");
    let mut expected = stiffer();
    expected.restore(&Snapshot::new(here.step, here.time, here.x.clone(), here.v.clone())).unwrap();
    go(&mut simulation, 10);
    go(&mut expected, 10);
    assert_eq!(simulation.snapshot(), expected.snapshot());
    let mut soft = beam("symplectic-euler");
    soft.restore(&here).unwrap();
    go(&mut soft, 10);
    assert_ne!(simulation.positions(), soft.positions());
}

// lecture 21: a vertex is grabbed and dragged.
#[test]
fn a_grabbed_vertex_is_where_it_is_put_until_it_is_let_go() {
    let mut simulation = beam("symplectic-euler");
    go(&mut simulation, 30);
    simulation.pin("hand", &[7], [true; 3]);
    let held = simulation.positions()[14..16].to_vec();
    go(&mut simulation, 10);
    assert_eq!(simulation.positions()[14..16], held);
    let mut x = simulation.positions().into_owned();
    x[15] += 0.01;
    simulation.set_positions(&x);
    simulation.set_velocities(&[1.0; 16]);
    assert_eq!(simulation.velocities()[14..16], [0.0, 0.0]);
    go(&mut simulation, 10);
    assert_eq!(simulation.positions()[14..16], x[14..16]);
    assert!(simulation.release("hand") && !simulation.release("hand"));
    go(&mut simulation, 10);
    assert_ne!(simulation.positions()[14..16], x[14..16]);
}

// lecture 1: M x'' = f. A free body under the same force per mass on each vertex falls as under gravity.
#[test]
fn forces_from_outside_are_forces() {
    let text = "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 1e-3, duration = 1.0 \
                }\n[[body]]\n\
                mesh = { grid = { cells = [2, 1], spacing = 0.1 } }\nmass = { per_vertex = 0.5 }\n\
                elastic = { corotated = { young = 1e4, poisson = 0.3 } }\n";
    let assembled =
        |text: &str| Scene::from_toml(text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap().simulation;
    let (mut pushed, mut falling) =
        (assembled(text), assembled(&format!("world = {{ gravity = [0.0, -2.0] }}\n{text}")));
    pushed.set_external_forces(Some(ExternalForce::Constant([0.0, -1.0].repeat(6))));
    go(&mut pushed, 100);
    go(&mut falling, 100);
    assert_eq!(pushed.positions(), falling.positions());
    // Work that came in is the present energy: 6 vertices of 0.5 kg.
    let measured = pushed.diagnostics();
    assert!((measured.kinetic - 0.5 * 3.0 * 0.2 * 0.2).abs() < 1e-9);
    assert!((measured.balance.unwrap().loads.unwrap() - measured.kinetic).abs() < 1e-9);
    pushed.set_external_forces(None);
    let v = pushed.velocities().into_owned();
    go(&mut pushed, 10);
    assert!(pushed.velocities().iter().zip(&v).all(|(a, b)| (a - b).abs() < 1e-12));

    // As a function of time and place: a spring to x = 0 of each vertex, omega = 3 rad/s.
    let mut held = assembled(&text.replace("mesh", "velocity = { rigid = { linear = [1.0, 0.0] } }\nmesh"));
    let start = held.positions().into_owned();
    let origin = start.clone();
    let spring = move |_: f64, x: &[f64], f: &mut [f64]| {
        (0..12).for_each(|i| f[i] = -0.5 * 9.0 * (x[i] - origin[i]));
        true
    };
    held.set_external_forces(Some(ExternalForce::Function(Box::new(spring))));
    go(&mut held, 500);
    let exact = (3.0 * 0.5_f64).sin() / 3.0;
    assert!(held.positions().iter().zip(&start).step_by(2).all(|(x, o)| (x - o - exact).abs() < 1e-6));

    let fails = |t: f64, _: &[f64], f: &mut [f64]| {
        f.fill(0.0);
        t < 0.505
    };
    held.set_external_forces(Some(ExternalForce::Function(Box::new(fails))));
    let error = (0..100).find_map(|_| held.step().err()).unwrap().to_string();
    assert!(
        error.contains("step 505") && error.contains("forces from outside is not finite at t = 0.5"),
        "{error}"
    );
}

#[test]
fn the_stiffness_matrix_is_the_derivative_of_the_force_at_all_coordinates() {
    let mut simulation = beam("symplectic-euler");
    go(&mut simulation, 30);
    let k = simulation.stiffness_matrix().unwrap();
    let x = simulation.state().x().to_vec();
    let n = x.len();
    assert_eq!((k.row_start.len(), *k.row_start.last().unwrap()), (n + 1, k.value.len()));
    for column in 0..n {
        let mut unit = vec![0.0; n];
        unit[column] = 1.0;
        let mut product = vec![0.0; n];
        simulation.system_mut().hessian_product(&x, &unit, &mut product);
        for (row, product) in product.iter().enumerate() {
            let range = k.row_start[row]..k.row_start[row + 1];
            let entry = range.clone().find(|i| k.column[*i] == column).map_or(0.0, |i| k.value[i]);
            assert!((entry - product).abs() < 1e-6, "({row}, {column}): {entry} and {product}");
            assert!(range.clone().is_sorted_by_key(|i| k.column[i]));
        }
    }
}

/// The beam with all of its left end on a motion.
fn moved(motion: &str) -> Simulation {
    let pin = format!(
        "pin = [{{ name = 'left', half_space = {{ normal = [1, 0], offset = 0 }}, motion = {{ {motion} }} }}]"
    );
    let (before, _) = BEAM.split_once("pin = ").unwrap();
    let text = format!("{}{pin}", before.replace("INTEGRATOR", "velocity-verlet"));
    let scene = Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}"));
    scene.assemble(UnstableStep::Accept).unwrap_or_else(|problems| panic!("{problems:?}")).simulation
}

/// Places of the two vertices that are held.
fn held(simulation: &Simulation) -> [[f64; 2]; 2] {
    let x = simulation.positions();
    let rows: Vec<u32> = simulation.system().constraints()[0].vertices().to_vec();
    [0, 1].map(|i| [0, 1].map(|c| x[2 * rows[i] as usize + c]))
}

/// A motion that takes the place of another, or of none, moves on from where the pin is: by `u(t) - u(t_0)`,
/// and by the angle `a(t) - a(t_0)` about its point.
#[test]
fn a_changed_motion_goes_on_from_where_the_pin_is() {
    let first = "displacement = ['0.1 * sin(t)', 0], rotation = { angle = '3 * t' }";
    let others = [
        ("displacement = ['0.2 * (1 - cos(4 * t))', '0.3 * t']", 0.0),
        ("rotation = { point = [0.5, 0.1], angle = '2 * sin(t)' }", 1.0),
    ];
    for (second, turns) in others {
        let mut simulation = moved(first);
        go(&mut simulation, 100);
        let (t0, before) = (simulation.state().time, held(&simulation));
        simulation.adopt(moved(second)).unwrap();
        for (now, before) in held(&simulation).iter().zip(&before) {
            (0..2).for_each(|c| assert!((now[c] - before[c]).abs() < 1e-15, "{second}: {now:?} {before:?}"));
        }
        go(&mut simulation, 1);
        let speed = 0.8 + 0.3 + 2.0;
        for (now, before) in held(&simulation).iter().zip(&before) {
            (0..2).for_each(|c| {
                assert!((now[c] - before[c]).abs() < 1e-3 * speed, "{second}: {now:?} {before:?}")
            });
        }
        go(&mut simulation, 49);
        let t = simulation.state().time;
        let angle = turns * 2.0 * (t.sin() - t0.sin());
        let way = |u: fn(f64) -> [f64; 2]| [0, 1].map(|c| (1.0 - turns) * (u(t)[c] - u(t0)[c]));
        let way = way(|t| [0.2 * (1.0 - (4.0 * t).cos()), 0.3 * t]);
        for (now, before) in held(&simulation).iter().zip(&before) {
            let r = [before[0] - 0.5, before[1] - 0.1];
            let turned = [r[0] * angle.cos() - r[1] * angle.sin(), r[0] * angle.sin() + r[1] * angle.cos()];
            let expected = [0.5 + turned[0] + way[0], 0.1 + turned[1] + way[1]];
            (0..2).for_each(|c| {
                assert!((now[c] - expected[c]).abs() < 1e-12, "{second}: {now:?} {expected:?}")
            });
        }
        // Back at the start, it goes on from there.
        let start = moved(first);
        simulation.restore(&start.snapshot()).unwrap();
        go(&mut simulation, 1);
        for (now, before) in held(&simulation).iter().zip(&held(&start)) {
            (0..2).for_each(|c| {
                assert!((now[c] - before[c]).abs() < 1e-3 * speed, "{second}: {now:?} {before:?}")
            });
        }
    }
}

/// Vertices that have not changed move on with the same bits, whatever else has.
#[test]
fn a_motion_that_is_not_changed_goes_on_with_the_same_bits() {
    let motion = "displacement = ['0.1 * sin(t)', 0], rotation = { angle = '3 * t' }";
    let (mut plain, mut adopting) = (moved(motion), moved(motion));
    go(&mut plain, 100);
    go(&mut adopting, 100);
    adopting.adopt(moved(motion)).unwrap();
    for simulation in [&mut plain, &mut adopting] {
        go(simulation, 20);
    }
    assert_eq!(held(&plain), held(&adopting));
    let kept = plain.snapshot();
    go(&mut plain, 20);
    adopting.restore(&kept).unwrap();
    go(&mut adopting, 20);
    assert_eq!((plain.positions(), plain.velocities()), (adopting.positions(), adopting.velocities()));
}
