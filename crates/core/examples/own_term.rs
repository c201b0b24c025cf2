//! An energy of one's own: masses on a bed of springs fall until it holds them, and come back.
//!
//! The engine asks a term for its energy and its gradient; implicit schemes ask for second derivatives too.
//!
//! `cargo run --release -p pliant --example own_term`

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use std::ops::Range;

use pliant::energy::gravity::UniformGravity;
use pliant::energy::{EnergyKind, EnergyTerm, Fault, Stencils, TermProperties, TermViews};
use pliant::integrator::IntegratorSpec;
use pliant::material::Psd;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

/// `E = sum_i k/2 y_i^2`: a bed of springs under the line `y = 0`, in two dimensions.
struct Bed {
    stiffness: f64,
    vertices: u32,
    gradient: Vec<f64>,
}

impl EnergyTerm for Bed {
    fn name(&self) -> String {
        "bed of springs".into()
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Other("bed"))
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        x.chunks_exact(2).map(|x| 0.5 * self.stiffness * x[1] * x[1]).sum()
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        // In memory that is there: a step allocates nothing.
        self.gradient.clear();
        self.gradient.extend(x.chunks_exact(2).flat_map(|x| [0.0, self.stiffness * x[1]]));
        self.gradient.iter().all(|g| g.is_finite())
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let own = &self.gradient[2 * first..][..g.len()];
        g.iter_mut().zip(own).for_each(|(g, own)| *g += own);
    }

    fn add_hessian_product(&mut self, _: &[f64], p: &[f64], y: &mut [f64]) {
        let rows = y.chunks_exact_mut(2).zip(p.chunks_exact(2));
        rows.for_each(|(y, p)| y[1] += self.stiffness * p[1]);
    }

    fn stencils(&mut self) -> Stencils {
        Stencils { size: 1, vertices: (0..self.vertices).collect() }
    }

    fn stencil_hessians(&self, _: Range<usize>, _: &[f64], _: Psd, out: &mut [f64]) {
        // A block of two by two for each vertex.
        let block = [0.0, 0.0, 0.0, self.stiffness];
        out.chunks_exact_mut(4).for_each(|out| out.copy_from_slice(&block));
    }

    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for Bed {}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mass, stiffness, g, h) = (2.0_f64, 50.0_f64, 9.81, 1e-3);
    for integrator in [IntegratorSpec::VelocityVerlet, IntegratorSpec::ImplicitMidpoint] {
        let mut system = System::new(2, vec![mass; 3]);
        system.add_term(Box::new(Bed { stiffness, vertices: 3, gradient: vec![] }));
        system.add_term(Box::new(UniformGravity::new(&[0.0, -g], &[mass; 3])));
        let start = State::new(vec![0.0, 0.0, 1.0, 0.0, 2.0, 0.0], vec![0.0; 6]);
        let mut simulation = Simulation::new(system, start, integrator.method(), h);
        for _ in 0..1000 {
            simulation.step()?;
        }
        // y(t) = -m g / k (1 - cos sqrt(k/m) t).
        let theory = -mass * g / stiffness * (1.0 - (stiffness / mass).sqrt().cos());
        let y = simulation.positions()[1];
        println!(
            "{}: y = {y:.7} m after 1 s; in theory {theory:.7} m",
            integrator.method().documentation.name
        );
        assert!((y - theory).abs() < 1e-5, "off by {:e} m", y - theory);
    }
    Ok(())
}
