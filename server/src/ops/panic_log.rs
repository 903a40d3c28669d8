//! The log of panics. Rooms with guests' scenes may panic as often as they are opened, so a room's panic takes up one
//! line without a backtrace. For each kind of thread, one panic per second is logged, along with the number of earlier
//! ones that were left out.

use crate::ops::refusal_log::{Foreign, RefusalLog};
use std::backtrace::Backtrace;
use std::panic::{self, PanicHookInfo};
use std::thread;
use std::time::Instant;
use tracing::error;

/// Prefix of the names of room threads.
pub const ROOM_THREAD: &str = "room ";

/// Sends panics to the log, because standard error itself may be a pipe that nothing reads.
pub fn log_panics() {
    let log = PanicLog::default();
    panic::set_hook(Box::new(move |info| {
        let current = thread::current();
        if let Some(line) = log.line(current.name().unwrap_or_default(), info, Instant::now()) {
            error!("{line}");
        }
    }));
}

#[derive(Default)]
struct PanicLog(RefusalLog);

impl PanicLog {
    /// The log entry for a panic, unless one from the same kind of thread was just logged.
    fn line(&self, thread: &str, info: &PanicHookInfo, now: Instant) -> Option<String> {
        let is_room = thread.starts_with(ROOM_THREAD);
        let left_out = self.0.admit(if is_room { "room" } else { "other" }, now)?;
        let place = info.location().map(ToString::to_string).unwrap_or_default();
        let message = info.payload_as_str().unwrap_or_default();
        if is_room {
            let message = Foreign(message.as_bytes());
            return Some(format!("{thread} panicked at {place}: {message}, {left_out} left out"));
        }
        Some(format!("{info}, {left_out} left out\n{}", Backtrace::capture()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};
    use std::time::Duration;

    #[test]
    fn a_rooms_panic_is_one_short_line_and_one_a_second() {
        let (log, lines) = (PanicLog::default(), Arc::new(Mutex::new(Vec::new())));
        let (noted, began) = (Arc::clone(&lines), Instant::now());
        let own = thread::current().id();
        let hook = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            // Other tests may panic at the same time.
            if thread::current().id() != own {
                return hook(info);
            }
            let mut lines = noted.lock().expect("no panic while it is locked");
            let now = began + Duration::from_millis(400) * lines.len() as u32;
            let line = log.line("room oak", info, now);
            lines.push(line);
        }));
        for _ in 0..4 {
            let long = "x\n".repeat(1000);
            assert!(panic::catch_unwind(|| panic!("{long}")).is_err());
        }
        drop(panic::take_hook());
        let lines = lines.lock().expect("no panic while it was locked");
        let [Some(first), None, None, Some(last)] = lines.as_slice() else { panic!("{lines:?}") };
        assert!(first.starts_with("room oak panicked at ") && first.contains("panic_log.rs"));
        assert!(!first.contains('\n') && first.len() < 400, "{first}");
        assert!(last.ends_with(", 2 left out"), "{last}");
    }
}
