//! The track of the day: a race whose obstacles follow from the date (UTC), the same everywhere and without a server.
//!
//! The track leads around an island. Every obstacle stands in a corridor and leaves a gap that is more than twice as
//! high and wide as a hero, and obstacles are further apart than that, so that every track can be flown.

use jostle_game::Scene;
use jostle_sim::Rng;

/// The name of the track's card in the lobby, which no scene can have.
pub const CARD: &str = "@day";
/// The largest date with a track: the end of the year 9999.
const DATE_MAX: u32 = 99_991_231;
/// The start of every track's title.
const TITLE: &str = "Track ";
/// Inner edges of the outer walls: left, right, bottom, top.
const EDGES: [i32; 4] = [2, 398, 7, 198];
/// The smallest gap that an obstacle leaves, world units; a hero is 9 by 12.
const GAP: i32 = 30;
const THEMES: [&str; 6] = ["ink", "sand", "ice", "meadow", "neon", "paper"];
/// The parts that all tracks have in common.
const BASE: &str = r#"about = "Three laps through the lit gates, on a new track every day."
size = [400, 200]
camera = { follow = 120 }
tools = ["steer"]
groups = ["hero", "platform"]
pairs = [["hero", "platform"]]
limits = { players = 8 }
[round]
task = "Three laps: fly through the lit gate, to the right first"
goal = 3
time = 180
fill = 4
finish = 30
[hero]
size = [9, 12]
restitution = 0.2
thrust = [130, 140]
speed_max = 110
spawns = [[60, 14], [45, 14], [30, 14], [60, 30], [45, 30], [30, 30], [60, 46], [45, 46]]
[[signals]]
name = "lap"
order = ["gate-1", "gate-2", "gate-3", "finish"]
each = "player"
[[rules]]
on = "lap"
score = 1
say = "{it} completed a lap"
splash = "fountain"
[[rules]]
enter = ["gate-1", "gate-2", "gate-3", "finish"]
checkpoint = true
[[rules]]
enter = ["lava-1", "lava-2"]
splash = "explosion"
back = 0.5
"#;

/// The date of a day, counted from 1970 (UTC), as a number like 20261129.
pub fn date(day: u32) -> u32 {
    // Years begin in March, so that leap days are last; 400 years have 146,097 days.
    let shifted = day + 719_468;
    let (era, of_era) = (shifted / 146_097, shifted % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    (era * 400 + year + u32::from(month < 3)) * 10_000 + month * 100 + day
}

/// A date for people, like 2026-11-29.
pub fn written(date: u32) -> String {
    format!("{:04}-{:02}-{:02}", date / 10_000, date / 100 % 100, date % 100)
}

/// The name under which bests of a date's track are kept.
pub fn name(date: u32) -> String {
    format!("track-{date}")
}

/// The date of a scene that is a track of the day.
pub fn date_of(scene: &Scene) -> Option<u32> {
    let date = scene.title.strip_prefix(TITLE)?.replace('-', "").parse().ok()?;
    (track(date) == scene.source).then_some(date)
}

/// The address fragment of a date's track.
pub fn hash(date: u32) -> String {
    format!("#daily={date}")
}

/// The date in an address fragment.
pub fn in_hash(hash: &str) -> Option<u32> {
    let date = hash.strip_prefix("#daily=")?.split('&').next()?;
    date.parse().ok().filter(|&date| date <= DATE_MAX)
}

/// The scene of a date's track.
pub fn track(date: u32) -> String {
    let mut track = Track { text: String::new(), rng: Rng::new(date.into(), 5) };
    let theme = THEMES[track.below(6) as usize];
    let gravity = -track.between(15, 40);
    track.text = format!(
        "title = \"{TITLE}{}\"\ntheme = \"{theme}\"\ngravity = [0, {gravity}]\n{BASE}",
        written(date)
    );
    track.build();
    track.text
}

struct Track {
    text: String,
    rng: Rng,
}

impl Track {
    fn below(&mut self, count: i32) -> i32 {
        self.rng.below(count as u32) as i32
    }

    /// A number from `low` to `high`.
    fn between(&mut self, low: i32, high: i32) -> i32 {
        low + self.below(high - low + 1)
    }

    /// Adds a box with these edges.
    fn solid(&mut self, kind: &str, [left, right, bottom, top]: [i32; 4]) {
        let middle = |low: i32, high: i32| f64::from(low + high) * 0.5;
        self.text += &format!(
            "[[bodies]]\nkind = \"{kind}\"\nposition = [{}, {}]\nsize = [{}, {}]\n",
            middle(left, right),
            middle(bottom, top),
            right - left,
            top - bottom
        );
    }

    fn zone(&mut self, name: &str, look: &str, [left, right, bottom, top]: [i32; 4]) {
        self.text += &format!(
            "[[zones]]\nname = \"{name}\"\narea = [[{left}, {bottom}], [{right}, {top}]]\n{look}\n"
        );
    }

    fn build(&mut self) {
        let [left, right, bottom, top] = EDGES;
        for wall in [
            [-40, 440, -33, bottom],
            [-40, 440, top, 228],
            [-28, left, bottom, top],
            [right, 428, bottom, top],
        ] {
            self.solid("wall", wall);
        }
        let (width, height) = (self.between(80, 110), self.between(15, 30));
        let island = [200 - width, 200 + width, 100 - height, 100 + height];
        self.solid("wall", island);
        let [inner_left, inner_right, inner_bottom, inner_top] = island;
        // Two obstacles in each of the long corridors, on either side of its gate.
        for [low, high] in [[bottom, inner_bottom], [inner_top, top]] {
            for near in [200 - 55, 200 + 55] {
                let x = near + self.between(-20, 20);
                self.barrier(x, low, high);
            }
        }
        for y in [50, 130] {
            let y = self.between(y, y + 12);
            self.shelf([inner_right, right], y);
        }
        if self.below(2) == 0 {
            let y = self.between(138, 150);
            self.shelf([left, inner_left], y);
        }
        let gate = |number: u32| format!("color = 3\nlabel = \"{number}\"");
        self.zone("gate-1", &gate(1), [198, 202, bottom, inner_bottom]);
        self.zone("gate-2", &gate(2), [inner_right, right, 98, 102]);
        self.zone("gate-3", &gate(3), [198, 202, inner_top, top]);
        self.zone("finish", "color = 7\nlabel = \"finish\"", [left, inner_left, 98, 102]);
        for (name, on) in [("lava-1", bottom), ("lava-2", inner_top)] {
            let at = if self.below(2) == 0 { 165 } else { 209 };
            let (from, width) = (at + self.below(6), self.between(14, 22));
            self.zone(name, "touch = true\ncolor = 5", [from, from + width, on, on + 3]);
            self.text += &format!(
                "[[emitters]]\nrecipe = \"ember\"\nposition = [{}, {}]\ncount = 6\nevery = 20\n",
                from + width / 2,
                on + 2
            );
        }
    }

    /// Adds an upright obstacle to a long corridor, from below or from above.
    fn barrier(&mut self, x: i32, low: i32, high: i32) {
        let length = self.between(16, high - low - GAP);
        let span = if self.below(2) == 0 { [low, low + length] } else { [high - length, high] };
        self.solid("platform", [x - 2, x + 2, span[0], span[1]]);
    }

    /// Adds a level obstacle to a short corridor, which may move from side to side.
    fn shelf(&mut self, [left, right]: [i32; 2], y: i32) {
        let length = self.between(22, right - left - 2 * GAP);
        if self.below(2) == 0 {
            let half = length / 2 + 3;
            let [mut from, mut to] = [left + half, right - half];
            if self.below(2) == 0 {
                std::mem::swap(&mut from, &mut to);
            }
            let period = self.between(4, 7);
            self.text += &format!(
                "[[bodies]]\nkind = \"platform\"\nsize = [{length}, 4]\n\
                 path = [[{from}, {y}], [{to}, {y}]]\nperiod = {period}\n"
            );
        } else if self.below(2) == 0 {
            self.solid("platform", [left, left + length, y - 2, y + 2]);
        } else {
            self.solid("platform", [right - length, right, y - 2, y + 2]);
        }
    }
}

#[cfg(test)]
mod tests;
