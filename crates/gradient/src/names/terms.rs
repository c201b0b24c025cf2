//! Terms of a body with other constants, as derivatives by parameters.

use pliant::algebra::{self, Mat};
use pliant::dissipation::{AtRest, DissipativeTerm, MassProportional, Viscosity};
use pliant::element::CellBlock;
use pliant::energy::EnergyTerm;
use pliant::energy::measure::StencilConstants;
use pliant::material::{MaterialSpec, Plane, material_axes};
use pliant::topology::BodyTopology;
use pliant_scene::{Body, DampingSpec, OneOrMany};
use pliant_terms::{ElementSet, ViscousSet};

use super::materials::{isotropic, rates_by_poisson, young};
use super::{Places, order};

/// Directions of the first axes, and of the second ones, if any.
type AxisVectors = (Vec<[f64; 3]>, Option<Vec<[f64; 3]>>);

impl Places<'_> {
    /// Dissipation terms that add up to the derivative of a body's dissipation by a number.
    pub(super) fn dissipation(
        &self,
        spec: &Body,
        material: &MaterialSpec,
        body: &BodyTopology,
        key: &str,
    ) -> Option<Vec<(f64, Box<dyn DissipativeTerm>)>> {
        let Some(damping) = &spec.damping else { return Some(vec![]) };
        let (rate, plane) = (damping.strain_rate_viscosity(), material.plane());
        let proportional = damping.proportional_viscosity(material, plane);
        // The viscosity of the material `linear` is evaluated in the reference configuration, as a
        // separate term.
        let is_apart = matches!(material, MaterialSpec::Linear(_));
        let whole = rate.plus(proportional);
        let of_rate = |shear, second| {
            let about = if is_apart { rate } else { whole };
            vec![(1.0, self.viscous(Viscosity { shear, second }, about, body))]
        };
        let of_stiffness = |factor, change| {
            let term = self.viscous(change, if is_apart { proportional } else { whole }, body);
            vec![(factor, self.about(material, term))]
        };
        Some(match key {
            "damping.strain_rate.shear" => of_rate(1.0, 0.0),
            "damping.strain_rate.second" => of_rate(0.0, 1.0),
            "damping.stiffness_proportional" => {
                let of_second = DampingSpec { stiffness_proportional: Some(1.0), ..damping.clone() };
                of_stiffness(1.0, of_second.proportional_viscosity(material, plane))
            }
            _ if proportional == Viscosity::default() => vec![],
            "elastic.young" => of_stiffness(1.0 / young(material)?, proportional),
            _ => {
                let in_plane_stress = self.topology.dimension == 2 && plane == Some(Plane::Stress);
                let (shear, second) = rates_by_poisson(&isotropic(material)?.0, in_plane_stress);
                of_stiffness(damping.stiffness_proportional?, Viscosity { shear, second })
            }
        })
    }

    /// Dashpots of 1 N s/m parallel to the springs of a body.
    pub(super) fn unit_dashpots(&self, body: &BodyTopology) -> Box<dyn DissipativeTerm> {
        let rest = self.numbering.to_internal(&self.topology.rest_positions, self.topology.dimension);
        let edges: Vec<[u32; 2]> =
            body.edges.iter().map(|ends| ends.map(|end| self.numbering.internal(end))).collect();
        let one = StencilConstants { stiffness: 1.0, ..StencilConstants::default() };
        let constants = vec![one; edges.len()];
        pliant_terms::dashpots(self.topology.dimension, &body.name, &edges, &constants, &rest)
    }

    /// Dashpots parallel to the springs of a body whose force is the derivative by a parameter of their
    /// formula.
    pub(super) fn expressed_dashpots(
        &self,
        spec: &Body,
        body: &BodyTopology,
        parameter: &str,
    ) -> Option<Box<dyn DissipativeTerm>> {
        let formula = spec.damping.as_ref()?.expression.as_ref()?.formula().ok()?.derivative(parameter)?;
        let lengths = self.rest_lengths(spec.springs.as_ref()?, body)?;
        let edges: Vec<[u32; 2]> =
            body.edges.iter().map(|ends| ends.map(|end| self.numbering.internal(end))).collect();
        let (d, rest) = (self.topology.dimension, self.rest());
        Some(pliant_terms::expressed_dashpots(d, &body.name, formula, &edges, &lengths, &rest))
    }

    /// Damping of all masses of a body at the rate 1/s.
    pub(super) fn by_masses(&self, body: &BodyTopology) -> Box<dyn DissipativeTerm> {
        // Bodies keep their index ranges when vertices are reordered.
        let vertices = body.vertices.start as usize..body.vertices.end as usize;
        let masses = self.numbering.to_internal(&self.topology.masses, 1)[vertices.clone()].to_vec();
        Box::new(MassProportional::new(&body.name, 1.0, &masses, vertices, self.topology.dimension))
    }

    /// Stiffness-proportional viscosity; for the material `linear` it is evaluated in the reference
    /// configuration.
    fn about(&self, material: &MaterialSpec, term: Box<dyn DissipativeTerm>) -> Box<dyn DissipativeTerm> {
        let rest = self.numbering.to_internal(&self.topology.rest_positions, self.topology.dimension);
        match material {
            MaterialSpec::Linear(_) => Box::new(AtRest::new(term, &rest)),
            _ => term,
        }
    }

    /// Change of the dissipation of a body's elements with the viscosity `about` due to the `change` of
    /// it.
    fn viscous(&self, change: Viscosity, about: Viscosity, body: &BodyTopology) -> Box<dyn DissipativeTerm> {
        let (cells, rest, dimension) = (self.cells(body), self.rest(), self.topology.dimension);
        let set = ViscousSet { body: &body.name, dimension, cells: &cells, rest: &rest };
        match body.blocks.first() {
            Some(block) => pliant_terms::change_of_viscous_cells(change, about, block.kind, &set),
            None => pliant_terms::viscous_simplices(change, order(body) as usize, &set),
        }
    }

    /// Elements of a body with the material `about`, filled with the change `material`.
    pub(super) fn term(
        &self,
        spec: &Body,
        (about, material): (&MaterialSpec, &MaterialSpec),
        body: &BodyTopology,
    ) -> Box<dyn EnergyTerm> {
        let d = self.topology.dimension;
        let rest = self.numbering.to_internal(&self.topology.rest_positions, d);
        let cells = self.cells(body);
        let factors = spec.elastic_factor.as_ref().map(|factor| self.each(factor, body));
        let axes = self.axes(spec, body);
        let elements = ElementSet {
            body: &body.name,
            dimension: d,
            cells: &cells,
            rest: &rest,
            stress: Default::default(),
            factors: factors.as_deref(),
            axes: axes.as_deref(),
        };
        match body.blocks.first() {
            Some(CellBlock { kind, .. }) => pliant_terms::change_of_cells(material, about, kind, &elements),
            None if body.triangle_middles.is_empty() && body.tetrahedron_middles.is_empty() => {
                pliant_terms::linear(material, &elements)
            }
            None => pliant_terms::quadratic(material, &elements),
        }
    }

    /// Directions of the material axes in each element as the scene gives them: the first, and the second
    /// if any; `None` without axes.
    pub(super) fn axis_directions(&self, spec: &Body, body: &BodyTopology) -> Option<AxisVectors> {
        let (axes, centres) = (spec.elastic_axes.as_ref()?, self.centres(body));
        Some((axes.first.vectors(&centres), axes.second.as_ref().map(|second| second.vectors(&centres))))
    }

    /// Rotation from material axes to spatial axes in each element, if the scene gives any.
    pub(super) fn axes(&self, spec: &Body, body: &BodyTopology) -> Option<Vec<Mat<f64, 3>>> {
        let (first, second) = self.axis_directions(spec, body)?;
        let second = |element: usize| second.as_ref().map(|second| &second[element]);
        let each = first.iter().enumerate();
        Some(each.map(|(element, first)| material_axes(first, second(element))).collect())
    }

    /// Reference centroids of the elements of a body, the means of their corners [m].
    pub(super) fn centres(&self, body: &BodyTopology) -> Vec<[f64; 3]> {
        let d = self.topology.dimension;
        let centre = |corners: &[u32]| algebra::centre(&self.topology.rest_positions, d, corners);
        match (body.blocks.first(), d) {
            (Some(block), _) => block.cells().map(centre).collect(),
            (None, 2) => body.triangles.iter().map(|cell| centre(cell)).collect(),
            _ => body.tetrahedra.iter().map(|cell| centre(cell)).collect(),
        }
    }

    /// Expands to one number for each element.
    pub(super) fn each(&self, factor: &OneOrMany, body: &BodyTopology) -> Vec<f64> {
        match factor {
            OneOrMany::One(factor) => {
                let count = match (body.blocks.first(), self.topology.dimension) {
                    (Some(block), _) => block.len(),
                    (None, 2) => body.triangles.len(),
                    _ => body.tetrahedra.len(),
                };
                vec![*factor; count]
            }
            OneOrMany::Many(factors) => factors.clone(),
        }
    }

    /// Vertices of the elements of a solid in the simulation, flat: corners, then midside nodes, of each.
    pub(super) fn cells(&self, body: &BodyTopology) -> Vec<u32> {
        let BodyTopology { triangles, triangle_middles, tetrahedra, tetrahedron_middles, .. } = body;
        let cells = match (body.blocks.first(), self.topology.dimension) {
            (Some(block), _) => block.vertices.clone(),
            (None, 2) => joined(triangles, triangle_middles),
            (None, _) => joined(tetrahedra, tetrahedron_middles),
        };
        cells.into_iter().map(|vertex| self.numbering.internal(vertex)).collect()
    }
}

/// Corners and midside nodes of each element; `middles` is empty or has as many rows.
fn joined<const C: usize, const M: usize>(corners: &[[u32; C]], middles: &[[u32; M]]) -> Vec<u32> {
    let middles_of = |i: usize| middles.get(i).map_or(&[][..], |middles| &middles[..]);
    corners.iter().enumerate().flat_map(|(i, corners)| corners.iter().chain(middles_of(i))).copied().collect()
}
