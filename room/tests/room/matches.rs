//! Matches of one person against the bots of a scene. Optimised builds play a hundred of each.

use super::novice::Novice;
use jostle_game::{Game, Input, RoundPhase, Scene, Seat, Side};
use jostle_protocol::Appearance;
use jostle_room::Room;
use std::sync::Arc;

/// Number of matches for each scene and player.
const MATCHES: u64 = if cfg!(debug_assertions) { 1 } else { 100 };
/// Length of a match that has not ended before, ticks.
const TICKS_MAX: u32 = 310 * 60;

/// The seed of the first match; the others follow it. `cargo xtask bots` gets it as an option.
#[expect(
    clippy::disallowed_methods,
    reason = "chooses the matches; each still depends on its seed alone"
)]
fn first_seed() -> u64 {
    std::env::var("JOSTLE_FIRST_SEED").map_or(0, |seed| seed.parse().expect("a seed"))
}

/// The outcome of matches in which one person plays against bots.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    won: u64,
    shared: u64,
    lost: u64,
    seconds: u64,
    points: [u64; 2],
}

/// Plays matches, the person's input being a function of the game.
fn matches(
    name: &str,
    count: u64,
    person: impl Fn(u64) -> Box<dyn FnMut(&Game, Seat) -> Input>,
) -> Tally {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == name);
    let scene = Arc::new(scene.expect("a shipped scene"));
    let mut tally = Tally::default();
    for seed in first_seed()..first_seed() + count {
        let fill = scene.rules.round.as_ref().expect("a round").fill.max(2);
        let mut room = Room::filled("match", Arc::clone(&scene), seed, fill);
        let ann = Appearance::new("Ann", 0).expect("a good name");
        let seat = room.join(ann, None).expect("a seat").claim.seat;
        let mut play = person(seed);
        for seq in 1..=TICKS_MAX {
            let input = play(room.game(), seat);
            room.input(seat, seq, input);
            room.tick();
            let round = room.game().round().expect("a round");
            if round.phase == RoundPhase::Over {
                break;
            }
        }
        tally.add(room.game(), seat);
    }
    tally
}

impl Tally {
    fn add(&mut self, game: &Game, seat: Seat) {
        let round = game.round().expect("a round");
        let own = round.side_of(seat);
        match &round.winners[..] {
            [winner] if *winner == own => self.won += 1,
            winners if winners.contains(&own) || winners.is_empty() => self.shared += 1,
            _ => self.lost += 1,
        }
        self.seconds += u64::from(game.tick_count() / 60);
        let sides: Vec<Side> = match round.teams.len() {
            0 => round.players.iter().map(|player| Side::Player(player.seat)).collect(),
            teams => (0..teams as u8).map(Side::Team).collect(),
        };
        for side in sides {
            let score = round.side(side).map_or(0, |side| side.score.max(0)) as u64;
            self.points[usize::from(side != own)] += score;
        }
    }
}

/// The scenes in which people play against each other.
const SCENES: [&str; 7] = ["flags", "roundup", "hockey", "hill", "splash", "race", "pong"];

#[test]
fn an_idle_player_does_not_win_against_bots() {
    let won = SCENES.into_iter().filter(|name| {
        let idle = matches(name, MATCHES, |_| Box::new(|_, _| Input::default()));
        println!("{name}: an idle player won {}, drew {}", idle.won, idle.shared);
        idle.won > 0
    });
    let won: Vec<&str> = won.collect();
    assert!(won.is_empty(), "an idle player wins {won:?}");
}

/// Prints how often a scripted novice wins; the docs have the figures.
#[test]
fn a_novice_is_an_opponent_for_bots() {
    println!("| scene | won | drawn | lost | seconds per match | points, novice | others |");
    let mut scored = 0;
    for name in SCENES {
        let novice = matches(name, MATCHES, |seed| {
            let mut novice = Novice::new(seed);
            Box::new(move |game, seat| novice.play(game, seat))
        });
        let Tally { won, shared, lost, seconds, points: [own, others] } = novice;
        let each = seconds / MATCHES;
        println!("| `{name}` | {won} | {shared} | {lost} | {each} | {own} | {others} |");
        scored += own;
    }
    assert!(scored > 0, "the novice scores nothing in any scene");
}
