//! Quantities in scenes.

use super::*;
use crate::MassSpec;
use crate::ProblemKind;

/// A scene in SI units, and the same scene in others.
#[test]
fn units_and_plain_numbers_make_the_same_scene() {
    let plain = GOOD
        .replace("step = 1e-3", "step = 1e-4")
        .replace(
            "[0.0, -9.8]",
            "[0.0, -9.8]\nether_drag = 0.5\nwalls = [{ normal = [0, 1], offset = -0.25 \
                                 }]\nnbody = { constant = 6.6743e-11, softening = 0.002 }",
        )
        .replace("cells = [2, 3], spacing = 0.1", "cells = [2, 3], size = [0.03125, 1.5], origin = [0, 1]")
        .replace(SPRINGS, "{ young = 2.5e5, rest_length = [0.1, 0.2] }")
        .replace(MASS, "{ per_vertex = [0.001, 2] }")
        .replace(
            PIN,
            "[{ box = { min = [0, -inf], max = [0.01, 1] } }]\nposition = { displacement = \
                       [[0.001, 2]] }\nvelocity = { rigid = { linear = [10, 0], angular = 1 } }",
        );
    let units = GOOD
        .replace("step = 1e-3", "step = '0.1 ms'")
        .replace("duration = 1.0", "duration = '1000 ms'")
        .replace("rate = 60.0", "rate = '60 Hz'")
        .replace(
            "[0.0, -9.8]",
            "['0', '-9.8 m/s²']\nether_drag = '0.5 1/s'\nwalls = [{ normal = [0, 1], \
                                 offset = '-25 cm' }]\nnbody = { constant = '6.6743e-11 m^3/(kg s^2)', \
                                 softening = '2 mm' }",
        )
        .replace(
            "cells = [2, 3], spacing = 0.1",
            "cells = [2, 3], size = ['3.125 cm', '15 dm'], origin = \
                                                   ['0 m', 1]",
        )
        .replace(SPRINGS, "{ young = '2.5 bar', rest_length = ['10 cm', 0.2] }")
        .replace(MASS, "{ per_vertex = ['1 g', '2'] }")
        .replace(
            PIN,
            "[{ box = { min = [0, -inf], max = ['10 mm', 1] } }]\nposition = { displacement = \
                       [['1000 µm', 2]] }\nvelocity = { rigid = { linear = ['36 km/h', 0], angular = '1 \
                       mrad/ms' } }",
        );
    let unchecked = |text: &str| Source::new("scene.toml", text).scene_unchecked().unwrap();
    assert_eq!(unchecked(&units), unchecked(&plain));
}

#[test]
fn every_parameter_of_a_material_takes_units() {
    let elastic = |young: &str| {
        let material = format!("elastic = {{ corotated = {{ young = {young}, poisson = 0.3 }} }}");
        changed(&format!("springs = {SPRINGS}"), &material)
    };
    assert_eq!(read(&elastic("'3 MPa'")).unwrap(), read(&elastic("3e6")).unwrap());
    assert_eq!(
        briefly(&error(&elastic("'3 m'"))),
        ["14:35 body.0.elastic.corotated.young: `young`: `3 m` is a length [m], not a pressure [Pa]"]
    );
}

#[test]
fn mistakes_are_placed_and_explained() {
    for (old, new, expected, help) in [
        (
            "1e-3",
            "'3 m'",
            "5:8 time.step: `step`: `3 m` is a length [m], not a time [s]",
            &["write a quantity, for example \"0.1 ms\", or a plain number in [s]"][..],
        ),
        (
            "1e-3",
            "\"0.1 msec\"",
            "5:13 time.step: `step`: unknown unit `msec`",
            &["write a quantity, for example \"0.1 ms\", or a plain number in [s]"],
        ),
        (
            "stiffness = 100.0",
            "stiffness = [1, \"2 N/mm\", \"3 kn/m\"]",
            "14:42 body.0.springs.stiffness.2: `stiffness`: unknown unit `kn`",
            &["did you mean `kN`?", "write a quantity, for example \"2 kN/m\", or a plain number in [N/m]"],
        ),
        (
            "stiffness = 100.0",
            "stiffness = '1 N'",
            "14:25 body.0.springs.stiffness: `stiffness`: `1 N` is a force [N], not a stiffness [N/m]",
            &["write a quantity, for example \"2 kN/m\", or a plain number in [N/m]"],
        ),
        (
            "60.0",
            "'1 /'",
            "19:12 output.rate: `rate`: expected a unit after the number, found the end",
            &["write a quantity, for example \"60 Hz\", or a plain number in [1/s]"],
        ),
        (
            "1e-3",
            "'fast'",
            "5:8 time.step: `step` takes a number, found the text `fast`",
            &["write a quantity, for example \"0.1 ms\", or a plain number in [s]"],
        ),
    ] {
        let failed = error(&changed(old, new));
        assert_eq!(briefly(&failed), [expected]);
        assert_eq!(failed.problems()[0].help, help, "{new}");
    }
    assert_eq!(error(&changed("1e-3", "'1 parsec'")).problems()[0].kind, ProblemKind::Quantity);
}

#[test]
fn a_picture_underlines_the_unit() {
    let failed = error(&changed("spacing = 0.1", "spacing = \"1.5 µn\""));
    let expected = "
error: `spacing`: unknown unit `µn`
  --> scene.toml:13:50
   |
13 | mesh = { grid = { cells = [2, 3], spacing = \"1.5 µn\" } }
   |                                                  ^^
   |
   = help: write a quantity, for example \"3 cm\", or a plain number in [m]
";
    assert_eq!(failed.to_string(), expected.trim_matches('\n'));
    // Where escapes make the text longer than what it stands for, all of it is underlined.
    let failed = error(&changed("spacing = 0.1", r#"spacing = "1.5 \u00b5n""#));
    assert_eq!((failed.line(), failed.column()), (Some(13), Some(45)));
}

#[test]
fn overrides_take_units_with_and_without_quotes() {
    for value in ["\"0.2 ms\"", "0.2 ms", "'2e-4 s'", "2e-4"] {
        let set = [("time.step".to_owned(), value.to_owned())];
        let scene = Source::new("scene.toml", GOOD).with_overrides(&set).unwrap().scene();
        assert_eq!(scene.unwrap().time.step, Some(2e-4), "{value}");
    }
    let set = [("time.step".to_owned(), "2 kg".to_owned())];
    let failed = Source::new("scene.toml", GOOD).with_overrides(&set).unwrap().scene().unwrap_err();
    assert_eq!(failed.problems()[0].note.as_deref(), Some("from `--set time.step=2 kg`"));
}

#[test]
fn what_is_written_is_in_si_units() {
    let text = changed("1e-3", "'0.25 ms'").replace(MASS, "{ density = '1.2 g/cm^2' }");
    let scene = read(&text).unwrap();
    let written = scene.to_toml().unwrap();
    assert!(
        written.contains("step = 0.00025\n") && written.contains("density = \"12.0 kg/m^2\""),
        "{written}"
    );
    assert_eq!(read(&written).unwrap(), scene);
    let json = serde_json::to_value(&scene).unwrap();
    assert_eq!(json["time"]["step"], 0.00025);
    assert_eq!(serde_json::from_value::<Scene>(json.clone()).unwrap(), scene);
    // Readers other than our own take units too.
    let mut units = json;
    units["time"]["step"] = "0.25 ms".into();
    units["body"][0]["springs"]["stiffness"] = serde_json::json!(["1 N/mm", 2]);
    let read = serde_json::from_value::<Scene>(units.clone()).unwrap();
    assert_eq!(read.time.step, Some(0.00025));
    assert_eq!(read.body[0].springs.as_ref().unwrap().stiffness.as_ref().unwrap().as_slice(), [1000.0, 2.0]);
    units["time"]["step"] = "0.25 m".into();
    assert_eq!(
        serde_json::from_value::<Scene>(units).unwrap_err().to_string(),
        "`0.25 m` is a length [m], not a time [s]"
    );
}

/// Of a plain number the body says what it is; a unit has to agree with the body.
#[test]
fn densities_fit_what_the_body_is_made_of() {
    use crate::assembly::UnstableStep;
    let elastic = "elastic = { corotated = { young = '1 MPa', poisson = 0.3 } }";
    let solid_2d = |density: &str| {
        changed(&format!("springs = {SPRINGS}"), elastic)
            .replace(MASS, &format!("{{ density = {density} }}"))
            .replace("1e-3", "1e-5")
    };
    let solid_3d = |density: &str| {
        solid_2d(density)
            .replace("dimension = 2", "dimension = 3")
            .replace("[0.0, -9.8]", "[0, 0, -9.8]")
            .replace("cells = [2, 3]", "cells = [2, 3, 4]")
            .replace(PIN, "[]")
    };
    let strand = |density: &str| {
        changed(MESH, "{ strand = { segments = 3, start = [0, 0], end = [1, 0] } }")
            .replace(MASS, &format!("{{ density = {density} }}"))
    };
    let problems = |text: &str| -> Vec<String> {
        let scene = read(text).unwrap();
        assert!(matches!(scene.body[0].mass, MassSpec::Density(_)));
        scene.assemble(UnstableStep::Accept).err().into_iter().flatten().map(|p| p.message).collect()
    };
    for good in [
        solid_2d("1000"),
        solid_2d("'1 g/cm^3'"),
        solid_2d("'1000 kg/m^2'"),
        solid_3d("'1 t/m^3'"),
        strand("'20 g/m'"),
        strand("0.02"),
    ] {
        assert!(problems(&good).is_empty(), "{good}");
    }
    for (bad, message) in [
        (
            solid_2d("'1 kg/m'"),
            "`density` is in [kg/m], but this body is made of triangles in 2D: it takes a mass per area \
             [kg/m^2] or a density [kg/m^3]",
        ),
        (
            solid_3d("'1 kg/m^2'"),
            "`density` is in [kg/m^2], but this body is made of tetrahedra: it takes a density [kg/m^3]",
        ),
        (
            strand("'1 kg/m^3'"),
            "`density` is in [kg/m^3], but this body is made of springs: it takes a mass per length [kg/m]",
        ),
    ] {
        assert_eq!(problems(&bad), [message]);
    }
    assert_eq!(
        briefly(&error(&solid_2d("'1 kg'"))),
        ["15:20 body.0.mass.density: `density`: `1 kg` is a mass [kg], not a density [kg/m^3] or a mass \
             per area [kg/m^2] or a mass per length [kg/m]"]
    );
}

#[test]
fn gravity_takes_formulas_of_time() {
    let text = changed("[0.0, -9.8]", "['1 cm/s^2', \"-9.81 * (1 - exp(-t/0.1))\"]");
    let scene = read(&text).unwrap();
    let gravity = scene.world.gravity.as_ref().unwrap();
    assert_eq!((gravity[0].constant(), gravity[1].constant()), (Some(0.01), None));
    assert_eq!((gravity[0].at(3.0), gravity[1].at(0.0)), (0.01, 0.0));
    assert_eq!(read(&scene.to_toml().unwrap()).unwrap(), scene);
    let json = serde_json::to_value(&scene).unwrap();
    assert_eq!(serde_json::from_value::<Scene>(json).unwrap(), scene);
    let set = [("world.gravity.1".to_owned(), "-9.81*t".to_owned())];
    let set = Source::new("scene.toml", GOOD).with_overrides(&set).unwrap().scene().unwrap();
    assert_eq!(set.world.gravity.unwrap()[1].at(2.0), -19.62);
}

#[test]
fn mistakes_in_formulas_are_placed_inside_the_text() {
    let write = "write a quantity, for example \"-9.81 m/s^2\", or a plain number in [m/s^2], or a formula \
                 of the time t [s] such as \"2 * sin(pi * t)\"";
    for (new, expected, help) in [
        (
            "[0, \"-9.81 * sine(t)\"]",
            "9:24 world.gravity.1: `gravity`: unknown name `sine`",
            Some("did you mean `sin`?"),
        ),
        (
            "[0, \"-9.81 * x\"]",
            "9:24 world.gravity.1: `gravity`: unknown name `x`",
            Some(
                "names in a formula: `t`, `pi`, `sin`, `cos`, `tan`, `asin`, `acos`, `atan`, `atan2`, \
                 `sinh`, `cosh`, `tanh`, `exp`, `ln`, `log`, `sqrt`, `abs`, `sign`, `floor`, `min`, `max`, \
                 `clamp`, `step`, `smoothstep`, `pulse`, `if`",
            ),
        ),
        (
            "[0, \"-9.81 * (1 - t\"]",
            "9:30 world.gravity.1: `gravity`: expected `)` or an operator, found the end",
            Some(write),
        ),
        (
            "[0, 'max(t)']",
            "9:16 world.gravity.1: `gravity`: `max` takes 2 arguments, found 1",
            Some("write max(a, b)"),
        ),
        (
            "[0, '3 m']",
            "9:15 world.gravity.1: `gravity`: `3 m` is a length [m], not an acceleration [m/s^2]",
            Some(write),
        ),
        (
            "[0, '2 t']",
            "9:15 world.gravity.1: `gravity`: `2 t` is a mass [kg], not an acceleration [m/s^2]",
            Some(write),
        ),
        ("[0, '?']", "9:15 world.gravity.1: `gravity` takes a number, found the text `?`", Some(write)),
        ("[0, '1/t']", "9:15 world.gravity.1: `gravity` is inf [m/s^2] at t = 0.0 s", None),
        ("[0, 'sqrt(0.5 - t)']", "9:15 world.gravity.1: `gravity` is NaN [m/s^2] at t = 1.0 s", None),
        (
            "['t', 't', 't']",
            "9:11 world.gravity: `gravity` has 3 numbers, but `dimension` is 2: 2 are needed",
            None,
        ),
    ] {
        let failed = error(&changed("[0.0, -9.8]", new));
        assert_eq!(briefly(&failed), [expected]);
        assert_eq!(failed.problems()[0].help.first().map(String::as_str), help, "{new}");
    }
}

/// True if a number without a unit is in here.
fn bare_number(schema: &serde_json::Value) -> bool {
    let bare = schema["format"] == "double" && schema["unit"].is_null();
    let alternatives = schema["anyOf"].as_array().into_iter().flatten();
    bare || (!schema["items"].is_null() && bare_number(&schema["items"]))
        || alternatives.into_iter().any(bare_number)
}

/// A key whose documentation names a unit takes that unit.
#[test]
fn every_key_with_a_dimension_takes_quantities() {
    let schema = crate::schema();
    let mut measured = 0;
    for (name, definition) in schema.as_value()["$defs"].as_object().unwrap() {
        // The text on a choice is about what it holds; that on a table is not about each of its keys.
        let choices = definition["oneOf"].as_array().into_iter().flatten();
        let choices = choices.map(|choice| (choice, choice["description"].as_str()));
        let documented = choices.flat_map(|(choice, text)| {
            choice["properties"].as_object().into_iter().flatten().map(move |(key, value)| (key, value, text))
        });
        let keys = definition["properties"].as_object().into_iter().flatten();
        let keys = keys.map(|(key, value)| (key, value, value["description"].as_str()));
        for (key, value, text) in documented.chain(keys) {
            if text.is_some_and(|text| text.contains(" [")) {
                assert!(!bare_number(value), "`{key}` of {name} has a unit and takes plain numbers only");
                measured += 1;
            }
        }
    }
    assert!(measured > 50, "{measured}");
}
