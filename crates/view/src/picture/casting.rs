//! Conversion of recorded frames to figures with colours.

use super::figure::{Dot, DrawnFigure, DrawnMark, DrawnTrail};
use super::film::RenderOptions;
use super::image::Rgb;
use super::legend::ColorScale;
use super::space::Vec3;
use crate::colour;
use crate::drawing::{BodyScalars, Colouring, DrawError, Drawing, DrawnBody, DrawnFrame};

/// Largest number of points whose paths are drawn, if nothing else is drawn.
const TRAILS: usize = 24;
/// Smallest and largest radius of a dot, relative to that of the median mass.
const SIZES: [f64; 2] = [0.5, 5.0];

/// Data shared by all frames.
#[derive(Debug)]
pub(super) struct Cast {
    colouring: Colouring,
    range: (f64, f64),
    /// Colour bar; `None` for colours by body.
    pub(super) scale: Option<ColorScale>,
    /// Radius of each vertex's dot.
    sizes: Vec<f32>,
    /// Positions in all frames of a few points, for their paths.
    paths: Option<Vec<Vec<Vec3>>>,
}

impl Cast {
    pub(super) fn new(
        drawing: &mut Drawing,
        options: &RenderOptions,
        frames: &[usize],
    ) -> Result<Cast, DrawError> {
        let colouring = options.colouring;
        let by_body = matches!(colouring, Colouring::Body);
        let range = match options.range {
            Some(range) => range,
            None if by_body => (0.0, 1.0),
            None => range_over(drawing, &colouring, frames)?,
        };
        let scale = (!by_body).then(|| ColorScale {
            name: name(&colouring),
            range: [range.0, range.1],
            color: |share| colour::of_value(f64::from(share), (0.0, 1.0)),
        });
        let paths = if has_trails(drawing.bodies()) { Some(paths(drawing)?) } else { None };
        Ok(Cast { colouring, range, scale, sizes: sizes(drawing), paths })
    }

    /// Figure of a frame.
    pub(super) fn figure(&self, drawing: &mut Drawing, frame: usize) -> Result<DrawnFigure, DrawError> {
        let scalars = match self.colouring {
            Colouring::Body => None,
            colouring => Some(drawing.scalars(&colouring, frame)?),
        };
        let DrawnFrame { x, .. } = drawing.frame(frame)?;
        let vertices = places(&x);
        let mut figure = DrawnFigure { dimension: drawing.dimension(), vertices, ..DrawnFigure::default() };
        for (number, body) in drawing.bodies().iter().enumerate() {
            let scalars = scalars.as_ref().map(|scalars| &scalars.bodies[number]);
            self.add(&mut figure, number, body, scalars);
        }
        figure.walls = drawing.walls().iter().map(|wall| [single(wall.point), single(wall.normal)]).collect();
        let pins = drawing
            .pins()
            .iter()
            .map(|pin| DrawnMark { at: figure.vertices[*pin as usize], name: String::new() });
        let probes = drawing.probes().iter().filter_map(|probe| {
            Some(DrawnMark { at: single(*probe.positions.get(frame)?), name: probe.name.clone() })
        });
        figure.marks = pins.chain(probes).collect();
        figure.trails = self.trails(&figure, frame);
        Ok(figure)
    }

    fn add(&self, figure: &mut DrawnFigure, number: usize, body: &DrawnBody, scalars: Option<&BodyScalars>) {
        let own = colour::of_body(number);
        let of_number = |values: &[f64], at: usize| {
            values.get(at).map_or(colour::NOT_FINITE, |value| colour::of_value(*value, self.range))
        };
        let of_vertex = |vertex: u32| match scalars {
            None => own,
            Some(BodyScalars::Vertices(values)) => of_number(values, body.place(vertex)),
            // Element values do not apply to lines and points.
            Some(BodyScalars::Elements(_) | BodyScalars::None) => colour::NOT_FINITE,
        };
        for (triangle, corners) in body.triangles.iter().enumerate() {
            let colors: [Rgb; 3] = match (scalars, &body.elements) {
                (Some(BodyScalars::Elements(values)), Some(elements)) => {
                    [of_number(values, elements[triangle] as usize); 3]
                }
                _ => corners.map(of_vertex),
            };
            figure.faces.push(*corners);
            figure.face_colors.push(colors);
        }
        figure.segments.extend(&body.lines);
        figure.segment_colors.extend(body.lines.iter().map(|ends| ends.map(of_vertex)));
        figure.dots.extend(body.points.iter().map(|&vertex| {
            let size = self.sizes.get(vertex as usize).copied().unwrap_or(1.0);
            Dot { vertex, color: of_vertex(vertex), size }
        }));
    }

    fn trails(&self, figure: &DrawnFigure, frame: usize) -> Vec<DrawnTrail> {
        let Some(paths) = &self.paths else { return vec![] };
        let trail = |dot: &Dot| {
            let places = paths[..=frame].iter().map(|places| places[dot.vertex as usize]).collect();
            DrawnTrail { places, color: dot.color }
        };
        figure.dots.iter().map(trail).collect()
    }
}

/// Label of a colouring, such as `von-mises [Pa]`.
fn name(colouring: &Colouring) -> String {
    match colouring.unit() {
        "1" => colouring.to_string(),
        unit => format!("{colouring} [{unit}]"),
    }
}

fn range_over(
    drawing: &mut Drawing,
    colouring: &Colouring,
    frames: &[usize],
) -> Result<(f64, f64), DrawError> {
    let mut over_all: Option<(f64, f64)> = None;
    for frame in frames {
        if let Some((low, high)) = drawing.scalars(colouring, *frame)?.range() {
            let (lowest, highest) = over_all.unwrap_or((low, high));
            over_all = Some((low.min(lowest), high.max(highest)));
        }
    }
    Ok(told_apart(over_all.unwrap_or((0.0, 1.0))))
}

/// Widens a range so that colours do not show rounding: values equal to six digits have one colour.
fn told_apart((low, high): (f64, f64)) -> (f64, f64) {
    let largest = low.abs().max(high.abs());
    if high - low > 1e-6 * largest {
        return (low, high);
    }
    let room = if largest > 0.0 { 0.5 * largest } else { 0.5 };
    (low - room, high + room)
}

fn has_trails(bodies: &[DrawnBody]) -> bool {
    let points: usize = bodies.iter().map(|body| body.points.len()).sum();
    let alone = bodies.iter().all(|body| body.triangles.is_empty() && body.lines.is_empty());
    alone && points <= TRAILS
}

fn paths(drawing: &mut Drawing) -> Result<Vec<Vec<Vec3>>, DrawError> {
    (0..drawing.times().len()).map(|frame| Ok(places(&drawing.frame(frame)?.x))).collect()
}

/// Cube roots of the masses relative to the median one.
fn sizes(drawing: &Drawing) -> Vec<f32> {
    let Some(masses) = drawing.masses() else { return vec![] };
    let points = drawing.bodies().iter().flat_map(|body| &body.points);
    let mut sorted: Vec<f64> = points.map(|point| masses[*point as usize]).filter(|m| *m > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(usual) = sorted.get(sorted.len() / 2).copied() else { return vec![] };
    masses.iter().map(|mass| (mass / usual).cbrt().clamp(SIZES[0], SIZES[1]) as f32).collect()
}

fn places(x: &[f64]) -> Vec<Vec3> {
    x.as_chunks::<3>().0.iter().map(|place| single(*place)).collect()
}

fn single(place: [f64; 3]) -> Vec3 {
    place.map(|x| x as f32)
}
