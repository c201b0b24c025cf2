//! Large vectors: what they hold, and how the system was asked for them.

use crate::lanes::{filled, with_room};

#[test]
fn vectors_of_any_size_hold_what_they_are_filled_with() {
    for count in [0, 1, 1000, 262_143, 262_144, 524_289, 1_500_000] {
        let numbers = filled(0.25, count);
        assert!(numbers.len() == count && numbers.iter().all(|n| *n == 0.25), "{count}");
        let mut numbers = with_room(count);
        assert!(numbers.is_empty() && numbers.capacity() >= count);
        numbers.extend(0..count);
        assert!(numbers.iter().copied().eq(0..count), "{count}");
    }
}

// The kernel says of each range of addresses whether huge pages were asked for: `hg` among its flags. One
// without them cannot.
#[test]
#[cfg(target_os = "linux")]
fn large_memory_is_asked_for_in_huge_pages() {
    if std::path::Path::new("/sys/kernel/mm/transparent_hugepage").exists() {
        let large: Vec<u8> = filled(1, 64 << 20);
        assert!(asked_for(&large[32 << 20]));
    }
}

#[cfg(target_os = "linux")]
fn asked_for(byte: &u8) -> bool {
    let address = std::ptr::from_ref(byte) as usize;
    let mut inside = false;
    for line in std::fs::read_to_string("/proc/self/smaps").unwrap().lines() {
        if let Some((start, end)) = line.split(' ').next().and_then(|range| range.split_once('-'))
            && let (Ok(start), Ok(end)) = (usize::from_str_radix(start, 16), usize::from_str_radix(end, 16))
        {
            inside = (start..end).contains(&address);
        } else if let (true, Some(flags)) = (inside, line.strip_prefix("VmFlags:")) {
            return flags.split_whitespace().any(|flag| flag == "hg");
        }
    }
    panic!("{address:x} is in no range of this process")
}
