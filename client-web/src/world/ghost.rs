//! A ghost: the hero of a run that was recorded, in step with the round that is played now. It is played again in the
//! page from its replay, beside the game, and meets nothing.

use crate::view::frame::FrameBody;
use jostle_game::{Kind, RoundInfo, RoundPhase, Scene, Seat, SnapshotBody};
use jostle_protocol::replay::Replay;
use jostle_room::Playback;
use jostle_sim::Vec2;
use std::sync::Arc;

/// Which run, and where in its replay the round began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GhostWish {
    /// The number in the name of the record.
    pub number: u64,
    /// Ticks of the replay before the round.
    pub begin: u32,
    pub seat: Seat,
}

impl GhostWish {
    /// Reads the value of `ghost` in an address: number, begin and seat, with dots between.
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
    /// The display's tick at which the round began that runs, or ran last.
    origin: Option<f64>,
    /// The hero after the last two ticks that were played.
    trail: [Option<FrameBody>; 2],
    /// The hero to draw.
    pub shown: Option<FrameBody>,
}

impl Ghost {
    /// The ghost of a replay, if that is of this scene.
    pub fn new(bytes: Vec<u8>, wish: GhostWish, scene: &Scene) -> Option<Ghost> {
        let replay = Arc::new(Replay::read(bytes).ok()?);
        let GhostWish { begin, seat, .. } = wish;
        let is_of_scene = replay.start().scene == scene.source && begin < replay.last_tick();
        let playback = Playback::new(replay).ok().filter(|_| is_of_scene)?;
        Some(Ghost { playback, begin, seat, origin: None, trail: [None; 2], shown: None })
    }

    /// Moves on to the moment of the run that belongs to the displayed one, as far as `may_go_on` lets it play.
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
            // What cannot be played ends there, and the ghost with it.
            let _ = self.playback.jump(goal.saturating_sub(1));
        }
        while self.playback.tick() < goal && may_go_on() {
            if !matches!(self.playback.step(), Ok(Some(_))) {
                break;
            }
            self.trail = [self.trail[1], self.hero()];
        }
        // On its way to the beginning it is not to be seen.
        let is_there = self.playback.tick() + 1 >= goal.max(self.begin);
        let late = (f64::from(self.playback.tick()) - moment).clamp(0.0, 1.0) as f32;
        self.shown = self.trail[1].filter(|_| is_there).map(|now| {
            let before = self.trail[0].map_or(now.center, |before| before.center);
            FrameBody { center: now.center + (before - now.center) * late, ..now }
        });
    }

    /// The hero as it is now.
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
