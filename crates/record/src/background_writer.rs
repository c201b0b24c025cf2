//! Background writer: encodes, compresses and writes in a thread of its own while the run continues.
//!
//! Frames are collected in batches, which arrive in order, so the file has the same bytes as with one
//! thread. A recording that never fills a batch never starts the thread. Large frames are not copied: the
//! run waits for them.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use mcap::McapResult;

use super::container::CHUNK_BYTES;
use super::frame_copy::{Batch, bytes_of};
use super::frame_encoder::FrameEncoder;
use pliant::observer::{Frame, Quantities};
use pliant_files::clock::Instant;

/// Bytes of frames after which a batch is handed over. Waking the thread takes about 20 us, as long as a
/// hundred small frames.
const BATCH_BYTES: usize = 1 << 17;
/// Limit on waiting batches; beyond it the run waits for the thread.
const WAITING: usize = 2;
/// Size from which on a frame is not copied [bytes].
pub(super) const LARGE_BYTES: usize = CHUNK_BYTES as usize;

/// Upper bound of the memory for frame copies that are not yet encoded [bytes]: waiting batches, one
/// being filled and one being emptied. `frame` is the size of a frame.
pub(super) fn waiting_bytes(frame: usize, frames: usize) -> usize {
    let batch = BATCH_BYTES.div_ceil(frame.max(1));
    frame.saturating_mul(frames.min(batch * (WAITING + 2)))
}

/// Writer thread with its queues.
struct WriterThread {
    batches: SyncSender<Batch>,
    /// Emptied batches for reuse.
    emptied: Receiver<Batch>,
    /// Acknowledgements: for each urgent batch, whether its last frame is durable.
    durable: Receiver<bool>,
    /// True if something could not be written.
    has_failed: Arc<AtomicBool>,
    thread: JoinHandle<Box<FrameEncoder>>,
}

/// Location of the encoder.
enum Worker {
    /// In the run's thread.
    Inline(Box<FrameEncoder>),
    Thread(WriterThread),
    /// Nowhere, while it moves between threads.
    Moving,
}

/// Encoder of a recording, moved to a thread of its own once there is enough work.
pub(super) struct BackgroundWriter {
    worker: Worker,
    quantities: Quantities,
    /// Frames not yet handed over.
    batch: Batch,
    /// Time that a frame may wait for the next one before it must survive a kill.
    max_loss: Duration,
    /// Frames that came until then are durable.
    durable_until: Instant,
    /// Value of `durable_until` once the thread has acknowledged it.
    pending_ack: Option<Instant>,
}

impl BackgroundWriter {
    pub(super) fn new(encoder: FrameEncoder, max_loss: Duration) -> Self {
        BackgroundWriter {
            quantities: encoder.quantities(),
            worker: Worker::Inline(Box::new(encoder)),
            batch: Batch::default(),
            max_loss,
            durable_until: Instant::now(),
            pending_ack: None,
        }
    }

    /// Takes a frame with all quantities of the encoder. After return, a kill loses at most frames that
    /// took no longer than the largest loss to compute.
    ///
    /// # Errors
    /// An earlier frame could not be written; it is in the journal, as are all others before this one.
    pub(super) fn frame(&mut self, frame: &Frame<'_>) -> McapResult<()> {
        let has_failed = match &self.worker {
            Worker::Inline(encoder) => encoder.has_failed(),
            Worker::Thread(thread) => thread.has_failed.load(Ordering::Relaxed),
            Worker::Moving => false,
        };
        if has_failed {
            return self.encoder().map(|_| ());
        }
        let frame = frame.only(self.quantities);
        if bytes_of(&frame) >= LARGE_BYTES {
            self.encoder()?.frame(&frame, Some(&|| ()));
            self.durable_until = Instant::now();
            return Ok(());
        }
        self.batch.push(&frame);
        let now = Instant::now();
        self.take_ack(now)?;
        // Requested early, so that the run need not wait.
        self.batch.is_urgent =
            self.pending_ack.is_none() && now.duration_since(self.durable_until) >= self.max_loss / 2;
        let is_full = self.batch.bytes() >= BATCH_BYTES;
        if is_full {
            self.start();
        }
        if is_full || self.batch.is_urgent {
            self.hand_over(now)?;
        }
        self.take_ack(now)
    }

    /// Returns the encoder, after everything handed over has been processed.
    ///
    /// # Errors
    /// Something handed over could not be written.
    pub(super) fn encoder(&mut self) -> McapResult<&mut FrameEncoder> {
        self.join();
        let Worker::Inline(encoder) = &mut self.worker else { unreachable!("it has been joined") };
        encoder.take(&mut self.batch, &|| ());
        match encoder.failure() {
            Some(error) => Err(error),
            None => Ok(encoder),
        }
    }

    /// Number of frames that recovery finds after [`frame`](Self::frame) or [`encoder`](Self::encoder)
    /// has failed.
    pub(super) fn salvage(&mut self) -> u64 {
        self.join();
        match &mut self.worker {
            Worker::Inline(encoder) => encoder.salvage(),
            Worker::Thread(_) | Worker::Moving => unreachable!("it has been joined"),
        }
    }

    /// Converts into the encoder, after everything handed over has been processed.
    ///
    /// # Errors
    /// The errors of [`encoder`](Self::encoder).
    pub(super) fn into_encoder(mut self) -> McapResult<FrameEncoder> {
        self.encoder()?;
        let Worker::Inline(encoder) = std::mem::replace(&mut self.worker, Worker::Moving) else {
            unreachable!("it has just been here")
        };
        Ok(*encoder)
    }

    /// Hands over the frames that came until `now`.
    fn hand_over(&mut self, now: Instant) -> McapResult<()> {
        let is_urgent = self.batch.is_urgent;
        match &mut self.worker {
            Worker::Thread(thread) => {
                let empty = thread.emptied.try_recv().unwrap_or_default();
                let full = std::mem::replace(&mut self.batch, empty);
                if thread.batches.send(full).is_err() {
                    // The thread ends early only if it panics.
                    return self.encoder().map(|_| ());
                }
                if is_urgent {
                    self.pending_ack = Some(now);
                }
            }
            Worker::Inline(encoder) => {
                encoder.take(&mut self.batch, &|| ());
                if is_urgent {
                    self.durable_until = now;
                }
            }
            Worker::Moving => unreachable!("it is on its way only while this waits"),
        }
        Ok(())
    }

    /// Takes the acknowledgement that frames are durable, if it has come. Waits for it if at `now` more
    /// than the largest loss is pending.
    fn take_ack(&mut self, now: Instant) -> McapResult<()> {
        let (Worker::Thread(thread), Some(pending_ack)) = (&self.worker, self.pending_ack) else {
            return Ok(());
        };
        let answer = if now.duration_since(self.durable_until) >= self.max_loss {
            thread.durable.recv().ok()
        } else {
            match thread.durable.try_recv() {
                Err(TryRecvError::Empty) => return Ok(()),
                answer => answer.ok(),
            }
        };
        if answer != Some(true) {
            return self.encoder().map(|_| ());
        }
        (self.durable_until, self.pending_ack) = (pending_ack, None);
        Ok(())
    }

    /// Moves the encoder into a thread, if one can be created.
    fn start(&mut self) {
        if !matches!(self.worker, Worker::Inline(_)) {
            return;
        }
        // Queues.
        let (batches, incoming) = sync_channel::<Batch>(WAITING);
        let (give_back, emptied) = sync_channel(WAITING + 1);
        let (acknowledge, durable) = sync_channel(1);
        let has_failed = Arc::new(AtomicBool::new(false));
        let failed = has_failed.clone();
        // Sent once the thread exists, otherwise it would be lost.
        let (hand_in, handed_in) = sync_channel::<Box<FrameEncoder>>(1);
        let work = move || {
            let mut encoder =
                handed_in.recv().expect("the encoder is sent as soon as the thread has started");
            for mut batch in incoming {
                let is_pending = Cell::new(batch.is_urgent);
                // Lost if the owner is already waiting for the end.
                let acknowledge_once = |is_durable| {
                    is_pending.set(false);
                    let _ = acknowledge.send(is_durable);
                };
                encoder.take(&mut batch, &|| acknowledge_once(true));
                if is_pending.get() {
                    acknowledge_once(false);
                }
                failed.store(encoder.has_failed(), Ordering::Relaxed);
                // Dropped if the run has gone.
                let _ = give_back.try_send(batch);
            }
            encoder
        };
        // The thread, which then gets the encoder.
        let Ok(thread) = std::thread::Builder::new().name("recording".to_owned()).spawn(work) else { return };
        if let Worker::Inline(encoder) = std::mem::replace(&mut self.worker, Worker::Moving) {
            hand_in.send(encoder).unwrap_or_else(|_| unreachable!("the thread waits for it"));
        }
        self.worker = Worker::Thread(WriterThread { batches, emptied, durable, has_failed, thread });
    }

    /// Waits for the thread and takes the encoder back.
    fn join(&mut self) {
        self.worker = match std::mem::replace(&mut self.worker, Worker::Moving) {
            Worker::Thread(WriterThread { batches, thread, .. }) => {
                // The thread ends once no batch can arrive.
                drop(batches);
                if let Some(pending_ack) = self.pending_ack.take() {
                    self.durable_until = pending_ack;
                }
                Worker::Inline(thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            }
            worker => worker,
        };
    }
}

/// Dropping writes all frames.
impl Drop for BackgroundWriter {
    fn drop(&mut self) {
        let encoder = match std::mem::replace(&mut self.worker, Worker::Moving) {
            Worker::Thread(WriterThread { batches, thread, .. }) => {
                drop(batches);
                // A panic of the thread is not repeated here.
                thread.join().ok()
            }
            Worker::Inline(encoder) => Some(encoder),
            Worker::Moving => None,
        };
        if let Some(mut encoder) = encoder {
            encoder.take(&mut self.batch, &|| ());
        }
    }
}
