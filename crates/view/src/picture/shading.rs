//! Lighting of surfaces.

use super::image::{Rgb, byte};
use super::space::{Vec3, dot, plus, unit};

/// Light from all around, from above, from the eye and from the lamp; a surface facing eye and lamp is a
/// fifth brighter than its colour.
const AROUND: f32 = 0.22;
const ABOVE: f32 = 0.16;
const EYE: f32 = 0.36;
const LAMP: f32 = 0.58;
/// Brightness of a highlight.
const GLOSS: f32 = 0.10;

/// Lit surface at a position.
pub(super) struct LitSurface {
    pub(super) normal: Vec3,
    pub(super) to_eye: Vec3,
    pub(super) to_light: Vec3,
    /// Fraction of the lamp's light that arrives.
    pub(super) lit: f32,
}

impl LitSurface {
    /// Shaded colour of a surface. Light is added linearly, for which screen colours are squared: their
    /// exponent of 2.2, rounded to 2, which every machine computes alike.
    pub(super) fn shaded(&self, color: Rgb) -> Rgb {
        let facing = dot(self.normal, self.to_light).max(0.0) * self.lit;
        let from_above = 0.5 + 0.5 * self.normal[2];
        let towards_eye = dot(self.normal, self.to_eye).max(0.0);
        let light = AROUND + ABOVE * from_above + EYE * towards_eye + LAMP * facing;
        let halfway = dot(self.normal, unit(plus(self.to_eye, self.to_light))).max(0.0);
        let gloss = GLOSS * self.lit * halfway.powi(40);
        color.map(|channel| {
            let channel = f32::from(channel) / 255.0;
            byte(255.0 * (channel * channel * light + gloss).sqrt())
        })
    }
}
