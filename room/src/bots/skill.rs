//! How well a bot plays, on one scale for all games. The scale changes nothing about what a bot wants to do, only how
//! late and how inexactly it does it.

/// Skill of a bot that is not ahead of the people.
const USUAL: f32 = 0.3;
/// Skill that a bot loses if it is as far ahead of the people as counts.
const EASED: f32 = 0.3;
/// Ticks from a look to the keys that it leads to, of the least and of the most skilled.
const REACTION_TICKS: [f32; 2] = [24.0, 4.0];
/// Maximum error of an aim or of a place, world units, likewise.
const MISS: [f32; 2] = [14.0, 2.0];
/// Share of the looks at which a bot misjudges what it sees, likewise.
const SLIPS: [f32; 2] = [0.4, 0.0];
/// Share of the looks at which a bot throws at a rival, likewise.
const SHOTS: [f32; 2] = [0.19, 0.34];

/// A bot's skill: 0 for a beginner, 1 for the best that bots can be.
#[derive(Clone, Copy, Debug)]
pub struct Skill(f32);

impl Skill {
    /// The skill of a bot while no person plays.
    pub const BEST: Skill = Skill(1.0);

    /// The skill of a bot that lets people catch up by this share, 0..1.
    pub fn eased(ease: f32) -> Skill {
        Skill((USUAL - EASED * ease).clamp(0.0, 1.0))
    }

    fn between(self, [least, most]: [f32; 2]) -> f32 {
        least + (most - least) * self.0
    }

    /// Ticks from a look to the keys that it leads to.
    pub fn reaction_ticks(self) -> u32 {
        self.between(REACTION_TICKS) as u32
    }

    /// Maximum error of an aim or of a place, world units.
    pub fn miss(self) -> f32 {
        self.between(MISS)
    }

    /// Share of the looks at which the bot throws at a rival.
    pub fn shots(self) -> f32 {
        self.between(SHOTS)
    }

    /// Share of the looks at which the bot misjudges what it sees.
    pub fn slips(self) -> f32 {
        self.between(SLIPS)
    }
}
