//! Charts as lines and texts, for SVG or pixels.

use std::fmt::Write as _;

use super::chart::{ChartAxes, TimeChart};
use crate::colour::Rgb;
use crate::picture::{Image, TextAnchor, Theme, stroke, text_width, ticks, write_text};

/// Width and height [pixel].
const SIZE: [usize; 2] = [900, 480];
/// Left, top, right and bottom of the axes [pixel]; the left moves right for longer labels.
const FRAME: [f32; 4] = [84.0, 48.0, 700.0, 430.0];
/// Space between the axis and its labels, and left of the labels [pixel].
const LABEL_GAP: f32 = 8.0;
/// Height of capitals [pixel].
const LETTERS: f32 = 9.5;
/// Colours that can be told apart with colour vision deficiencies; Okabe, Ito 2008, *Color universal
/// design*.
const COLORS: [Rgb; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [230, 159, 0],
    [140, 120, 30],
];
/// Limit on names in the legend.
const NAMES: usize = 18;

/// Shape in a chart.
enum ChartShape {
    Line { points: Vec<[f32; 2]>, width: f32, color: Rgb },
    Words { words: String, at: [f32; 2], anchor: TextAnchor, color: Rgb },
}

impl TimeChart {
    /// Draws the chart as SVG, in the colours of a light page.
    pub fn svg(&self) -> String {
        let [width, height] = SIZE;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"13\" fill=\"none\" stroke-linejoin=\"round\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
        );
        for shape in self.shapes(Theme::Light) {
            // Writing to a string cannot fail.
            let _ = shape.svg(&mut svg);
        }
        svg + "</svg>\n"
    }

    /// Draws the chart as an image.
    pub fn image(&self, theme: Theme) -> Image {
        let [r, g, b] = theme.background();
        let mut image = Image::filled(SIZE, [r, g, b, 255]);
        for shape in self.shapes(theme) {
            shape.draw(&mut image);
        }
        image
    }

    fn shapes(&self, theme: Theme) -> Vec<ChartShape> {
        let frame = ChartFrame::of(self.axes());
        let mut shapes = frame.grid(theme);
        let words = |words: &str, at: [f32; 2], color: Rgb| ChartShape::Words {
            words: words.to_owned(),
            at,
            anchor: TextAnchor::Left,
            color,
        };
        shapes.push(words(&self.title, [16.0, 24.0], theme.ink()));
        shapes.push(words(&self.name, [16.0, FRAME[1] - 8.0], theme.faint()));
        for (i, series) in self.series.iter().enumerate() {
            let color = COLORS[i % COLORS.len()];
            for points in series.points.split(|point| !point[1].is_finite()) {
                let points = points.iter().map(|point| frame.place(*point)).collect();
                shapes.push(ChartShape::Line { points: thinned(points), width: 1.8, color });
            }
            if i < NAMES {
                let y = FRAME[1] + 10.0 + 20.0 * i as f32;
                let points = vec![[FRAME[2] + 16.0, y], [FRAME[2] + 36.0, y]];
                shapes.push(ChartShape::Line { points, width: 3.0, color });
                shapes.push(words(&series.name, [FRAME[2] + 44.0, y + 4.5], theme.ink()));
            }
        }
        if self.series.len() > NAMES {
            let rest = format!("and {} more", self.series.len() - NAMES);
            shapes.push(words(
                &rest,
                [FRAME[2] + 16.0, FRAME[1] + 14.0 + 20.0 * NAMES as f32],
                theme.faint(),
            ));
        }
        shapes
    }
}

/// Axes with their left end in the chart.
struct ChartFrame {
    axes: ChartAxes,
    /// Left end [pixel].
    left: f32,
}

impl ChartFrame {
    /// Frame as wide as the longest label allows.
    fn of(axes: ChartAxes) -> Self {
        let labels = ticks(axes.value[0], axes.value[1]);
        let longest = labels.iter().map(|(_, label)| text_width(label, LETTERS)).fold(0.0, f32::max);
        ChartFrame { axes, left: FRAME[0].max(longest + 2.0 * LABEL_GAP) }
    }

    /// Grid lines with their labels.
    fn grid(&self, theme: Theme) -> Vec<ChartShape> {
        let ChartFrame { axes, left } = self;
        let [_, top, right, bottom] = FRAME;
        let mut shapes = Vec::new();
        let mut line = |points: [[f32; 2]; 2], words: String, at: [f32; 2], anchor: TextAnchor| {
            shapes.push(ChartShape::Line { points: points.to_vec(), width: 1.0, color: theme.grid() });
            shapes.push(ChartShape::Words { words, at, anchor, color: theme.ink() });
        };
        for (value, label) in ticks(axes.value[0], axes.value[1]) {
            let y = self.place([axes.time[0], value])[1];
            line([[*left, y], [right, y]], label, [left - LABEL_GAP, y + 4.5], TextAnchor::Right);
        }
        for (time, label) in ticks(axes.time[0], axes.time[1]) {
            let x = self.place([time, axes.value[0]])[0];
            line([[x, top], [x, bottom]], label, [x, bottom + 18.0], TextAnchor::Middle);
        }
        let at = [0.5 * (left + right), bottom + 38.0];
        let words = "time [s]".to_owned();
        shapes.push(ChartShape::Words { words, at, anchor: TextAnchor::Middle, color: theme.faint() });
        shapes
    }

    fn place(&self, point: [f64; 2]) -> [f32; 2] {
        let [x, y] = self.axes.share(point).map(|share| share as f32);
        [self.left + x * (FRAME[2] - self.left), FRAME[3] + y * (FRAME[1] - FRAME[3])]
    }
}

/// Reduces points to the lowest and the highest in each half pixel, in order, if there are more points
/// than pixels.
fn thinned(points: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
    if points.len() < 2 * SIZE[0] {
        return points;
    }
    let column = |point: &[f32; 2]| (2.0 * point[0]) as i64;
    let runs = points.chunk_by(|a, b| column(a) == column(b));
    runs.flat_map(|run| {
        let by_height = |a: &&[f32; 2], b: &&[f32; 2]| a[1].total_cmp(&b[1]);
        let extremes = [run.iter().min_by(by_height), run.iter().max_by(by_height)];
        let mut extremes: Vec<[f32; 2]> = extremes.into_iter().flatten().copied().collect();
        extremes.sort_by(|a, b| a[0].total_cmp(&b[0]));
        extremes
    })
    .collect()
}

impl ChartShape {
    fn svg(&self, out: &mut String) -> std::fmt::Result {
        match self {
            ChartShape::Line { points, width, color: [r, g, b] } => {
                let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
                let path = path.join("L");
                let style = format!("stroke=\"#{r:02x}{g:02x}{b:02x}\" stroke-width=\"{width}\"");
                writeln!(out, "<path d=\"M{path}\" {style}/>")
            }
            ChartShape::Words { words, at: [x, y], anchor, color: [r, g, b] } => {
                let anchor = match anchor {
                    TextAnchor::Left => "start",
                    TextAnchor::Middle => "middle",
                    TextAnchor::Right => "end",
                };
                let words = words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
                let style = format!("text-anchor=\"{anchor}\" fill=\"#{r:02x}{g:02x}{b:02x}\"");
                writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" {style}>{words}</text>")
            }
        }
    }

    fn draw(&self, image: &mut Image) {
        match self {
            ChartShape::Line { points, width, color } => {
                for pair in points.windows(2) {
                    stroke(image, [pair[0], pair[1]], *width, *color, 1.0);
                }
            }
            ChartShape::Words { words, at, anchor, color } => {
                write_text(image, words, *at, LETTERS, *color, *anchor);
            }
        }
    }
}
