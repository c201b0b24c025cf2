//! Observed orders of convergence.

use super::row::Row;

/// Sets the observed orders of an integrator's rows, from the largest step to the smallest: the order
/// between each row and the one before, if both count.
pub(super) fn observe(rows: &mut [&mut Row]) {
    let mut before: Option<(f64, f64)> = None;
    for row in rows {
        row.obs_order = None;
        // Adaptive rows have no single step size.
        let Some(error) = row.error().filter(|error| *error > 0.0 && row.tol.is_none()) else {
            before = None;
            continue;
        };
        row.obs_order = before.map(|(dt, larger)| (larger / error).ln() / (dt / row.dt).ln());
        before = Some((row.dt, error));
    }
}

/// Slope of the line through the finest rows that count, four at most; `None` for fewer than two.
pub fn fit<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Option<f64> {
    let mut points: Vec<(f64, f64)> = rows
        .into_iter()
        .filter(|row| row.tol.is_none())
        .filter_map(|row| Some((row.dt.ln(), row.error().filter(|error| *error > 0.0)?.ln())))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points.truncate(4);
    if points.len() < 2 {
        return None;
    }
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let (xy, xx) = points
        .iter()
        .fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x) * (p.0 - x)));
    (xx > 0.0).then(|| xy / xx)
}
