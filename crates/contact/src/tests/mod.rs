//! Tests against reference values of 50 digits (`data/points.json`, `data/motions.json`, from an mpmath
//! script based on the definitions, with derivatives by differences) and assembled values of ipc-toolkit
//! 1.6.1 and of such a script (`data/surfaces.json`).

mod fuzz;
mod points;
mod surfaces;

use serde_json::Value;

/// Parses a number written as text with 17 digits or as a JSON number.
fn number(value: &Value) -> f64 {
    value.as_str().map_or_else(|| value.as_f64().unwrap(), |text| text.parse().unwrap())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

fn positions<const D: usize, const N: usize>(value: &Value) -> [[f64; D]; N] {
    let rows: Vec<[f64; D]> =
        value.as_array().unwrap().iter().map(|row| numbers(row).try_into().unwrap()).collect();
    rows.try_into().unwrap()
}

/// Random numbers, uniform in `[0, 1)` (PCG's multiplier).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn vector<const D: usize>(&mut self) -> [f64; D] {
        std::array::from_fn(|_| self.between(-1.0, 1.0))
    }
}
