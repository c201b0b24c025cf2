//! Charts of a fit: measured and predicted values, with the residuals below.

use super::{MeasuredSeries, SceneFit};
use crate::study::plot::{AxisSpec, Chart, Line, PlotError, Point};

/// Smallest height of a chart.
const HEIGHT: u32 = 520;

/// Draws both charts, one below the other.
pub(super) fn svg(fit: &SceneFit, title: &str) -> Result<String, PlotError> {
    let unit = |fit: &SceneFit| match fit.series.first() {
        Some(first) if fit.series.iter().all(|series| series.unit == first.unit) => {
            format!("[{}]", first.unit)
        }
        _ => "in SI units".to_owned(),
    };
    let (mut above, mut below) = (
        Chart::new(
            title,
            AxisSpec::linear(fit.axis),
            AxisSpec::linear(&format!("measured, fitted {}", unit(fit))),
        ),
        Chart::new(
            "",
            AxisSpec::linear(fit.axis),
            AxisSpec::linear(&format!("measured - fitted {}", unit(fit))),
        ),
    );
    for (look, series) in fit.series.iter().enumerate() {
        let line = |name: String, values: Vec<f64>, joined: bool| {
            let mut points: Vec<Point> =
                series.at.iter().zip(values).map(|(x, y)| Point::new(*x, y)).collect();
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
            Line { name, points, marked: !joined, joined, look }
        };
        above.lines.push(line(format!("{}, fitted", series.name), series.fitted.clone(), true));
        above.lines.push(line(format!("{}, measured", series.name), series.measured.clone(), false));
        below.lines.push(line(series.name.clone(), residuals(series), false));
    }
    below.floors.push((0.0, String::new()));
    let charts = [above.svg()?, below.svg()?];
    let heights: Vec<u32> = charts.iter().map(|svg| height(svg)).collect();
    let mut page = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"900\" height=\"{0}\" viewBox=\"0 0 900 {0}\">\n",
        heights.iter().sum::<u32>()
    );
    let mut y = 0;
    for (chart, height) in charts.iter().zip(heights) {
        page += &chart.replacen("<svg ", &format!("<svg y=\"{y}\" "), 1);
        y += height;
    }
    Ok(page + "</svg>\n")
}

fn residuals(series: &MeasuredSeries) -> Vec<f64> {
    series.measured.iter().zip(&series.fitted).map(|(measured, fitted)| measured - fitted).collect()
}

/// Height that the SVG states.
fn height(svg: &str) -> u32 {
    let said = svg.split("height=\"").nth(1).and_then(|rest| rest.split('"').next());
    said.and_then(|height| height.parse().ok()).unwrap_or(HEIGHT)
}
