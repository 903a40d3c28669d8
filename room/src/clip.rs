//! Clips: the last seconds of a game, kept in memory as they are played, and cut out of any replay.

use crate::playback::{Playback, PlaybackError};
use crate::recorder::recorded;
use jostle_game::{Game, Input, Seat};
use jostle_protocol::Appearance;
use jostle_protocol::limits::REPLAY_BLOCK_TICKS_MAX;
use jostle_protocol::replay::{Block, Change, Keyframe, Record, Replay, Start, Tick, header};
use std::collections::VecDeque;
use std::sync::Arc;

/// Ticks of a clip: 20 seconds.
pub const CLIP_TICKS: u32 = 20 * 60;
/// Least ticks between two kept states.
const STATE_TICKS_MIN: u32 = 60;
/// Bytes of state for each tick at most: large states are kept less often.
const STATE_BYTES_PER_TICK: usize = 1024;

/// The last seconds of a game: [`CLIP_TICKS`], and what was played since the kept state before them.
#[derive(Clone, Debug)]
pub struct ClipBuffer {
    start: Start,
    /// The oldest first; never empty.
    segments: VecDeque<Segment>,
}

/// A kept state, and the ticks after it.
#[derive(Clone, Debug)]
struct Segment {
    state: Keyframe,
    ticks: Vec<Tick>,
}

impl Segment {
    fn of(game: &Game, members: Vec<(Seat, Appearance)>) -> Segment {
        Segment { state: keyframe(game, members), ticks: Vec::new() }
    }

    /// Whether it is time for another state.
    fn is_long(&self) -> bool {
        let ticks = (self.state.state.len() / STATE_BYTES_PER_TICK) as u32;
        self.ticks.len() as u32 >= ticks.max(STATE_TICKS_MIN)
    }
}

impl ClipBuffer {
    /// Begins with the game as it is.
    pub fn new(start: Start, game: &Game, members: Vec<(Seat, Appearance)>) -> ClipBuffer {
        ClipBuffer { start, segments: [Segment::of(game, members)].into() }
    }

    /// Keeps the tick that the game has just played. See [`crate::Recorder::tick`].
    pub fn tick(
        &mut self,
        changes: Vec<Change>,
        inputs: &[(Seat, Input)],
        game: &Game,
        hash: u64,
        members: impl FnOnce() -> Vec<(Seat, Appearance)>,
    ) {
        let now = game.tick_count();
        let newest = self.segments.back_mut().expect("there is always a segment");
        newest.ticks.push(recorded(now, changes, inputs, hash));
        if newest.is_long() {
            self.segments.push_back(Segment::of(game, members()));
        }
        while self.segments.get(1).is_some_and(|next| next.state.tick + CLIP_TICKS <= now) {
            self.segments.pop_front();
        }
    }

    /// All that is kept, as the records of a replay that begins before the clip and ends now.
    pub fn records(&self, game: &Game, unix_s: u64) -> Vec<Record> {
        let first = &self.segments[0].state;
        let ticks = self.segments.iter().flat_map(|segment| &segment.ticks).cloned().collect();
        let end = Record::End { tick: game.tick_count(), hash: game.hash() };
        assemble(Start { unix_s, ..self.start.clone() }, first.clone(), ticks, end)
    }
}

/// Cuts the ticks after `from` up to `to` out of a replay: the bytes of a replay that begins with the state at tick
/// `from` and ends at `to`, both moved into the replay's own range.
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
    let end = Record::End { tick: to, hash };
    let records = assemble(replay.start().clone(), state, ticks, end);
    Ok(header().into_iter().chain(records.iter().flat_map(Record::seal)).collect())
}

fn keyframe(game: &Game, members: Vec<(Seat, Appearance)>) -> Keyframe {
    Keyframe { tick: game.tick_count(), hash: game.hash(), members, state: game.save() }
}

/// The records of a replay that begins with a state. The state at tick 0 follows from scene and seed.
fn assemble(start: Start, state: Keyframe, ticks: Vec<Tick>, end: Record) -> Vec<Record> {
    let first_tick = state.tick;
    let mut records = vec![Record::Start(Start { first_tick, ..start })];
    records.extend((first_tick > 0).then_some(Record::Keyframe(state)));
    let firsts = (first_tick + 1..).step_by(REPLAY_BLOCK_TICKS_MAX);
    let blocks = firsts.zip(ticks.chunks(REPLAY_BLOCK_TICKS_MAX));
    records
        .extend(blocks.map(|(first, ticks)| Record::Ticks(Block { first, ticks: ticks.to_vec() })));
    records.push(end);
    records
}

#[cfg(test)]
mod tests;
