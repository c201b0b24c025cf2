//! Compression beside the run: messages are collected in batches, and a thread of its own compresses and writes them while the
//! steps go on. Batches arrive in order and end where the messages say, so the bytes of the file are those of one thread.
//!
//! The thread lives for one chunk at most: a chunk is closed by its owner, who waits for the thread first. A recording that never
//! fills a batch never starts one.

use std::io::{Seek, Write};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use mcap::records::MessageHeader;
use mcap::{McapResult, Writer};

use super::container::Message;

/// Message bytes after which a batch is handed over: some ten times the work of waking a thread.
const BATCH_BYTES: usize = 1 << 16;
/// Batches that wait at most; then the run waits for the thread.
const WAITING: usize = 2;

/// Messages in the order in which they are to be written.
#[derive(Default)]
struct Batch {
    /// Headers, and the lengths of what belongs to them in `bytes`.
    headers: Vec<(MessageHeader, usize)>,
    bytes: Vec<u8>,
}

impl Batch {
    fn push(&mut self, group: &[Message<'_>]) {
        for Message { header, data } in group {
            self.headers.push((*header, data.len()));
            self.bytes.extend_from_slice(data);
        }
    }

    fn write_to<W: Write + Seek>(&mut self, writer: &mut Writer<W>) -> McapResult<()> {
        let mut rest = self.bytes.as_slice();
        for (header, length) in self.headers.drain(..) {
            let (data, after) = rest.split_at(length);
            rest = after;
            writer.write_to_known_channel(&header, data)?;
        }
        self.bytes.clear();
        Ok(())
    }
}

/// The thread, and the ways to it and back.
struct Helper<W: Write + Seek> {
    batches: SyncSender<Batch>,
    /// To be filled again.
    emptied: Receiver<Batch>,
    thread: JoinHandle<(Box<Writer<W>>, McapResult<()>)>,
}

/// Where the writer is.
enum Place<W: Write + Seek> {
    Here(Box<Writer<W>>),
    There(Helper<W>),
    /// Only while it is on its way.
    Nowhere,
}

/// A writer, sometimes in a thread of its own.
pub(super) struct Behind<W: Write + Seek + Send + 'static> {
    place: Place<W>,
    /// What has not been handed over.
    batch: Batch,
}

impl<W: Write + Seek + Send + 'static> Behind<W> {
    pub(super) fn new(writer: Writer<W>) -> Self {
        Behind { place: Place::Here(Box::new(writer)), batch: Batch::default() }
    }

    /// Takes messages over, to be written some time before [`writer`](Self::writer) returns.
    ///
    /// # Errors
    /// Messages of an earlier call could not be written.
    pub(super) fn push(&mut self, group: &[Message<'_>]) -> McapResult<()> {
        self.batch.push(group);
        if self.batch.bytes.len() >= BATCH_BYTES { self.hand_over() } else { Ok(()) }
    }

    /// The writer, after everything that was pushed.
    ///
    /// # Errors
    /// Something that was pushed could not be written.
    pub(super) fn writer(&mut self) -> McapResult<&mut Writer<W>> {
        let written = self.join();
        let Place::Here(writer) = &mut self.place else { unreachable!("it has been joined") };
        written?;
        self.batch.write_to(writer)?;
        Ok(writer)
    }

    /// The stream, after the end of the file.
    ///
    /// # Errors
    /// It could not be written.
    pub(super) fn finish(mut self) -> McapResult<W> {
        self.writer()?.finish()?;
        let Place::Here(writer) = std::mem::replace(&mut self.place, Place::Nowhere) else {
            unreachable!("it has just been here")
        };
        Ok(writer.into_inner())
    }

    fn hand_over(&mut self) -> McapResult<()> {
        self.start();
        let Place::There(helper) = &self.place else {
            // No thread to be had: then here.
            return self.writer().map(|_| ());
        };
        let empty = helper.emptied.try_recv().unwrap_or_default();
        let full = std::mem::replace(&mut self.batch, empty);
        if helper.batches.send(full).is_ok() {
            return Ok(());
        }
        // It ends early only where it could not write.
        self.join()
    }

    /// Moves the writer into a thread, if the system has one.
    fn start(&mut self) {
        if !matches!(self.place, Place::Here(_)) {
            return;
        }
        let (batches, incoming) = sync_channel::<Batch>(WAITING);
        let (give_back, emptied) = sync_channel(WAITING + 1);
        // Sent once the thread exists, or it would be lost where there is none.
        let (hand_in, handed_in) = sync_channel::<Box<Writer<W>>>(1);
        let work = move || {
            let mut writer = handed_in.recv().expect("the writer is sent as soon as the thread has started");
            for mut batch in incoming {
                if let Err(error) = batch.write_to(&mut writer) {
                    return (writer, Err(error));
                }
                // Where nobody takes it, it is dropped.
                let _ = give_back.try_send(batch);
            }
            (writer, Ok(()))
        };
        let Ok(thread) = std::thread::Builder::new().name("recording".to_owned()).spawn(work) else { return };
        if let Place::Here(writer) = std::mem::replace(&mut self.place, Place::Nowhere) {
            hand_in.send(writer).unwrap_or_else(|_| unreachable!("the thread waits for it"));
        }
        self.place = Place::There(Helper { batches, emptied, thread });
    }

    /// Waits for the thread, and takes the writer back.
    fn join(&mut self) -> McapResult<()> {
        match std::mem::replace(&mut self.place, Place::Nowhere) {
            Place::There(Helper { batches, thread, .. }) => {
                // It ends when nothing can come any more.
                drop(batches);
                let (writer, written) =
                    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                self.place = Place::Here(writer);
                written
            }
            other => {
                self.place = other;
                Ok(())
            }
        }
    }
}

/// Whoever drops a recorder finds its file closed.
impl<W: Write + Seek + Send + 'static> Drop for Behind<W> {
    fn drop(&mut self) {
        if let Place::There(Helper { batches, thread, .. }) =
            std::mem::replace(&mut self.place, Place::Nowhere)
        {
            drop(batches);
            // What it has not written is in the journal, and a panic there is no reason for a second one here.
            let _ = thread.join();
        }
    }
}
