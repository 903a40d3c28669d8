//! Kinds of bodies.

/// A body's kind, which decides its appearance and how the rules treat it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// A player's hero, or an ownerless one in scenes where heroes are only selected.
    Hero,
    /// Wanders at a constant speed.
    Minion,
    /// Falls, and collides with platforms and other marbles.
    Marble,
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
    /// All kinds, in wire order.
    pub const ALL: [Kind; 7] = [
        Kind::Hero,
        Kind::Minion,
        Kind::Marble,
        Kind::Platform,
        Kind::Wall,
        Kind::Pack,
        Kind::Block,
    ];

    /// Lower-case name, as in traces and scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Hero => "hero",
            Kind::Minion => "minion",
            Kind::Marble => "dumb",
            Kind::Platform => "platform",
            Kind::Wall => "wall",
            Kind::Pack => "pack",
            Kind::Block => "block",
        }
    }
}
