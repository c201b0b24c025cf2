//! Tests of whole pictures of simple figures.

use super::camera::{Camera, Lens, ViewDirection, Viewport};
use super::figure::{Dot, DrawnFigure};
use super::image::{Image, Rgb};
use super::space::{Vec3, plus};
use super::stage::{PictureStage, Style};
use super::theme::Theme;

const RED: Rgb = [220, 40, 40];
const BLUE: Rgb = [40, 60, 220];
const SIZE: [usize; 2] = [160, 120];
const STYLE: Style = Style { size: SIZE, theme: Theme::Light, transparent: false };

/// Adds a square with this half side around a position, facing the front.
fn square(figure: &mut DrawnFigure, center: Vec3, half: f32, color: Rgb) {
    let first = figure.vertices.len() as u32;
    for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        figure.vertices.push(plus(center, [half * x, 0.0, half * z]));
    }
    figure.faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    figure.face_colors.extend([[color; 3]; 2]);
}

fn front() -> ViewDirection {
    ViewDirection { azimuth: 0.0, elevation: 0.0, zoom: 1.0 }
}

fn picture(figure: &DrawnFigure, style: Style) -> Image {
    let viewport = Viewport::inside(style.size, [10.0; 4]);
    PictureStage::new(style, front(), figure.dimension, &figure.drawn(), 0, &viewport).draw(figure)
}

fn is_reddish([r, g, b, _]: [u8; 4]) -> bool {
    u32::from(r) > u32::from(g) + 60 && u32::from(r) > u32::from(b) + 60
}

fn is_bluish([r, g, b, _]: [u8; 4]) -> bool {
    u32::from(b) > u32::from(g) + 60 && u32::from(b) > u32::from(r) + 60
}

#[test]
fn nearer_surfaces_hide_farther_ones_in_any_order() {
    let mut figure = DrawnFigure { dimension: 3, ..DrawnFigure::default() };
    square(&mut figure, [0.0, 0.0, 0.0], 1.0, RED);
    square(&mut figure, [0.0, -0.5, 0.0], 0.4, BLUE);
    for _ in 0..2 {
        let image = picture(&figure, STYLE);
        assert!(is_bluish(image.pixel(80, 60)), "{:?}", image.pixel(80, 60));
        assert!(is_reddish(image.pixel(80, 22)), "{:?}", image.pixel(80, 22));
        assert_eq!(image.pixel(2, 2), [255; 4]);
        figure.faces.reverse();
        figure.face_colors.reverse();
    }
}

#[test]
fn fitted_cameras_show_all_points_and_touch_the_rim() {
    let mut seed = 1_u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    let points: Vec<Vec3> = (0..300).map(|_| [3.0 * random(), random(), 2.0 * random()]).collect();
    let viewport = Viewport::inside([400, 300], [20.0, 30.0, 60.0, 10.0]);
    for lens in [Lens::Perspective, Lens::Parallel] {
        let direction = ViewDirection { azimuth: 40.0, elevation: 25.0, zoom: 1.0 };
        let camera = Camera::fitted(direction, lens, &points, &viewport);
        let seen: Vec<[f32; 2]> = points.iter().map(|p| camera.project(*p).unwrap().at).collect();
        let fold = |start: f32, pick: fn(f32, f32) -> f32| {
            seen.iter().fold([start; 2], |a, b| [pick(a[0], b[0]), pick(a[1], b[1])])
        };
        let (low, high) = (fold(f32::INFINITY, f32::min), fold(f32::NEG_INFINITY, f32::max));
        let slack = 0.01;
        assert!(low[0] > 20.0 - slack && low[1] > 30.0 - slack, "{low:?}");
        assert!(high[0] < 340.0 + slack && high[1] < 290.0 + slack, "{high:?}");
        let touches =
            |axis: usize, a: f32, b: f32| (low[axis] - a).abs() < slack && (high[axis] - b).abs() < slack;
        assert!(touches(0, 20.0, 340.0) || touches(1, 30.0, 290.0), "{low:?} {high:?}");
    }
}

#[test]
fn bodies_cast_shadows_on_the_floor() {
    let mut figure = DrawnFigure { dimension: 3, ..DrawnFigure::default() };
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        figure.vertices.push([0.5 * x, 0.5 * y, 1.0]);
    }
    figure.faces = vec![[0, 1, 2], [0, 2, 3]];
    figure.face_colors = vec![[RED; 3]; 2];
    let floor = DrawnFigure { walls: vec![[[0.0; 3], [0.0, 0.0, 1.0]]], ..figure.clone() };
    let corners = [[-2.0, -2.0, 0.0], [2.0, 2.0, 1.0]];
    let direction = ViewDirection { elevation: 50.0, ..front() };
    let stage = PictureStage::new(STYLE, direction, 3, &corners, 0, &Viewport::inside(SIZE, [10.0; 4]));
    let image = stage.draw(&floor);
    // From the middle of the plate along the light to the floor.
    let down = 1.0 / stage.light[2];
    let shadow = [-stage.light[0] * down, -stage.light[1] * down, 0.0];
    let brightness = |place: Vec3| {
        let [x, y] = stage.camera.project(place).unwrap().at;
        image.pixel(x as usize, y as usize).iter().take(3).map(|c| u32::from(*c)).sum::<u32>()
    };
    let beside = plus(shadow, [1.3, 0.0, 0.0]);
    assert!(
        brightness(shadow) * 10 < brightness(beside) * 8,
        "{} {}",
        brightness(shadow),
        brightness(beside)
    );
    // With a transparent background, only the shadow of the floor remains.
    let style = Style { transparent: true, ..STYLE };
    let image = PictureStage { style, ..stage.clone() }.draw(&floor);
    let opacity = |place: Vec3| {
        let [x, y] = stage.camera.project(place).unwrap().at;
        image.pixel(x as usize, y as usize)[3]
    };
    assert!(opacity(shadow) > 60 && opacity(beside) == 0, "{} {}", opacity(shadow), opacity(beside));
}

#[test]
fn plane_triangles_have_their_colour_and_are_marked_when_inside_out() {
    let mut figure = DrawnFigure { dimension: 2, ..DrawnFigure::default() };
    figure.vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    figure.faces = vec![[0, 1, 2], [0, 3, 2]];
    figure.face_colors = vec![[BLUE; 3]; 2];
    let image = picture(&figure, STYLE);
    assert_eq!(image.pixel(95, 75), [BLUE[0], BLUE[1], BLUE[2], 255]);
    assert!(is_reddish(image.pixel(65, 45)), "{:?}", image.pixel(65, 45));
}

#[test]
fn fine_meshes_are_not_painted_black_by_their_edges() {
    let grid = |n: u32| {
        let mut figure = DrawnFigure { dimension: 2, ..DrawnFigure::default() };
        let place = |i: u32| i as f32 / n as f32;
        figure.vertices = (0..=n).flat_map(|y| (0..=n).map(move |x| [place(x), place(y), 0.0])).collect();
        let at = |x: u32, y: u32| y * (n + 1) + x;
        for (x, y) in (0..n).flat_map(|y| (0..n).map(move |x| (x, y))) {
            figure.faces.push([at(x, y), at(x + 1, y), at(x + 1, y + 1)]);
            figure.faces.push([at(x, y), at(x + 1, y + 1), at(x, y + 1)]);
        }
        figure.face_colors = vec![[BLUE; 3]; figure.faces.len()];
        picture(&figure, STYLE)
    };
    let differ = |image: &Image| {
        (40..80)
            .flat_map(|y| (60..100).map(move |x| (x, y)))
            .filter(|(x, y)| image.pixel(*x, *y) != [BLUE[0], BLUE[1], BLUE[2], 255])
            .count()
    };
    assert_eq!(differ(&grid(50)), 0);
    let coarse = differ(&grid(4));
    assert!((40..600).contains(&coarse), "{coarse}");
}

#[test]
fn dots_have_a_radius_in_proportion_to_their_size() {
    let figure = |size: f32| DrawnFigure {
        dimension: 3,
        vertices: vec![[0.0; 3]],
        dots: vec![Dot { vertex: 0, color: RED, size }],
        ..DrawnFigure::default()
    };
    let area =
        |size: f32| picture(&figure(size), STYLE).rgba.chunks_exact(4).filter(|p| p[1] < 200).count() as f32;
    let ratio = area(4.0) / area(2.0);
    assert!((3.4..4.6).contains(&ratio), "{ratio}");
}

#[test]
fn the_same_figure_gives_the_same_bytes() {
    let mut figure = DrawnFigure { dimension: 3, ..DrawnFigure::default() };
    square(&mut figure, [0.0, 0.0, 0.3], 1.0, RED);
    assert_eq!(picture(&figure, STYLE), picture(&figure, STYLE));
}
