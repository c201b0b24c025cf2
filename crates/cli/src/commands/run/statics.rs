//! Closing lines of a static equilibrium.

use pliant::simulation::{Extreme, StaticState};

use crate::text::number;

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

/// `1.5e-2 m at vertex 7 of `beam`, (2, 0.5)`.
fn place(extreme: &Extreme, unit: &str, what: &str) -> String {
    let Extreme { value, body, index, at } = extreme;
    format!(
        "{} {unit}, at {what} {index} of `{body}`, now at ({}) m",
        number(*value),
        at.map(number).join(", ")
    )
}
