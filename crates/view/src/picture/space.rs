//! Vectors of three single-precision numbers.

/// Point or direction.
pub type Vec3 = [f32; 3];

pub(super) fn plus(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn times(a: Vec3, factor: f32) -> Vec3 {
    a.map(|x| x * factor)
}

pub(super) fn dot(a: Vec3, b: Vec3) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn length(a: Vec3) -> f32 {
    dot(a, a).sqrt()
}

/// Unit vector `a / |a|`; zero for zero.
pub(super) fn unit(a: Vec3) -> Vec3 {
    let length = length(a);
    if length > 0.0 { times(a, 1.0 / length) } else { [0.0; 3] }
}

/// Linear interpolation `a (1 - t) + b t`.
pub(super) fn mixed(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    [0, 1, 2].map(|i| a[i] + t * (b[i] - a[i]))
}

/// Weighted sum of three vectors.
pub(super) fn weighted(of: [Vec3; 3], by: [f32; 3]) -> Vec3 {
    [0, 1, 2].map(|i| of[0][i] * by[0] + of[1][i] * by[1] + of[2][i] * by[2])
}

/// Two unit vectors orthogonal to a unit vector and to each other, horizontal if possible.
pub(super) fn tangents(normal: Vec3) -> [Vec3; 2] {
    let level = cross([0.0, 0.0, 1.0], normal);
    let first = if length(level) > 1e-3 { unit(level) } else { [1.0, 0.0, 0.0] };
    [first, unit(cross(normal, first))]
}

/// Smooth step: `0` below `from`, `1` above `to`, `3 t^2 - 2 t^3` between.
pub(super) fn smooth_step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
