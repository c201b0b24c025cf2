//! Colours of everything except bodies.

use super::image::Rgb;

/// Light or dark theme.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// Dark on white.
    #[default]
    Light,
    /// Light on black.
    Dark,
}

impl Theme {
    /// Background colour.
    pub(crate) fn background(self) -> Rgb {
        self.choose([255, 255, 255], [22, 25, 31])
    }

    /// Colour of letters.
    pub(crate) fn ink(self) -> Rgb {
        self.choose([38, 43, 51], [222, 227, 235])
    }

    /// Colour of less important lines: frames, pins.
    pub(crate) fn faint(self) -> Rgb {
        self.choose([128, 136, 148], [128, 137, 150])
    }

    /// Colour of floors and walls.
    pub(crate) fn ground(self) -> Rgb {
        self.choose([233, 236, 241], [41, 46, 56])
    }

    /// Colour of grid lines on floors and walls.
    pub(crate) fn grid(self) -> Rgb {
        self.choose([205, 211, 220], [62, 69, 82])
    }

    /// Colour of triangle edges.
    pub(crate) fn edge(self) -> Rgb {
        [12, 16, 24]
    }

    fn choose(self, light: Rgb, dark: Rgb) -> Rgb {
        if self == Theme::Light { light } else { dark }
    }
}
