//! The search for the point where a replay and its re-simulation diverge. The hashes reveal the tick; the search then
//! narrows down the phase, body and field.
//!
//! A replay contains no state for each tick, only 16 bits of its hash. But the hashes of the following ticks are a
//! strong test, because an assumed cause must reproduce all of them. The search therefore tries changing each number by
//! one unit in the last place, in every phase of the tick, until one change fits. If none fits, more than one number
//! differed, and the next keyframe shows which bodies differ by then.

use crate::playback::{Moment, Playback, PlaybackError};
use jostle_game::{Game, Phase};
use jostle_protocol::replay::{Block, Keyframe, Replay};
use jostle_sim::{BodyId, Difference, Motion, Vec2, World};
use std::fmt;
use std::sync::Arc;

/// Maximum number of nudges to try, which takes about a second in a busy scene.
const NUDGES_MAX: usize = 20_000;
/// Number of ticks after the divergence whose hashes, of 16 bits each, a nudge must reproduce.
const WITNESSES: u32 = 6;

/// The point where a replay and its re-simulation diverge.
#[derive(Clone, Debug, PartialEq)]
pub struct Divergence {
    /// The first tick whose hash differs.
    pub tick: u32,
    /// The cause, if it can be determined.
    pub cause: Cause,
}

/// A divergence's cause.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// One number differed by one unit in the last place.
    Nudge {
        /// Phases of the tick in which this may have happened, earliest first.
        phases: Vec<Phase>,
        /// The body with the differing field.
        body: BodyId,
        /// The name of the differing number.
        field: &'static str,
        /// Whether the recorded number is greater in magnitude.
        recorded_is_greater: bool,
    },
    /// More than one number differed. This is the first difference at a later keyframe, with the recorded value first.
    Later {
        /// The keyframe's tick.
        tick: u32,
        /// The first field that differs at the keyframe.
        difference: Difference,
    },
    /// More than one number differed, and no keyframe follows.
    Unknown,
}

impl fmt::Display for Divergence {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        write!(out, "tick {}: ", self.tick)?;
        match &self.cause {
            Cause::Nudge { phases, body, field, recorded_is_greater } => {
                let names: Vec<_> = phases.iter().map(|phase| phase.name()).collect();
                let way = if *recorded_is_greater { "greater" } else { "smaller" };
                let BodyId { index, generation } = body;
                write!(out, "in {}, body {index}.{generation} {field}: ", names.join(" or "))?;
                write!(out, "the recorded one is {way} by one unit in the last place")
            }
            Cause::Later { tick, difference } => {
                write!(out, "more than one number differs; at tick {tick}, {difference}")
            }
            Cause::Unknown => write!(out, "more than one number differs"),
        }
    }
}

/// Plays a whole replay, and returns the point where it diverges from the recording, if any. `progress` is called for
/// each tick.
pub fn verify(
    replay: &Arc<Replay>,
    mut progress: impl FnMut(u32),
) -> Result<Option<Divergence>, PlaybackError> {
    let mut playback = Playback::new(Arc::clone(replay))?;
    let mut keyframes = replay.keyframe_ticks().peekable();
    loop {
        if keyframes.next_if_eq(&playback.tick()).is_some() {
            let tick = playback.tick();
            let keyframe = replay.keyframe_before(tick).ok_or(PlaybackError::Record { tick })?;
            if let Some(cause) = compare(playback.game(), &keyframe) {
                return Ok(Some(Divergence { tick, cause }));
            }
        }
        match playback.step()? {
            None => break,
            Some(played) if played.agrees => progress(played.tick),
            Some(played) => return locate(playback, played.tick).map(Some),
        }
    }
    let differs = replay.end_hash().is_some_and(|hash| hash != playback.game().hash());
    Ok(differs.then(|| Divergence { tick: playback.tick(), cause: Cause::Unknown }))
}

/// Finds the cause of a divergence at this tick.
fn locate(mut playback: Playback, tick: u32) -> Result<Divergence, PlaybackError> {
    playback.seek(tick - 1)?;
    let before = playback.moment().clone();
    let replay = playback.replay();
    let cause = match find_nudge(replay, &before, tick)? {
        Some(nudge) => nudge,
        None => look_later(playback, tick)?,
    };
    Ok(Divergence { tick, cause })
}

/// Compares the game with a keyframe for the same tick.
fn compare(game: &Game, keyframe: &Keyframe) -> Option<Cause> {
    if game.hash() == keyframe.hash {
        return None;
    }
    let recorded = Game::restore(Arc::clone(game.scene()), &keyframe.state).ok();
    let difference = recorded.and_then(|recorded| recorded.first_difference(game));
    let tick = keyframe.tick;
    Some(difference.map_or(Cause::Unknown, |difference| Cause::Later { tick, difference }))
}

fn look_later(mut playback: Playback, tick: u32) -> Result<Cause, PlaybackError> {
    let Some(keyframe) = playback.replay().keyframe_after(tick) else { return Ok(Cause::Unknown) };
    // The game is played to this point rather than sought, because keyframes contain the recorded game.
    while playback.tick() < keyframe.tick && playback.step()?.is_some() {}
    Ok(compare(playback.game(), &keyframe).unwrap_or(Cause::Unknown))
}

/// The numbers in a body that a nudge can change.
const FIELDS: [&str; 4] = ["position.x", "position.y", "velocity.x", "velocity.y"];

/// An assumed cause: this number in this body is off by one unit after this phase.
#[derive(Clone, Copy)]
struct Nudge {
    phase: Phase,
    body: BodyId,
    field: usize,
    greater: bool,
}

impl Nudge {
    /// Changes a world that has just completed `phase`. Does nothing if the body is gone.
    fn apply(self, phase: Phase, world: &mut World) {
        if phase != self.phase || !world.contains(self.body) {
            return;
        }
        let (mut position, mut velocity) = (world.position(self.body), world.velocity(self.body));
        match self.field {
            0 => position.x = nudged(position.x, self.greater),
            1 => position.y = nudged(position.y, self.greater),
            2 => velocity.x = nudged(velocity.x, self.greater),
            _ => velocity.y = nudged(velocity.y, self.greater),
        }
        if Vec2::is_finite(position) && Vec2::is_finite(velocity) {
            world.set_position(self.body, position);
            world.set_velocity(self.body, velocity);
        }
    }
}

/// The next number, either away from zero or towards it.
fn nudged(value: f32, greater: bool) -> f32 {
    let bits = value.to_bits();
    match (greater, bits << 1) {
        (true, _) => f32::from_bits(bits + 1),
        (false, 0) => value,
        (false, _) => f32::from_bits(bits - 1),
    }
}

/// Phases after which a nudge has a distinct effect. The search for pairs changes no numbers, and particles are not
/// bodies.
const NUDGED: [Phase; 4] = [Phase::Inputs, Phase::Integrate, Phase::Relax, Phase::Events];

fn find_nudge(replay: &Replay, before: &Moment, tick: u32) -> Result<Option<Cause>, PlaybackError> {
    let Some(block) = replay.block_with(tick) else { return Ok(None) };
    let world = before.game.world();
    let bodies: Vec<BodyId> =
        world.ids().filter(|&id| world.motion(id) != Motion::Static).collect();
    let mut found: Option<Nudge> = None;
    let mut phases = Vec::new();
    let nudges = NUDGED.into_iter().flat_map(|phase| {
        let numbers = (0..FIELDS.len()).flat_map(|field| [(field, false), (field, true)]);
        let of_body = move |body| {
            numbers.clone().map(move |(field, greater)| Nudge { phase, body, field, greater })
        };
        bodies.iter().copied().flat_map(of_body)
    });
    for nudge in nudges.take(NUDGES_MAX) {
        let is_same = |found: &Nudge| found.body == nudge.body && found.field == nudge.field;
        if found.as_ref().is_some_and(|found| !is_same(found)) {
            continue;
        }
        if explains(replay, before, &block, nudge)? {
            found = found.or(Some(nudge));
            phases.push(nudge.phase);
        }
    }
    Ok(found.map(|Nudge { body, field, greater, .. }| Cause::Nudge {
        phases,
        body,
        field: FIELDS[field],
        recorded_is_greater: greater,
    }))
}

/// Returns true if a nudge reproduces the recorded hashes of this tick and the following ones.
fn explains(
    replay: &Replay,
    before: &Moment,
    block: &Block,
    nudge: Nudge,
) -> Result<bool, PlaybackError> {
    let mut moment = before.clone();
    let mut watch = |phase, world: &mut World| nudge.apply(phase, world);
    let first = moment.step(block, &mut watch)?;
    if !first.agrees {
        return Ok(false);
    }
    let last = replay.last_tick().min(first.tick + WITNESSES);
    for tick in first.tick + 1..=last {
        let block =
            if tick <= block.last() { Some(block.clone()) } else { replay.block_with(tick) };
        let Some(block) = block else { return Ok(false) };
        if !moment.step(&block, &mut |_, _| {})?.agrees {
            return Ok(false);
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests;
