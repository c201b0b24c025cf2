//! Messages on their way to the page.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Texts that may wait before commands are no longer read.
const TEXTS: usize = 256;

/// Message that is sent next.
#[derive(Debug, PartialEq)]
pub(crate) enum Outgoing {
    Text(String),
    Frame(Vec<u8>),
    Pong(Vec<u8>),
}

#[derive(Default)]
struct Waiting {
    /// Replies and states: none is lost.
    texts: VecDeque<Outgoing>,
    /// The newest frame.
    frame: Option<Vec<u8>>,
    /// Number of the page that is connected, from 1; 0 without one.
    page: u64,
    pages: u64,
    closed: bool,
}

/// Messages for the page that is connected; without one they are dropped.
#[derive(Default)]
pub(crate) struct Outbox {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

impl Outbox {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins for a page; `None` while another one is connected.
    pub(crate) fn connect(&self) -> Option<u64> {
        let mut waiting = self.lock();
        if waiting.page != 0 || waiting.closed {
            return None;
        }
        waiting.pages += 1;
        waiting.page = waiting.pages;
        waiting.texts.clear();
        waiting.frame = None;
        Some(waiting.page)
    }

    /// Ends for that page.
    pub(crate) fn disconnect(&self, page: u64) {
        let mut waiting = self.lock();
        if waiting.page == page {
            waiting.page = 0;
        }
        self.changed.notify_all();
    }

    /// Number of the page that is connected, from 1; 0 without one.
    pub(crate) fn page(&self) -> u64 {
        self.lock().page
    }

    pub(crate) fn text(&self, text: String) {
        self.push(Outgoing::Text(text));
    }

    pub(crate) fn push(&self, message: Outgoing) {
        let mut waiting = self.lock();
        if waiting.page != 0 {
            waiting.texts.push_back(message);
            self.changed.notify_all();
        }
    }

    /// Replaces the frame that waits.
    pub(crate) fn frame(&self, frame: Vec<u8>) {
        let mut waiting = self.lock();
        if waiting.page != 0 {
            waiting.frame = Some(frame);
            self.changed.notify_all();
        }
    }

    /// True while no frame waits: the last was taken.
    pub(crate) fn wants_frame(&self) -> bool {
        let waiting = self.lock();
        waiting.page != 0 && waiting.frame.is_none()
    }

    /// Waits for a message to `page`, texts first; `None` once it is gone.
    pub(crate) fn next(&self, page: u64) -> Option<Outgoing> {
        let mut waiting = self.lock();
        loop {
            if waiting.page != page {
                return None;
            }
            if let Some(message) = waiting.texts.pop_front() {
                self.changed.notify_all();
                return Some(message);
            }
            if let Some(frame) = waiting.frame.take() {
                return Some(Outgoing::Frame(frame));
            }
            if waiting.closed {
                return None;
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits until there is room for an answer to `page`; false once it is gone.
    pub(crate) fn has_room(&self, page: u64) -> bool {
        let mut waiting = self.lock();
        while waiting.page == page && waiting.texts.len() >= TEXTS && !waiting.closed {
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
        waiting.page == page && !waiting.closed
    }

    /// No more messages from now on.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_frame_replaces_the_last_and_no_text_is_lost() {
        let outbox = Outbox::default();
        outbox.text("before".into());
        let page = outbox.connect().unwrap();
        assert!(outbox.connect().is_none());
        (0..3).for_each(|i| outbox.frame(vec![i]));
        (0..3).for_each(|i| outbox.text(i.to_string()));
        let texts = (0..3).map(|i| Outgoing::Text(i.to_string()));
        for expected in texts.chain([Outgoing::Frame(vec![2])]) {
            assert_eq!(outbox.next(page), Some(expected));
        }
        outbox.disconnect(page);
        assert_eq!((outbox.next(page), outbox.has_room(page)), (None, false));
        assert_eq!(outbox.connect(), Some(2));
    }
}
