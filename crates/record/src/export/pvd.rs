//! Export as ParaView's collection: a list of times and files.

use std::io::{self, Write};

/// Writes a collection of `(time [s], file name)`; names are relative to the collection's directory.
///
/// # Errors
/// A write error of the stream.
pub fn write_pvd(frames: &[(f64, String)], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(out, "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>")?;
    for (time, name) in frames {
        writeln!(out, "<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{}\"/>", escaped(name))?;
    }
    writeln!(out, "</Collection>\n</VTKFile>")
}

/// Escapes text for the value of an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
