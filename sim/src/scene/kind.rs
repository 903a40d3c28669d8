//! What a body is to the rules and to the eye.

/// What a body is to the rules and to the eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// A player's hero, or an unowned one in scenes where heroes are only selected.
    Hero,
    /// Wanders at a constant speed.
    Minion,
    /// Falls, collides with platforms and its like.
    Dumb,
    /// A slab to stand on; may be kinematic.
    Platform,
    /// Floor, ceiling and walls around the world.
    Wall,
    /// Chases a hero and bursts on it.
    Pack,
    /// A loose crate or ball.
    Block,
}

impl Kind {
    /// Every kind, in wire order.
    pub const ALL: [Kind; 7] =
        [Kind::Hero, Kind::Minion, Kind::Dumb, Kind::Platform, Kind::Wall, Kind::Pack, Kind::Block];

    /// Lower-case name, as in traces and scene files.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Hero => "hero",
            Kind::Minion => "minion",
            Kind::Dumb => "dumb",
            Kind::Platform => "platform",
            Kind::Wall => "wall",
            Kind::Pack => "pack",
            Kind::Block => "block",
        }
    }
}
