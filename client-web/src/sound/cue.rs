//! Cues: audible events in the world.

use jostle_sim::{BodyId, Vec2};

/// The kinds of sounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sound {
    /// An impact of a wooden body: blocks, platforms and walls.
    Wood,
    /// An impact of a rubber body: heroes, minions, packs, and bouncy blocks.
    Rubber,
    Glass,
    /// A pack is thrown.
    Throw,
    Burst,
    Spawn,
    Break,
    /// A side scores points.
    Goal,
    /// A side lost a life, or can no longer win.
    Out,
    /// Another side takes the lead.
    Lead,
    /// One of the last seconds of a round passes.
    Late,
    /// A second of the countdown passes.
    Count,
    Go,
    /// A round was won by the player, or by any side if the page only watches.
    Won,
    /// The player lost a round.
    Lost,
}

impl Sound {
    pub const ALL: [Sound; 15] = [
        Sound::Wood,
        Sound::Rubber,
        Sound::Glass,
        Sound::Throw,
        Sound::Burst,
        Sound::Spawn,
        Sound::Break,
        Sound::Goal,
        Sound::Out,
        Sound::Lead,
        Sound::Late,
        Sound::Count,
        Sound::Go,
        Sound::Won,
        Sound::Lost,
    ];

    /// Whether the sound is an impact.
    pub fn is_strike(self) -> bool {
        matches!(self, Sound::Wood | Sound::Rubber | Sound::Glass)
    }

    /// The importance of a sound. A sound never replaces one that is more important.
    pub fn rank(self) -> u8 {
        match self {
            Sound::Wood | Sound::Rubber | Sound::Glass | Sound::Spawn => 0,
            Sound::Throw | Sound::Break | Sound::Burst => 1,
            Sound::Goal | Sound::Out | Sound::Lead | Sound::Late => 2,
            Sound::Count | Sound::Go | Sound::Won | Sound::Lost => 2,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cue {
    pub sound: Sound,
    /// The position, world units; `None` for sounds that concern the whole room.
    pub at: Option<Vec2>,
    /// Width of the body, world units.
    pub size: f32,
    /// Closing speed of an impact, units/s.
    pub speed: f32,
    /// The movable bodies involved.
    pub bodies: [Option<BodyId>; 2],
}

impl Cue {
    /// A cue that concerns the whole room.
    pub fn of_room(sound: Sound) -> Cue {
        Cue { sound, at: None, size: 0.0, speed: 0.0, bodies: [None; 2] }
    }

    /// A cue for a body of this size.
    pub fn of_body(sound: Sound, at: Vec2, size: f32, body: BodyId) -> Cue {
        Cue { at: Some(at), size, bodies: [Some(body), None], ..Cue::of_room(sound) }
    }
}
