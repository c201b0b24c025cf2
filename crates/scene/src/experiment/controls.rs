//! Parameters that can be set while a simulation runs, found in the scene itself.

use pliant::integrator::IntegratorSpec;
use serde_json::Value;

use crate::{Scene, Source};

/// Map from the length of a slider to values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SliderScale {
    /// Evenly.
    Linear,
    /// By the logarithm.
    Log,
}

/// Present value of a parameter, and its kind.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum ControlValue {
    /// A number in SI units, with a range that is useful; the scene says what is possible.
    Number {
        /// Value.
        value: f64,
        /// Lower end.
        minimum: f64,
        /// Upper end.
        maximum: f64,
        /// Whether the values between them are spaced evenly or by factors.
        scale: SliderScale,
    },
    /// On or off.
    Toggle {
        /// True for on.
        value: bool,
    },
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Control {
    /// Path of its key in the scene; of a pin `pin.` and its name.
    pub path: String,
    /// Text for people.
    pub label: String,
    /// Unit, empty where there is none.
    pub unit: String,
    /// Name of a body, `world` or `pins`.
    pub group: String,
    /// Value and kind.
    #[serde(flatten)]
    pub value: ControlValue,
}

/// Description of a key of a body.
struct BodyKey {
    path: &'static str,
    label: &'static str,
    unit: &'static str,
    range: SliderRange,
}

/// Range of the slider of a key, from the value that the key has at the start.
enum SliderRange {
    /// From a hundredth to a hundred times the value.
    Decades,
    /// These numbers, and the value.
    Fixed(f64, f64),
    /// From zero to ten times the value, or to this where it is zero.
    UpTo(f64),
}

/// Keys of a body; `*` is any key.
const KEYS: [BodyKey; 10] = [
    key("elastic.*.young", "Young's modulus", "Pa", SliderRange::Decades),
    key("elastic.*.poisson", "Poisson's ratio", "", SliderRange::Fixed(0.0, 0.49)),
    key("springs.stiffness", "stiffness of springs", "N/m", SliderRange::Decades),
    key("springs.young", "Young's modulus", "Pa", SliderRange::Decades),
    key("bending.stiffness", "bending stiffness", "J", SliderRange::Decades),
    key("damping.strain_rate.shear", "shear viscosity", "Pa s", SliderRange::UpTo(0.0)),
    key("damping.strain_rate.second", "second viscosity", "Pa s", SliderRange::UpTo(0.0)),
    key("damping.dashpot", "dashpot", "N s/m", SliderRange::UpTo(10.0)),
    key("damping.stiffness_proportional", "damping with stiffness", "s", SliderRange::UpTo(0.01)),
    key("damping.mass_proportional", "damping with mass", "1/s", SliderRange::UpTo(10.0)),
];

const fn key(path: &'static str, label: &'static str, unit: &'static str, range: SliderRange) -> BodyKey {
    BodyKey { path, label, unit, range }
}

impl SliderRange {
    /// Ends of the slider, and its scale.
    fn around(&self, value: f64) -> ControlValue {
        let (minimum, maximum, scale) = match *self {
            SliderRange::Decades if value > 0.0 => (1e-2 * value, 1e2 * value, SliderScale::Log),
            SliderRange::Decades => (0.0, 1.0, SliderScale::Linear),
            SliderRange::Fixed(low, high) => (low.min(value), high.max(value), SliderScale::Linear),
            SliderRange::UpTo(_) if value > 0.0 => (0.0, 10.0 * value, SliderScale::Linear),
            SliderRange::UpTo(high) => (0.0, if high > 0.0 { high } else { 1.0 }, SliderScale::Linear),
        };
        ControlValue::Number { value, minimum, maximum, scale }
    }
}

/// Parameters of a scene that a scene with the same value written out still has.
pub(super) fn of(source: &Source, scene: &Scene) -> Vec<Control> {
    let mut controls = vec![];
    for (i, body) in scene.body.iter().enumerate() {
        let written = serde_json::to_value(body).unwrap_or_default();
        for key in &KEYS {
            controls.extend(control_of(key, i, &body.name_or_default(i), &written));
        }
    }
    controls.extend(of_world(scene));
    controls.retain(|control| match control.value {
        ControlValue::Number { value, .. } => {
            source.varied(&[(control.path.clone(), format!("{value:?}"))]).is_ok()
        }
        ControlValue::Toggle { .. } => true,
    });
    controls
}

/// The control of a key that the body has, or that has a range although its value is zero.
fn control_of(key: &BodyKey, index: usize, name: &str, body: &Value) -> Option<Control> {
    let (path, value) = match found(body, key.path) {
        Some((path, value)) => (path, value.as_f64()?),
        None => match key.range {
            SliderRange::UpTo(high) if high > 0.0 => (key.path.to_owned(), 0.0),
            _ => return None,
        },
    };
    let (label, unit) = (format!("{name}: {}", key.label), key.unit.to_owned());
    let path = format!("body.{index}.{path}");
    Some(Control { path, label, unit, group: name.to_owned(), value: key.range.around(value) })
}

/// The value at a path below `value`, where `*` is the first key under which the rest is found.
fn found<'a>(value: &'a Value, path: &str) -> Option<(String, &'a Value)> {
    let (first, rest) = match path.split_once('.') {
        Some((first, rest)) => (first, Some(rest)),
        None => (path, None),
    };
    let table = value.as_object()?;
    table.iter().filter(|(key, _)| first == "*" || first == *key).find_map(|(key, value)| match rest {
        None => Some((key.clone(), value)).filter(|(_, value)| value.is_number()),
        Some(rest) => found(value, rest).map(|(below, value)| (format!("{key}.{below}"), value)),
    })
}

fn of_world(scene: &Scene) -> Vec<Control> {
    let control = |path: &str, label: &str, unit: &str, value| {
        let (path, label, unit) = (path.to_owned(), label.to_owned(), unit.to_owned());
        Control { path, label, unit, group: "world".into(), value }
    };
    let gravity = scene.world.gravity.iter().flatten().zip(["x", "y", "z"]).enumerate();
    let constant = gravity.filter_map(|(i, (component, axis))| Some((i, component.constant()?, axis)));
    let mut controls: Vec<Control> = constant
        .map(|(i, value, axis)| {
            let end = f64::max(20.0, 2.0 * value.abs());
            let value = SliderRange::Fixed(-end, end).around(value);
            control(&format!("world.gravity.{i}"), &format!("gravity {axis}"), "m/s^2", value)
        })
        .collect();
    let drag = scene.world.ether_drag.unwrap_or(0.0);
    controls.push(control("world.ether_drag", "drag", "1/s", SliderRange::UpTo(10.0).around(drag)));
    if let Some(contact) = &scene.contact {
        let range = SliderRange::UpTo(1.0).around(contact.friction);
        controls.push(control("contact.friction", "friction", "", range));
    }
    controls
}

/// The same with the values of `scene`, and the pins.
pub(super) fn present(
    controls: &[Control],
    scene: &Scene,
    pins: &[String],
    released: &[String],
) -> Vec<Control> {
    let scene = serde_json::json!({ "body": scene.body, "world": scene.world });
    let mut controls = controls.to_vec();
    for control in &mut controls {
        if let ControlValue::Number { value, .. } = &mut control.value
            && let Some(now) = at(&scene, &control.path).and_then(Value::as_f64)
        {
            *value = now;
        }
    }
    controls.extend(pins.iter().map(|pin| Control {
        path: format!("pin.{pin}"),
        label: pin.clone(),
        unit: String::new(),
        group: "pins".into(),
        value: ControlValue::Toggle { value: !released.contains(pin) },
    }));
    controls
}

fn at<'a>(value: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(value, |value, key| match value {
        Value::Array(list) => list.get(key.parse::<usize>().ok()?),
        value => value.get(key),
    })
}

/// Names of schemes that move bodies, or, in statics, of those that do not, and the present one.
pub(super) fn integrators(scene: &Scene) -> (Vec<&'static str>, &'static str) {
    let present = scene.time.integrator.method();
    let methods = IntegratorSpec::ALL.iter().map(|spec| spec.method());
    let alike = methods.filter(|method| method.is_static() == present.is_static());
    (alike.map(|method| method.documentation.name).collect(), present.documentation.name)
}
