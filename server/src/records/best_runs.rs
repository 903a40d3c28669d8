//! The best runs of one scene.

use crate::limits;
use jostle_room::Run;

/// A run that is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Name of its file, without the ending.
    pub name: String,
    /// The run that it proved.
    pub run: Run,
    /// When it came, seconds since 1970.
    pub unix_s: u64,
    /// Length of its file.
    pub bytes: u64,
}

impl Record {
    fn players(&self) -> impl Iterator<Item = &str> {
        self.run.players.iter().map(|(_, look)| &*look.name)
    }
}

/// The best runs of a scene, the best first: at most [`limits::RECORDS_MAX`], one of the same players. Of equal runs the
/// older one is better.
#[derive(Clone, Debug, Default)]
pub struct BestRuns(Vec<Record>);

impl BestRuns {
    /// The runs, the best first.
    pub fn list(&self) -> &[Record] {
        &self.0
    }

    /// The rank of a run of this name, from 1.
    pub fn rank(&self, name: &str) -> Option<usize> {
        self.0.iter().position(|record| record.name == name).map(|index| index + 1)
    }

    /// Returns whether a run would be among the best.
    pub fn takes(&self, new: &Record) -> bool {
        let mut with = self.clone();
        with.enter(new.clone());
        self.rank(&new.name).is_none() && with.rank(&new.name).is_some()
    }

    /// Enters a run, and returns the names of those that have no place any more, be it the run itself.
    pub fn enter(&mut self, new: Record) -> Vec<String> {
        if self.rank(&new.name).is_some() {
            return Vec::new();
        }
        let key = |record: &Record| (record.run.rank(), record.unix_s);
        let at = self.0.partition_point(|record| key(record) <= key(&new));
        self.0.insert(at, new);
        let mut displaced = Vec::new();
        let mut kept: Vec<Record> = Vec::new();
        for record in self.0.drain(..) {
            let is_same = |better: &Record| better.players().eq(record.players());
            match kept.len() < limits::RECORDS_MAX && !kept.iter().any(is_same) {
                true => kept.push(record),
                false => displaced.push(record.name),
            }
        }
        self.0 = kept;
        displaced
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
        Record { name: name.to_owned(), run, unix_s, bytes: 1 }
    }

    fn names(runs: &BestRuns) -> Vec<&str> {
        runs.list().iter().map(|record| record.name.as_str()).collect()
    }

    #[test]
    fn the_best_run_of_each_player_is_kept() {
        let mut runs = BestRuns::default();
        assert!(runs.enter(record("a", "Ann", 500, 3)).is_empty());
        assert!(runs.enter(record("b", "Bob", 400, 4)).is_empty());
        assert_eq!(runs.enter(record("c", "Ann", 300, 5)), ["a"], "Ann was faster");
        assert_eq!(names(&runs), ["c", "b"]);
        assert!(!runs.takes(&record("d", "Ann", 301, 6)));
        assert_eq!(runs.enter(record("d", "Ann", 301, 6)), ["d"]);
        assert!(!runs.takes(&record("b", "Bob", 400, 4)), "it is there");
        assert!(runs.enter(record("b", "Bob", 400, 7)).is_empty());
        assert_eq!((names(&runs), runs.rank("b"), runs.rank("d")), (vec!["c", "b"], Some(2), None));
    }

    #[test]
    fn of_equal_runs_the_older_one_is_better_in_whatever_order_they_come() {
        for order in [[0, 1], [1, 0]] {
            let equal = [record("old", "Ann", 300, 5), record("new", "Bob", 300, 6)];
            let mut runs = BestRuns::default();
            for index in order {
                assert!(runs.enter(equal[index].clone()).is_empty());
            }
            assert_eq!(names(&runs), ["old", "new"]);
        }
    }

    #[test]
    fn there_are_only_so_and_so_many() {
        let mut runs = BestRuns::default();
        for number in 0..limits::RECORDS_MAX {
            let name = number.to_string();
            assert!(runs.enter(record(&name, &name, 300, number as u64)).is_empty());
        }
        assert!(!runs.takes(&record("late", "Ann", 300, 99)));
        assert!(runs.takes(&record("good", "Ann", 299, 99)));
        let last = (limits::RECORDS_MAX - 1).to_string();
        assert_eq!(runs.enter(record("good", "Ann", 299, 99)), [last]);
        assert_eq!((runs.list().len(), runs.rank("good")), (limits::RECORDS_MAX, Some(1)));
    }
}
