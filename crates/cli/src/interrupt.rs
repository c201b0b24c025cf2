//! Ctrl-C, SIGTERM and SIGHUP: the first asks the run to end well, the second ends the program.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, OnceLock};

use crate::failure::{ExitStatus, Failure};

static INTERRUPTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// The flag that signals set. Signals are caught from the first call on.
///
/// # Errors
/// The system does not let the program catch them.
pub(crate) fn flag() -> Result<&'static Arc<AtomicBool>, Failure> {
    static RESULT: OnceLock<Result<(), String>> = OnceLock::new();
    let result = RESULT.get_or_init(|| ctrlc::set_handler(interrupt).map_err(|error| error.to_string()));
    match result {
        Ok(()) => Ok(&INTERRUPTED),
        Err(error) => Err(Failure::failed("signals", format!("cannot catch Ctrl-C: {error}"))),
    }
}

/// Runs on a thread of its own.
#[expect(clippy::exit, reason = "who asks twice does not want to wait for the file")]
fn interrupt() {
    if INTERRUPTED.swap(true, Ordering::Relaxed) {
        std::process::exit(i32::from(ExitStatus::Interrupted.code()));
    }
}
