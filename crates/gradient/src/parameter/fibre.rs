//! Fibres of a muscle in elements: their directions, and the positions on which their tension depends.
//!
//! At a point of reference volume `w` with the tension `T` along the unit vector `a`, `p . dE/dx = w T G
//! a . F a`, whose derivative by `a` is `w T (F^T G + G^T F) a`.

use pliant::algebra::{Mat, Vect, unit};
use pliant_scene::OverTime;

use super::elements::{BodyElements, ElementsVisitor, ModulusElements};
use super::{ForceUse, NumberLink, Parameter, Weighted};

/// Parameter: components of the fibre direction of each element.
struct FibreDirections<const D: usize, const N: usize> {
    elements: ModulusElements<D, N>,
    tension: OverTime,
    /// Reference positions of the quadrature points [m].
    places: Vec<[f64; 3]>,
    /// Unit vectors, and the lengths of the directions as given.
    directions: Vec<(Vect<f64, D>, f64)>,
}

/// Derivative `(I - a a^T) v / l` of a unit vector by a vector of length `l` along it, and its transpose.
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
            let (a, turn) = (direction.0, across(direction, *change));
            let mut both = Mat::zero();
            (0..D).for_each(|r| (0..D).for_each(|c| both[r][c] = turn[r] * a[c] + a[r] * turn[c]));
            for at in self.elements.at(i) {
                let [f, _] = at.deformation((of.x, of.x));
                let tension = self.tension.value(self.places[at.number], of.time);
                at.add(&f.mul(&both).scale(-tension), force);
            }
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let each = derivative.as_chunks_mut::<D>().0.iter_mut().zip(&self.directions);
        for (i, (derivative, direction)) in each.enumerate() {
            let mut by_unit = [0.0; D];
            for at in self.elements.at(i) {
                let [f, g] = at.deformation((of.x, of.p));
                let of_point = (f.transpose_mul(&g) + g.transpose_mul(&f)).mul_vec(&direction.0);
                let pull = at.volume() * self.tension.value(self.places[at.number], of.time);
                by_unit.iter_mut().zip(of_point).for_each(|(sum, by)| *sum += pull * by);
            }
            derivative.iter_mut().zip(across(direction, by_unit)).for_each(|(d, by)| *d -= by);
        }
    }
}

/// Parameter: reference positions of the quadrature points, on which the tension depends.
struct TensionPlaces<const D: usize, const N: usize>(FibreDirections<D, N>);

impl<const D: usize, const N: usize> TensionPlaces<D, N> {
    /// Gradient of the tension at the point with this index.
    fn slope(&self, number: usize, time: f64) -> [f64; 3] {
        self.0.tension.slope(self.0.places[number], time)
    }
}

impl<const D: usize, const N: usize> Parameter for TensionPlaces<D, N> {
    fn len(&self) -> usize {
        D * self.0.places.len()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (i, (a, _)) in self.0.directions.iter().enumerate() {
            for at in self.0.elements.at(i) {
                let [f, _] = at.deformation((of.x, of.x));
                let (change, slope) = (&change[at.number * D..][..D], self.slope(at.number, of.time));
                let growth: f64 = change.iter().zip(slope).map(|(c, slope)| c * slope).sum();
                at.add(&Mat(f.mul_vec(a).map(|along| a.map(|a| -growth * along * a))), force);
            }
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (i, (a, _)) in self.0.directions.iter().enumerate() {
            for at in self.0.elements.at(i) {
                let [f, g] = at.deformation((of.x, of.p)).map(|m| m.mul_vec(a));
                let work = at.volume() * f.iter().zip(g).map(|(f, g)| f * g).sum::<f64>();
                let (derivative, slope) =
                    (&mut derivative[at.number * D..][..D], self.slope(at.number, of.time));
                derivative.iter_mut().zip(slope).for_each(|(d, slope)| *d -= work * slope);
            }
        }
    }
}

/// Builder of the parameter for the fibre directions of a muscle.
struct FibreMaker<'a> {
    rest: &'a [f64],
    directions: &'a [[f64; 3]],
    tension: OverTime,
}

impl FibreMaker<'_> {
    fn fibres<const D: usize, const N: usize>(
        self,
        elements: ModulusElements<D, N>,
    ) -> FibreDirections<D, N> {
        let of_element = |direction: &[f64; 3]| unit(&std::array::from_fn(|c| direction[c]));
        FibreDirections {
            places: elements.places(self.rest),
            elements,
            directions: self.directions.iter().map(of_element).collect(),
            tension: self.tension,
        }
    }
}

impl ElementsVisitor for FibreMaker<'_> {
    fn visit<const D: usize, const N: usize>(self, elements: ModulusElements<D, N>) -> Box<dyn Parameter> {
        Box::new(self.fibres(elements))
    }
}

/// Builder of the parameter for reference positions of vertices, on which the tension of a muscle
/// depends.
struct TensionPlaceMaker<'a> {
    fibres: FibreMaker<'a>,
    /// Vertices by index in the simulation.
    vertices: &'a [u32],
}

impl ElementsVisitor for TensionPlaceMaker<'_> {
    fn visit<const D: usize, const N: usize>(self, elements: ModulusElements<D, N>) -> Box<dyn Parameter> {
        let TensionPlaceMaker { fibres, vertices } = self;
        let mut number = vec![0; fibres.rest.len() / D];
        vertices.iter().enumerate().for_each(|(i, vertex)| number[*vertex as usize] = i);
        let fibres = fibres.fibres(elements);
        let mut links = vec![];
        for (point, (element, values)) in fibres.elements.nodes().enumerate() {
            for (vertex, weight) in element.iter().zip(values) {
                let with = number[*vertex as usize] * D;
                let link = |c| NumberLink { number: point * D + c, with: with + c, weight: *weight };
                links.extend((0..D).map(link));
            }
        }
        Box::new(Weighted::linked(Box::new(TensionPlaces(fibres)), links, vertices.len() * D))
    }
}

impl BodyElements<'_> {
    /// Parameter for the reference positions of `vertices`, by index in the simulation, through the
    /// `tension` of a muscle at quadrature points; fibres as in [`fibres`](Self::fibres).
    pub fn tension_places(
        &self,
        directions: &[[f64; 3]],
        tension: OverTime,
        vertices: &[u32],
    ) -> Box<dyn Parameter> {
        let fibres = FibreMaker { rest: self.rest, directions, tension };
        self.visit(TensionPlaceMaker { fibres, vertices })
    }

    /// Parameter for the components of the fibre directions of a muscle with this `tension`, flat
    /// `(elements, dimension)`: as given, third component 0 in 2D.
    pub fn fibres(&self, directions: &[[f64; 3]], tension: OverTime) -> Box<dyn Parameter> {
        self.visit(FibreMaker { rest: self.rest, directions, tension })
    }
}
