//! How far many threads are, as one line on stderr that is drawn again and again; nothing where
//! stderr is no terminal.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Time between two drawings.
pub const DRAW_EVERY: Duration = Duration::from_millis(150);
/// Characters of the bar.
const BAR_CHARS: usize = 30;
/// Ticks between two steps of a share, so that threads seldom write to the same place.
const STEP_TICKS: u32 = 600;

/// What all of them have done, measured in bytes of the files.
pub struct Progress {
    done: AtomicU64,
    total: u64,
    started: Instant,
    is_shown: bool,
}

/// The part of one file.
pub struct Share<'a> {
    progress: &'a Progress,
    bytes: u64,
    done: u64,
}

impl Progress {
    /// Nothing done yet of so many bytes.
    pub fn new(total: u64) -> Progress {
        let is_shown = std::io::stderr().is_terminal();
        Progress { done: AtomicU64::new(0), total, started: Instant::now(), is_shown }
    }

    /// A file of so many bytes is begun. It counts as done when the share is dropped.
    pub fn share(&self, bytes: u64) -> Share<'_> {
        Share { progress: self, bytes, done: 0 }
    }

    /// Draws the line.
    pub fn draw(&self, files: usize, files_all: usize) {
        if self.is_shown {
            let text = self.text(files, files_all);
            // A terminal that is gone needs no bar.
            let _ = write!(std::io::stderr(), "\r\x1b[K{text}");
        }
    }

    /// Takes the line away.
    pub fn clear(&self) {
        if self.is_shown {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }

    fn text(&self, files: usize, files_all: usize) -> String {
        let share = self.done.load(Ordering::Relaxed) as f64 / self.total.max(1) as f64;
        let full = (share * BAR_CHARS as f64) as usize;
        let bar = "#".repeat(full.min(BAR_CHARS));
        let elapsed_s = self.started.elapsed().as_secs_f64();
        let left = match share > 0.01 {
            true => format!(", {:.0} s left", elapsed_s / share - elapsed_s),
            false => String::new(),
        };
        let percent = share * 100.0;
        format!("[{bar:-<BAR_CHARS$}] {percent:.0} %, {files} of {files_all} files{left}")
    }
}

impl Share<'_> {
    /// So many of its ticks are done.
    pub fn reach(&mut self, tick: u32, ticks: u32) {
        if tick.is_multiple_of(STEP_TICKS) {
            let done = self.bytes * u64::from(tick) / u64::from(ticks.max(1));
            self.progress.done.fetch_add(done - self.done, Ordering::Relaxed);
            self.done = done;
        }
    }
}

impl Drop for Share<'_> {
    fn drop(&mut self) {
        self.progress.done.fetch_add(self.bytes - self.done, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_all() {
        let progress = Progress::new(1000);
        let mut one = progress.share(600);
        one.reach(600, 1200);
        assert!(progress.text(0, 2).starts_with("[#########---"), "{}", progress.text(0, 2));
        one.reach(1200, 1200);
        drop(one);
        assert!(progress.text(1, 2).contains("] 60 %, 1 of 2 files"));
        drop(progress.share(400));
        let bar = "#".repeat(BAR_CHARS);
        assert!(progress.text(2, 2).starts_with(&format!("[{bar}] 100 %")));
    }
}
