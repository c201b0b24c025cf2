//! The file system; in a browser, which has none, [`memory`](crate::memory).

#[cfg(target_family = "wasm")]
pub use crate::memory::{
    MemoryFile as File, create_dir, create_new, exists, metadata, remove_dir_all, remove_file, rename,
    temp_dir,
};
#[cfg(not(target_family = "wasm"))]
pub use {
    std::env::temp_dir,
    std::fs::{File, create_dir, metadata, remove_dir_all, remove_file, rename},
};

/// Creates an empty file that must not exist.
///
/// # Errors
/// Errors of the system.
#[cfg(not(target_family = "wasm"))]
pub fn create_new(path: &std::path::Path) -> std::io::Result<File> {
    File::options().write(true).create_new(true).open(path)
}

/// True if there is something at `path`, as far as the system tells.
#[cfg(not(target_family = "wasm"))]
pub fn exists(path: &std::path::Path) -> bool {
    path.exists()
}
