//! Closing lines of a static equilibrium.

use pliant::control::increments::Increments;
use pliant::simulation::{Extreme, StaticState};

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
    facts.push(("residual", format!("{residual} N, the largest force left at a free coordinate")));
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
    format!("{solved} solved, {cut}; the least {} s, the largest {} s", number(least), number(largest))
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
