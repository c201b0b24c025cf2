//! Charts in a terminal: braille characters have two by four dots each.

use super::chart::{ChartAxes, TimeChart};
use crate::picture::ticks;

/// Bits of the dots of a braille character, by row and column; Unicode 15, chapter 21.1.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
/// Columns for the numbers at the axis.
const NUMBERS: usize = 11;

impl TimeChart {
    /// Draws one small chart for each series, one below the other, so that they can be told apart without
    /// colours: `width` columns, `height` rows each.
    pub fn text(&self, width: usize, height: usize) -> String {
        let mut text = format!("{}, {}\n", self.title, self.name);
        for series in &self.series {
            let alone = TimeChart { series: vec![series.clone()], ..self.clone() };
            text += &format!("\n{}\n", series.name);
            text += &alone.block(width.max(NUMBERS + 12) - NUMBERS - 1, height.max(2));
        }
        text
    }

    fn block(&self, columns: usize, rows: usize) -> String {
        let axes = self.axes();
        let mut cells = vec![0_u32; columns * rows];
        let places = self.series[0].points.iter().map(|point| dot(&axes, *point, [2 * columns, 4 * rows]));
        let places: Vec<Option<[usize; 2]>> = places.collect();
        let mut set = |[x, y]: [usize; 2]| cells[y / 4 * columns + x / 2] |= DOTS[y % 4][x % 2];
        for pair in places.windows(2) {
            if let [Some(from), Some(to)] = *pair {
                between(from, to, &mut set);
            }
        }
        places.into_iter().flatten().for_each(set);
        let mut text = String::new();
        for (row, cells) in cells.chunks(columns).enumerate() {
            let line: String = cells.iter().filter_map(|bits| char::from_u32(0x2800 + bits)).collect();
            let label = label(&axes, row, rows);
            text += &format!("{label:>NUMBERS$} {}\n", line.trim_end_matches('\u{2800}'));
        }
        let [start, end] = axes.time.map(|time| format!("{time:.4}"));
        text + &format!(
            "{:>NUMBERS$} {start} s{end:>rest$} s\n",
            "",
            rest = columns.saturating_sub(start.len() + 4)
        )
    }
}

/// Label of the first, the last and the middle row: the value at its middle.
fn label(axes: &ChartAxes, row: usize, rows: usize) -> String {
    if row != 0 && row + 1 != rows && row != rows / 2 {
        return String::new();
    }
    let [low, high] = axes.value;
    let value = high - (row as f64 + 0.5) / rows as f64 * (high - low);
    // Enough digits to distinguish rows.
    match ticks(low, high).as_slice() {
        [(a, _), (b, _), ..] if (b - a).abs() < 1e-3 || value.abs() >= 1e5 => format!("{value:.3e}"),
        _ => format!("{value:.4}"),
    }
}

fn dot(axes: &ChartAxes, point: [f64; 2], size: [usize; 2]) -> Option<[usize; 2]> {
    let [x, y] = axes.share(point);
    let at = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
    point[1].is_finite().then(|| [at(x, size[0]), size[1] - 1 - at(y, size[1])])
}

/// Sets all dots of a straight line except its end.
fn between(from: [usize; 2], to: [usize; 2], set: &mut impl FnMut([usize; 2])) {
    let count = from[0].abs_diff(to[0]).max(from[1].abs_diff(to[1]));
    for i in 0..count {
        let at = |axis: usize| {
            let (a, b) = (from[axis] as f64, to[axis] as f64);
            (a + (b - a) * i as f64 / count as f64).round() as usize
        };
        set([at(0), at(1)]);
    }
}
