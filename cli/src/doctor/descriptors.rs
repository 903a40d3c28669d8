//! The limit on open files.

use super::finding::Finding;
use crate::descriptors::{connections_under, limits};
use jostle_server::limits::{CONNECTIONS_MAX, DESCRIPTORS_SPARE};

/// Looks at the limits of this process.
pub fn look() -> Finding {
    judge(limits())
}

/// Judges the soft and the hard limit; `None` is no limit. The server raises the soft one itself.
fn judge(limits: Option<[Option<u64>; 2]>) -> Finding {
    let needed = (CONNECTIONS_MAX + DESCRIPTORS_SPARE) as u64;
    let Some([soft, hard]) = limits else {
        return Finding::fine("open files", "this system has no limit");
    };
    let [shown_soft, shown_hard] = [soft, hard]
        .map(|limit| limit.map_or_else(|| "none".to_owned(), |limit| limit.to_string()));
    let found = format!("soft limit {shown_soft}, hard limit {shown_hard}; {needed} are needed");
    let connections = connections_under(hard.unwrap_or(u64::MAX));
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
        let needed = (CONNECTIONS_MAX + DESCRIPTORS_SPARE) as u64;
        for fine in [None, Some([Some(1024), Some(needed)]), Some([Some(1024), None])] {
            assert!(judge(fine).is_fine(), "{fine:?}");
        }
        let finding = judge(Some([Some(1024), Some(needed - 1)]));
        assert!(finding.found.starts_with("soft limit 1024, hard limit "), "{finding}");
        let change = finding.change.expect("too few");
        assert!(
            change.contains(&format!("to {needed} ")) && change.contains(" 4095 conn"),
            "{change}"
        );
    }
}
