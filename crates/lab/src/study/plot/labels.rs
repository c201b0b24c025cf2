//! Placement of labels next to points without overlap.

/// Height of the letters, and of a line.
pub(super) const HEIGHT: i32 = 10;
const LINE: i32 = 12;
/// Average width of digits and small letters, sufficient for most fonts.
const WIDTH: i32 = 6;
/// Gap between a point and its label.
const GAP: i32 = 6;
/// Maximum distance of a label from its point, in lines above or below.
const FARTHEST: i32 = 9;

/// Upper left corner of each label next to its point [pixels]; `None` if no position near the point is
/// free and within `size`. Earlier labels choose first.
pub(super) fn places(labels: &[((i32, i32), &str)], size: (i32, i32)) -> Vec<Option<(i32, i32)>> {
    let mut taken: Vec<[i32; 4]> = vec![];
    let place = |taken: &mut Vec<[i32; 4]>, ((x, y), text): ((i32, i32), &str)| {
        let width = WIDTH * text.chars().count() as i32;
        let sides = [x + GAP, x - GAP - width];
        // Above, below, then farther above, ...
        let heights = (0..FARTHEST).flat_map(|k| [y - 9 - LINE * k, y + 3 + LINE * k]);
        let corners = heights.flat_map(|top| sides.map(|left| (left, top)));
        let free = |(left, top): &(i32, i32)| {
            let inside = *left >= 0 && left + width <= size.0 && *top >= 0 && top + LINE <= size.1;
            let meets = |[l, t, w, h]: &[i32; 4]| {
                *left < l + w && *l < left + width && *top < t + h && *t < top + LINE
            };
            inside && !taken.iter().any(meets)
        };
        let corner = corners.into_iter().find(free)?;
        taken.push([corner.0, corner.1, width, LINE]);
        Some(corner)
    };
    labels.iter().map(|label| place(&mut taken, *label)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_points_at_one_place_lie_beside_each_other() {
        let labels = vec![((300, 200), "1.25 ms"); 24];
        let places: Vec<(i32, i32)> = places(&labels, (600, 400)).into_iter().flatten().collect();
        assert_eq!(places.len(), 24, "there is room for all");
        let width = 6 * 7;
        for (i, a) in places.iter().enumerate() {
            for b in &places[..i] {
                assert!((a.0 - b.0).abs() >= width || (a.1 - b.1).abs() >= 12, "{a:?} on {b:?}");
            }
        }
        assert_eq!(places[0], (306, 191), "the first where labels have always been");
    }

    #[test]
    fn labels_stay_on_the_page_or_are_left_out() {
        let corner = places(&[((598, 2), "1.25 ms"), ((1, 399), "x")], (600, 400));
        assert_eq!(corner, [Some((598 - 6 - 42, 5)), Some((7, 378))]);
        assert_eq!(places(&[((5, 5), "wider than the page")], (60, 400)), [None]);
    }
}
