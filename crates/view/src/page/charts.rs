//! Charts below the time line: energies, momentum, smallest J, probes, reactions.

use pliant_record::read::Column;
use serde_json::{Value, json};

use crate::drawing::{DrawError, Drawing};

/// Charts of columns of `/energy`: name, unit, columns.
const ENERGY: [(&str, &str, &[&str]); 4] = [
    ("energy", "J", &["kinetic", "elastic", "gravitational", "loads", "total"]),
    ("momentum", "kg m/s", &["linear_momentum[0]", "linear_momentum[1]", "linear_momentum[2]"]),
    ("angular momentum", "kg m^2/s", &["angular_momentum[0]", "angular_momentum[1]", "angular_momentum[2]"]),
    ("min J", "1", &["min_j"]),
];
const PROBE: [(&str, &str); 2] = [("displacement", "m"), ("velocity", "m/s")];

/// Charts that a recording has data for, one value for each of these frames.
pub(super) fn charts(drawing: &mut Drawing, frames: &[usize]) -> Result<Vec<Value>, DrawError> {
    let mut charts = Vec::new();
    let probes: Vec<String> = drawing.probes().iter().map(|probe| probe.name.clone()).collect();
    let topics: Vec<String> = ["/energy", "/reactions"]
        .map(str::to_owned)
        .into_iter()
        .chain(probes.iter().map(|name| format!("/probe/{name}")))
        .collect();
    let topics: Vec<&str> = topics.iter().map(String::as_str).collect();
    let tables = drawing.trajectory().tables(&topics)?;
    let (recorded, of_probes) = tables.split_at(2);
    let [energy, reactions] = recorded else { return Ok(charts) };
    for (name, unit, columns) in ENERGY {
        let of_chart = columns.iter().filter_map(|name| energy.iter().find(|column| column.name == *name));
        // An energy that a scene does not have is zero in every frame.
        let of_chart = of_chart.filter(|column| column.values.iter().any(|value| *value != 0.0));
        charts.extend(chart(name, unit, of_chart, frames));
    }
    for (probe, columns) in probes.iter().zip(of_probes) {
        for (quantity, unit) in PROBE {
            let of_chart = columns.iter().filter(|column| column.name.starts_with(quantity));
            charts.extend(chart(&format!("{probe}: {quantity}"), unit, of_chart, frames));
        }
    }
    let forces = reactions.iter().filter(|column| column.name.contains(".force["));
    charts.extend(chart("reactions", "N", forces, frames));
    Ok(charts)
}

/// Chart of these columns; `None` if there are none.
fn chart<'a>(
    name: &str,
    unit: &str,
    columns: impl Iterator<Item = &'a Column>,
    frames: &[usize],
) -> Option<Value> {
    // JSON has no NaN: `null`.
    let values = |column: &Column| -> Vec<Option<f64>> {
        let value = |&frame: &usize| column.values.get(frame).copied().filter(|value| value.is_finite());
        frames.iter().map(value).collect()
    };
    let series: Vec<Value> =
        columns.map(|column| json!({ "name": column.name, "values": values(column) })).collect();
    (!series.is_empty()).then(|| json!({ "name": name, "unit": unit, "series": series }))
}
