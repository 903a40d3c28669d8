//! How a bot keeps away from dye packs where being hit costs a life.

use super::bot::Bot;
use super::bot_view::{BotView, OwnHero};
use super::terrain::Terrain;
use jostle_game::scene::Kind;
use jostle_sim::Vec2;
use jostle_sim::math::{cos, min, sin};

/// Distance within which a pack matters, world units.
const FEARED: f32 = 55.0;
/// Number of ways out that a bot considers.
const WAYS: u8 = 12;
/// How far a bot flies on a way out, world units, and the times at which it imagines itself on the way, seconds.
const RUN: f32 = 36.0;
const TIMES: [f32; 3] = [0.25, 0.5, 0.8];
/// Distance from all packs that is far enough, world units.
const SAFE: f32 = 40.0;
/// How much nearer to its destination a way has to end to make up for a unit less of distance from packs.
const WORTH: f32 = 0.25;

impl Bot {
    /// A place out of the way of the packs nearby, as far as possible on the way to `to`; `None` if there are none.
    pub(super) fn dodge(
        &self,
        view: &BotView,
        terrain: &Terrain,
        own: &OwnHero,
        to: Vec2,
    ) -> Option<Vec2> {
        if !view.aims.fears_packs {
            return None;
        }
        let world = view.game.world();
        let packs = view
            .game
            .bodies()
            .filter(|body| body.kind == Kind::Pack && body.owner != Some(self.seat));
        let late = self.late();
        let ahead = self.ahead(view, own);
        let from = ahead.at;
        let packs: Vec<(Vec2, Vec2)> = packs
            .map(|body| {
                let (at, velocity) = (world.position(body.id), world.velocity(body.id));
                (at + velocity * late, velocity)
            })
            .filter(|(at, _)| at.distance(from) < FEARED)
            .collect();
        if packs.is_empty() {
            return None;
        }
        let ways = (0..WAYS).map(|way| {
            let angle = f32::from(way) * (std::f32::consts::TAU / f32::from(WAYS));
            from + Vec2::new(cos(angle), sin(angle)) * RUN
        });
        let worth = |end: Vec2| {
            let near = |time: f32| {
                let at = from.lerp(end, time / TIMES[2]);
                packs.iter().map(move |(pack, velocity)| (*pack + *velocity * time).distance(at))
            };
            let nearest = TIMES.into_iter().flat_map(near).fold(SAFE, min);
            nearest - end.distance(to) * WORTH
        };
        let ways = ways.filter(|&end| terrain.has_room(end));
        let best = ways.map(|end| (end, worth(end))).max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(ahead.seen_from(own, best.0))
    }
}
