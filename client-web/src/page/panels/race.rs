//! The line of a race: the running clock, the place, the laps, and the split against a ghost.

use crate::language::fill;
use crate::page::app::App;
use crate::page::strings;
use crate::page::view::View;
use crate::world::ghost::Ghost;
use crate::world::replica::Replica;
use crate::world::replica::moments::race::split;
use jostle_game::RoundPhase;

/// The race at the displayed moment.
pub fn view(app: &App) -> View {
    let ghost = app.screen.game().and_then(|game| game.ghost());
    let parts = app.screen.replica().and_then(|replica| parts(replica, ghost));
    let is_on = parts.is_some();
    let [clock, place, laps, split] = parts.unwrap_or_default();
    let split = Some(split).filter(|split| !split.is_empty());
    View::panel("race")
        .show("#race", is_on)
        .text("#race-clock", clock)
        .text("#race-place", place)
        .text("#race-laps", laps)
        .text_or_hide("#race-split", split)
}

/// The clock, the player's place and laps, and the split.
fn parts(replica: &Replica, ghost: Option<&Ghost>) -> Option<[String; 4]> {
    let (race, room) = (replica.moments.race.as_ref()?, &replica.room);
    let phase = room.round()?.phase;
    if !matches!(phase, RoundPhase::Running | RoundPhase::Over) {
        return None;
    }
    let seat = room.own().map(|own| own.seat);
    let finish = seat.and_then(|seat| race.finish(seat)).map(f64::from);
    let clock = strings::clock(finish.or_else(|| race.elapsed(room.display))?, true);
    let Some(seat) = seat else {
        return Some([clock, String::new(), String::new(), String::new()]);
    };
    let (place, count) = race.place(seat);
    let [place, count] = [place, count].map(|number| number.to_string());
    let place = fill("Place {place} of {count}", &[("place", &place), ("count", &count)]);
    let times: Vec<u32> = race.lap_times(seat).collect();
    let lap = (times.len() + 1).min(race.laps).to_string();
    let all = race.laps.to_string();
    let mut laps = fill("Lap {lap} of {count}", &[("lap", &lap), ("count", &all)]);
    for (index, &ticks) in times.iter().enumerate() {
        laps += if index == 0 { ": " } else { ", " };
        laps += &strings::clock(f64::from(ticks), true);
    }
    let split = ghost.and_then(|ghost| {
        let ticks = split(race.marks(seat), ghost.marks());
        let split = ticks.map_or_else(String::new, strings::difference);
        Some(fill("Ghost of {name} {split}", &[("name", ghost.name()?), ("split", &split)]))
    });
    Some([clock, place, laps, split.unwrap_or_default()])
}
