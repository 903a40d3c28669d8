//! Bots that play a scene without a server, using seeded input. Occasionally, one of them leaves and comes back.

use crate::bot_input::BotInput;
use jostle_game::{Input, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_protocol::limits::COLORS;
use jostle_protocol::replay::Change;
use jostle_sim::Rng;
use jostle_sim::TICKS_PER_SECOND;

/// The random stream that decides which bot leaves; streams from 0 upwards are for inputs.
const LEAVE_STREAM: u64 = 1 << 32;

/// All of a run's bots, in seats from 0 upwards.
pub struct Bots {
    bots: Vec<Bot>,
    rng: Rng,
    inputs: Vec<(Seat, Input)>,
}

struct Bot {
    seat: Seat,
    input: BotInput,
    is_here: bool,
    /// Tick until which the bot stays, or stays away.
    until: u32,
}

impl Bots {
    /// Creates bots that join before the first tick.
    pub fn new(count: u16, seed: u64, scene: &Scene) -> Bots {
        let bot = |index: u16| Bot {
            seat: Seat(index),
            input: BotInput::new(seed, index.into(), scene.size),
            is_here: false,
            until: 0,
        };
        let bots = (0..count).map(bot).collect();
        Bots { bots, rng: Rng::new(seed, LEAVE_STREAM), inputs: Vec::new() }
    }

    /// The joins and leaves before a tick, and the inputs of the bots present. Must be called with ticks in increasing
    /// order.
    pub fn next(&mut self, tick: u32) -> (Vec<Change>, &[(Seat, Input)]) {
        let changes = self.changes(tick);
        let here = self.bots.iter_mut().filter(|bot| bot.is_here);
        self.inputs.clear();
        self.inputs.extend(here.map(|bot| (bot.seat, bot.input.next_input())));
        (changes, &self.inputs)
    }

    fn changes(&mut self, tick: u32) -> Vec<Change> {
        let mut changes = Vec::new();
        for bot in self.bots.iter_mut().filter(|bot| tick >= bot.until) {
            bot.is_here = !bot.is_here;
            let seconds = match bot.is_here {
                true => 120 + self.rng.below(360),
                false => 1 + self.rng.below(6),
            };
            bot.until = tick.max(1) + seconds * TICKS_PER_SECOND;
            changes.push(match bot.is_here {
                true => Change::Join(bot.seat, appearance(bot.seat)),
                false => Change::Leave(bot.seat),
            });
        }
        changes
    }
}

/// The name and colour of the bot in a seat.
pub fn appearance(seat: Seat) -> Appearance {
    Appearance {
        name: format!("Bot {}", seat.0 + 1).into(),
        color: (seat.0 % u16::from(COLORS)) as u8,
    }
}
