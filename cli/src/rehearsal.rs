//! A rehearsal of a scene: the server's bots play it for a minute, next to a player who only watches. It finds what is
//! wrong with a game that the file does not show: nobody scores, bodies fall out of the world, or most bots stand about.

use jostle_game::scene::Trigger;
use jostle_game::{Event, Input, RoundInfo, RoundPhase, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_room::Room;
use jostle_sim::{TICKS_PER_SECOND, Vec2};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Maximum number of bots. Smaller scenes get one fewer than they have seats.
const BOTS: u16 = 5;
/// Number of ticks that rounds run.
const PLAYED_TICKS: u32 = 60 * TICKS_PER_SECOND;
/// Number of ticks with countdowns and pauses after which the rehearsal ends in any case.
const TICKS_MAX: u32 = 5 * PLAYED_TICKS;
/// A bot is idle if its hero stays this close to one place, world units, for this many ticks of a round.
const IDLE_DISTANCE: f32 = 6.0;
const IDLE_TICKS: u32 = 50 * TICKS_PER_SECOND;

/// The results of a rehearsal.
#[derive(Debug, Default, Serialize)]
pub struct Rehearsal {
    /// Number of bots that played.
    pub bots: usize,
    /// Number of rounds that ended.
    pub rounds: u32,
    /// Most points of a side in any round.
    pub score_max: i32,
    /// Number of bodies that left the world.
    pub fallen: u32,
    /// Names of the bots that stood about.
    pub idle: Vec<String>,
    /// The problems of the scene, in sentences.
    pub problems: Vec<String>,
}

/// Where each bot's hero has been, and since when, in ticks of rounds.
type Places = BTreeMap<Seat, (Vec2, u32)>;

impl Rehearsal {
    /// Plays a scene.
    pub fn of(scene: &Scene, seed: u64) -> Rehearsal {
        let mut rehearsal = Rehearsal::default();
        let fill = scene.players_max.min(BOTS + 1);
        let mut room = Room::filled("rehearsal", Arc::new(scene.clone()), seed, fill);
        let watcher = Appearance::new("Watcher", 0).expect("a good name");
        let watcher = room.join(watcher, None).expect("a free seat").claim.seat;
        let (mut places, mut played, mut was) = (Places::new(), 0, RoundPhase::Waiting);
        for tick in 1..=TICKS_MAX {
            // A player who sends nothing would count as away.
            room.input(watcher, tick, Input::default());
            room.tick();
            let round = room.game().round().unwrap_or_default();
            rehearsal.bots = rehearsal.bots.max(room.bots());
            rehearsal.rounds += u32::from(was != round.phase && round.phase == RoundPhase::Over);
            was = round.phase;
            let fallen = |event: &&Event| matches!(event, Event::BodyLeft { .. });
            rehearsal.fallen += room.game().events().iter().filter(fallen).count() as u32;
            if round.phase == RoundPhase::Running {
                played += 1;
                rehearsal.score_max = rehearsal.score_max.max(highest(&round));
                rehearsal.note_idle(&room, watcher, played, &mut places);
            } else {
                places.clear();
            }
            if played == PLAYED_TICKS || tick == TICKS_MAX {
                break;
            }
        }
        rehearsal.judge(scene, played);
        rehearsal
    }

    fn note_idle(&mut self, room: &Room, watcher: Seat, played: u32, places: &mut Places) {
        let (game, names) = (room.game(), &room.snapshot().players);
        for player in game.players().filter(|player| player.seat != watcher) {
            let Some(hero) = player.hero else { continue };
            let at = game.world().position(hero);
            let (place, since) = places.entry(player.seat).or_insert((at, played));
            if place.distance(at) > IDLE_DISTANCE {
                (*place, *since) = (at, played);
            } else if played - *since == IDLE_TICKS {
                let known = names.iter().find(|known| known.seat == player.seat);
                let name =
                    known.map_or_else(String::new, |known| known.appearance.name.to_string());
                self.idle.push(name);
            }
        }
    }

    fn judge(&mut self, scene: &Scene, played: u32) {
        let seconds = played / TICKS_PER_SECOND;
        let is_meant = |trigger: &Trigger| matches!(trigger, Trigger::Lost(_));
        let may_fall = scene.rules.rules.iter().any(|rule| is_meant(&rule.occasion));
        if scene.rules.round.is_none() {
            self.problems.push("it has no [round], so nobody can win it".to_owned());
        } else if played == 0 {
            self.problems.push("no round began: too few players".to_owned());
        } else if self.score_max <= 0 && self.rounds == 0 {
            self.problems.push(format!("nobody scored in {seconds} seconds"));
        }
        if self.bots == 0 {
            self.problems.push("no bots play: it has no [hero]".to_owned());
        }
        if self.fallen > 0 && !may_fall {
            let text =
                format!("{} bodies fell out of the world, and no rule says lost", self.fallen);
            self.problems.push(text);
        }
        // Some may be guards, who wait at their place for the whole round.
        if self.idle.len() * 2 > self.bots {
            let (names, limit) = (self.idle.join(", "), IDLE_TICKS / TICKS_PER_SECOND);
            self.problems.push(format!("{names} did not move for {limit} seconds"));
        }
    }

    /// The result in one line.
    pub fn sentence(&self) -> String {
        let Rehearsal { bots, rounds, score_max, .. } = self;
        format!("{bots} bots, {score_max} points at most, {rounds} rounds over")
    }
}

/// The points of the side that has the most.
fn highest(round: &RoundInfo) -> i32 {
    let of_players = round.players.iter().map(|player| player.side.score);
    round.teams.iter().map(|team| team.score).chain(of_players).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::scene_file;
    use std::path::Path;

    fn problems(text: &str) -> Vec<String> {
        let scene = Scene::parse("yard.toml", text).unwrap_or_else(|error| panic!("{error}"));
        Rehearsal::of(&scene, 1).problems
    }

    /// A pit without a floor, in which nothing can be won.
    const PIT: &str = "title = \"Pit\"\nsize = [160, 90]\ngroups = [\"hero\", \"platform\", \"block\"]\n\
        [[bodies]]\nkind = \"block\"\nposition = [80, 60]\nradius = 3\n[hero]\nspawns = [[80, 40]]\n";

    #[test]
    fn a_rehearsal_says_what_is_wrong() {
        let found = problems(PIT);
        assert!(found[0].contains("no [round]") && found[1].contains("fell out"), "{found:?}");
        let still = PIT.replace("[hero]\n", "[hero]\nthrust = [0, 0]\n");
        let still =
            format!("gravity = [0, 0]\n{still}\n[round]\ntime = 200\n[limits]\nplayers = 2\n");
        let found = problems(&still);
        assert!(found[0].contains("nobody scored"), "{found:?}");
        assert!(found[1].starts_with("Bot ") && found[1].contains("did not move"), "{found:?}");
    }

    #[test]
    fn the_gallery_is_fun_for_bots() {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/gallery");
        let paths = std::fs::read_dir(dir).expect("the gallery").map(|entry| entry.unwrap().path());
        let scenes = paths.filter(|path| path.extension().is_some_and(|ending| ending == "toml"));
        let mut wrong = Vec::new();
        for path in scenes {
            let scene = scene_file(&path).unwrap_or_else(|failure| panic!("{failure:?}"));
            let rehearsal = Rehearsal::of(&scene, 1);
            println!("{}: {}", scene.name, rehearsal.sentence());
            wrong.extend(rehearsal.problems.iter().map(|what| format!("{}: {what}", scene.name)));
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}
