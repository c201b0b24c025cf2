//! Advice: changes with which a failed case would have passed.

/// Halvings of a step that are tried.
const HALVINGS: u32 = 12;
/// Bisections between the largest that worked and the smallest that did not: to a tenth.
const BISECTIONS: u32 = 3;

/// The largest step below `step` [s] that `works`, to a tenth; `None` where none of 4096 times less does.
pub(super) fn nearest_step(step: f64, works: impl Fn(f64) -> bool) -> Option<f64> {
    let mut good = (1..=HALVINGS).map(|n| step / f64::from(1u32 << n)).find(|step| works(*step))?;
    let mut bad = 2.0 * good;
    for _ in 0..BISECTIONS {
        let middle = (good * bad).sqrt();
        if works(middle) { good = middle } else { bad = middle }
    }
    Some(good)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_step_is_found_to_a_tenth() {
        for limit in [0.9, 0.3, 1e-3] {
            let found = nearest_step(1.0, |step| step <= limit).unwrap();
            assert!(found <= limit && found > 0.9 * limit, "{found} for {limit}");
        }
        assert_eq!(nearest_step(1.0, |_| false), None);
    }
}
