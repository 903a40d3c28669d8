//! The snapshot: visible state at a tick. A [`crate::Stream`] says how it travels.

use crate::codec;
use crate::limits::{BODIES_MAX, QUANTA_MAX};
use crate::message::Appearance;
use crate::wire::DecodeError;
use jostle_sim::{BodyId, BodyInfo, Event, Game, Kind, Seat, Shape};

/// One body as clients see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnapshotBody {
    /// Its name; a body keeps kind, owner, group and shape for life.
    pub id: BodyId,
    /// What it is.
    pub kind: Kind,
    /// Whose it is.
    pub owner: Option<Seat>,
    /// Collision group, an index into the scene's.
    pub group: u8,
    /// Outline.
    pub shape: Shape,
    /// Centre in quanta.
    pub quanta: [i32; 2],
}

/// One player as clients see them.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayerState {
    /// The seat.
    pub seat: Seat,
    /// Name and colour.
    pub appearance: Appearance,
    /// Whether a socket is attached; the seat is held for a while without one.
    pub connected: bool,
    /// Newest input that was played.
    pub input_seq: u32,
    /// Own hero.
    pub hero: Option<BodyId>,
    /// Selected body (chapter project 9.1).
    pub selected: Option<BodyId>,
    /// Body that is held by the pointer.
    pub held: Option<BodyId>,
    /// Hits scored with packs.
    pub score: u16,
    /// Where the player points, in quanta.
    pub pointer: Option<[i32; 2]>,
}

/// An event and the tick it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedEvent {
    /// Tick of the event.
    pub tick: u32,
    /// What happened.
    pub event: Event,
}

/// Visible state at a tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Ticks played when it was taken.
    pub tick: u32,
    /// Bodies in index order.
    pub bodies: Vec<SnapshotBody>,
    /// Players in seat order.
    pub players: Vec<PlayerState>,
}

impl Snapshot {
    /// The bodies of a game now. `players` come from the room, which knows names and sockets.
    /// Coordinates past [`QUANTA_MAX`] are brought back to it, far outside of any view.
    pub fn capture(game: &Game, players: Vec<PlayerState>) -> Snapshot {
        let mut snapshot = Snapshot { players, ..Snapshot::default() };
        snapshot.recapture(game);
        snapshot
    }

    /// [`Snapshot::capture`] in the memory of an older one, whose players are up to date already.
    pub fn recapture(&mut self, game: &Game) {
        self.tick = game.tick_count();
        self.bodies.clear();
        self.bodies.extend(game.bodies().map(visible));
        assert!(
            self.bodies.len() <= BODIES_MAX,
            "{} bodies exceed {BODIES_MAX}",
            self.bodies.len()
        );
        for player in &mut self.players {
            player.pointer = player.pointer.map(limited);
        }
    }

    /// Takes the players of another snapshot, in the memory of those that this one had.
    pub fn copy_players(&mut self, other: &[PlayerState]) {
        self.players.truncate(other.len());
        for (own, player) in self.players.iter_mut().zip(other) {
            let mut name = std::mem::take(&mut own.appearance.name);
            name.clone_from(&player.appearance.name);
            let appearance = Appearance { name, ..player.appearance };
            *own = PlayerState { appearance, ..*player };
        }
        self.players.extend_from_slice(&other[self.players.len()..]);
    }

    /// Names of the sections that a coded snapshot has, read from its first byte alone.
    pub fn section_names(bytes: &[u8]) -> Result<Vec<&'static str>, DecodeError> {
        codec::section_names(bytes)
    }
}

fn visible(body: BodyInfo) -> SnapshotBody {
    let BodyInfo { id, kind, owner, group, shape, quanta } = body;
    SnapshotBody { id, kind, owner, group, shape, quanta: limited(quanta) }
}

fn limited(quanta: [i32; 2]) -> [i32; 2] {
    quanta.map(|axis| axis.clamp(-QUANTA_MAX, QUANTA_MAX))
}
