//! All formulas of a scene that may depend on time.

use crate::key_path::KeyPath;
use crate::schema::{MotionSpec, OverTime, Scene};

impl Scene {
    /// Each number or formula of gravity, loads, muscles and prescribed motion, with its place in the scene.
    pub(crate) fn formulas(&self) -> Vec<(KeyPath, &OverTime)> {
        let root = KeyPath::root();
        let mut formulas: Vec<(KeyPath, &OverTime)> = vec![];
        let gravity = root.key("world").key("gravity");
        formulas.extend(self.world.gravity.iter().flatten().map(|formula| (gravity.clone(), formula)));
        // Obstacles among the bodies stand in the list of obstacles.
        for (b, body) in self.body.iter().enumerate().filter(|(_, body)| body.obstacle.is_none()) {
            let path = root.key("body").index(b);
            for (l, load) in body.load.iter().enumerate() {
                let path = path.key("load").index(l);
                for (key, _, vector) in load.vectors() {
                    formulas.extend(vector.iter().map(|formula| (path.key(key), formula)));
                }
                formulas.extend(load.pressure.iter().map(|formula| (path.key("pressure"), formula)));
            }
            for (m, muscle) in body.muscle.iter().enumerate() {
                formulas.push((path.key("muscle").index(m).key("tension"), &muscle.tension));
            }
            for (p, pin) in body.pin.iter().enumerate() {
                formulas.extend(of_motion(&path.key("pin").index(p), pin.motion.as_ref()));
            }
        }
        for (o, obstacle) in self.obstacle.iter().enumerate() {
            formulas.extend(of_motion(&root.key("obstacle").index(o), obstacle.motion.as_ref()));
        }
        formulas
    }
}

fn of_motion<'a>(path: &KeyPath, motion: Option<&'a MotionSpec>) -> Vec<(KeyPath, &'a OverTime)> {
    let Some(motion) = motion else { return vec![] };
    let path = path.key("motion");
    let displacement =
        motion.displacement.iter().flatten().map(|formula| (path.key("displacement"), formula));
    let angle = motion.rotation.iter().filter_map(|rotation| rotation.angle.as_ref());
    displacement.chain(angle.map(|formula| (path.key("rotation"), formula))).collect()
}
