//! A game's log: blocks of played ticks, with states between them. It has several readers: a replay, the file from
//! which a room is restored, a clip, and the proof of a run. Each reader has its own position.
//!
//! **Data.** A block is a [`Record`] of ticks, a keyframe, or a record appended by a host; it is created once and
//! shared by all readers. **Data flow.** Each tick is added to a block, which ends after [`BLOCK_TICKS`] or when
//! something else is appended. Readers ask for the blocks after their position. A [`ReplayTail`] combines them into a
//! replay's longer blocks, outside the tick path if another thread is available. **Limits.** The log discards blocks
//! older than a clip, even if a reader has not read them yet.

use crate::playback::{Playback, PlaybackError};
use jostle_game::{Game, Input, Seat};
use jostle_protocol::Appearance;
use jostle_protocol::limits::REPLAY_BLOCK_TICKS_MAX;
use jostle_protocol::replay::{
    Block, Change, Keyframe, Record, Replay, Start, Tick, header, keeps_full_hash,
};
use std::collections::VecDeque;
use std::sync::Arc;

/// Maximum number of ticks in a block; if a persistent room crashes, it can lose this many.
pub const BLOCK_TICKS: usize = 30;
/// Number of ticks in a replay block; a crash can lose at most this many.
pub const REPLAY_BLOCK_TICKS: usize = 300;
/// Minimum number of ticks between a replay's keyframes.
pub const KEYFRAME_TICKS_MIN: u32 = 30 * 60;
/// Length of a clip in ticks: 20 seconds.
pub const CLIP_TICKS: u32 = 20 * 60;
/// Minimum number of ticks between states, if clips are kept.
const CLIP_KEYFRAME_TICKS_MIN: u32 = 60;
/// Maximum number of bytes of state per tick, if clips are kept; large states are saved less often.
const CLIP_KEYFRAME_BYTES_PER_TICK: usize = 1024;

/// The members in a keyframe: names and colours by seat.
pub type Looks = Vec<(Seat, Appearance)>;

/// A log's newest blocks. Each has a position, counted from the first block.
#[derive(Clone, Debug, Default)]
pub struct RecentBlocks {
    /// The start record for a replay of the game.
    start: Start,
    /// The kept blocks, oldest first.
    kept: VecDeque<Arc<Record>>,
    /// Number of blocks discarded so far.
    forgotten: u64,
}

impl RecentBlocks {
    /// The position after the last block.
    pub fn end(&self) -> u64 {
        self.forgotten + self.kept.len() as u64
    }

    /// The blocks from a position on; `None` if the first of them has been discarded.
    pub fn since(&self, position: u64) -> Option<Vec<Arc<Record>>> {
        let index = position.checked_sub(self.forgotten)? as usize;
        Some(self.kept.range(index..).cloned().collect())
    }

    /// The position of the newest keyframe.
    pub fn newest_keyframe(&self) -> Option<u64> {
        let index = self.kept.iter().rposition(|block| keyframe_tick(block).is_some())?;
        Some(self.forgotten + index as u64)
    }

    /// The start record for a file created at this time, in seconds since 1970, after this many ticks.
    pub fn start(&self, unix_s: u64, first_tick: u32) -> Record {
        Record::Start(Start { unix_s, first_tick, ..self.start.clone() })
    }
}

/// A game's log.
#[derive(Clone, Debug)]
pub struct GameLog {
    /// The blocks, which are kept only for clips. The first one is a keyframe.
    blocks: RecentBlocks,
    /// The block being filled.
    ticks: Vec<Tick>,
    /// The last tick played.
    newest: u32,
    next_keyframe: u32,
    keeps_clips: bool,
    /// A replay kept in memory until its records are taken.
    replay: Option<ReplayTail>,
}

impl GameLog {
    /// Starts with the game's current state. If clips are kept, the log holds a clip's length of blocks, with states in
    /// between; otherwise it serves only a replay in memory.
    pub fn new(start: Start, keeps_clips: bool, game: &Game, looks: Looks) -> GameLog {
        let blocks = RecentBlocks { start, ..RecentBlocks::default() };
        let (ticks, newest) = (Vec::new(), game.tick_count());
        let mut log =
            GameLog { blocks, ticks, newest, next_keyframe: 0, keeps_clips, replay: None };
        log.keyframe(game, looks);
        log
    }

    /// Begins a replay in memory with the game's current state, at this time, in seconds since 1970.
    pub fn record(&mut self, unix_s: u64, game: &Game, looks: Looks) {
        self.flush();
        let mut replay = ReplayTail::default();
        replay.take(&self.blocks.start(unix_s, self.newest));
        replay.take(&Record::Keyframe(keyframe(game, looks)));
        self.replay = Some(replay);
    }

    /// Takes the finished records from the replay in memory.
    pub fn take_records(&mut self) -> Vec<Record> {
        self.replay.as_mut().map(ReplayTail::ready).unwrap_or_default()
    }

    /// The final records of the replay in memory, as if it ended now. The replay continues.
    pub fn recording_end(&self, game: &Game) -> Vec<Record> {
        let Some(mut replay) = self.replay.clone() else { return Vec::new() };
        self.unfinished().iter().for_each(|block| replay.take(block));
        replay.take(&end(game));
        replay.ready()
    }

    /// Ends the replay in memory.
    pub fn stop_recording(&mut self) {
        self.replay = None;
    }

    /// The blocks, for readers.
    pub fn blocks(&self) -> &RecentBlocks {
        &self.blocks
    }

    /// Appends the tick that the game has just played, with its inputs and the changes applied before it. `looks` is
    /// called only for a keyframe.
    pub fn tick(
        &mut self,
        changes: Vec<Change>,
        inputs: &[(Seat, Input)],
        game: &Game,
        looks: impl FnOnce() -> Looks,
    ) {
        self.newest = game.tick_count();
        let hash = if keeps_full_hash(self.newest) { game.hash() } else { game.hash() & 0xffff };
        self.ticks.push(Tick { changes, inputs: inputs.to_vec(), hash });
        if self.newest >= self.next_keyframe {
            self.keyframe(game, looks());
        } else if self.ticks.len() == BLOCK_TICKS {
            self.flush();
        }
    }

    /// Ends the current block, so that all ticks are available to readers.
    pub fn flush(&mut self) {
        if let Some(block) = self.unfinished() {
            self.ticks.clear();
            self.push(block);
        }
    }

    /// Appends a record after all ticks: the end of a replay, or notes.
    pub fn append(&mut self, record: Record) {
        self.flush();
        self.push(record);
    }

    /// Appends the game's state, unless the last block already contains it.
    pub fn keyframe(&mut self, game: &Game, members: Looks) {
        self.flush();
        if self.blocks.kept.back().is_some_and(|block| keyframe_tick(block) == Some(self.newest)) {
            return;
        }
        let keyframe = keyframe(game, members);
        let (least, bytes_per_tick) = match self.keeps_clips {
            true => (CLIP_KEYFRAME_TICKS_MIN, CLIP_KEYFRAME_BYTES_PER_TICK),
            false => (KEYFRAME_TICKS_MIN, 1),
        };
        // The initial state follows from the scene and the seed, and takes up no space in a replay.
        let bytes = if self.newest > 0 || self.keeps_clips { keyframe.state.len() } else { 0 };
        self.next_keyframe = self.newest + least.max((bytes / bytes_per_tick) as u32);
        self.push(Record::Keyframe(keyframe));
    }

    /// The last few seconds as a replay's records. The replay ends now and may begin a little before the clip; [`cut`]
    /// shortens it. `None` if no clips are kept.
    pub fn clip(&self, unix_s: u64, game: &Game) -> Option<Vec<Arc<Record>>> {
        let kept = &self.blocks.kept;
        let first = self.kept_from();
        let begin = kept.get(first)?;
        let first_tick = keyframe_tick(begin)?;
        let ticks = kept.range(first..).filter(|block| matches!(***block, Record::Ticks(_)));
        let mut records = vec![Arc::new(self.blocks.start(unix_s, first_tick))];
        records.extend((first_tick > 0).then(|| Arc::clone(begin)));
        records.extend(ticks.cloned());
        records.extend(self.unfinished().map(Arc::new));
        records.push(Arc::new(end(game)));
        Some(records)
    }

    /// A copy of the current block.
    fn unfinished(&self) -> Option<Record> {
        let first = self.newest + 1 - self.ticks.len() as u32;
        (!self.ticks.is_empty()).then(|| Record::Ticks(Block { first, ticks: self.ticks.clone() }))
    }

    fn push(&mut self, block: Record) {
        self.replay.iter_mut().for_each(|replay| replay.take(&block));
        if self.keeps_clips {
            self.blocks.kept.push_back(Arc::new(block));
            let gone = self.kept_from();
            self.blocks.kept.drain(..gone);
            self.blocks.forgotten += gone as u64;
        }
    }

    /// Index of the last keyframe before the clip.
    fn kept_from(&self) -> usize {
        let Some(from) = self.newest.checked_sub(CLIP_TICKS) else { return 0 };
        let is_old = |block: &Arc<Record>| keyframe_tick(block).is_some_and(|tick| tick <= from);
        self.blocks.kept.iter().rposition(is_old).unwrap_or(0)
    }
}

fn keyframe_tick(block: &Record) -> Option<u32> {
    match block {
        Record::Keyframe(keyframe) => Some(keyframe.tick),
        _ => None,
    }
}

/// A replay's end record.
pub fn end(game: &Game) -> Record {
    Record::End { tick: game.tick_count(), hash: game.hash() }
}

fn keyframe(game: &Game, members: Looks) -> Keyframe {
    Keyframe { tick: game.tick_count(), hash: game.hash(), members, state: game.save() }
}

/// The part of a log that goes into a replay: five-second blocks, and a few of the keyframes.
#[derive(Clone, Debug, Default)]
pub struct ReplayTail {
    /// Ticks waiting to be combined into the next block.
    ticks: Vec<Tick>,
    /// The number of the first of these ticks.
    first: u32,
    next_keyframe: u32,
    ready: Vec<Record>,
}

impl ReplayTail {
    /// Adds the log's next block, or the start of the replay.
    pub fn take(&mut self, block: &Record) {
        match block {
            Record::Ticks(block) => {
                for (tick, number) in block.ticks.iter().zip(block.first..) {
                    if self.ticks.is_empty() {
                        self.first = number;
                    }
                    self.ticks.push(tick.clone());
                    if self.ticks.len() == REPLAY_BLOCK_TICKS {
                        self.flush();
                    }
                }
                return;
            }
            // The initial state follows from the scene and the seed.
            Record::Start(start) if start.first_tick == 0 => {
                self.next_keyframe = KEYFRAME_TICKS_MIN
            }
            Record::Start(_) | Record::End { .. } => {}
            // One byte of state per tick: when packed, an hour of states takes up about a fifth of the megabyte that an
            // hour with one player may take.
            Record::Keyframe(keyframe) if keyframe.tick >= self.next_keyframe => {
                let ticks = (keyframe.state.len() as u32).max(KEYFRAME_TICKS_MIN);
                self.next_keyframe = keyframe.tick + ticks;
            }
            Record::Keyframe(_) | Record::Host(_) => return,
        }
        self.flush();
        self.ready.push(block.clone());
    }

    /// Combines the waiting ticks into a block.
    pub fn flush(&mut self) {
        let ticks = std::mem::take(&mut self.ticks);
        if !ticks.is_empty() {
            self.ready.push(Record::Ticks(Block { first: self.first, ticks }));
        }
    }

    /// Takes the finished records.
    pub fn ready(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.ready)
    }
}

/// Cuts the ticks after `from` up to `to` out of a replay. Returns the bytes of a replay that begins with the state at
/// tick `from` and ends at `to`. Both are clamped to the original's range.
pub fn cut(replay: Replay, from: u32, to: u32) -> Result<Vec<u8>, PlaybackError> {
    let to = to.clamp(replay.first_tick(), replay.last_tick());
    let from = from.clamp(replay.first_tick(), to);
    let mut playback = Playback::new(Arc::new(replay))?;
    playback.seek(from)?;
    let members = &playback.moment().members;
    let members = members.iter().map(|(&seat, look)| (Seat(seat), look.clone())).collect();
    let state = keyframe(playback.game(), members);
    let replay = Arc::clone(playback.replay());
    let mut ticks = Vec::new();
    while from + (ticks.len() as u32) < to {
        let next = from + ticks.len() as u32 + 1;
        let block = replay.block_with(next).ok_or(PlaybackError::Record { tick: next })?;
        let skipped = (next - block.first) as usize;
        let wanted = (to + 1 - next) as usize;
        ticks.extend(block.ticks.into_iter().skip(skipped).take(wanted));
    }
    let hash = match replay.end_hash().filter(|_| to == replay.last_tick()) {
        Some(hash) => hash,
        None => {
            playback.seek(to)?;
            playback.game().hash()
        }
    };
    let mut records = vec![Record::Start(Start { first_tick: from, ..replay.start().clone() })];
    // The state at tick 0 follows from the scene and the seed.
    records.extend((from > 0).then_some(Record::Keyframe(state)));
    let firsts = (from + 1..).step_by(REPLAY_BLOCK_TICKS_MAX);
    let blocks = firsts.zip(ticks.chunks(REPLAY_BLOCK_TICKS_MAX));
    let blocks = blocks.map(|(first, ticks)| Block { first, ticks: ticks.to_vec() });
    records.extend(blocks.map(Record::Ticks));
    records.push(Record::End { tick: to, hash });
    Ok(header().into_iter().chain(records.iter().flat_map(Record::seal)).collect())
}

#[cfg(test)]
mod tests;
