//! `jostle` with a counting allocator: it prints the number of allocations per second, across all threads, sessions and
//! sockets, to stderr. `cargo xtask load --allocations` runs it.

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use std::alloc::System;
use std::process::ExitCode;
use std::time::Duration;

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn main() -> ExitCode {
    std::thread::spawn(|| {
        let mut before = 0;
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let stats = COUNTED.stats();
            let now = stats.allocations + stats.reallocations;
            eprintln!("allocations: {}", now - before);
            before = now;
        }
    });
    jostle_cli::main()
}
