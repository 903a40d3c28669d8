//! Reasons for which a server keeps no clip.

/// The reason why a clip was not kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ClipRefusal {
    /// The server keeps no replays.
    Off = 1,
    /// The player, or the room, has asked too often.
    TooMany,
    /// There was no room for it, or it could not be written.
    Failed,
}

impl ClipRefusal {
    /// All of them, in wire order.
    pub const ALL: [ClipRefusal; 3] = [ClipRefusal::Off, ClipRefusal::TooMany, ClipRefusal::Failed];
}
