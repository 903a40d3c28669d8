//! The data that rules act on.

use crate::emitters;
use crate::event::Event;
use crate::rngs::Rngs;
use crate::roster::Roster;
use crate::scene::Scene;
use jostle_sim::{BodyId, EmitterDef, Source, World};

/// Number of particles in a splash.
const SPLASH_PARTICLES: u16 = 40;

/// The data that rules act on.
pub(crate) struct RuleContext<'a> {
    pub scene: &'a Scene,
    pub world: &'a mut World,
    pub roster: &'a mut Roster,
    pub rngs: &'a mut Rngs,
    pub events: &'a mut Vec<Event>,
}

impl RuleContext<'_> {
    /// Emits particles at a body.
    pub fn splash(&mut self, recipe: u8, body: BodyId) {
        let source = Source::Point(self.world.position(body));
        let seed = self.rngs.emit.next_u32();
        let emitter = EmitterDef { recipe, count: SPLASH_PARTICLES, seed, source };
        emitters::start(self.world, emitter, self.events);
    }
}
