//! Memory, as reported by Linux.

use super::finding::{Finding, megabytes};
use std::fs;

/// Memory per player in a full room of 16, bytes (see Load in docs/development.md).
const PLAYER_BYTES: u64 = 73 << 10;
/// Memory that the program uses with rooms open. Measurements showed 20 MB with one room for each of 24 scenes.
const PROGRAM_BYTES: u64 = 64 << 20;

/// Checks the free memory, within the container's limit if there is one, for a server with this many connections.
pub fn look(connections: usize) -> Finding {
    let read = |path: &str| fs::read_to_string(path).ok();
    let free = read("/proc/meminfo").and_then(|text| available(&text));
    let group = ["memory.max", "memory.current"].map(|file| {
        read(&format!("/sys/fs/cgroup/{file}")).and_then(|text| text.trim().parse().ok())
    });
    judge(free, group, connections as u64)
}

/// Judges the machine's free memory, and the container's limit and usage.
fn judge(free: Option<u64>, [limit, used]: [Option<u64>; 2], connections: u64) -> Finding {
    let left = limit.map(|limit| limit.saturating_sub(used.unwrap_or_default()));
    let Some(free) = free.into_iter().chain(left).min() else {
        return Finding::fine("memory", "unknown: this system does not tell it");
    };
    let needed = PROGRAM_BYTES + connections * PLAYER_BYTES;
    let [shown, all] = [free, needed].map(megabytes);
    let found = format!("{shown} are free; {connections} players take {all}");
    let spared = free.saturating_sub(PROGRAM_BYTES);
    let players = spared / PLAYER_BYTES;
    let change = format!("free {all}, or let --connections-max say {players}");
    Finding::judged("memory", found, free >= needed, change)
}

/// Number of bytes still available to programs.
fn available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smaller_of_machine_and_container_counts() {
        let (plenty, little) = (Some(4 << 30), Some(200 << 20));
        assert!(judge(plenty, [None, None], 4096).is_fine());
        assert!(judge(plenty, [plenty, Some(1 << 30)], 4096).is_fine());
        assert!(judge(None, [None, None], 4096).is_fine());
        for finding in
            [judge(little, [plenty, None], 4096), judge(plenty, [plenty, Some(4000 << 20)], 4096)]
        {
            let change = finding.change.expect("too little");
            assert!(
                change.starts_with("free 3") && change.contains("--connections-max"),
                "{change}"
            );
        }
    }

    #[test]
    fn the_line_is_found() {
        assert_eq!(available("MemTotal: 9 kB\nMemAvailable:   2048 kB\n"), Some(2 << 20));
        assert_eq!(available("MemTotal: 9 kB\n"), None);
    }
}
