//! Charts, read back as XML.

use roxmltree::Document;

use super::*;

fn chart() -> Chart {
    let mut chart = Chart::new("Error & <time>", AxisSpec::log("time [s]"), AxisSpec::log("error"));
    let points = (0..15).map(|i| Point::new(1e-3 * 10f64.powf(0.2 * f64::from(i)), 10f64.powi(-i))).collect();
    chart.lines.push(Line { name: "rk4".into(), points, marked: true, joined: true, look: 0 });
    chart
}

/// Texts of a chart.
fn texts(svg: &str) -> Vec<String> {
    let document = Document::parse(svg).unwrap();
    let texts = document.descendants().filter(|node| node.has_tag_name("text"));
    texts.filter_map(|node| node.text().map(|text| text.trim().to_owned())).collect()
}

#[test]
fn a_chart_is_well_formed_whatever_is_written_in_it() {
    let texts = texts(&chart().svg().unwrap());
    for expected in ["Error & <time>", "time [s]", "error", "rk4"] {
        assert!(texts.iter().any(|text| text == expected), "no {expected:?} in {texts:?}");
    }
}

#[test]
fn errors_down_to_rounding_are_on_the_page_one_below_the_other() {
    let svg = chart().svg().unwrap();
    assert!(texts(&svg).iter().any(|text| text == "10⁻¹⁴"), "{:?}", texts(&svg));
    let document = Document::parse(&svg).unwrap();
    let circles = document.descendants().filter(|node| node.has_tag_name("circle"));
    let heights: Vec<i32> = circles.map(|node| node.attribute("cy").unwrap().parse().unwrap()).collect();
    // Fifteen points, and one in the legend.
    assert_eq!(heights.len(), 16);
    let points = &heights[..15];
    assert!(points.windows(2).all(|pair| pair[1] - pair[0] >= 20), "evenly down the page: {points:?}");
    assert!(points[0] > 0 && points[14] < 520, "{points:?}");
}

#[test]
fn a_run_that_failed_is_a_cross_above_all_points() {
    let mut chart = chart();
    chart.lines[0].points.push(Point { x: 1e-3, y: None, label: None });
    let svg = chart.svg().unwrap();
    assert!(texts(&svg).iter().any(|text| text.contains("the run failed")));
    let document = Document::parse(&svg).unwrap();
    let top = |tag: &str, key: &str| {
        let nodes = document.descendants().filter(|node| node.has_tag_name(tag));
        nodes.filter_map(|node| node.attribute(key)).map(str::to_owned).collect::<Vec<_>>()
    };
    let number = |y: &String| y.parse::<i32>().unwrap();
    let highest = top("circle", "cy").iter().take(15).map(number).min().unwrap();
    // The two strokes of the cross follow the grid lines.
    let strokes: Vec<i32> = top("line", "y1").iter().map(number).collect();
    let strokes = &strokes[strokes.len() - 2..];
    assert!(strokes.iter().all(|y| *y < highest - 5), "{strokes:?} above {highest}");
}

#[test]
fn the_same_chart_is_the_same_text_and_nothing_to_show_is_no_error() {
    assert_eq!(chart().svg().unwrap(), chart().svg().unwrap());
    let empty = Chart::new("", AxisSpec::log("a"), AxisSpec::linear("b"));
    Document::parse(&empty.svg().unwrap()).unwrap();
}

#[test]
fn a_map_names_its_rows_columns_and_states() {
    let state = |name: &str, color| CellState { name: name.into(), color };
    let map = HeatMap {
        title: "Which steps hold".into(),
        x: "step [s]".into(),
        y: "stiffness".into(),
        columns: vec!["1e-3".into(), "1e-2".into()],
        rows: vec!["1e5".into(), "1e6".into()],
        cells: vec![vec![Some((0, "ok".into())), Some((1, "x".into()))], vec![Some((1, "x".into())), None]],
        states: vec![state("holds", (0, 158, 115)), state("fails", (213, 94, 0))],
    };
    let svg = map.svg().unwrap();
    let texts = texts(&svg);
    for expected in ["Which steps hold", "step [s]", "stiffness", "1e-3", "1e6", "holds", "fails"] {
        assert!(texts.iter().any(|text| text == expected), "no {expected:?} in {texts:?}");
    }
    assert_eq!(svg.matches("#D55E00").count(), 3, "two cells and the legend");
}

/// No two of twenty-three lines look the same, with or without marks, and no labels overlap.
#[test]
fn as_many_lines_as_there_are_schemes_can_be_told_apart() {
    for marked in [true, false] {
        let mut chart = Chart::new("all", AxisSpec::log("time [s]"), AxisSpec::log("error"));
        for look in 0..23 {
            let points = vec![
                Point { x: 1.0, y: Some(1.0), label: Some("1.25 ms".into()) },
                Point::new(2.0 + look as f64, 0.1),
            ];
            chart.lines.push(Line { name: format!("scheme {look}"), points, marked, joined: true, look });
        }
        let svg = chart.svg().unwrap();
        let document = Document::parse(&svg).unwrap();
        let strokes: Vec<(String, String)> = document
            .descendants()
            .filter(|node| node.has_tag_name("polyline") && node.attribute("stroke-width") == Some("2"))
            .map(|node| {
                let of = |key: &str| node.attribute(key).unwrap_or_default().to_owned();
                (of("stroke"), of("stroke-dasharray"))
            })
            .collect();
        assert_eq!(strokes.len(), 46, "in the chart and in the legend");
        let mut legend = strokes[23..].to_vec();
        assert_eq!(legend, strokes[..23], "as in the legend");
        legend.sort();
        legend.dedup();
        assert_eq!(legend.len(), 23, "colour and dashes alone tell {legend:?}");
        let labels: Vec<(i32, i32)> = document
            .descendants()
            .filter(|node| node.is_element() && node.text().is_some_and(|text| text.trim() == "1.25 ms"))
            .map(|node| ["x", "y"].map(|key| node.attribute(key).unwrap().parse::<i32>().unwrap()).into())
            .collect();
        assert!(labels.len() >= 15, "{labels:?}");
        for (i, a) in labels.iter().enumerate() {
            for b in &labels[..i] {
                assert!((a.0 - b.0).abs() >= 42 || (a.1 - b.1).abs() >= 12, "{a:?} on {b:?}");
            }
        }
    }
}
