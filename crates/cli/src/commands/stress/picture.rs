//! End states as drawings.

use std::fmt::Write;

use pliant_lab::stress::Picture;

/// Pale where the volume is right, blue where it is small, yellow where it is large, red where it is
/// negative.
fn color(j: f64) -> &'static str {
    match j {
        j if j.is_nan() => "#888888",
        j if j <= 0.0 => "#d55e00",
        j if j < 0.8 => "#56b4e9",
        j if j < 0.95 => "#a6d4ee",
        j if j > 1.25 => "#f0e442",
        _ => "#dfe6e9",
    }
}

/// The same for the light that falls on a surface in space.
fn shade(light: f64) -> &'static str {
    const SHADES: [&str; 6] = ["#51646e", "#6b7f89", "#8598a2", "#a2b3bb", "#c0cdd3", "#dfe6e9"];
    SHADES[((light.clamp(0.0, 1.0) * 5.99) as usize).min(5)]
}

/// The drawing inside a square of `size` at `(x, y)`, as elements of an SVG.
pub(super) fn draw(picture: &Picture, (x, y): (f64, f64), size: f64) -> String {
    let d = picture.dimension;
    let at = |v: u32| {
        let p = &picture.x[v as usize * d..][..d];
        match p {
            // From the front, a little from the right and from above: first axis to the right, last one up.
            [a, b, c] => [0.87 * a - 0.5 * b, 0.87 * c + 0.25 * a + 0.43 * b, 0.5 * a + 0.87 * b - 0.5 * c],
            _ => [p[0], p[1], 0.0],
        }
    };
    let points: Vec<[f64; 3]> = picture.triangles.iter().flatten().map(|v| at(*v)).collect();
    if points.is_empty() || points.iter().flatten().any(|c| !c.is_finite()) {
        return String::new();
    }
    let bound = |c: usize, pick: fn(f64, f64) -> f64, from| points.iter().map(|p| p[c]).fold(from, pick);
    let (low, high) = (
        [0, 1].map(|c| bound(c, f64::min, f64::INFINITY)),
        [0, 1].map(|c| bound(c, f64::max, f64::NEG_INFINITY)),
    );
    let extent = (high[0] - low[0]).max(high[1] - low[1]).max(f64::MIN_POSITIVE);
    let scale = 0.9 * size / extent;
    let place = |p: [f64; 3]| {
        let (cx, cy) = (0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]));
        (x + 0.5 * size + scale * (p[0] - cx), y + 0.5 * size - scale * (p[1] - cy))
    };
    let mut order: Vec<(f64, usize)> =
        picture.triangles.iter().enumerate().map(|(i, t)| (t.iter().map(|v| at(*v)[2]).sum(), i)).collect();
    // The far ones first; in the plane the inverted ones last.
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    if d == 2 && picture.j.len() == order.len() {
        order.sort_by(|a, b| picture.j[b.1].total_cmp(&picture.j[a.1]));
    }
    let mut out = String::from("<g stroke=\"#333\" stroke-width=\"0.3\" stroke-linejoin=\"round\">");
    for (_, i) in order {
        let triangle = picture.triangles[i];
        let fill = if d == 2 {
            color(picture.j.get(i).copied().unwrap_or(1.0))
        } else {
            shade(light(triangle.map(at)))
        };
        let [a, b, c] = triangle.map(|v| place(at(v)));
        let _ = write!(
            out,
            "<path fill=\"{fill}\" d=\"M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}z\"/>",
            a.0, a.1, b.0, b.1, c.0, c.1
        );
    }
    out + "</g>"
}

/// How much light from the upper left falls on a triangle.
fn light([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length == 0.0 { 0.5 } else { (0.5 * n[1].abs() + 0.35 * n[0].abs() + 0.75 * n[2].abs()) / length }
}

/// A drawing of its own.
pub(super) fn svg(picture: &Picture, size: f64) -> String {
    let drawing = draw(picture, (0.0, 0.0), size);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{size}\" height=\"{size}\" viewBox=\"0 0 {size} \
         {size}\">{drawing}</svg>"
    )
}

/// Drawings in rows and columns, with their names.
pub(super) fn sheet(columns: &[String], rows: &[(String, Vec<Option<&Picture>>)], size: f64) -> String {
    const NAMES: f64 = 190.0;
    const TOP: f64 = 26.0;
    let (width, height) = (NAMES + size * columns.len() as f64, TOP + size * rows.len() as f64 + 4.0);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 \
         {width} {height}\" font-family=\"sans-serif\" font-size=\"12\"><rect width=\"{width}\" \
         height=\"{height}\" fill=\"white\"/>"
    );
    for (c, name) in columns.iter().enumerate() {
        let x = NAMES + size * (c as f64 + 0.5);
        let _ = write!(out, "<text x=\"{x}\" y=\"16\" text-anchor=\"middle\">{}</text>", escape(name));
    }
    for (r, (name, pictures)) in rows.iter().enumerate() {
        let y = TOP + size * r as f64;
        let _ = write!(out, "<text x=\"8\" y=\"{}\">{}</text>", y + 0.5 * size + 4.0, escape(name));
        for (c, picture) in pictures.iter().enumerate() {
            if let Some(picture) = picture {
                out += &draw(picture, (NAMES + size * c as f64, y), size);
            }
        }
        out.push('\n');
    }
    out + "</svg>\n"
}

/// For HTML and SVG.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
