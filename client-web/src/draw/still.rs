//! A [`Game`] looked at directly, without snapshots: for pictures and rendered replays. Call
//! [`Still::watch`] after every tick, then [`Still::frame`] for the ticks that are drawn.

use crate::frame::{Effect, EffectKind, Frame, FrameBody, View};
use jostle_sim::{BodyId, BodyInfo, DT, Event, Game, PlayerInfo, Seat, Tools, Vec2};

/// Seconds for which effects are kept.
const EFFECT_S: f32 = 1.0;
/// Effects kept at a time; the oldest go first.
const EFFECTS_MAX: usize = 256;
/// Contacts slower than this throw no spark, units/s.
const SPARK_SPEED_MIN: f32 = 14.0;

/// What a frame needs beyond the game's present state: ages and recent events.
#[derive(Default)]
pub struct Still {
    bodies: Vec<FrameBody>,
    /// Tick at which a body was first seen, by index.
    births: Vec<Option<(BodyId, u32)>>,
    effects: Vec<Effect>,
    ticks: u32,
}

impl Still {
    /// Takes in the tick that `game` has just played.
    pub fn watch(&mut self, game: &Game) {
        self.ticks = game.tick_count();
        for effect in &mut self.effects {
            effect.age += DT;
        }
        self.effects.retain(|effect| effect.age < EFFECT_S);
        self.effects.extend(game.events().iter().filter_map(|event| effect(game, event)));
        let surplus = self.effects.len().saturating_sub(EFFECTS_MAX);
        self.effects.drain(..surplus);

        let players: Vec<PlayerInfo> = game.players().collect();
        self.bodies.clear();
        for info in game.bodies() {
            let age = self.age(info.id);
            self.bodies.push(body(game, &players, &info, age));
        }
        for touch in game.world().touches() {
            for id in [touch.a, touch.b] {
                if let Ok(at) = self.bodies.binary_search_by_key(&id.index, |b| b.id.index) {
                    self.bodies[at].touching = true;
                }
            }
        }
    }

    /// Seconds since a body was first seen.
    fn age(&mut self, id: BodyId) -> f32 {
        let index = id.index as usize;
        if index >= self.births.len() {
            self.births.resize(index + 1, None);
        }
        let born = match self.births[index] {
            Some((known, tick)) if known == id => tick,
            _ => self.ticks,
        };
        self.births[index] = Some((id, born));
        (self.ticks - born) as f32 * DT
    }

    /// What a camera shows now. Scenes made for their bounds show them.
    pub fn frame<'a>(&'a self, game: &'a Game, view: View) -> Frame<'a> {
        Frame {
            view,
            world_size: game.scene().size,
            bodies: &self.bodies,
            particles: game.world().particles(),
            recipes: &game.scene().recipes,
            particle_lead: 0.0,
            effects: &self.effects,
            time: self.ticks as f32 * DT,
            bounds: game.scene().tools.contains(Tools::SELECT),
            calm: false,
            own_seat: None,
            pointer: None,
            copy: 0,
            dimmed: false,
        }
    }
}

fn body(game: &Game, players: &[PlayerInfo], info: &BodyInfo, age: f32) -> FrameBody {
    let owner = players.iter().find(|player| info.owner == Some(player.seat));
    let gaze = owner
        .and_then(|player| player.pointer)
        .map(|quanta| Vec2::new(quanta[0] as f32, quanta[1] as f32) * game.scene().quantum);
    FrameBody {
        id: info.id,
        kind: info.kind,
        color: info.owner.map(color),
        shape: info.shape,
        center: game.world().position(info.id),
        velocity: game.world().velocity(info.id),
        age,
        gaze,
        touching: false,
        hidden: players.iter().any(|player| player.selected == Some(info.id)),
        hot: players.iter().any(|player| player.held == Some(info.id)),
        squash: None,
    }
}

fn effect(game: &Game, event: &Event) -> Option<Effect> {
    let (kind, point, color, strength, body) = match *event {
        Event::Impact { a, point, speed, .. } if speed >= SPARK_SPEED_MIN => {
            (EffectKind::Spark, point, None, speed, a)
        }
        Event::PackHit { owner, hero, point, .. } => {
            (EffectKind::Splash, point, Some(color(owner)), 0.0, hero)
        }
        Event::BodyLeft { body, point, .. } => {
            let inside = point.clamp(Vec2::ZERO, game.scene().size);
            (EffectKind::Gone, inside, None, 0.0, body)
        }
        _ => return None,
    };
    Some(Effect { kind, point, age: 0.0, color, strength, body: Some(body) })
}

/// The palette index of a player without a choice of its own.
fn color(seat: Seat) -> u8 {
    seat.0 % crate::palette::PLAYERS.len() as u8
}
