//! Tests of charts.

use super::{Series, TimeChart};
use crate::picture::Theme;

fn chart(points: Vec<[f64; 2]>) -> TimeChart {
    let series = vec![Series { name: "<b>&co".to_owned(), points }];
    TimeChart { title: "A <script> & more".to_owned(), name: "energy [J]".to_owned(), series }
}

#[test]
fn names_are_text_in_svg() {
    let svg = chart(vec![[0.0, 1.0], [1.0, 2.0]]).svg();
    assert!(svg.contains("A &lt;script&gt; &amp; more") && svg.contains("&lt;b&gt;&amp;co"));
    assert!(!svg.contains("<script>"));
}

#[test]
fn gaps_stay_gaps_and_nothing_is_not_a_number() {
    let svg = chart(vec![[0.0, 1.0], [1.0, 2.0], [2.0, f64::NAN], [3.0, 1.0], [4.0, 3.0]]).svg();
    assert_eq!(svg.matches("stroke-width=\"1.8\"").count(), 2);
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    for points in [vec![], vec![[0.0, 5.0]], vec![[0.0, f64::NAN]], vec![[0.0, 0.0], [1.0, 0.0]]] {
        assert!(!chart(points).svg().contains("NaN"));
    }
}

#[test]
fn lines_rise_from_the_lower_left_to_the_upper_right() {
    let image = chart((0..100).map(|i| [f64::from(i), f64::from(i)]).collect()).image(Theme::Light);
    let is_blue = |x: usize, y: usize| {
        let [r, g, b, _] = image.pixel(x, y);
        b > 150 && r < 60 && g < 140
    };
    // In the middle of both axes, and neither above nor below it.
    let rows: Vec<usize> = (60..420).filter(|row| is_blue(392, *row)).collect();
    assert!(!rows.is_empty() && rows.iter().all(|row| row.abs_diff(239) < 4), "{rows:?}");
}

/// Values that differ little need many digits, and all of these fit inside the picture.
#[test]
fn the_longest_label_is_inside() {
    let chart = chart((0..100).map(|i| [f64::from(i), -4.999_94e-7 + 1e-13 * f64::from(i)]).collect());
    let svg = chart.svg();
    let labels = svg.lines().filter(|line| line.contains("text-anchor=\"end\""));
    let longest = labels.map(|line| line.split('>').nth(1).unwrap().len()).max().unwrap();
    assert!(longest >= "-4.99994e-7</text".len(), "{svg}");
    let image = chart.image(Theme::Light);
    let is_blank = |column: usize| (60..420).all(|row| image.pixel(column, row) == image.pixel(0, 0));
    assert!((0..7).all(is_blank) && (7..12).any(|column| !is_blank(column)));
}

#[test]
fn charts_in_terminals_have_the_size_asked_for() {
    let text = chart((0..500).map(|i| [f64::from(i), f64::from(i).sin()]).collect()).text(60, 6);
    let lines: Vec<&str> =
        text.lines().filter(|line| line.contains(|c| ('\u{2801}'..='\u{28ff}').contains(&c))).collect();
    assert_eq!(lines.len(), 6);
    assert!(lines.iter().all(|line| line.chars().count() <= 60));
}

#[test]
fn many_points_are_thinned_and_keep_their_extremes() {
    let mut points: Vec<[f64; 2]> = (0..100_000).map(|i| [f64::from(i), 0.0]).collect();
    points[50_000][1] = 1.0;
    let svg = chart(points).svg();
    assert!(svg.len() < 60_000, "{}", svg.len());
    // The peak is at the upper end of its axis, minus the 5 % of room above: 48 + 382 * 0.05 / 1.1.
    assert!(svg.contains(" 65.4"), "no peak");
}
