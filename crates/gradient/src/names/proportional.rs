//! Parameters that scale whole terms: of attachments, membranes, bending, mutual gravity.

use pliant::dissipation::Viscosity;
use pliant::material::MaterialSpec;
use pliant::topology::{BodyKind, BodyTopology, Topology};
use pliant_scene::{AttachmentSpec, Body, MassSpec, Scene};

use super::materials::young;
use super::{is_static, stiffness_proportional, viscosity};
use crate::parameter::{EtherDrag, Parameter, Softening, TermFactor, TieRestLength};

/// Gravitational constant of mutual gravity.
const CONSTANT: &str = "world.nbody.constant";
/// Softening of mutual gravity.
const SOFTENING: &str = "world.nbody.softening";
/// Rest length of an attachment.
const REST_LENGTH: &str = "rest_length";
/// Mass-proportional drag on everything.
const DRAG: &str = "world.ether_drag";
/// Prefix of the parameters of attachments.
const ATTACHMENT: &str = "attachment.";

/// Factors of terms, with the terms' names.
type Parts = Vec<(f64, String)>;

/// Names of the parameters of a scene that do not belong to bodies.
pub(super) fn names(scene: &Scene, topology: &Topology) -> impl Iterator<Item = String> {
    let of_world = [CONSTANT, SOFTENING, DRAG].map(String::from).into_iter();
    let of_attachments = scene.attachment.iter().enumerate().flat_map(|(i, spec)| {
        let name = spec.name_or_default(i);
        let length = (spec.rest_length != 0.0).then_some(REST_LENGTH);
        let keys = numbers(spec).into_iter().map(|(key, ..)| key).chain(length);
        keys.map(move |key| format!("{ATTACHMENT}{name}.{key}"))
    });
    of_world.chain(of_attachments).filter(|name| parameter(scene, topology, name).is_some())
}

/// Parameter of a scene with this name.
pub(super) fn parameter(scene: &Scene, topology: &Topology, name: &str) -> Option<Box<dyn Parameter>> {
    let factor = |parts: Parts| -> Option<Box<dyn Parameter>> { Some(Box::new(TermFactor::new(parts))) };
    match name {
        DRAG => {
            let acts = scene.world.ether_drag.is_some_and(|drag| drag != 0.0) && !is_static(scene);
            acts.then(|| -> Box<dyn Parameter> { Box::new(EtherDrag) })
        }
        CONSTANT => {
            let nbody = scene.world.nbody.as_ref().filter(|nbody| nbody.tree.is_none())?;
            let count = attracting(topology).count();
            factor(vec![(1.0 / nbody.constant, format!("mutual gravity of {count} particles"))])
        }
        SOFTENING => {
            let nbody =
                scene.world.nbody.as_ref().filter(|nbody| nbody.tree.is_none() && nbody.softening != 0.0)?;
            // Bodies without elements are not renumbered.
            Some(Box::new(Softening::new(attracting(topology).collect(), nbody.constant, nbody.softening)))
        }
        _ => {
            let asked = name.strip_prefix(ATTACHMENT)?;
            scene.attachment.iter().enumerate().find_map(|(i, spec)| {
                let name = spec.name_or_default(i);
                let key = asked.strip_prefix(&name)?.strip_prefix('.')?;
                if key == REST_LENGTH && spec.rest_length != 0.0 {
                    return Some(Box::new(TieRestLength::new(format!("attachment `{name}`"))) as _);
                }
                let (_, value, term) = numbers(spec).into_iter().find(|(known, ..)| *known == key)?;
                factor(vec![(1.0 / value, format!("{term}attachment `{name}`"))])
            })
        }
    }
}

/// Vertices subject to mutual gravity.
pub(super) fn attracting(topology: &Topology) -> impl Iterator<Item = u32> {
    let particles = topology.bodies.iter().filter(|body| body.kind == BodyKind::Particles);
    particles.flat_map(|body| body.vertices.clone())
}

/// Nonzero numbers of an attachment, with the prefixes of their terms' names.
fn numbers(spec: &AttachmentSpec) -> Vec<(&'static str, f64, &'static str)> {
    let AttachmentSpec { stiffness, total_stiffness, dashpot, .. } = spec;
    let all = [
        ("stiffness", stiffness, ""),
        ("total_stiffness", total_stiffness, ""),
        ("dashpot", dashpot, "damping of "),
    ];
    let given = all.into_iter().filter_map(|(key, value, term)| Some((key, (*value)?, term)));
    given.filter(|(_, value, _)| *value != 0.0).collect()
}

/// Number of a body, with the factors that turn terms into its derivative.
pub(super) struct BodyFactor {
    /// Key of the number.
    pub(super) key: &'static str,
    /// Factors of terms, with the terms' names.
    pub(super) parts: Parts,
    /// Value of the number, if masses are proportional to it.
    pub(super) of_masses: Option<f64>,
}

/// Numbers of a body that its terms are proportional to, or to a power of.
pub(super) fn of_body(scene: &Scene, spec: &Body, body: &BodyTopology) -> Vec<BodyFactor> {
    let is_membrane = body.kind == BodyKind::Membrane;
    let mut factors = vec![];
    if let (Some(material), true) = (&spec.elastic, is_membrane) {
        factors.extend(of_young(spec, material, body));
    }
    if let Some(membrane) = spec.membrane.as_ref().filter(|_| is_membrane) {
        let h = membrane.thickness;
        let terms = std::iter::once(format!("membrane of `{}`", body.name)).chain(viscosity_of(spec, body));
        let per_area = |density: &pliant::quantity::Quantity| {
            density.dimension == Some(pliant::quantity::Kind::AREA_DENSITY.dimension)
        };
        let weighs = match &spec.mass {
            MassSpec::Density(density) => !per_area(density),
            MassSpec::Preset(_) => true,
            MassSpec::PerVertex(_) | MassSpec::Total(_) => false,
        };
        factors.push(BodyFactor {
            key: "membrane.thickness",
            parts: terms.map(|term| (1.0 / h, term)).collect(),
            of_masses: weighs.then_some(h),
        });
    }
    factors.extend(of_bending(scene, spec, body));
    factors
}

/// Young's modulus of membranes.
fn of_young(spec: &Body, material: &MaterialSpec, body: &BodyTopology) -> Option<BodyFactor> {
    let young = young(material).or(match material {
        MaterialSpec::MooneyRivlin(constants) => constants.young,
        MaterialSpec::Ogden(terms) => terms.young,
        _ => None,
    })?;
    let mut parts: Parts = vec![(1.0 / young, format!("membrane of `{}`", body.name))];
    if let Some(damping) = &spec.damping
        && stiffness_proportional(spec) != 0.0
    {
        // One term holds both viscosities, except for the material `linear`.
        if damping.strain_rate_viscosity() != Viscosity::default()
            || matches!(material, MaterialSpec::Linear(_))
        {
            return None;
        }
        parts.extend(viscosity_of(spec, body).map(|term| (1.0 / young, term)));
    }
    Some(BodyFactor { key: "elastic.young", parts, of_masses: None })
}

/// Numbers in the bending stiffnesses `D = E h^3/(12 (1 - nu^2))`, `B = E h^3/12`, `B = pi E h^4/64`.
fn of_bending(scene: &Scene, spec: &Body, body: &BodyTopology) -> Vec<BodyFactor> {
    let Some(bending) = &spec.bending else { return vec![] };
    let is_strand = !matches!(body.kind, BodyKind::Membrane | BodyKind::Cloth);
    let power = if is_strand && scene.dimension == 3 { 4.0 } else { 3.0 };
    let numbers = [
        ("bending.stiffness", bending.stiffness.map(|stiffness| 1.0 / stiffness.value)),
        ("bending.young", bending.young.map(|young| 1.0 / young)),
        ("bending.thickness", bending.thickness.map(|h| power / h)),
        ("bending.poisson", bending.poisson.map(|nu| 2.0 * nu / (1.0 - nu * nu))),
    ];
    let what = if is_strand { "joints" } else { "hinges" };
    let damping = (stiffness_proportional(spec) != 0.0).then_some("damping of the ");
    let part = |factor: f64| {
        let name = |of: &str| (factor, format!("{of}{what} of `{}`", body.name));
        std::iter::once("").chain(damping).map(name).collect::<Parts>()
    };
    let factor = |(key, factor): (&'static str, Option<f64>)| {
        Some(BodyFactor { key, parts: part(factor?), of_masses: None })
    };
    numbers.into_iter().filter_map(factor).collect()
}

/// Name of the viscosity term of elements, if they have any.
fn viscosity_of(spec: &Body, body: &BodyTopology) -> Option<String> {
    let is_viscous = viscosity(spec, spec.elastic.as_ref()?) != Viscosity::default();
    is_viscous.then(|| format!("strain-rate damping of `{}`", body.name))
}
