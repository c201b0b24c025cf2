//! Files that recordings are written to.

use std::fmt::Debug;
use std::io::{self, BufWriter, Seek, Write};

use pliant_files::disk::File;

/// Stream that can be synced to the disk. A trait, so that tests can simulate a full disk.
pub(super) trait Sink: Write + Seek + Send {
    /// Waits until everything written is on the disk.
    fn sync(&mut self) -> io::Result<()>;
}

/// File that is emptied and refilled.
pub(super) trait Tail: Write + Send + Debug {
    /// Discards everything written; the next byte is the first.
    fn empty(&mut self) -> io::Result<()>;

    /// Waits until everything written is on the disk.
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
