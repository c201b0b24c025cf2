//! Encoding, compression and writing beside the run: frames are collected in batches, and a thread of its own does the rest while the
//! steps go on. Batches arrive in order, so the bytes of the file are those of one thread.
//!
//! A recording that never fills a batch never starts the thread. Frames that are large are not copied: the run waits for them.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mcap::McapResult;

use super::container::CHUNK_BYTES;
use super::desk::Desk;
use super::kept::{Batch, Needs, bytes_of};
use pliant::observer::Frame;

/// Bytes of frames after which a batch is handed over. Waking the thread takes some 20 us, as long as a hundred small frames take.
const BATCH_BYTES: usize = 1 << 17;
/// Batches that wait at most; then the run waits for the thread.
const WAITING: usize = 2;
/// Bytes from which on a frame is not copied.
const LARGE_BYTES: usize = CHUNK_BYTES as usize;

/// The thread, and the ways to it and back.
struct Helper {
    batches: SyncSender<Batch>,
    /// To be filled again.
    emptied: Receiver<Batch>,
    /// Of each batch that is urgent, whether its last frame is safe.
    safe: Receiver<bool>,
    /// Whether something could not be written.
    has_failed: Arc<AtomicBool>,
    thread: JoinHandle<Box<Desk>>,
}

/// Where the desk is.
enum Place {
    Here(Box<Desk>),
    There(Helper),
    /// Only while it is on its way.
    Nowhere,
}

/// A desk, sometimes in a thread of its own.
pub(super) struct Behind {
    place: Place,
    needs: Needs,
    /// What has not been handed over.
    batch: Batch,
    /// How long a frame may wait for the next one before it is made safe from a kill.
    patience: Duration,
    /// Frames that came until then are safe.
    safe_until: Instant,
    /// The same once the thread says so.
    asked_until: Option<Instant>,
}

impl Behind {
    pub(super) fn new(desk: Desk, patience: Duration) -> Self {
        Behind {
            needs: desk.needs(),
            place: Place::Here(Box::new(desk)),
            batch: Batch::default(),
            patience,
            safe_until: Instant::now(),
            asked_until: None,
        }
    }

    /// Takes a frame over that has all that the desk needs. When this returns, a kill cannot lose it, or what it can lose took no
    /// longer than the patience to compute.
    ///
    /// # Errors
    /// An earlier frame could not be written; it is in the journal, as all others before this one.
    pub(super) fn frame(&mut self, frame: &Frame<'_>) -> McapResult<()> {
        let has_failed = match &self.place {
            Place::Here(desk) => desk.has_failed(),
            Place::There(helper) => helper.has_failed.load(Ordering::Relaxed),
            Place::Nowhere => false,
        };
        if has_failed {
            return self.desk().map(|_| ());
        }
        let frame = self.needs.of(frame);
        if bytes_of(&frame) >= LARGE_BYTES {
            self.desk()?.frame(&frame, Some(&|| ()));
            self.safe_until = Instant::now();
            return Ok(());
        }
        self.batch.push(&frame);
        let now = Instant::now();
        self.listen(now)?;
        // Asked for early, so that nobody need wait.
        self.batch.is_urgent =
            self.asked_until.is_none() && now.duration_since(self.safe_until) >= self.patience / 2;
        let is_full = self.batch.bytes() >= BATCH_BYTES;
        if is_full {
            self.start();
        }
        if is_full || self.batch.is_urgent {
            self.hand_over(now)?;
        }
        self.listen(now)
    }

    /// The desk, after everything that was handed over.
    ///
    /// # Errors
    /// Something that was handed over could not be written.
    pub(super) fn desk(&mut self) -> McapResult<&mut Desk> {
        self.join();
        let Place::Here(desk) = &mut self.place else { unreachable!("it has been joined") };
        desk.take(&mut self.batch, &|| ());
        match desk.failure() {
            Some(error) => Err(error),
            None => Ok(desk),
        }
    }

    /// Number of frames that recovery finds, after [`frame`](Self::frame) or [`desk`](Self::desk) has failed.
    pub(super) fn salvage(&mut self) -> u64 {
        self.join();
        match &mut self.place {
            Place::Here(desk) => desk.salvage(),
            Place::There(_) | Place::Nowhere => unreachable!("it has been joined"),
        }
    }

    /// The desk, after everything that was handed over, for good.
    ///
    /// # Errors
    /// As [`desk`](Self::desk).
    pub(super) fn into_desk(mut self) -> McapResult<Desk> {
        self.desk()?;
        let Place::Here(desk) = std::mem::replace(&mut self.place, Place::Nowhere) else {
            unreachable!("it has just been here")
        };
        Ok(*desk)
    }

    /// Hands over what came until `now`.
    fn hand_over(&mut self, now: Instant) -> McapResult<()> {
        let is_urgent = self.batch.is_urgent;
        match &mut self.place {
            Place::There(helper) => {
                let empty = helper.emptied.try_recv().unwrap_or_default();
                let full = std::mem::replace(&mut self.batch, empty);
                if helper.batches.send(full).is_err() {
                    // It ends early only where it panics.
                    return self.desk().map(|_| ());
                }
                if is_urgent {
                    self.asked_until = Some(now);
                }
            }
            Place::Here(desk) => {
                desk.take(&mut self.batch, &|| ());
                if is_urgent {
                    self.safe_until = now;
                }
            }
            Place::Nowhere => unreachable!("it is on its way only while this waits"),
        }
        Ok(())
    }

    /// Hears what has become safe; waits for it where at `now` the patience has run out.
    fn listen(&mut self, now: Instant) -> McapResult<()> {
        let (Place::There(helper), Some(asked_until)) = (&self.place, self.asked_until) else {
            return Ok(());
        };
        let answer = if now.duration_since(self.safe_until) >= self.patience {
            helper.safe.recv().ok()
        } else {
            match helper.safe.try_recv() {
                Err(TryRecvError::Empty) => return Ok(()),
                answer => answer.ok(),
            }
        };
        if answer != Some(true) {
            return self.desk().map(|_| ());
        }
        (self.safe_until, self.asked_until) = (asked_until, None);
        Ok(())
    }

    /// Moves the desk into a thread, if the system has one.
    fn start(&mut self) {
        if !matches!(self.place, Place::Here(_)) {
            return;
        }
        let (batches, incoming) = sync_channel::<Batch>(WAITING);
        let (give_back, emptied) = sync_channel(WAITING + 1);
        let (tell, safe) = sync_channel(1);
        let has_failed = Arc::new(AtomicBool::new(false));
        let failed = has_failed.clone();
        // Sent once the thread exists, or it would be lost where there is none.
        let (hand_in, handed_in) = sync_channel::<Box<Desk>>(1);
        let work = move || {
            let mut desk = handed_in.recv().expect("the desk is sent as soon as the thread has started");
            for mut batch in incoming {
                let is_untold = Cell::new(batch.is_urgent);
                // Lost where the owner has come to wait for the end.
                let say = |is_safe| {
                    is_untold.set(false);
                    let _ = tell.send(is_safe);
                };
                desk.take(&mut batch, &|| say(true));
                if is_untold.get() {
                    say(false);
                }
                failed.store(desk.has_failed(), Ordering::Relaxed);
                // Where nobody takes it, it is dropped.
                let _ = give_back.try_send(batch);
            }
            desk
        };
        let Ok(thread) = std::thread::Builder::new().name("recording".to_owned()).spawn(work) else { return };
        if let Place::Here(desk) = std::mem::replace(&mut self.place, Place::Nowhere) {
            hand_in.send(desk).unwrap_or_else(|_| unreachable!("the thread waits for it"));
        }
        self.place = Place::There(Helper { batches, emptied, safe, has_failed, thread });
    }

    /// Waits for the thread, and takes the desk back.
    fn join(&mut self) {
        self.place = match std::mem::replace(&mut self.place, Place::Nowhere) {
            Place::There(Helper { batches, thread, .. }) => {
                // It ends when nothing can come any more.
                drop(batches);
                if let Some(asked_until) = self.asked_until.take() {
                    self.safe_until = asked_until;
                }
                Place::Here(thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            }
            place => place,
        };
    }
}

/// Whoever drops a recorder finds all of its frames.
impl Drop for Behind {
    fn drop(&mut self) {
        let desk = match std::mem::replace(&mut self.place, Place::Nowhere) {
            Place::There(Helper { batches, thread, .. }) => {
                drop(batches);
                // A panic there is no reason for a second one here.
                thread.join().ok()
            }
            Place::Here(desk) => Some(desk),
            Place::Nowhere => None,
        };
        if let Some(mut desk) = desk {
            desk.take(&mut self.batch, &|| ());
        }
    }
}
