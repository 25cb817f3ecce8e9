//! How much memory the machine gives.

use std::fs;
use std::path::Path;

/// Bytes of memory that the process may use: the machine's, or less where its control group or one around it has less, or the process
/// itself is held to less (`ulimit -v`, `ulimit -d`).
pub fn memory_bytes() -> Option<u64> {
    memory_bytes_below(Path::new("/"))
}

fn memory_bytes_below(root: &Path) -> Option<u64> {
    let read = |path: &Path| fs::read_to_string(root.join(path)).ok();
    let machine_bytes = read(Path::new("proc/meminfo")).and_then(|text| {
        let kib = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?.split_whitespace().next()?;
        Some(1024 * kib.parse::<u64>().ok()?)
    });
    let groups = read(Path::new("proc/self/cgroup")).unwrap_or_default();
    let limits = groups.lines().flat_map(|line| {
        let mut fields = line.splitn(3, ':');
        let (controllers, path) = (fields.nth(1).unwrap_or_default(), fields.next().unwrap_or_default());
        // The second version has all controllers in one tree; of the first the one for memory counts.
        let (tree, file) = match controllers {
            "" => ("sys/fs/cgroup", "memory.max"),
            _ if controllers.split(',').any(|name| name == "memory") => {
                ("sys/fs/cgroup/memory", "memory.limit_in_bytes")
            }
            _ => return Vec::new(),
        };
        // A container may see its own group as the root of the tree.
        let around = Path::new(path.trim_start_matches('/')).ancestors();
        let limit = |group: &Path| read(&Path::new(tree).join(group).join(file))?.trim().parse::<u64>().ok();
        around.filter_map(limit).collect()
    });
    let of_process = read(Path::new("proc/self/limits")).unwrap_or_default();
    let soft = |line: &str| {
        let values = ["Max address space", "Max data size"].iter().find_map(|name| line.strip_prefix(name))?;
        values.split_whitespace().next()?.parse::<u64>().ok()
    };
    limits.chain(of_process.lines().filter_map(soft)).chain(machine_bytes).min()
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
    fn the_least_of_machine_and_control_groups_counts() {
        assert_eq!(with("bare", &[MACHINE]), Some(16 << 30));
        let group = ("proc/self/cgroup", "0::/team/job\n");
        let (own, around) = ("sys/fs/cgroup/team/job/memory.max", "sys/fs/cgroup/team/memory.max");
        assert_eq!(with("unlimited", &[MACHINE, group, (own, "max\n")]), Some(16 << 30));
        assert_eq!(with("own", &[MACHINE, group, (own, "2147483648\n"), (around, "max\n")]), Some(2 << 30));
        assert_eq!(with("around", &[MACHINE, group, (own, "max\n"), (around, "1073741824\n")]), Some(1 << 30));
        let container = ("sys/fs/cgroup/memory.max", "536870912\n");
        assert_eq!(with("container", &[MACHINE, ("proc/self/cgroup", "0::/\n"), container]), Some(512 << 20));
        let first = ("proc/self/cgroup", "5:cpu,cpuacct:/\n4:memory:/docker/1\n");
        let limit = ("sys/fs/cgroup/memory/memory.limit_in_bytes", "268435456\n");
        assert_eq!(with("first-version", &[MACHINE, first, limit]), Some(256 << 20));
    }

    #[test]
    fn what_the_process_is_held_to_counts_as_well() {
        let limits = |data: &str, space: &str| {
            let head = "Limit                     Soft Limit           Hard Limit           Units     \n";
            format!(
                "{head}Max data size             {data}            unlimited            bytes     \nMax address space         {space}            unlimited            bytes     \n"
            )
        };
        for (name, data, space, expected) in [
            ("free", "unlimited", "unlimited", 16 << 30),
            ("space", "unlimited", "1073741824", 1 << 30),
            ("data", "536870912", "1073741824", 512 << 20),
        ] {
            assert_eq!(with(name, &[MACHINE, ("proc/self/limits", &limits(data, space))]), Some(expected));
        }
    }
}
