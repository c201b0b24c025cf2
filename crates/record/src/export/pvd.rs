//! ParaView's collection: which file holds which time.

use std::io::{self, Write};

/// Writes a collection of `(time [s], file name)`, names relative to where the collection is.
///
/// # Errors
/// The stream cannot be written.
pub fn write_pvd(frames: &[(f64, String)], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(out, "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>")?;
    for (time, name) in frames {
        writeln!(out, "<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{}\"/>", escaped(name))?;
    }
    writeln!(out, "</Collection>\n</VTKFile>")
}

/// Text as the value of an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
