//! Closing lines of a static equilibrium.

use pliant::control::increments::Increments;
use pliant::quantity::Seconds;
use pliant::simulation::{Extreme, PathState, StaticState};
use serde_json::{Value, json};

use crate::text::{counted, number};

/// The lines on an equilibrium, each with its name.
pub(super) fn facts(state: &StaticState) -> Vec<(&'static str, String)> {
    let StaticState { displacement, von_mises, reactions, residual } = state;
    let mut facts = vec![("displaced", format!("at most {}", place(displacement, "m", "vertex")))];
    facts.extend(
        von_mises.iter().map(|stress| ("von Mises", format!("at most {}", place(stress, "Pa", "element")))),
    );
    let [force, residual] = [reactions.map(number).join(", "), number(*residual)];
    facts.push(("reactions", format!("{force} N, the sum over all pins")));
    facts.push(("residual", format!("{residual} N, the largest residual force at a free degree of freedom")));
    facts
}

/// Increments of a run that finds them by itself.
pub(super) fn increments(increments: &Increments) -> String {
    let Increments { accepted, cut_back, least, largest } = *increments;
    let cut = match cut_back {
        0 => "none cut back".to_owned(),
        n => format!("{} cut back", counted(n, "try", "tries")),
    };
    let solved = counted(accepted, "increment", "increments");
    format!("{solved} solved, {cut}; the smallest {}, the largest {}", Seconds(least), Seconds(largest))
}

/// The lines on a path of equilibria, each with its name.
pub(super) fn path(path: &PathState) -> Vec<(&'static str, String)> {
    let PathState { load_factor, arc_length, limit_points, cut_back, radii, .. } = path;
    let cut = match cut_back {
        0 => "none cut back".to_owned(),
        n => format!("{} cut back", counted(*n, "try", "tries")),
    };
    let [least, largest] = radii.map(number);
    let mut lines = vec![(
        "path",
        format!(
            "to the load factor {}, {} m long, steps of {least} to {largest} m, {cut}",
            number(*load_factor),
            number(*arc_length)
        ),
    )];
    lines.extend(limit_points.iter().map(|limit| {
        let what = if limit.is_maximum { "most" } else { "least" };
        let factor = number(limit.load_factor);
        ("limit", format!("load factor at {what} {factor}, passed in step {}", limit.step))
    }));
    lines
}

/// The same for programs.
pub(super) fn path_document(path: &PathState) -> Value {
    json!({
        "load_factor": path.load_factor,
        "arc_length": path.arc_length,
        "limit_points": path.limit_points,
        "cut_back": path.cut_back,
        "least_radius": path.radii[0],
        "largest_radius": path.radii[1],
        "has_ended": path.has_ended,
    })
}

/// `1.5e-2 m at vertex 7 of `beam`, (2, 0.5)`.
fn place(extreme: &Extreme, unit: &str, what: &str) -> String {
    let Extreme { value, body, index, at } = extreme;
    format!(
        "{} {unit}, at {what} {index} of `{body}`, now at ({}) m",
        number(*value),
        at.map(number).join(", ")
    )
}
