//! Page that plays a recording in a browser: one self-contained HTML file.
//!
//! The modules in `crates/view/page` and three.js are embedded as base 64 of deflate, together with
//! blocks of the recording. Names and titles occur in such blocks only, and the page shows them as text,
//! so that no name can become markup. The page's content security policy forbids all requests.
//!
//! # How to add a part of the page
//! 1. Write a module in `crates/view/page` and name it in the list of `html.rs`.
//! 2. Look at it: `tests/tools/check_page.sh target/release/pliant` opens pages in a headless Chromium,
//!    which npm brings, and leaves screenshots in `target/ci/page`; its steps are in
//!    `tests/tools/view_page`.
//! 3. `tests/tools/check_gltf.sh target/release/pliant` gives exported `.glb` files to Khronos' validator.

mod charts;
mod codec;
mod html;
mod loads;
mod pack;
mod shown;
#[cfg(test)]
mod tests;

use crate::drawing::{Colouring, DrawError, Drawing};

/// Limits of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageBudget {
    /// Size of the packed recording, before base 64 [bytes].
    pub bytes: usize,
    /// Number of frames.
    pub frames: usize,
}

impl Default for PageBudget {
    fn default() -> PageBudget {
        PageBudget { bytes: 20_000_000, frames: 300 }
    }
}

/// Page, with the extent of the recording in it.
#[derive(Clone, Debug)]
pub struct ViewerPage {
    /// HTML text.
    pub html: String,
    /// Number of frames in the page.
    pub frames: usize,
    /// Number of frames of the recording.
    pub frame_count: usize,
    /// Names of colourings that did not fit.
    pub left_out: Vec<String>,
}

/// Socket of a page that shows a running simulation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveSocket {
    /// Host and port, such as `127.0.0.1:8080`.
    pub host: String,
    /// Path, of letters, digits and slashes.
    pub path: String,
}

/// Connection of a page that shows a running simulation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LiveLink {
    /// A socket.
    Socket(LiveSocket),
    /// A `MessagePort` that the page receives from the window around it.
    Port,
}

impl ViewerPage {
    /// Packs a recording. If it is too large, frames are dropped evenly until it fits; if two frames are
    /// too many, colourings are dropped.
    ///
    /// # Errors
    /// The recording cannot be read.
    pub fn new(drawing: &mut Drawing, budget: &PageBudget) -> Result<ViewerPage, DrawError> {
        ViewerPage::packed(drawing, budget, None)
    }

    /// Packs the present state of a simulation that runs behind `link`; `drawing` has that state.
    ///
    /// # Errors
    /// The recording cannot be read.
    pub fn live(
        drawing: &mut Drawing,
        budget: &PageBudget,
        link: &LiveLink,
    ) -> Result<ViewerPage, DrawError> {
        ViewerPage::packed(drawing, budget, Some(link))
    }

    fn packed(
        drawing: &mut Drawing,
        budget: &PageBudget,
        live: Option<&LiveLink>,
    ) -> Result<ViewerPage, DrawError> {
        let frame_count = drawing.times().len();
        let mut colourings = drawing.colourings();
        let mut left_out = Vec::new();
        let mut count = frame_count.min(budget.frames.max(1));
        loop {
            let frames = evenly(frame_count, count);
            let mut packed = pack::pack(drawing, &frames, &colourings)?;
            let bytes = packed.bytes();
            if bytes > budget.bytes && count > 2 {
                count = (count as f64 * budget.bytes as f64 / bytes as f64) as usize;
                count = count.min(frames.len() - 1).max(2);
            } else if bytes > budget.bytes && colourings.len() > 1 {
                left_out = colourings.drain(1..).map(|colouring: Colouring| colouring.to_string()).collect();
            } else {
                packed.head["left_out"] = left_out.clone().into();
                let html = html::html(&packed, live);
                return Ok(ViewerPage { html, frames: frames.len(), frame_count, left_out });
            }
        }
    }
}

/// Every n-th of `total` frames, so that at most `count` remain.
fn evenly(total: usize, count: usize) -> Vec<usize> {
    (0..total).step_by(total.div_ceil(count.max(1)).max(1)).collect()
}
