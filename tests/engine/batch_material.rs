use std::sync::atomic::{AtomicU32, Ordering};

use pliant::algebra::Mat;
use pliant::energy::batch::BatchMaterial;
use pliant::material::{Isotropic, Material, Model, NeoHookean, Psd};
use pliant::simulation::StepError;
use pliant_scene::Scene;
use pliant_scene::assembly::{Assembly, UnstableStep};

/// A material of the library, as if it came from elsewhere.
struct Foreign<const D: usize> {
    material: NeoHookean,
    knows_tangent: bool,
    /// It answers so many questions.
    patience: AtomicU32,
}

impl<const D: usize> Foreign<D> {
    fn answers(&self) -> bool {
        self.patience.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_ok()
    }

    fn gradients(f: &[f64]) -> impl Iterator<Item = Mat<f64, D>> {
        f.chunks_exact(D * D).map(|f| {
            let mut matrix = Mat::zero();
            matrix.0.as_flattened_mut().copy_from_slice(f);
            matrix
        })
    }
}

impl<const D: usize> BatchMaterial for Foreign<D> {
    fn density(&self, f: &[f64], psi: &mut [f64]) -> bool {
        for (psi, f) in psi.iter_mut().zip(Self::gradients(f)) {
            *psi = if f.determinant() > 0.0 { self.material.psi(&f) } else { f64::INFINITY };
        }
        self.answers()
    }

    fn stress(&self, f: &[f64], p: &mut [f64]) -> bool {
        for (p, f) in p.chunks_exact_mut(D * D).zip(Self::gradients(f)) {
            p.copy_from_slice(self.material.pk1(&f).0.as_flattened());
        }
        self.answers()
    }

    fn tangent(&self, f: &[f64], tangent: &mut [f64]) -> Option<bool> {
        self.knows_tangent.then(|| {
            for (tangent, f) in tangent.chunks_exact_mut(D * D * D * D).zip(Self::gradients(f)) {
                let exact = Material::<D>::hessian(&self.material, &f, Psd::Exact);
                let rows = exact.0.iter().flatten().flat_map(|row| row.0.as_flattened());
                tangent.iter_mut().zip(rows).for_each(|(to, from)| *to = *from);
            }
            self.answers()
        })
    }
}

/// A clamped beam that bends under its weight, with linear or quadratic elements.
fn beam(dimension: usize, order: usize, integrator: &str) -> Assembly {
    let (cells, gravity) =
        if dimension == 2 { ("[4, 1]", "[0.0, -9.8]") } else { ("[4, 1, 1]", "[0.0, -9.8, 1.0]") };
    let text = format!(
        "dimension = {dimension}\ntime = {{ integrator = '{integrator}', step = 5e-4, duration = 1.0 }}\n\
         world = {{ gravity = {gravity} }}\n[[body]]\nname = 'beam'\nmesh = {{ grid = {{ cells = {cells}, \
         spacing = 0.1 }} }}\n\
         order = {order}\nelastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density \
         = 1000.0 }}\n\
         pin = [{{ half_space = {{ normal = {}, offset = 0.0 }} }}]\n",
        if dimension == 2 { "[1.0, 0.0]" } else { "[1.0, 0.0, 0.0]" }
    );
    Scene::from_toml(&text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap()
}

/// The same with its material from elsewhere.
fn foreign(dimension: usize, order: usize, integrator: &str, knows_tangent: bool, patience: u32) -> Assembly {
    let mut assembly = beam(dimension, order, integrator);
    give(&mut assembly, dimension, 1e5, knows_tangent, patience);
    assembly
}

/// Gives the beam a material from elsewhere.
fn give(assembly: &mut Assembly, dimension: usize, young: f64, knows_tangent: bool, patience: u32) {
    let material = NeoHookean::new(&Isotropic::new(young, 0.3));
    let patience = AtomicU32::new(patience);
    let material: Box<dyn BatchMaterial> = match dimension {
        2 => Box::new(Foreign::<2> { material, knows_tangent, patience }),
        _ => Box::new(Foreign::<3> { material, knows_tangent, patience }),
    };
    assembly.simulation.set_material(&assembly.topology, "beam", material).unwrap();
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A material that is set while a simulation runs is in all that was made for the one before: the plan of
/// the matrix, and what schemes remember of forces. To the last bit and the last count, as in a simulation
/// that had it from its beginning.
#[test]
fn a_material_set_between_implicit_steps_is_that_of_the_next() {
    for integrator in ["implicit-euler", "newmark", "bdf2", "tr-bdf2", "radau-iia2"] {
        for (dimension, order) in ALL {
            let what = format!("{integrator}, {dimension}D, order {order}");
            let mut changed = beam(dimension, order, integrator);
            (0..3).for_each(|_| changed.simulation.step().unwrap());
            let before = changed.simulation.work().solver.unwrap().newton_iterations;
            give(&mut changed, dimension, 2e5, true, u32::MAX);
            let mut always = beam(dimension, order, integrator);
            give(&mut always, dimension, 2e5, true, u32::MAX);
            always.simulation.restore(&changed.simulation.snapshot()).unwrap();
            for both in [&mut changed, &mut always] {
                (0..3).for_each(|_| both.simulation.step().unwrap_or_else(|e| panic!("{what}: {e}")));
            }
            assert_eq!(changed.simulation.positions(), always.simulation.positions(), "{what}");
            let [changed, always] =
                [changed, always].map(|one| one.simulation.work().solver.unwrap().newton_iterations);
            assert_eq!(changed - before, always, "{what}");
        }
    }
}

const ALL: [(usize, usize); 4] = [(2, 1), (2, 2), (3, 1), (3, 2)];

// lecture 18, 19: the same elements, evaluated by either material.
#[test]
fn elements_are_those_of_the_library() {
    for (dimension, order) in ALL {
        for knows_tangent in [true, false] {
            let ours = beam(dimension, order, "velocity-verlet").simulation;
            let theirs = foreign(dimension, order, "velocity-verlet", knows_tangent, u32::MAX).simulation;
            let mut both = [ours, theirs];
            let x: Vec<f64> =
                both[0].positions().iter().enumerate().map(|(i, x)| x + 0.01 * (i as f64).sin()).collect();
            both.iter_mut().for_each(|one| one.set_positions(&x));
            let measured = both.each_mut().map(|one| one.diagnostics());
            assert!((measured[0].elastic - measured[1].elastic).abs() < 1e-12 * measured[0].elastic);
            assert!((measured[0].min_j.unwrap() - measured[1].min_j.unwrap()).abs() < 1e-12);
            let stiffness = both.each_mut().map(|one| one.stiffness_matrix().unwrap());
            assert_eq!(stiffness[0].column, stiffness[1].column);
            let largest = stiffness[0].value.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            let bound = if knows_tangent { 1e-12 } else { 1e-9 };
            let difference = largest_difference(&stiffness[0].value, &stiffness[1].value) / largest;
            assert!(difference < bound, "{dimension}D, order {order}: {difference:e}");
            let direction: Vec<f64> = (0..x.len()).map(|i| (3.0 * i as f64).cos()).collect();
            let products = both.each_mut().map(|one| {
                let mut product = vec![0.0; x.len()];
                one.system_mut().hessian_product(&x, &direction, &mut product);
                product
            });
            assert!(largest_difference(&products[0], &products[1]) < 10.0 * bound * largest);
            let states = both.each_ref().map(|one| one.element_states());
            for (ours, theirs) in states[0].iter().zip(&states[1]) {
                for i in 0..dimension {
                    let (f, g) = (&ours.deformation_gradient[i], &theirs.deformation_gradient[i]);
                    assert!(largest_difference(&f[..dimension], &g[..dimension]) < 1e-12);
                    let (p, q) = (&ours.first_piola[i], &theirs.first_piola[i]);
                    assert!(largest_difference(&p[..dimension], &q[..dimension]) < 1e-12 * 1e5);
                }
                assert_eq!(theirs.first_piola[2][2].is_nan(), dimension == 2);
            }
            for one in &mut both {
                (0..50).for_each(|_| one.step().unwrap());
            }
            assert!(largest_difference(&both[0].positions(), &both[1].positions()) < 1e-12);
        }
    }
}

#[test]
fn implicit_steps_find_the_same_solutions() {
    for (dimension, knows_tangent) in [(2, true), (2, false), (3, false)] {
        let mut ours = beam(dimension, 1, "implicit-euler").simulation;
        let mut theirs = foreign(dimension, 1, "implicit-euler", knows_tangent, u32::MAX).simulation;
        for simulation in [&mut ours, &mut theirs] {
            (0..20).for_each(|_| simulation.step().unwrap());
        }
        let difference = largest_difference(&ours.positions(), &theirs.positions());
        assert!(difference < 1e-9, "{dimension}D: {difference:e}");
        // Newton's method converges as fast: by exact derivatives in as many iterations, by differences in
        // few more.
        let iterations = |one: &pliant::simulation::Simulation| one.work().solver.unwrap().newton_iterations;
        assert!(iterations(&theirs) <= iterations(&ours) + if knows_tangent { 0 } else { 20 });
    }
}

/// Nothing is known of a body whose material no longer answers.
#[test]
fn a_material_that_fails_ends_the_step() {
    for integrator in ["velocity-verlet", "implicit-euler"] {
        let mut simulation = foreign(2, 1, integrator, true, 40).simulation;
        let error = (0..100).find_map(|_| simulation.step().err()).unwrap();
        assert!(matches!(error, StepError::NotFinite { .. } | StepError::Unsolved { .. }), "{error}");
        assert!(simulation.positions().iter().all(|x| x.is_finite()));
    }
}

#[test]
fn an_element_outside_of_the_domain_is_named() {
    let mut simulation = foreign(2, 1, "velocity-verlet", false, u32::MAX).simulation;
    let mut x = simulation.positions().into_owned();
    (x[18], x[19]) = (0.2, 0.05);
    simulation.set_positions(&x);
    let error = simulation.step().unwrap_err().to_string();
    assert!(error.contains("element 7 of `beam` has J = -"), "{error}");
}

#[test]
fn only_solids_have_deformation_gradients() {
    let mut assembly = beam(2, 1, "rk4");
    let material = || {
        let material = NeoHookean::new(&Isotropic::new(1.0, 0.0));
        Box::new(Foreign::<2> { material, knows_tangent: false, patience: AtomicU32::new(1) })
    };
    let simulation = &mut assembly.simulation;
    let error = simulation.set_material(&assembly.topology, "rope", material()).unwrap_err();
    assert!(error.to_string().contains("no body `rope`"));
    assembly.topology.bodies[0].kind = pliant::topology::BodyKind::Cloth;
    let error = simulation.set_material(&assembly.topology, "beam", material()).unwrap_err();
    assert!(error.to_string().contains("no elastic solid"));
}
