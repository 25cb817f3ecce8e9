//! Memory and cores that this process may use.

use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;

/// Cores that this process may use: the minimum of machine, affinity mask and control group.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

/// Bytes of memory that this process may use: the machine's, or the limit of its control group if that is lower.
pub fn memory_bytes() -> Option<u64> {
    memory_bytes_below(Path::new("/"))
}

fn memory_bytes_below(root: &Path) -> Option<u64> {
    let read = |path: &Path| fs::read_to_string(root.join(path)).ok();
    let machine_bytes = read(Path::new("proc/meminfo")).and_then(|text| {
        let kib = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?.split_whitespace().next()?;
        Some(1024 * kib.parse::<u64>().ok()?)
    });
    let group = read(Path::new("proc/self/cgroup")).unwrap_or_default();
    let path = group.lines().find_map(|line| line.strip_prefix("0::")).unwrap_or("/");
    // A limit of a parent group counts too. A container sees its own group as the root.
    let groups = Path::new(path.trim_start_matches('/')).ancestors();
    let limit = |group: &Path| {
        let file = Path::new("sys/fs/cgroup").join(group).join("memory.max");
        read(&file)?.trim().parse::<u64>().ok()
    };
    // In cgroup version 1 a container sees its own limit here.
    let first = read(Path::new("sys/fs/cgroup/memory/memory.limit_in_bytes")).and_then(|text| text.trim().parse().ok());
    groups.filter_map(limit).chain(machine_bytes).chain(first).min()
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::memory_bytes_below;

    fn with(name: &str, files: &[(&str, &str)]) -> Option<u64> {
        let root = std::env::temp_dir().join(format!("toothwave-memory-{name}-{}", std::process::id()));
        for (path, text) in files {
            let path = root.join(path);
            fs::create_dir_all(path.parent().unwrap_or(Path::new("/"))).expect("a folder of the test");
            fs::write(path, text).expect("a file of the test");
        }
        let found = memory_bytes_below(&root);
        fs::remove_dir_all(&root).expect("the test's own folder");
        found
    }

    const MACHINE: (&str, &str) = ("proc/meminfo", "MemTotal:       16777216 kB\nMemFree: 1 kB\n");

    #[test]
    fn lowest_memory_limit_counts() {
        assert_eq!(with("bare", &[MACHINE]), Some(16 << 30));
        let group = ("proc/self/cgroup", "0::/team/job\n");
        let (own, around) = ("sys/fs/cgroup/team/job/memory.max", "sys/fs/cgroup/team/memory.max");
        assert_eq!(with("unlimited", &[MACHINE, group, (own, "max\n")]), Some(16 << 30));
        assert_eq!(with("own", &[MACHINE, group, (own, "2147483648\n"), (around, "max\n")]), Some(2 << 30));
        assert_eq!(with("around", &[MACHINE, group, (own, "max\n"), (around, "1073741824\n")]), Some(1 << 30));
        let container = ("sys/fs/cgroup/memory.max", "536870912\n");
        assert_eq!(with("container", &[MACHINE, ("proc/self/cgroup", "0::/\n"), container]), Some(512 << 20));
        let first = ("sys/fs/cgroup/memory/memory.limit_in_bytes", "268435456\n");
        assert_eq!(with("first-version", &[MACHINE, first]), Some(256 << 20));
    }
}
