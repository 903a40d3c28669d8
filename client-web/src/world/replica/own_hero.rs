//! The own hero on display: where the snapshots have it, and where prediction shows it instead.

use super::Replica;
use crate::world::predict::Predicted;
use jostle_game::Seat;
use jostle_protocol::PlayerState;
use jostle_sim::Vec2;
use jostle_sim::particles::dequantise;

impl Replica {
    /// Shows a body elsewhere than the snapshots do: the own hero, as predicted.
    pub fn lead(&mut self, own: Predicted) {
        let Some(place) = self.samples.iter().position(|sample| sample.id == own.id) else {
            return;
        };
        let Predicted { center, velocity, .. } = own;
        self.led_from = Some((self.samples[place].center, self.samples[place].velocity));
        let (sample, body) = (&mut self.samples[place], &mut self.bodies[place]);
        (sample.center, sample.velocity) = (center, velocity);
        (body.center, body.velocity) = (center, velocity);
    }

    /// Centre and velocity of the own hero as the snapshots have it at the displayed moment, also
    /// while it is shown elsewhere.
    pub fn own_hero_as_told(&self) -> Option<(Vec2, Vec2)> {
        self.led_from.or_else(|| self.own_hero().map(|hero| (hero.center, hero.velocity)))
    }

    /// Centre and velocity of a player's hero at the displayed moment.
    pub fn hero_of(&self, seat: Seat) -> Option<(Vec2, Vec2)> {
        let hero = self.players().iter().find(|player| player.seat == seat)?.hero?;
        let sample = self.samples.iter().find(|sample| sample.id == hero)?;
        Some((sample.center, sample.velocity))
    }

    /// The middle of a hero's upper edge, at the displayed moment.
    pub fn top_of_hero(&self, player: &PlayerState) -> Option<Vec2> {
        let hero = player.hero.and_then(|id| self.bodies().iter().find(|body| body.id == id))?;
        Some(hero.center + Vec2::new(0.0, hero.shape.half_extent().y))
    }

    /// Position of the player's hero in the newest snapshot, whatever is on display.
    pub fn told_place(&self) -> Option<Vec2> {
        let newest = self.newest()?;
        let hero = newest.players.iter().find(|p| p.seat == self.seat)?.hero?;
        let body = newest.bodies.iter().find(|body| body.id == hero)?;
        Some(dequantise(body.quanta, self.scene.world.quantum))
    }
}
