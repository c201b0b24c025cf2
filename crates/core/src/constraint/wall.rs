//! Walls: rigid half-spaces without friction.
use crate::algebra::{cross, direction, dot};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::scalar::{Compared, Mask};

/// Keeps vertices in `normal . x >= offset`, as the lecture's cantilever does (lecture 21). A vertex
/// behind the plane is moved back onto it, and its velocity into the wall is set to zero: an inelastic,
/// frictionless impact.
///
/// ```
/// use pliant::constraint::Wall;
///
/// let floor = Wall::new(&[0.0, 2.0], 0.5);
/// let (mut x, mut v) = ([3.0, 0.4], [1.0, -2.0]);
/// let stopped = |vertex, speed| assert_eq!((vertex, speed), (0, 2.0));
/// assert!(floor.apply(&[1.0, 1.0], &mut x, &mut v, stopped));
/// assert_eq!((x, v), ([3.0, 0.5], [1.0, 0.0]));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    normal: Vec<f64>,
    offset: f64,
}

impl Wall {
    /// Creates the half-space `normal . x >= offset`. `normal` is scaled to unit length; `offset` [m] is
    /// along the unit normal.
    ///
    /// # Panics
    /// If the normal is zero or not finite, or does not have two or three components; scenes are checked
    /// before.
    pub fn new(normal: &[f64], offset: f64) -> Self {
        assert!(matches!(normal.len(), 2 | 3), "a wall is in two or three dimensions");
        let unit = direction(normal);
        assert!(unit.is_some(), "a wall has a direction");
        let unit = unit.into_iter().flatten().take(normal.len());
        Wall { normal: unit.collect(), offset }
    }

    /// Returns the unit normal, pointing out of the wall.
    pub fn normal(&self) -> &[f64] {
        &self.normal
    }

    /// Returns the distance of the plane from the origin along the normal [m].
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Returns the point of the plane nearest to the origin [m]; third component 0 in 2D.
    pub fn foot(&self) -> [f64; 3] {
        let mut foot = [0.0; 3];
        foot.iter_mut().zip(&self.normal).for_each(|(foot, n)| *foot = self.offset * n);
        foot
    }

    /// Returns the moment [N m] about the [foot](Self::foot) of the force `force` [N] at the point `x`
    /// [m]; in 2D only the third component.
    #[inline]
    pub fn moment(&self, x: &[f64], force: [f64; 3]) -> [f64; 3] {
        let mut arm = self.foot().map(|foot| -foot);
        arm.iter_mut().zip(x).for_each(|(arm, x)| *arm += x);
        cross(&arm, &force)
    }

    /// Returns the distance of `x` behind the plane [m].
    pub fn depth(&self, x: &[f64]) -> f64 {
        self.offset - dot(&self.normal, x)
    }

    /// True if [`apply`](Self::apply) would move any vertex.
    pub fn is_crossed(&self, inverse_mass: &[f64], x: &[f64]) -> bool {
        let d = self.normal.len();
        self.is_reached(x)
            && x.chunks_exact(d).zip(inverse_mass.chunks_exact(d)).any(|(x, w)| {
                let yields = |c: usize| w[c] != 0.0 && self.normal[c] != 0.0;
                self.depth(x) > 0.0 && (0..d).any(yields)
            })
    }

    /// True if any vertex is behind the plane. In most steps none is, and this check is the whole cost.
    fn is_reached(&self, x: &[f64]) -> bool {
        let offset = self.offset;
        match self.normal[..] {
            [n0, n1] => dispatch(BehindWallKernel { normal: &[n0, n1], offset, x }),
            _ => {
                let normal = &[self.normal[0], self.normal[1], self.normal[2]];
                dispatch(BehindWallKernel { normal, offset, x })
            }
        }
    }

    /// Moves vertices back; returns whether any position changed. `stopped` receives each vertex that
    /// moved into the wall: its number, and the size `s` [m/s] of the velocity change `s n` along the
    /// unit normal `n`, which does not act on constrained coordinates. Constrained coordinates (zero
    /// inverse mass; one value per coordinate) are unchanged: such a vertex moves to the plane along its
    /// free coordinates, if possible.
    pub fn apply(
        &self,
        inverse_mass: &[f64],
        x: &mut [f64],
        v: &mut [f64],
        stopped: impl FnMut(usize, f64),
    ) -> bool {
        if !self.is_reached(x) {
            return false;
        }
        match self.normal[..] {
            [n0, n1] => self.put_back([n0, n1], inverse_mass, x, v, stopped),
            _ => self.put_back([self.normal[0], self.normal[1], self.normal[2]], inverse_mass, x, v, stopped),
        }
    }

    /// Moves vertices back as [`apply`](Self::apply) does, for the plane with this normal.
    #[inline(always)]
    fn put_back<const D: usize>(
        &self,
        normal: [f64; D],
        inverse_mass: &[f64],
        x: &mut [f64],
        v: &mut [f64],
        mut stopped: impl FnMut(usize, f64),
    ) -> bool {
        let mut moved = false;
        let rows = x.as_chunks_mut::<D>().0.iter_mut().zip(v.as_chunks_mut::<D>().0);
        for (vertex, ((x, v), w)) in rows.zip(inverse_mass.as_chunks::<D>().0).enumerate() {
            let depth = self.offset - dot(&normal, x);
            if depth <= 0.0 {
                continue;
            }
            // A vertex with constrained coordinates moves along its free ones.
            if w.contains(&0.0) {
                if let Some(size) = self.slide(depth, w, x, v) {
                    moved = true;
                    if size > 0.0 {
                        stopped(vertex, size);
                    }
                }
                continue;
            }
            moved = true;
            let into = dot(&normal, v).min(0.0);
            for c in 0..D {
                x[c] += depth * normal[c];
                v[c] -= into * normal[c];
            }
            if into < 0.0 {
                stopped(vertex, -into);
            }
        }
        moved
    }

    /// Moves a vertex that is `depth` [m] behind the plane back along its free coordinates. Returns the
    /// size of its velocity change along the normal [m/s]; `None` if it cannot move.
    fn slide(&self, depth: f64, inverse_mass: &[f64], x: &mut [f64], v: &mut [f64]) -> Option<f64> {
        let free = |c: usize| if inverse_mass[c] == 0.0 { 0.0 } else { self.normal[c] };
        let length2 = (0..x.len()).map(|c| free(c) * free(c)).sum::<f64>();
        if length2 == 0.0 {
            return None;
        }
        let into = dot(&self.normal, v).min(0.0);
        for c in 0..x.len() {
            x[c] += depth * free(c) / length2;
            v[c] -= into * free(c) / length2;
        }
        Some(-into / length2)
    }
}

/// Checks whether any of the rows `x` is behind a plane.
struct BehindWallKernel<'a, const D: usize> {
    normal: &'a [f64; D],
    offset: f64,
    x: &'a [f64],
}

impl<const D: usize> Kernel for BehindWallKernel<'_, D> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let (packs, rest) = self.x.as_chunks::<D>().0.as_chunks::<WIDTH>();
        let offset = L::splat(self.offset);
        // Running maximum of the depths, eight at a time.
        let mut depth = L::splat(f64::NEG_INFINITY);
        for rows in packs {
            let x: [L; D] = L::load_interleaved(rows);
            let mut height = L::splat(self.normal[0]) * x[0];
            for c in 1..D {
                height += L::splat(self.normal[c]) * x[c];
            }
            // With this argument order NaN does not hide other vertices.
            depth = Compared::max(offset - height, depth);
        }
        let behind = L::zero().lt(depth).any();
        rest.iter().fold(behind, |any, x| any | (self.offset - dot(self.normal, x) > 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // lecture 21
    #[test]
    fn a_vertex_that_crossed_is_put_back_and_keeps_its_tangential_velocity() {
        let wall = Wall::new(&[2.0, 0.0], 0.1);
        let (mut x, mut v) = (vec![0.05, 0.7, 0.2, 0.7, 0.0, 0.0], vec![-3.0, 1.0, -3.0, 1.0, -1.0, 0.0]);
        let free = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0];
        assert!(wall.is_crossed(&free, &x) && wall.apply(&free, &mut x, &mut v, |_, _| {}));
        assert!(!wall.is_crossed(&free, &x));
        assert_eq!(x, [0.1, 0.7, 0.2, 0.7, 0.0, 0.0]);
        assert_eq!(v, [0.0, 1.0, -3.0, 1.0, -1.0, 0.0]);
        let mut leaving = vec![3.0, 0.0];
        assert!(wall.apply(&[1.0, 1.0], &mut [0.0, 0.0], &mut leaving, |_, _| {}));
        assert_eq!(leaving, [3.0, 0.0]);
        assert!(!wall.apply(&[1.0, 1.0], &mut [0.1, 0.0], &mut [-1.0, 0.0], |_, _| {}));
    }

    #[test]
    fn a_vertex_with_a_held_coordinate_goes_back_along_the_others() {
        let wall = Wall::new(&[3.0, 4.0], 0.0);
        let (mut x, mut v) = (vec![-1.0, 0.5], vec![-2.0, 1.0]);
        assert!(wall.apply(&[1.0, 0.0], &mut x, &mut v, |_, _| {}));
        // On the plane 0.6 x + 0.8 y = 0, and along it where y moves at 1.
        assert!((x[0] + 0.5 * 0.8 / 0.6).abs() < 1e-15 && x[1] == 0.5, "{x:?}");
        assert!((v[0] + 0.8 / 0.6).abs() < 1e-15 && v[1] == 1.0, "{v:?}");
        let (mut x, mut v) = (vec![-1.0, -1.0], vec![-2.0, 0.0]);
        assert!(!Wall::new(&[1.0, 0.0], 0.0).apply(&[0.0, 1.0], &mut x, &mut v, |_, _| {}));
        assert_eq!((x, v), (vec![-1.0, -1.0], vec![-2.0, 0.0]));
    }

    #[test]
    fn a_normal_may_be_of_any_size() {
        for size in [f64::from_bits(1), 1e-300, 1e-163, 1e155, 1e300] {
            let wall = Wall::new(&[0.0, -size], 1.0);
            assert_eq!((wall.normal(), wall.depth(&[0.0, -3.0])), (&[0.0, -1.0][..], -2.0), "{size:e}");
            assert_eq!(Wall::new(&[size, 0.0, 0.0], 1.0).foot(), [1.0, 0.0, 0.0], "{size:e}");
        }
    }

    // lecture 21: vertices are checked eight at a time, and a NaN position hides no other vertex.
    #[test]
    fn the_vertex_that_crossed_is_found_wherever_it_is() {
        for d in [2, 3] {
            let wall = Wall::new(&[0.0, 1.0, 0.0][..d], -0.5);
            for n in 1..20 {
                for crossed in 0..n {
                    let mut x = vec![0.25; n * d];
                    x[crossed * d + 1] = -0.75;
                    for lost in crossed + 1..n {
                        x[lost * d] = f64::NAN;
                    }
                    let (mut v, w) = (vec![-1.0; n * d], vec![1.0; n * d]);
                    assert!(
                        wall.is_crossed(&w, &x) && wall.apply(&w, &mut x, &mut v, |_, _| {}),
                        "{crossed} of {n} in {d}D"
                    );
                    assert_eq!((x[crossed * d + 1], v[crossed * d + 1]), (-0.5, 0.0));
                    assert!(!wall.apply(&w, &mut x, &mut v, |_, _| {}), "none is left behind it");
                }
            }
        }
    }
}
