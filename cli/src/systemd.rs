//! Status notifications for systemd, or another service manager with the same protocol, if it started this process and
//! expects them (`Type=notify`, `WatchdogSec=`).

use jostle_server::ops::supervisor::Supervisor;
#[cfg(unix)]
use std::sync::Arc;

/// Passes the server's status on to the service manager, if there is one.
#[cfg(unix)]
pub fn supervisor() -> Supervisor {
    // This way, two notifications may be late or lost.
    let alive_every = sd_notify::watchdog_enabled().map(|within| within / 3);
    let alive_every = alive_every.filter(|every| !every.is_zero());
    Supervisor { tell: Arc::new(unix::tell), alive_every }
}

#[cfg(not(unix))]
pub fn supervisor() -> Supervisor {
    Supervisor::default()
}

#[cfg(unix)]
mod unix {
    use jostle_server::ops::supervisor::Sign;
    use sd_notify::NotifyState;
    use tracing::warn;

    pub fn tell(sign: Sign) {
        let state = match sign {
            Sign::Ready => NotifyState::Ready,
            Sign::Alive => NotifyState::Watchdog,
            Sign::Stopping => NotifyState::Stopping,
        };
        if let Err(error) = sd_notify::notify(&[state]) {
            warn!(?sign, %error, "a sign of life did not reach the service manager (NOTIFY_SOCKET)");
        }
    }
}
