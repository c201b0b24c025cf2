//! Losses: the functions of a run whose gradient is computed.

/// State of a run at the end of a step.
#[derive(Clone, Copy, Debug)]
pub struct LossFrame<'a> {
    /// Number of steps taken.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    /// Positions, flat `(n, dimension)`, vertices in the order of the scene [m].
    pub x: &'a [f64],
    /// Velocities, likewise [m/s].
    pub v: &'a [f64],
}

/// Loss that is a sum over the states of a run, `L = sum_k l_k(x_k, v_k)`.
pub trait Loss {
    /// Returns the part `l_k` of one state, and adds its derivatives by positions to `x_bar` and by
    /// velocities to `v_bar`, both of the shape of the frame's. Called once for each state, from the last
    /// to the first.
    fn frame(&mut self, frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]) -> f64;
}

impl<F: FnMut(&LossFrame<'_>, &mut [f64], &mut [f64]) -> f64> Loss for F {
    fn frame(&mut self, frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]) -> f64 {
        self(frame, x_bar, v_bar)
    }
}
