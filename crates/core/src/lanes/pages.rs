//! Memory in huge pages.
//!
//! Arrays larger than the caches are read in order, some tens of megabytes a step. With pages of 4 KiB each
//! page needs an address translation, which takes as long in a virtual machine as loading its lines. One page
//! of 2 MiB replaces 512 of them. Operating systems provide huge pages on request.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;

/// Bytes of a huge page, and their alignment.
#[cfg(target_os = "linux")]
const HUGE: usize = 2 << 20;

/// An empty vector with room for `capacity` items, in huge pages if it is large enough and the system has
/// any.
pub fn with_room<T>(capacity: usize) -> Vec<T> {
    let mut items = Vec::with_capacity(capacity);
    ask_for_huge_pages(items.spare_capacity_mut());
    items
}

/// A vector of `count` copies of `item`, in huge pages likewise.
pub fn filled<T: Clone>(item: T, count: usize) -> Vec<T> {
    let mut items = with_room(count);
    items.resize(count, item);
    items
}

/// Requests huge pages for the part of `memory` that fills whole ones. Call it before the memory is written:
/// existing pages stay.
fn ask_for_huge_pages<T>(memory: &mut [MaybeUninit<T>]) {
    #[cfg(target_os = "linux")]
    {
        let bytes = size_of_val(memory);
        let start = memory.as_mut_ptr().cast::<u8>();
        let skipped = start.align_offset(HUGE);
        if skipped >= bytes || bytes - skipped < HUGE {
            return;
        }
        let length = (bytes - skipped) / HUGE * HUGE;
        // SAFETY: the range lies within `memory`, as `skipped + length <= bytes`, and begins at a page, as a
        // huge page does. The advice changes neither what is in it nor whether it can be read or written,
        // only in which pieces the system provides it. Systems that cannot follow it say so, and nothing is
        // lost.
        unsafe { libc::madvise(start.wrapping_add(skipped).cast(), length, libc::MADV_HUGEPAGE) };
    }
    #[cfg(not(target_os = "linux"))]
    let _ = memory;
}
