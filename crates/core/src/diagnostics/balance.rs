//! Where energy comes from and where it goes.

/// Energy brought into a system and taken out of it since the start, or since its state or its equations
/// were last changed by hand [J]: the present energy, kinetic and potential, less [`net`](Self::net), stays
/// what it was then, to the order of the scheme, and at most to fourth order; to second with ether drag,
/// which schemes treat to that order, and where walls act, which they do at the ends of steps. What still
/// changes is the error of the scheme: an implicit one that damps numerically loses energy that nothing here
/// accounts for. `None` where a scene has no such thing, and where it was not asked for.
///
/// Rates are known at the end of every step, and integrated to fourth order. A rate that jumps within a step
/// (a formula or keyframes with a kink) costs one order for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Balance {
    /// Brought in by prescribed motion: `1/2 m v^2` of what moves now, less at the start, plus the integral
    /// of `(dE/dx + dR/dv + c m v) . v` over these coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<f64>,
    /// Brought in by loads, and tension of muscles, that change with time or have no potential, `dE/dt` at
    /// fixed `x` and `f . v`, integrated; those that stay the same are in the potential energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loads: Option<f64>,
    /// Brought in by gravity that changes with time: the integral of `-sum m g'(t) . x`. With what the
    /// potential lost, it is the work of gravity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gravity: Option<f64>,
    /// Taken out by ether drag: the integral of `c sum m |v|^2`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ether_drag: Option<f64>,
    /// Taken out by damping: the integral of `v . dR/dv`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<f64>,
    /// Taken out by friction of surfaces that touch: the integral of `v . dR/dv` of friction alone; in steps
    /// of backward Euler, whose force is that at the end, `(x_(n+1) - x_n) . dR/dv`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Taken out by walls: the energy with which vertices arrive at a wall, in the motion that it ends.
    /// Never negative; nothing for what rests or slides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub walls: Option<f64>,
}

impl Balance {
    /// Names of the fields of what was taken out.
    pub const LOSSES: [&str; 4] = ["ether_drag", "damping", "friction", "walls"];

    /// Energy that came in, less that which went out [J].
    pub fn net(&self) -> f64 {
        sum([self.motion, self.loads, self.gravity]) - self.lost()
    }

    /// Energy taken out by drag, damping, friction and walls [J].
    pub fn lost(&self) -> f64 {
        sum(self.losses())
    }

    /// Each of them [J].
    fn losses(&self) -> [Option<f64>; 4] {
        [self.ether_drag, self.damping, self.friction, self.walls]
    }

    /// True if any loss is counted.
    pub fn counts_losses(&self) -> bool {
        self.losses().iter().any(Option::is_some)
    }

    /// The sizes of what was brought in, added up [J].
    pub(crate) fn turnover(&self) -> f64 {
        sum([self.motion, self.loads, self.gravity].map(|work| work.map(f64::abs)))
    }
}

fn sum<const N: usize>(parts: [Option<f64>; N]) -> f64 {
    parts.into_iter().flatten().sum()
}
