//! The player's own bests and streaks. They are kept in the browser's storage only, and nobody else sees them.

use crate::language::fill;
use crate::page::context::Context;
use crate::page::game::GameScreen;
use crate::page::storage::Storage;
use crate::page::strings;
use crate::world::daily;
use crate::world::replica::Replica;
use jostle_game::{RoundInfo, RoundPhase, Side};
use jostle_room::Measure;

/// Storage key of the bests: lines of a name, a space, and a [`Score`].
const BESTS: &str = "jostle.bests";
/// Storage key of the streaks: the last day of play, days in a row and wins in a row, separated by spaces.
const STREAK: &str = "jostle.streak";
/// Maximum number of stored bests; the one improved longest ago is dropped first.
const BESTS_MAX: usize = 64;
/// The name that the server gives to scenes of guests, whose bests are not kept.
const GUEST: &str = "guest";

/// A player's result in a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Score {
    /// Time to the goal, ticks.
    Ticks(u32),
    Points(i32),
}

impl Score {
    fn parse(text: &str) -> Option<Score> {
        match text.strip_prefix('t') {
            Some(ticks) => Some(Score::Ticks(ticks.parse().ok()?)),
            None => Some(Score::Points(text.parse().ok()?)),
        }
    }

    fn encode(self) -> String {
        match self {
            Score::Ticks(ticks) => format!("t{ticks}"),
            Score::Points(points) => points.to_string(),
        }
    }

    /// How much better it is than another one, in ticks or points; `None` if they cannot be compared.
    fn gain(self, other: Score) -> Option<i64> {
        match (self, other) {
            (Score::Ticks(own), Score::Ticks(other)) => Some(i64::from(other) - i64::from(own)),
            (Score::Points(own), Score::Points(other)) => Some(i64::from(own) - i64::from(other)),
            _ => None,
        }
    }

    pub fn words(self) -> String {
        match self {
            Score::Ticks(ticks) => strings::clock(f64::from(ticks), true),
            Score::Points(points) => strings::points(points),
        }
    }
}

/// The player's own result of the latest round.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OwnResult {
    /// The sentence about it; may be empty.
    pub said: String,
    /// The start tick of the most recent result that was examined.
    since: Option<u32>,
}

impl OwnResult {
    /// Counts the day, and the result of a round that has just ended, once.
    pub fn note(&mut self, ctx: &mut Context, game: &GameScreen) {
        let is_played = !game.watches() && (game.is_alone() || !game.is_in_page());
        let Some(replica) = game.replica().filter(|_| is_played && !game.is_frozen()) else {
            return;
        };
        let mut streak = Streak::read(&ctx.storage);
        streak.note_day(ctx.day());
        let over = replica.room.round().filter(|round| round.phase == RoundPhase::Over);
        if let Some(round) = over.filter(|round| self.since != Some(round.since)) {
            self.since = Some(round.since);
            streak.note_round(replica, round);
            let score = best_name(ctx, game).zip(score_of(replica, round));
            self.said = score.map_or_else(String::new, |(name, score)| {
                let before = keep(&mut ctx.storage, &name, score);
                said(score, before)
            });
        }
        streak.keep(&mut ctx.storage);
    }
}

/// The sentence about a score and the best one before.
fn said(score: Score, before: Option<Score>) -> String {
    let best = |score: Score| fill("Your best: {result}", &[("result", &score.words())]);
    let Some((before, gain)) = before.and_then(|it| Some((it, score.gain(it)?))) else {
        return best(score);
    };
    let by = match score {
        Score::Ticks(_) => strings::difference(-gain),
        Score::Points(_) => format!("{gain:+}").replace('-', "\u{2212}"),
    };
    match gain {
        1.. => best(score) + ", " + &by,
        _ => score.words() + ", " + &by + " \u{b7} " + &best(before),
    }
}

/// The name under which bests are kept: the scene's, or the track's of a day.
fn best_name(ctx: &Context, game: &GameScreen) -> Option<String> {
    let scene = &game.replica()?.room.scene;
    if let Some(date) = daily::date_of(scene) {
        return Some(daily::name(date));
    }
    let alone = ctx.site.alone().0.filter(|_| game.edited.is_none());
    let name = if game.is_in_page() { alone? } else { scene.name.as_str() };
    Some(name.to_owned()).filter(|name| name != GUEST)
}

/// The player's result in a round that is over, if it can be compared with other rounds.
fn score_of(replica: &Replica, round: &RoundInfo) -> Option<Score> {
    let (room, moments) = (&replica.room, &replica.moments);
    let spec = room.scene.rules.round.as_ref()?;
    let side = round.side_of(room.seat);
    let info = round.side(side)?;
    let won = round.winners.contains(&side);
    let is_contest = round.players.len() > 1 && round.teams.len() != 1;
    match Measure::of(&room.scene)? {
        Measure::Points => {
            (info.score > 0 && (won || is_contest)).then_some(Score::Points(info.score))
        }
        Measure::Time => {
            let race = moments.race.as_ref();
            if let Some(finish) = race.and_then(|race| race.finish(room.seat)) {
                return Some(Score::Ticks(finish));
            }
            let ticks = round.since.checked_sub(moments.began?)?;
            let reached = spec.goal.is_some_and(|goal| info.score >= goal);
            let in_time = reached || spec.time.is_none_or(|time| ticks < time);
            (won && in_time).then_some(Score::Ticks(ticks))
        }
    }
}

fn entries(storage: &Storage) -> impl Iterator<Item = (&str, Score)> {
    let lines = storage.get(BESTS).unwrap_or_default().lines();
    lines.filter_map(|line| {
        let (name, score) = line.split_once(' ')?;
        Some((name, Score::parse(score)?))
    })
}

/// The player's best in a scene.
pub fn best(storage: &Storage, name: &str) -> Option<Score> {
    entries(storage).find(|(known, _)| *known == name).map(|(_, score)| score)
}

/// Stores a score if it is the best, and returns the best one before.
fn keep(storage: &mut Storage, name: &str, score: Score) -> Option<Score> {
    let before = best(storage, name);
    if before.and_then(|before| score.gain(before)).is_some_and(|gain| gain <= 0) {
        return before;
    }
    let kept: Vec<_> = entries(storage).filter(|(known, _)| *known != name).collect();
    let mut text = String::new();
    let first = (kept.len() + 1).saturating_sub(BESTS_MAX);
    for &(name, score) in kept[first..].iter().chain(&[(name, score)]) {
        text += name;
        text.push(' ');
        text += &score.encode();
        text.push('\n');
    }
    storage.keep(BESTS, &text);
    before
}

/// Days of play in a row, and wins in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Streak {
    /// The last day of play, counted from 1970 (UTC).
    day: u32,
    days: u32,
    wins: u32,
}

impl Streak {
    fn read(storage: &Storage) -> Streak {
        let mut numbers = storage.get(STREAK).unwrap_or_default().split(' ');
        let mut next = || numbers.next().and_then(|text| text.parse().ok()).unwrap_or(0);
        Streak { day: next(), days: next(), wins: next() }
    }

    fn keep(self, storage: &mut Storage) {
        let Streak { day, days, wins } = self;
        storage.keep(STREAK, &[day, days, wins].map(|number| number.to_string()).join(" "));
    }

    fn note_day(&mut self, today: u32) {
        if self.day != today || self.days == 0 {
            let goes_on = self.day.saturating_add(1) == today;
            self.days = if goes_on { self.days.saturating_add(1) } else { 1 };
            self.day = today;
        }
    }

    /// A round that only one side played changes nothing, and neither does a draw.
    fn note_round(&mut self, replica: &Replica, round: &RoundInfo) {
        let own = round.side_of(replica.room.seat);
        let sides = if round.teams.is_empty() { round.players.len() } else { round.teams.len() };
        let is_in = matches!(own, Side::Team(_)) || round.player(replica.room.seat).is_some();
        match &round.winners[..] {
            [winner] if sides > 1 && is_in => {
                self.wins = if *winner == own { self.wins.saturating_add(1) } else { 0 };
            }
            _ => {}
        }
    }
}

/// The streaks that are still going on, in words; empty if there are none.
pub fn streaks(ctx: &Context) -> String {
    let Streak { day, days, wins } = Streak::read(&ctx.storage);
    let days = if day.saturating_add(1) >= ctx.day() { days } else { 0 };
    let count = |number: u32| number.to_string();
    let days = (days > 1).then(|| fill("{count} days in a row", &[("count", &count(days))]));
    let wins = (wins > 1).then(|| fill("{count} wins in a row", &[("count", &count(wins))]));
    let parts: Vec<String> = days.into_iter().chain(wins).collect();
    parts.join(" \u{b7} ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_best_is_replaced_only_by_a_better_one_of_its_kind() {
        let mut storage = Storage::default();
        let mut kept = |score| {
            let before = keep(&mut storage, "race", score);
            (before, best(&storage, "race"))
        };
        let [slow, fast] = [300, 200].map(Score::Ticks);
        assert_eq!(kept(slow), (None, Some(slow)));
        assert_eq!(kept(fast), (Some(slow), Some(fast)));
        assert_eq!(kept(slow), (Some(fast), Some(fast)));
        // The scene counts points now.
        assert_eq!(kept(Score::Points(3)), (Some(fast), Some(Score::Points(3))));
        assert_eq!(said(Score::Points(7), Some(Score::Points(3))), "Your best: 7 points, +4");
        assert_eq!(
            said(Score::Points(1), Some(Score::Points(3))),
            "1 point, \u{2212}2 \u{b7} Your best: 3 points"
        );
        assert_eq!(said(slow, Some(slow)), "0:05.0, +0.0 s \u{b7} Your best: 0:05.0");
    }

    #[test]
    fn stored_bests_are_bounded_and_anything_may_be_stored() {
        let mut storage = Storage::default();
        for number in 0..200 {
            keep(&mut storage, &format!("s{number}"), Score::Ticks(number));
        }
        assert_eq!(entries(&storage).count(), BESTS_MAX);
        assert_eq!(best(&storage, "s199"), Some(Score::Ticks(199)));
        assert_eq!(best(&storage, "s100"), None);
        for text in ["", "\n\n", "race", "race t", "race t-1", "race 99999999999", " x", "\u{0}"] {
            storage.keep(BESTS, text);
            assert_eq!(best(&storage, "race"), None, "{text:?}");
            storage.keep(STREAK, text);
            assert_eq!(Streak::read(&storage), Streak::default());
        }
    }

    #[test]
    fn a_missed_day_ends_a_streak() {
        let mut streak = Streak::default();
        let days = [3, 3, 4, 5, 7, 8, 2].map(|day| {
            streak.note_day(day);
            streak.days
        });
        assert_eq!(days, [1, 1, 2, 3, 1, 2, 1]);
    }
}
