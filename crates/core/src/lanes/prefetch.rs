//! Prefetching of memory.
#![allow(unsafe_code)]

/// Bytes that come at once.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;

/// Asks for item `index`, if there is one, so that it is in the cache some hundred nanoseconds later.
/// Processors see for themselves what is read in order, but not beyond the end of a page, and not where
/// short runs are strung together.
#[inline(always)]
pub fn prefetch<T>(items: &[T], index: usize) {
    if let Some(item) = items.get(index) {
        prefetch_all(std::slice::from_ref(item));
    }
}

/// Asks for all of these.
#[inline(always)]
pub fn prefetch_all<T>(items: &[T]) {
    #[cfg(target_arch = "x86_64")]
    ask::<{ std::arch::x86_64::_MM_HINT_T0 }, T>(items);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = items;
}

/// As [`prefetch`], but into the second cache: for what is asked for so early that it would not stay in the
/// first. That has room for a few tens of lines on their way, and waits where there are more.
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
