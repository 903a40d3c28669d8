//! Where a bot wants to be: the place that the rules reward most.

use super::aims::{Errand, Goal, middle, nearest_inside, zone_of};
use super::bot::Bot;
use super::bot_view::{BotView, OwnHero};
use super::terrain::Terrain;
use super::walker::Walker;
use jostle_game::scene::ZoneSpec;
use jostle_sim::{BodyId, Vec2};

/// Distance from a ball within which an obstacle does not keep a bot from reaching it, world units.
const NEAR_SIDE: f32 = 22.0;
/// How far beyond a gate a bot aims, so that it does not slow down in it, world units.
const THROUGH: f32 = 25.0;
/// Ticks for which a bot leaves a step of a quest to a mate who is nearer, so that they do not push each other.
const PATIENCE_TICKS: u32 = 900;

impl Bot {
    /// The place to be at. `walker` is the hero if it walks.
    pub(super) fn place(
        &mut self,
        view: &BotView,
        terrain: &Terrain,
        own: &OwnHero,
        walker: Option<&Walker>,
    ) -> Vec2 {
        let scene = view.game.scene();
        if let Some(&zone) = view.aims.gates.get(self.memory.gate) {
            // Through the gate, not only up to it.
            let near = nearest_inside(zone_of(view.game.scene(), zone), scene.size, own.at);
            return near + (near - own.at).normalize_or_zero() * THROUGH;
        }
        if let Some(zone) = view.aims.hill.filter(|_| self.ease < 1.0) {
            let spread = Vec2::new(self.miss().x * 2.0, 0.0);
            return middle(zone_of(view.game.scene(), zone), scene.size) + spread;
        }
        let place = self.place_of_errand(view, own);
        let place = place.or_else(|| self.place_of_herder(view, terrain, own));
        let place = place.or_else(|| self.place_at_ball(view, terrain, own, walker));
        let place = place.or_else(|| self.place_of_quest(view, own));
        if let Some(place) = place.or_else(|| self.place_of_coin(view, own)) {
            return place;
        }
        let is_bored = self.rng.below(40) == 0;
        let roams_to = &mut self.memory.roams_to;
        if is_bored || roams_to.is_none_or(|place| place.distance(own.at) < 20.0) {
            let (x, y) = (self.rng.range(0.1, 0.9), self.rng.range(0.1, 0.8));
            *roams_to = Some(Vec2::new(x, y) * scene.size);
        }
        roams_to.unwrap_or(own.at)
    }

    /// Where to carry a thing that belongs elsewhere, where to get it, or where a thing is that must be sent back.
    fn place_of_errand(&mut self, view: &BotView, own: &OwnHero) -> Option<Vec2> {
        let (game, world) = (view.game, view.game.world());
        let is_own = |errand: &&Errand| errand.team.is_none() || errand.team == own.team;
        let fetch = view.aims.fetches.iter().find(is_own)?;
        let home = middle(zone_of(view.game.scene(), fetch.zone), game.scene().size);
        let (thing, _) = view.nearest_ball(fetch.things, own.at)?;
        let lost = view.aims.guards.iter().filter(is_own).find_map(|guard| {
            let (at, velocity) = view.nearest_ball(guard.things, own.at)?;
            (!zone_of(view.game.scene(), guard.zone).holds(at)).then_some(at + velocity * 0.2)
        });
        let is_thing = |id: BodyId| fetch.things >> world.group(id) & 1 == 1;
        let carriers = game.players().filter(|player| player.carried.is_some_and(is_thing));
        let carrier = carriers.map(|player| player.seat).next();
        let has_mates = view.mates(self.seat).next().is_some();
        Some(match (carrier, lost) {
            // The thing, not the hero, has to be in the zone. It waits there while mates fetch what is lost.
            (Some(seat), lost) if seat == self.seat && (lost.is_none() || has_mates) => {
                home - (thing - own.at)
            }
            (Some(_), Some(lost)) => lost,
            (Some(_), None) => home,
            (None, Some(lost)) if self.guards(view, own) => lost,
            (None, Some(lost)) if lost.distance(own.at) < thing.distance(own.at) => lost,
            (None, _) => thing,
        })
    }

    /// Returns whether the bot is one of the defenders, which every second player of a team is.
    pub(super) fn guards(&self, view: &BotView, own: &OwnHero) -> bool {
        let mates = view.round.iter().flat_map(|round| &round.players);
        mates.filter(|mate| mate.team == own.team && mate.seat < self.seat).count() % 2 == 1
    }

    /// A place behind the ball, or beyond it so that the bot hits it. The team's player nearest to the ball attacks;
    /// the others stay between the ball and their own goal.
    fn place_at_ball(
        &mut self,
        view: &BotView,
        terrain: &Terrain,
        own: &OwnHero,
        walker: Option<&Walker>,
    ) -> Option<Vec2> {
        let (scene, team) = (view.game.scene(), own.team);
        let attacked = view.aims.goals.iter().find(|goal| goal.is_good_for(team))?;
        let goal = |goal: &Goal| middle(zone_of(view.game.scene(), goal.zone), scene.size);
        let (ball, velocity) = view.nearest_ball(attacked.balls, own.at)?;
        let defended = view.aims.goals.iter().find(|goal| !goal.is_good_for(team));
        let late = (own.at.distance(ball) / 110.0).clamp(0.0, 0.5);
        let ball = ball + velocity * late;
        if let Some(home) = defended.map(goal) {
            let near_side = ball + (own.at - ball).clamp_length_max(NEAR_SIDE);
            // Whoever stands on something is as near to it as to an obstacle.
            let is_far = walker.is_none() && !terrain.is_open(own.at, near_side);
            if is_far || (self.guards(view, own) && own.at.distance(ball) > 45.0) {
                let share = if self.guards(view, own) { 0.25 } else { 0.4 };
                return Some(home.lerp(ball, share));
            }
        }
        if let Some(walker) = walker {
            let ball = view.nearest(attacked.balls, own.at)?;
            return Some(self.place_afoot(view, own, walker, ball, goal(attacked)));
        }
        let miss = self.miss();
        let aim = (goal(attacked) + miss * 2.0 - ball).normalize_or_zero();
        Some(place_behind(own, ball, aim, 16.0) + miss * 0.3)
    }

    /// The next zone to touch.
    fn place_of_quest(&mut self, view: &BotView, own: &OwnHero) -> Option<Vec2> {
        let is_own = |team: Option<u8>| team.is_none() || team == own.team;
        let quest = view.aims.quests.iter().find(|quest| is_own(quest.team))?;
        let (world, size) = (view.game.world(), view.game.scene().size);
        let touches = |hero: BodyId, zone: &ZoneSpec| {
            let (at, half) = (world.position(hero), world.shape(hero).half_extent());
            let reach = if zone.touch { half } else { Vec2::ZERO };
            zone.holds(at + (middle(zone, size) - at).clamp(-reach, reach))
        };
        let mut step = self.memory.step;
        if let Some(at) = quest.steps.get(step) {
            let zone = zone_of(view.game.scene(), at.zone);
            let mates = view.mates(self.seat).map(|(_, hero)| hero);
            if mates.chain([own.hero]).any(|hero| touches(hero, zone)) {
                step += 1;
                let ends = at.lasts.map(|ticks| view.game.tick_count() + ticks);
                self.memory.ends = ends.or(self.memory.ends);
            }
        }
        step = quest.resume(step, view.round);
        let is_late = self.memory.ends.is_some_and(|ends| view.game.tick_count() > ends);
        if let Some(at) = quest.steps.get(step).filter(|step| is_late && step.is_of_order()) {
            (step, self.memory.ends) = (at.first, None);
        }
        let last = quest.steps.last().map(|last| zone_of(view.game.scene(), last.zone));
        if step >= quest.steps.len() && !last.is_some_and(|zone| touches(own.hero, zone)) {
            // What was won once can be won again.
            step = 0;
        }
        let tick = view.game.tick_count();
        if step != self.memory.step || self.memory.patience.is_none() {
            self.memory.patience = Some(tick + PATIENCE_TICKS);
        }
        self.memory.step = step;
        let place = middle(zone_of(view.game.scene(), quest.steps.get(step)?.zone), size);
        let away = |hero: BodyId| world.position(hero).distance(place);
        let is_mates = view.mates(self.seat).any(|(_, mate)| away(mate) < away(own.hero));
        let waits = is_mates && self.memory.patience.is_some_and(|until| tick < until);
        Some(if waits { own.at } else { place })
    }

    /// The nearest thing that is worth touching.
    fn place_of_coin(&self, view: &BotView, own: &OwnHero) -> Option<Vec2> {
        let world = view.game.world();
        let coins = view.game.bodies().filter(|body| view.aims.coins >> body.group & 1 == 1);
        let coins = coins.map(|body| world.position(body.id));
        coins.min_by(|a, b| a.distance(own.at).total_cmp(&b.distance(own.at)))
    }
}

/// A place behind a ball that is to move along `aim`, or beyond the ball once the bot is behind it.
fn place_behind(own: &OwnHero, ball: Vec2, aim: Vec2, reach: f32) -> Vec2 {
    let off = own.at - ball;
    if off.normalize_or_zero().dot(aim) < -0.85 {
        ball + aim * 50.0
    } else if off.dot(aim) > 0.0 {
        // The bot flies around the ball.
        let side = aim.perp() * if aim.perp_dot(off) < 0.0 { -reach } else { reach };
        ball + side - aim * reach
    } else {
        ball - aim * reach
    }
}
