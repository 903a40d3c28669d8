//! Cues: moments of the world that can be heard.

use jostle_sim::{BodyId, Vec2};

/// The kinds of sounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sound {
    /// A struck body of wood: blocks, platforms and walls.
    Wood,
    /// A struck body of rubber: heroes, minions, packs, and blocks that bounce.
    Rubber,
    Glass,
    /// A pack flies off.
    Throw,
    Burst,
    Spawn,
    Break,
    /// A side gets points.
    Goal,
    /// A second of the countdown.
    Count,
    Go,
    /// A round was won: by the player, or by anybody while the player only watches.
    Won,
    /// The player lost a round.
    Lost,
}

impl Sound {
    pub const ALL: [Sound; 12] = [
        Sound::Wood,
        Sound::Rubber,
        Sound::Glass,
        Sound::Throw,
        Sound::Burst,
        Sound::Spawn,
        Sound::Break,
        Sound::Goal,
        Sound::Count,
        Sound::Go,
        Sound::Won,
        Sound::Lost,
    ];

    /// Whether a body was struck.
    pub fn is_strike(self) -> bool {
        matches!(self, Sound::Wood | Sound::Rubber | Sound::Glass)
    }

    /// Importance: a sound never takes the place of a more important one.
    pub fn rank(self) -> u8 {
        match self {
            Sound::Wood | Sound::Rubber | Sound::Glass | Sound::Spawn => 0,
            Sound::Throw | Sound::Break | Sound::Burst => 1,
            Sound::Goal | Sound::Count | Sound::Go | Sound::Won | Sound::Lost => 2,
        }
    }
}

/// Something that can be heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cue {
    pub sound: Sound,
    /// Its position, world units; `None` for what concerns the whole room.
    pub at: Option<Vec2>,
    /// Width of the body, world units.
    pub size: f32,
    /// Closing speed of a strike, units/s.
    pub speed: f32,
    /// Movable bodies that take part.
    pub bodies: [Option<BodyId>; 2],
}

impl Cue {
    /// A cue that concerns the whole room.
    pub fn of_room(sound: Sound) -> Cue {
        Cue { sound, at: None, size: 0.0, speed: 0.0, bodies: [None; 2] }
    }

    /// A cue of a body with this size.
    pub fn of_body(sound: Sound, at: Vec2, size: f32, body: BodyId) -> Cue {
        Cue { at: Some(at), size, bodies: [Some(body), None], ..Cue::of_room(sound) }
    }
}
