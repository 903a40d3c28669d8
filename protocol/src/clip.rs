//! The reasons why a server may refuse a clip.

/// The reason why a clip was not kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ClipRefusal {
    /// The server does not keep replays.
    Off = 1,
    /// The player or the room has asked too often.
    TooMany,
    /// The disk was full, or writing the clip failed.
    Failed,
}

impl ClipRefusal {
    /// All refusals, in wire order.
    pub const ALL: [ClipRefusal; 3] = [ClipRefusal::Off, ClipRefusal::TooMany, ClipRefusal::Failed];
}
