//! `pliant list`: what scenes can be made of, from the registries of the core.

use pliant::integrator::{Documentation, IntegratorSpec};
use pliant::material::{About, Domain, MaterialSpec};
use serde_json::{Map, Value, json};

use crate::arguments::{Family, ListArguments};
use crate::failure::{Failure, Status};
use crate::terminal::Terminal;
use crate::text::{entry, number, wrap};

const ALL: [Family; 2] = [Family::Integrators, Family::Materials];

pub(crate) fn execute(arguments: &ListArguments, terminal: Terminal) -> Result<Status, Failure> {
    let families = arguments.family.map_or_else(|| ALL.to_vec(), |family| vec![family]);
    let mut document = Map::from_iter([("status".to_owned(), json!(Status::Done))]);
    let mut text = String::new();
    for family in families {
        let (name, items) = items(family);
        text += &format!("{name}\n\n");
        for item in &items {
            text += &item.describe(terminal.width());
            text.push('\n');
        }
        document.insert(name.to_owned(), items.into_iter().map(|item| item.value).collect());
    }
    if !terminal.json {
        terminal.print(&text)?;
    }
    terminal.document(&Value::Object(document))?;
    Ok(Status::Done)
}

/// One thing that a scene can name.
struct Item {
    name: String,
    summary: String,
    /// What there is to know: name and text.
    facts: Vec<(&'static str, String)>,
    /// The same for programs.
    value: Value,
}

impl Item {
    fn describe(&self, width: usize) -> String {
        let mut out = format!("  {}\n{}", self.name, wrap(&self.summary, 4, width));
        for (name, fact) in &self.facts {
            out += &entry(name, fact, 4, 11, width);
        }
        out
    }
}

fn items(family: Family) -> (&'static str, Vec<Item>) {
    match family {
        Family::Integrators => (
            "integrators",
            IntegratorSpec::ALL.iter().map(|i| integrator(&i.method().documentation)).collect(),
        ),
        Family::Materials => ("materials", MaterialSpec::examples().iter().map(material).collect()),
    }
}

fn integrator(about: &Documentation) -> Item {
    let stability = if about.stability_limit == 0.0 {
        "none: gains energy at any step".to_owned()
    } else {
        format!("step x frequency up to {}", number(about.stability_limit))
    };
    let cost = about.force_evaluations;
    let facts = vec![
        ("order", about.order.to_string()),
        ("stability", stability),
        ("cost", format!("{cost} force evaluation{} a step", if cost == 1 { "" } else { "s" })),
        ("symplectic", if about.symplectic { "yes" } else { "no" }.to_owned()),
        ("conserves", format!("linear momentum; {}", about.conserves)),
        ("source", about.source.to_owned()),
    ];
    Item { name: about.name.to_owned(), summary: about.summary.to_owned(), facts, value: json!(about) }
}

fn material(material: &MaterialSpec) -> Item {
    let About { summary, formula, source, domain, frame_indifferent, has_rest_shape } = material.about();
    let defined = match domain {
        Domain::Everywhere => "for every deformation, inverted elements included",
        Domain::PositiveJ => "as long as no element is inverted (J > 0)",
    };
    let mut facts = vec![("psi", formula.to_owned()), ("defined", defined.to_owned())];
    if !frame_indifferent {
        facts.push(("rotation", "not frame indifferent: a rotated body feels forces".to_owned()));
    }
    if !has_rest_shape {
        facts.push(("rest shape", "none: there is stress at F = I".to_owned()));
    }
    facts.push(("source", source.to_owned()));
    // The parameters of the example are the keys that the material takes in a scene.
    let example = json!(material)[material.name()].clone();
    if let Some(parameters) = example.as_object() {
        facts.insert(0, ("parameters", parameters.keys().cloned().collect::<Vec<_>>().join(", ")));
    }
    let mut value = json!(material.about());
    value["name"] = json!(material.name());
    value["example"] = example;
    Item { name: material.name().to_owned(), summary: summary.to_owned(), facts, value }
}
