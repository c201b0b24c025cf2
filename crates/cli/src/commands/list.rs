//! `pliant list`: what scenes can be made of, from the registries of the core.

use pliant::element::{self, ELEMENTS};
use pliant::integrator::{IntegratorSpec, Method};
use pliant::material::{AboutPreset, Domain, MaterialDescription, MaterialSpec, PRESETS};
use serde_json::{Map, Value, json};

use crate::arguments::{Family, ListArguments};
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;
use crate::text::{entry, number, wrap};

const ALL: [Family; 6] = [
    Family::Integrators,
    Family::Materials,
    Family::Presets,
    Family::Elements,
    Family::Meshes,
    Family::Channels,
];

pub(crate) fn execute(arguments: &ListArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let families = arguments.family.map_or_else(|| ALL.to_vec(), |family| vec![family]);
    let mut document = Map::from_iter([("status".to_owned(), json!(ExitStatus::Done))]);
    let mut text = String::new();
    for (i, family) in families.into_iter().enumerate() {
        let (name, items) = items(family);
        let gap = if i == 0 { "" } else { "\n" };
        text += &format!("{gap}{name}\n\n");
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
    Ok(ExitStatus::Done)
}

/// Members of each family, by its name, as `pliant list --json` prints them.
pub fn listed() -> Vec<(&'static str, Vec<Value>)> {
    let families = ALL.into_iter().map(items);
    families.map(|(name, items)| (name, items.into_iter().map(|item| item.value).collect())).collect()
}

/// One thing that a scene can name.
struct Item {
    name: String,
    summary: String,
    /// Facts about it: name and text.
    facts: Vec<(String, String)>,
    /// The same for programs.
    value: Value,
}

impl Item {
    fn new(name: &str, summary: &str, facts: Vec<(&str, String)>, value: Value) -> Item {
        let facts = facts.into_iter().map(|(name, fact)| (name.to_owned(), fact)).collect();
        Item { name: name.to_owned(), summary: summary.to_owned(), facts, value }
    }

    /// The names of its facts, those that may be left out marked.
    fn keys(&self) -> Vec<String> {
        let mark = |about: &str| if about.ends_with("(optional)") { " (optional)" } else { "" };
        self.facts.iter().map(|(key, about)| format!("{key}{}", mark(about))).collect()
    }

    fn describe(&self, width: usize) -> String {
        let mut out = format!("  {}\n{}", self.name, wrap(&self.summary, 4, width));
        for (name, fact) in &self.facts {
            out += &entry(name, fact, 4, 13, width);
        }
        out
    }
}

fn items(family: Family) -> (&'static str, Vec<Item>) {
    match family {
        Family::Integrators => {
            ("integrators", IntegratorSpec::ALL.iter().map(|i| integrator(&i.method())).collect())
        }
        Family::Materials => {
            let tables = choices("MaterialSpec");
            let keys =
                |name: &str| tables.iter().find(|t| t.name == name).map(Item::keys).unwrap_or_default();
            let specs = MaterialSpec::examples();
            ("materials", specs.iter().map(|spec| material(spec, &keys(spec.name()))).collect())
        }
        Family::Presets => ("presets", PRESETS.iter().map(preset).collect()),
        Family::Elements => ("elements", ELEMENTS.iter().map(element).collect()),
        Family::Meshes => ("meshes", choices("MeshSpec")),
        Family::Channels => ("channels", choices("Channel")),
    }
}

fn integrator(method: &Method) -> Item {
    let about = &method.documentation;
    let stability = if about.stability_limit == 0.0 {
        "none: gains energy at any step".to_owned()
    } else if about.stability_limit == f64::INFINITY {
        "any step on a linear system".to_owned()
    } else {
        format!("step x frequency up to {}", number(about.stability_limit))
    };
    let cost = match (about.solves, about.force_evaluations) {
        (0, 0) => "seven force evaluations an iteration, two or three iterations a step".to_owned(),
        (0, 1) => "1 force evaluation a step".to_owned(),
        (0, forces) => format!("{forces} force evaluations a step"),
        (1, _) => "1 nonlinear solve a step".to_owned(),
        (solves, _) => format!("{solves} nonlinear solves a step"),
    };
    let error = match method.error_exponent() {
        Some(_) => "estimated in every step: steps can be `adaptive`",
        None => "not estimated: the step is fixed",
    };
    let mut value = json!(about);
    value["adaptive"] = json!(method.is_adaptive());
    let facts = vec![
        ("order", about.order.to_string()),
        ("stability", stability),
        ("cost", cost),
        ("error", error.to_owned()),
        ("symplectic", if about.symplectic { "yes" } else { "no" }.to_owned()),
        ("conserves", format!("linear momentum; {}", about.conserves)),
        ("source", about.source.to_owned()),
    ];
    Item::new(about.name, about.summary, facts, value)
}

/// `parameters` are the keys that the material takes in a scene.
fn material(material: &MaterialSpec, parameters: &[String]) -> Item {
    let MaterialDescription { summary, formula, source, domain, frame_indifferent, has_rest_shape } =
        material.about();
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
    facts.insert(0, ("parameters", parameters.join(", ")));
    let example = json!(material)[material.name()].clone();
    let mut value = json!(material.about());
    value["name"] = json!(material.name());
    value["example"] = example;
    Item::new(material.name(), summary, facts, value)
}

fn preset(about: &AboutPreset) -> Item {
    let facts = vec![
        ("young", format!("{} Pa", number(about.young))),
        ("poisson", number(about.poisson)),
        ("density", format!("{} kg/m^3", number(about.density))),
        ("source", about.source.to_owned()),
    ];
    Item::new(about.name, about.summary, facts, json!(about))
}

fn element(about: &element::ElementDescription) -> Item {
    let facts = vec![
        ("scene", about.scene.to_owned()),
        ("vertices", about.vertices.to_string()),
        ("energy", about.formula.to_owned()),
        ("source", about.source.to_owned()),
    ];
    Item::new(about.name, about.summary, facts, json!(about))
}

/// The choices of one type of the scene, with their documentation, from the schema.
fn choices(kind: &str) -> Vec<Item> {
    let schema = pliant_scene::schema();
    let definitions = &schema.as_value()["$defs"];
    let choices = definitions[kind]["oneOf"].as_array().cloned().unwrap_or_default();
    choices.iter().filter_map(|choice| self::choice(choice, definitions)).collect()
}

/// A plain name, or a name with a table of its own.
fn choice(choice: &Value, definitions: &Value) -> Option<Item> {
    let summary = text_of(choice);
    if let Some(name) = choice["const"].as_str() {
        let value = json!({ "name": name, "summary": summary });
        return Some(Item { name: name.to_owned(), summary, facts: vec![], value });
    }
    let (name, table) = choice["properties"].as_object()?.iter().next()?;
    let definition = table["$ref"].as_str()?.strip_prefix("#/$defs/")?;
    let definition = &definitions[definition];
    let required = definition["required"].as_array().cloned().unwrap_or_default();
    let fields = definition["properties"].as_object()?.iter();
    let fields: Vec<(String, String, bool)> =
        fields.map(|(key, about)| (key.clone(), text_of(about), required.contains(&json!(key)))).collect();
    let facts = fields.iter().map(|(key, about, needed)| {
        (key.clone(), if *needed { about.clone() } else { format!("{about} (optional)") })
    });
    let listed: Vec<Value> = fields
        .iter()
        .map(|(key, about, needed)| json!({ "name": key, "summary": about, "required": needed }))
        .collect();
    let value = json!({ "name": name, "summary": summary, "fields": listed });
    Some(Item { name: name.clone(), summary, facts: facts.collect(), value })
}

fn text_of(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().replace('`', "")
}
