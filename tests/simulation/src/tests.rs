//! Simulates fleets with faults, and with flaws that the checks must detect.

use super::{Faults, Flaws, Settings, Simulation};
use std::time::Duration;

/// Returns the first violation among several seeds, which are tried on two threads.
fn first_violation(seeds: u64, settings: impl Fn(u64) -> Settings + Sync) -> Option<String> {
    let run = |first: u64| {
        let seeds = (first..seeds).step_by(2);
        seeds.map(|seed| Simulation::run(settings(seed))).find_map(Result::err)
    };
    std::thread::scope(|scope| {
        let odd = scope.spawn(|| run(1));
        let even = run(0);
        even.or(odd.join().expect("it does not panic")).map(|violation| violation.to_string())
    })
}

fn flawed(seed: u64, flaws: Flaws) -> Settings {
    Settings { flaws, ..Settings::small(seed) }
}

fn two_play(violation: &str) -> bool {
    violation.contains("is played by [") && !violation.ends_with("[]")
}

/// Number of seeds to run: all of them before a release, when `JOSTLE_LONG` is set, and a quarter otherwise.
fn seeds(all: u64) -> u64 {
    if std::env::var_os("JOSTLE_LONG").is_some_and(|value| value == "1") { all } else { all / 4 }
}

#[test]
fn rooms_are_played_by_one_node_each_whatever_happens() {
    assert_eq!(first_violation(seeds(200), Settings::small), None);
}

#[test]
fn rooms_are_played_by_one_node_each_when_much_more_happens() {
    let often = Faults {
        lost: 50,
        cuts: 8.0,
        outages: 2.0,
        freezes: 6.0,
        stalls: 6.0,
        deaths: 4.0,
        opening_fails: 200,
        ..Faults::all()
    };
    let settings = |seed| Settings { faults: often.clone(), ..Settings::small(seed) };
    assert_eq!(first_violation(seeds(60), settings), None);
    // With this seed, a write arrives so late that the room it opens has ended in the meantime.
    let late = Simulation::run(settings(517)).map_err(|violation| violation.to_string());
    assert!(late.is_ok(), "{late:?}");
}

#[test]
fn entries_that_expire_too_early_give_no_room_a_second_node() {
    let flaws = Flaws { lease_ttl: Duration::from_secs(9), ..Flaws::default() };
    let settings = |seed| Settings { flaws: flaws.clone(), ..Settings::small(seed) };
    assert_eq!(first_violation(40, settings), None);
}

#[test]
fn rooms_without_leases_are_found() {
    let flaws = Flaws { ignores_lease: true, ..Flaws::default() };
    let found = first_violation(60, |seed| flawed(seed, flaws.clone()));
    assert!(found.as_deref().is_some_and(two_play), "{found:?}");
}

#[test]
fn writes_without_a_comparison_are_found() {
    let flaws = Flaws { ignores_revisions: true, ..Flaws::default() };
    let found = first_violation(60, |seed| flawed(seed, flaws.clone()));
    assert!(found.is_some(), "epochs or players");
}

#[test]
fn a_seed_gives_one_course_of_events() {
    let run = || Simulation::run(Settings::small(5)).expect("no violation");
    let (first, second) = (run(), run());
    assert_eq!(format!("{:?}", first.store), format!("{:?}", second.store));
}
