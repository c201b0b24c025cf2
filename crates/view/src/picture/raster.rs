//! Rasterisation of triangles, thick lines and discs into samples.

use super::camera::Projected;

/// Subdivisions of a sample's side to which corners are rounded, so that neighbours share their edges
/// exactly.
const GRAIN: f32 = 16.0;
/// Corners beyond this many samples are not drawn; products of coordinates stay below 2^63.
const FARTHEST: f32 = 1e6;

/// Corner in the grid of samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Position [sample]; the centre of the first sample is at (0.5, 0.5).
    pub(super) at: [f32; 2],
    pub(super) nearness: f32,
    pub(super) weight: f32,
}

impl Corner {
    /// Corner of a projected point, with `samples` by `samples` samples per pixel.
    pub(super) fn new(point: &Projected, samples: usize) -> Corner {
        let at = point.at.map(|x| x * samples as f32);
        Corner { at, nearness: point.nearness, weight: point.weight }
    }
}

/// Sample inside a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Covered {
    pub(super) column: usize,
    pub(super) row: usize,
    /// Barycentric coordinates in the picture.
    pub(super) share: [f32; 3],
    pub(super) nearness: f32,
}

impl Covered {
    /// Barycentric coordinates on the triangle itself.
    pub(super) fn on_surface(&self, corners: &[Corner; 3]) -> [f32; 3] {
        let weighted = [0, 1, 2].map(|i| self.share[i] * corners[i].weight);
        let sum: f32 = weighted.iter().sum();
        weighted.map(|share| share / sum)
    }
}

/// Visits every sample whose centre is inside a triangle, row by row. A sample on an edge shared by two
/// triangles belongs to exactly one of them: the one that has it to its right or below.
pub(super) fn triangle(corners: &[Corner; 3], size: [usize; 2], mut visit: impl FnMut(Covered)) {
    if corners.iter().flat_map(|corner| corner.at).any(|x| !x.is_finite() || x.abs() >= FARTHEST) {
        return;
    }
    let at = corners.map(|corner| corner.at.map(|x| (x * GRAIN).round() as i64));
    let area = area(at[0], at[1], at[2]);
    if area == 0 {
        return;
    }
    let edges = [0, 1, 2].map(|i| EdgeFunction::new(at[(i + 1) % 3], at[(i + 2) % 3], area.signum()));
    let [columns, rows] = [0, 1].map(|axis| span(at.map(|corner| corner[axis]), size[axis]));
    let per_area = 1.0 / area.abs() as f32;
    for row in rows {
        let mut values = edges.map(|edge| edge.at(columns.start, row));
        for column in columns.clone() {
            if values.iter().zip(&edges).all(|(value, edge)| value + edge.included > 0) {
                let share = values.map(|value| value as f32 * per_area);
                let nearness = (0..3).map(|i| share[i] * corners[i].nearness).sum();
                visit(Covered { column, row, share, nearness });
            }
            for (value, edge) in values.iter_mut().zip(&edges) {
                *value += edge.along;
            }
        }
    }
}

/// Signed area of a triangle, times two.
fn area(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Range of rows or columns whose centres can be inside.
fn span(at: [i64; 3], count: usize) -> std::ops::Range<usize> {
    let grain = GRAIN as i64;
    let low = at.iter().min().map_or(0, |low| (low - grain / 2).div_euclid(grain));
    let high = at.iter().max().map_or(0, |high| (high + grain / 2).div_euclid(grain) + 1);
    low.clamp(0, count as i64) as usize..high.clamp(0, count as i64) as usize
}

/// Edge function, positive on the inner side.
#[derive(Clone, Copy)]
struct EdgeFunction {
    from: [i64; 2],
    /// Change to the next column and to the next row.
    along: i64,
    down: i64,
    /// 1 if the edge itself is inside.
    included: i64,
}

impl EdgeFunction {
    fn new(from: [i64; 2], to: [i64; 2], sign: i64) -> EdgeFunction {
        let (x, y) = (sign * (to[0] - from[0]), sign * (to[1] - from[1]));
        let included = i64::from(y < 0 || (y == 0 && x > 0));
        EdgeFunction { from, along: -y * GRAIN as i64, down: x * GRAIN as i64, included }
    }

    /// Value at the centre of a sample.
    fn at(&self, column: usize, row: usize) -> i64 {
        let grain = GRAIN as i64;
        let center = |n: usize| n as i64 * grain + grain / 2;
        let (x, y) = (center(column) - self.from[0], center(row) - self.from[1]);
        (self.down * y + self.along * x) / grain
    }
}

/// Visits the samples of a line of this width [sample], with the fraction towards the second end and the
/// position across, -1 to 1.
pub(super) fn line(
    ends: &[Corner; 2],
    width: f32,
    size: [usize; 2],
    mut visit: impl FnMut(Covered, f32, f32),
) {
    let [a, b] = ends;
    let along = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
    let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
    let along = if length > 1e-6 { along.map(|x| x / length) } else { [1.0, 0.0] };
    let half = 0.5 * width;
    // Extends the ends by 0.3 of the width to close gaps at bends.
    let cap = 0.3 * width;
    let corner = |end: &Corner, sign: f32, side: f32| Corner {
        at: [
            end.at[0] + sign * cap * along[0] - side * half * along[1],
            end.at[1] + sign * cap * along[1] + side * half * along[0],
        ],
        ..*end
    };
    let [p, q, r, s] =
        [corner(a, -1.0, -1.0), corner(b, 1.0, -1.0), corner(b, 1.0, 1.0), corner(a, -1.0, 1.0)];
    let mut covered = |corners: [Corner; 3], second: [f32; 3], side: [f32; 3]| {
        triangle(&corners, size, |sample| {
            let mix = |of: [f32; 3]| (0..3).map(|i| of[i] * sample.share[i]).sum::<f32>();
            visit(sample, mix(second), mix(side));
        });
    };
    covered([p, q, r], [0.0, 1.0, 1.0], [-1.0, -1.0, 1.0]);
    covered([p, r, s], [0.0, 1.0, 0.0], [-1.0, 1.0, 1.0]);
}

/// Visits the samples of a disc of this radius [sample], with their offset from the centre in radii.
pub(super) fn disc(
    center: [f32; 2],
    radius: f32,
    size: [usize; 2],
    mut visit: impl FnMut(usize, usize, [f32; 2]),
) {
    let range = |axis: usize| {
        let bound = |x: f32| x.clamp(0.0, size[axis] as f32) as usize;
        bound((center[axis] - radius).floor())..bound((center[axis] + radius).ceil() + 1.0)
    };
    for row in range(1) {
        for column in range(0) {
            let place = [column as f32 + 0.5 - center[0], row as f32 + 0.5 - center[1]];
            let place = place.map(|x| x / radius);
            if place[0] * place[0] + place[1] * place[1] <= 1.0 {
                visit(column, row, place);
            }
        }
    }
}
