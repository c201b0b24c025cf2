//! "Did you mean".

use super::json_schema;
use super::key_path::KeyPath;

/// Keys and choices of scenes with their names in other programs and papers, in small letters without
/// separators.
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
    ("height", &["length", "depth"]),
    ("size", &["extent", "extents", "dimensions", "lengths"]),
    ("origin", &["corner", "offset", "center", "centre"]),
    ("translate", &["move", "translation", "shift"]),
    ("half_space", &["plane", "halfplane"]),
    ("grid", &["cube", "box", "cuboid", "block", "brick", "square", "rectangle", "bar", "beam"]),
    ("ball", &["sphere"]),
    ("box", &["cuboid", "cube", "aabb"]),
    ("path", &["file", "filename", "url"]),
    ("tolerance", &["tol", "rtol", "atol", "newtontol"]),
    ("linear", &["linearsolver", "preconditioner"]),
    ("forward-euler", &["expliciteuler", "euler"]),
    ("symplectic-euler", &["semiimpliciteuler", "semiexpliciteuler", "eulercromer"]),
    ("velocity-verlet", &["leapfrog", "stormerverlet", "centraldifference", "centraldifferences"]),
    ("rk4", &["rungekutta", "rungekutta4"]),
    ("bogacki-shampine3", &["rk23", "ode23", "bs3"]),
    ("dormand-prince5", &["rk45", "ode45", "dopri", "dopri5", "dp5"]),
    ("implicit-euler", &["backwardeuler", "bdf1", "be"]),
    ("linearised-implicit-euler", &["semiimplicit", "baraffwitkin", "rosenbrock"]),
    ("trapezoid", &["cranknicolson", "cn", "averageacceleration"]),
    ("generalised-alpha", &["hht", "hhtalpha", "generalizedalpha", "chunghulbert"]),
    ("quasi-static", &["static", "statics", "equilibrium", "newton"]),
    ("stvk", &["saintvenantkirchhoff", "stvenantkirchhoff", "svk", "kirchhoff"]),
    ("corotated", &["corotational", "fcr"]),
    ("stable-neo-hookean", &["snh"]),
    ("holzapfel-gasser-ogden", &["hgo", "holzapfelogden"]),
];

/// Keys whose value is a list of numbers where one number is what people write first, with a right one.
const LISTS: &[(&str, &str)] = &[
    ("gravity", "[0.0, -9.81]` in 2D, `gravity = [0.0, 0.0, -9.81]` in 3D"),
    ("velocity", "[1.0, 0.0]` in 2D, `velocity = [1.0, 0.0, 0.0]` in 3D"),
    ("cells", "[8, 4]` in 2D, `cells = [8, 4, 4]` in 3D"),
    ("size", "[1.0, 0.5]` in 2D, `size = [1.0, 0.5, 0.5]` in 3D"),
    ("origin", "[0.0, 0.0]` in 2D, `origin = [0.0, 0.0, 0.0]` in 3D"),
    ("force", "[0.0, -10.0]` in 2D, `force = [0.0, 0.0, -10.0]` in 3D"),
    ("traction", "[0.0, -1e3]` in 2D, `traction = [0.0, 0.0, -1e3]` in 3D"),
];

/// Keys that people look for in a table of scenes, or in any, and that no table there has: what does their
/// work.
const ELSEWHERE: &[(&str, &[&str], &str)] = &[
    (
        "walls",
        &["friction", "mu", "coefficientoffriction", "frictioncoefficient"],
        "friction of a wall is that of a pair: [contact] with `pairs = [{ between = [\"NAME OF THE BODY\", \
         \"wall0\"], friction = 0.3 }]`",
    ),
    (
        "body",
        &["nodalintegration", "meandilatation", "fbar", "bbar"],
        "give `order = 2`, or a mesh of quadrilaterals or hexahedra: these do not lock",
    ),
    (
        "",
        &["color", "colour", "colors", "colours", "rgb", "rgba", "opacity", "texture"],
        "a scene has no colours: `pliant render --colour-by` and `pliant view` colour a recording by what \
         it holds, such as `von-mises`",
    ),
];

/// What does the work of a key `name` that the table called `table` does not have.
fn elsewhere(table: &str, name: &str) -> Option<&'static str> {
    let plain = plain(name);
    let is_meant = |(of, names, _): &&(&str, &[&str], &str)| {
        (of.is_empty() || *of == table) && names.contains(&plain.as_str())
    };
    ELSEWHERE.iter().find(is_meant).map(|(.., remedy)| *remedy)
}

/// The name in small letters, without separators.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// Right values of `key`, one that is a list of components.
pub(super) fn list_help(key: &str) -> Option<String> {
    let (_, lists) = LISTS.iter().find(|(of, _)| *of == key)?;
    Some(format!("a number for each direction, in brackets: `{key} = {lists}"))
}

/// Bytes of the longest name that others are compared with.
const LONGEST: usize = 64;

/// Key of scenes, among `expected`, that is called `name` elsewhere.
fn synonym<'a>(name: &str, expected: &[&'a str]) -> Option<&'a str> {
    let plain = plain(name);
    let knows =
        |field: &&str| SYNONYMS.iter().any(|(of, names)| of == field && names.contains(&plain.as_str()));
    expected.iter().copied().find(knows)
}

/// The name among `expected` that `name` most likely stands for: its name elsewhere, a part of it, or one
/// that a typing mistake explains.
pub fn meant<'a>(name: &str, expected: &[&'a str]) -> Option<&'a str> {
    synonym(name, expected).or_else(|| with_word(name, expected)).or_else(|| nearest(name, expected))
}

/// Lines of help for a key `name` that the table called `table` does not have; the keys `expected` are there.
pub(super) fn field_help(table: &str, name: &str, expected: &[&str]) -> Vec<String> {
    match elsewhere(table, name) {
        Some(remedy) => vec![remedy.to_owned(), listed(expected, "fields here")],
        None => help(name, expected, "fields here"),
    }
}

/// Lines of help for a name that is none of `expected`.
pub(super) fn help(name: &str, expected: &[&str], what: &str) -> Vec<String> {
    // No name that is longer was meant to be one of them.
    if name.len() > LONGEST {
        return vec![listed(expected, what)];
    }
    let mut lines = Vec::new();
    let body = KeyPath::root().key("body").index(0);
    if let Some(meant) = meant(name, expected) {
        lines.push(format!("did you mean `{meant}`?"));
    } else if let Some(field) = expected.iter().find(|field| json_schema::has_key(&body.key(field), name)) {
        lines.push(format!("`{name}` stands in `{field}`: `{field} = {{ {name} = .. }}`"));
    } else if let Some(table) = json_schema::table_with(name) {
        lines.push(format!("`{name}` stands {table}"));
    }
    lines.push(listed(expected, what));
    lines
}

/// The names that there are.
fn listed(expected: &[&str], what: &str) -> String {
    if expected.is_empty() {
        return format!("{what}: none");
    }
    let names: Vec<String> = expected.iter().map(|name| format!("`{name}`")).collect();
    format!("{what}: {}", names.join(", "))
}

/// The only candidate of several words of which `name` is one: `verlet` of `velocity-verlet`.
fn with_word<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let name = name.to_lowercase();
    let mut found =
        candidates.iter().filter(|candidate| candidate.split(['-', '_']).any(|word| word == name));
    found.next().filter(|_| found.next().is_none()).copied()
}

/// The candidate that a typing mistake, another case or separator, or a longer form of the name explains.
pub fn nearest<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace('_', "-");
    let name = plain(name);
    // The distance is quadratic in the length, and a short name is not mistyped into a very long one.
    if name.len() > LONGEST {
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
    fn knows_the_names_of_choices() {
        let choices =
            ["forward-euler", "symplectic-euler", "velocity-verlet", "rk4", "implicit-euler", "rk2-midpoint"];
        for (typed, meant) in [
            ("verlet", "velocity-verlet"),
            ("leapfrog", "velocity-verlet"),
            ("backward_euler", "implicit-euler"),
            ("euler", "forward-euler"),
            ("RK-4", "rk4"),
        ] {
            assert_eq!(help(typed, &choices, "choices")[0], format!("did you mean `{meant}`?"), "{typed}");
        }
        let ambiguous = help("euler", &["implicit-euler", "linearised-implicit-euler"], "choices");
        assert_eq!(ambiguous, ["choices: `implicit-euler`, `linearised-implicit-euler`"]);
    }

    #[test]
    fn knows_the_field_that_has_a_key() {
        let fields = ["mesh", "elastic", "mass", "springs"];
        assert_eq!(
            help("density", &fields, "fields here")[0],
            "`density` stands in `mass`: `mass = { density = .. }`"
        );
    }

    #[test]
    fn knows_the_table_of_a_key() {
        for (key, table) in [
            ("gravity", "`[world]`"),
            ("integrator", "`[time]`"),
            ("elastic", "`[[body]]`"),
            ("stvk", "`elastic` of a `[[body]]`"),
        ] {
            let help = help(key, &["young", "poisson"], "fields here");
            assert_eq!(help[0], format!("`{key}` stands in {table}"));
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
