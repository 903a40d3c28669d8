//! The scripted players in a picture, who use the scene's tools.

use jostle_game::{Buttons, Game, Input, Scene, Seat, Tools};
use jostle_sim::Vec2;

/// Number of ticks between two shots by a player.
const SHOT_TICKS: u32 = 75;

/// The number of players in a scene.
pub fn players(scene: &Scene) -> u16 {
    let wanted = match scene.name.as_str() {
        "arena" => 6,
        "tower" | "bridge" => 4,
        // The room adds bots if there is a single player.
        "hockey" | "race" => 1,
        "pong" | "lock" | "lamp" => 4,
        "hill" | "splash" | "flags" | "herd" | "roundup" => 6,
        "hall" => 64,
        _ => 1,
    };
    scene.players_max.min(wanted)
}

/// The inputs of all players in this tick, in seat order.
pub fn inputs(game: &Game, tick: u32) -> Vec<(Seat, Input)> {
    let heroes: Vec<(Seat, Option<Vec2>)> = game
        .players()
        .map(|player| (player.seat, player.hero.map(|hero| game.world().position(hero))))
        .collect();
    heroes.iter().map(|&(seat, at)| (seat, input(game, tick, seat, at, &heroes))).collect()
}

fn input(
    game: &Game,
    tick: u32,
    seat: Seat,
    at: Option<Vec2>,
    heroes: &[(Seat, Option<Vec2>)],
) -> Input {
    let scene = game.scene();
    let mut buttons = Buttons::default();
    let mut pointer = wander(scene, tick, seat, 90);
    if let Some(at) = at.filter(|_| scene.tools.contains(Tools::STEER)) {
        buttons = steer(game, tick, seat, at);
        let others = heroes.iter().filter(|(other, _)| *other != seat).filter_map(|(_, p)| *p);
        let nearest = others.min_by(|a, b| a.distance(at).total_cmp(&b.distance(at)));
        pointer = nearest.map_or(pointer, |other| other + (at - other).clamp_length_max(24.0));
    }
    let busy = (tick + u32::from(seat.0) * 23) % SHOT_TICKS;
    if scene.tools.contains(Tools::LAUNCH) && busy == 0 {
        buttons.0 |= Buttons::FIRE.0;
    }
    if scene.tools.contains(Tools::SELECT) {
        pointer = scene.size * Vec2::new(0.42, 0.46);
        buttons = if tick > 5 { Buttons::FIRE } else { Buttons::PICK_HERO };
    }
    if let Some(sling) = &scene.sling {
        (buttons, pointer) = shoot(scene.bodies[sling.ball].def.position, tick);
    }
    if scene.tools.contains(Tools::SPRAY) {
        buttons.0 |= Buttons::MAKE.0;
        pointer = spray_point(scene, tick);
    }
    if scene.tools.contains(Tools::MARBLE)
        && seat.0 == 0
        && tick < drop_ticks(scene)
        && tick.is_multiple_of(12)
    {
        buttons.0 |= Buttons::MAKE.0;
        pointer = drop_point(scene, tick);
    }
    Input::new(buttons, Some(pointer))
}

/// Shoots once, then pulls the ball back for the next shot.
fn shoot(ball: Vec2, tick: u32) -> (Buttons, Vec2) {
    let pull = if tick < 400 { Vec2::new(-18.0, -8.0) } else { Vec2::new(-15.0, -11.0) };
    let share = (tick % 400 / 4).saturating_sub(48) as f32 / 4.0;
    let buttons = if share > 0.0 && tick % 400 < 216 { Buttons::FIRE } else { Buttons::default() };
    (buttons, ball + pull * (share - 0.25).clamp(0.0, 1.0))
}

/// Flies towards a point that changes from time to time.
fn steer(game: &Game, tick: u32, seat: Seat, at: Vec2) -> Buttons {
    let goal = wander(game.scene(), tick, seat, 150);
    let mut buttons = Buttons::default();
    if at.x < goal.x - 6.0 {
        buttons.0 |= Buttons::RIGHT.0;
    } else if at.x > goal.x + 6.0 {
        buttons.0 |= Buttons::LEFT.0;
    }
    if at.y < goal.y {
        buttons.0 |= Buttons::UP.0;
    }
    buttons
}

/// A point inside the world at which a player aims for a while.
fn wander(scene: &Scene, tick: u32, seat: Seat, ticks: u32) -> Vec2 {
    let mut bits =
        (tick / ticks).wrapping_mul(0x9e37_79b9) ^ u32::from(seat.0).wrapping_mul(0x85eb_ca6b);
    bits = (bits ^ bits >> 16).wrapping_mul(0x7feb_352d);
    bits ^= bits >> 15;
    let part = |shift: u32| (bits >> shift & 0xff) as f32 / 255.0;
    scene.size * Vec2::new(0.1 + 0.8 * part(0), 0.15 + 0.6 * part(12))
}

fn spray_point(scene: &Scene, tick: u32) -> Vec2 {
    let turn = tick as f32 / 60.0;
    scene.size * Vec2::new(0.5 + 0.22 * turn.sin(), 0.62 + 0.12 * (turn * 1.7).cos())
}

/// How long marbles are dropped, ticks: long enough to build a pile, but only briefly in scenes that should show
/// players.
fn drop_ticks(scene: &Scene) -> u32 {
    if scene.hero.is_none() { 3000 } else { 200 }
}

fn drop_point(scene: &Scene, tick: u32) -> Vec2 {
    let sway = (tick as f32 / 23.0).sin();
    scene.size * Vec2::new(0.62 + 0.10 * sway, 0.8)
}
