//! Walls, pins, loads and gravity of the attached scene, and recorded probes.

use std::path::Path;

use pliant::constraint::Wall;
use pliant_record::RecordError;
use pliant_record::read::{Column, Trajectory};
use pliant_scene::assembly::PinnedVertices;
use pliant_scene::{HalfSpace, ObstacleShape, OverTime, Scene, Source};

use super::loads::{self, DrawnLoad};

/// Rigid half-space.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnWall {
    /// Name, `wall0`, `wall1`, ... in the order of the scene.
    pub name: String,
    /// Point of its plane nearest to the origin [m].
    pub point: [f64; 3],
    /// Unit normal, pointing out of the wall.
    pub normal: [f64; 3],
}

/// Recorded probe.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnProbe {
    /// Name.
    pub name: String,
    /// Position in each frame [m].
    pub positions: Vec<[f64; 3]>,
}

/// Walls, pins, loads, gravity and probes.
#[derive(Debug, Default)]
pub(super) struct Surroundings {
    pub(super) walls: Vec<DrawnWall>,
    /// Fixed vertices, ascending.
    pub(super) pins: Vec<u32>,
    pub(super) loads: Vec<DrawnLoad>,
    /// Components of gravity; empty without gravity.
    pub(super) gravity: Vec<OverTime>,
    pub(super) probes: Vec<DrawnProbe>,
}

impl Surroundings {
    pub(super) fn read(
        trajectory: &mut Trajectory,
        directory: &Path,
        topics: &[String],
    ) -> Result<Surroundings, RecordError> {
        let scene = attached_scene(trajectory, directory)?;
        let probes = probes(trajectory, topics)?;
        let Some(scene) = scene else { return Ok(Surroundings { probes, ..Surroundings::default() }) };
        let gravity = scene.world.gravity.clone().unwrap_or_default();
        // None if the scene does not build the recorded meshes.
        let places = scene.places().ok().filter(|found| found.vertex_count == trajectory.vertex_count());
        let (pins, loads) =
            places.map(|found| (pins(found.pins), loads::drawn(found.loads))).unwrap_or_default();
        Ok(Surroundings { walls: walls(&scene), pins, loads, gravity, probes })
    }
}

/// Scene of the recording; `None` if missing or unreadable for this version.
fn attached_scene(trajectory: &mut Trajectory, directory: &Path) -> Result<Option<Scene>, RecordError> {
    let Some(bytes) = trajectory.attachment("scene.toml")? else { return Ok(None) };
    let Ok(text) = String::from_utf8(bytes) else { return Ok(None) };
    Ok(Source::new("scene.toml", text).in_directory(directory).scene().ok())
}

/// Walls, and half-space obstacles in their initial position.
fn walls(scene: &Scene) -> Vec<DrawnWall> {
    let walls = scene.world.walls.iter().enumerate().map(|(i, wall)| drawn_wall(format!("wall{i}"), wall));
    let half_spaces = scene.obstacle.iter().enumerate().filter_map(|(i, obstacle)| match &obstacle.shape {
        ObstacleShape::HalfSpace(half_space) => Some(drawn_wall(obstacle.name_or_default(i), half_space)),
        _ => None,
    });
    walls.chain(half_spaces).collect()
}

fn drawn_wall(name: String, half_space: &HalfSpace) -> DrawnWall {
    let wall = Wall::new(&half_space.normal, half_space.offset);
    let mut normal = [0.0; 3];
    normal.iter_mut().zip(wall.normal()).for_each(|(n, component)| *n = *component);
    DrawnWall { name, point: wall.foot(), normal }
}

/// Vertices of all pins, ascending.
fn pins(pins: Vec<PinnedVertices>) -> Vec<u32> {
    let mut pins: Vec<u32> = pins.into_iter().flat_map(|pin| pin.vertices).collect();
    pins.sort_unstable();
    pins.dedup();
    pins
}

fn probes(trajectory: &mut Trajectory, topics: &[String]) -> Result<Vec<DrawnProbe>, RecordError> {
    let named = topics.iter().filter_map(|topic| Some((topic.as_str(), topic.strip_prefix("/probe/")?)));
    let (topics, names): (Vec<&str>, Vec<&str>) = named.unzip();
    let tables = trajectory.tables(&topics)?;
    let drawn = |(name, columns): (&str, Vec<Column>)| DrawnProbe {
        name: name.to_owned(),
        positions: positions(&columns),
    };
    Ok(names.into_iter().zip(tables).map(drawn).collect())
}

/// Positions from the columns `position[0]`, `position[1]`, `position[2]`.
fn positions(columns: &[Column]) -> Vec<[f64; 3]> {
    let axis = |axis: usize| {
        let name = format!("position[{axis}]");
        columns.iter().find(|column| column.name == name).map_or(&[][..], |column| &column.values)
    };
    let [x, y, z] = [axis(0), axis(1), axis(2)];
    let at = |frame: usize| [x, y, z].map(|axis| axis.get(frame).copied().unwrap_or(0.0));
    (0..x.len()).map(at).collect()
}
