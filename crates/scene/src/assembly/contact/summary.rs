//! Report of contact: bodies that can touch, contact parameters and their origin, and warnings.

use pliant::quantity::{Rounded, counted};

use super::impacts::ImpactDurations;

/// Contact of a scene in numbers.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ContactSummary {
    /// Activation distance `dhat`: gap below which surfaces repel each other [m].
    pub distance: f64,
    /// Origin of the activation distance.
    pub distance_origin: DistanceOrigin,
    /// True in a scene without `[contact]`, in which bodies only touch walls, from gap zero on.
    pub of_walls: bool,
    /// Contact parameters of every pair that can touch.
    pub pairs: Vec<PairLaw>,
    /// Bodies with a smaller activation distance for self-contact.
    pub with_itself: Vec<SelfContact>,
    /// Friction regularisation velocity [m/s]; `None` without friction.
    pub threshold_speed: Option<f64>,
    /// Contact in explicit steps; `None` for implicit steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explicit: Option<ExplicitContactSummary>,
    /// Durations of impacts; `None` in statics and in explicit steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub impacts: Option<ImpactDurations>,
    /// Contact at the start; `None` if the report does not need it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<ContactStart>,
    /// Size of all bodies without obstacles [m], the reference length of tolerances.
    pub size: f64,
    /// Name and size [m] of the smallest body that has a size.
    #[serde(skip)]
    pub(in crate::assembly) smallest: Option<(String, f64)>,
    /// Number of surface vertices.
    pub vertices: usize,
    /// Number of surface triangles, in the plane edges.
    pub faces: usize,
}

/// Origin of the activation distance.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DistanceOrigin {
    /// Specified in the scene.
    Given,
    /// A thousandth of the size of this body, the smallest one.
    SmallestBody(String),
    /// A quarter of the shortest edge, which belongs to this body.
    ShortestEdge(String),
}

/// Contact parameters of two bodies, or of a body with itself.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PairLaw {
    /// Names of the bodies.
    pub bodies: [String; 2],
    /// Contact stiffness `kappa` [Pa].
    pub stiffness: f64,
    /// Origin of the stiffness.
    pub origin: StiffnessOrigin,
    /// Coefficient of friction.
    pub friction: f64,
}

/// Origin of the contact stiffness of a pair.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StiffnessOrigin {
    /// Specified in the scene.
    Given,
    /// Young's modulus of this body, the softer one.
    Modulus(String),
    /// Masses and the step size: neither body has a modulus.
    Masses,
    /// Size of explicit steps relative to the largest stable step.
    ExplicitStep,
    /// No stiffness: neither body moves.
    Nothing,
}

/// Self-contact of a body with a smaller activation distance than contact with others, so that no contact
/// force acts in the reference configuration.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SelfContact {
    /// Name of the body.
    pub body: String,
    /// Activation distance [m].
    pub gap: f64,
    /// Smallest distance between two of the body's primitives in the reference configuration [m].
    pub least: f64,
    /// These two primitives.
    pub between: [String; 2],
}

/// Contact at the start.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ContactStart {
    /// Number of pairs of primitives that the first search measures.
    pub candidates: usize,
    /// Smallest gap of two bodies; `None` if no two can touch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least: Option<StartGap>,
}

/// Smallest gap of two bodies at the start.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StartGap {
    /// Distance minus the radii [m].
    pub gap: f64,
    /// The two primitives.
    pub between: [String; 2],
}

/// Approach speeds that contact can stop in explicit steps.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ExplicitContactSummary {
    /// Step size that determines stiffness and friction [s]; `None` with adaptive step sizes.
    pub step: Option<f64>,
    /// Pairs that can touch.
    pub pairs: Vec<StoppedApproach>,
    /// True if the friction regularisation velocity is raised to what the step size permits.
    pub raises_threshold: bool,
    /// Smallest regularisation velocity that the step size permits for a vertex under its own weight
    /// [m/s].
    pub borne_threshold: f64,
}

/// Approach speeds of two bodies.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StoppedApproach {
    /// Names of the bodies.
    pub bodies: [String; 2],
    /// Largest speed that contact stops before the gap closes [m/s].
    pub stopped: f64,
    /// Largest relative speed of their vertices at the start [m/s].
    pub at_start: f64,
}

/// Limit on a specified activation distance, as a fraction of the size of the smallest body.
const LARGE_DISTANCE: f64 = 0.25;

/// Maximum number of pairs with equal parameters that are named one by one.
const MOST_NAMED: usize = 8;

impl ContactSummary {
    /// Sentence for the list of features in use.
    pub(in crate::assembly) fn described(&self) -> String {
        let surface = format!(
            "{} and {}",
            counted(self.vertices as u64, "vertex", "vertices"),
            counted(self.faces as u64, "face", "faces")
        );
        match self.of_walls {
            true => format!("compliant walls, {surface}"),
            false => format!("contact, activation distance {} m, {surface}", Rounded::<4>(self.distance)),
        }
    }

    /// Contact potential of these steps, and the consequence of there being two kinds; `None` in statics
    /// and with walls only.
    pub fn law(&self) -> Option<String> {
        let (own, others) = match (&self.explicit, &self.impacts) {
            _ if self.of_walls => return None,
            (Some(_), _) => ("explicit steps have a penalty", "implicit ones a barrier"),
            (None, Some(_)) => ("implicit steps have a barrier", "explicit ones a penalty"),
            (None, None) => return None,
        };
        Some(format!("{own}, {others}: the two converge to different motions after an impact"))
    }

    /// All facts about contact, one sentence each; `step` [s] for a fixed step size.
    pub fn facts(&self, step: Option<f64>) -> Vec<String> {
        let (distance, origin) = (Rounded::<4>(self.distance), self.distance_origin.described());
        let mut facts = vec![match self.of_walls {
            true => format!("walls are compliant within {distance} m, {origin}"),
            false => format!("activation distance {distance} m, {origin}"),
        }];
        facts.extend(self.law());
        facts.extend(self.described_pairs());
        facts.extend(self.with_itself.iter().map(|SelfContact { body, gap, least, between: [a, b] }| {
            format!(
                "`{body}` has a self-contact distance of {} m, half of its smallest reference gap {} m, \
                 between {a} and {b}",
                Rounded::<4>(*gap),
                Rounded::<4>(*least)
            )
        }));
        facts.extend(self.threshold_speed.map(|e| {
            let way = step.map_or(String::new(), |h| format!(", {} m per step", Rounded::<4>(e * h)));
            format!("regularised friction: sticking contacts creep at up to {} m/s{way}", Rounded::<4>(e))
        }));
        facts.extend(self.impacts.as_ref().map(ImpactDurations::described));
        facts.extend(self.explicit.iter().flat_map(ExplicitContactSummary::facts));
        facts.extend(self.start.as_ref().map(ContactStart::described));
        facts
    }

    /// Descriptions of the pairs, grouped by equal parameters.
    fn described_pairs(&self) -> Vec<String> {
        let mut laws: Vec<(&PairLaw, Vec<String>)> = vec![];
        for pair in &self.pairs {
            let name = pair.bodies.join("-");
            let same = laws.iter_mut().find(|(law, _)| {
                (law.stiffness, &law.origin, law.friction) == (pair.stiffness, &pair.origin, pair.friction)
            });
            match same {
                Some((_, names)) => names.push(name),
                None => laws.push((pair, vec![name])),
            }
        }
        let described = |(law, names): (&PairLaw, Vec<String>)| {
            let shown = names[..names.len().min(MOST_NAMED)].join(", ");
            let more = match names.len().saturating_sub(MOST_NAMED) {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            let rub = match law.friction > 0.0 {
                true => format!(", mu {}", law.friction),
                false => String::new(),
            };
            format!("{shown}{more}: {} Pa, {}{rub}", Rounded::<4>(law.stiffness), law.origin.described())
        };
        laws.into_iter().map(described).collect()
    }

    /// Warnings about speeds that explicit steps may not stop and about integrators that may gain energy
    /// in impacts.
    pub(in crate::assembly) fn warnings(&self, scheme: &str) -> Vec<String> {
        let gains = self.impacts.as_ref().and_then(|impacts| impacts.warning(scheme));
        gains.into_iter().chain(self.far()).chain(self.explicit_warnings()).collect()
    }

    /// Warning about a specified activation distance that is large compared with the smallest body.
    fn far(&self) -> Option<String> {
        let (body, size) =
            self.smallest.as_ref().filter(|_| self.distance_origin == DistanceOrigin::Given)?;
        (self.distance > LARGE_DISTANCE * size).then(|| {
            format!(
                "[contact] `distance` is {} m, and `{body}` is {} m large: it will hover; the default is a \
                 thousandth of its size",
                Rounded::<3>(self.distance),
                Rounded::<3>(*size)
            )
        })
    }

    fn explicit_warnings(&self) -> Vec<String> {
        let Some(explicit) = &self.explicit else { return vec![] };
        let fast = |pair: &&StoppedApproach| pair.at_start > pair.stopped;
        let worst = explicit
            .pairs
            .iter()
            .filter(fast)
            .max_by(|a, b| (a.at_start * b.stopped).total_cmp(&(b.at_start * a.stopped)));
        let passes = worst.map(|StoppedApproach { bodies: [a, b], stopped, at_start }| {
            format!(
                "`{a}` and `{b}` move at up to {at_start} m/s relative to each other, but explicit contact \
                 stops {stopped} m/s: they may interpenetrate; use an implicit integrator, whose contact \
                 stops any speed, a larger [contact] `distance`, or a smaller step",
                at_start = Rounded::<4>(*at_start),
                stopped = Rounded::<4>(*stopped)
            )
        });
        let slips =
            self.threshold_speed.filter(|e| !explicit.raises_threshold && *e < explicit.borne_threshold);
        let slips = slips.map(|e| {
            format!(
                "`threshold_speed`, {e} m/s, is too small for this step size: a vertex that carries its own \
                 weight needs {} m/s; remove it, and it is raised where necessary",
                Rounded::<4>(explicit.borne_threshold),
                e = Rounded::<4>(e)
            )
        });
        passes.into_iter().chain(slips).collect()
    }
}

impl DistanceOrigin {
    fn described(&self) -> String {
        match self {
            DistanceOrigin::Given => "given".into(),
            DistanceOrigin::SmallestBody(body) => format!("a thousandth of the size of `{body}`"),
            DistanceOrigin::ShortestEdge(body) => format!("a quarter of the shortest edge, of `{body}`"),
        }
    }
}

impl StiffnessOrigin {
    fn described(&self) -> String {
        match self {
            StiffnessOrigin::Given => "given".into(),
            StiffnessOrigin::Modulus(body) => format!("Young's modulus of `{body}`"),
            StiffnessOrigin::Masses => "from masses and the step, since neither has a modulus".into(),
            StiffnessOrigin::ExplicitStep => "the largest that an explicit step allows".into(),
            StiffnessOrigin::Nothing => "neither moves".into(),
        }
    }
}

impl ContactStart {
    fn described(&self) -> String {
        let least = self.least.as_ref().map_or(String::new(), |StartGap { gap, between: [a, b] }| {
            format!("; smallest gap {} m, between {a} and {b}", Rounded::<4>(*gap))
        });
        let pairs = counted(self.candidates as u64, "pair is a candidate", "pairs are candidates");
        format!("{pairs} at the start{least}")
    }
}

impl ExplicitContactSummary {
    fn facts(&self) -> Vec<String> {
        let slowest = self.pairs.iter().min_by(|a, b| a.stopped.total_cmp(&b.stopped));
        let stops = slowest.map(|StoppedApproach { bodies: [a, b], stopped, .. }| {
            format!(
                "explicit contact is a penalty, which stops approaches of up to {stopped} m/s ({a}-{b})",
                stopped = Rounded::<4>(*stopped)
            )
        });
        let raised = self.raises_threshold.then(|| {
            format!(
                "`threshold_speed` is raised to what the step size requires, {} m/s for a vertex that \
                 carries its own weight",
                Rounded::<4>(self.borne_threshold)
            )
        });
        stops.into_iter().chain(raised).collect()
    }
}
