//! The snapshot: the visible state at a tick. It is sent through a [`crate::SnapshotStream`].

use crate::appearance::Appearance;
use crate::limits::{BODIES_MAX, QUANTA_MAX};
use jostle_game::{Event, Game, RoundInfo, Seat};
use jostle_sim::BodyId;

pub use jostle_game::SnapshotBody;

/// The bit in a message's first byte that marks a coded snapshot; the other bits are its sections.
pub(crate) const SNAPSHOT: u8 = 1 << 7;

/// One player, as clients see them.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayerState {
    /// The player's seat.
    pub seat: Seat,
    /// The player's name and colour.
    pub appearance: Appearance,
    /// Whether a socket is attached. Without one, the seat is held for a while.
    pub connected: bool,
    /// Sequence number of the newest input played.
    pub input_seq: u32,
    /// The player's hero, as long as it exists.
    pub hero: Option<BodyId>,
    /// The selected body (A1.1).
    pub selected: Option<BodyId>,
    /// The body held with the pointer.
    pub held: Option<BodyId>,
    /// Number of hits scored with packs.
    pub score: u16,
    /// Position of the pointer, in quanta.
    pub pointer: Option<[i32; 2]>,
}

impl PlayerState {
    /// Whether two states differ in no more than the number of the newest input.
    pub fn is_like(&self, other: &PlayerState) -> bool {
        let PlayerState { seat, appearance, connected, input_seq: _, hero, selected, .. } = self;
        (seat, appearance, connected, hero, selected)
            == (&other.seat, &other.appearance, &other.connected, &other.hero, &other.selected)
            && (self.held, self.score, self.pointer) == (other.held, other.score, other.pointer)
    }
}

/// An event with its tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedEvent {
    /// Tick in which the event happened.
    pub tick: u32,
    /// The event itself.
    pub event: Event,
}

/// The visible state at a tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Number of ticks played so far.
    pub tick: u32,
    /// Bodies in index order.
    pub bodies: Vec<SnapshotBody>,
    /// Players in seat order.
    pub players: Vec<PlayerState>,
    /// The player-visible state of the scene's rules, if it has any.
    pub round: Option<RoundInfo>,
}

impl Snapshot {
    /// Captures a game's bodies. `players` come from the room, which knows names and sockets. Coordinates are clamped
    /// to [`QUANTA_MAX`], far outside any view.
    pub fn capture(game: &Game, players: Vec<PlayerState>) -> Snapshot {
        let mut snapshot = Snapshot { players, ..Snapshot::default() };
        snapshot.recapture(game);
        snapshot
    }

    /// Captures a game's bodies into an older snapshot, reusing its memory. The snapshot's players must be up to date.
    pub fn recapture(&mut self, game: &Game) {
        self.tick = game.tick_count();
        game.capture_round(&mut self.round);
        self.bodies.clear();
        self.bodies.extend(
            game.bodies().map(|body| SnapshotBody { quanta: limited(body.quanta), ..body }),
        );
        assert!(
            self.bodies.len() <= BODIES_MAX,
            "{} bodies exceed {BODIES_MAX}",
            self.bodies.len()
        );
        for player in &mut self.players {
            player.pointer = player.pointer.map(limited);
        }
    }
}

fn limited(quanta: [i32; 2]) -> [i32; 2] {
    quanta.map(|axis| axis.clamp(-QUANTA_MAX, QUANTA_MAX))
}
