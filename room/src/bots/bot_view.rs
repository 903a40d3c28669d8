//! What bots see of a game.

use super::aims::Aims;
use jostle_game::{Game, RoundInfo, Seat};
use jostle_sim::{BodyId, Motion, Vec2};

/// Speed at which a bot flies to a place, units/s per unit of distance.
pub const GAIN: f32 = 2.5;

/// The game as bots see it in one tick: what players see, and what the rules ask for.
#[derive(Clone, Copy)]
pub struct BotView<'a> {
    pub game: &'a Game,
    pub round: Option<&'a RoundInfo>,
    pub aims: &'a Aims,
}

/// The state of a bot's own hero.
#[derive(Clone, Copy, Debug)]
pub struct OwnHero {
    pub hero: BodyId,
    pub at: Vec2,
    pub velocity: Vec2,
    pub team: Option<u8>,
}

impl OwnHero {
    /// The place to which the hero has to fly from where it is `now`, to fly to `place` from where it will be.
    pub fn seen_from(&self, now: &OwnHero, place: Vec2) -> Vec2 {
        place + now.at - self.at - (self.velocity - now.velocity) / GAIN
    }
}

impl BotView<'_> {
    /// The hero of a seat, if it has any.
    pub fn own(&self, seat: Seat) -> Option<OwnHero> {
        let hero = self.game.players().find(|player| player.seat == seat)?.hero?;
        let world = self.game.world();
        let team = self.round.and_then(|round| round.player(seat)?.team);
        Some(OwnHero { hero, at: world.position(hero), velocity: world.velocity(hero), team })
    }

    /// Seats and heroes of the others in a seat's team.
    pub fn mates(&self, seat: Seat) -> impl Iterator<Item = (Seat, BodyId)> + '_ {
        let of_team = self.others(seat, true);
        of_team.filter(move |&(other, _)| other != seat)
    }

    /// Seats and heroes of the other sides.
    pub fn rivals(&self, seat: Seat) -> impl Iterator<Item = (Seat, BodyId)> + '_ {
        self.others(seat, false)
    }

    fn others(&self, seat: Seat, is_own: bool) -> impl Iterator<Item = (Seat, BodyId)> + '_ {
        let side = self.round.map(|round| round.side_of(seat));
        let of_side = self.game.players().filter(move |player| {
            (self.round.map(|round| round.side_of(player.seat)) == side) == is_own
        });
        of_side.filter_map(|player| Some((player.seat, player.hero?)))
    }

    /// The movable bodies in these groups.
    pub fn balls(&self, groups: u32) -> impl Iterator<Item = BodyId> + '_ {
        let world = self.game.world();
        let of_group = self.game.bodies().filter(move |body| groups >> body.group & 1 == 1);
        of_group.map(|body| body.id).filter(|&id| world.motion(id) == Motion::Dynamic)
    }

    /// Position and velocity of the nearest movable body in these groups.
    pub fn nearest_ball(&self, groups: u32, at: Vec2) -> Option<(Vec2, Vec2)> {
        let world = self.game.world();
        let ball = self.nearest(groups, at)?;
        Some((world.position(ball), world.velocity(ball)))
    }

    /// The nearest movable body in these groups.
    pub fn nearest(&self, groups: u32, at: Vec2) -> Option<BodyId> {
        let near = |id: BodyId| self.game.world().position(id).distance_squared(at);
        self.balls(groups).min_by(|&a, &b| near(a).total_cmp(&near(b)))
    }
}
