//! The chart of a study of meshes and steps: total error against run time.

use super::results::{QuantityRefinement, RefinementResults, percent};
use crate::quantity::ElementFamily;
use crate::study::plot::{AxisSpec, Chart, Line, Point};

/// Number of colours: schemes that solve equations have hollow marks, which come after all colours.
const COLOURS: usize = 8;
/// Colour of the front, black.
const FRONT: usize = 6;
/// Ratio of errors below which two floors share a name.
const SHARED: f64 = 1.25;

/// Chart of the total error of a quantity against run time: a colour for each kind of elements, filled where
/// the scheme is explicit; the front is joined and named by what to write; thin lines are the errors of the
/// meshes, below which no step leads.
pub fn chart(results: &RefinementResults, of: &QuantityRefinement) -> Chart {
    let mut chart = Chart::new(
        &format!("{}: total error against run time", of.quantity),
        AxisSpec::log("run time [s]"),
        AxisSpec::log(&format!("error of {}, relative", of.quantity)),
    );
    for (colour, family) in ElementFamily::ALL.into_iter().enumerate() {
        for explicit in [true, false] {
            let own = of.errors.iter().filter(|error| {
                let row = &results.rows[error.row];
                error.told && row.family == family && (row.explicit == explicit || results.is_static)
            });
            let points: Vec<Point> =
                own.map(|error| Point::new(results.rows[error.row].seconds, error.total)).collect();
            if points.is_empty() || (results.is_static && !explicit) {
                continue;
            }
            // The legend has room for the elements; the hollow mark below is the same by implicit schemes.
            let name = if explicit { family.words(results.dimension) } else { "  implicit" };
            chart.lines.push(Line {
                name: name.to_owned(),
                points,
                marked: true,
                joined: false,
                look: if explicit { colour } else { colour + COLOURS },
            });
        }
    }
    let mut front = vec![];
    for row in &of.front {
        let Some(error) = of.errors.iter().find(|error| error.row == *row) else { continue };
        let row = &results.rows[*row];
        let label = format!("{} {}", row.cells, row.family.name(results.dimension));
        let repeated = front.iter().any(|point: &Point| point.label.as_ref() == Some(&label));
        let label = (!repeated).then_some(label);
        front.push(Point { x: row.seconds, y: Some(error.total), label });
    }
    chart.lines.push(Line { name: "front".into(), points: front, marked: false, joined: true, look: FRONT });
    (chart.floors, chart.floors_named_right) = (floors(results, of), true);
    chart
}

/// Errors of the meshes with their names; neighbours share one.
fn floors(results: &RefinementResults, of: &QuantityRefinement) -> Vec<(f64, String)> {
    let mut floors: Vec<(f64, String)> = of
        .errors
        .iter()
        .filter(|error| error.told && results.rows[error.row].is_floor && !results.is_static)
        .map(|error| {
            let row = &results.rows[error.row];
            let name = row.family.name(results.dimension);
            (error.total, format!("{} {name} {}", row.cells, percent(error.total)))
        })
        .collect();
    floors.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut shared: Vec<(f64, String)> = vec![];
    for (error, name) in floors {
        match shared.iter_mut().rev().find(|(_, name)| !name.is_empty()) {
            Some((named, names)) if *named / error < SHARED => {
                *names += &format!(", {name}");
                shared.push((error, String::new()));
            }
            _ => shared.push((error, name)),
        }
    }
    shared
}
