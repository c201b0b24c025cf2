//! Matrix structures of all stages with stencils that change from stage to stage.

use std::ops::Range;

use crate::energy::{ChangingStencils, EnergyKind, EnergyTerm, Fault, Stencils, TermProperties, TermViews};
use crate::integrator::IntegratorSpec;
use crate::material::Psd;
use crate::simulation::Simulation;
use crate::state::State;
use crate::system::System;

/// Number of vertices.
const COUNT: usize = 10;

/// A constant force on every vertex, with stencils of zeros: all pairs of the first eight vertices while
/// `x_0 < 0.5 m`, the last two vertices afterwards.
struct Alternating {
    lists: [Stencils; 1],
}

impl Alternating {
    fn stencils_at(x: &[f64]) -> Vec<u32> {
        let pairs = (0..8).flat_map(|a| (a + 1..8).map(move |b| [a, b]));
        if x[0] < 0.5 { pairs.flatten().collect() } else { vec![8, 9] }
    }
}

impl EnergyTerm for Alternating {
    fn name(&self) -> String {
        "alternating".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        x.iter().sum()
    }
    fn evaluate(&mut self, _: &[f64]) -> bool {
        true
    }
    fn add_rows(&self, _: usize, g: &mut [f64]) {
        g.iter_mut().for_each(|g| *g += 1.0);
    }
    fn add_hessian_product(&mut self, _: &[f64], _: &[f64], _: &mut [f64]) {}
    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for Alternating {
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        Some(self)
    }
    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        Some(self)
    }
}

impl ChangingStencils for Alternating {
    fn find(&mut self, x: &[f64]) -> bool {
        let vertices = Self::stencils_at(x);
        let others = vertices != self.lists[0].vertices;
        self.lists[0].vertices = vertices;
        others
    }
    fn lists(&self) -> &[Stencils] {
        &self.lists
    }
    fn blocks(&self, _: usize, _: Range<usize>, _: (&[f64], &[f64]), _: Psd, out: &mut [f64]) {
        out.fill(0.0);
    }
}

// The stages of a step have stencils of different vertices. Those of the second are so few that their
// pattern alone would drop those of the first. The matrix of all stages needs room for both, and one
// analysis.
#[test]
fn the_structure_has_room_for_the_stencils_of_every_stage() {
    let mut system = System::new(1, vec![100.0; COUNT]);
    system.add_term(Box::new(Alternating { lists: [Stencils { size: 2, vertices: vec![] }] }));
    let state = State::new(vec![0.0; COUNT], vec![1.0; COUNT]);
    let mut methods = IntegratorSpec::ALL.iter().map(|spec| spec.method());
    let gauss = methods.find(|method| method.documentation.name == "gauss2").unwrap();
    let mut simulation = Simulation::new(system, state, gauss, 1.0);
    simulation.step().unwrap();
    // Exact solution under a constant force: x = v t - f t^2 / 2 m.
    let x = simulation.state().x();
    assert!(x.iter().all(|x| (x - 0.995).abs() < 1e-14), "{x:?}");
    let work = simulation.work().solver.unwrap();
    assert!(work.factorizations >= 1 && work.analyses == 1, "{work:?}");
}
