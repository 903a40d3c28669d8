//! Where a replay and the game that comes of it part: first the tick, by the hashes; then phase,
//! body and field.
//!
//! A replay keeps no states, only 16 bits of each tick's hash. But those of the ticks after the
//! divergence are kept too, and they are a strong test: whatever is assumed to have happened must
//! give them all. So every change of one number by one unit in the last place, in every phase of
//! that tick, is tried until one does. Where none does, more than one number changed at once; the
//! next keyframe then tells which bodies differ by then.

use crate::playback::{Moment, Playback, PlaybackError};
use jostle_protocol::replay::{Block, Keyframe, Replay};
use jostle_sim::{BodyId, Difference, Game, Motion, Phase, Vec2, World};
use std::fmt;
use std::sync::Arc;

/// Nudges that are tried: what takes about a second in a busy scene.
const NUDGES_MAX: usize = 20_000;
/// Ticks after the divergence that a nudge has to explain: 16 bits of hash each.
const WITNESSES: u32 = 6;

/// Where a replay and its re-simulation part.
#[derive(Clone, Debug, PartialEq)]
pub struct Divergence {
    /// First tick whose hash differs.
    pub tick: u32,
    /// What happened in it, as far as it can be told.
    pub cause: Cause,
}

/// What a divergence comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// One number was another one, by one unit in the last place.
    Nudge {
        /// In which phases of the tick this can have happened; the earliest first.
        phases: Vec<Phase>,
        /// Whose.
        body: BodyId,
        /// Which number.
        field: &'static str,
        /// Whether the recorded one is the greater in magnitude.
        recorded_is_greater: bool,
    },
    /// More than that; the states differ so at a later keyframe. First the recorded value.
    Later {
        /// Tick of the keyframe.
        tick: u32,
        /// What differs there.
        difference: Difference,
    },
    /// No keyframe follows.
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

/// Plays a whole replay; where it parts from what was recorded, `None` if nowhere. `progress` is
/// told each tick.
pub fn verify(
    replay: &Arc<Replay>,
    mut progress: impl FnMut(u32),
) -> Result<Option<Divergence>, PlaybackError> {
    let mut playback = Playback::new(Arc::clone(replay))?;
    let mut keyframes = replay.keyframe_ticks().peekable();
    loop {
        if keyframes.next_if_eq(&playback.tick()).is_some() {
            let tick = playback.tick();
            let keyframe = replay.keyframe_before(tick);
            if let Some(cause) = keyframe.and_then(|keyframe| against(playback.game(), &keyframe)) {
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

/// What happened in the first tick that differs.
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

/// How a keyframe differs from the game at its tick.
fn against(game: &Game, keyframe: &Keyframe) -> Option<Cause> {
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
    // By playing, not from a keyframe: those are of the recorded game.
    while playback.tick() < keyframe.tick && playback.step()?.is_some() {}
    Ok(against(playback.game(), &keyframe).unwrap_or(Cause::Unknown))
}

/// A number of a body that a nudge can change.
const FIELDS: [&str; 4] = ["position.x", "position.y", "velocity.x", "velocity.y"];

/// One assumption: this number of this body, after this phase, is off by one unit.
#[derive(Clone, Copy)]
struct Nudge {
    phase: Phase,
    body: BodyId,
    field: usize,
    greater: bool,
}

impl Nudge {
    /// Does it to a world that has just ended `phase`; nothing if the body is gone.
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

/// The next number away from zero, or towards it.
fn nudged(value: f32, greater: bool) -> f32 {
    let bits = value.to_bits();
    match (greater, bits << 1) {
        (true, _) => f32::from_bits(bits + 1),
        (false, 0) => value,
        (false, _) => f32::from_bits(bits - 1),
    }
}

/// Phases after which numbers can be nudged with an effect of their own: the search for pairs
/// changes none, and particles have no bodies.
const NUDGED: [Phase; 4] = [Phase::Inputs, Phase::Integrate, Phase::Relax, Phase::Events];

fn find_nudge(replay: &Replay, before: &Moment, tick: u32) -> Result<Option<Cause>, PlaybackError> {
    let Some(block) = replay.block_with(tick) else { return Ok(None) };
    let world = before.game.world();
    let bodies: Vec<BodyId> =
        world.ids().filter(|&id| world.motion(id) != Motion::Static).collect();
    let mut found: Option<Nudge> = None;
    let mut phases = Vec::new();
    let assumptions = NUDGED.into_iter().flat_map(|phase| {
        let numbers = (0..FIELDS.len()).flat_map(|field| [(field, false), (field, true)]);
        let of_body = move |body| {
            numbers.clone().map(move |(field, greater)| Nudge { phase, body, field, greater })
        };
        bodies.iter().copied().flat_map(of_body)
    });
    for nudge in assumptions.take(NUDGES_MAX) {
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

/// Whether a nudge gives the recorded hashes, of this tick and of those that follow.
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

/// The first difference of two games that are given the same tick, with the phase that it
/// appeared in; both are one tick further afterwards. `watch_one` and `watch_other` see (and may
/// change) the worlds after each phase, before they are compared.
pub fn step_together(
    one: &mut Moment,
    other: &mut Moment,
    block: &Block,
    watch_one: &mut impl FnMut(Phase, &mut World),
    watch_other: &mut impl FnMut(Phase, &mut World),
) -> Result<Option<(Phase, Difference)>, PlaybackError> {
    let mut trail = Vec::new();
    one.step(block, &mut |phase, world| {
        watch_one(phase, world);
        trail.push(world.clone());
    })?;
    let mut found = None;
    let mut trail = trail.iter();
    other.step(block, &mut |phase, world| {
        watch_other(phase, world);
        let twin = trail.next().filter(|_| found.is_none());
        let difference = twin.and_then(|twin| twin.first_difference(world));
        found = found.or(difference.map(|difference| (phase, difference)));
    })?;
    // What the rules alone know is compared at the end.
    let rules = || Some((Phase::Events, one.game.first_difference(&other.game)?));
    Ok(found.or_else(rules))
}

#[cfg(test)]
mod tests;
