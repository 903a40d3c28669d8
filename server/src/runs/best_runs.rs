//! A scene's best runs.

use crate::limits;
use jostle_room::Run;
use std::cmp::Reverse;

/// Seconds for which displaced runs are kept: thirty days, since operators may be away.
const DISPLACED_KEPT_S: u64 = 30 * 24 * 60 * 60;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Name of the run's file, without its extension.
    pub name: String,
    /// The run that the file proves.
    pub run: Run,
    /// Time of submission, in seconds since 1970.
    pub unix_s: u64,
    /// Length of the file, in bytes.
    pub bytes: u64,
    /// Time when a better run displaced it, in seconds since 1970; `None` while it is among the best.
    pub displaced_s: Option<u64>,
}

impl Record {
    fn players(&self) -> impl Iterator<Item = &str> {
        self.run.players.iter().map(|(_, look)| &*look.name)
    }
}

/// A scene's best runs, best first: at most [`limits::RECORDS_MAX`], with no more than one by the same players. Of
/// equal runs, the older one is better. The runs that they displace are kept for a while, in case the better ones are
/// removed: at most [`limits::DISPLACED_MAX`] for [`DISPLACED_KEPT_S`]. Those that stood longest are kept, since runs
/// that displace each other within minutes are a bot's.
#[derive(Clone, Debug, Default)]
pub struct BestRuns {
    listed: Vec<Record>,
    displaced: Vec<Record>,
}

/// A change that must be applied to a run's file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunFileChange {
    /// The run with this name was displaced at this time, in seconds since 1970, and is kept.
    Displaced(String, u64),
    /// The run with this name, displaced at this time, is among the best again.
    Listed(String, u64),
    /// The run with this name, displaced at this time, is no longer kept.
    Gone(String, u64),
}

impl BestRuns {
    /// The runs, best first.
    pub fn list(&self) -> &[Record] {
        &self.listed
    }

    /// The rank of the run with this name, starting at 1.
    pub fn rank(&self, name: &str) -> Option<usize> {
        self.listed.iter().position(|record| record.name == name).map(|index| index + 1)
    }

    /// Returns whether a run would be among the best.
    pub fn takes(&self, new: &Record) -> bool {
        let mut with = self.clone();
        with.enter(new.clone(), new.unix_s);
        self.rank(&new.name).is_none() && with.rank(&new.name).is_some()
    }

    /// Enters a run at this time, in seconds since 1970, and returns the resulting changes.
    pub fn enter(&mut self, new: Record, now_s: u64) -> Vec<RunFileChange> {
        if self.listed.iter().chain(&self.displaced).any(|record| record.name == new.name) {
            let again = new.displaced_s.map(|at_s| RunFileChange::Gone(new.name, at_s));
            return again.into_iter().collect();
        }
        self.listed.push(new);
        self.settle(now_s)
    }

    /// Removes the best run with this name, if any, and returns the resulting changes.
    pub fn remove(&mut self, name: &str, now_s: u64) -> Vec<RunFileChange> {
        self.listed.retain(|record| record.name != name);
        self.settle(now_s)
    }

    fn settle(&mut self, now_s: u64) -> Vec<RunFileChange> {
        let mut all = std::mem::take(&mut self.listed);
        all.append(&mut self.displaced);
        all.sort_by_key(|record| (record.run.rank(), record.unix_s));
        let mut moved = Vec::new();
        for mut record in all {
            let is_same = |better: &Record| better.players().eq(record.players());
            if self.listed.len() < limits::RECORDS_MAX && !self.listed.iter().any(is_same) {
                let since_s = record.displaced_s.take();
                moved.extend(since_s.map(|at_s| RunFileChange::Listed(record.name.clone(), at_s)));
                self.listed.push(record);
            } else {
                if record.displaced_s.is_none() {
                    moved.push(RunFileChange::Displaced(record.name.clone(), now_s));
                }
                record.displaced_s.get_or_insert(now_s);
                self.displaced.push(record);
            }
        }
        moved.extend(self.forget(now_s));
        moved
    }

    /// Drops displaced runs that are too old or exceed the limit.
    fn forget(&mut self, now_s: u64) -> Vec<RunFileChange> {
        let at_s = |record: &Record| record.displaced_s.unwrap_or(now_s);
        self.displaced.sort_by_key(|record| Reverse(at_s(record).saturating_sub(record.unix_s)));
        let mut kept = 0;
        let (kept, gone) = std::mem::take(&mut self.displaced).into_iter().partition(|record| {
            let is_kept = kept < limits::DISPLACED_MAX
                && now_s.saturating_sub(at_s(record)) < DISPLACED_KEPT_S;
            kept += usize::from(is_kept);
            is_kept
        });
        self.displaced = kept;
        let gone: Vec<Record> = gone;
        gone.into_iter()
            .map(|record| RunFileChange::Gone(record.name.clone(), at_s(&record)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_game::Seat;
    use jostle_protocol::Appearance;
    use jostle_room::Measure;

    fn record(name: &str, player: &str, ticks: u32, unix_s: u64) -> Record {
        let look = Appearance::new(player, 0).expect("a name");
        let (measure, players) = (Measure::Time, vec![(Seat(0), look)]);
        let run = Run { measure, begin: 9, end: 9 + ticks, points: 1, hash: 0, players };
        Record { name: name.to_owned(), run, unix_s, bytes: 1, displaced_s: None }
    }

    fn names(runs: &BestRuns) -> Vec<&str> {
        runs.list().iter().map(|record| record.name.as_str()).collect()
    }

    /// Names of the displaced runs, and of those that are among the best again.
    fn names_of(moved: &[RunFileChange]) -> (Vec<&str>, Vec<&str>) {
        let (mut displaced, mut listed) = (Vec::new(), Vec::new());
        for moved in moved {
            match moved {
                RunFileChange::Displaced(name, _) => displaced.push(name.as_str()),
                RunFileChange::Listed(name, _) => listed.push(name.as_str()),
                RunFileChange::Gone(..) => {}
            }
        }
        (displaced, listed)
    }

    #[test]
    fn the_best_run_of_each_player_is_kept() {
        let mut runs = BestRuns::default();
        assert!(runs.enter(record("a", "Ann", 500, 3), 3).is_empty());
        assert!(runs.enter(record("b", "Bob", 400, 4), 4).is_empty());
        let moved = runs.enter(record("c", "Ann", 300, 5), 5);
        assert_eq!(moved, [RunFileChange::Displaced("a".to_owned(), 5)], "Ann was faster");
        assert_eq!(names(&runs), ["c", "b"]);
        assert!(!runs.takes(&record("d", "Ann", 301, 6)));
        assert!(!runs.takes(&record("b", "Bob", 400, 4)), "it is there");
        assert!(runs.enter(record("b", "Bob", 400, 7), 7).is_empty());
        assert_eq!((names(&runs), runs.rank("b"), runs.rank("a")), (vec!["c", "b"], Some(2), None));
        assert_eq!(runs.remove("c", 8), [RunFileChange::Listed("a".to_owned(), 5)]);
        assert_eq!(names(&runs), ["b", "a"]);
    }

    #[test]
    fn of_equal_runs_the_older_one_is_better_in_whatever_order_they_come() {
        for order in [[0, 1], [1, 0]] {
            let equal = [record("old", "Ann", 300, 5), record("new", "Bob", 300, 6)];
            let mut runs = BestRuns::default();
            for index in order {
                assert!(runs.enter(equal[index].clone(), 9).is_empty());
            }
            assert_eq!(names(&runs), ["old", "new"]);
        }
    }

    #[test]
    fn runs_that_bots_displaced_come_back_as_those_are_removed() {
        let mut runs = BestRuns::default();
        for number in 0..limits::RECORDS_MAX as u32 {
            let name = number.to_string();
            assert!(runs.enter(record(&name, &name, 300 + number, 10), 10).is_empty());
        }
        assert!(!runs.takes(&record("late", "Ann", 309, 99)));
        // Bots displace all the runs, and then displace each other more often than runs are kept.
        let bots = (limits::RECORDS_MAX + 2 * limits::DISPLACED_MAX) as u32;
        let (mut displaced, mut gone) = (0, 0);
        for number in 0..bots {
            let bot =
                record(&format!("bot-{number}"), &format!("Bot {number}"), 299 - number, 5000);
            let moved = runs.enter(bot, 5000 + u64::from(number));
            displaced += names_of(&moved).0.len();
            gone += moved.iter().filter(|moved| matches!(moved, RunFileChange::Gone(..))).count();
        }
        assert_eq!((displaced, gone), (bots as usize, bots as usize - limits::DISPLACED_MAX));
        assert!(names(&runs).iter().all(|name| name.starts_with("bot")));
        while let Some(bot) = names(&runs).iter().find(|name| name.starts_with("bot")) {
            let bot = (*bot).to_owned();
            runs.remove(&bot, 6000);
        }
        assert_eq!(names(&runs).len(), limits::RECORDS_MAX);
        assert_eq!((runs.rank("0"), runs.rank("9")), (Some(1), Some(10)));
    }

    #[test]
    fn a_displaced_run_is_kept_for_a_while_only() {
        let mut runs = BestRuns::default();
        runs.enter(record("a", "Ann", 500, 3), 3);
        runs.enter(record("b", "Ann", 400, 4), 4);
        let late = 4 + DISPLACED_KEPT_S;
        let moved = runs.enter(record("c", "Cid", 400, late), late);
        assert_eq!(moved, [RunFileChange::Gone("a".to_owned(), 4)]);
        // The file may be read again after the run has been entered once more.
        let again = Record { displaced_s: Some(9), ..record("b", "Ann", 400, 4) };
        assert_eq!(runs.enter(again, late), [RunFileChange::Gone("b".to_owned(), 9)]);
    }
}
