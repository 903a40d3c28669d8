//! A Room: one Game and its members, without sockets, files or time. Bytes and ticks in, bytes out.

use jostle_protocol::{Appearance, ClientMessage, Refusal};
use jostle_sim::{Game, Input, Scene, Seat};
use std::sync::Arc;

/// Ticks for which a seat is held after its socket is lost.
pub const SEAT_HELD_TICKS: u32 = 45 * 60;
/// Inputs that may wait for a player; the oldest are dropped past it.
pub const INPUTS_QUEUED_MAX: usize = 8;
/// Ticks for which the last input is repeated when none arrives; then the player stops steering.
pub const SILENCE_TICKS: u32 = 15;
/// Snapshots kept as baselines for late clients.
pub const HISTORY_TICKS: usize = 64;

/// One game and its members.
pub struct Room {
    game: Game,
}

/// What a player gets on joining.
#[derive(Clone, Debug, PartialEq)]
pub struct Welcome {
    /// The seat.
    pub seat: Seat,
    /// Whether an earlier seat was resumed.
    pub resumed: bool,
    /// Coded [`jostle_protocol::ServerMessage::Welcome`], to be sent first.
    pub bytes: Vec<u8>,
}

impl Room {
    /// An empty room at tick 0. `code` is the word in its link.
    pub fn new(code: &str, scene: Arc<Scene>, seed: u64) -> Room {
        let _ = (code, seed);
        Room { game: Game::new(scene, 0) }
    }

    /// Takes a free seat, or the held one that `token` names; effective with the next tick.
    /// `fresh_token` (random, from the caller) is what will give the seat back later.
    pub fn join(
        &mut self,
        appearance: Appearance,
        token: Option<u64>,
        fresh_token: u64,
    ) -> Result<Welcome, Refusal> {
        let _ = (appearance, token, fresh_token);
        todo!()
    }

    /// The seat's socket is gone; the seat is held for [`SEAT_HELD_TICKS`], its hero at rest.
    pub fn disconnect(&mut self, seat: Seat) {
        let _ = seat;
        todo!()
    }

    /// The player left for good; effective with the next tick.
    pub fn leave(&mut self, seat: Seat) {
        let _ = seat;
        todo!()
    }

    /// Queues an input; old, repeated and far-future sequence numbers are dropped.
    pub fn input(&mut self, seat: Seat, seq: u32, input: Input) {
        let _ = (seat, seq, input);
        todo!()
    }

    /// Plays one tick: joins and leaves, one input per player in seat order, the game, a snapshot.
    pub fn tick(&mut self) {
        todo!()
    }

    /// Coded [`jostle_protocol::ServerMessage::Snapshot`] that takes a client from `baseline` (a
    /// tick it was sent, or `None`) to the newest tick; a keyframe when the baseline is too old.
    /// Encoded once a baseline and tick, then shared.
    pub fn snapshot_since(&mut self, baseline: Option<u32>) -> Arc<[u8]> {
        let _ = baseline;
        todo!()
    }

    /// The game.
    pub fn game(&self) -> &Game {
        &self.game
    }

    /// Seats taken, held ones included.
    pub fn players(&self) -> usize {
        todo!()
    }

    /// Seats with a socket.
    pub fn connected(&self) -> usize {
        todo!()
    }

    #[doc(hidden)]
    pub fn _uses(_: ClientMessage) {}
}
