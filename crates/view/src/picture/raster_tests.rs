//! Tests of the rasteriser: each sample of a surface belongs to one triangle.

use super::raster::{Corner, disc, line, triangle};

const SIZE: [usize; 2] = [40, 30];

fn corner(x: f32, y: f32, nearness: f32) -> Corner {
    Corner { at: [x, y], nearness, weight: 1.0 }
}

/// Number of times each sample is covered.
fn counts(triangles: &[[Corner; 3]]) -> Vec<u32> {
    let mut counts = vec![0; SIZE[0] * SIZE[1]];
    for corners in triangles {
        triangle(corners, SIZE, |sample| counts[sample.row * SIZE[0] + sample.column] += 1);
    }
    counts
}

/// Fan of triangles around a point, with a regular polygon as rim; `turned` selects the orientation.
fn fan(center: [f32; 2], radius: f32, count: usize, turned: bool) -> Vec<[Corner; 3]> {
    let rim = |i: usize| {
        let (sin, cos) = (i as f32 / count as f32 * std::f32::consts::TAU).sin_cos();
        corner(center[0] + radius * cos, center[1] + radius * sin, 1.0)
    };
    let middle = corner(center[0], center[1], 1.0);
    let around = |i: usize| if turned { [middle, rim(i + 1), rim(i)] } else { [middle, rim(i), rim(i + 1)] };
    (0..count).map(around).collect()
}

#[test]
fn triangles_that_share_edges_cover_each_sample_once() {
    for (center, turned) in [([20.0, 15.0], false), ([20.5, 15.5], true), ([19.3, 14.8], false)] {
        for count in [3, 4, 8, 37] {
            let counts = counts(&fan(center, 12.0, count, turned));
            assert!(counts.iter().all(|count| *count <= 1), "a sample is covered twice");
            // No sample well inside the polygon is missed.
            for (at, count) in counts.iter().enumerate() {
                let (x, y) = ((at % SIZE[0]) as f32 + 0.5, (at / SIZE[0]) as f32 + 0.5);
                if (x - center[0]).hypot(y - center[1]) < 5.5 {
                    assert_eq!(*count, 1, "at {x}, {y}");
                }
            }
        }
    }
}

#[test]
fn edges_through_centres_of_samples_belong_to_one_side() {
    // Two triangles with a common edge through sample centres: the square of 8 by 8 samples has 64.
    let [a, b, c, d] = [(4.5, 4.5), (12.5, 4.5), (12.5, 12.5), (4.5, 12.5)].map(|(x, y)| corner(x, y, 1.0));
    for triangles in [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]], [[c, b, a], [d, c, a]]] {
        let counts = counts(&triangles);
        assert_eq!(counts.iter().sum::<u32>(), 64);
        assert!(counts.iter().all(|count| *count <= 1));
    }
}

#[test]
fn depth_and_shares_are_linear() {
    let corners = [corner(2.0, 3.0, 1.0), corner(35.0, 5.0, 3.0), corner(10.0, 28.0, 7.0)];
    triangle(&corners, SIZE, |sample| {
        let [x, y] = [sample.column as f32 + 0.5, sample.row as f32 + 0.5];
        let at = |axis: usize| (0..3).map(|i| sample.share[i] * corners[i].at[axis]).sum::<f32>();
        // Corners are rounded to 1/16.
        assert!((at(0) - x).abs() < 1e-4 && (at(1) - y).abs() < 1e-4);
        assert!((sample.share.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        let nearness: f32 = (0..3).map(|i| sample.share[i] * corners[i].nearness).sum();
        assert!((sample.nearness - nearness).abs() < 1e-4);
    });
}

#[test]
fn what_is_outside_or_no_number_is_not_drawn() {
    let outside = [corner(-50.0, -5.0, 1.0), corner(90.0, -1.0, 1.0), corner(3.0, -80.0, 1.0)];
    let not_a_number = [corner(f32::NAN, 1.0, 1.0), corner(20.0, 1.0, 1.0), corner(3.0, 20.0, 1.0)];
    let far = [corner(1e30, 1.0, 1.0), corner(20.0, 1.0, 1.0), corner(3.0, 20.0, 1.0)];
    assert_eq!(counts(&[outside, not_a_number, far]).iter().sum::<u32>(), 0);
    let over_all = [corner(-100.0, -100.0, 1.0), corner(300.0, -100.0, 1.0), corner(-100.0, 300.0, 1.0)];
    assert_eq!(counts(&[over_all]), vec![1; SIZE[0] * SIZE[1]]);
}

#[test]
fn lines_and_discs_have_their_area() {
    let mut covered = 0;
    let ends = [corner(6.0, 6.0, 1.0), corner(30.0, 24.0, 1.0)];
    line(&ends, 4.0, SIZE, |_, second, across| {
        assert!((-0.2..=1.2).contains(&second) && (-1.0..=1.0).contains(&across));
        covered += 1;
    });
    // Length 30 with caps of 1.2 at both ends, width 4; rounding moves the rim by less than half a
    // sample.
    let area = 32.4 * 4.0;
    assert!((f64::from(covered) - area).abs() < 0.5 * 36.4, "{covered}");
    let mut covered = 0;
    disc([20.2, 15.1], 9.0, SIZE, |_, _, _| covered += 1);
    let area = std::f64::consts::PI * 81.0;
    assert!((f64::from(covered) - area).abs() < 9.0, "{covered} of {area}");
}
