//! Line charts.

use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::cartesian::Cartesian2d;
use plotters::element::{EmptyElement, PathElement, Text};
use plotters::prelude::SVGBackend;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, Color};

use super::PlotError;
use super::axis::{AxisScale, Ticks};
use super::labels;
use super::style::{Area, Drawn, GREY, Mark, color, letters, page, shortened, stroke, titled};

/// Width of the legend.
const LEGEND: u32 = 215;
/// Height of a name in the legend, and its maximum number of letters.
const NAME: i32 = 17;
const LONGEST_NAME: usize = 28;

/// Specification of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisSpec {
    /// Quantity, with its unit.
    pub name: String,
    /// Scale of the axis.
    pub scale: AxisScale,
}

impl AxisSpec {
    /// A logarithmic axis.
    pub fn log(name: &str) -> AxisSpec {
        AxisSpec { name: name.to_owned(), scale: AxisScale::Log }
    }

    /// A linear axis.
    pub fn linear(name: &str) -> AxisSpec {
        AxisSpec { name: name.to_owned(), scale: AxisScale::Linear }
    }
}

/// One point of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Coordinate along the first axis.
    pub x: f64,
    /// Coordinate along the second; `None` for a failed run, drawn as a cross at the top.
    pub y: Option<f64>,
    /// Label next to the point.
    pub label: Option<String>,
}

impl Point {
    /// A point without a label.
    pub fn new(x: f64, y: f64) -> Point {
        Point { x, y: Some(y), label: None }
    }
}

/// A line: points of one series.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The name in the legend.
    pub name: String,
    /// Points, joined in this order; points without a number interrupt the line.
    pub points: Vec<Point>,
    /// True to mark each point; lines of many points are better without marks.
    pub marked: bool,
    /// False for points without a joining line, such as measurements.
    pub joined: bool,
    /// Index of colour, dashes and mark, equal in all charts of this line: the first 24 differ.
    pub look: usize,
}

/// Slope triangle of a power `y = c x^order`, below `(x, y)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeTriangle {
    /// Exponent of the power.
    pub order: f64,
    /// Abscissa of the lower corner.
    pub x: f64,
    /// Ordinate of the lower corner.
    pub y: f64,
}

/// A line chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Above it.
    pub title: String,
    /// The first axis.
    pub x: AxisSpec,
    /// The second axis.
    pub y: AxisSpec,
    /// Lines, in the order of the legend.
    pub lines: Vec<Line>,
    /// Slope triangles for comparison.
    pub slopes: Vec<SlopeTriangle>,
    /// Named horizontal lines at these heights, such as the limit of measurement.
    pub floors: Vec<(f64, String)>,
    /// True to name these lines at their right ends.
    pub floors_named_right: bool,
}

type Axes<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Ticks, Ticks>>;

impl Chart {
    /// A chart without lines.
    pub fn new(title: &str, x: AxisSpec, y: AxisSpec) -> Chart {
        Chart {
            title: title.to_owned(),
            x,
            y,
            lines: vec![],
            slopes: vec![],
            floors: vec![],
            floors_named_right: false,
        }
    }

    /// Draws the chart as SVG, 900 by 520 or higher if the legend needs it. Points without a position on
    /// the axes are omitted.
    ///
    /// # Errors
    /// The drawing library fails.
    pub fn svg(&self) -> Result<String, PlotError> {
        let height = (self.lines.len() as u32 * NAME as u32 + 110).max(520);
        page(&self.title, (900, height), |root| self.draw(&titled(root, &self.title)?))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let width = area.dim_in_pixel().0;
        let (plot, legend) = area.split_horizontally(width - LEGEND);
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let x = Ticks::over(self.x.scale, points().map(|p| p.x));
        let heights = points().filter(|p| self.x.scale.holds(p.x)).filter_map(|p| p.y);
        let floors = self.floors.iter().map(|(y, _)| *y);
        let triangles = self.slopes.iter().map(|slope| slope.y);
        let mut y = Ticks::over(self.y.scale, heights.chain(floors).chain(triangles));
        if points().any(|p| p.y.is_none()) {
            // Margin for crosses above all points.
            let (low, _) = y.ends();
            y = Ticks::over(self.y.scale, [low, y.at(1.09)].into_iter());
        }
        let mut chart = ChartBuilder::on(&plot)
            .margin_right(12)
            .margin_left(6)
            .margin_top(6)
            .x_label_area_size(42)
            .y_label_area_size(66)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .x_desc(&self.x.name)
            .y_desc(&self.y.name)
            .x_labels(9)
            .y_labels(16)
            .bold_line_style(BLACK.mix(0.16))
            .light_line_style(BLACK.mix(0.05))
            .label_style(letters(13, BLACK))
            .axis_desc_style(letters(14, BLACK))
            .draw()?;
        for (height, name) in &self.floors {
            self.draw_floor(&mut chart, (x, y), *height, name)?;
        }
        for slope in &self.slopes {
            self.draw_slope(&mut chart, x, *slope)?;
        }
        for line in &self.lines {
            self.draw_line(&mut chart, line, y)?;
        }
        self.draw_labels(&chart)?;
        self.draw_legend(&legend)
    }

    fn draw_line(&self, chart: &mut Axes<'_, '_>, line: &Line, y: Ticks) -> Drawn {
        let placed: Vec<&Point> = line.points.iter().filter(|p| self.x.scale.holds(p.x)).collect();
        let at = |p: &Point| p.y.filter(|y| self.y.scale.holds(*y)).map(|y| (p.x, y));
        let path: Vec<(f64, f64)> = placed.iter().filter_map(|p| at(p)).collect();
        if line.joined {
            chart.draw_series(std::iter::once(PathElement::new(path.clone(), stroke(line.look))))?;
        }
        if line.marked {
            chart.draw_series(path.iter().map(|at| Mark { at: *at, line: line.look, failed: false }))?;
        }
        let top = y.at(0.965);
        let crosses = placed.iter().filter(|p| p.y.is_none());
        chart.draw_series(crosses.map(|p| Mark { at: (p.x, top), line: line.look, failed: true }))?;
        Ok(())
    }

    /// Draws labels next to their points, in the colours of their lines; a distant label is joined to its
    /// point.
    fn draw_labels(&self, chart: &Axes<'_, '_>) -> Drawn {
        let area = chart.plotting_area();
        let (pixels, (left, top)) = (area.strip_coord_spec(), area.get_base_pixel());
        let mut labels = vec![];
        for line in &self.lines {
            for point in &line.points {
                let (Some(y), Some(label)) = (point.y, &point.label) else { continue };
                if self.x.scale.holds(point.x) && self.y.scale.holds(y) {
                    let (x, y) = area.map_coordinate(&(point.x, y));
                    labels.push((((x - left, y - top), label.as_str()), line.look));
                }
            }
        }
        let (width, height) = area.dim_in_pixel();
        let texts: Vec<((i32, i32), &str)> = labels.iter().map(|(label, _)| *label).collect();
        let places = labels::places(&texts, (width as i32, height as i32));
        for (((point, text), look), place) in labels.into_iter().zip(places) {
            let Some(corner) = place else { continue };
            let middle =
                (if corner.0 > point.0 { corner.0 } else { point.0 - 6 }, corner.1 + labels::HEIGHT / 2);
            if (middle.1 - point.1).abs() > 2 * labels::HEIGHT {
                pixels.draw(&PathElement::new(vec![point, middle], color(look).mix(0.5).stroke_width(1)))?;
            }
            pixels.draw_text(text, &letters(labels::HEIGHT, color(look)), corner)?;
        }
        Ok(())
    }

    fn draw_floor(&self, chart: &mut Axes<'_, '_>, (x, _): (Ticks, Ticks), height: f64, name: &str) -> Drawn {
        if !self.y.scale.holds(height) {
            return Ok(());
        }
        let (low, high) = x.ends();
        let style = GREY.stroke_width(1);
        chart.draw_series(std::iter::once(PathElement::new(vec![(low, height), (high, height)], style)))?;
        let (at, place, style) = match self.floors_named_right {
            true => (high, (-4, -2), letters(11, GREY).pos(Pos::new(HPos::Right, VPos::Bottom))),
            false => (low, (4, -14), letters(11, GREY)),
        };
        let label = Text::new(name.to_owned(), place, style);
        chart.draw_series(std::iter::once(EmptyElement::at((at, height)) + label))?;
        Ok(())
    }

    fn draw_slope(&self, chart: &mut Axes<'_, '_>, x: Ticks, slope: SlopeTriangle) -> Drawn {
        let SlopeTriangle { order, x: x0, y: y0 } = slope;
        if !(self.x.scale.holds(x0) && self.y.scale.holds(y0)) {
            return Ok(());
        }
        // Width: a twelfth of the axis.
        let (low, high) = x.ends();
        let width = (high / low).powf(1.0 / 12.0);
        let (x1, y1) = (x0 * width, y0 * width.powf(order));
        let style = GREY.stroke_width(1);
        let corners = vec![(x0, y0), (x1, y0), (x1, y1), (x0, y0)];
        chart.draw_series(std::iter::once(PathElement::new(corners, style)))?;
        let label = Text::new(format!("{order}"), (4, -6), letters(12, GREY));
        let middle = (x1, (y0 * y1).sqrt());
        chart.draw_series(std::iter::once(EmptyElement::at(middle) + label))?;
        Ok(())
    }

    fn draw_legend(&self, area: &Area<'_>) -> Drawn {
        let mut y = 14;
        for line in &self.lines {
            if line.joined {
                area.draw(&PathElement::new(vec![(4, y), (34, y)], stroke(line.look)))?;
            }
            if line.marked {
                area.draw(&Mark { at: (19, y), line: line.look, failed: false })?;
            }
            area.draw_text(&shortened(&line.name, LONGEST_NAME), &letters(12, BLACK), (40, y - 6))?;
            y += NAME;
        }
        if self.lines.iter().flat_map(|line| &line.points).any(|point| point.y.is_none()) {
            area.draw_text("× at the top: the run failed", &letters(11, GREY), (4, y))?;
        }
        Ok(())
    }
}
