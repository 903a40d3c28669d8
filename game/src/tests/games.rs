//! The shipped games, played by players who are functions of what they see: each can be won, and whoever
//! does nothing loses.

use super::*;
use crate::rules::RoundPhase;
use crate::side::Side;

/// Ticks in which every game is over.
const TICKS_MAX: u32 = 20_000;

/// The keys that take a hero to a place: towards it, as fast as it can still stop there.
fn keys_to(game: &Game, hero: BodyId, place: Vec2) -> Buttons {
    let away = place - game.world().position(hero);
    let velocity = game.world().velocity(hero);
    let fall = if game.world().gravity_scale(hero) == 0.0 { 0.0 } else { 8.0 };
    let wanted = away * 2.5 - velocity + Vec2::new(0.0, fall);
    let key = |wanted: f32, more, less| match wanted {
        _ if wanted > 4.0 => more,
        _ if wanted < -4.0 => less,
        _ => Buttons::default(),
    };
    let across = key(wanted.x, Buttons::RIGHT, Buttons::LEFT);
    Buttons(across.0 | key(wanted.y, Buttons::UP, Buttons::DOWN).0)
}

/// Plays a game of so many players to the end of its first round; `place` is where each wants to be, if
/// anywhere. Returns who won.
fn winners(
    name: &str,
    players: u16,
    mut place: impl FnMut(&Game, Seat, BodyId) -> Option<Vec2>,
) -> Vec<Side> {
    let mut game = built_in(name, 5);
    (0..players).for_each(|seat| game.join(Seat(seat)));
    for _ in 0..TICKS_MAX {
        let heroes: Vec<(Seat, Option<BodyId>)> =
            game.players().map(|player| (player.seat, player.hero)).collect();
        let inputs = heroes.iter().map(|&(seat, hero)| {
            let goal = hero.and_then(|hero| Some((hero, place(&game, seat, hero)?)));
            let buttons = goal.map_or(Buttons::default(), |(hero, at)| keys_to(&game, hero, at));
            (seat, Input { buttons, pointer: None })
        });
        let inputs: Vec<(Seat, Input)> = inputs.collect();
        game.tick(&inputs);
        let round = game.round().expect("a round");
        if round.phase == RoundPhase::Over {
            return round.winners;
        }
    }
    panic!("{name} has no end: {:?}", game.round());
}

fn puck(game: &Game) -> Vec2 {
    let id = game.roster.placed[0].expect("a puck");
    game.world().position(id)
}

#[test]
fn hockey_is_won_by_who_goes_for_the_puck() {
    let won = winners("hockey", 2, |game, seat, hero| {
        let (puck, here) = (puck(game), game.world().position(hero));
        if seat == Seat(1) || puck.x > 146.0 {
            return None;
        }
        // From behind it, through it, towards the goal.
        let aim = (Vec2::new(265.0, 60.0) - puck).normalize();
        let behind = puck - aim * 16.0;
        let is_behind = (here - puck).normalize().dot(aim) < -0.9;
        Some(if is_behind { puck + aim * 60.0 } else { behind })
    });
    assert_eq!(won, [Side::Team(0)]);
}

#[test]
fn pong_is_won_by_who_follows_the_ball() {
    let won = winners("pong", 2, |game, seat, hero| {
        let ball = puck(game);
        let here = game.world().position(hero);
        (seat == Seat(1)).then_some(Vec2::new(here.x, ball.y))
    });
    assert_eq!(won, [Side::Team(1)]);
}

#[test]
fn four_play_pong_and_the_last_one_wins() {
    let won = winners("pong", 4, |game, seat, hero| {
        let (ball, here) = (puck(game), game.world().position(hero));
        let place = if seat.0 < 2 { Vec2::new(here.x, ball.y) } else { Vec2::new(ball.x, here.y) };
        (seat == Seat(2)).then_some(place)
    });
    assert_eq!(won, [Side::Team(2)]);
}

#[test]
fn the_hill_is_won_by_who_stands_on_it() {
    let won = winners("hill", 3, |game, seat, hero| {
        let here = game.world().position(hero);
        // Around the shelf, not through it from below.
        let place = match (here.x > 116.0, here.y > 98.0) {
            (true, true) | (false, true) => Vec2::new(140.0, 97.0),
            (true, false) if here.y > 92.0 => Vec2::new(140.0, 97.0),
            (true, false) => Vec2::new(106.0, 70.0),
            (false, false) => Vec2::new(108.0, 108.0),
        };
        (seat == Seat(2)).then_some(place)
    });
    assert_eq!(won, [Side::Player(Seat(2))]);
}

#[test]
fn the_race_is_won_by_who_makes_three_laps() {
    let way = [
        (120.0, 62.0),
        (205.0, 62.0),
        (212.0, 20.0),
        (250.0, 24.0),
        (312.0, 40.0),
        (314.0, 95.0),
        (312.0, 145.0),
        (258.0, 142.0),
        (222.0, 142.0),
        (195.0, 176.0),
        (150.0, 180.0),
        (85.0, 160.0),
        (60.0, 110.0),
        (60.0, 60.0),
    ];
    let mut next = 0;
    let won = winners("race", 2, |game, seat, hero| {
        if seat == Seat(1) {
            return None;
        }
        let (x, y) = way[next % way.len()];
        let place = Vec2::new(x, y);
        if (game.world().position(hero) - place).length() < 16.0 {
            next += 1;
        }
        Some(place)
    });
    assert_eq!(won, [Side::Player(Seat(0))]);
}

/// Who does nothing does not win: time decides, and all share.
#[test]
fn a_game_in_which_nobody_moves_ends_at_its_time() {
    for (name, ticks) in [("hockey", 300 * 60), ("hill", 240 * 60), ("race", 180 * 60)] {
        let mut game = built_in(name, 5);
        (0..2).for_each(|seat| game.join(Seat(seat)));
        // Three seconds of countdown come first.
        idle(&mut game, ticks + 179);
        assert_eq!(game.round().expect("a round").phase, RoundPhase::Running, "{name}");
        idle(&mut game, 1);
        let round = game.round().expect("a round");
        assert_eq!((round.phase, round.winners.len()), (RoundPhase::Over, 2), "{name}");
    }
}
