//! Named materials in scenes.

use pliant::material::{MaterialSpec, Parameters, Preset};
use pliant_scene::{MassSpec, Scene, Source};

fn text(elastic: &str, mass: &str) -> String {
    format!(
        "dimension = 2\ntime = {{ integrator = 'rk4', step = 1e-9, duration = 1.0 }}\n[[body]]\n\
         mesh = {{ grid = {{ cells = [1, 1], spacing = 0.5 }} }}\nelastic = {elastic}\nmass = {mass}\n"
    )
}

#[test]
fn a_preset_gives_what_the_scene_does_not() {
    let read = |elastic: &str| {
        let scene =
            Scene::from_toml(&text(elastic, "{ preset = 'steel' }")).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scene.body[0].mass, MassSpec::Preset(Preset::Steel));
        let mass: f64 = scene
            .assemble(pliant_scene::assembly::UnstableStep::Accept)
            .ok()
            .unwrap()
            .topology
            .masses
            .iter()
            .sum();
        // A square of 0.5 m, a metre thick.
        assert!((mass - 7850.0 * 0.25).abs() < 1e-9, "{mass}");
        let again: Scene = serde_json::from_value(serde_json::to_value(&scene).unwrap()).unwrap();
        assert_eq!(again, scene);
        scene.body[0].elastic.clone().unwrap()
    };
    for (elastic, young, poisson) in [
        ("{ stvk = { preset = 'steel' } }", 210e9, 0.3),
        ("{ corotated = { preset = 'steel', young = '1 MPa' } }", 1e6, 0.3),
        ("{ neo-hookean = { preset = 'glass', poisson = 0.1 } }", 70e9, 0.1),
        ("{ linear = { preset = 'glass', plane = 'stress' } }", 70e9, 0.2),
        ("{ hencky = { young = 2.0, poisson = 0.1 } }", 2.0, 0.1),
    ] {
        let spec = read(elastic);
        let lame = spec.lame().unwrap();
        assert_eq!(lame, pliant::material::Lame::new(young, poisson), "{elastic}");
        assert_eq!(spec.preset().is_some(), elastic.contains("preset"));
    }
    assert_eq!(pliant::material::Isotropic::example().preset, None);
    assert!(matches!(read("{ stvk = { preset = 'wood' } }"), MaterialSpec::Stvk(_)));
}

#[test]
fn a_wrong_preset_is_an_error_with_its_place_and_what_was_meant() {
    let says = |elastic: &str, mass: &str| match Source::new("scene.toml", text(elastic, mass)).scene() {
        Err(error) => error.to_string(),
        Ok(scene) => {
            scene.assemble(pliant_scene::assembly::UnstableStep::Accept).err().unwrap()[0].message.clone()
        }
    };
    let mass = "{ total = 1.0 }";
    let text = says("{ stvk = { preset = 'steal' } }", mass);
    assert!(text.contains("scene.toml:5:31") && text.contains("did you mean `steel`?"), "{text}");
    let text = says("{ stvk = { young = 1.0 } }", mass);
    assert!(text.contains("missing field `poisson`") && text.contains("scene.toml:5:"), "{text}");
    let text = says("{ stvk = { preset = 'steel', youg = 1.0 } }", mass);
    assert!(text.contains("did you mean `young`?"), "{text}");
    let text = says("{ stvk = { preset = 'steel', poisson = 0.5 } }", mass);
    assert!(text.contains("makes the bulk modulus infinite"), "{text}");
    let text = says("{ stvk = { preset = 'steel' } }", "{ preset = 'sillicone' }");
    assert!(text.contains("scene.toml:6:19") && text.contains("did you mean `silicone`?"), "{text}");
}
