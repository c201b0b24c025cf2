//! Numbers of decks in millimetres are told, those of other soft, light or large things are not.

use super::*;
use crate::assembly::UnstableStep;

/// Warnings of a solid of this shape, material and density.
fn warnings(shape: &str, elastic: &str, density: &str) -> Vec<String> {
    let text = format!(
        "dimension = 3\ntime = {{ integrator = 'implicit-euler', step = 1e-3, duration = 1e-2 }}\n[[body]]\n\
         name = 'part'\n{shape}\nelastic = {{ stvk = {elastic} }}\nmass = {{ density = {density} }}\n"
    );
    let scene = Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}"));
    scene.assemble(UnstableStep::Accept).map_err(|problems| format!("{problems:?}")).unwrap().report.warnings
}

/// Four cells through it do not lock.
const CUBE: &str = "mesh = { grid = { cells = [4, 4, 4], size = [100.0, 100.0, 100.0] } }";
/// A tetrahedron or two of about a metre, in millimetres.
const FILE: &str = concat!(
    "mesh = { file = { path = '",
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/data/meshes/solid.mesh' } }\ntransform = { scale = 1000.0 }"
);
const STEEL: &str = "{ preset = 'steel' }";

fn one(shape: &str, elastic: &str, density: &str) -> String {
    let warnings = warnings(shape, elastic, density);
    let of_units: Vec<String> = warnings
        .into_iter()
        .filter(|text| text.starts_with("`part` is") || text.starts_with("`part` has"))
        .collect();
    assert_eq!(of_units.len(), 1, "{of_units:?}");
    of_units.concat()
}

#[test]
fn decks_in_millimetres_are_told_and_how_to_write_them() {
    // Steel in mm, t, s; in mm, g, ms; its modulus alone in MPa; a part in millimetres.
    let said = one(CUBE, "{ young = 210e3, poisson = 0.3 }", "7.85e-9");
    assert!(said.contains("7.85e-9 kg/m^3") && said.contains("`\"7.85e-9 t/mm^3\"`"), "{said}");
    let said = one(CUBE, "{ young = 210e3, poisson = 0.3 }", "7.85e-3");
    assert!(said.contains("`\"0.00785 g/mm^3\"`"), "{said}");
    let said = one(CUBE, "{ young = 210e3, poisson = 0.3 }", "7850.0");
    assert!(said.contains("as soft as rubber, 210000 Pa") && said.contains("`\"210000 MPa\"`"), "{said}");
    let said = one(FILE, STEEL, "7850.0");
    assert!(said.contains("m large") && said.contains("transform = { scale = 1e-3 }"), "{said}");
}

// A sheet of springs, and one of elements, from a file are as likely in millimetres.
#[test]
fn sheets_of_many_metres_from_a_file_are_told_too() {
    let text = |scale: f64| {
        format!(
            "dimension = 3\ntime = {{ integrator = 'symplectic-euler', step = 1e-6, duration = 1e-2 }}\n\
             [[body]]\nname = 'part'\n{}\nsprings = {{ stiffness = 1.0 }}\nmass = {{ total = 1.0 }}\n",
            FILE.replace("1000.0", &scale.to_string())
        )
    };
    let told = |scale: f64| {
        let scene = Scene::from_toml(&text(scale)).unwrap_or_else(|error| panic!("{error}"));
        let assembled = scene.assemble(UnstableStep::Accept).map_err(|problems| format!("{problems:?}"));
        assembled.unwrap().report.warnings.iter().filter(|text| text.contains("scale = 1e-3")).count()
    };
    assert_eq!((told(1000.0), told(1.0)), (1, 0));
}

#[test]
fn other_soft_light_and_large_things_are_not() {
    let small = FILE.replace("1000.0", "0.1");
    for (shape, elastic, density) in [
        // A hill, a lead foil's metal, an aerogel, iron in rubber, a heavy jelly.
        (CUBE, "{ preset = 'concrete' }", "2400.0"),
        (CUBE, "{ young = '16 GPa', poisson = 0.44 }", "11340.0"),
        (CUBE, "{ young = '10 kPa', poisson = 0.2 }", "1.0"),
        (CUBE, "{ young = '1 MPa', poisson = 0.4 }", "3500.0"),
        (CUBE, "{ young = 100.0, poisson = 0.4 }", "1000.0"),
        (&small, STEEL, "7850.0"),
    ] {
        let warnings = warnings(shape, elastic, density);
        assert!(
            !warnings.iter().any(|text| text.contains("write its unit") || text.contains("m large")),
            "{warnings:?}"
        );
    }
}

/// Warnings of the solid of a scene with gravity and, say, a load.
fn beside(elastic: &str, density: &str, more: &str) -> Vec<String> {
    let text = format!(
        "dimension = 3\ntime = {{ integrator = 'implicit-euler', step = 1e-3, duration = 1e-2 }}\n\
         world = {{ gravity = [0, 0, -9.81] }}\n[[body]]\nname = 'part'\n\
         mesh = {{ grid = {{ cells = [4, 4, 4], size = [0.1, 0.1, 0.1] }} }}\nelastic = {{ stvk = {elastic} \
         }}\n\
         mass = {{ density = {density} }}\n{more}"
    );
    let scene = Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}"));
    let assembled = scene.assemble(UnstableStep::Accept).map_err(|problems| format!("{problems:?}"));
    let warnings = assembled.unwrap().report.warnings;
    warnings.into_iter().filter(|text| text.starts_with("`part` has")).collect()
}

#[test]
fn densities_beside_water_and_moduli_below_their_loads_are_told() {
    let pulled = "load = [{ traction = [0, 0, 1e8], half_space = { normal = [0, 0, -1], offset = -0.09 } }]";
    let soft = beside("{ young = 210.0, poisson = 0.3 }", "7850.0", pulled);
    assert!(soft.len() == 1 && soft[0].contains("210 Pa and bears 100000000 Pa"), "{soft:?}");
    assert!(soft[0].contains("`\"210 GPa\"`"), "{soft:?}");
    assert_eq!(beside("{ young = '210 GPa', poisson = 0.3 }", "7850.0", pulled), [""; 0]);
    let airy = beside("{ young = 1e6, poisson = 0.3 }", "1.0", "");
    assert!(airy.len() == 1 && airy[0].contains("`\"1.0 g/cm^3\"`"), "{airy:?}");
    assert_eq!(beside("{ young = 1e6, poisson = 0.3 }", "10.0", ""), [""; 0]);
}

/// Zero is what a controller begins with: it is told and taken.
#[test]
fn loads_and_muscles_of_zero_are_told() {
    let told = |more: &str| {
        let text = format!(
            "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 1e-3, duration = 1e-2 \
             }}\n[[body]]\n\
             name = 'arm'\nmesh = {{ grid = {{ cells = [2, 2], size = [0.1, 0.1] }} }}\n\
             elastic = {{ stvk = {{ young = 1e6, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n{more}"
        );
        let scene = Scene::from_toml(&text).unwrap_or_else(|error| panic!("{error}"));
        let report =
            scene.assemble(UnstableStep::Accept).map_err(|problems| format!("{problems:?}")).unwrap().report;
        report.warnings.into_iter().filter(|text| text.contains("is zero")).collect::<Vec<_>>()
    };
    let muscle =
        |tension: &str| format!("muscle = [{{ fibre = {{ direction = [1, 0] }}, tension = {tension} }}]");
    let load = |force: &str| format!("load = [{{ vertices = [0], force = {force} }}]");
    assert_eq!(told(&muscle("0")).len(), 1);
    assert!(told(&load("[0, 0]"))[0].contains("`arm`, its `force`"), "{:?}", told(&load("[0, 0]")));
    assert_eq!(told(&muscle("1e3")).len() + told(&load("[0, '1*t']")).len(), 0);
}
