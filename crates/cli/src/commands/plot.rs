//! `pliant plot`: charts of recordings over time.

use std::ffi::OsStr;

use pliant_view::picture::write_png;
use pliant_view::plot::{ChartError, PlotQuantity, TimeChart};
use serde_json::json;

use super::render::{refuse_existing, write};
use crate::arguments::{PlotArguments, QuantityArgument};
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;
use crate::text::counted;

/// Rows of each chart in a terminal.
const ROWS: usize = 6;

pub(crate) fn execute(arguments: &PlotArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    arguments.files.iter().try_for_each(|file| Failure::unless_file(file))?;
    if let Some(output) = &arguments.output {
        refuse_existing(output, arguments.force)?;
    }
    let chart =
        quantity(arguments.quantity).chart_of_all(&arguments.files).map_err(|error| cannot_plot(&error))?;
    match &arguments.output {
        None if terminal.json => {}
        None => terminal.print(&chart.text(terminal.width(), ROWS))?,
        Some(output) => {
            write(output, &encoded(&chart, arguments)?)?;
            let series = counted(chart.series.len() as u64, "line", "lines");
            terminal.report(&format!("wrote {series} to {}", output.display()))?;
        }
    }
    let series: Vec<_> =
        chart.series.iter().map(|one| json!({ "name": one.name, "points": one.points })).collect();
    let plotted = json!({ "file": arguments.output, "name": chart.name, "series": series });
    terminal.document(&json!({ "status": ExitStatus::Done, "plotted": plotted }))?;
    Ok(ExitStatus::Done)
}

fn encoded(chart: &TimeChart, arguments: &PlotArguments) -> Result<Vec<u8>, Failure> {
    let output = arguments.output.as_deref().unwrap_or_else(|| "".as_ref());
    let extension = output.extension().and_then(OsStr::to_str).unwrap_or("").to_ascii_lowercase();
    match extension.as_str() {
        "svg" => Ok(chart.svg().into_bytes()),
        "png" => {
            let mut content = Vec::new();
            let image = chart.image(arguments.theme.into());
            write_png(&image, &mut content).map_err(|error| Failure::failed("output", error.to_string()))?;
            Ok(content)
        }
        _ => {
            let message = format!("{} does not say which format it has", output.display());
            Err(Failure::usage(format!("{message}; end it in .svg or .png")))
        }
    }
}

fn quantity(argument: QuantityArgument) -> PlotQuantity {
    match argument {
        QuantityArgument::Energy => PlotQuantity::Energy,
        QuantityArgument::Balance => PlotQuantity::Balance,
        QuantityArgument::Momentum => PlotQuantity::Momentum,
        QuantityArgument::AngularMomentum => PlotQuantity::AngularMomentum,
        QuantityArgument::MinJ => PlotQuantity::MinJ,
        QuantityArgument::Reactions => PlotQuantity::Reactions,
        QuantityArgument::Probes => PlotQuantity::Probes,
    }
}

fn cannot_plot(error: &ChartError) -> Failure {
    match error {
        ChartError::Record(error) => Failure::recording(error),
        error => Failure::usage(error.to_string()),
    }
}
