//! The processor: how fast a core plays a scene, and how much time a virtual machine's host takes away from it.

use super::finding::Finding;
use crate::run::bots::Bots;
use jostle_game::scene::WorstTick;
use jostle_game::{Game, Scene};
use jostle_protocol::replay::Change;
use jostle_sim::{DT, TICKS_PER_SECOND};
use std::fs;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the scene is played.
const PLAYED: Duration = Duration::from_secs(2);
/// Maximum acceptable fraction of processor time taken by the host.
const STEAL_MAX: f64 = 0.02;
/// One in this many ticks may take longer than the tick interval.
const LATE_TICKS: usize = 100;
const SEED: u64 = 1;

/// Timing measurements for a scene played on one core.
#[derive(Debug)]
pub struct PlayedScene {
    scene: String,
    bots: u16,
    /// Mean time per tick, in milliseconds.
    mean_ms: f64,
    /// 99th percentile of the time per tick, in milliseconds.
    p99_ms: f64,
}

/// The time of all processors since boot, and the part of it that the host took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    all: u64,
    stolen: u64,
}

impl Times {
    /// Reads the times; `None` if the system does not report them.
    pub fn now() -> Option<Times> {
        Times::parse(&fs::read_to_string("/proc/stat").ok()?)
    }

    /// Parses the first line: user, nice, system, idle, iowait, irq, softirq and steal. The two fields after these are
    /// already included in the first two.
    fn parse(stat: &str) -> Option<Times> {
        let fields = stat.lines().next()?.strip_prefix("cpu ")?.split_ascii_whitespace().take(8);
        let times: Vec<u64> = fields.map(|field| field.parse().ok()).collect::<Option<_>>()?;
        Some(Times { all: times.iter().sum(), stolen: *times.get(7)? })
    }
}

/// Plays the scene with the slowest worst tick for two seconds, with as many bots as it allows.
pub fn play_largest(scenes: &[Scene]) -> Option<PlayedScene> {
    let cost = |scene: &&Scene| WorstTick::of(scene).ms;
    let largest = scenes.iter().max_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let bots = largest.players_max;
    let mut players = Bots::new(bots, SEED, largest);
    let mut game = Game::new(Arc::new(largest.clone()), SEED);
    let (began, mut ticks_ms) = (Instant::now(), Vec::new());
    while began.elapsed() < PLAYED {
        let (changes, inputs) = players.next(1 + ticks_ms.len() as u32);
        let tick = Instant::now();
        for change in &changes {
            match change {
                Change::Join(seat, _) => game.join(*seat),
                Change::Leave(seat) => game.leave(*seat),
                Change::Look(..) => {}
            }
        }
        game.tick(inputs);
        ticks_ms.push(tick.elapsed().as_secs_f64() * 1e3);
    }
    let mean_ms = ticks_ms.iter().sum::<f64>() / ticks_ms.len() as f64;
    ticks_ms.sort_by(f64::total_cmp);
    let p99_ms = ticks_ms[ticks_ms.len() - 1 - ticks_ms.len() / LATE_TICKS];
    Some(PlayedScene { scene: largest.name.clone(), bots, mean_ms, p99_ms })
}

/// Judges the speed of a core on a machine with this many cores.
pub fn judge_speed(played: Option<PlayedScene>, cores: usize, is_release: bool) -> Finding {
    let Some(PlayedScene { scene, bots, mean_ms, p99_ms }) = played else {
        return Finding::fine("processor", format!("{cores} cores; there is no scene to play"));
    };
    let tick_ms = 1e3 * f64::from(DT);
    let rooms = (tick_ms / mean_ms) as usize;
    let found = format!(
        "{cores} cores; on one {:.0} ticks a second of {scene} with {bots} bots ({mean_ms:.2} ms each, p99 {p99_ms:.2}), \
         {rooms} such rooms, {} on all",
        1e3 / mean_ms,
        cores * rooms,
    );
    let change = match is_release {
        true => format!(
            "p99 has to be below {tick_ms:.1} ms for {TICKS_PER_SECOND} ticks a second: use a faster processor, \
             or leave the scene out"
        ),
        false => "build with --release".to_owned(),
    };
    Finding::judged("processor", found, p99_ms < tick_ms, change)
}

/// Judges how much time a virtual machine's host took between two readings.
pub fn judge_steal(times: [Option<Times>; 2]) -> Finding {
    let [Some(before), Some(after)] = times else {
        return Finding::fine("steal", "unknown: this system does not tell it");
    };
    let all = after.all.saturating_sub(before.all).max(1);
    let share = after.stolen.saturating_sub(before.stolen) as f64 / all as f64;
    let found = format!("{:.1} % of the processors' time", 100.0 * share);
    let change = "ask for a machine whose processors are not shared: rooms miss ticks meanwhile";
    Finding::judged("steal", found, share <= STEAL_MAX, change)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn played(mean_ms: f64, p99_ms: f64) -> Option<PlayedScene> {
        Some(PlayedScene { scene: "hall".to_owned(), bots: 64, mean_ms, p99_ms })
    }

    #[test]
    fn one_tick_in_a_hundred_may_be_late() {
        let fine = judge_speed(played(1.0, 16.0), 2, true);
        assert!(fine.is_fine() && fine.found.contains(" 1000 ticks a second of hall"), "{fine}");
        assert!(fine.found.ends_with("16 such rooms, 32 on all"), "{fine}");
        let slow = judge_speed(played(1.0, 17.0), 2, true).change.expect("too slow");
        assert!(slow.contains("faster"), "{slow}");
        let debug = judge_speed(played(20.0, 17.0), 2, false).change.expect("too slow");
        assert!(debug.contains("--release"), "{debug}");
        assert!(judge_speed(None, 2, true).is_fine());
    }

    #[test]
    fn steal_is_a_share_of_all_time() {
        let times = |all, stolen| Some(Times { all, stolen });
        assert!(judge_steal([times(1000, 10), times(2000, 30)]).is_fine());
        let finding = judge_steal([times(1000, 10), times(2000, 31)]);
        assert!(!finding.is_fine() && finding.found.starts_with("2.1 %"), "{finding}");
        assert!(judge_steal([None, times(1, 1)]).is_fine());
    }

    #[test]
    fn the_first_line_has_the_times() {
        let stat = "cpu  10 20 30 40 50 60 70 80 90 100\ncpu0 1 2 3 4 5 6 7 8 9 10\n";
        assert_eq!(Times::parse(stat), Some(Times { all: 360, stolen: 80 }));
        assert_eq!(Times::parse("cpu  1 2 3\n"), None);
    }

    #[test]
    fn the_largest_scene_is_played() {
        let played = play_largest(&Scene::built_in()).expect("scenes");
        let hall = Scene::built_in().into_iter().find(|scene| scene.name == played.scene);
        assert_eq!(played.bots, hall.expect("a scene").players_max);
        assert!(played.mean_ms > 0.0 && played.p99_ms >= 0.0, "{played:?}");
    }
}
