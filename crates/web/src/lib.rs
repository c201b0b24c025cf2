//! Running scenes in a browser: the page of `pliant live`, with this library in a Worker in the place of the
//! server.
//!
//! The library does what [`EmbeddedScene`](pliant_live::EmbeddedScene) does, one experiment at a time, behind
//! functions that JavaScript calls; texts and bytes go through its memory.
//!
//! | export | meaning |
//! |---|---|
//! | `alloc(len)`, `release(ptr, len)` | memory for what comes in |
//! | `file(name, name_len, data, data_len)` | a file that scenes may name, kept until `forget_files()` |
//! | `open(scene, len)` | 0: the experiment of this TOML text runs, the result is the HTML of its page; 1: the result is `{"message", "line", "column", "rendered"}` |
//! | `greet()` | a page has connected: the first messages to it are waiting |
//! | `command(text, len)` | a message of the page, JSON |
//! | `advance()` | executes commands and takes steps for about 12 ms; milliseconds until it wants to be called again |
//! | `message()` | takes the next message to the page: 0 none, 1 the result is a text, 2 a frame |
//! | `download()` | 0: the result is the MCAP file of the run so far; 1: a text says why not |
//! | `run(steps)` | for tests, steps without a page: 0, or 1 and the result is a text |
//! | `positions()`, `positions_len()` | the positions after `run`, numbers of 64 bits |
//! | `result()`, `result_len()` | the result of the last call |
//!
//! It imports `env.now()`: milliseconds of a clock that never goes back. A panic leaves its text in the
//! result before it traps; afterwards the instance must not be used.

#[cfg(target_family = "wasm")]
pub mod exports;
