//! Networks that operators have temporarily banned. With a state directory, bans outlive the process.

use crate::files::read_regular;
use crate::log::write_closed;
use ipnet::IpNet;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Maximum number of bans in force at once.
const BANS_MAX: usize = 1024;
/// Maximum size of the ban file, bytes; an IPv6 ban takes 90.
const BANS_BYTES_MAX: usize = 128 * BANS_MAX;

/// A network that is banned until a certain time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ban {
    pub network: IpNet,
    /// End of the ban, in seconds since 1970.
    pub until_unix_s: u64,
}

/// All bans that are still in force.
#[derive(Debug, Default)]
pub struct Bans {
    /// The file in which the bans are stored.
    file: Option<PathBuf>,
    bans: Mutex<Vec<Ban>>,
    /// Held while the file is being written, so that requests never wait for the disk.
    writing: Mutex<()>,
}

impl Bans {
    /// Reads the previous process's bans. If the file cannot be read, it is set aside and this is logged: a server
    /// without bans is better than no server.
    pub fn open(file: Option<PathBuf>) -> Bans {
        let Some(path) = &file else { return Bans::default() };
        let read = read_regular(path, BANS_BYTES_MAX).map(|bytes| serde_json::from_slice(&bytes));
        let bans = match read {
            Ok(Ok(bans)) => bans,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Ok(Err(error)) => set_aside(path, &error),
            Err(error) => set_aside(path, &error),
        };
        Bans { file, bans: Mutex::new(bans), writing: Mutex::default() }
    }

    /// Returns whether an address is currently banned.
    pub fn is_banned(&self, ip: IpAddr) -> bool {
        let bans = self.lock();
        let ip = ip.to_canonical();
        !bans.is_empty() && {
            let now = unix_s();
            bans.iter().any(|ban| ban.until_unix_s > now && ban.network.contains(&ip))
        }
    }

    /// Bans that are still in force, earliest end first.
    pub fn list(&self) -> Vec<Ban> {
        let now = unix_s();
        let mut bans: Vec<_> =
            self.lock().iter().filter(|ban| ban.until_unix_s > now).copied().collect();
        bans.sort_by_key(|ban| ban.until_unix_s);
        bans
    }

    /// Bans a network from now on, replacing an earlier ban of the same network. If there are more than [`BANS_MAX`]
    /// bans, the one that would end first is dropped. An error means that the ban is in force but will not outlive this
    /// process.
    pub fn ban(&self, network: IpNet, time: Duration) -> io::Result<Ban> {
        let network = network.trunc();
        let ban = Ban { network, until_unix_s: unix_s() + time.as_secs() };
        self.change(|bans| {
            bans.retain(|other| other.network != network);
            if bans.len() >= BANS_MAX
                && let Some(first) = (0..bans.len()).min_by_key(|&at| bans[at].until_unix_s)
            {
                bans.swap_remove(first);
            }
            bans.push(ban);
        })?;
        Ok(ban)
    }

    /// Lifts the ban on a network; returns `false` if it was not banned.
    pub fn lift(&self, network: IpNet) -> io::Result<bool> {
        let network = network.trunc();
        let mut lifted = false;
        self.change(|bans| {
            let before = bans.len();
            bans.retain(|ban| ban.network != network);
            lifted = bans.len() < before;
        })?;
        Ok(lifted)
    }

    fn change(&self, change: impl FnOnce(&mut Vec<Ban>)) -> io::Result<()> {
        let _writing = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        let bans = {
            let mut bans = self.lock();
            let now = unix_s();
            bans.retain(|ban| ban.until_unix_s > now);
            change(&mut bans);
            bans.clone()
        };
        match &self.file {
            Some(file) => write_closed(file, &serde_json::to_vec(&bans)?),
            None => Ok(()),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Ban>> {
        self.bans.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn set_aside(path: &Path, error: &dyn std::error::Error) -> Vec<Ban> {
    let aside = path.with_extension("damaged");
    let moved = fs::rename(path, &aside).is_ok();
    tracing::error!(file = %path.display(), %error, moved, "the bans cannot be read; there are none now");
    Vec::new()
}

fn unix_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR: Duration = Duration::from_secs(3600);

    fn network(text: &str) -> IpNet {
        text.parse().expect("a network")
    }

    fn ip(text: &str) -> IpAddr {
        text.parse().expect("an address")
    }

    #[test]
    fn a_network_is_banned_until_the_ban_ends_or_is_lifted() {
        let bans = Bans::default();
        bans.ban(network("203.0.113.7/24"), HOUR).expect("nothing to write");
        bans.ban(network("2001:db8::/48"), Duration::ZERO).expect("nothing to write");
        assert!(bans.is_banned(ip("203.0.113.200")) && bans.is_banned(ip("::ffff:203.0.113.1")));
        assert!(!bans.is_banned(ip("203.0.114.1")) && !bans.is_banned(ip("2001:db8::1")));
        assert_eq!(bans.list().len(), 1, "the other has ended");
        assert!(bans.lift(network("203.0.113.0/24")).expect("nothing to write"));
        assert!(!bans.lift(network("203.0.113.0/24")).expect("nothing to write"));
        assert!(!bans.is_banned(ip("203.0.113.200")));
    }

    #[test]
    fn few_bans_are_kept_and_a_second_one_replaces_the_first() {
        let bans = Bans::default();
        for number in 0..BANS_MAX as u32 + 5 {
            let ip = IpAddr::from((10 << 24 | number).to_be_bytes());
            let time = HOUR + Duration::from_secs(number.into());
            bans.ban(ip.into(), time).expect("nothing to write");
        }
        assert_eq!(bans.list().len(), BANS_MAX);
        assert!(!bans.is_banned(ip("10.0.0.4")) && bans.is_banned(ip("10.0.0.5")));
        bans.ban(network("10.0.0.5/32"), 9 * HOUR).expect("nothing to write");
        assert_eq!(bans.list().len(), BANS_MAX);
    }

    #[test]
    fn bans_outlive_the_process_and_a_wrong_file_is_set_aside() {
        let name = format!("jostle-bans-{:016x}.json", crate::host::random());
        let file = std::env::temp_dir().join(name);
        let open = || Bans::open(Some(file.clone()));
        open().ban(network("10.0.0.0/8"), HOUR).expect("a place");
        let bans = open();
        assert!(bans.is_banned(ip("10.1.2.3")) && bans.list().len() == 1);
        fs::write(&file, "").expect("a place");
        assert!(open().list().is_empty());
        let aside = file.with_extension("damaged");
        assert!(!file.exists() && aside.exists(), "set aside");
        fs::remove_file(aside).expect("the file");
    }
}
