//! Parameters of a scene by name: keys of the scene, with bodies by name or index.

mod constants;
mod contact;
mod formulas;
mod loads;
mod materials;
mod motions;
mod muscles;
mod proportional;
mod terms;

use std::borrow::Cow;

use pliant::dissipation::Viscosity;
use pliant::energy::attachment::Tie;
use pliant::material::{MaterialSpec, Plane};
use pliant::numbering::Numbering;
use pliant::topology::{BodyKind, BodyTopology, Topology};
use pliant_scene::assembly::TiedPoints;
use pliant_scene::{AttachmentSpec, Body, Load, MassSpec, MembraneSpec, MuscleSpec, Scene, SpringsSpec};
use pliant_terms::{ElementSet, ViscousSet};

use crate::parameter::{
    AttractingMasses, AxisDirections, BodyDensity, BodyElements, Concatenated, ContactShape, FibreTension,
    Gravity, GravityNumber, HeldPlaces, LoadShape, Masses, MembraneElements, Modulus, NumberLink, Parameter,
    RestLengths, ShapedElements, SpringStiffness, StepForces, TermFactor, TieConstants, TieShape, Together,
    TunedSpring, VolumeForce, WeightDensity, Weighted, cell_axes,
};
use crate::{GradientError, RunGradient};
use constants::MaterialConstants;
use materials::{by_poisson, isotropic, rates_by_poisson, stiffness, young};

/// Names of the initial positions and velocities.
const START: [&str; 2] = ["position", "velocity"];

/// Names of arrays over all steps, or states, and vertices.
const EACH_STEP: [&str; 2] = ["forces", "pins"];

/// Uniform gravity.
const GRAVITY: &str = "world.gravity";

/// Prefix of the keys of a material.
const OF_MATERIAL: &str = "elastic.";

/// Poisson's ratio.
const POISSON: &str = "elastic.poisson";

/// Axis directions of a material in each element.
const FIRST_AXIS: &str = "elastic_axes.first_per_element";
const SECOND_AXIS: &str = "elastic_axes.second_per_element";

/// Prefix of the parameters of dashpots with a formula.
const OF_DASHPOTS: &str = "damping.expression.parameters.";

/// Quantity by which the gradient is taken.
enum NamedQuantity {
    Position,
    Velocity,
    /// Index among the parameters.
    Parameter(usize),
}

/// Selected parameters of a scene.
pub struct ParameterSelection {
    quantities: Vec<NamedQuantity>,
    parameters: Vec<Box<dyn Parameter>>,
}

impl ParameterSelection {
    /// Selects the parameters with these names; `topology` and `numbering` are those of the scene's
    /// assembly.
    ///
    /// # Errors
    /// [`GradientError::Parameter`], which lists the names with a derivative.
    pub fn new(
        scene: &Scene,
        topology: &Topology,
        numbering: &Numbering,
        names: &[impl AsRef<str>],
    ) -> Result<Self, GradientError> {
        let places = Places { scene, topology, numbering };
        let mut selection = ParameterSelection { quantities: vec![], parameters: vec![] };
        for name in names.iter().map(AsRef::as_ref) {
            let quantity = match name {
                "position" => NamedQuantity::Position,
                "velocity" => NamedQuantity::Velocity,
                _ => {
                    selection.parameters.push(places.parameter(name)?);
                    NamedQuantity::Parameter(selection.parameters.len() - 1)
                }
            };
            selection.quantities.push(quantity);
        }
        Ok(selection)
    }

    /// Parameters of forces and masses, for [`gradient`](crate::gradient).
    pub fn parameters(&mut self) -> &mut [Box<dyn Parameter>] {
        &mut self.parameters
    }

    /// Parts of a gradient by these [`parameters`](Self::parameters), in the order of the names.
    pub fn parts(&self, gradient: &RunGradient) -> Vec<Vec<f64>> {
        let part = |quantity: &NamedQuantity| match quantity {
            NamedQuantity::Position => gradient.position.clone(),
            NamedQuantity::Velocity => gradient.velocity.clone(),
            NamedQuantity::Parameter(i) => gradient.parameters[*i].clone(),
        };
        self.quantities.iter().map(part).collect()
    }
}

/// All names by which the gradient of a scene can be taken; `topology` is that of its assembly.
pub fn names(scene: &Scene, topology: &Topology) -> Vec<String> {
    let mut names: Vec<String> = START.iter().chain(&EACH_STEP).map(|name| (*name).to_owned()).collect();
    if scene.body.iter().all(|spec| !is_static(scene) || !spec.is_quadratic()) {
        names.push(GRAVITY.into());
        let of_formulas = formulas::names(scene.world.gravity.iter().flatten());
        names.extend(of_formulas.into_iter().map(|name| format!("{GRAVITY}.{}", formulas::key(&name))));
    }
    names.extend(contact::names(scene).map(String::from).chain(motions::names(scene)));
    names.extend(proportional::names(scene, topology));
    for (i, (spec, body)) in scene.body.iter().zip(&topology.bodies).enumerate() {
        let keys = of_body(scene, spec, body);
        let name = spec.name_or_default(i);
        names.extend(keys.into_iter().map(|key| format!("body.{name}.{key}")));
    }
    names
}

/// Keys of a body by which the gradient can be taken.
fn of_body(scene: &Scene, spec: &Body, body: &BodyTopology) -> Vec<Cow<'static, str>> {
    let (dimension, is_static) = (scene.dimension, is_static(scene));
    let by_mass = match spec.mass {
        MassSpec::Density(_) | MassSpec::Preset(_) => Some("mass.density"),
        MassSpec::Total(_) => Some("mass.total"),
        MassSpec::PerVertex(_) => (!is_static).then_some("mass.per_vertex"),
    };
    let attracts = scene.world.nbody.is_some() && body.kind == BodyKind::Particles;
    let has_weight = !is_static || !attracts && !scene.world.gravity_changes() && !spec.is_quadratic();
    let mut keys: Vec<&str> = by_mass.into_iter().filter(|_| has_weight).collect();
    let mut of_formula = vec![];
    let is_plain = is_plain_solid(spec, body);
    if let Some(material) = spec.elastic.as_ref().filter(|_| is_plain) {
        // True if no viscosity follows from the material.
        let has_own_viscosity = spec.damping.as_ref().is_none_or(|damping| {
            damping.proportional_viscosity(material, material.plane()) == Viscosity::default()
        });
        let is_first_order = body.blocks.iter().any(|block| block.kind.order() == 1);
        let is_one_by_one = !is_first_order && has_own_viscosity;
        let each = |key, of_element| [key].into_iter().chain(is_one_by_one.then_some(of_element));
        if young(material).is_some() {
            keys.extend(each("elastic.young", "elastic.young_per_element"));
        }
        if by_poisson(material, dimension).is_some() {
            // Parameters of single elements ignore factors, which are part of the Young's modulus of an
            // element.
            let each_or_all = each("elastic.poisson", "elastic.poisson_per_element");
            keys.extend(each_or_all.take(if spec.elastic_factor.is_some() { 1 } else { 2 }));
        }
        if let (Some(constants), true) = (MaterialConstants::of(material), has_own_viscosity) {
            of_formula.extend(constants.keys().map(|key| format!("{OF_MATERIAL}{key}").into()));
        }
        if stiffness(material).is_some() && has_own_viscosity {
            keys.push("elastic.stiffness");
        }
        if let Some(axes) = &spec.elastic_axes {
            keys.push(FIRST_AXIS);
            keys.extend(axes.second.is_some().then_some(SECOND_AXIS));
        }
        if has_shape(scene, spec, material) {
            keys.push("rest");
        }
    }
    if let (Some(material), Some(_)) = (&spec.elastic, &spec.membrane) {
        keys.extend(by_poisson(material, 3).map(|_| POISSON));
    }
    let by_masses = spec.damping.as_ref().and_then(|damping| damping.mass_proportional);
    keys.extend(by_masses.map(|_| "damping.mass_proportional"));
    if let (Some(damping), true) = (&spec.damping, is_plain) {
        let Viscosity { shear, second } = damping.strain_rate_viscosity();
        // Isoparametric elements with volume viscosity only have a kink in the bending stiffness.
        let has_kink = !body.blocks.is_empty() && shear == 0.0 && second != 0.0;
        // Damping of springs and hinges is proportional to their own stiffness.
        let of_elements = damping.stiffness_proportional.filter(|_| spec.springs.is_none());
        let of_elements = of_elements.filter(|beta| spec.bending.is_none() && !(has_kink && *beta == 0.0));
        keys.extend(of_elements.map(|_| "damping.stiffness_proportional"));
        if damping.strain_rate.is_some() {
            keys.extend((!has_kink).then_some("damping.strain_rate.shear"));
            keys.push("damping.strain_rate.second");
        }
    }
    let dashpot = spec.damping.as_ref().and_then(|damping| damping.dashpot);
    keys.extend(dashpot.filter(|_| spec.springs.is_some()).map(|_| "damping.dashpot"));
    let formula = spec.damping.as_ref().and_then(|damping| damping.expression.as_ref());
    if let Some(formula) = formula.filter(|_| spec.springs.is_some()) {
        of_formula.extend(formula.parameters.keys().map(|name| format!("{OF_DASHPOTS}{name}").into()));
    }
    match &spec.springs {
        Some(SpringsSpec { expression: Some(_), .. }) => {}
        Some(SpringsSpec { young: Some(_), .. }) => keys.push("springs.young"),
        Some(_) => {
            keys.push("springs.stiffness");
            // The dashpot formula may contain the rest length.
            keys.extend(formula.is_none().then_some("springs.rest_length"));
        }
        None => {}
    }
    keys.extend(proportional::of_body(scene, spec, body).into_iter().map(|factor| factor.key));
    let all = keys.into_iter().map(Cow::Borrowed).chain(of_formula);
    let by_index = loads::keys(spec)
        .chain(muscles::keys(spec))
        .chain((0..spec.muscle.len()).map(muscles::of_fibres))
        .chain(motions::keys(spec));
    let all = all.chain(by_index.map(Cow::Owned));
    all.filter(|key| contact::obstacle(scene, spec, key).is_none()).collect()
}

/// True in statics, where masses act as weights only.
fn is_static(scene: &Scene) -> bool {
    scene.time.integrator.method().is_static()
}

/// True if the body is a solid with a single term of its unmodified material.
fn is_plain_solid(spec: &Body, body: &BodyTopology) -> bool {
    body.kind == BodyKind::Solid && spec.membrane.is_none()
}

/// True if the dependence on the reference shape is known for everything in the body.
fn has_shape(scene: &Scene, spec: &Body, material: &MaterialSpec) -> bool {
    // The viscosity of the material `linear` is evaluated in the reference configuration.
    let is_at_rest = matches!(material, MaterialSpec::Linear(_)) && stiffness_proportional(spec) != 0.0;
    let by_masses = spec.damping.as_ref().and_then(|damping| damping.mass_proportional).unwrap_or(0.0) != 0.0;
    let weighs = !is_static(scene) || !by_masses && !scene.world.gravity_changes();
    spec.springs.is_none() && spec.bending.is_none() && !is_at_rest && weighs
}

/// Stiffness-proportional damping of a body [s].
fn stiffness_proportional(spec: &Body) -> f64 {
    spec.damping.as_ref().and_then(|damping| damping.stiffness_proportional).unwrap_or(0.0)
}

/// Viscosity of elements of this material, including stiffness-proportional damping.
fn viscosity(spec: &Body, material: &MaterialSpec) -> Viscosity {
    spec.damping.as_ref().map_or(Viscosity::default(), |damping| {
        damping.strain_rate_viscosity().plus(damping.proportional_viscosity(material, material.plane()))
    })
}

/// True for three-node triangles and four-node tetrahedra.
fn has_linear_elements(body: &BodyTopology) -> bool {
    body.blocks.is_empty() && body.triangle_middles.is_empty() && body.tetrahedron_middles.is_empty()
}

/// Order of the simplices of a body.
fn order(body: &BodyTopology) -> u32 {
    if has_linear_elements(body) { 1 } else { 2 }
}

/// Density from which the masses of a body are computed [kg/m^3]; `None` if masses are given.
fn density(mass: &MassSpec) -> Option<f64> {
    match mass {
        MassSpec::Density(density) => Some(density.value),
        MassSpec::Preset(preset) => Some(preset.about().density),
        MassSpec::PerVertex(_) | MassSpec::Total(_) => None,
    }
}

/// Scene with its topology and numbering.
struct Places<'a> {
    scene: &'a Scene,
    topology: &'a Topology,
    numbering: &'a Numbering,
}

impl Places<'_> {
    fn parameter(&self, name: &str) -> Result<Box<dyn Parameter>, GradientError> {
        let unknown = |problem: &str| GradientError::Parameter {
            name: name.to_owned(),
            problem: problem.to_owned(),
            known: names(self.scene, self.topology),
        };
        // Parameters of the whole scene.
        if let Some(key) = name.strip_prefix(GRAVITY)
            && names(self.scene, self.topology).iter().any(|known| known == name)
        {
            return Ok(match key.strip_prefix('.').and_then(formulas::name) {
                Some(name) => {
                    let formulas = self.scene.world.gravity.iter().flatten().cloned().collect();
                    Box::new(GravityNumber::new(formulas, name))
                }
                None => Box::new(Gravity::new(self.topology.dimension)),
            });
        }
        let (numbering, coordinates) = (self.numbering.clone(), self.topology.rest_positions.len());
        match name {
            "forces" => return Ok(Box::new(StepForces::new(numbering, coordinates))),
            "pins" => return Ok(Box::new(HeldPlaces::new(numbering, coordinates))),
            _ => {}
        }
        if let Some(of_contact) = contact::parameter(self.scene, name) {
            return Ok(of_contact);
        }
        if let Some(of_obstacle) = motions::of_obstacle(self.scene, name, &self.rest()) {
            return Ok(of_obstacle);
        }
        if let Some(factor) = proportional::parameter(self.scene, self.topology, name) {
            return Ok(factor);
        }
        // Parameters of bodies.
        let (spec, body, key) = self.body(name).ok_or_else(|| unknown("is no parameter of this scene"))?;
        if !of_body(self.scene, spec, body).iter().any(|known| known == key) {
            let reason = contact::obstacle(self.scene, spec, key);
            return Err(unknown(reason.as_deref().unwrap_or("has no derivative")));
        }
        self.of_body(spec, body, key).ok_or_else(|| unknown("has no derivative"))
    }

    /// Body that `name` begins with, and the key after it. Body names may contain dots.
    fn body<'n>(&self, name: &'n str) -> Option<(&Body, &BodyTopology, &'n str)> {
        let rest = name.strip_prefix("body.")?;
        let bodies = self.scene.body.iter().zip(&self.topology.bodies).enumerate();
        bodies.into_iter().find_map(|(i, (spec, body))| {
            let of = |prefix: &str| rest.strip_prefix(prefix)?.strip_prefix('.');
            let key = of(&spec.name_or_default(i)).or_else(|| of(&i.to_string()))?;
            Some((spec, body, key))
        })
    }

    fn of_body(&self, spec: &Body, body: &BodyTopology, key: &str) -> Option<Box<dyn Parameter>> {
        let internal = |vertex| self.numbering.internal(vertex);
        // Parameter for a number that all masses are proportional to.
        let whole = |number| -> Box<dyn Parameter> {
            let density = BodyDensity::new(number, body.vertices.clone(), internal);
            let mut all: Vec<Box<dyn Parameter>> = vec![if is_static(self.scene) {
                Box::new(WeightDensity::new(density, self.gravity()))
            } else {
                Box::new(density)
            }];
            if let Some(attracting) = self.attracting(body).filter(|_| !is_static(self.scene)) {
                let shares =
                    self.topology.masses[body.vertices.start as usize..body.vertices.end as usize].iter();
                all.push(Box::new(Weighted::new(attracting, shares.map(|mass| mass / number).collect())));
            }
            if all.len() == 1 { all.swap_remove(0) } else { Box::new(Together::new(all)) }
        };
        if let Some(factor) =
            proportional::of_body(self.scene, spec, body).into_iter().find(|factor| factor.key == key)
        {
            let terms: Box<dyn Parameter> = Box::new(TermFactor::new(factor.parts));
            return Some(match factor.of_masses {
                Some(value) => Box::new(Together::new(vec![terms, whole(value)])),
                None => terms,
            });
        }
        // Other keys.
        Some(match (key, &spec.mass) {
            ("mass.density", mass) => whole(density(mass)?),
            ("mass.total", MassSpec::Total(total)) => whole(*total),
            ("mass.per_vertex", _) => {
                let vertices: Vec<u32> = body.vertices.clone().map(internal).collect();
                let mut all: Vec<Box<dyn Parameter>> = vec![Box::new(Masses::new(vertices))];
                all.extend(self.attracting(body));
                if all.len() == 1 { all.swap_remove(0) } else { Box::new(Together::new(all)) }
            }
            _ if key.starts_with("load.") => {
                return loads::parameter(spec, &body.name, self.topology.dimension, key);
            }
            _ if key.starts_with("muscle.") => {
                let mut each = spec.muscle.iter().enumerate();
                return match each.find(|(i, _)| muscles::of_fibres(*i) == key) {
                    Some((_, muscle)) => Some(self.fibres(muscle, body)),
                    None => muscles::parameter(spec, &body.name, key),
                };
            }
            _ if key.starts_with("pin.") => {
                return motions::parameter(spec, &body.name, key, &self.rest());
            }
            _ if key.starts_with("springs.") => {
                return self.of_springs(spec.springs.as_ref()?, stiffness_proportional(spec), body, key);
            }
            _ if key.starts_with(OF_DASHPOTS) => {
                let dashpots = self.expressed_dashpots(spec, body, key.strip_prefix(OF_DASHPOTS)?)?;
                Box::new(Modulus::new(vec![], vec![(1.0, dashpots)]))
            }
            ("damping.mass_proportional", _) => {
                Box::new(Modulus::new(vec![], vec![(1.0, self.by_masses(body))]))
            }
            ("damping.dashpot", _) => Box::new(Modulus::new(vec![], vec![(1.0, self.unit_dashpots(body))])),
            _ => return self.of_elements(spec, body, key),
        })
    }

    /// Parameter for the masses of a body as sources of mutual gravity; `None` if it has none.
    fn attracting(&self, body: &BodyTopology) -> Option<Box<dyn Parameter>> {
        let nbody = self.scene.world.nbody.as_ref().filter(|_| body.kind == BodyKind::Particles)?;
        let internal = |vertex| self.numbering.internal(vertex);
        let all = proportional::attracting(self.topology).map(internal).collect();
        let numbers = body.vertices.clone().map(internal).collect();
        Some(Box::new(AttractingMasses::new(numbers, all, nbody.constant, nbody.softening)))
    }

    /// Reference positions of all vertices, flat, in the order of the simulation [m].
    fn rest(&self) -> Cow<'_, [f64]> {
        self.numbering.to_internal(&self.topology.rest_positions, self.topology.dimension)
    }

    /// Constant gravity [m/s^2]; zero without gravity.
    fn gravity(&self) -> Vec<f64> {
        let gravity = self.scene.world.gravity.iter().flatten();
        let mut components: Vec<f64> = gravity.filter_map(|component| component.constant()).collect();
        components.resize(self.topology.dimension, 0.0);
        components
    }

    /// Parameter of springs with as many numbers as the scene gives: one for all springs, or one for
    /// each.
    fn of_springs(
        &self,
        spec: &SpringsSpec,
        beta: f64,
        body: &BodyTopology,
        key: &str,
    ) -> Option<Box<dyn Parameter>> {
        let springs = self.springs(spec, body)?;
        let stiffness = |springs| SpringStiffness::new(springs).damped(beta);
        let lengths: Vec<f64> = springs.iter().map(|spring| spring.rest_length).collect();
        let (given, each): (_, Box<dyn Parameter>) = match key {
            "springs.young" => {
                return Some(Box::new(Weighted::new(Box::new(stiffness(springs)), lengths)));
            }
            "springs.stiffness" => (&spec.stiffness, Box::new(stiffness(springs))),
            _ => (&spec.rest_length, Box::new(RestLengths::new(springs))),
        };
        let one = given.as_ref().is_some_and(|given| given.as_slice().len() == 1);
        Some(if one { Box::new(Weighted::new(each, vec![1.0; lengths.len()])) } else { each })
    }

    fn springs(&self, spec: &SpringsSpec, body: &BodyTopology) -> Option<Vec<TunedSpring>> {
        let lengths = self.rest_lengths(spec, body)?;
        let spring = |(i, ends): (usize, &[u32; 2])| {
            let rest_length = *lengths.get(i)?;
            let stiffness = match (&spec.stiffness, spec.young) {
                (Some(stiffness), _) => stiffness.get(i)?,
                (None, young) => young? * rest_length,
            };
            Some(TunedSpring { ends: ends.map(|end| self.numbering.internal(end)), stiffness, rest_length })
        };
        body.edges.iter().enumerate().map(spring).collect()
    }

    /// Rest lengths of the springs of a body [m].
    fn rest_lengths(&self, spec: &SpringsSpec, body: &BodyTopology) -> Option<Vec<f64>> {
        let d = self.topology.dimension;
        let point = |vertex: u32| &self.topology.rest_positions[vertex as usize * d..][..d];
        let length = |(i, ends): (usize, &[u32; 2])| {
            let squares = point(ends[0]).iter().zip(point(ends[1])).map(|(a, b)| (a - b) * (a - b));
            match &spec.rest_length {
                Some(lengths) => lengths.get(i),
                None => Some(squares.sum::<f64>().sqrt()),
            }
        };
        body.edges.iter().enumerate().map(length).collect()
    }

    /// Forces per volume on a body and the vertices they act on; `None` if these cannot be determined.
    fn body_forces(&self, spec: &Body, body: &BodyTopology) -> Option<Vec<VolumeForce>> {
        let mut places = None;
        let mut forces = vec![];
        for (i, load) in spec.load.iter().enumerate() {
            let Some(components) = load.body_force.clone() else { continue };
            let name = load.term_name(i, &body.name);
            let vertices = if load.selections().is_empty() {
                body.vertices.clone().collect()
            } else {
                if places.is_none() {
                    places = Some(self.scene.places().ok()?);
                }
                let on = places.iter().flat_map(|places| &places.loads).find(|on| on.name == name)?;
                on.on.concat()
            };
            let vertices = vertices.into_iter().map(|vertex| self.numbering.internal(vertex)).collect();
            forces.push(VolumeForce { components, vertices });
        }
        Some(forces)
    }

    /// Parameter for the reference positions of a body.
    fn rest_shape(
        &self,
        spec: &Body,
        material: &MaterialSpec,
        body: &BodyTopology,
    ) -> Option<Box<dyn Parameter>> {
        // Elements with everything that depends on their shape.
        let (cells, rest) = (self.cells(body), self.rest());
        let factors = spec.elastic_factor.as_ref().map(|factor| self.each(factor, body));
        let weight = is_static(self.scene).then(|| {
            let mut weight = [0.0; 3];
            weight.iter_mut().zip(self.gravity()).for_each(|(weight, gravity)| *weight = gravity);
            weight
        });
        let axes = self.axes(spec, body).unwrap_or_default();
        let centres = if spec.muscle.is_empty() { vec![] } else { self.centres(body) };
        let of_muscle = |muscle: &MuscleSpec| FibreTension {
            directions: muscle.fibre.vectors(&centres),
            tension: muscle.tension.clone(),
        };
        let muscles: Vec<FibreTension> = spec.muscle.iter().map(of_muscle).collect();
        let body_forces = self.body_forces(spec, body)?;
        let shaped = ShapedElements {
            dimension: self.topology.dimension,
            order: order(body),
            kind: body.blocks.first().map(|block| block.kind),
            cells: &cells,
            rest: &rest,
            material,
            factors: factors.as_deref().unwrap_or_default(),
            axes: &axes,
            muscles: &muscles,
            body_forces: &body_forces,
            viscosity: viscosity(spec, material),
            density: density(&spec.mass),
            weight,
        };
        // Loads, formulas of positions, pins, attachments and contact.
        let vertices: Vec<u32> =
            body.vertices.clone().map(|vertex| self.numbering.internal(vertex)).collect();
        let elements = shaped.parameter(&vertices);
        let loads = spec.load.iter().enumerate().filter(|(_, load)| loads::goes_by_shape(load));
        let of_load = |(i, load): (usize, &Load)| -> Box<dyn Parameter> {
            Box::new(LoadShape::new(load.term_name(i, &body.name), self.topology.dimension, vertices.clone()))
        };
        let mut all: Vec<Box<dyn Parameter>> = std::iter::once(elements).chain(loads.map(of_load)).collect();
        all.extend(self.by_places(spec, body));
        all.extend(motions::by_shape(spec, &body.name, &vertices, &rest));
        all.extend(self.ties(body)?);
        if contact::goes_by_shape(self.scene, spec) {
            let rest = self.rest().into_owned();
            all.push(Box::new(ContactShape::new(rest, vertices, self.topology.dimension)));
        }
        Some(if all.len() == 1 { all.swap_remove(0) } else { Box::new(Together::new(all)) })
    }

    /// Dependence on a body's reference positions through attachments: nearest points, and directions of
    /// ties with a rest length in vibration modes. `None` if the ties cannot be determined.
    fn ties(&self, body: &BodyTopology) -> Option<Vec<Box<dyn Parameter>>> {
        let is_own = |tie: &AttachmentSpec| {
            let target = tie.target.as_ref();
            let is_from = tie.body.as_ref().is_none_or(|from| *from == body.name);
            let goes_by_shape =
                tie.rest_length > 0.0 || target.is_some_and(|target| target.nearest_point.is_some());
            goes_by_shape && (is_from || target.is_some_and(|target| target.body == body.name))
        };
        let each = self.scene.attachment.iter().enumerate();
        let own: Vec<usize> = each.filter(|(_, tie)| is_own(tie)).map(|(i, _)| i).collect();
        if own.is_empty() {
            return Some(vec![]);
        }
        let all = self.scene.ties().ok()?;
        let internal = |vertex: u32| self.numbering.internal(vertex);
        let vertices: Vec<u32> = body.vertices.clone().map(internal).collect();
        let rest = self.rest();
        let of_attachment = |i: usize| -> Option<Box<dyn Parameter>> {
            let TiedPoints { ties, stiffness, rest_length, dashpot } = all.get(i)?;
            let constants =
                TieConstants { stiffness: *stiffness, rest_length: *rest_length, dashpot: *dashpot };
            let tie = |tie: &Tie| {
                let shares = tie.shares.iter().map(|(v, weight)| (internal(*v), *weight)).collect();
                Tie { shares, ..*tie }
            };
            let ties: Vec<Tie> = ties.iter().map(tie).collect();
            let place = (self.topology.dimension, &rest[..]);
            Some(Box::new(TieShape::new(&ties, constants, place, &vertices)))
        };
        own.into_iter().map(of_attachment).collect()
    }

    /// Dependence on a body's reference positions through formulas evaluated at element centroids:
    /// tensions and directions of muscles, material axes.
    fn by_places(&self, spec: &Body, body: &BodyTopology) -> Vec<Box<dyn Parameter>> {
        if spec.muscle.is_empty() && spec.elastic_axes.is_none() {
            return vec![];
        }
        let (cells, rest, centres) = (self.cells(body), self.rest(), self.centres(body));
        let elements = self.elements(body, &cells, &rest);
        let vertices: Vec<u32> =
            body.vertices.clone().map(|vertex| self.numbering.internal(vertex)).collect();
        let mut all = vec![];
        for muscle in &spec.muscle {
            if muscle.tension.depends_on_place() {
                let directions = muscle.fibre.vectors(&centres);
                all.push(elements.tension_places(&directions, muscle.tension.clone(), &vertices));
            }
            if let Some(slopes) = muscle.fibre.slopes(&centres) {
                all.push(self.by_middles(self.fibres(muscle, body), &slopes, body));
            }
        }
        let axes = spec
            .elastic_axes
            .iter()
            .flat_map(|axes| [(FIRST_AXIS, Some(&axes.first)), (SECOND_AXIS, axes.second.as_ref())]);
        for (key, fibre) in axes {
            let slopes = fibre.and_then(|fibre| fibre.slopes(&centres));
            let directions = slopes.and_then(|slopes| Some((slopes, self.of_elements(spec, body, key)?)));
            all.extend(directions.map(|(slopes, directions)| self.by_middles(directions, &slopes, body)));
        }
        all
    }

    /// Dependence of a parameter with D numbers per element (D the dimension) on reference positions
    /// through the element centroids, with these slopes.
    fn by_middles(
        &self,
        of: Box<dyn Parameter>,
        slopes: &[[[f64; 3]; 3]],
        body: &BodyTopology,
    ) -> Box<dyn Parameter> {
        let d = self.topology.dimension;
        let (cells, count) = match (body.blocks.first(), d) {
            (Some(block), _) => (&block.vertices[..], block.kind.nodes),
            (None, 2) => (body.triangles.as_flattened(), 3),
            _ => (body.tetrahedra.as_flattened(), 4),
        };
        let mut links = vec![];
        for (element, (corners, slope)) in cells.chunks_exact(count).zip(slopes).enumerate() {
            for (corner, (c, k)) in corners.iter().flat_map(|v| (0..d * d).map(move |i| (v, (i / d, i % d))))
            {
                let with = (corner - body.vertices.start) as usize * d + k;
                let weight = slope[c][k] / count as f64;
                links.push(NumberLink { number: element * d + c, with, weight });
            }
        }
        Box::new(Weighted::linked(of, links, body.vertices.len() * d))
    }

    /// Elements of a body with these cells and reference positions.
    fn elements<'e>(&self, body: &'e BodyTopology, cells: &'e [u32], rest: &'e [f64]) -> BodyElements<'e> {
        let kind = body.blocks.first().map(|block| block.kind);
        BodyElements { dimension: self.topology.dimension, order: order(body), kind, cells, rest }
    }

    /// Parameter for the fibre directions of a muscle.
    fn fibres(&self, muscle: &MuscleSpec, body: &BodyTopology) -> Box<dyn Parameter> {
        let (cells, rest, centres) = (self.cells(body), self.rest(), self.centres(body));
        let elements = self.elements(body, &cells, &rest);
        elements.fibres(&muscle.fibre.vectors(&centres), muscle.tension.clone())
    }

    /// Parameter for Poisson's ratio of a membrane and its viscosity.
    fn membrane_by_poisson(
        &self,
        spec: &Body,
        membrane: &MembraneSpec,
        body: &BodyTopology,
    ) -> Option<Box<dyn Parameter>> {
        let (material, rest) = (spec.elastic.as_ref()?, self.rest());
        let triangles = body.triangles.as_flattened().iter();
        let cells: Vec<u32> = triangles.map(|vertex| self.numbering.internal(*vertex)).collect();
        let frees_faces = membrane.plane_or_default() == Plane::Stress;
        let elements = MembraneElements {
            cells: &cells,
            rest: &rest,
            thickness: membrane.thickness,
            frees_faces,
            material,
        };
        let energy = elements.modulus(&by_poisson(material, 3)?);
        let beta = stiffness_proportional(spec);
        if beta == 0.0 {
            return Some(energy);
        }
        let (mu, lambda) = rates_by_poisson(&isotropic(material)?.0, frees_faces);
        let [shear, second] = [mu, lambda].map(|rate| membrane.thickness * beta * rate);
        let set = ViscousSet { body: &body.name, dimension: 3, cells: &cells, rest: &rest };
        let viscous = pliant_terms::viscous_membrane(Viscosity { shear, second }, &set);
        Some(Box::new(Together::new(vec![energy, Box::new(Modulus::new(vec![], vec![(1.0, viscous)]))])))
    }

    fn of_elements(&self, spec: &Body, body: &BodyTopology, key: &str) -> Option<Box<dyn Parameter>> {
        let (material, dimension) = (spec.elastic.as_ref()?, self.topology.dimension);
        // Membranes and nodal integration.
        if let (Some(membrane), POISSON) = (&spec.membrane, key) {
            return self.membrane_by_poisson(spec, membrane, body);
        }
        let term = |(factor, change)| (factor, self.term(spec, (material, &change), body));
        if let Some(constants) = MaterialConstants::of(material)
            && let Some(derivatives) =
                key.strip_prefix(OF_MATERIAL).and_then(|key| constants.derivatives(key))
        {
            let modulus =
                |change| -> Box<dyn Parameter> { Box::new(Modulus::new(vec![term((1.0, change))], vec![])) };
            return Some(Box::new(Concatenated::new(derivatives.into_iter().map(modulus).collect())));
        }
        // Constants in which the energy is linear, the shape, and axes.
        let (cells, rest) =
            (self.cells(body), self.numbering.to_internal(&self.topology.rest_positions, dimension));
        let elements = self.elements(body, &cells, &rest);
        let parts = match key {
            "elastic.young" | "elastic.young_per_element" => vec![(1.0 / young(material)?, material.clone())],
            "elastic.poisson" | "elastic.poisson_per_element" => by_poisson(material, dimension)?.to_vec(),
            "rest" => return self.rest_shape(spec, material, body),
            FIRST_AXIS | SECOND_AXIS => {
                let (first, second) = self.axis_directions(spec, body)?;
                let by_second = key == SECOND_AXIS;
                let directions = AxisDirections { first: &first, second: second.as_deref(), by_second };
                if let Some(block) = body.blocks.first().filter(|block| block.kind.order() == 1) {
                    let axes = self.axes(spec, body);
                    let elements = ElementSet {
                        body: &body.name,
                        dimension,
                        cells: &cells,
                        rest: &rest,
                        stress: spec.stress.unwrap_or_default(),
                        factors: None,
                        axes: axes.as_deref(),
                    };
                    return Some(cell_axes(material, block.kind, &elements, directions));
                }
                let factors = spec.elastic_factor.as_ref().map(|factor| self.each(factor, body));
                return Some(elements.axes(material, &factors.unwrap_or_default(), directions));
            }
            "elastic.stiffness" => vec![(1.0 / stiffness(material)?, material.clone())],
            // Damping has parameters of its own.
            _ => vec![],
        };
        let is_per_element = ["elastic.young_per_element", "elastic.poisson_per_element"].contains(&key);
        if is_per_element {
            return Some(elements.moduli(&parts));
        }
        let energies = parts.into_iter().map(term).collect();
        let mut modulus = Modulus::new(energies, self.dissipation(spec, material, body, key)?);
        if key == "elastic.young" {
            modulus = modulus.of_system();
        }
        Some(Box::new(modulus))
    }
}
