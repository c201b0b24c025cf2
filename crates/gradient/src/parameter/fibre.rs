//! Fibres of a muscle in linear elements: their directions, and the places that their tension goes by.
//!
//! Of an element of rest volume `w` with the tension `T` along the unit vector `a`, `p . dE/dx = w T G a . F
//! a`, whose derivative by `a` is `w T (F^T G + G^T F) a`.

use pliant::algebra::{Mat, Vect, unit};
use pliant_scene::OverTime;

use super::elements::{LinearElements, ModulusElements};
use super::{ForceUse, Parameter};

/// Components of the direction of each element.
struct FibreDirections<const D: usize, const N: usize> {
    elements: ModulusElements<D, N>,
    tension: OverTime,
    /// Means of the corners at rest [m].
    centres: Vec<[f64; 3]>,
    /// Unit vectors, and the lengths of the directions that are given.
    directions: Vec<(Vect<f64, D>, f64)>,
}

impl<const D: usize, const N: usize> FibreDirections<D, N> {
    /// `w T` of element `i`.
    fn pull(&self, i: usize, time: f64) -> f64 {
        self.elements.volume(i) * self.tension.value(self.centres[i], time)
    }
}

/// `(I - a a^T) v / l`: how a unit vector changes with a vector of length `l` along it, and its transpose.
fn across<const D: usize>((a, length): &(Vect<f64, D>, f64), v: Vect<f64, D>) -> Vect<f64, D> {
    let along: f64 = a.iter().zip(v).map(|(a, v)| a * v).sum();
    let mut across = v;
    across.iter_mut().zip(a).for_each(|(v, a)| *v = (*v - along * a) / length);
    across
}

impl<const D: usize, const N: usize> Parameter for FibreDirections<D, N> {
    fn len(&self) -> usize {
        D * self.directions.len()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (i, (change, direction)) in change.as_chunks::<D>().0.iter().zip(&self.directions).enumerate() {
            let [f, _] = self.elements.deformation(i, (of.x, of.x));
            let (a, turn) = (direction.0, across(direction, *change));
            let mut both = Mat::zero();
            (0..D).for_each(|r| (0..D).for_each(|c| both[r][c] = turn[r] * a[c] + a[r] * turn[c]));
            let tension = self.tension.value(self.centres[i], of.time);
            self.elements.add_at(i, &f.mul(&both).scale(-tension), force);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let each = derivative.as_chunks_mut::<D>().0.iter_mut().zip(&self.directions);
        for (i, (derivative, direction)) in each.enumerate() {
            let [f, g] = self.elements.deformation(i, (of.x, of.p));
            let by_unit = (f.transpose_mul(&g) + g.transpose_mul(&f)).mul_vec(&direction.0);
            let pull = self.pull(i, of.time);
            derivative.iter_mut().zip(across(direction, by_unit)).for_each(|(d, by)| *d -= pull * by);
        }
    }
}

/// Middles of elements at rest as tension goes by them.
struct TensionPlaces<const D: usize, const N: usize>(FibreDirections<D, N>);

impl<const D: usize, const N: usize> TensionPlaces<D, N> {
    /// Slope of the tension in element `i`.
    fn slope(&self, i: usize, time: f64) -> [f64; 3] {
        self.0.tension.slope(self.0.centres[i], time)
    }
}

impl<const D: usize, const N: usize> Parameter for TensionPlaces<D, N> {
    fn len(&self) -> usize {
        D * self.0.directions.len()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let each = change.as_chunks::<D>().0.iter().zip(&self.0.directions);
        for (i, (change, (a, _))) in each.enumerate() {
            let [f, _] = self.0.elements.deformation(i, (of.x, of.x));
            let growth: f64 = change.iter().zip(self.slope(i, of.time)).map(|(c, slope)| c * slope).sum();
            let stress = Mat(f.mul_vec(a).map(|along| a.map(|a| -growth * along * a)));
            self.0.elements.add_at(i, &stress, force);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let each = derivative.as_chunks_mut::<D>().0.iter_mut().zip(&self.0.directions);
        for (i, (derivative, (a, _))) in each.enumerate() {
            let [f, g] = self.0.elements.deformation(i, (of.x, of.p)).map(|m| m.mul_vec(a));
            let along: f64 = f.iter().zip(g).map(|(f, g)| f * g).sum();
            let work = self.0.elements.volume(i) * along;
            derivative.iter_mut().zip(self.slope(i, of.time)).for_each(|(d, slope)| *d -= work * slope);
        }
    }
}

impl LinearElements<'_> {
    /// Coordinates of the middles of elements at rest as the `tension` of a muscle goes by them, flat
    /// `(elements, dimension)`; its fibres and the middles as [`fibres`](Self::fibres) has them.
    pub fn tension_places(
        &self,
        directions: &[[f64; 3]],
        tension: OverTime,
        centres: Vec<[f64; 3]>,
    ) -> Box<dyn Parameter> {
        match self.dimension {
            2 => Box::new(TensionPlaces(self.fibres_of::<2, 3>(directions, tension, centres))),
            _ => Box::new(TensionPlaces(self.fibres_of::<3, 4>(directions, tension, centres))),
        }
    }

    /// Components of the directions of the fibres of a muscle of this `tension`, flat `(elements,
    /// dimension)`: as given, third component 0 in 2D, in elements whose corners have the means `centres` at
    /// rest [m].
    pub fn fibres(
        &self,
        directions: &[[f64; 3]],
        tension: OverTime,
        centres: Vec<[f64; 3]>,
    ) -> Box<dyn Parameter> {
        match self.dimension {
            2 => Box::new(self.fibres_of::<2, 3>(directions, tension, centres)),
            _ => Box::new(self.fibres_of::<3, 4>(directions, tension, centres)),
        }
    }

    fn fibres_of<const D: usize, const N: usize>(
        &self,
        directions: &[[f64; 3]],
        tension: OverTime,
        centres: Vec<[f64; 3]>,
    ) -> FibreDirections<D, N> {
        let of_element = |direction: &[f64; 3]| unit(&std::array::from_fn(|c| direction[c]));
        FibreDirections {
            elements: ModulusElements::new(self.cells, self.rest),
            directions: directions.iter().map(of_element).collect(),
            tension,
            centres,
        }
    }
}
