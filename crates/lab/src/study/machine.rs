//! Machine on which a study ran, and the part of it that the study used.

use pliant::lanes;

/// Provenance of the numbers: the program and the machine.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Provenance {
    /// Commit of the program's source.
    pub commit: String,
    /// Name of the machine.
    pub host: String,
    /// Model of its processor.
    pub cpu: String,
    /// Version of the compiler.
    pub rustc: String,
    /// Compiler flags, and the instruction set of the kernels.
    pub flags: String,
}

impl Provenance {
    /// Provenance on this machine, for a program of this commit, compiler and flags.
    pub fn here(commit: &str, rustc: &str, flags: &str) -> Provenance {
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let host = if host.trim().is_empty() { "unknown" } else { host.trim() };
        Provenance {
            commit: commit.to_owned(),
            host: host.to_owned(),
            cpu: crate::benchmark::processor(),
            rustc: rustc.to_owned(),
            flags: format!("{flags}; {}", lanes::level().name()),
        }
    }
}

/// Resets the peak of resident memory, if the system supports it.
pub(super) fn forget_peak() {
    // Linux: 5 resets VmHWM. Otherwise, or without permission, peaks are those of the whole study.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Peak of resident memory since the reset [MB].
pub(super) fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kilobytes * 1024e-6)
}
