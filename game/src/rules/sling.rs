//! The sling: its ball waits at its start, is pulled back by a player, flies, and comes back.

use super::book::{Rules, Table};
use super::memory::Sling;
use crate::input::Buttons;
use crate::scene::{Scene, SlingSpec};
use glam::Vec2;
use jostle_sim::math::clamp_length;
use jostle_sim::{BodyId, World};

/// How far from the ball a pull may begin, as a share of how far it can be pulled: fingers are thick.
const GRAB: f32 = 1.0;

impl Rules {
    /// Before the step: lets players pull the ball, lets it go, and brings it back.
    pub fn work_sling(&mut self, table: &mut Table) {
        let (Some(spec), Some(mut sling)) = (table.scene.sling, self.sling) else { return };
        if sling.flight > 0 {
            sling.flight += 1;
            // Levels are those of the last tick: in the first one everything may still lie still.
            let settled = sling.flight > 2 && spec.over.is_some_and(|over| over.all(self.levels));
            let ball = table.roster.placed[spec.ball];
            if settled || sling.flight > spec.over_time || ball.is_none() {
                sling.flight = 0;
                self.end_shot(&spec, sling, table);
            }
        }
        let is_gone = table.roster.placed[spec.ball].is_none();
        if is_gone && sling.flight == 0 && sling.shots > 0 {
            self.reset(spec.ball, 0, table);
        }
        if let Some(ball) = table.roster.placed[spec.ball].filter(|_| sling.flight == 0) {
            let start = table.scene.bodies[spec.ball].def.position;
            let pull = if self.round.is_running() {
                pull(&spec, &mut sling, start, ball, table)
            } else {
                Vec2::ZERO
            };
            hold(table.world, ball, start + pull);
            let released = sling.shooter.is_some() && !sling.is_pulled;
            if let Some(velocity) = spec.launch(pull).filter(|_| released) {
                table.world.set_velocity(ball, velocity);
                let scale = table.scene.bodies[spec.ball].def.gravity_scale;
                table.world.set_gravity_scale(ball, scale);
                self.notes.of(ball, table.world).touched_by = sling.shooter;
                sling.shots = sling.shots.saturating_sub(1);
                sling.flight = 1;
            }
        }
        self.sling = Some(sling);
    }

    /// The ball comes back for the next shot, or is gone after the last one.
    fn end_shot(&mut self, spec: &SlingSpec, sling: Sling, table: &mut Table) {
        match (table.roster.placed[spec.ball], sling.shots > 0) {
            (_, true) => self.reset(spec.ball, 0, table),
            (Some(ball), false) => table.roster.remove(table.world, ball),
            (None, false) => {}
        }
    }
}

/// The way from its start to where the ball is pulled in this tick.
fn pull(spec: &SlingSpec, sling: &mut Sling, start: Vec2, ball: BodyId, table: &Table) -> Vec2 {
    let players = &table.roster.players;
    let is_held = sling.is_pulled && !table.roster.is_away(sling.shooter);
    if !is_held {
        let grabs = players.iter().find(|player| {
            let near = |aim: Vec2| aim.distance(start) <= GRAB * spec.pull;
            player.pressed(Buttons::FIRE) && player.aim.is_some_and(near)
        });
        if !sling.is_pulled || grabs.is_some() {
            sling.shooter = grabs.map(|player| player.seat);
            sling.is_pulled = grabs.is_some();
        }
    }
    let Some(shooter) = players.iter().find(|player| Some(player.seat) == sling.shooter) else {
        // Nobody pulls, or who did is gone.
        (sling.shooter, sling.is_pulled) = (None, false);
        return Vec2::ZERO;
    };
    // Silence of the connection lets nothing go.
    sling.is_pulled = shooter.holds(Buttons::FIRE) || shooter.is_away;
    let pulled = shooter.pointer.filter(|_| sling.is_pulled);
    clamp_length(pulled.unwrap_or_else(|| table.world.position(ball)) - start, spec.pull)
}

/// Keeps the ball where it is pulled to.
fn hold(world: &mut World, ball: BodyId, place: Vec2) {
    world.set_gravity_scale(ball, 0.0);
    world.set_position(ball, place);
    world.set_velocity(ball, Vec2::ZERO);
}

/// The path of a ball that is let go here, one point a tick until so many ticks are over, as long as it
/// meets nothing: by the engine's own steps, so that it flies exactly this way.
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
