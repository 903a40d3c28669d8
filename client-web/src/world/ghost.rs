//! A ghost: the hero of a recorded run, synchronised with the current round. The page re-simulates it from the run's
//! replay next to the game; it collides with nothing.

use crate::view::frame::FrameBody;
use crate::world::replica::moments::race::Race;
use jostle_game::{Kind, RoundInfo, RoundPhase, Scene, Seat, SnapshotBody};
use jostle_protocol::replay::Replay;
use jostle_room::Playback;
use jostle_sim::Vec2;
use std::sync::Arc;

/// Identifies a run and the point in its replay at which the round began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GhostWish {
    /// The number in the record's name.
    pub number: u64,
    /// The tick of the replay at which the round begins.
    pub begin: u32,
    pub seat: Seat,
}

impl GhostWish {
    /// Parses the value of `ghost` in an address: number, start tick and seat, separated by dots.
    pub fn parse(text: &str) -> Option<GhostWish> {
        let mut parts = text.split('.');
        let number = u64::from_str_radix(parts.next()?, 16).ok()?;
        let (begin, seat) = (parts.next()?.parse().ok()?, Seat(parts.next()?.parse().ok()?));
        Some(GhostWish { number, begin, seat })
    }

    /// The address of the record's replay.
    pub fn file(&self, scene: &str) -> String {
        format!("/records/{scene}-{:016x}.jostle", self.number)
    }
}

/// The ghost of a run.
pub struct Ghost {
    playback: Playback,
    begin: u32,
    seat: Seat,
    /// The displayed tick at which the current or previous round began.
    origin: Option<f64>,
    /// The hero after each of the last two ticks played.
    trail: [Option<FrameBody>; 2],
    /// The hero to draw.
    pub shown: Option<FrameBody>,
    /// The race that the ghost flies, until the displayed moment.
    race: Option<Race>,
    round: Option<RoundInfo>,
}

impl Ghost {
    /// Creates a ghost from a replay; `None` if the replay does not show this scene.
    pub fn new(bytes: Vec<u8>, wish: GhostWish, scene: &Scene) -> Option<Ghost> {
        let replay = Arc::new(Replay::read(bytes).ok()?);
        let GhostWish { begin, seat, .. } = wish;
        let is_of_scene = replay.start().scene == scene.source && begin < replay.last_tick();
        let playback = Playback::new(replay).ok().filter(|_| is_of_scene)?;
        let race = Race::of(scene);
        let (origin, trail, round) = (None, [None; 2], None);
        Some(Ghost { playback, begin, seat, origin, trail, shown: None, race, round })
    }

    /// Advances the ghost to the moment of its run that corresponds to the displayed one, for as long as `may_go_on`
    /// returns `true`.
    pub fn advance(
        &mut self,
        round: Option<&RoundInfo>,
        display: f64,
        mut may_go_on: impl FnMut() -> bool,
    ) {
        match round.map(|round| (round.phase, f64::from(round.since))) {
            Some((RoundPhase::Running, since)) => self.origin = Some(since),
            Some((RoundPhase::Over, _)) => {}
            _ => self.origin = None,
        }
        let elapsed = self.origin.map_or(0.0, |origin| (display - origin).max(0.0));
        let moment = f64::from(self.begin) + elapsed;
        let goal = (moment.ceil() as u32).min(self.playback.replay().last_tick());
        if self.playback.tick() > goal {
            self.trail = [None; 2];
            // If the replay cannot be played any further, the ghost stops there.
            let _ = self.playback.jump(goal.saturating_sub(1));
        }
        while self.playback.tick() < goal && may_go_on() {
            if !matches!(self.playback.step(), Ok(Some(_))) {
                break;
            }
            self.trail = [self.trail[1], self.hero()];
            if let Some(race) = &mut self.race {
                self.playback.game().capture_round(&mut self.round);
                self.round.iter().for_each(|round| race.note(round, self.playback.tick()));
            }
        }
        // The ghost is hidden until it has reached the right moment.
        let is_there = self.playback.tick() + 1 >= goal.max(self.begin);
        let late = (f64::from(self.playback.tick()) - moment).clamp(0.0, 1.0) as f32;
        self.shown = self.trail[1].filter(|_| is_there).map(|now| {
            let before = self.trail[0].map_or(now.center, |before| before.center);
            FrameBody { center: now.center + (before - now.center) * late, ..now }
        });
    }

    /// The name of the player who flew the run.
    pub fn name(&self) -> Option<&str> {
        let members = &self.playback.moment().members;
        members.get(&self.seat.0).map(|look| &*look.name)
    }

    /// Ticks after the start at which the ghost passed each gate so far.
    pub fn marks(&self) -> &[u32] {
        self.race.as_ref().map_or(&[], |race| race.marks(self.seat))
    }

    /// The current state of the hero.
    fn hero(&self) -> Option<FrameBody> {
        let (game, members) = (self.playback.game(), &self.playback.moment().members);
        let is_own = |body: &SnapshotBody| body.kind == Kind::Hero && body.owner == Some(self.seat);
        let hero = game.bodies().find(is_own)?;
        Some(FrameBody {
            id: hero.id,
            kind: hero.kind,
            color: members.get(&self.seat.0).map(|look| look.color),
            shape: hero.shape,
            center: game.world().position(hero.id),
            velocity: Vec2::ZERO,
            age: 1.0,
            gaze: None,
            touching: false,
            hidden: false,
            hot: false,
            cracked: false,
            ring: None,
            squash: None,
        })
    }
}

#[cfg(test)]
mod tests;
