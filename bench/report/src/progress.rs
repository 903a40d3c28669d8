//! Shows progress on stderr, as a redrawn bar on a terminal and as lines otherwise.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::Instant;

const BAR: usize = 30;

/// Counts finished tasks; may be shared between threads.
pub struct Progress {
    total: usize,
    began: Instant,
    done: Mutex<usize>,
}

impl Progress {
    /// Creates a counter with no finished tasks.
    pub fn new(total: usize) -> Progress {
        Progress { total, began: Instant::now(), done: Mutex::new(0) }
    }

    pub fn begin(&self, name: &str) {
        let done = *self.done.lock().expect("no holder panics");
        let seconds = self.began.elapsed().as_secs();
        let mut out = std::io::stderr().lock();
        let line = format!("{done:3} of {} done, {seconds:4} s: {name}", self.total);
        // Errors are ignored: a run need not stop because its progress cannot be shown.
        let _ = if out.is_terminal() {
            let filled = BAR * done / self.total.max(1);
            write!(out, "\r\x1b[2K[{}{}] {line}", "#".repeat(filled), ".".repeat(BAR - filled))
        } else {
            writeln!(out, "{line}")
        };
        let _ = out.flush();
    }

    pub fn done(&self) {
        let mut done = self.done.lock().expect("no holder panics");
        *done += 1;
        if *done == self.total && std::io::stderr().is_terminal() {
            eprintln!();
        }
    }
}
