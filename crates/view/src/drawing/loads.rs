//! Loads of the attached scene.

use pliant_scene::Load;
use pliant_scene::assembly::LoadedVertices;

/// External load on vertices or faces.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnLoad {
    /// Key in the scene: `force`, `force_per_vertex`, `body_force`, `traction`, `pressure`.
    pub key: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    /// Single vertices, or the corners of faces, ordered so that the area vector points outwards.
    pub on: Vec<Vec<u32>>,
    load: Load,
}

impl DrawnLoad {
    /// True for a pressure, which follows the present normal of each face.
    pub fn follows(&self) -> bool {
        self.load.pressure.is_some()
    }

    /// True if the load varies over its vertices and faces.
    pub fn depends_on_place(&self) -> bool {
        let (vectors, pressure) = (self.load.vectors(), &self.load.pressure);
        vectors.iter().flat_map(|(_, _, vector)| *vector).chain(pressure).any(|x| x.depends_on_place())
    }

    /// True if the load varies in time.
    pub fn changes(&self) -> bool {
        let (vectors, pressure) = (self.load.vectors(), &self.load.pressure);
        vectors.iter().flat_map(|(_, _, vector)| *vector).chain(pressure).any(|x| x.constant().is_none())
    }

    /// Value at a reference position [m] and a time [s], in [`unit`](Self::unit); for a pressure only the
    /// first number is used.
    pub fn value(&self, place: [f64; 3], time: f64) -> [f64; 3] {
        let mut value = [0.0; 3];
        let vectors = self.load.vectors();
        let components = vectors.iter().flat_map(|(_, _, vector)| *vector).chain(&self.load.pressure);
        value.iter_mut().zip(components).for_each(|(value, component)| *value = component.value(place, time));
        value
    }
}

/// Loads of a scene.
pub(super) fn drawn(loads: Vec<LoadedVertices>) -> Vec<DrawnLoad> {
    let one = |LoadedVertices { load, on, .. }: LoadedVertices| {
        let (key, unit) = load.vectors().first().map_or(("pressure", "Pa"), |(key, unit, _)| (*key, *unit));
        DrawnLoad { key, unit, on, load }
    };
    loads.into_iter().map(one).collect()
}
