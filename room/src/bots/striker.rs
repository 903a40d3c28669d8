//! How a bot plays a ball where heroes run and jump: it runs into the ball from behind. From the other side it first
//! jumps over the ball.

use super::bot::Bot;
use super::bot_view::{BotView, OwnHero};
use super::walker::Walker;
use jostle_sim::{BodyId, Vec2};

/// Distance that a bot keeps from a ball until it runs into it, and by which it misses the best place to jump off, world
/// units.
const GAP: f32 = 5.0;
/// How far through a ball a bot aims, so that it keeps running, world units.
const THROUGH: f32 = 25.0;
/// Speed below which a ball that a bot pushes does not move, units/s.
const STUCK_SPEED: f32 = 5.0;
/// Ticks for which a bot pushes a ball that does not move, before it thinks of making way, and number of looks at one of
/// which it then does. It is at random because two bots that make way at the same time would soon push against each other
/// again.
const PUSH_TICKS: u32 = 30;
const YIELD_LOOKS: u32 = 20;
/// Minimum number of ticks for which it makes way, and the random range added to it.
const YIELD_TICKS: u32 = 30;
const YIELD_MORE: u32 = 60;

impl Bot {
    /// The place of a hero that walks, to get a ball to `goal`. The bot remembers whether it has to jump.
    pub(super) fn place_afoot(
        &mut self,
        view: &BotView,
        own: &OwnHero,
        walker: &Walker,
        ball: BodyId,
        goal: Vec2,
    ) -> Vec2 {
        let world = view.game.world();
        let (now, velocity) = (world.position(ball), world.velocity(ball));
        let (half, radius) = (world.shape(own.hero).half_extent(), world.shape(ball).half_extent());
        let at = now + velocity * self.late();
        let way = if goal.x < now.x { -1.0 } else { 1.0 };
        let beyond = |distance: f32| Vec2::new(at.x + way * distance, at.y);
        let clear = half.x + radius.x;
        let rise = now.y + radius.y - (own.at.y - half.y);
        let is_behind = (own.at.x - now.x) * way < 0.0;
        let touches =
            (own.at.x - now.x).abs() < clear + GAP && (own.at.y - now.y).abs() < half.y + radius.y;
        let pushes = is_behind && touches && velocity.x.abs() < STUCK_SPEED;
        if self.yields(view.game.tick_count(), pushes) {
            return beyond(-clear - THROUGH);
        }
        if rise <= 0.0 {
            // Over the ball, it comes down behind it.
            return beyond(-clear - GAP);
        }
        if is_behind {
            return beyond(THROUGH);
        }
        let Some(run_up) = walker.run_up(rise) else { return own.at };
        let gap = (walker.at().x - at.x).abs() - clear - run_up;
        self.memory.leaps = gap < GAP;
        if gap < 0.0 {
            Vec2::new(walker.at().x + way * GAP, own.at.y)
        } else {
            beyond(-clear - GAP)
        }
    }

    /// Returns whether the bot makes way for a while, because it has pushed in vain for some time.
    fn yields(&mut self, tick: u32, pushes: bool) -> bool {
        if self.memory.yields_until.is_some_and(|until| tick < until) {
            return true;
        }
        let since = self.memory.pushes_since.filter(|_| pushes).unwrap_or(tick);
        self.memory.pushes_since = pushes.then_some(since);
        let is_stuck = tick > since + PUSH_TICKS && self.rng.below(YIELD_LOOKS) == 0;
        if is_stuck {
            let ticks = YIELD_TICKS + self.rng.below(YIELD_MORE);
            self.memory.yields_until = Some(tick + ticks);
            self.memory.pushes_since = None;
        }
        is_stuck
    }
}
