//! `jostle replay verify` plays replays again, several at once, and compares every tick.

mod verdict;

use super::file::{duration, read, size};
use crate::output::{Failure, json, say};
use indicatif::{ProgressBar, ProgressStyle};
use jostle_protocol::replay::Ending;
use jostle_room::divergence;
use jostle_sim::TICKS_PER_SECOND;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use verdict::{Verdict, VerifyOutcome};

/// Progress bar on stderr, shown if stderr is a terminal. Progress is measured in bytes of the files.
const PROGRESS: &str = "[{bar:30}] {percent} %, {msg}, {eta} left";
/// Number of ticks between progress updates, so that threads rarely contend for the progress bar.
const STEP_TICKS: u32 = 600;

/// Play replays again and compare every tick with the recording
///
/// The status is 0 if all replays are equal; a truncated file is compared up to its end. The status is 1 if a replay
/// differs (the tick, phase, body and field are named if known), is damaged or cannot be read.
#[derive(clap::Args)]
pub struct Verify {
    /// The replay files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Number of files to play in parallel [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct VerifyReport {
    files: Vec<Verdict>,
    /// Number of complete files that replay as recorded.
    equal: usize,
    /// Number of truncated files that replay as recorded up to their end.
    cut: usize,
    differ: usize,
    /// Number of files that replay as recorded up to a damaged record.
    damaged: usize,
    unreadable: usize,
    ticks: u64,
    seconds: f64,
    /// Seconds of play verified per second of wall time.
    times_real_time: f64,
}

impl Verify {
    /// Verifies the files and prints the report.
    pub fn run(self) -> Result<(), Failure> {
        let sizes: Vec<u64> = self.files.iter().map(|path| size(path)).collect::<Result<_, _>>()?;
        let style = ProgressStyle::with_template(PROGRESS).expect("a template that is well formed");
        let progress = ProgressBar::new(sizes.iter().sum())
            .with_style(style.progress_chars("#--"))
            .with_message(format!("0 of {} files", self.files.len()));
        let started = Instant::now();
        let verdicts = self.verify(&sizes, &progress)?;
        let report = VerifyReport::new(verdicts, started.elapsed().as_secs_f64());
        if self.json { say(json(&report)) } else { say(report.sentence()) }?;
        report.failure()
    }

    fn jobs(&self) -> usize {
        let cores = jostle_server::limits::processors();
        self.jobs.map_or(cores, usize::from).min(self.files.len())
    }

    /// Verdicts in the order of the files. Each is printed as soon as all the earlier ones have been.
    fn verify(&self, sizes: &[u64], progress: &ProgressBar) -> Result<Vec<Verdict>, Failure> {
        let (sender, verdicts) = channel();
        let queue = Mutex::new(self.files.iter().zip(sizes).enumerate());
        let take = &|| queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        let mut known: Vec<Option<Verdict>> = self.files.iter().map(|_| None).collect();
        let mut printed = 0;
        std::thread::scope(|scope| {
            for _ in 0..self.jobs() {
                let sender = sender.clone();
                scope.spawn(move || {
                    while let Some((index, (path, &bytes))) = take() {
                        if sender.send((index, verify(path, bytes, progress))).is_err() {
                            return;
                        }
                    }
                });
            }
            drop(sender);
            for (index, verdict) in verdicts {
                known[index] = Some(verdict);
                while let Some(Some(verdict)) = known.get(printed) {
                    if !self.json {
                        progress.suspend(|| say(verdict))?;
                    }
                    printed += 1;
                }
                progress.set_message(format!("{printed} of {} files", self.files.len()));
            }
            progress.finish_and_clear();
            Ok(known.into_iter().flatten().collect())
        })
    }
}

fn verify(path: &Path, bytes: u64, progress: &ProgressBar) -> Verdict {
    let file = path.display().to_string();
    let mut done = 0;
    let mut reach = |all: u64| {
        progress.inc(all - done);
        done = all;
    };
    let replay = match read(path) {
        Ok(replay) => Arc::new(replay),
        Err(Failure::Check(reason) | Failure::Usage(reason)) => {
            reach(bytes);
            // The verdict already names the file.
            let reason = reason.strip_prefix(&format!("{file}: ")).unwrap_or(&reason).to_owned();
            return Verdict { file, ticks: 0, outcome: VerifyOutcome::Unreadable { reason } };
        }
    };
    let first_tick = replay.first_tick();
    let ticks = replay.last_tick() - first_tick;
    let found = divergence::verify(&replay, |tick| {
        let played = tick - first_tick;
        if played.is_multiple_of(STEP_TICKS) {
            reach(bytes * u64::from(played) / u64::from(ticks.max(1)));
        }
    });
    reach(bytes);
    let (ticks, outcome) = match (found, replay.ending()) {
        (Err(error), _) => (0, VerifyOutcome::Unreadable { reason: error.to_string() }),
        (Ok(Some(divergence)), _) => {
            (divergence.tick - first_tick, VerifyOutcome::differs(&divergence))
        }
        (Ok(None), Ending::Cut(error)) => (ticks, VerifyOutcome::cut(&error, replay.last_tick())),
        (Ok(None), Ending::Damaged(error)) => {
            (ticks, VerifyOutcome::damaged(&error, replay.last_tick()))
        }
        (Ok(None), Ending::Whole) => (ticks, VerifyOutcome::Ok),
    };
    Verdict { file, ticks, outcome }
}

impl VerifyReport {
    fn new(files: Vec<Verdict>, seconds: f64) -> VerifyReport {
        let count = |is: fn(&VerifyOutcome) -> bool| {
            files.iter().filter(|verdict| is(&verdict.outcome)).count()
        };
        let ticks = files.iter().map(|verdict| u64::from(verdict.ticks)).sum();
        VerifyReport {
            equal: count(|outcome| matches!(outcome, VerifyOutcome::Ok)),
            cut: count(|outcome| matches!(outcome, VerifyOutcome::Cut { .. })),
            differ: count(|outcome| matches!(outcome, VerifyOutcome::Differs { .. })),
            damaged: count(|outcome| matches!(outcome, VerifyOutcome::Damaged { .. })),
            unreadable: count(|outcome| matches!(outcome, VerifyOutcome::Unreadable { .. })),
            files,
            ticks,
            seconds,
            times_real_time: ticks as f64 / f64::from(TICKS_PER_SECOND) / seconds.max(1e-9),
        }
    }

    fn sentence(&self) -> String {
        let mut parts = vec![format!("{} equal", self.equal + self.cut)];
        let others = [
            (self.cut, "of them cut"),
            (self.differ, "differ"),
            (self.damaged, "damaged"),
            (self.unreadable, "unreadable"),
        ];
        parts.extend(
            others
                .iter()
                .filter(|(count, _)| *count > 0)
                .map(|(count, what)| format!("{count} {what}")),
        );
        format!(
            "{} files: {}; {} ticks, {} of play in {:.1} s, {:.0} times real time",
            self.files.len(),
            parts.join(", "),
            self.ticks,
            duration(self.ticks),
            self.seconds,
            self.times_real_time
        )
    }

    /// Fails, naming the first file that is not equal, if there is one.
    fn failure(&self) -> Result<(), Failure> {
        let is_bad = |verdict: &&Verdict| {
            !matches!(verdict.outcome, VerifyOutcome::Ok | VerifyOutcome::Cut { .. })
        };
        match self.files.iter().find(is_bad) {
            None => Ok(()),
            Some(first) => {
                let bad = self.differ + self.damaged + self.unreadable;
                let all = self.files.len();
                Err(Failure::Check(format!("{bad} of {all} replays did not verify; {first}")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Verifies a file with these bytes, in a directory for this test.
    fn verify_bytes(name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let file = std::env::temp_dir().join(format!("jostle-{}-{name}", std::process::id()));
        std::fs::write(&file, bytes).expect("the temporary directory is writable");
        let result = Verify { files: vec![file.clone()], jobs: None, json: false }.run();
        std::fs::remove_file(&file).expect("it was just written");
        result
    }

    #[test]
    fn damage_in_the_middle_fails_and_a_missing_end_does_not() {
        let golden = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/goldens/replays/gas.jostle");
        let whole = std::fs::read(golden).expect("a golden replay");
        assert!(verify_bytes("whole", &whole).is_ok());
        for missing in [1, 12, 300] {
            assert!(verify_bytes("cut", &whole[..whole.len() - missing]).is_ok(), "{missing}");
        }
        for place in [whole.len() * 3 / 4, whole.len() - 400] {
            let mut damaged = whole.clone();
            damaged[place] ^= 4;
            match verify_bytes("damaged", &damaged) {
                Err(Failure::Check(reason)) => assert!(reason.contains("DAMAGED"), "{reason}"),
                other => panic!("byte {place}: {other:?}"),
            }
        }
    }
}
