//! "Did you mean".

/// Keys of scenes with their names in other programs and papers, in small letters without separators.
const SYNONYMS: &[(&str, &[&str])] = &[
    ("step", &["dt", "h", "timestep", "stepsize", "deltat"]),
    ("duration", &["tend", "tmax", "endtime", "tfinal", "time", "length"]),
    ("integrator", &["scheme", "method", "stepper", "timeintegrator", "timestepper", "solver"]),
    ("young", &["e", "ymod", "youngmodulus", "youngsmodulus", "modulus", "stiffness"]),
    ("poisson", &["nu", "poissonratio", "poissonsratio", "v"]),
    ("bulk", &["k", "kappa", "bulkmodulus", "compressionmodulus"]),
    ("shear", &["g", "shearmodulus", "modulusofrigidity"]),
    ("lambda", &["la", "lamelambda", "lame1", "firstlame"]),
    ("mu", &["lamemu", "lame2", "secondlame"]),
    ("density", &["rho", "massdensity"]),
    ("total", &["mass"]),
    ("per_vertex", &["pointmass", "nodalmass"]),
    ("stiffness", &["k", "ks", "springconstant"]),
    ("rest_length", &["l0", "restlen"]),
    (
        "pin",
        &[
            "fixed",
            "fix",
            "anchor",
            "anchors",
            "boundary",
            "dirichlet",
            "bc",
            "constraint",
            "constraints",
            "clamp",
        ],
    ),
    ("walls", &["wall", "floor", "ground", "plane", "groundplane", "boundaries"]),
    ("obstacle", &["obstacles", "collider", "colliders", "rigid", "rigidbody"]),
    ("contact", &["collision", "collisions", "ipc", "contacts"]),
    ("friction", &["mu", "frictioncoefficient", "coefficientoffriction"]),
    ("distance", &["dhat", "thickness", "activationdistance", "offset"]),
    ("elastic", &["material", "constitutive", "model", "energy", "hyperelastic"]),
    ("gravity", &["g", "gravitationalacceleration"]),
    ("ether_drag", &["airdrag", "drag", "viscousdrag"]),
    ("nbody", &["gravitation", "newtoniangravity", "mutualgravity"]),
    ("softening", &["eps", "epsilon", "plummer"]),
    ("constant", &["g", "bigg"]),
    ("rate", &["fps", "framerate", "framespersecond", "frequency", "interval"]),
    ("channels", &["fields", "outputs", "quantities", "record"]),
    ("dimension", &["dim", "ndim", "d", "dimensions"]),
    ("body", &["object", "objects", "bodies", "entity", "actor"]),
    ("load", &["force", "forces", "loads", "neumann", "externalforce"]),
    ("velocity", &["v", "v0", "initialvelocity", "speed"]),
    ("position", &["x0", "initialposition", "initialpositions"]),
    ("damping", &["viscosity", "rayleigh", "damp"]),
    ("mass_proportional", &["alpha", "massdamping", "rayleighalpha"]),
    ("stiffness_proportional", &["beta", "stiffnessdamping", "rayleighbeta"]),
    ("springs", &["spring", "edges"]),
    ("membrane", &["shell", "sheet", "clothmaterial"]),
    ("thickness", &["t", "shellthickness"]),
    ("cells", &["resolution", "n", "elements", "divisions", "subdivisions"]),
    ("size", &["extent", "extents", "dimensions", "lengths"]),
    ("origin", &["corner", "offset", "center", "centre"]),
    ("path", &["file", "filename", "url"]),
    ("nodal_integration", &["meandilatation", "fbar", "bbar"]),
    ("tolerance", &["tol", "rtol", "atol", "newtontol"]),
    ("linear", &["linearsolver", "preconditioner"]),
];

/// Key of scenes, among `expected`, that is called `name` elsewhere.
fn synonym<'a>(name: &str, expected: &[&'a str]) -> Option<&'a str> {
    let plain: String = name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    let knows =
        |field: &&str| SYNONYMS.iter().any(|(of, names)| of == field && names.contains(&plain.as_str()));
    expected.iter().copied().find(knows)
}

/// Lines of help for a name that is none of `expected`.
pub(super) fn help(name: &str, expected: &[&str], what: &str) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(nearest) = synonym(name, expected).or_else(|| nearest(name, expected)) {
        lines.push(format!("did you mean `{nearest}`?"));
    } else if let Some(table) = crate::json_schema::table_with(name) {
        lines.push(format!("`{name}` stands {table}"));
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
    fn knows_the_names_of_other_programs() {
        let fields = ["young", "poisson", "step", "duration", "density", "rate", "pin", "walls"];
        for (typed, meant) in [
            ("dt", "step"),
            ("time_step", "step"),
            ("nu", "poisson"),
            ("E", "young"),
            ("youngs_modulus", "young"),
            ("rho", "density"),
            ("fps", "rate"),
            ("fixed", "pin"),
            ("floor", "walls"),
        ] {
            assert_eq!(help(typed, &fields, "fields here")[0], format!("did you mean `{meant}`?"), "{typed}");
        }
    }

    #[test]
    fn knows_the_table_of_a_key() {
        for (key, table) in [("gravity", "[world]"), ("integrator", "[time]"), ("elastic", "[[body]]")] {
            let help = help(key, &["young", "poisson"], "fields here");
            assert_eq!(help[0], format!("`{key}` stands in `{table}`"));
        }
        assert_eq!(
            help("dimension", &["young"], "fields here")[0],
            "`dimension` stands at the top of the file"
        );
    }

    #[test]
    fn stays_silent_about_something_else() {
        for typed in ["gravity", "x", "", "colour", &"young".repeat(1000)] {
            assert_eq!(nearest(typed, &["young", "poisson"]), None, "{typed}");
        }
    }
}
