//! Advice for a failed case: changes with which it would have passed.

/// Maximum number of halvings of a step.
const HALVINGS: u32 = 12;
/// Number of bisections between the largest working step and the smallest failing one: to a tenth.
const BISECTIONS: u32 = 3;

/// Largest step below `step` [s] for which `works` holds, to a tenth; `None` if even a 4096th of `step`
/// fails.
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
