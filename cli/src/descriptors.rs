//! The limit on file descriptors, since each connection takes one. The limit is raised as far as the system allows. If
//! that is not enough for all connections, fewer are accepted, so that rooms, files and operators keep theirs.

use jostle_server::limits::descriptors_spare;
use tracing::warn;

/// Raises the limit, and returns how many of the `wanted` connections it allows at once alongside this many rooms.
pub fn connections_max(wanted: usize, rooms: usize) -> usize {
    let Some(descriptors) = raised() else { return wanted };
    let connections = connections_under(descriptors, rooms).min(wanted);
    if connections < wanted {
        warn!(
            descriptors,
            connections,
            "the limit on open files (ulimit -Hn) allows fewer connections than {wanted}; raise it to {}",
            wanted + descriptors_spare(rooms)
        );
    }
    connections
}

/// Number of connections allowed at once with this many descriptors: at least a quarter of them.
pub fn connections_under(descriptors: u64, rooms: usize) -> usize {
    let descriptors = usize::try_from(descriptors).unwrap_or(usize::MAX);
    let spared = descriptors.saturating_sub(descriptors_spare(rooms));
    spared.max(descriptors / 4).max(1)
}

/// The soft and hard limits, each `None` if unlimited; `None` on systems without such limits.
#[cfg(unix)]
pub fn limits() -> Option<[Option<u64>; 2]> {
    let limit = rustix::process::getrlimit(rustix::process::Resource::Nofile);
    Some([limit.current, limit.maximum])
}

#[cfg(not(unix))]
pub fn limits() -> Option<[Option<u64>; 2]> {
    None
}

/// Raises the soft limit to the hard one, and returns the resulting limit; `None` if unlimited.
#[cfg(unix)]
fn raised() -> Option<u64> {
    use rustix::process::{Resource, getrlimit, setrlimit};
    let mut limit = getrlimit(Resource::Nofile);
    let before = limit.current;
    limit.current = limit.maximum;
    match setrlimit(Resource::Nofile, limit) {
        Ok(()) => limit.maximum,
        Err(_) => before,
    }
}

#[cfg(not(unix))]
fn raised() -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_leave_descriptors_for_everything_else() {
        let (rooms, more) = (64, 1000);
        let enough = (4096 + descriptors_spare(rooms)) as u64;
        assert_eq!(connections_under(enough, rooms), 4096);
        assert_eq!(connections_under(enough - 1, rooms), 4095);
        assert_eq!(connections_under(enough, more), 4096 - 2 * (more - rooms));
        assert_eq!(connections_under(1024, rooms), 1024 - descriptors_spare(rooms));
        assert_eq!(connections_under(256, rooms), 64);
        assert_eq!(connections_under(0, rooms), 1);
    }

    #[cfg(unix)]
    #[test]
    fn the_limit_is_raised_to_the_hard_one() {
        use rustix::process::{Resource, getrlimit};
        assert_eq!(raised(), getrlimit(Resource::Nofile).maximum);
        assert_eq!(getrlimit(Resource::Nofile).current, getrlimit(Resource::Nofile).maximum);
    }
}
