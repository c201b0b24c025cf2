//! Film: frame selection, camera fit and colouring of a recording.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use super::camera::{ViewDirection, Viewport};
use super::casting::Cast;
use super::figure::{DrawnFigure, bounds};
use super::image::Image;
use super::legend;
use super::space::{Vec3, length, minus};
use super::stage::{PictureStage, Style};
use super::text::{self, Anchor};
use crate::drawing::{Colouring, DrawError, Drawing};

/// Largest number of frames that the camera is fitted to, chosen evenly.
const FITTED: usize = 60;
/// Size ratio above which the camera follows a flying body.
const FAR: f32 = 3.0;

/// Fit of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fit {
    /// All frames, or [`Fit::Follow`] if bodies fly many times their size.
    #[default]
    Auto,
    /// All frames of the film; of more than 60, some chosen evenly.
    All,
    /// The first frame of the recording.
    First,
    /// The largest frame; the camera moves with the mean of the bodies.
    Follow,
}

/// Options for rendering a recording.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Size, theme, background.
    pub style: Style,
    /// Camera direction.
    pub direction: ViewDirection,
    /// Fit of the camera.
    pub fit: Fit,
    /// Colouring of bodies.
    pub colouring: Colouring,
    /// Ends of the colour scale; `None` for the range of the values.
    pub range: Option<(f64, f64)>,
    /// True to draw title, time and colour scale.
    pub labels: bool,
}

/// Frames of a recording with their shared data.
#[derive(Debug)]
pub struct Film {
    options: RenderOptions,
    title: String,
    duration: f64,
    cast: Cast,
    figures: Vec<(f64, DrawnFigure)>,
    stages: Vec<PictureStage>,
}

/// Line of text, its position, and the height of its capitals [pixel].
type Words = (String, [f32; 2], f32);

impl Film {
    /// Title of the recording.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Reads these frames, at least one, and fits the camera.
    ///
    /// # Errors
    /// The errors of [`Drawing::frame`] and [`Drawing::scalars`].
    pub fn read(drawing: &mut Drawing, frames: &[usize], options: RenderOptions) -> Result<Film, DrawError> {
        let cast = Cast::new(drawing, &options, frames)?;
        let figures: Result<Vec<_>, _> = frames
            .iter()
            .map(|&frame| Ok::<_, DrawError>((drawing.times()[frame], cast.figure(drawing, frame)?)))
            .collect();
        let first = cast.figure(drawing, 0)?;
        let (title, duration) = (drawing.title().to_owned(), drawing.times().last().copied().unwrap_or(0.0));
        let mut film = Film { options, title, duration, cast, figures: figures?, stages: vec![] };
        film.stages = film.fitted(&first);
        Ok(film)
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.figures.len()
    }

    /// True if there are no frames.
    pub fn is_empty(&self) -> bool {
        self.figures.is_empty()
    }

    /// Simulated times of the frames [s].
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.figures.iter().map(|(time, _)| *time)
    }

    /// Figure and stage of a frame, for vector formats.
    pub(crate) fn shot(&self, number: usize) -> (&DrawnFigure, &PictureStage) {
        (&self.figures[number].1, &self.stages[number])
    }

    /// Draws all frames in parallel; the pictures do not depend on the number of threads.
    pub fn draw(&self) -> Vec<Image> {
        self.each(|number| {
            let mut image = self.picture(number);
            self.write_labels(&mut image, number);
            image
        })
    }

    /// Draws all frames in one picture, in rows, with the title above and the scale next to them.
    pub fn contact_sheet(&self) -> Image {
        let cells = self.each(|number| {
            let mut image = self.picture(number);
            self.write_time(&mut image, number);
            image
        });
        let [width, height] = self.options.style.size;
        let columns = (1..=cells.len()).find(|columns| columns * columns >= cells.len()).unwrap_or(1);
        let rows = cells.len().div_ceil(columns);
        let (above, beside) = if self.options.labels {
            (3.2 * legend::letters(height), self.cast.scale.as_ref().map_or(0.0, |_| legend::room(height)))
        } else {
            (0.0, 0.0)
        };
        let size = [columns * width + beside as usize, rows * height + above as usize];
        let mut sheet = Image::filled(size, self.background());
        for (number, cell) in cells.iter().enumerate() {
            sheet.paste(cell, number % columns * width, above as usize + number / columns * height);
        }
        self.write_title(&mut sheet, legend::letters(height));
        if self.options.labels
            && let Some(scale) = &self.cast.scale
        {
            legend::draw(&mut sheet, scale, self.options.style.theme);
        }
        sheet
    }

    fn each(&self, draw: impl Fn(usize) -> Image + Sync) -> Vec<Image> {
        let images: Vec<Mutex<Option<Image>>> = self.figures.iter().map(|_| Mutex::new(None)).collect();
        let next = AtomicUsize::new(0);
        let threads = thread::available_parallelism().map_or(1, NonZero::get).min(images.len());
        thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    while let number = next.fetch_add(1, Ordering::Relaxed)
                        && number < images.len()
                    {
                        let image = draw(number);
                        *images[number].lock().unwrap_or_else(PoisonError::into_inner) = Some(image);
                    }
                });
            }
        });
        images
            .into_iter()
            .filter_map(|image| image.into_inner().unwrap_or_else(PoisonError::into_inner))
            .collect()
    }

    fn picture(&self, number: usize) -> Image {
        let (figure, stage) = self.shot(number);
        stage.draw(figure)
    }

    fn background(&self) -> [u8; 4] {
        let [r, g, b] = self.options.style.theme.background();
        [r, g, b, if self.options.style.transparent { 0 } else { 255 }]
    }

    fn write_labels(&self, image: &mut Image, number: usize) {
        self.write_time(image, number);
        self.write_title(image, legend::letters(image.height));
        if self.options.labels
            && let Some(scale) = &self.cast.scale
        {
            legend::draw(image, scale, self.options.style.theme);
        }
    }

    fn write_time(&self, image: &mut Image, number: usize) {
        if self.options.labels {
            self.write(image, &self.time(number, image.height));
        }
    }

    fn write_title(&self, image: &mut Image, size: f32) {
        if self.options.labels {
            self.write(image, &self.headline(image.width, size));
        }
    }

    fn write(&self, image: &mut Image, (words, at, size): &Words) {
        text::write(image, words, *at, *size, self.options.style.theme.ink(), Anchor::Left);
    }

    fn time(&self, number: usize, height: usize) -> Words {
        let size = legend::letters(height);
        let words = format!("t = {} s", written_time(self.figures[number].0, self.duration));
        (words, [1.6 * size, height as f32 - 1.6 * size], size)
    }

    fn headline(&self, width: usize, size: f32) -> Words {
        let size = 1.15 * size;
        let title = text::shortened(&self.title, size, width as f32 - 3.2 * size);
        (title, [1.4 * size, 2.3 * size], size)
    }

    /// Texts over a frame with positions and capital heights; empty without labels.
    pub(crate) fn words(&self, number: usize) -> Vec<Words> {
        let [width, height] = self.options.style.size;
        if !self.options.labels {
            return vec![];
        }
        vec![self.headline(width, legend::letters(height)), self.time(number, height)]
    }

    /// Colour bar, if one is drawn.
    pub(crate) fn scale(&self) -> Option<&legend::ColorScale> {
        self.cast.scale.as_ref().filter(|_| self.options.labels)
    }

    /// Margins at the left, top, right and bottom that bodies are kept out of [pixel].
    fn margins(&self) -> [f32; 4] {
        let height = self.options.style.size[1];
        let rim = 0.05 * height as f32;
        let (line, bar) = if self.options.labels {
            (3.9 * legend::letters(height), self.cast.scale.as_ref().map_or(0.0, |_| legend::room(height)))
        } else {
            (0.0, 0.0)
        };
        [rim, rim.max(line), rim.max(bar), rim.max(line)]
    }

    /// Stage for each frame.
    fn fitted(&self, first: &DrawnFigure) -> Vec<PictureStage> {
        let step = self.figures.len().div_ceil(FITTED);
        let chosen: Vec<Vec<Vec3>> =
            self.figures.iter().step_by(step).map(|(_, figure)| seen(figure)).collect();
        let all: Vec<Vec3> = chosen.iter().flatten().copied().collect();
        let largest = chosen.iter().map(|places| bounds(places).1).fold(0.0, f32::max);
        let follows = match self.options.fit {
            Fit::Follow => true,
            Fit::Auto => !first.faces.is_empty() && bounds(&all).1 > FAR * largest,
            Fit::All | Fit::First => false,
        };
        if follows {
            let around =
                chosen.iter().flat_map(|places| places.iter().map(|place| minus(*place, mean(places))));
            let stage = self.stage(&around.collect::<Vec<_>>(), first);
            self.figures.iter().map(|(_, figure)| stage.moved(mean(&figure.drawn()))).collect()
        } else {
            let places = if self.options.fit == Fit::First { seen(first) } else { all };
            vec![self.stage(&places, first); self.figures.len()]
        }
    }

    fn stage(&self, places: &[Vec3], figure: &DrawnFigure) -> PictureStage {
        let RenderOptions { style, direction, .. } = self.options;
        let viewport = Viewport::inside(style.size, self.margins());
        PictureStage::new(style, direction, figure.dimension, places, figure.dots.len(), &viewport)
    }
}

/// Fraction of a point cloud that the camera is fitted to: a few points fly far.
const CLOUD: f32 = 0.985;
/// Number of points that make a cloud.
const MANY: usize = 200;

/// Positions that the camera should see: everything drawn, and trails; for clouds the points nearest to
/// the mean.
fn seen(figure: &DrawnFigure) -> Vec<Vec3> {
    let mut places = figure.drawn();
    let trails = figure.trails.iter().flat_map(|trail| &trail.places);
    places.extend(trails.filter(|place| place.iter().all(|x| x.is_finite())));
    if figure.faces.is_empty() && figure.dots.len() > MANY {
        let middle = mean(&places);
        places.sort_by(|a, b| length(minus(*a, middle)).total_cmp(&length(minus(*b, middle))));
        places.truncate((CLOUD * places.len() as f32) as usize);
    }
    places
}

/// Mean position; the origin if there are none.
fn mean(places: &[Vec3]) -> Vec3 {
    let sum = places.iter().fold([0.0_f64; 3], |sum, place| [0, 1, 2].map(|i| sum[i] + f64::from(place[i])));
    sum.map(|sum| (sum / places.len().max(1) as f64) as f32)
}

/// Formats a time to three digits of the duration [s].
fn written_time(time: f64, duration: f64) -> String {
    if duration > 0.0 && !(1e-4..1e5).contains(&duration) {
        return format!("{time:.3e}");
    }
    let decimals = if duration > 0.0 { (2.0 - duration.log10().floor()).clamp(0.0, 6.0) } else { 2.0 };
    format!("{time:.*}", decimals as usize)
}
