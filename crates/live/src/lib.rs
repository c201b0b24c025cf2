//! A running scene in the page of [`pliant_view`]: a server that sends frames and takes commands.
//!
//! One port has the page and its socket, at a path with a random token. Frames wait in a slot of one, in
//! which the newest replaces the last; commands wait in a queue whose full state stops reading, so that none
//! is lost. Commands are executed between steps, by an [`Experiment`](pliant_scene::experiment::Experiment).
//!
//! # What is refused
//! | request | answer |
//! |---|---|
//! | another path or token | 404 |
//! | a `Host` that is not this server's (a name that was made to lead to loopback) | 421 |
//! | the socket, from a page of another origin or of none | 403 |
//! | the socket, while another page has it that reads | 409 |
//! | a head above 8 kB, or slower than 5 s | the connection ends |
//! | a message that is no command, or above 64 kB | an answer that says so; above 64 kB the socket ends |

mod error;
mod head;
mod outbox;
mod pace;
mod page;
mod protocol;
mod recording;
mod replay;
mod scratch;
mod server;
mod session;
mod token;

pub use error::LiveError;
pub use replay::replay;
pub use server::{LiveOptions, LiveServer, LiveSummary};
