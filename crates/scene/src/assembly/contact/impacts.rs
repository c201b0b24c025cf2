//! Durations of impacts, and the integrators that gain energy if steps are long compared with them.

use std::f64::consts::PI;

use pliant::quantity::Rounded;
use pliant::system::System;
use pliant_contact::model::ContactModel;

use super::ContactParty;

/// Largest step that conserves the energy of impacts, as a fraction of the contact time of the lightest
/// vertex.
const PART_OF_CONTACT: f64 = 0.25;
/// Largest step without energy gain of dissipative integrators, as a fraction of a body's impact time.
/// Measured with blocks of 0.1 MPa to 1 GPa at 1 to 20 m/s on a floor: the energy grows 1.2 to 6.5 times
/// for fractions of 0.8 and more, and never up to 0.5.
const PART_OF_BODY: f64 = 0.5;

/// Durations of impacts.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ImpactDurations {
    /// Shortest contact of a single vertex, `pi sqrt(m dhat / (8 kappa w))`.
    pub vertex: ImpactDuration,
    /// Shortest impact of a whole solid (a wave crosses it there and back) or of a particle; `None`
    /// without either.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<ImpactDuration>,
}

/// Duration of an impact.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ImpactDuration {
    /// Name of the body.
    pub body: String,
    /// Duration [s].
    pub time: f64,
    /// Duration in steps; `None` with adaptive step sizes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<f64>,
}

/// Steps in which an integrator has gained energy in impacts, by measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum GainingSteps {
    /// Steps that are long compared with the contact of a single vertex.
    BesideVertex,
    /// Steps that are long compared with the impact of a whole body.
    BesideBody,
}

fn gaining_steps(scheme: &str) -> Option<GainingSteps> {
    match scheme {
        "sdirk4" | "trapezoid" | "newmark" => Some(GainingSteps::BesideVertex),
        "tr-bdf2" | "sdirk2" | "sdirk3" | "bdf2" => Some(GainingSteps::BesideBody),
        _ => None,
    }
}

/// Integrators that gain no energy in impacts.
const NONE_GAINED: &str = "implicit-euler and generalised-alpha with `rho = 0` gain none";

/// Advice on a `scheme` that has gained energy in a run with contact; `None` for a scheme that does not
/// gain energy in impacts.
pub fn advice_on_gain(scheme: &str) -> Option<String> {
    gaining_steps(scheme)?;
    Some(format!("`{scheme}` gains energy in impacts that last few steps: {NONE_GAINED}"))
}

impl ImpactDurations {
    /// Computes the durations in units of `step` [s]; `None` if no moving body can touch anything.
    pub(super) fn new(
        model: &ContactModel,
        parties: &[ContactParty<'_>],
        system: &System,
        step: Option<f64>,
    ) -> Option<Self> {
        let shortest = |times: &mut dyn Iterator<Item = (usize, f64)>| {
            let (body, time) = times.min_by(|a, b| a.1.total_cmp(&b.1))?;
            let body = model.names[body].clone();
            Some(ImpactDuration { body, time, steps: step.map(|step| time / step) })
        };
        let of_vertices = vertex_times(model, system);
        let of_bodies = (0..parties.len()).filter_map(|body| {
            let own = of_vertices[body]?;
            let party = &parties[body];
            let lone = party.body.mesh.element_dimension() == 0 && party.body.springs.is_empty();
            party.time_of_waves().map(|time| (body, own.max(time))).or_else(|| lone.then_some((body, own)))
        });
        let mut vertices = (0..parties.len()).filter_map(|body| Some((body, of_vertices[body]?)));
        let vertex = shortest(&mut vertices)?;
        Some(ImpactDurations { vertex, body: shortest(&mut { of_bodies }) })
    }

    /// Sentence for the report.
    pub(super) fn described(&self) -> String {
        let ImpactDuration { body, time, .. } = &self.vertex;
        format!(
            "contact of the lightest vertex, of `{body}`, lasts {} s{}: steps up to {} s keep the energy of \
             impacts with tr-bdf2, in longer ones {NONE_GAINED}",
            Rounded::<3>(*time),
            self.vertex.in_steps(),
            Rounded::<3>(PART_OF_CONTACT * time),
        )
    }

    /// Warning about an integrator that has gained energy with steps of this length.
    pub(super) fn warning(&self, scheme: &str) -> Option<String> {
        let (impact, part, what) = match gaining_steps(scheme)? {
            GainingSteps::BesideVertex => {
                (&self.vertex, PART_OF_CONTACT, "contact of the lightest vertex, of")
            }
            GainingSteps::BesideBody => (self.body.as_ref()?, PART_OF_BODY, "an impact of"),
        };
        let ImpactDuration { body, time, steps } = impact;
        (part * (*steps)? < 1.0).then(|| {
            format!(
                "`{scheme}` may gain energy in impacts: {what} `{body}`, lasts {} s{}, and in steps of more \
                 than {} s it has gained several times what there was; {NONE_GAINED}",
                Rounded::<3>(*time),
                impact.in_steps(),
                Rounded::<3>(part * time),
            )
        })
    }
}

impl ImpactDuration {
    fn in_steps(&self) -> String {
        self.steps.map_or(String::new(), |steps| format!(", {} steps", Rounded::<2>(steps)))
    }
}

/// Shortest contact of a vertex of each body [s]; `None` for bodies that do not move or touch nothing.
fn vertex_times(model: &ContactModel, system: &System) -> Vec<Option<f64>> {
    let count = model.names.len() as u32;
    let mut lightest = vec![f64::INFINITY; model.names.len()];
    for &v in &model.surface.vertices {
        let (mass, area) = (system.mass()[v as usize], model.surface.vertex_areas[v as usize]);
        if mass > 0.0 && area > 0.0 && !system.is_pinned(v as usize) {
            let of_body = &mut lightest[model.body(v) as usize];
            *of_body = of_body.min(mass / area);
        }
    }
    let time = |body: u32| {
        let others = (0..count).filter(|other| model.touch(body, *other));
        let laws = others.map(|other| &model.laws.of(body, other).barrier);
        let softness = laws.map(|law| law.reach / law.stiffness).reduce(f64::min)?;
        let time = PI * (lightest[body as usize] * softness / 8.0).sqrt();
        time.is_finite().then_some(time)
    };
    (0..count).map(time).collect()
}

impl ContactParty<'_> {
    /// Time in which a wave crosses a solid there and back along its shortest extent [s]:
    /// `2 L sqrt(rho / E)`.
    fn time_of_waves(&self) -> Option<f64> {
        let mesh = &self.body.mesh;
        let is_solid = self.spec.elastic.is_some() && mesh.element_dimension() == mesh.dimension;
        let young = self.young.filter(|_| is_solid)?;
        let density = self.body.mass.iter().sum::<f64>() / mesh.lumped_measure().iter().sum::<f64>();
        let (lower, upper) = mesh.bounding_box();
        let thinnest = lower.iter().zip(&upper).map(|(low, high)| high - low).fold(f64::INFINITY, f64::min);
        Some(2.0 * thinnest * (density / young).sqrt())
    }
}
