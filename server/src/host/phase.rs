//! The phases of a server's life.

/// Phase of a server's life. It only moves forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    Running,
    /// Players are warned, and nothing new begins.
    Draining,
    Closing,
}
