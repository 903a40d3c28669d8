//! The calling thread's processor time and priority.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Processor time that the calling thread has used so far. If the system does not measure it, returns the time since
/// the first call.
pub fn taken() -> Duration {
    counted().unwrap_or_else(|| {
        static FIRST: OnceLock<Instant> = OnceLock::new();
        FIRST.get_or_init(Instant::now).elapsed()
    })
}

#[cfg(unix)]
fn counted() -> Option<Duration> {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Some(Duration::new(time.tv_sec.try_into().ok()?, time.tv_nsec.try_into().ok()?))
}

#[cfg(not(unix))]
fn counted() -> Option<Duration> {
    None
}

/// Lowers the priority of the calling thread by a niceness from 1 to 19. Only Linux has per-thread niceness; elsewhere
/// this does nothing.
pub fn go_after_others(niceness: i32) {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::setpriority_process(None, niceness) {
        tracing::debug!(%error, "a thread keeps its priority");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = niceness;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn work_is_counted_and_sleep_is_not() {
        let before = taken();
        let until = before + Duration::from_millis(5);
        while taken() < until {
            std::hint::spin_loop();
        }
        let worked = taken();
        std::thread::sleep(Duration::from_millis(200));
        assert!(taken() - worked < Duration::from_millis(150), "a sleep counts as work");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn only_the_calling_thread_goes_after_others() {
        use rustix::process::getpriority_process;
        let niceness = || getpriority_process(None).expect("its own");
        let before = niceness();
        let within = std::thread::spawn(move || {
            go_after_others(before + 1);
            niceness()
        });
        assert_eq!(within.join().expect("no panic"), (before + 1).min(19));
        assert_eq!(niceness(), before);
    }
}
