//! Mutates replays of every scene and plays the results, on all cores:
//!
//!     cargo run --release -p jostle-fuzz --example mutate_replays -- [COUNT [FIRST]]
//!
//! COUNT is a million by default. If a mutation causes a panic, its number is reported; pass it as FIRST to start with
//! that mutation.

use jostle_fuzz::mutations::{Tally, bases, run};
use std::num::NonZero;
use std::sync::Mutex;
use std::time::Instant;

fn main() {
    let mut numbers = std::env::args().skip(1).map(|text| text.parse::<u64>());
    let mut next = |usual| numbers.next().unwrap_or(Ok(usual)).expect("arguments are numbers");
    let (count, first) = (next(1_000_000), next(0));
    let bases = bases();
    let jobs = std::thread::available_parallelism().map_or(1, NonZero::get) as u64;
    let tallies = Mutex::new(vec![Tally::default(); jobs as usize]);
    let started = Instant::now();
    std::thread::scope(|scope| {
        for job in 0..jobs {
            let (bases, tallies) = (&bases, &tallies);
            scope.spawn(move || {
                let own = (first..first + count).skip(job as usize).step_by(jobs as usize);
                run(bases, own, |tally| report(tallies, job as usize, *tally, count));
            });
        }
    });
    let sum = sum(&tallies.lock().expect("no job panicked"));
    let Tally { refused, equal, stopped, differs, ticks, slowest } = sum;
    println!();
    println!(
        "{} mutated replays of {} in {:.0} s: {refused} refused, {equal} equal as far as they go, \
         {stopped} equal up to a tick that cannot be played, {differs} differ; {ticks} ticks played, \
         {:.2} s for the slowest; none panicked",
        sum.count(),
        bases.len(),
        started.elapsed().as_secs_f64(),
        slowest.as_secs_f64()
    );
}

fn report(tallies: &Mutex<Vec<Tally>>, job: usize, tally: Tally, count: u64) {
    let mut tallies = tallies.lock().expect("no job panicked");
    tallies[job] = tally;
    eprint!("\r{} of {count}", sum(&tallies).count());
}

fn sum(tallies: &[Tally]) -> Tally {
    let mut sum = Tally::default();
    tallies.iter().for_each(|tally| sum.add(tally));
    sum
}
