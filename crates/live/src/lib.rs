//! Live view of a running scene in the page of [`pliant_view`]: a server that sends frames and receives
//! commands.
//!
//! One port serves the page and its socket, at a path with a random token. Frames wait in a slot of one,
//! in which the newest replaces the last. Commands wait in a queue; when it is full, the server stops
//! reading, so that none is lost. An [`Experiment`](pliant_scene::experiment::Experiment) executes
//! commands between steps.
//!
//! Without the feature `server` an [`EmbeddedScene`] does the same for a program that carries the messages
//! itself, in one thread.
//!
//! # What is refused
//! | request | answer |
//! |---|---|
//! | another path or token | 404 |
//! | a `Host` that is not this server's (DNS rebinding to loopback) | 421 |
//! | the socket, from a page of another origin or none | 403 |
//! | the socket, while another page uses it | 409 |
//! | a head above 8 kB, or slower than 5 s | the connection ends |
//! | a message that is not a command, or above 64 kB | an error reply; above 1 MB the socket is closed |

mod embedded;
mod error;
#[cfg(feature = "server")]
mod head;
mod outbox;
mod pace;
mod page;
mod protocol;
mod recording;
mod replay;
mod scratch;
#[cfg(feature = "server")]
mod server;
mod session;
#[cfg(feature = "server")]
mod token;

pub use embedded::{EmbeddedScene, LiveMessage};
pub use error::LiveError;
pub use replay::replay;
#[cfg(feature = "server")]
pub use server::{LiveOptions, LiveServer, LiveSummary};
