//! Reference shapes of simplices of first and second order, and of isoparametric elements.
//!
//! At a quadrature point of weight `w` with gradients `b_a` of the shape functions, `F = sum_a x_a
//! b_a^T`, and `G` and `L` are formed likewise from `p` and the velocities. If reference positions move
//! by `d_a`, with `B = sum_a d_a b_a^T`,
//!
//! ```text
//! dw = w tr B      dF = -F B      dG = -G B      dL = -L B
//! ```
//!
//! so that the derivative of `w P(F) : G` is `w K : B`, `K = (P : G) I - F^T (dP/dF : G) - G^T P`. For
//! the viscous stress `F S`, `S = S(sym A)` with `A = F^T L`, and with `S_p = S(sym C)`, `C = F^T G`, it
//! is `K = (S : C) I - (A + A^T) S_p - (C + C^T) S`. Masses are functions of the `w` at points of their
//! own. For isoparametric elements, muscles, masses and forces per volume use these points, too; stresses
//! are computed by [the elements](pliant::energy::elastic::ShapedCells).

use pliant::algebra::Mat;
use pliant::dissipation::Viscosity;
use pliant::element::{CellKind, CellVisitor, Isoparametric, QuadraturePoint, mass_rule, order};
use pliant::energy::elastic::{CellShapes, points_of};
use pliant::material::{MaterialSpec, material_axes};
use pliant_scene::OverTime;
use pliant_terms::ElementSet;

use super::elements::{ElementEnergy, Maker};
use super::mass::{add_by_mass, by_mass, mode_by_mass, uniform_gravity};
use super::points::{VolumePoints, mean};
use super::{ForceUse, ModeUse, Parameter, ParameterNeeds, Together};
use pliant::algebra::dot;

/// Muscle tension along fibres.
#[derive(Clone, Debug)]
pub struct FibreTension {
    /// Direction of any length in each element, third component 0 in 2D.
    pub directions: Vec<[f64; 3]>,
    /// Tension as a function of the positions of the quadrature points [Pa].
    pub tension: OverTime,
}

/// Force per volume on elements, interpolated between their vertices.
#[derive(Clone, Debug)]
pub struct VolumeForce {
    /// Components as functions of the positions of vertices [N/m^d].
    pub components: Vec<OverTime>,
    /// Vertices with this value, by index in the simulation; it is zero at others.
    pub vertices: Vec<u32>,
}

/// Elements of a body with everything that depends on their reference shape.
#[derive(Clone, Copy, Debug)]
pub struct ShapedElements<'a> {
    /// Dimension, 2 or 3.
    pub dimension: usize,
    /// Order of simplices, 1 or 2.
    pub order: u32,
    /// Kind of isoparametric elements; `None` for simplices.
    pub kind: Option<&'a CellKind>,
    /// Vertices, by index in the simulation, flat: corners, then midside nodes, of each element.
    pub cells: &'a [u32],
    /// Reference positions of all vertices of the simulation, flat [m].
    pub rest: &'a [f64],
    /// Material of the elements.
    pub material: &'a MaterialSpec,
    /// Factors of the energy, one for each element; empty if all are 1.
    pub factors: &'a [f64],
    /// Rotation from material axes to spatial axes in each element, independent of its shape; empty if
    /// all are the identity.
    pub axes: &'a [Mat<f64, 3>],
    /// Muscle tensions along fibres.
    pub muscles: &'a [FibreTension],
    /// Forces per volume.
    pub body_forces: &'a [VolumeForce],
    /// Viscosity of the elements, independent of their stiffness.
    pub viscosity: Viscosity,
    /// Density [kg/m^3]; `None` if masses do not depend on volumes.
    pub density: Option<f64>,
    /// Gravity if masses are weights only, in statics [m/s^2]; `None` if they are inertia.
    pub weight: Option<[f64; 3]>,
}

impl ShapedElements<'_> {
    /// Parameter for the reference positions of `vertices`, by index in the simulation, which must be
    /// exactly those of the elements. They change deformation, volumes and masses; the initial state of
    /// the run does not change, nor do axes, fibres and the tension along them in each element.
    pub fn parameter(&self, vertices: &[u32]) -> Box<dyn Parameter> {
        let shape = self.shape(vertices);
        match self.kind.filter(|kind| kind.order() == 1) {
            Some(kind) => Box::new(Together::new(vec![Box::new(self.cells(kind, vertices)), shape])),
            None => shape,
        }
    }

    /// Dependence of elements of any kind on the reference positions of `vertices`, except for the
    /// stresses of isoparametric elements.
    fn shape(&self, vertices: &[u32]) -> Box<dyn Parameter> {
        match self.kind {
            Some(kind) if kind.order() == 1 => {
                return kind.visit_first(CellVolumes { of: self, vertices });
            }
            Some(kind) => return kind.visit_second(SecondOrderShape { of: self, vertices }),
            None => {}
        }
        match (self.dimension, self.order) {
            (2, 1) => Box::new(RestShape::<2, 3>::elements(self, vertices)),
            (2, _) => Box::new(RestShape::<2, 6>::elements(self, vertices)),
            (_, 1) => Box::new(RestShape::<3, 4>::elements(self, vertices)),
            _ => Box::new(RestShape::<3, 10>::elements(self, vertices)),
        }
    }

    /// Dependence of the stresses of isoparametric elements on the reference positions of `vertices`.
    fn cells(&self, kind: &CellKind, vertices: &[u32]) -> CellShape {
        let elements = ElementSet {
            body: "",
            dimension: self.dimension,
            cells: self.cells,
            rest: self.rest,
            stress: Default::default(),
            factors: None,
            axes: (!self.axes.is_empty()).then_some(self.axes),
        };
        let cells = pliant_terms::shaped_cells(self.material, kind, &elements, self.viscosity);
        let coordinate = |vertex: &u32| {
            let first = *vertex as usize * self.dimension;
            first..first + self.dimension
        };
        CellShape { cells, coordinates: vertices.iter().flat_map(coordinate).collect() }
    }
}

/// Parameter: reference positions of a body's vertices through the stresses of isoparametric elements.
struct CellShape {
    cells: Box<dyn CellShapes>,
    /// Index of each coordinate in the simulation.
    coordinates: Vec<usize>,
}

impl Parameter for CellShape {
    fn len(&self) -> usize {
        self.coordinates.len()
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        let mut rows = vec![0.0; of.x.len()];
        self.cells.add_curvatures(of.x, of.shape, &mut rows);
        derivative.iter_mut().zip(&self.coordinates).for_each(|(by, place)| *by += rows[*place]);
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let mut opposite = vec![0.0; of.x.len()];
        self.coordinates.iter().zip(change).for_each(|(place, change)| opposite[*place] = -change);
        self.cells.add_gradients((of.x, of.v), &opposite, force);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let mut rows = vec![0.0; of.x.len()];
        self.cells.add_works((of.x, of.v), of.p, &mut rows);
        derivative.iter_mut().zip(&self.coordinates).for_each(|(by, place)| *by -= rows[*place]);
    }
}

/// Builder for the contributions of isoparametric elements other than stresses.
struct CellVolumes<'a> {
    of: &'a ShapedElements<'a>,
    vertices: &'a [u32],
}

impl CellVisitor for CellVolumes<'_> {
    type Output = Box<dyn Parameter>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        Box::new(RestShape::<D, N>::cells(self.of, self.vertices, cell))
    }
}

/// Builder for second-order cells of any kind.
struct SecondOrderShape<'a> {
    of: &'a ShapedElements<'a>,
    vertices: &'a [u32],
}

impl CellVisitor for SecondOrderShape<'_> {
    type Output = Box<dyn Parameter>;

    fn visit<const D: usize, const N: usize>(self, _: &'static Isoparametric<D, N>) -> Self::Output {
        Box::new(RestShape::<D, N>::elements(self.of, self.vertices))
    }
}

/// Parameter: reference positions of a body's vertices.
struct RestShape<const D: usize, const N: usize> {
    /// Vertices of each element, by index in the simulation.
    elements: Vec<[u32; N]>,
    /// Quadrature points of the energies.
    points: VolumePoints<D, N>,
    /// Quadrature points of the masses; none if masses do not depend on volumes.
    masses: VolumePoints<D, N>,
    /// Quadrature points of the forces per volume; none without such forces.
    volumes: VolumePoints<D, N>,
    /// Reference positions of the body's vertices, third component 0 in 2D, if there are such forces [m].
    places: Vec<[f64; 3]>,
    /// Energy density; `None` for isoparametric elements, which have their own.
    psi: Option<Box<dyn ElementEnergy<D>>>,
    /// Factor of the energy of each element.
    factors: Vec<f64>,
    /// Material rotation of each element; empty if there is none.
    axes: Vec<Mat<f64, D>>,
    /// Tensions, with `a a^T` of the unit vector `a` in each element.
    muscles: Vec<(FibreTension, Vec<Mat<f64, D>>)>,
    /// Reference positions of the quadrature points of the energies, if there are muscles [m].
    point_places: Vec<[f64; 3]>,
    body_forces: Vec<VolumeForce>,
    viscosity: Viscosity,
    density: f64,
    weight: Option<[f64; 3]>,
    /// True if masses are lumped by squares of the shape functions (with inertia).
    by_squares: bool,
    /// Index of each vertex of the simulation in the body.
    place: Vec<u32>,
    vertices: usize,
}

/// Quadrature rule of `D + 1` points, each nearer to one corner, that is exact to degree 2 (products of
/// linear shape functions). Hammer, Stroud 1956, "Numerical integration over simplexes", Mathematical
/// Tables and Other Aids to Computation 10, 137.
fn corner_rule<const D: usize>() -> Vec<([f64; 4], f64)> {
    let corners = (D + 1) as f64;
    let far = (1.0 - 1.0 / (corners + 1.0).sqrt()) / corners;
    let point = |near: usize| {
        let mut at = [0.0; 4];
        at[..=D].fill(far);
        at[near] = 1.0 - D as f64 * far;
        (at, 1.0 / corners)
    };
    (0..=D).map(point).collect()
}

/// Forces per volume at the vertices of a body, with their gradients.
struct BodyForces<const D: usize> {
    values: Vec<[f64; D]>,
    /// Derivatives of each component by the coordinates.
    slopes: Vec<[[f64; 3]; D]>,
}

/// Gradient `sum_a x_a b_a^T` of rows of these vertices.
fn gradient<const D: usize, const N: usize>(
    rows: &[f64],
    element: &[u32; N],
    point: &QuadraturePoint<D, N>,
) -> Mat<f64, D> {
    point.deformation_gradient(&points_of(rows, element))
}

/// Projectors `a a^T` of the unit vectors `a` along these directions.
fn along<const D: usize>(directions: &[[f64; 3]]) -> Vec<Mat<f64, D>> {
    let of_element = |direction: &[f64; 3]| {
        // A rotation's first column is the unit vector.
        let axes = material_axes(direction, None);
        let mut both = Mat::zero();
        (0..D).for_each(|i| (0..D).for_each(|j| both[i][j] = axes[i][0] * axes[j][0]));
        both
    };
    directions.iter().map(of_element).collect()
}

/// Viscous stress `2 eta sym(A) + zeta tr(A) I`.
fn viscous<const D: usize>(viscosity: Viscosity, a: &Mat<f64, D>) -> Mat<f64, D> {
    a.symmetric().scale(2.0 * viscosity.shear) + Mat::scalar(viscosity.second * a.trace())
}

impl<const D: usize, const N: usize> RestShape<D, N> {
    /// Creates the shapes of simplices and of cells of second order.
    fn elements(of: &ShapedElements<'_>, vertices: &[u32]) -> Self {
        let elements = of.cells.as_chunks::<N>().0;
        let is_linear = order::<D, N>() == 1;
        let volume_points = |is_some: bool, linear: &[([f64; 4], f64)]| match (is_some, is_linear) {
            (false, _) => VolumePoints::none(),
            (true, true) => VolumePoints::new(elements, of.rest, linear),
            (true, false) => VolumePoints::new(elements, of.rest, &mass_rule::<D, N>()),
        };
        let centre = [1.0 / (D + 1) as f64; 4];
        RestShape {
            masses: volume_points(of.density.is_some(), &[(centre, 1.0)]),
            volumes: volume_points(!of.body_forces.is_empty(), &corner_rule::<D>()),
            psi: Some(of.material.visit::<D, _>(Maker)),
            viscosity: of.viscosity,
            by_squares: of.weight.is_none() && !is_linear,
            ..Self::of_points(of, vertices, VolumePoints::of_energy(elements, of.rest))
        }
    }

    /// Isoparametric elements: muscles, masses and forces per volume only.
    fn cells(of: &ShapedElements<'_>, vertices: &[u32], cell: &Isoparametric<D, N>) -> Self {
        let points = VolumePoints::of_cells(of.cells.as_chunks::<N>().0, of.rest, cell);
        let points_if = |is_some: bool| if is_some { points.clone() } else { VolumePoints::none() };
        RestShape {
            masses: points_if(of.density.is_some()),
            volumes: points_if(!of.body_forces.is_empty()),
            ..Self::of_points(of, vertices, points_if(!of.muscles.is_empty()))
        }
    }

    /// Elements without energy, masses and forces per volume.
    fn of_points(of: &ShapedElements<'_>, vertices: &[u32], points: VolumePoints<D, N>) -> Self {
        let mut place = vec![0; of.rest.len() / D];
        vertices.iter().zip(0..).for_each(|(vertex, i)| place[*vertex as usize] = i);
        let elements = of.cells.as_chunks::<N>().0.to_vec();
        let corner = |vertex: &u32| {
            let mut corner = [0.0; 3];
            corner[..D].copy_from_slice(&of.rest[*vertex as usize * D..][..D]);
            corner
        };
        RestShape {
            point_places: if of.muscles.is_empty() { vec![] } else { points.places(&elements, of.rest) },
            points,
            places: vertices.iter().filter(|_| !of.body_forces.is_empty()).map(corner).collect(),
            masses: VolumePoints::none(),
            volumes: VolumePoints::none(),
            psi: None,
            factors: if of.factors.is_empty() { vec![1.0; elements.len()] } else { of.factors.to_vec() },
            axes: of.axes.iter().map(Mat::leading).collect(),
            muscles: of.muscles.iter().map(|muscle| (muscle.clone(), along(&muscle.directions))).collect(),
            body_forces: of.body_forces.to_vec(),
            viscosity: Viscosity::default(),
            weight: of.weight,
            by_squares: false,
            vertices: vertices.len(),
            density: of.density.unwrap_or(0.0),
            elements,
            place,
        }
    }

    /// Elements with their indices and points.
    fn each(&self) -> impl Iterator<Item = (usize, &[u32; N], &[QuadraturePoint<D, N>])> {
        self.elements.iter().enumerate().map(|(i, element)| (i, element, self.points.all_of(i)))
    }

    /// Stress `P` of element `i` at its point `q`.
    fn stress(&self, (i, q): (usize, usize), f: &Mat<f64, D>, time: f64) -> Mat<f64, D> {
        let stress = match (&self.psi, self.axes.get(i)) {
            (None, _) => Mat::zero(),
            (Some(psi), None) => psi.stress(f),
            (Some(psi), Some(axes)) => psi.stress(&f.mul(axes)).mul_transpose(axes),
        };
        stress.scale(self.factors[i]) + self.tension((i, q), f, time)
    }

    /// Stress derivative `dP/dF : G` of element `i` without muscles.
    fn passive_along(&self, i: usize, f: &Mat<f64, D>, g: &Mat<f64, D>) -> Mat<f64, D> {
        let along = match (&self.psi, self.axes.get(i)) {
            (None, _) => Mat::zero(),
            (Some(psi), None) => psi.stress_along(f, g),
            (Some(psi), Some(axes)) => psi.stress_along(&f.mul(axes), &g.mul(axes)).mul_transpose(axes),
        };
        along.scale(self.factors[i])
    }

    /// Stress `T F a a^T` of all muscles, linear in `F`.
    fn tension(&self, (i, q): (usize, usize), f: &Mat<f64, D>, time: f64) -> Mat<f64, D> {
        let of_muscle = |(muscle, both): &(FibreTension, Vec<Mat<f64, D>>)| {
            let place = self.point_places[i * self.points.values.len() + q];
            f.mul(&both[i]).scale(muscle.tension.value(place, time))
        };
        self.muscles.iter().map(of_muscle).fold(Mat::zero(), |sum, stress| sum + stress)
    }

    /// Forces per volume at a time [N/m^d]; `None` if there are none.
    fn forces_at(&self, time: f64) -> Option<BodyForces<D>> {
        let count = self.places.len();
        let (mut values, mut slopes) = (vec![[0.0; D]; count], vec![[[0.0; 3]; D]; count]);
        for VolumeForce { components, vertices } in self.body_forces.iter().filter(|_| count > 0) {
            for at in vertices.iter().map(|vertex| self.place[*vertex as usize] as usize) {
                let (place, value, slope) = (self.places[at], &mut values[at], &mut slopes[at]);
                for (c, component) in components.iter().enumerate().take(D) {
                    value[c] += component.value(place, time);
                    slope[c].iter_mut().zip(component.slope(place, time)).for_each(|(sum, by)| *sum += by);
                }
            }
        }
        (!values.is_empty()).then_some(BodyForces { values, slopes })
    }

    /// Indices of the nodes of element `i` in the body.
    fn places_of(&self, i: usize) -> [usize; N] {
        self.elements[i].map(|vertex| self.place[vertex as usize] as usize)
    }

    /// Matrix `K` of the energy and viscosity of element `i` at its point `q`.
    fn rate(
        &self,
        ((i, q), element): ((usize, usize), &[u32; N]),
        point: &QuadraturePoint<D, N>,
        of: &ForceUse<'_>,
    ) -> Mat<f64, D> {
        let [f, g, l] = [of.x, of.p, of.v].map(|rows| gradient(rows, element, point));
        let stress = self.stress((i, q), &f, of.time);
        let along = self.passive_along(i, &f, &g) + self.tension((i, q), &g, of.time);
        let rate = Mat::scalar(stress.dot(&g)) - f.transpose_mul(&along) - g.transpose_mul(&stress);
        if self.viscosity == Viscosity::default() {
            return rate;
        }
        let (a, c) = (f.transpose_mul(&l), f.transpose_mul(&g));
        let [s, s_p] = [&a, &c].map(|rate| viscous(self.viscosity, rate));
        let twice = |m: &Mat<f64, D>| m.symmetric().scale(2.0);
        rate + Mat::scalar(s.dot(&c)) - twice(&a).mul(&s_p) - twice(&c).mul(&s)
    }

    /// Adds `-w dP/dB : B b_a` at the nodes of element `i`: the transpose of [`rate`](Self::rate).
    fn add_rate(
        &self,
        ((i, q), element): ((usize, usize), &[u32; N]),
        point: &QuadraturePoint<D, N>,
        (of, b): (&ForceUse<'_>, &Mat<f64, D>),
        force: &mut [f64],
    ) {
        let [f, l] = [of.x, of.v].map(|rows| gradient(rows, element, point));
        let (stress, growth, changed) = (self.stress((i, q), &f, of.time), b.trace(), f.mul(b));
        let along = self.passive_along(i, &f, &changed) + self.tension((i, q), &changed, of.time);
        let mut by_shape = stress.mul_transpose(b) + along - stress.scale(growth);
        if self.viscosity != Viscosity::default() {
            let a = f.transpose_mul(&l);
            let s = viscous(self.viscosity, &a);
            let change = viscous(self.viscosity, &(b.transpose_mul(&a) + a.mul(b)));
            let whole = f.mul(&s);
            by_shape += whole.mul_transpose(b) + f.mul(b).mul(&s) + f.mul(&change) - whole.scale(growth);
        }
        for (vertex, gradient) in element.iter().zip(&point.gradients) {
            let row = by_shape.mul_vec(gradient);
            let force = &mut force[*vertex as usize * D..][..D];
            force.iter_mut().zip(row).for_each(|(force, by)| *force += point.weight * by);
        }
    }

    /// Adds the derivative of `w K : B` at a point by the reference positions.
    fn spread(
        &self,
        element: &[u32; N],
        point: &QuadraturePoint<D, N>,
        rate: &Mat<f64, D>,
        derivative: &mut [f64],
    ) {
        for (vertex, gradient) in element.iter().zip(&point.gradients) {
            let row = rate.mul_vec(gradient);
            let derivative = &mut derivative[self.place[*vertex as usize] as usize * D..][..D];
            derivative.iter_mut().zip(row).for_each(|(by, row)| *by += point.weight * row);
        }
    }

    /// Derivatives of nodal masses by the volume of each point, `visit(q, node, dm/dw)`: `rho sum_q w
    /// N_a` in statics and for isoparametric elements; equal shares for first order; for second order
    /// `m_a = rho V t_a / T`, `t_a = sum_q w N_a^2`, `T = sum_a t_a`.
    fn each_mass(&self, i: usize, mut visit: impl FnMut(usize, usize, f64)) {
        let (mut squares, mut volume) = ([0.0; N], 0.0);
        for (point, values) in self.masses.of(i) {
            volume += point.weight;
            squares.iter_mut().zip(values).for_each(|(sum, n)| *sum += point.weight * n * n);
        }
        let trace: f64 = squares.iter().sum();
        for (q, (_, values)) in self.masses.of(i).enumerate() {
            let both: f64 = values.iter().map(|n| n * n).sum();
            for (a, n) in values.iter().enumerate() {
                let by_volume = if self.by_squares {
                    (squares[a] + volume * (n * n - squares[a] * both / trace)) / trace
                } else {
                    *n
                };
                visit(q, a, self.density * by_volume);
            }
        }
    }

    /// Adds the derivative by reference positions of the work of forces per volume along `p`, flat. The
    /// work at a point is `w N_a p_a . N_b f(X_b)`.
    fn spread_forces(&self, forces: &BodyForces<D>, p: &[f64], derivative: &mut [f64]) {
        for (i, element) in self.elements.iter().enumerate() {
            let (places, along) = (self.places_of(i), points_of::<D, N>(p, element));
            let values = places.map(|place| forces.values[place]);
            for (point, n) in self.volumes.of(i) {
                let (along, force) = (mean(&along, n), mean(&values, n));
                self.spread(element, point, &Mat::scalar(dot(&along, &force)), derivative);
                for (place, n) in places.iter().zip(n) {
                    let slope = &forces.slopes[*place];
                    let derivative = &mut derivative[place * D..][..D];
                    for (k, by) in derivative.iter_mut().enumerate() {
                        let changed: f64 = along.iter().zip(slope).map(|(p, slope)| p * slope[k]).sum();
                        *by += point.weight * n * changed;
                    }
                }
            }
        }
    }

    /// Adds the change of these forces if reference positions move by `change`, flat by the vertices of
    /// the body: the transpose of [`spread_forces`](Self::spread_forces).
    fn add_change_of_forces(&self, forces: &BodyForces<D>, change: &[f64], rows: &mut [f64]) {
        for (i, element) in self.elements.iter().enumerate() {
            let places = self.places_of(i);
            let moved = places.map(|place| {
                let mut moved = [0.0; D];
                moved.copy_from_slice(&change[place * D..][..D]);
                moved
            });
            let values = places.map(|place| forces.values[place]);
            let mut changed = [[0.0; D]; N];
            for ((changed, place), moved) in changed.iter_mut().zip(places).zip(&moved) {
                let slopes = &forces.slopes[place];
                changed.iter_mut().zip(slopes).for_each(|(changed, slope)| *changed = dot(slope, moved));
            }
            for (point, n) in self.volumes.of(i) {
                let growth = point.deformation_gradient(&moved).trace();
                let (force, changed) = (mean(&values, n), mean(&changed, n));
                for (vertex, n) in element.iter().zip(n) {
                    let row = rows[*vertex as usize * D..][..D].iter_mut();
                    row.zip(force.iter().zip(changed))
                        .for_each(|(row, (f, df))| *row += point.weight * n * (growth * f + df));
                }
            }
        }
    }

    /// Adds the derivative by reference positions through the masses, from a derivative by each vertex
    /// mass.
    fn spread_masses(&self, by_mass: impl Fn(usize) -> f64, derivative: &mut [f64]) {
        if self.density == 0.0 {
            return;
        }
        for (i, element) in self.elements.iter().enumerate() {
            let at_nodes = element.map(|vertex| by_mass(vertex as usize));
            let mut rates = vec![0.0; self.masses.values.len()];
            self.each_mass(i, |q, a, by_volume| rates[q] += by_volume * at_nodes[a]);
            for ((point, _), rate) in self.masses.of(i).zip(rates) {
                self.spread(element, point, &Mat::scalar(rate), derivative);
            }
        }
    }
}

impl<const D: usize, const N: usize> RestShape<D, N> {
    /// Calls `visit` with vertices and the changes of their masses if reference positions move by
    /// `change`, flat by the vertices of the body.
    fn each_mass_change(&self, change: &[f64], mut visit: impl FnMut(usize, f64)) {
        if self.density == 0.0 {
            return;
        }
        for (i, element) in self.elements.iter().enumerate() {
            let moved = points_of(change, &self.places_of(i).map(|place| place as u32));
            let growth =
                |point: &QuadraturePoint<D, N>| point.weight * point.deformation_gradient(&moved).trace();
            let growths: Vec<f64> = self.masses.of(i).map(|(point, _)| growth(point)).collect();
            let mut masses = [0.0; N];
            self.each_mass(i, |q, a, by_volume| masses[a] += by_volume * growths[q]);
            element.iter().zip(masses).for_each(|(vertex, mass)| visit(*vertex as usize, mass));
        }
    }
}

impl<const D: usize, const N: usize> Parameter for RestShape<D, N> {
    fn len(&self) -> usize {
        D * self.vertices
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        let force = self.density != 0.0 && self.weight.is_none();
        ParameterNeeds { force, ..ParameterNeeds::default() }
    }

    /// The state moves along with the reference shape: `F` stays, and `G` of a mode changes by `-G B`.
    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        for (i, element, points) in self.each() {
            for point in points {
                let [f, g] = [of.x, of.shape].map(|rows| gradient(rows, element, point));
                // Without forces, muscles have no tension.
                let along = self.passive_along(i, &f, &g);
                let rate = Mat::scalar(along.dot(&g)) - g.transpose_mul(&along).scale(2.0);
                self.spread(element, point, &rate, derivative);
            }
        }
        self.spread_masses(|vertex| mode_by_mass(of, vertex), derivative);
        of.is_lumped
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let gravity = self.weight.unwrap_or_else(|| uniform_gravity(of.system));
        if let Some(forces) = self.forces_at(of.time) {
            self.add_change_of_forces(&forces, change, force);
        }
        for (i, element, points) in self.each() {
            let moved = points_of(change, &element.map(|vertex| self.place[vertex as usize]));
            for (q, point) in points.iter().enumerate() {
                self.add_rate(((i, q), element), point, (of, &point.deformation_gradient(&moved)), force);
            }
        }
        self.each_mass_change(change, |vertex, mass| match self.weight {
            Some(_) => {
                let force = &mut force[vertex * D..][..D];
                force.iter_mut().zip(gravity).for_each(|(force, g)| *force += mass * g);
            }
            None => add_by_mass(of, &gravity, vertex, mass, force),
        });
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (i, element, points) in self.each() {
            for (q, point) in points.iter().enumerate() {
                let rate = self.rate(((i, q), element), point, of).scale(-1.0);
                self.spread(element, point, &rate, derivative);
            }
        }
        let gravity = self.weight.unwrap_or_else(|| uniform_gravity(of.system));
        let by_weight = |vertex: usize| of.p[vertex * D..][..D].iter().zip(gravity).map(|(p, g)| p * g).sum();
        if let Some(forces) = self.forces_at(of.time) {
            self.spread_forces(&forces, of.p, derivative);
        }
        match self.weight {
            Some(_) => self.spread_masses(by_weight, derivative),
            None => self.spread_masses(|vertex| by_mass(of, &gravity, vertex), derivative),
        }
    }
}
