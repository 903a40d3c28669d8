//! Bots are players run by the room that take seats until people come (`round.fill` in a scene). They see only what
//! players see, and their inputs are recorded like people's, so that a replay needs no bots.

mod aims;
mod bot;
mod bot_view;
mod destination;
mod dodge;
mod herder;
mod quest;
mod skill;
mod slinger;
mod striker;
mod terrain;
mod walker;

use aims::Aims;
use bot::Bot;
use bot_view::BotView;
use jostle_game::{Buttons, Game, Input, RoundInfo, Seat, Side};
use jostle_protocol::Appearance;
use jostle_protocol::limits::COLORS;
use jostle_sim::math::max;
use jostle_sim::{Rng, Vec2};
use terrain::Terrain;

/// Number of ticks between surveys of the obstacles.
const SURVEY_TICKS: u32 = 30;
/// Lead over the best person, as a share of the points or lives of a round, that a bot has to have to play at its
/// slowest.
const EASE_LEAD: f32 = 0.15;
/// Points of a round without a number of its own.
const EASE_POINTS: i32 = 20;
/// The random stream, derived from the seed, that the bots use.
const STREAM: u64 = 0x626f_7473;
const NAMES: [&str; 8] = [
    "Bot Ada",
    "Bot Grace",
    "Bot Alan",
    "Bot Edsger",
    "Bot Barbara",
    "Bot Donald",
    "Bot Niklaus",
    "Bot Radia",
];

/// A player's recent activity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Nothing yet, having just come.
    New,
    /// Something.
    Active,
    /// Nothing for a while.
    Idle,
}

/// A room's bots.
pub(crate) struct Bots {
    /// Number of seats that bots fill while there are not enough people.
    fill: usize,
    aims: Aims,
    terrain: Terrain,
    /// What players see of the round, whose memory is kept between ticks.
    round: Option<RoundInfo>,
    /// Sorted by seat.
    bots: Vec<Bot>,
    rng: Rng,
}

impl Bots {
    /// Creates the bots for a game; `None` if the scene uses no bots.
    pub fn of(game: &Game, seed: u64) -> Option<Bots> {
        let round = game.scene().rules.round.as_ref()?;
        Bots::filling(game, seed, usize::from(round.fill))
    }

    /// Creates bots that fill the room until this many seats are taken; `None` if `fill` is 0 or players have neither
    /// heroes nor a sling.
    pub fn filling(game: &Game, seed: u64, fill: usize) -> Option<Bots> {
        let scene = game.scene();
        if fill == 0 || scene.hero.is_none() && scene.sling.is_none() {
            return None;
        }
        let half = scene.hero.as_ref().map_or(Vec2::ONE, |hero| hero.body.shape.half_extent());
        let terrain = Terrain::new(scene.size, half);
        let (aims, rng) = (Aims::of(scene), Rng::new(seed, STREAM));
        Some(Bots { fill, aims, terrain, round: None, bots: Vec::new(), rng })
    }

    /// Number of seats that bots fill while there are not enough people.
    pub fn fill(&self) -> usize {
        self.fill
    }

    /// Lowers the number of seats that bots fill; it never exceeds the scene's number.
    pub fn set_fill(&mut self, fill: usize) {
        self.fill = self.fill.min(fill);
    }

    /// Number of bots.
    pub fn count(&self) -> usize {
        self.bots.len()
    }

    /// Number of bots wanted in addition to this many people.
    pub fn wanted(&self, people: usize) -> usize {
        if people == 0 { 0 } else { self.fill.saturating_sub(people) }
    }

    /// The bots' seats, in increasing order.
    pub fn seats(&self) -> impl Iterator<Item = Seat> {
        self.bots.iter().map(|bot| bot.seat)
    }

    /// Returns whether a bot has this seat.
    pub fn has(&self, seat: Seat) -> bool {
        self.bots.binary_search_by_key(&seat, |bot| bot.seat).is_ok()
    }

    /// The appearance that the next bot requests.
    pub fn look(&self) -> Appearance {
        let number = self.bots.len();
        let color = ((number + 1) % usize::from(COLORS)) as u8;
        Appearance { name: NAMES[number % NAMES.len()].to_owned().into(), color }
    }

    pub fn add(&mut self, seat: Seat) {
        let at = self.bots.partition_point(|bot| bot.seat < seat);
        let rng = Rng::new(u64::from(self.rng.next_u32()), STREAM);
        self.bots.insert(at, Bot::new(seat, rng));
    }

    /// Removes a bot from the team with the most players, and returns the bot's seat.
    pub fn remove(&mut self, game: &Game) -> Option<Seat> {
        let round = game.round();
        let team = |seat| round.as_ref().and_then(|round| round.player(seat)?.team);
        let size = |bot: &Bot| {
            let own = team(bot.seat);
            let players = round.iter().flat_map(|round| &round.players);
            players.filter(|player| player.team == own).count()
        };
        let largest = (0..self.bots.len()).max_by_key(|&index| size(&self.bots[index]))?;
        Some(self.bots.remove(largest).seat)
    }

    /// Removes this bot permanently, so that bots fill one seat fewer from now on.
    pub fn dismiss(&mut self, seat: Seat, people: usize) -> bool {
        let Ok(index) = self.bots.binary_search_by_key(&seat, |bot| bot.seat) else { return false };
        self.bots.remove(index);
        self.fill = people + self.bots.len();
        true
    }

    /// The bot that should change teams: the first one on the largest team, if that team has at least two players more
    /// than the smallest.
    fn out_of_balance(&self) -> Option<Seat> {
        let round = self.round.as_ref()?;
        let size = |team| round.players.iter().filter(|player| player.team == Some(team)).count();
        let teams = (0..).zip(&round.teams).filter(|(_, info)| info.is_in);
        let sizes: Vec<(usize, u8)> = teams.map(|(team, _)| (size(team), team)).collect();
        let (&(smallest, _), &(_, largest)) = (sizes.iter().min()?, sizes.iter().max()?);
        let mut of_largest =
            self.bots.iter().map(|bot| bot.seat).filter(|&seat| {
                round.player(seat).is_some_and(|player| player.team == Some(largest))
            });
        of_largest.next().filter(|_| size(largest) >= smallest + 2)
    }

    /// Lets bots that are ahead of the best person play less well, the further they are ahead. They do not spare people
    /// who do nothing yet, or nothing any more. Where all people of a team do nothing any more, its bots do not win for
    /// them.
    fn ease(&mut self, game: &Game, activity: impl Fn(Seat) -> Option<Activity>) {
        let Some(round) = self.round.take() else { return };
        let rules = game.scene().rules.round.as_ref();
        let goal = rules.and_then(|round| round.goal.or(round.lives)).unwrap_or(EASE_POINTS) as f32;
        let gates = self.aims.gates.len().max(1) as f32;
        let standing = |seat: Seat| {
            let side = round.side_of(seat);
            let of_side = round
                .orders
                .iter()
                .filter(|order| order.side == Some(side) || order.side == Some(Side::Player(seat)));
            let laps = of_side.map(|order| f32::from(order.steps) / gates).fold(0.0, max);
            round.side(side).map_or(0.0, |side| (side.score + side.lives) as f32 + laps)
        };
        let people = round.players.iter().map(|player| player.seat).filter(|&seat| !self.has(seat));
        let that_are = |which| -> Vec<Seat> {
            people.clone().filter(|&seat| activity(seat) == Some(which)).collect()
        };
        let [new, active, idle] = [Activity::New, Activity::Active, Activity::Idle].map(that_are);
        let best = active.iter().map(|&seat| standing(seat)).reduce(max);
        for bot in &mut self.bots {
            let side = round.side_of(bot.seat);
            let is_in = |people: &[Seat]| people.iter().any(|&seat| round.side_of(seat) == side);
            let lead = best.map(|best| (standing(bot.seat) - best) / (goal * EASE_LEAD));
            bot.waits = is_in(&idle) && !is_in(&active) && !is_in(&new);
            let lead = lead.or(is_in(&new).then_some(0.0));
            bot.ease(lead.map(|lead| lead.clamp(0.0, 1.0)));
        }
        self.round = Some(round);
    }

    /// From time to time, looks at the obstacles, and at how people do.
    pub fn survey(&mut self, game: &Game, activity: impl Fn(Seat) -> Option<Activity>) {
        if self.is_due(game) {
            game.capture_round(&mut self.round);
            self.ease(game, activity);
            self.terrain.survey(game);
        }
    }

    /// Returns whether this is the tick of a survey.
    fn is_due(&self, game: &Game) -> bool {
        !self.bots.is_empty() && game.tick_count().is_multiple_of(SURVEY_TICKS)
    }

    /// Calls `take` with each bot's input for the next tick, in seat order.
    pub fn play(&mut self, game: &Game, mut take: impl FnMut(Seat, Input)) {
        if !self.bots.is_empty() {
            game.capture_round(&mut self.round);
        }
        let changes_over = if self.is_due(game) { self.out_of_balance() } else { None };
        let Bots { aims, terrain, bots, round, .. } = self;
        let view = BotView { game, round: round.as_ref(), aims };
        for bot in bots {
            let mut input = bot.play(&view, terrain);
            if Some(bot.seat) == changes_over {
                input = input.with_buttons(Buttons(input.buttons().0 | Buttons::TEAM.0));
            }
            take(bot.seat, input);
        }
    }
}

#[cfg(test)]
mod tests;
