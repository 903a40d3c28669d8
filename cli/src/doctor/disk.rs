//! The disks used by `--state` and `--replays`.

use super::finding::{Finding, megabytes};
use jostle_server::limits::STATE_SYNC_EVERY;
use jostle_server::log::StateDir;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Free bytes needed for the state directory: a megabyte for each of two files per room, for 64 scenes and 64 rooms.
/// Measurements showed up to 36 kB for a room with one player.
const STATE_BYTES: u64 = 256 << 20;
/// Maximum acceptable time for a sync: eight busy rooms can be synced one after another within the sync interval.
const SYNC_MAX: Duration = STATE_SYNC_EVERY.checked_div(8).expect("eight is not zero");
/// Number of syncs measured. The median is used, since other programs use the disk too.
const SYNCS: usize = 9;
/// Number of bytes written before each sync: as many as a busy room adds in half a second.
const SYNC_BYTES: usize = 8 << 10;

/// A directory's state.
#[derive(Debug)]
struct Disk {
    /// The directory, or the one in which it would be created.
    place: PathBuf,
    is_missing: bool,
    /// `None` if the system does not report it.
    free_bytes: Option<u64>,
    /// Median time for a sync, or the error if a write failed.
    sync: io::Result<Duration>,
}

/// Checks a state directory; `is_synced` says whether its files are synced to the disk.
pub fn look_at_state(dir: &Path, is_synced: bool) -> Finding {
    match StateDir::is_in_use(dir) {
        Ok(false) => judge("--state", &Disk::of(dir), STATE_BYTES, is_synced),
        Ok(true) => Finding::change(
            "--state",
            format!("{}: another server uses it", dir.display()),
            "give each server a directory of its own, unless that is this server",
        ),
        Err(error) => unusable("--state", dir, &error),
    }
}

/// Checks a replay directory that may grow to this many bytes.
pub fn look_at_replays(dir: &Path, bytes_max: u64) -> Finding {
    judge("--replays", &Disk::of(dir), bytes_max.saturating_sub(bytes_in(dir)), false)
}

fn judge(flag: &str, disk: &Disk, needed: u64, is_synced: bool) -> Finding {
    let sync = match &disk.sync {
        Ok(sync) => *sync,
        Err(error) => return unusable(flag, &disk.place, error),
    };
    let place = disk.place.display();
    let place = if disk.is_missing { format!("to be made in {place}") } else { place.to_string() };
    let free = disk.free_bytes.map_or_else(|| "an unknown number of bytes".to_owned(), megabytes);
    let sync_ms = sync.as_secs_f64() * 1e3;
    let found = format!("{place}: {free} free, a sync takes {sync_ms:.1} ms");
    if disk.free_bytes.is_some_and(|free| free < needed) {
        let fewer = if flag == "--replays" { ", or allow fewer with --replays-mb" } else { "" };
        return Finding::change(flag, found, format!("free {}{fewer}", megabytes(needed)));
    }
    let change = format!(
        "use a disk that syncs within {} ms, or --state-sync system, which loses more if the power fails",
        SYNC_MAX.as_millis()
    );
    Finding::judged(flag, found, !is_synced || sync <= SYNC_MAX, change)
}

fn unusable(flag: &str, dir: &Path, error: &io::Error) -> Finding {
    let dir = dir.display();
    let change = "make the directory, and give it to the server's user (install -d -o USER DIR)";
    Finding::change(flag, format!("{dir}: it cannot be used: {error}"), change)
}

impl Disk {
    fn of(dir: &Path) -> Disk {
        let absolute = std::path::absolute(dir).unwrap_or_else(|_| dir.to_owned());
        let place = absolute.ancestors().find(|place| place.exists()).unwrap_or(dir).to_owned();
        let (is_missing, free_bytes) = (place != absolute, free_bytes(&place));
        let sync = sync_time(&place);
        Disk { place, is_missing, free_bytes, sync }
    }
}

/// Median time to sync a temporary file in a directory.
fn sync_time(place: &Path) -> io::Result<Duration> {
    let path = place.join(format!(".jostle-doctor-{}", std::process::id()));
    let mut file = File::options().write(true).create_new(true).open(&path)?;
    let times = (0..SYNCS).map(|_| {
        file.write_all(&[0; SYNC_BYTES])?;
        let began = Instant::now();
        file.sync_data()?;
        Ok(began.elapsed())
    });
    let times = times.collect::<io::Result<Vec<_>>>();
    fs::remove_file(&path)?;
    let mut times = times?;
    times.sort();
    Ok(times[SYNCS / 2])
}

/// Total size of the files in a directory, in bytes.
fn bytes_in(dir: &Path) -> u64 {
    let entries = fs::read_dir(dir).into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.metadata().ok()).map(|metadata| metadata.len()).sum()
}

#[cfg(unix)]
fn free_bytes(place: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(place).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_place: &Path) -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disk(free_mb: u64, sync_ms: u64) -> Disk {
        let sync = Ok(Duration::from_millis(sync_ms));
        Disk { place: "/srv".into(), is_missing: true, free_bytes: Some(free_mb << 20), sync }
    }

    #[test]
    fn room_speed_and_rights_are_judged() {
        let fine = judge("--state", &disk(256, 50), STATE_BYTES, true);
        assert!(fine.is_fine(), "{fine}");
        assert_eq!(fine.found, "to be made in /srv: 256 MB free, a sync takes 50.0 ms");
        assert!(judge("--state", &disk(256, 51), STATE_BYTES, false).is_fine());
        assert!(judge("--state", &Disk { free_bytes: None, ..disk(0, 1) }, 1, true).is_fine());
        let refused = Disk { sync: Err(io::ErrorKind::PermissionDenied.into()), ..disk(256, 1) };
        for (flag, disk, advice) in [
            ("--state", disk(255, 1), "free 256 MB"),
            ("--state", disk(256, 51), "--state-sync system"),
            ("--replays", disk(255, 1), "--replays-mb"),
            ("--replays", refused, "server's user"),
        ] {
            let change = judge(flag, &disk, STATE_BYTES, true).change.expect("something to change");
            assert!(change.contains(advice), "{change}");
        }
    }

    #[test]
    fn a_directory_that_is_not_made_yet_is_looked_at_where_it_would_be() {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let disk = Disk::of(&package.join("none/at/all"));
        assert!(disk.is_missing && disk.place == package && disk.sync.is_ok(), "{disk:?}");
        assert!(!Disk::of(package).is_missing);
        assert!(bytes_in(package) > 0);
        assert!(!look_at_replays(&package.join("Cargo.toml"), 1).is_fine(), "a file");
    }

    #[test]
    fn the_lock_of_another_server_is_found() {
        let dir = std::env::temp_dir().join(format!("jostle-doctor-{}", std::process::id()));
        let open = StateDir::open(&dir).expect("a state directory");
        let finding = look_at_state(&dir, true);
        assert!(finding.found.ends_with("another server uses it"), "{finding}");
        drop(open);
        assert!(!look_at_state(&dir, false).found.contains("another server"));
        fs::remove_dir_all(dir).expect("a directory of ours");
    }
}
