//! Files that recordings are written to.

use std::fmt::Debug;
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};

/// A stream that can make its content permanent. A trait, so that tests can fill the disk.
pub(super) trait Sink: Write + Seek + Send {
    /// Returns when everything written is on the disk.
    fn sync(&mut self) -> io::Result<()>;
}

/// A file that is emptied and filled again.
pub(super) trait Tail: Write + Send + Debug {
    /// Forgets everything written; the next byte is the first.
    fn empty(&mut self) -> io::Result<()>;

    /// Returns when everything written is on the disk.
    fn sync(&mut self) -> io::Result<()>;
}

impl Tail for File {
    fn empty(&mut self) -> io::Result<()> {
        self.set_len(0)?;
        self.rewind()
    }

    fn sync(&mut self) -> io::Result<()> {
        self.sync_all()
    }
}

impl Sink for BufWriter<File> {
    fn sync(&mut self) -> io::Result<()> {
        self.flush()?;
        self.get_ref().sync_all()
    }
}
