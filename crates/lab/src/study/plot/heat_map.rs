//! Heat map: a table of cells, coloured by state.

use plotters::element::Rectangle;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, Color, RGBColor, WHITE};

use super::PlotError;
use super::style::{Area, Drawn, GREY, centred, letters, page, titled};

/// Width and height of a cell.
const CELL: (i32, i32) = (54, 30);
/// Width for the names of rows.
const NAMES: i32 = 190;

/// A state of cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellState {
    /// Name in the legend.
    pub name: String,
    /// Colour: red, green, blue.
    pub color: (u8, u8, u8),
}

/// A map of states by row and column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeatMap {
    /// Title above the map.
    pub title: String,
    /// Quantity that columns differ in.
    pub x: String,
    /// Quantity that rows differ in.
    pub y: String,
    /// Names of columns.
    pub columns: Vec<String>,
    /// Names of rows.
    pub rows: Vec<String>,
    /// Index of the state and text for each row and column; `None` if unknown.
    pub cells: Vec<Vec<Option<(usize, String)>>>,
    /// States, in the order of the legend.
    pub states: Vec<CellState>,
}

impl HeatMap {
    /// Draws the map as SVG, sized by its cells.
    ///
    /// # Errors
    /// The drawing library fails.
    pub fn svg(&self) -> Result<String, PlotError> {
        let width = (NAMES + CELL.0 * self.columns.len() as i32 + 30).max(560);
        let height = 30 + CELL.1 * self.rows.len() as i32 + 66 + 22 * self.states.len() as i32 + 12;
        page(&self.title, (width as u32, height as u32), |root| self.draw(&titled(root, &self.title)?))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        area.draw_text(&self.y, &letters(13, GREY), (14, 4))?;
        let top = 24;
        let right = letters(13, BLACK).pos(Pos::new(HPos::Right, VPos::Center));
        for (i, name) in self.rows.iter().enumerate() {
            let y = top + CELL.1 * i as i32;
            area.draw_text(name, &right, (NAMES - 8, y + CELL.1 / 2))?;
            for (j, cell) in self.cells.get(i).into_iter().flatten().enumerate() {
                let x = NAMES + CELL.0 * j as i32;
                let corners = [(x, y), (x + CELL.0 - 2, y + CELL.1 - 2)];
                let Some((state, text)) = cell else {
                    area.draw(&Rectangle::new(corners, GREY.mix(0.25).stroke_width(1)))?;
                    continue;
                };
                let color = self.color(*state);
                area.draw(&Rectangle::new(corners, color.filled()))?;
                let middle = (x + CELL.0 / 2 - 1, y + CELL.1 / 2 - 1);
                area.draw_text(text, &centred(11, readable_on(color)), middle)?;
            }
        }
        let bottom = top + CELL.1 * self.rows.len() as i32;
        for (j, name) in self.columns.iter().enumerate() {
            let x = NAMES + CELL.0 * j as i32 + CELL.0 / 2 - 1;
            area.draw_text(name, &centred(12, BLACK), (x, bottom + 9))?;
        }
        area.draw_text(&self.x, &letters(13, GREY), (NAMES, bottom + 20))?;
        for (i, state) in self.states.iter().enumerate() {
            let y = bottom + 46 + 22 * i as i32;
            area.draw(&Rectangle::new([(NAMES, y), (NAMES + 26, y + 16)], self.color(i).filled()))?;
            area.draw_text(&state.name, &letters(13, BLACK), (NAMES + 34, y + 2))?;
        }
        Ok(())
    }

    fn color(&self, state: usize) -> RGBColor {
        self.states.get(state).map_or(GREY, |state| {
            let (red, green, blue) = state.color;
            RGBColor(red, green, blue)
        })
    }
}

/// Black or white, whichever is more legible on this colour.
fn readable_on(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let light = 0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue);
    if light > 140.0 { BLACK } else { WHITE }
}
