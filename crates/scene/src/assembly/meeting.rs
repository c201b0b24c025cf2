//! Warning of overlapping bodies without contact, by their bounding boxes.

use crate::Scene;

/// True if bodies pass through each other: the scene has neither contact nor attachments.
pub fn passes_through(scene: &Scene) -> bool {
    scene.contact.as_ref().is_none_or(|contact| contact.of_walls) && scene.attachment.is_empty()
}

/// First two bodies whose bounding boxes overlap, by ascending index; each body is given by its points,
/// flat `(n, dimension)` [m].
pub fn first_meeting<'a>(bodies: impl Iterator<Item = &'a [f64]>, dimension: usize) -> Option<[usize; 2]> {
    let of_body = |x: &[f64]| if dimension == 2 { bounds::<2>(x) } else { bounds::<3>(x) };
    let boxes: Vec<[[f64; 2]; 3]> = bodies.map(of_body).collect();
    let meet =
        |[a, b]: &[usize; 2]| boxes[*a].iter().zip(&boxes[*b]).all(|(a, b)| a[0] <= b[1] && b[0] <= a[1]);
    (0..boxes.len()).flat_map(|b| (0..b).map(move |a| [a, b])).find(meet)
}

/// Smallest and largest coordinate of points, flat `(n, D)`, along each axis; in 2D the third axis has
/// equal bounds.
fn bounds<const D: usize>(x: &[f64]) -> [[f64; 2]; 3] {
    let (mut least, mut largest) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for row in x.as_chunks::<D>().0 {
        for k in 0..D {
            least[k] = if row[k] < least[k] { row[k] } else { least[k] };
            largest[k] = if row[k] > largest[k] { row[k] } else { largest[k] };
        }
    }
    let mut bounds = [[0.0; 2]; 3];
    (0..D).for_each(|k| bounds[k] = [least[k], largest[k]]);
    bounds
}
