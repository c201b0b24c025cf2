//! Energy balance: external work and dissipation.

/// Energy that entered and left a system since the start, or since its state or equations were last
/// changed manually [J]. The current energy, kinetic and potential, minus [`net`](Self::net) is constant
/// to the order of the integrator, at most to fourth order; to second order with ether drag, which
/// integrators treat to that order, and with walls, which act at the ends of steps. The remaining drift
/// is the integration error: numerical damping loses energy that this balance does not account for.
/// Fields are `None` if a scene has no such part, or if it was not requested.
///
/// Rates are known at the end of each step and integrated to fourth order. A jump of a rate within a step
/// (a kink of a formula or of keyframes) costs one order each.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Balance {
    /// Work of prescribed motion: current `1/2 m v^2` of its coordinates, minus that at the start, plus
    /// the integral of `(dE/dx + dR/dv + c m v) . v` over these coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<f64>,
    /// Work of loads and muscle tension that are time-dependent or have no potential: the integral of
    /// `dE/dt` at fixed `x` and of `f . v`. Constant ones count as potential energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loads: Option<f64>,
    /// Energy supplied by time-dependent gravity: the integral of `-sum m g'(t) . x`. Together with the
    /// loss of potential energy it is the work of gravity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gravity: Option<f64>,
    /// Dissipation by ether drag: the integral of `c sum m |v|^2`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ether_drag: Option<f64>,
    /// Dissipation by damping: the integral of `v . dR/dv`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<f64>,
    /// Dissipation by contact friction: the integral of `v . dR/dv` of friction; in steps of backward
    /// Euler, whose force is that at the end, `(x_(n+1) - x_n) . dR/dv`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Dissipation by walls: the impact energy of vertices. Never negative; zero for resting and sliding
    /// vertices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub walls: Option<f64>,
}

impl Balance {
    /// Names of the dissipation fields.
    pub const LOSSES: [&str; 4] = ["ether_drag", "damping", "friction", "walls"];

    /// Returns the energy that entered minus the energy that left [J].
    pub fn net(&self) -> f64 {
        sum([self.motion, self.loads, self.gravity]) - self.lost()
    }

    /// Returns the dissipation by drag, damping, friction and walls [J].
    pub fn lost(&self) -> f64 {
        sum(self.losses())
    }

    /// Returns the individual losses [J].
    fn losses(&self) -> [Option<f64>; 4] {
        [self.ether_drag, self.damping, self.friction, self.walls]
    }

    /// True if any loss is counted.
    pub fn counts_losses(&self) -> bool {
        self.losses().iter().any(Option::is_some)
    }

    /// Returns the sum of the absolute supplied energies [J].
    pub(crate) fn turnover(&self) -> f64 {
        sum([self.motion, self.loads, self.gravity].map(|work| work.map(f64::abs)))
    }
}

fn sum<const N: usize>(parts: [Option<f64>; N]) -> f64 {
    parts.into_iter().flatten().sum()
}
