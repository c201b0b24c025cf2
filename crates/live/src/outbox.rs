//! Outgoing messages to the page.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use pliant_files::clock::Instant;

/// Number of waiting texts above which commands are no longer read.
const TEXTS: usize = 256;
/// Limit on waiting texts: a page that leaves more is disconnected.
const MOST_TEXTS: usize = 8 * TEXTS;
/// Time after which a page that does not receive yields to another one.
const YIELDS: Duration = Duration::from_secs(2);

/// Next message to be sent.
#[derive(Debug, PartialEq)]
pub(crate) enum Outgoing {
    Text(String),
    Frame(Vec<u8>),
    Pong(Vec<u8>),
}

#[derive(Default)]
struct Waiting {
    /// Replies and states, none of which is lost.
    texts: VecDeque<String>,
    /// The newest frame.
    frame: Option<Vec<u8>>,
    /// Newest answer to a ping, which supersedes older ones (RFC 6455, section 5.5.3).
    pong: Option<Vec<u8>>,
    /// Start time of the message being sent.
    sending: Option<Instant>,
    /// Number of the connected page, from 1; 0 if there is none.
    page: u64,
    pages: u64,
    closed: bool,
}

/// Messages for the connected page; dropped if there is none.
#[derive(Default)]
pub(crate) struct Outbox {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

impl Waiting {
    /// Takes a message, texts first.
    fn take(&mut self) -> Option<Outgoing> {
        let text = self.texts.pop_front().map(Outgoing::Text);
        let message = text.or_else(|| self.pong.take().map(Outgoing::Pong));
        let message = message.or_else(|| self.frame.take().map(Outgoing::Frame));
        self.sending = message.is_some().then(Instant::now);
        message
    }
}

impl Outbox {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Connects a page; `None` while another one is connected and receiving.
    pub(crate) fn connect(&self) -> Option<u64> {
        let mut waiting = self.lock();
        let yields = waiting.sending.is_some_and(|since| since.elapsed() > YIELDS);
        if waiting.closed || (waiting.page != 0 && !yields) {
            return None;
        }
        waiting.pages += 1;
        waiting.page = waiting.pages;
        waiting.texts.clear();
        (waiting.frame, waiting.pong, waiting.sending) = (None, None, None);
        self.changed.notify_all();
        Some(waiting.page)
    }

    /// Disconnects that page.
    pub(crate) fn disconnect(&self, page: u64) {
        let mut waiting = self.lock();
        if waiting.page == page {
            waiting.page = 0;
        }
        self.changed.notify_all();
    }

    /// Number of the connected page, from 1; 0 if there is none.
    pub(crate) fn page(&self) -> u64 {
        self.lock().page
    }

    /// Adds a text; disconnects a page with too many waiting ones.
    pub(crate) fn text(&self, text: String) {
        let mut waiting = self.lock();
        if waiting.page == 0 {
            return;
        }
        if waiting.texts.len() == MOST_TEXTS {
            waiting.page = 0;
            waiting.texts.clear();
        } else {
            waiting.texts.push_back(text);
        }
        self.changed.notify_all();
    }

    /// Replaces the waiting answer to a ping, if `page` is still connected.
    #[cfg(any(test, feature = "server"))]
    pub(crate) fn pong(&self, page: u64, data: Vec<u8>) {
        let mut waiting = self.lock();
        if waiting.page == page {
            waiting.pong = Some(data);
            self.changed.notify_all();
        }
    }

    /// Replaces the waiting frame.
    pub(crate) fn frame(&self, frame: Vec<u8>) {
        let mut waiting = self.lock();
        if waiting.page != 0 {
            waiting.frame = Some(frame);
            self.changed.notify_all();
        }
    }

    /// True if no frame is waiting.
    pub(crate) fn wants_frame(&self) -> bool {
        let waiting = self.lock();
        waiting.page != 0 && waiting.frame.is_none()
    }

    /// Takes a message to the page, texts first, if one is waiting.
    pub(crate) fn take(&self) -> Option<Outgoing> {
        self.lock().take()
    }

    /// Waits for a message to `page`, texts first; `None` once the page is gone.
    #[cfg(any(test, feature = "server"))]
    pub(crate) fn next(&self, page: u64) -> Option<Outgoing> {
        let mut waiting = self.lock();
        loop {
            if waiting.page != page {
                return None;
            }
            let message = waiting.take();
            if message.is_some() {
                self.changed.notify_all();
                return message;
            }
            if waiting.closed {
                return None;
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits until there is room for a reply to `page`; false once the page is gone.
    #[cfg(any(test, feature = "server"))]
    pub(crate) fn has_room(&self, page: u64) -> bool {
        let mut waiting = self.lock();
        while waiting.page == page && waiting.texts.len() >= TEXTS && !waiting.closed {
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
        waiting.page == page && !waiting.closed
    }

    /// Ends sending: no more messages from now on.
    #[cfg(any(test, feature = "server"))]
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
        (0..3).for_each(|i| outbox.pong(page, vec![i]));
        assert_eq!(outbox.next(page), Some(Outgoing::Pong(vec![2])));
        outbox.disconnect(page);
        assert_eq!((outbox.next(page), outbox.has_room(page)), (None, false));
        assert_eq!(outbox.connect(), Some(2));
    }

    #[test]
    fn a_page_that_does_not_read_is_gone() {
        let outbox = Outbox::default();
        let page = outbox.connect().unwrap();
        (0..=MOST_TEXTS).for_each(|i| outbox.text(i.to_string()));
        assert_eq!((outbox.page(), outbox.next(page)), (0, None));
        assert_eq!(outbox.connect(), Some(2));
        outbox.text("sent".into());
        outbox.next(2);
        assert_eq!(outbox.connect(), None);
        outbox.lock().sending = Instant::now().checked_sub(2 * YIELDS);
        assert_eq!((outbox.connect(), outbox.next(2)), (Some(3), None));
    }
}
