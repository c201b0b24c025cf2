//! Warnings of solids with numbers in unintended units: decks in millimetres (mm, t, s and MPa, or mm, g, ms
//! and MPa), densities relative to water, moduli in GPa or MPa.

use super::body::BodyAssembly;
use crate::{Body, Load, MassSpec, OverTime, Scene};
use pliant::material::Lame;

/// Density below that of any solid [kg/m^3]: the lightest foams are above 0.15. Steel is 7.85e-9 t/mm^3
/// and 7.85e-3 g/mm^3.
const LIGHTER_THAN_FOAM: f64 = 0.1;
/// Density of steel, about [kg/m^3]: such a solid is not as soft as rubber.
const DENSE: f64 = 7000.0;
/// Modulus of rubber, about [Pa]. Steel has 210000 MPa.
const SOFT: f64 = 1e6;
/// Size of a mesh from a file [m] above which its unit is more likely millimetres than metres.
const LARGE: f64 = 50.0;

/// Density [kg/m^3] below which a solid under the earth's gravity more likely has its density relative to
/// water: air has 1.2, expanded polystyrene 10.
const LIGHT_AS_AIR: f64 = 5.0;
/// Range of the earth's gravity [m/s^2].
const EARTH: std::ops::RangeInclusive<f64> = 9.7..=9.9;
/// Load per area, as a multiple of Young's modulus, that no real solid withstands.
const CRUSHED: f64 = 10.0;

/// Warnings of values that suggest unintended units, with the right notation.
pub(super) fn warnings(scene: &Scene, bodies: &[BodyAssembly]) -> Vec<String> {
    let on_earth = EARTH.contains(&super::gravity::strength_at_start(scene));
    scene.body.iter().zip(bodies).flat_map(|(spec, body)| of_body(spec, body, on_earth)).collect()
}

fn of_body(spec: &Body, body: &BodyAssembly, on_earth: bool) -> Vec<String> {
    // Sheets and strands have other densities.
    if spec.elastic.is_none() || body.thickness.is_some() {
        return large(spec, body).into_iter().collect();
    }
    let airy = airy(spec, body).filter(|_| on_earth);
    [light(spec, body), airy, soft(spec, body), crushed(spec, body), large(spec, body)]
        .into_iter()
        .flatten()
        .collect()
}

/// Density specified in the scene [kg/m^3].
fn density(spec: &Body) -> Option<f64> {
    match &spec.mass {
        MassSpec::Density(density) => Some(density.value),
        _ => None,
    }
}

fn light(spec: &Body, body: &BodyAssembly) -> Option<String> {
    let density = density(spec).filter(|density| *density < LIGHTER_THAN_FOAM)?;
    Some(format!(
        "`{}` has a density of {density:?} kg/m^3, less than any solid: if the number is from a model in \
         millimetres, write its unit, `\"{density:?} t/mm^3\"` or `\"{density:?} g/mm^3\"`, and those of \
         the moduli and lengths",
        body.name
    ))
}

fn airy(spec: &Body, body: &BodyAssembly) -> Option<String> {
    let light = |density: &f64| (LIGHTER_THAN_FOAM..LIGHT_AS_AIR).contains(density);
    let density = density(spec).filter(light)?;
    Some(format!(
        "`{}` has a density of {density:?} kg/m^3, about that of air: if the number is relative to water, \
         write its unit, `\"{density:?} g/cm^3\"`",
        body.name
    ))
}

fn crushed(spec: &Body, body: &BodyAssembly) -> Option<String> {
    let young = young(spec)?;
    let magnitude = |load: &[OverTime]| {
        let components = load.iter().filter_map(OverTime::constant);
        components.map(|p| p * p).sum::<f64>().sqrt()
    };
    let of_load = |load: &Load| {
        let pressure = load.pressure.as_slice();
        magnitude(pressure).max(magnitude(load.traction.as_deref().unwrap_or_default()))
    };
    let most = spec.load.iter().map(of_load).fold(0.0, f64::max);
    (most > CRUSHED * young).then(|| {
        format!(
            "`{}` has a Young's modulus of {young:.0} Pa and bears {most:.0} Pa: if the modulus is in MPa \
             or GPa, write its unit, `\"{young:.0} GPa\"`",
            body.name
        )
    })
}

/// Young's modulus [Pa] of the solid at small strains.
fn young(spec: &Body) -> Option<f64> {
    let Lame { lambda, mu } = spec.elastic.as_ref()?.lame()?;
    Some(mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu))
}

fn soft(spec: &Body, body: &BodyAssembly) -> Option<String> {
    let density = density(spec).filter(|density| *density >= DENSE)?;
    let young = young(spec).filter(|young| *young <= SOFT)?;
    Some(format!(
        "`{}` is as dense as steel, {density:?} kg/m^3, and as soft as rubber, {young:.0} Pa: if the \
         modulus is in MPa or N/mm^2, write its unit, `\"{young:.0} MPa\"`",
        body.name
    ))
}

fn large(spec: &Body, body: &BodyAssembly) -> Option<String> {
    let (lower, upper) = body.mesh.bounding_box();
    let size = lower.iter().zip(&upper).map(|(a, b)| b - a).fold(0.0, f64::max);
    if spec.mesh.file().is_none() || size < LARGE || size.is_nan() {
        return None;
    }
    Some(format!(
        "`{}` is {size:.1} m large: if its file is in millimetres, give the body `transform = {{ scale = \
         1e-3 }}`",
        body.name
    ))
}
