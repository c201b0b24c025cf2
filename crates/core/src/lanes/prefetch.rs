//! Prefetching of memory.
#![allow(unsafe_code)]

/// Bytes of a cache line.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;

/// Prefetches item `index`, if there is one, so that it is in the cache some hundred nanoseconds later.
/// Processors detect sequential reads, but not beyond the end of a page, and not in strings of short runs.
#[inline(always)]
pub fn prefetch<T>(items: &[T], index: usize) {
    if let Some(item) = items.get(index) {
        prefetch_all(std::slice::from_ref(item));
    }
}

/// Prefetches all of these.
#[inline(always)]
pub fn prefetch_all<T>(items: &[T]) {
    #[cfg(target_arch = "x86_64")]
    ask::<{ std::arch::x86_64::_MM_HINT_T0 }, T>(items);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = items;
}

/// Prefetches like [`prefetch`], but into the second-level cache: for items needed so late that they would
/// not stay in the first. The first has room for a few tens of outstanding lines, and stalls beyond.
#[inline(always)]
pub fn prefetch_early<T>(items: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(item) = items.get(index) {
        ask::<{ std::arch::x86_64::_MM_HINT_T1 }, T>(std::slice::from_ref(item));
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, index);
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn ask<const HINT: i32, T>(items: &[T]) {
    for offset in (0..size_of_val(items)).step_by(LINE) {
        // SAFETY: every processor of this architecture has the instruction; it reads nothing that the
        // program could see, and never faults. The address is within `items`.
        unsafe { std::arch::x86_64::_mm_prefetch::<HINT>(items.as_ptr().cast::<i8>().wrapping_add(offset)) };
    }
}
