//! Plays back a replay. Every tick is simulated again and compared with its recorded hash.

use crate::members::player_state;
use jostle_game::{Game, Phase, Scene, SceneError, Seat};
use jostle_protocol::replay::{Block, Change, Keyframe, Replay};
use jostle_protocol::{Appearance, Snapshot};
use jostle_sim::{StateError, World};
use litemap::LiteMap;
use std::sync::Arc;

/// Maximum number of states that one playback keeps, in addition to the keyframes in the file.
const MARKS_MAX: u32 = 128;
/// Minimum number of ticks between kept states.
const MARK_TICKS_MIN: u32 = 600;

/// The reason why a replay cannot be played, or cannot be played to its end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlaybackError {
    /// The scene was refused.
    #[error("the scene of the replay is refused: {0}")]
    Scene(SceneError),
    /// A player joins twice, or leaves without having joined.
    #[error("tick {tick}: seat {seat} cannot change as the replay says")]
    Change {
        /// The tick's number.
        tick: u32,
        /// The seat's number.
        seat: u16,
    },
    /// A keyframe does not contain a state of this scene.
    #[error("the keyframe of tick {tick} is refused: {error}")]
    Keyframe {
        /// The keyframe's tick.
        tick: u32,
        /// The reason why the keyframe cannot be restored.
        error: StateError,
    },
    /// A record is complete, but its contents are invalid for its kind.
    #[error("the record with tick {tick} cannot be decoded")]
    Record {
        /// The first missing tick, or the tick of the keyframe.
        tick: u32,
    },
}

/// A replayed tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Played {
    /// The number of the tick that was played.
    pub tick: u32,
    /// Whether the tick's hash equals the recorded one.
    pub agrees: bool,
}

/// A replay and the game that it plays.
#[derive(Clone, Debug)]
pub struct Playback {
    replay: Arc<Replay>,
    moment: Moment,
    /// The block that contains the most recently played ticks.
    block: Option<Block>,
    /// Kept states by tick, from which to start when seeking backwards.
    marks: LiteMap<u32, Keyframe>,
}

/// The game at one tick, with its members.
#[derive(Clone, Debug)]
pub struct Moment {
    /// The game after its latest tick.
    pub game: Game,
    /// Names and colours by seat.
    pub members: LiteMap<u16, Appearance>,
}

impl Moment {
    /// The state before the first tick of a replay.
    fn first(replay: &Replay, scene: Arc<Scene>) -> Result<Moment, PlaybackError> {
        let game = Game::new(scene, replay.start().seed);
        let moment = Moment { game, members: LiteMap::new() };
        match keyframe_before(replay, replay.first_tick())? {
            Some(keyframe) => moment.at(&keyframe),
            None => Ok(moment),
        }
    }

    /// The game at one of the same replay's keyframes.
    fn at(&self, keyframe: &Keyframe) -> Result<Moment, PlaybackError> {
        let Keyframe { tick, members, state, .. } = keyframe;
        let game = Game::restore(Arc::clone(self.game.scene()), state)
            .map_err(|error| PlaybackError::Keyframe { tick: *tick, error })?;
        let members = members.iter().map(|(seat, appearance)| (seat.0, appearance.clone()));
        Ok(Moment { game, members: members.collect() })
    }

    /// Plays the next tick from the block that contains it.
    pub fn step(
        &mut self,
        block: &Block,
        watch: &mut impl FnMut(Phase, &mut World),
    ) -> Result<Played, PlaybackError> {
        let tick = self.game.tick_count() + 1;
        let given = &block.ticks[(tick - block.first) as usize];
        for change in &given.changes {
            self.change(tick, change)?;
        }
        self.game.tick_watched(&given.inputs, watch);
        Ok(Played { tick, agrees: given.agrees(tick, self.game.hash()) })
    }

    fn change(&mut self, tick: u32, change: &Change) -> Result<(), PlaybackError> {
        let (Change::Join(seat, _) | Change::Leave(seat) | Change::Look(seat, _)) = change;
        let is_here = self.game.players().any(|player| player.seat == *seat);
        match change {
            Change::Join(_, appearance) if !is_here => {
                self.members.insert(seat.0, appearance.clone());
                self.game.join(*seat);
            }
            Change::Leave(_) if is_here => {
                self.members.remove(&seat.0);
                self.game.leave(*seat);
            }
            Change::Look(_, appearance) if is_here => {
                self.members.insert(seat.0, appearance.clone());
            }
            _ => return Err(PlaybackError::Change { tick, seat: seat.0 }),
        }
        Ok(())
    }
}

impl Playback {
    /// Creates a playback at the point before the first tick.
    pub fn new(replay: Arc<Replay>) -> Result<Playback, PlaybackError> {
        let start = replay.start();
        let file = format!("{}.toml", start.scene_name);
        let scene = Scene::parse(&file, &start.scene).map_err(PlaybackError::Scene)?;
        Playback::of_scene(replay, Arc::new(scene))
    }

    /// Like [`Playback::new`], with a scene that has already been parsed and may have been given a budget.
    pub fn of_scene(replay: Arc<Replay>, scene: Arc<Scene>) -> Result<Playback, PlaybackError> {
        let moment = Moment::first(&replay, scene)?;
        Ok(Playback { replay, moment, block: None, marks: LiteMap::new() })
    }

    /// The replay being played.
    pub fn replay(&self) -> &Arc<Replay> {
        &self.replay
    }

    /// The game in its current state.
    pub fn game(&self) -> &Game {
        &self.moment.game
    }

    /// The game and its members in their current state.
    pub fn moment(&self) -> &Moment {
        &self.moment
    }

    /// Ends the playback, and returns the game and its members in their current state.
    pub fn into_moment(self) -> Moment {
        self.moment
    }

    /// The number of the last tick played.
    pub fn tick(&self) -> u32 {
        self.moment.game.tick_count()
    }

    /// Plays the next tick; `None` at the end of the replay.
    pub fn step(&mut self) -> Result<Option<Played>, PlaybackError> {
        remember(&mut self.marks, &self.replay, &self.moment);
        let Some(block) = self.take_block()? else { return Ok(None) };
        let played = self.moment.step(&block, &mut |_, _| {});
        self.block = Some(block);
        played.map(Some)
    }

    /// The block that contains the next tick.
    fn take_block(&mut self) -> Result<Option<Block>, PlaybackError> {
        let next = self.tick() + 1;
        let holds = |block: &Block| (block.first..=block.last()).contains(&next);
        let block = self.block.take().filter(holds).or_else(|| self.replay.block_with(next));
        let recorded = self.replay.first_tick() + 1..=self.replay.last_tick();
        match block {
            None if recorded.contains(&next) => Err(PlaybackError::Record { tick: next }),
            block => Ok(block),
        }
    }

    /// Adds a state from the same replay that was computed elsewhere, as a starting point for seeking.
    pub fn learn(&mut self, moment: &Moment) {
        remember(&mut self.marks, &self.replay, moment);
    }

    /// Jumps to the latest known state at or before a tick, without playing; [`Playback::step`] plays the rest. Does
    /// nothing if the current state is already the closest.
    pub fn jump(&mut self, tick: u32) -> Result<(), PlaybackError> {
        let tick = tick.clamp(self.replay.first_tick(), self.replay.last_tick());
        let mark = self.marks.iter().rev().find(|(at, _)| **at <= tick).map(|(_, mark)| mark);
        let mark_tick = mark.map(|mark| mark.tick);
        let keyframe_tick = last_keyframe_tick(&self.replay, tick);
        let now = Some(self.tick()).filter(|&now| now <= tick);
        if now.is_some() && now >= mark_tick.max(keyframe_tick) {
            return Ok(());
        }
        self.moment = match mark.filter(|_| mark_tick >= keyframe_tick) {
            Some(mark) => self.moment.at(mark)?,
            None => match keyframe_before(&self.replay, tick)? {
                Some(keyframe) => self.moment.at(&keyframe)?,
                None => Moment::first(&self.replay, Arc::clone(self.game().scene()))?,
            },
        };
        Ok(())
    }

    /// Seeks to a tick, playing as few ticks as possible.
    pub fn seek(&mut self, tick: u32) -> Result<(), PlaybackError> {
        let tick = tick.clamp(self.replay.first_tick(), self.replay.last_tick());
        self.jump(tick)?;
        while self.tick() < tick && self.step()?.is_some() {}
        Ok(())
    }

    /// The snapshot that players saw at this tick.
    pub fn snapshot(&self) -> Snapshot {
        let players = self.moment.game.players();
        let states = players.map(|player| player_state(&player, self.appearance(player.seat)));
        Snapshot::capture(&self.moment.game, states.collect())
    }

    fn appearance(&self, seat: Seat) -> Appearance {
        let known = self.moment.members.get(&seat.0).cloned();
        known.unwrap_or_else(|| Appearance {
            name: format!("Player {}", seat.0 + 1).into(),
            color: 0,
        })
    }
}

fn last_keyframe_tick(replay: &Replay, tick: u32) -> Option<u32> {
    replay.keyframe_ticks().take_while(|&at| at <= tick).last()
}

/// The last keyframe at or before a tick, if any.
fn keyframe_before(replay: &Replay, tick: u32) -> Result<Option<Keyframe>, PlaybackError> {
    match (last_keyframe_tick(replay, tick), replay.keyframe_before(tick)) {
        (Some(tick), None) => Err(PlaybackError::Record { tick }),
        (_, keyframe) => Ok(keyframe),
    }
}

/// Keeps the state at a moment if its tick is due to be kept.
fn remember(marks: &mut LiteMap<u32, Keyframe>, replay: &Replay, moment: &Moment) {
    let Moment { game, members } = moment;
    let tick = game.tick_count();
    let apart = MARK_TICKS_MIN.max(replay.last_tick() / MARKS_MAX);
    if tick.is_multiple_of(apart) {
        let members = members.iter().map(|(&seat, appearance)| (Seat(seat), appearance.clone()));
        let mark =
            || Keyframe { tick, hash: game.hash(), members: members.collect(), state: game.save() };
        marks.entry(tick).or_insert_with(mark);
    }
}

#[cfg(test)]
pub(crate) mod tests;
