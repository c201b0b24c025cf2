//! The reference page of the scene format: the JSON schema as Markdown, so that it says what the program
//! reads.

use std::collections::BTreeMap;

use pliant::expression;
use pliant::quantity;
use serde_json::{Map, Value};

/// Conventions of the tables below.
fn introduction() -> String {
    let (with_prefixes, without) = quantity::unit_symbols();
    let list = |names: &[&str]| names.join(", ");
    let functions: Vec<String> = expression::signatures().map(|call| format!("`{call}`")).collect();
    format!(
        "# The scene format\n\n\
         Every key of a scene file. This page is what `pliant schema --format markdown` prints.\n\n\
         **Quantities** are numbers in the SI unit of the column *unit*, or texts with a unit: `3e6` or \
         `\"3 MPa\"`, `0.03` or\n\
         `\"3 cm\"`. A decimal unit is exact: `\"3 cm\"` and `0.03` are the same number.\n\n\
         - units with prefixes: {}\n\
         - prefixes: {}\n\
         - units without: {}\n\
         - products `N m`, `N*m`; quotients `m/s`, `m^3/(kg s^2)`; powers `s^2`, `s**2`, `s²`, `s2`\n\n\
         **Formulas** of the time `t` [s] are texts, `\"-9.81 * (1 - exp(-t/0.1))\"`; they give the number \
         in SI units, and angles in\n\
         them are in radian. Where the column *type* lists them, they may also use the reference position \
         `X`, `Y`, `Z` [m].\n\n\
         - operators: `+` `-` `*` `/` `^` `**` `<` `<=` `>` `>=`; a comparison is 1 or 0\n\
         - functions: {}\n\
         - constant: `pi`\n\
         - numbers with names, in SI units, after `where`: `\"A*sin(w*t) where A = 2, w = 12\"`; gradients \
         of runs exist with respect to those\n\
         \x20 of loads, of muscles, of gravity and of prescribed displacements\n\n\
         **Choices** are a table with exactly one key, `mesh = {{ grid = {{ cells = [2, 3], spacing = 0.1 \
         }} }}`; a choice without\n\
         parameters is a word, `\"rk4\"`.\n",
        list(&with_prefixes),
        list(&quantity::prefixes()),
        list(&without),
        functions.join(", "),
    )
}

/// The whole page.
pub(super) fn page(schema: &Value) -> String {
    let mut writer = Writer { definitions: &schema["$defs"], sections: BTreeMap::new(), queue: Vec::new() };
    let mut out = introduction();
    out += &writer.section("A scene", schema);
    // In the order in which they are first met: a reader meets them in that order too.
    let mut next = 0;
    while let Some((name, title)) = writer.queue.get(next).cloned() {
        out += &writer.section(&title, &writer.definitions[&name].clone());
        next += 1;
    }
    out
}

struct Writer<'a> {
    definitions: &'a Value,
    /// The title of the section of each definition that has one.
    sections: BTreeMap<String, String>,
    queue: Vec<(String, String)>,
}

impl Writer<'_> {
    fn section(&mut self, title: &str, schema: &Value) -> String {
        let mut out = format!("\n## {title}\n\n{}\n\n", text(schema));
        // The path of the keys in it: the title without its backticks.
        let path = title.trim_matches('`').to_owned();
        let path = if title.starts_with('`') { format!("{path}.") } else { String::new() };
        if let Some(choices) = schema["oneOf"].as_array() {
            out += "| choice | takes | unit | meaning |\n|---|---|---|---|\n";
            for choice in choices {
                for (name, content) in names(choice) {
                    let kind = content
                        .map_or("a word".to_owned(), |content| self.kind(content, &format!("{path}{name}")));
                    let unit = content.map_or("", unit);
                    out += &row(&[&format!("`{name}`"), &kind, unit, &text(choice)]);
                }
            }
        } else if let Some(words) = schema["enum"].as_array() {
            let words: Vec<String> =
                words.iter().filter_map(Value::as_str).map(|word| format!("`{word}`")).collect();
            out += &format!("One of {}.\n", words.join(", "));
        } else {
            let empty = Map::new();
            let properties = schema["properties"].as_object().unwrap_or(&empty);
            let required: Vec<&str> =
                schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
            out += "| key | type | unit | default | meaning |\n|---|---|---|---|---|\n";
            for (key, property) in properties {
                let kind = self.kind(property, &format!("{path}{key}"));
                let default = match &property["default"] {
                    _ if required.contains(&key.as_str()) => "**required**".to_owned(),
                    Value::Null => "none".to_owned(),
                    value => format!("`{value}`"),
                };
                out += &row(&[&format!("`{key}`"), &kind, unit(property), &default, &text(property)]);
            }
        }
        out
    }

    /// Kind of a value, in words; `path` names a table that is met for the first time.
    fn kind(&mut self, schema: &Value, path: &str) -> String {
        if let Some(reference) = schema["$ref"].as_str() {
            let name = reference.rsplit('/').next().unwrap_or(reference);
            return self.link(name, path);
        }
        if let Some(alternatives) = schema["anyOf"].as_array() {
            let some = alternatives.iter().filter(|alternative| alternative["type"] != "null");
            let kinds: Vec<String> = some.map(|alternative| self.kind(alternative, path)).collect();
            return kinds.join(" or ") + &range(schema);
        }
        let types: Vec<&str> = match &schema["type"] {
            Value::String(one) => vec![one.as_str()],
            several => several.as_array().into_iter().flatten().filter_map(Value::as_str).collect(),
        };
        if types.contains(&"array") {
            let entries = self.kind(&schema["items"], &format!("{path}[]"));
            return format!("list of {}{entries}", length(schema));
        }
        if let Some(variables) = schema["formula"].as_str() {
            return format!("quantity or formula of {variables}");
        }
        if schema["unit"].is_string() {
            return format!("quantity{}", range(schema));
        }
        let word = match types.first() {
            Some(&"number") => "number",
            Some(&"integer") => "whole number",
            Some(&"string") => "text",
            Some(&"boolean") => "`true` or `false`",
            _ => "table",
        };
        format!("{word}{}", range(schema))
    }

    /// A link to the section of a definition, which is queued where it is new.
    fn link(&mut self, name: &str, path: &str) -> String {
        if !self.sections.contains_key(name) {
            let title = format!("`{path}`");
            self.sections.insert(name.to_owned(), title.clone());
            self.queue.push((name.to_owned(), title));
        }
        let title = &self.sections[name];
        let choice = !self.definitions[name]["oneOf"].is_null() || !self.definitions[name]["enum"].is_null();
        format!("[{} {title}](#{})", if choice { "choice" } else { "table" }, anchor(title))
    }
}

/// How Markdown renderers call the heading.
fn anchor(title: &str) -> String {
    let kept = title.to_lowercase().replace(' ', "-");
    kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, '-' | '_')).collect()
}

/// The names of a choice, with what follows each.
fn names(choice: &Value) -> Vec<(String, Option<&Value>)> {
    if let Some(word) = choice["const"].as_str() {
        return vec![(word.to_owned(), None)];
    }
    let words = choice["enum"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let tables = choice["properties"].as_object().into_iter().flatten();
    let words = words.map(|word| (word.to_owned(), None));
    words.chain(tables.map(|(name, content)| (name.clone(), Some(content)))).collect()
}

/// The description on one line.
fn text(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().replace('\n', " ")
}

/// The unit of a value or of the entries of a list.
fn unit(schema: &Value) -> &str {
    if let Some(unit) = schema["unit"].as_str() {
        return unit;
    }
    let inner =
        schema["anyOf"].as_array().and_then(|some| some.iter().map(unit).find(|unit| !unit.is_empty()));
    match (&schema["items"], inner) {
        (_, Some(unit)) => unit,
        (Value::Null, None) => "",
        (items, None) => unit(items),
    }
}

/// `2 or 3 `, `2 `, `at least 1 `, or nothing.
fn length(schema: &Value) -> String {
    match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
        (Some(least), Some(most)) if least == most => format!("{least} "),
        (Some(least), Some(most)) if least + 1 == most => format!("{least} or {most} "),
        (Some(least), None) => format!("at least {least} "),
        _ => String::new(),
    }
}

/// The bounds of a number.
fn range(schema: &Value) -> String {
    let plain = |value: &Value| value.as_f64().map(|value| value.to_string());
    let least = plain(&schema["minimum"]).map(|value| format!("{value} or more"));
    let above = plain(&schema["exclusiveMinimum"]).map(|value| format!("above {value}"));
    let most = plain(&schema["maximum"]).map(|value| format!("at most {value}"));
    let below = plain(&schema["exclusiveMaximum"]).map(|value| format!("below {value}"));
    let bounds: Vec<String> = [least, above, most, below].into_iter().flatten().collect();
    if bounds.is_empty() { String::new() } else { format!(", {}", bounds.join(", ")) }
}

/// A row of a table; the bar in a text would end its cell.
fn row(cells: &[&str]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
    format!("| {} |\n", cells.join(" | "))
}
