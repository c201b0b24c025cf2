//! Degenerate initial states, the same on every machine.

/// Perturbation of the free vertices of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// Each vertex at a quasirandom point of the bounding box.
    Scramble,
    /// All vertices in the middle plane of the box, across the first axis.
    Plane,
    /// All vertices at the centre of the box.
    Point,
    /// Mirrored at the lower end of the box, along the first axis.
    Inverted,
    /// Stretched tenfold from the lower end of the box, along the first axis.
    Stretch,
}

impl Start {
    /// All starts.
    pub const ALL: [Start; 5] =
        [Start::Scramble, Start::Plane, Start::Point, Start::Inverted, Start::Stretch];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Start::Scramble => "scramble",
            Start::Plane => "plane",
            Start::Point => "point",
            Start::Inverted => "inverted",
            Start::Stretch => "stretch",
        }
    }

    /// Displaces the `free` coordinates. `x` is flat and in the reference configuration on entry [m].
    /// Vertex `i` has the number `i` in the sequence
    /// `x_(i,k) = lower_k + extent_k frac(1/2 + (i + 1) g_k)`, with `1/g_1` the root of `r^(d+1) = r + 1`
    /// and `g_k = g_1^k`: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences".
    pub fn apply(self, dimension: usize, x: &mut [f64], free: impl Fn(usize) -> bool) {
        let d = dimension;
        let bound =
            |c: usize, pick: fn(f64, f64) -> f64, from| x.iter().skip(c).step_by(d).copied().fold(from, pick);
        let low: Vec<f64> = (0..d).map(|c| bound(c, f64::min, f64::INFINITY)).collect();
        let high: Vec<f64> = (0..d).map(|c| bound(c, f64::max, f64::NEG_INFINITY)).collect();
        for i in 0..x.len() {
            let (vertex, c) = (i / d, i % d);
            if !free(i) {
                continue;
            }
            let middle = 0.5 * (low[c] + high[c]);
            match self {
                Start::Scramble => {
                    let at = (0.5 + (vertex as f64 + 1.0) * generator(d)[c]).fract();
                    x[i] = low[c] + (high[c] - low[c]) * at;
                }
                Start::Plane if c == 0 => x[i] = middle,
                Start::Point => x[i] = middle,
                Start::Inverted if c == 0 => x[i] = 2.0 * low[c] - x[i],
                Start::Stretch if c == 0 => x[i] = low[c] + 10.0 * (x[i] - low[c]),
                _ => {}
            }
        }
    }
}

/// Generator `g_1, .., g_d`.
fn generator(dimension: usize) -> [f64; 3] {
    match dimension {
        2 => [0.754_877_666_246_692_7, 0.569_840_290_998_053_2, 0.0],
        _ => [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generators_are_powers_of_the_root() {
        for d in [2, 3] {
            let g = generator(d);
            let root = 1.0 / g[0];
            assert!((root.powi(d as i32 + 1) - root - 1.0).abs() < 1e-14);
            for k in 0..d {
                assert!((g[k] - g[0].powi(k as i32 + 1)).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn what_is_held_stays_and_the_rest_goes_where_it_should() {
        let rest = [0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 2.0, 1.0];
        let moved = |start: Start| {
            let mut x = rest;
            start.apply(2, &mut x, |i| i > 1);
            x
        };
        assert_eq!(moved(Start::Plane), [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(moved(Start::Point), [0.0, 0.0, 1.0, 0.5, 1.0, 0.5, 1.0, 0.5]);
        assert_eq!(moved(Start::Inverted), [0.0, 0.0, -2.0, 0.0, 0.0, 1.0, -2.0, 1.0]);
        assert_eq!(moved(Start::Stretch), [0.0, 0.0, 20.0, 0.0, 0.0, 1.0, 20.0, 1.0]);
        let scrambled = moved(Start::Scramble);
        assert_eq!(scrambled[..2], rest[..2]);
        assert!((scrambled[2] - 2.0 * (0.5 + 2.0 * 0.754_877_666_246_692_7_f64).fract()).abs() < 1e-15);
    }
}
