//! Memory that the system could allocate now, if the system reports it (Linux): free memory, within the
//! limits of the control groups of the process and of its address space. Also memory that the process has
//! used.

use std::fs;
use std::path::{Path, PathBuf};

/// Mount point of control groups of the second version.
const GROUPS: &str = "/sys/fs/cgroup";

/// Bytes that could be allocated now; `None` if the system does not report it.
pub fn available() -> Option<u64> {
    available_beside(0)
}

/// Bytes that could be allocated besides `reserved` bytes, which are hardly touched and take address space
/// only.
pub fn available_beside(reserved: u64) -> Option<u64> {
    let read = |path: &str| fs::read_to_string(path).ok();
    let free = read("/proc/meminfo").and_then(|text| kibibytes(&text, "MemAvailable:"));
    let groups = read("/proc/self/cgroup").and_then(|text| of_groups(Path::new(GROUPS), &text));
    let address = read("/proc/self/limits").zip(read("/proc/self/status"));
    let address = address.and_then(|(limits, status)| of_address_space(&limits, &status));
    let address = of_webassembly().or(address).map(|left| left.saturating_sub(reserved));
    [free, groups, address].into_iter().flatten().min()
}

/// Bytes left of the four gigabytes that WebAssembly addresses; `None` elsewhere.
fn of_webassembly() -> Option<u64> {
    #[cfg(target_arch = "wasm32")]
    return Some((4_u64 << 30).saturating_sub((std::arch::wasm32::memory_size(0) as u64) << 16));
    #[cfg(not(target_arch = "wasm32"))]
    None
}

/// Peak resident set of this process [bytes]; `None` if the system does not report it.
pub fn peak() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Bytes of files that this process has in memory now, above all its own program, whose pages are read when
/// they first run. `None` if the system does not report it.
pub fn of_files() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "RssFile:")
}

/// The number of kB after `name`, in bytes.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.saturating_mul(1024))
}

/// Memory left by the control groups in `membership` and those above them; pages of files count as free,
/// because they can be dropped.
fn of_groups(root: &Path, membership: &str) -> Option<u64> {
    let second = membership.lines().find_map(|line| line.strip_prefix("0::"));
    let first = membership.lines().find_map(|line| line.split_once(":memory:").map(|(_, group)| group));
    let left = match (second, first) {
        (Some(group), _) => of_group(root, group, ["memory.max", "memory.current"], "inactive_file "),
        (None, Some(group)) => of_group(
            &root.join("memory"),
            group,
            ["memory.limit_in_bytes", "memory.usage_in_bytes"],
            "total_inactive_file ",
        ),
        (None, None) => None,
    };
    // In a container the group is the root of what is mounted.
    left.or_else(|| of_group(root, "/", ["memory.max", "memory.current"], "inactive_file "))
}

fn of_group(root: &Path, group: &str, [limit, used]: [&str; 2], file_pages: &str) -> Option<u64> {
    let mut directory: PathBuf = root.join(group.trim().trim_start_matches('/'));
    let mut least = None;
    while directory.starts_with(root) {
        let number = |name: &str| fs::read_to_string(directory.join(name)).ok()?.trim().parse::<u64>().ok();
        // A group without a limit says `max`.
        if let (Some(limit), Some(used)) = (number(limit), number(used)) {
            let pages = fs::read_to_string(directory.join("memory.stat")).unwrap_or_default();
            let pages = pages.lines().find_map(|line| line.strip_prefix(file_pages)?.trim().parse().ok());
            let left = limit.saturating_sub(used.saturating_sub(pages.unwrap_or(0)));
            least = Some(least.map_or(left, |least: u64| least.min(left)));
        }
        if !directory.pop() {
            break;
        }
    }
    least
}

/// Memory left by the limit of the address space (`ulimit -v`).
fn of_address_space(limits: &str, status: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(limit.saturating_sub(kibibytes(status, "VmSize:")?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Memory that is in use is at least what was just written, and what was given back still counts.
    #[cfg(target_os = "linux")]
    #[test]
    fn the_peak_is_that_of_pages_that_were_in_use() {
        let before = peak().unwrap();
        let written = vec![1u8; before as usize + (16 << 20)];
        let during = peak().unwrap();
        // The system counts pages of a thread in batches.
        assert!(during + (1 << 20) > written.len() as u64, "{during} of {}", written.len());
        drop(written);
        assert!(peak().unwrap() + (1 << 20) > during);
    }

    #[test]
    fn the_tightest_group_counts() {
        let root = tempfile::tempdir().unwrap();
        let inner = root.path().join("user/work");
        fs::create_dir_all(&inner).unwrap();
        let write = |directory: &Path, limit: &str, used: u64, pages: u64| {
            fs::write(directory.join("memory.max"), limit).unwrap();
            fs::write(directory.join("memory.current"), used.to_string()).unwrap();
            fs::write(directory.join("memory.stat"), format!("anon 1\ninactive_file {pages}\n")).unwrap();
        };
        write(&inner, "max\n", 70, 0);
        assert_eq!(of_groups(root.path(), "0::/user/work\n"), None, "no limit anywhere");
        write(&root.path().join("user"), "1000\n", 400, 50);
        assert_eq!(of_groups(root.path(), "0::/user/work\n"), Some(650));
        write(&inner, "100\n", 70, 10);
        assert_eq!(of_groups(root.path(), "0::/user/work\n"), Some(40));
        assert_eq!(of_groups(root.path(), "0::/elsewhere\n"), None);
        write(&inner, "100\n", 700, 10);
        assert_eq!(of_groups(root.path(), "0::/user/work\n"), Some(0), "more than allowed");
    }

    #[test]
    fn the_address_space_is_limited_by_ulimit() {
        let limits =
            |bytes: &str| format!("Max stack size  8388608\nMax address space  {bytes}  {bytes}  bytes\n");
        let status = "VmPeak:\t 900 kB\nVmSize:\t     100 kB\nVmRSS:\t 1 kB\n";
        assert_eq!(of_address_space(&limits("1024000"), status), Some(1_024_000 - 102_400));
        assert_eq!(of_address_space(&limits("1024"), status), Some(0));
        assert_eq!(of_address_space(&limits("unlimited"), status), None);
        assert_eq!(kibibytes("MemFree: 1 kB\nMemAvailable:    2 kB\n", "MemAvailable:"), Some(2048));
    }
}
