//! The limit on open files.

use super::finding::Finding;
use crate::descriptors::{connections_under, limits};
use jostle_server::limits::descriptors_spare;

/// Checks this process's limits for a server with this many connections and rooms.
pub fn look(connections: usize, rooms: usize) -> Finding {
    judge(limits(), connections, rooms)
}

/// Judges the soft and hard limits; `None` means unlimited. The server raises the soft limit itself.
fn judge(limits: Option<[Option<u64>; 2]>, connections: usize, rooms: usize) -> Finding {
    let needed = (connections + descriptors_spare(rooms)) as u64;
    let Some([soft, hard]) = limits else {
        return Finding::fine("open files", "this system has no limit");
    };
    let [shown_soft, shown_hard] = [soft, hard]
        .map(|limit| limit.map_or_else(|| "none".to_owned(), |limit| limit.to_string()));
    let found = format!(
        "soft limit {shown_soft}, hard limit {shown_hard}; {connections} connections need {needed}"
    );
    let connections = connections_under(hard.unwrap_or(u64::MAX), rooms);
    let change = format!(
        "raise the hard limit to {needed} (ulimit -Hn, or LimitNOFILE of the service); there can be {connections} \
         connections now"
    );
    Finding::judged("open files", found, hard.is_none_or(|hard| hard >= needed), change)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hard_limit_decides() {
        let needed = (4096 + descriptors_spare(64)) as u64;
        for fine in [None, Some([Some(1024), Some(needed)]), Some([Some(1024), None])] {
            assert!(judge(fine, 4096, 64).is_fine(), "{fine:?}");
        }
        let finding = judge(Some([Some(1024), Some(needed - 1)]), 4096, 64);
        assert!(finding.found.starts_with("soft limit 1024, hard limit "), "{finding}");
        let change = finding.change.expect("too few");
        assert!(
            change.contains(&format!("to {needed} ")) && change.contains(" 4095 conn"),
            "{change}"
        );
    }
}
