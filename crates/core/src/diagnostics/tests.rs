use std::ops::Range;

use super::*;
use crate::energy::{EnergyTerm, Fault, Stencils, TermProperties, TermViews};
use crate::material::Psd;

/// A term of another kind: `E = q x_0`.
struct Magnet(f64);

impl EnergyTerm for Magnet {
    fn name(&self) -> String {
        "magnet".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Other("magnetic"))
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        self.0 * x[0]
    }
    fn evaluate(&mut self, _: &[f64]) -> bool {
        true
    }
    fn add_rows(&self, _: usize, g: &mut [f64]) {
        g[0] += self.0;
    }
    fn add_hessian_product(&mut self, _: &[f64], _: &[f64], _: &mut [f64]) {}
    fn stencils(&mut self) -> Stencils {
        Stencils::default()
    }
    fn stencil_hessians(&self, _: Range<usize>, _: &[f64], _: Psd, _: &mut [f64]) {}
    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for Magnet {}

#[test]
fn energies_of_kinds_of_others_are_part_of_the_total() {
    let mut system = System::new(2, vec![2.0]);
    let (x, v) = ([3.0, 0.0], [1.0, 2.0]);
    assert_eq!(Diagnostics::measure(&mut system, 0.0, &x, &v).other, None);
    system.add_term(Box::new(Magnet(0.5)));
    let measured = Diagnostics::measure(&mut system, 0.0, &x, &v);
    assert_eq!((measured.other, measured.kinetic, measured.total), (Some(1.5), 5.0, 6.5));
    assert_eq!(measured.further_energies().collect::<Vec<_>>(), [("other", 1.5)]);
}

fn energy(total: f64, loads: f64, damping: f64, walls: f64) -> Energy {
    let parts =
        Balance { loads: Some(loads), damping: Some(damping), walls: Some(walls), ..Balance::default() };
    Energy { total, balance: Some(parts) }
}

/// Recordings from before friction was separate from damping stay readable.
#[test]
fn balances_without_friction_are_read() {
    let old = serde_json::json!({ "motion": 3.0, "damping": 2.0, "walls": 0.5 });
    let read: Balance = serde_json::from_value(old).unwrap();
    assert_eq!((read.friction, read.lost(), read.net()), (None, 2.5, 0.5));
    let now = Balance { friction: Some(1.0), ..read };
    assert_eq!((now.lost(), now.net()), (3.5, -0.5));
    assert_eq!(serde_json::from_value::<Balance>(serde_json::to_value(now).unwrap()).unwrap(), now);
}

/// A state of 10 J, of which 3 J were supplied, after a loss of 1 J.
#[test]
fn no_loss_excuses_a_gain() {
    let start = energy(10.0, 3.0, 1.0, 0.0);
    let gain = |total, loads, damping, walls| energy(total, loads, damping, walls).gain(&start);
    // All of it is accounted for.
    assert_eq!(gain(14.0, 9.0, 3.0, 0.0), 0.0);
    // Known losses do not hide that 5 J came from nowhere.
    assert_eq!(gain(13.0, 3.0, 3.0, 0.0), 5.0);
    // A negative loss is a gain by another name: the energy has grown by 20 J that nothing brought in.
    assert_eq!(gain(30.0, 3.0, 1.0, -20.0), 20.0);
    // What is lost and not counted is no gain.
    assert!(Energy { total: 4.0, balance: None }.gain(&Energy { total: 10.0, balance: None }) < 0.0);
    assert_eq!(Energy { total: 12.0, balance: None }.gain(&Energy { total: 10.0, balance: None }), 2.0);
}
