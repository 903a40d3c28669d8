//! Starts the scene's emitters when they are due, and reports every start.

use crate::event::Event;
use crate::scene::{Condition, Location, Scene, ScheduledEmitter};
use jostle_sim::Rng;
use jostle_sim::{BodyId, EmitterDef, Source, World};

/// Starts the scene's emitters that are due in this tick.
pub(crate) fn start_due(
    world: &mut World,
    scene: &Scene,
    placed: &[Option<BodyId>],
    tick: u32,
    allows: impl Fn(&Condition) -> bool,
    rng: &mut Rng,
    events: &mut Vec<Event>,
) {
    let numbered = (0..=u8::MAX).zip(&scene.emitters);
    let is_due = |of: &ScheduledEmitter| of.starts_at(tick) && allows(&of.condition);
    for (index, scheduled) in numbered.filter(|(_, scheduled)| is_due(scheduled)) {
        match scheduled.location {
            Location::Point(point) => {
                let seed = rng.next_u32();
                if world.start_emitter(scheduled.emitter(Source::Point(point), seed)) {
                    events.push(Event::ScheduledEmitterStarted { index, seed });
                }
            }
            Location::Body(body) => {
                if let Some(id) = placed[body] {
                    start(world, scheduled.emitter(Source::Body(id), rng.next_u32()), events);
                }
            }
        }
    }
}

/// Starts an emitter and reports it, unless the world has no room for it.
pub(crate) fn start(world: &mut World, emitter: EmitterDef, events: &mut Vec<Event>) {
    if world.start_emitter(emitter) {
        events.push(Event::EmitterStarted(emitter));
    }
}
