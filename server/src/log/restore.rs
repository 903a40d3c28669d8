//! Rooms from the previous process, restored from their files.

use crate::files::read_regular;
use crate::host::admission::Admission;
use crate::limits;
use jostle_game::Scene;
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::{Change, Replay};
use jostle_room::{Playback, Room, SavedMembers};
use serde::{Deserialize, Serialize};
use std::net::IpAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tracing::{info, warn};

/// The host's notes in a room's file, as JSON. New fields have defaults, so that files written by older versions can be
/// read.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct HostNotes {
    /// The room's number, which its tokens and host keys contain. See [`crate::host::room_handle::RoomInfo::number`].
    pub number: u64,
    /// Whether the room can be reached only by its link.
    pub private: bool,
    /// The creator's network; `None` for a standing room.
    pub creator: Option<IpAddr>,
    /// Whether a guest provided the scene.
    #[serde(default)]
    pub guest: bool,
    /// Who holds which seat.
    pub members: SavedMembers,
    /// The seats' networks, and the kicked players.
    #[serde(default)]
    pub admission: Admission,
}

/// A room whose file has been read, and whose game has yet to be played up to its last tick.
#[derive(Debug)]
pub struct SavedRoom {
    /// The code in the room's link.
    pub code: String,
    /// The scene, as it was when the room opened.
    pub scene: Arc<Scene>,
    /// The notes in the file.
    pub notes: HostNotes,
    replay: Arc<Replay>,
}

impl SavedRoom {
    /// Reads a room's file. The error is a sentence that states the reason.
    pub fn read(code: String, path: &Path) -> Result<SavedRoom, String> {
        let bytes = read_regular(path, REPLAY_BYTES_MAX).map_err(|error| error.to_string())?;
        SavedRoom::from_bytes(code, bytes)
    }

    /// Reads the contents of such a file. The error is a sentence that states the reason.
    pub fn from_bytes(code: String, bytes: Vec<u8>) -> Result<SavedRoom, String> {
        let replay = Replay::read(bytes).map_err(|error| error.to_string())?;
        let start = replay.start();
        if start.room != code {
            return Err(format!("it is the file of room {:?}", start.room));
        }
        let scene = Scene::parse(&format!("{}.toml", start.scene_name), &start.scene);
        let mut scene = scene.map_err(|error| error.to_string())?;
        let (noted_tick, json) =
            replay.host().ok_or("it has no notes on the players and their seats")?;
        let mut notes: HostNotes =
            serde_json::from_slice(json).map_err(|error| error.to_string())?;
        if notes.guest {
            scene.world.budget = limits::GUEST_STEP;
        }
        forget_changed_seats(&mut notes, &replay, noted_tick);
        Ok(SavedRoom { code, scene: Arc::new(scene), notes, replay: Arc::new(replay) })
    }

    pub fn seed(&self) -> u64 {
        self.replay.start().seed
    }

    /// Plays the game up to its last recorded tick. The caller begins a new epoch of claims ([`Room::begin_epoch`]).
    /// The error is a sentence that states the reason. Returns `None` if the game exceeds its budget, or if
    /// `may_go_on`, which is called before each tick, returns false.
    pub fn restore(&self, may_go_on: impl Fn() -> bool) -> Result<Option<Room>, String> {
        let began = Instant::now();
        let mut playback = Playback::of_scene(Arc::clone(&self.replay), Arc::clone(&self.scene))
            .map_err(|error| error.to_string())?;
        let mut diverged = None;
        while let Some(played) = playback.step().map_err(|error| error.to_string())? {
            if playback.game().is_over_budget() || !may_go_on() {
                return Ok(None);
            }
            if !played.agrees {
                diverged.get_or_insert(played.tick);
            }
        }
        let (code, tick) = (&self.code, playback.tick());
        if let Some(diverged) = diverged {
            let recorded_by = &self.replay.start().program;
            warn!(
                room = %code, tick = diverged, %recorded_by,
                "this version simulates the game differently from the previous one; players may see a jump"
            );
        }
        if let Some(error) = self.replay.ending().error().filter(|_| !self.ends_whole()) {
            warn!(room = %code, tick, %error, "the file of a room lost its tail; the last whole tick counts");
        }
        let played = tick - self.replay.first_tick();
        let ms = began.elapsed().as_millis() as u64;
        info!(room = %code, tick, played, ms, "room restored");
        let moment = playback.into_moment();
        Ok(Some(Room::restore(code, self.seed(), moment, &self.notes.members)))
    }

    /// Whether only the end record is missing; such files never have one.
    fn ends_whole(&self) -> bool {
        self.replay.sizes().lost == 0
    }
}

/// Removes the holders of seats that were given up or taken after the notes were made.
fn forget_changed_seats(notes: &mut HostNotes, replay: &Replay, noted_tick: u32) {
    let mut tick = noted_tick + 1;
    while let Some(block) = replay.block_with(tick) {
        let later = (block.first..).zip(&block.ticks).filter(|&(number, _)| number > noted_tick);
        for change in later.flat_map(|(_, tick)| &tick.changes) {
            if let Change::Join(seat, _) | Change::Leave(seat) = change {
                notes.members.seats.retain(|saved| saved.seat != seat.0);
            }
        }
        tick = block.last() + 1;
    }
}
