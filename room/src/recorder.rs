//! Recording of a game's inputs and state hashes, tick by tick, as records of a replay. Records wait
//! here until the caller takes them, and packs them off the tick path.

use jostle_game::{Game, Input, Seat};
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Block, Change, Keyframe, Record, Start, Tick, keeps_full_hash};

/// Ticks in a record of a replay: the most that a crash can lose.
pub const BLOCK_TICKS: usize = 300;
/// Ticks in a record of a recording from which a room is restored: half a second.
const RESTORE_BLOCK_TICKS: usize = 30;
/// Least ticks between keyframes.
pub const KEYFRAME_TICKS_MIN: u32 = 30 * 60;
/// Budget of keyframe bytes per tick, before packing: large keyframes are rarer. Packed, an hour of them is
/// about a fifth of the megabyte that an hour of one player may take.
const KEYFRAME_BYTES_PER_TICK: usize = 1;

/// Records a game as a replay.
#[derive(Clone, Debug)]
pub struct Recorder {
    /// The block that is being filled.
    ticks: Vec<Tick>,
    /// The last tick in the block.
    newest: u32,
    /// Ticks in a full block.
    block_ticks: usize,
    next_keyframe: u32,
    records: Vec<Record>,
}

impl Recorder {
    /// Starts a recording of the game as it is. `start.first_tick` is set here.
    pub fn new(start: Start, game: &Game, members: Vec<(Seat, Appearance)>) -> Recorder {
        let first_tick = game.tick_count();
        let records = vec![Record::Start(Start { first_tick, ..start })];
        let next_keyframe = first_tick + KEYFRAME_TICKS_MIN;
        let (ticks, block_ticks) = (Vec::new(), BLOCK_TICKS);
        let mut recorder =
            Recorder { ticks, newest: first_tick, block_ticks, next_keyframe, records };
        if first_tick > 0 {
            recorder.keyframe(game, members);
        }
        recorder
    }

    /// Starts a recording from which the room is to be restored after its process ends: blocks are short, so
    /// that little is lost, and there is no keyframe but the first.
    pub fn for_restoring(start: Start, game: &Game, members: Vec<(Seat, Appearance)>) -> Recorder {
        let recorder = Recorder::new(start, game, members);
        Recorder { block_ticks: RESTORE_BLOCK_TICKS, next_keyframe: u32::MAX, ..recorder }
    }

    /// Records the tick that the game has just played, with its inputs and the changes applied before it.
    /// `hash` is the game's, and `members` is called only for a keyframe.
    pub fn tick(
        &mut self,
        changes: Vec<Change>,
        inputs: &[(Seat, Input)],
        game: &Game,
        hash: u64,
        members: impl FnOnce() -> Vec<(Seat, Appearance)>,
    ) {
        let number = game.tick_count();
        self.ticks.push(recorded(number, changes, inputs, hash));
        self.newest = number;
        let is_keyframe = number >= self.next_keyframe;
        if self.ticks.len() == self.block_ticks || is_keyframe {
            self.close_block(number);
        }
        if is_keyframe {
            self.keyframe(game, members());
        }
    }

    /// Ends the block with tick `last`.
    fn close_block(&mut self, last: u32) {
        let ticks = std::mem::take(&mut self.ticks);
        if !ticks.is_empty() {
            let first = last + 1 - ticks.len() as u32;
            self.records.push(Record::Ticks(Block { first, ticks }));
        }
    }

    fn keyframe(&mut self, game: &Game, members: Vec<(Seat, Appearance)>) {
        let (tick, hash, state) = (game.tick_count(), game.hash(), game.save());
        let ticks = (state.len() / KEYFRAME_BYTES_PER_TICK) as u32;
        self.next_keyframe = tick + ticks.max(KEYFRAME_TICKS_MIN);
        self.records.push(Record::Keyframe(Keyframe { tick, hash, members, state }));
    }

    /// Closes the block that is being filled, so that [`Recorder::take`] returns all that was recorded.
    pub fn flush(&mut self) {
        self.close_block(self.newest);
    }

    /// Returns the last ticks of a game that cannot go on, without an end record.
    pub fn break_off(mut self) -> Vec<Record> {
        self.close_block(self.newest);
        self.records
    }

    /// Takes the records that are ready.
    pub fn take(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.records)
    }

    /// Ends the recording with the game, and returns the last records.
    pub fn finish(mut self, game: &Game) -> Vec<Record> {
        self.close_block(game.tick_count());
        self.records.push(Record::End { tick: game.tick_count(), hash: game.hash() });
        self.records
    }
}

/// A tick as replays keep it.
pub fn recorded(number: u32, changes: Vec<Change>, inputs: &[(Seat, Input)], hash: u64) -> Tick {
    let hash = if keeps_full_hash(number) { hash } else { hash & 0xffff };
    Tick { changes, inputs: inputs.to_vec(), hash }
}
