//! Elastic constants and densities of well-known materials, each with its source.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A well-known material. `pliant list presets` has its numbers and their sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Preset {
    /// Natural rubber, as in Treloar's experiments.
    Rubber,
    /// The silicone elastomer PDMS (Sylgard 184, ten to one, cured at room temperature).
    Silicone,
    /// Liver: soft tissues are between 1 and 100 kPa.
    SoftTissue,
    /// Softwood of the strength class C24, along the grain.
    Wood,
    /// Concrete of the strength class C30/37, uncracked.
    Concrete,
    /// Soda-lime glass.
    Glass,
    /// Aluminium alloys for structures.
    Aluminium,
    /// Structural steel.
    Steel,
}

/// Constants of a preset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AboutPreset {
    /// The preset.
    pub preset: Preset,
    /// Name in a scene.
    pub name: &'static str,
    /// One-line description.
    pub summary: &'static str,
    /// Young's modulus [Pa].
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density [kg/m^3].
    pub density: f64,
    /// Source of the numbers, and their accuracy.
    pub source: &'static str,
}

/// All presets, the softest first.
pub const PRESETS: [AboutPreset; 8] = [
    AboutPreset {
        preset: Preset::SoftTissue,
        name: "soft-tissue",
        summary: "Liver: soft tissues are between 1 and 100 kPa.",
        young: 5.5e3,
        poisson: 0.49,
        density: 1080.0,
        source: "E: 5.5 kPa, the mean of healthy livers by transient elastography, Roulot et al. 2008, J. \
                 Hepatology 48, 606-613. nu and density are typical values, orders of magnitude: nearly \
                 incompressible, a little heavier than water",
    },
    AboutPreset {
        preset: Preset::Rubber,
        name: "rubber",
        summary: "Natural rubber, as in Treloar's experiments.",
        young: 1.2e6,
        poisson: 0.49,
        density: 930.0,
        source: "E: three times the shear modulus of about 0.4 MPa, Treloar 1975, The Physics of Rubber \
                 Elasticity, chapter 5. Technical rubbers are from 1 to 10 MPa. nu = 0.49 stands for nearly \
                 incompressible; the density is typical of unfilled natural rubber",
    },
    AboutPreset {
        preset: Preset::Silicone,
        name: "silicone",
        summary: "The silicone elastomer PDMS (Sylgard 184, ten to one, cured at room temperature).",
        young: 1.32e6,
        poisson: 0.49,
        density: 1030.0,
        source: "E: 1.32 MPa cured at 25 C, 2.97 MPa at 200 C, Johnston et al. 2014, J. Micromech. \
                 Microeng. 24, 035017. Density: data sheet of Sylgard 184. nu = 0.49 stands for nearly \
                 incompressible",
    },
    AboutPreset {
        preset: Preset::Wood,
        name: "wood",
        summary: "Softwood of the strength class C24, along the grain.",
        young: 11e9,
        poisson: 0.3,
        density: 420.0,
        source: "E and density: means of class C24, EN 338. Along the grain only: across it wood is some \
                 thirty times softer, which no isotropic model shows; nu = 0.3 is a typical value, an order \
                 of magnitude",
    },
    AboutPreset {
        preset: Preset::Concrete,
        name: "concrete",
        summary: "Concrete of the strength class C30/37, uncracked.",
        young: 33e9,
        poisson: 0.2,
        density: 2400.0,
        source: "E and nu: EN 1992-1-1, table 3.1 and 3.1.3 (4). Density: 24 kN/m^3, EN 1991-1-1, table A.1",
    },
    AboutPreset {
        preset: Preset::Glass,
        name: "glass",
        summary: "Soda-lime glass.",
        young: 70e9,
        poisson: 0.2,
        density: 2500.0,
        source: "EN 572-1, general physical properties of soda-lime silicate glass",
    },
    AboutPreset {
        preset: Preset::Aluminium,
        name: "aluminium",
        summary: "Aluminium alloys for structures.",
        young: 70e9,
        poisson: 0.3,
        density: 2700.0,
        source: "EN 1999-1-1, 3.2.5: design values of material constants",
    },
    AboutPreset {
        preset: Preset::Steel,
        name: "steel",
        summary: "Structural steel.",
        young: 210e9,
        poisson: 0.3,
        density: 7850.0,
        source: "E and nu: EN 1993-1-1, 3.2.6. Density: 78.5 kN/m^3, EN 1991-1-1, table A.4",
    },
];

impl Preset {
    /// Returns the constants of the preset.
    pub fn about(self) -> &'static AboutPreset {
        PRESETS.iter().find(|about| about.preset == self).expect("every preset is in the list: a test looks")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_in_the_list_under_its_name() {
        let schema = serde_json::to_value(schemars::schema_for!(Preset)).unwrap();
        let choices = schema["oneOf"].as_array().unwrap();
        assert_eq!(choices.len(), PRESETS.len());
        for choice in choices {
            let preset: Preset = serde_json::from_value(choice["const"].clone()).unwrap();
            let about = preset.about();
            assert_eq!(
                (choice["const"].as_str(), choice["description"].as_str()),
                (Some(about.name), Some(about.summary))
            );
            assert!(about.density > 0.0 && !about.source.is_empty());
        }
        assert!(PRESETS.is_sorted_by_key(|about| about.young));
    }
}
