//! The sling. Its ball waits at its start, is pulled back by a player, flies, and returns.

use super::body_notes::BodyNotes;
use super::context::RuleContext;
use crate::input::{Buttons, Seat};
use crate::scene::{Levels, Scene, SlingSpec};
use glam::Vec2;
use jostle_sim::math::clamp_length;
use jostle_sim::{BodyId, World};

/// Distance from the ball at which a pull may begin, as a share of the longest pull. It is generous because fingers are
/// thick.
const GRAB: f32 = 1.0;

/// State of a sling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sling {
    /// Shots left, including the one in the sling.
    pub shots: u8,
    /// The player who is pulling, or the last one who did.
    pub shooter: Option<Seat>,
    /// Whether the shooter holds the ball.
    pub is_pulled: bool,
    /// Ticks since the ball was released; 0 while it is in the sling.
    pub flight: u32,
}

impl Sling {
    /// The state of the sling at the start of a round.
    pub fn at_start(scene: &Scene) -> Option<Sling> {
        scene.sling.map(|spec| Sling { shots: spec.shots, ..Sling::default() })
    }

    /// Returns whether the last shot is over.
    pub fn is_spent(&self) -> bool {
        self.shots == 0 && self.flight == 0
    }

    /// The levels of the sling that conditions can refer to.
    pub fn levels(&self) -> Levels {
        let on = |holds, level| if holds { level } else { Levels::default() };
        on(self.is_spent(), Levels::SPENT).or(on(self.flight > 0, Levels::FLYING))
    }

    /// Before the step, lets players pull the ball, releases it, and brings it back. `levels` are those of the previous
    /// tick.
    pub fn work(
        &mut self,
        spec: &SlingSpec,
        levels: Levels,
        is_running: bool,
        notes: &mut BodyNotes,
        table: &mut RuleContext,
    ) {
        if self.flight > 0 {
            self.flight += 1;
            // In the first ticks, nothing may have moved yet.
            let settled = self.flight > 2 && spec.over.is_some_and(|over| over.all(levels));
            let ball = table.roster.placed[spec.ball];
            if settled || self.flight > spec.over_time || ball.is_none() {
                self.flight = 0;
                // The ball comes back for the next shot, and is removed after the last one.
                match (ball, self.shots > 0) {
                    (_, true) => notes.reset(spec.ball, 0, table),
                    (Some(ball), false) => table.roster.remove(table.world, ball),
                    (None, false) => {}
                }
            }
        }
        let is_gone = table.roster.placed[spec.ball].is_none();
        if is_gone && self.flight == 0 && self.shots > 0 {
            notes.reset(spec.ball, 0, table);
        }
        if let Some(ball) = table.roster.placed[spec.ball].filter(|_| self.flight == 0) {
            let start = table.scene.bodies[spec.ball].def.position;
            let pull = if is_running { pull(spec, self, start, ball, table) } else { Vec2::ZERO };
            hold(table.world, ball, start + pull);
            let released = self.shooter.is_some() && !self.is_pulled;
            if let Some(velocity) = spec.launch(pull).filter(|_| released) {
                table.world.set_velocity(ball, velocity);
                let scale = table.scene.bodies[spec.ball].def.gravity_scale;
                table.world.set_gravity_scale(ball, scale);
                notes.of(ball, table.world).touched_by = self.shooter;
                self.shots = self.shots.saturating_sub(1);
                self.flight = 1;
            }
        }
    }
}

/// Returns the offset from the ball's start to where it is pulled in this tick.
fn pull(
    spec: &SlingSpec,
    sling: &mut Sling,
    start: Vec2,
    ball: BodyId,
    table: &RuleContext,
) -> Vec2 {
    let players = &table.roster.players;
    let is_held = sling.is_pulled && !table.roster.is_away(sling.shooter);
    if !is_held {
        let grabs = players.iter().find(|player| {
            let near = |aim: Vec2| aim.distance(start) <= GRAB * spec.pull;
            player.controls.pressed(Buttons::FIRE) && player.controls.aim.is_some_and(near)
        });
        if !sling.is_pulled || grabs.is_some() {
            sling.shooter = grabs.map(|player| player.seat);
            sling.is_pulled = grabs.is_some();
        }
    }
    let Some(shooter) = players.iter().find(|player| Some(player.seat) == sling.shooter) else {
        // There is no shooter, or the shooter is gone.
        (sling.shooter, sling.is_pulled) = (None, false);
        return Vec2::ZERO;
    };
    // A silent connection does not release the ball.
    sling.is_pulled = shooter.controls.holds(Buttons::FIRE) || shooter.controls.is_away;
    let pulled = shooter.controls.pointer.filter(|_| sling.is_pulled);
    clamp_length(pulled.unwrap_or_else(|| table.world.position(ball)) - start, spec.pull)
}

/// Holds the ball at the position to which it is pulled.
fn hold(world: &mut World, ball: BodyId, place: Vec2) {
    world.set_gravity_scale(ball, 0.0);
    world.set_position(ball, place);
    world.set_velocity(ball, Vec2::ZERO);
}

/// The path of a ball released here, with one point per tick, for up to this many ticks, until it hits
/// something. It is computed with the engine's own steps, so the ball will fly exactly along it.
pub fn sling_path(scene: &Scene, pull: Vec2, ticks: u32) -> Vec<Vec2> {
    let Some((spec, velocity)) = scene.sling.and_then(|spec| Some((spec, spec.launch(pull)?)))
    else {
        return Vec::new();
    };
    let def = scene.bodies[spec.ball].def;
    let mut world = World::new(scene.world_settings());
    let def = jostle_sim::BodyDef { position: def.position + pull, velocity, ..def };
    let Some(ball) = world.add(&def) else { return Vec::new() };
    let mut path = Vec::new();
    for _ in 0..ticks {
        world.step();
        if !world.contains(ball) {
            break;
        }
        path.push(world.position(ball));
    }
    path
}
