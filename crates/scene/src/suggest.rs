//! "Did you mean".

/// Lines of help for a name that is none of `expected`.
pub(super) fn help(name: &str, expected: &[&str], what: &str) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(nearest) = nearest(name, expected) {
        lines.push(format!("did you mean `{nearest}`?"));
    }
    lines.push(if expected.is_empty() {
        format!("{what}: none")
    } else {
        let names: Vec<String> = expected.iter().map(|name| format!("`{name}`")).collect();
        format!("{what}: {}", names.join(", "))
    });
    lines
}

/// The candidate that a typing mistake, another case or separator, or a longer form of the name explains.
pub(super) fn nearest<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace('_', "-");
    let name = plain(name);
    // The distance is quadratic in the length, and a short name is not mistyped into a very long one.
    if name.len() > 64 {
        return None;
    }
    candidates
        .iter()
        .map(|&candidate| (candidate, plain(candidate)))
        .filter(|(_, plain)| {
            let typing_mistakes = strsim::damerau_levenshtein(&name, plain);
            let shorter = name.chars().count().min(plain.chars().count());
            typing_mistakes <= (shorter / 3).max(1) && shorter > 1
                || strsim::jaro_winkler(&name, plain) >= 0.85
        })
        .max_by(|(_, a), (_, b)| strsim::jaro_winkler(&name, a).total_cmp(&strsim::jaro_winkler(&name, b)))
        .map(|(candidate, _)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_was_meant() {
        let fields = ["young", "poisson", "step", "duration", "per_vertex", "half_space"];
        for (typed, meant) in [
            ("yuong", "young"),
            ("poissons_ratio", "poisson"),
            ("Step", "step"),
            ("stp", "step"),
            ("per-vertex", "per_vertex"),
            ("halfspace", "half_space"),
        ] {
            assert_eq!(nearest(typed, &fields), Some(meant), "{typed}");
        }
    }

    #[test]
    fn stays_silent_about_something_else() {
        for typed in ["gravity", "x", "", "colour", &"young".repeat(1000)] {
            assert_eq!(nearest(typed, &["young", "poisson"]), None, "{typed}");
        }
    }
}
