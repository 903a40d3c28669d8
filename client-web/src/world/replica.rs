//! The client's replica of a room: snapshots by tick, particles simulated locally from emitter events, flashes and
//! news, and the frame contents derived from them.

pub mod dye;
pub mod highlights;
pub mod listener;
pub mod moments;
pub mod picture;
pub mod room;

use crate::net::clock::Arrival;
use crate::net::timeline::Sample;
use crate::sound::cue::{Cue, Sound};
use crate::view::frame::{EffectKind, FrameBody};
use crate::world::predict::Predicted;
use dye::Dye;
use highlights::Highlights;
use jostle_game::scene::{To, Whose};
use jostle_game::{Event, Kind, SEATS_MAX, Scene, Seat, Side};
use jostle_protocol::{
    Appearance, DecodeError, Decoded, PlayerState, Snapshot, SnapshotStream, TimedEvent,
};
use jostle_sim::particles::{Obstacle, dequantise, quantise};
use jostle_sim::{EmitterDef, Features, Particles, TICKS_PER_SECOND, Vec2};
use listener::Listener;
use moments::Moments;
pub use picture::Eye;
use picture::RoomPicture;
use room::{KNOWN_TICKS, RoomView};
use std::collections::VecDeque;
use std::sync::Arc;

/// Maximum number of ticks caught up at once after an absence. Older particles have expired anyway.
const CATCH_UP_TICKS_MAX: u32 = 600;
/// Maximum number of unread news items; the oldest are dropped first.
const NEWS_MAX: usize = 32;

/// An event worth a line of text.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    Joined(Appearance),
    Left(Appearance),
    /// This page's host removed a player.
    Removed(Appearance),
    /// A player's pack burst on another player's hero, or on a hero without a player.
    Hit(Appearance, Option<Appearance>),
    /// A player has taken another name: the look before, and the new one.
    Renamed(Appearance, Appearance),
    /// A player's hero left the world.
    Fell(Appearance),
    /// A player scored for another team.
    OwnGoal(Appearance),
    /// A message from a rule of the scene, between the names of two players.
    Said(Option<Appearance>, String, Option<Appearance>),
    /// The player was given this appearance because another player already has the colour with this number.
    Recolored(Appearance, u8),
}

/// A replica of a room.
pub struct Replica {
    /// The room at the displayed moment.
    pub room: RoomView,
    /// The picture of the room at that moment.
    pub picture: RoomPicture,
    /// The features of the scene.
    pub features: Features,
    stream: SnapshotStream,
    particles: Particles,
    /// Particles from a keyframe whose tick has not been displayed yet.
    told: Option<(u32, Particles)>,
    /// The most recent tick whose events and particles were played.
    applied: Option<u32>,
    waiting: VecDeque<TimedEvent>,
    /// Unread news, oldest first.
    pub news: VecDeque<News>,
    names: Vec<Option<Appearance>>,
    ears: Listener,
    dye: Dye,
    /// The newest event.
    pub moments: Moments,
    /// Highlights, if the game has rounds.
    pub highlights: Option<Highlights>,
}

impl Replica {
    /// Creates an empty replica of a room that plays `scene`.
    pub fn new(scene: Arc<Scene>, seat: Seat) -> Replica {
        Replica {
            features: scene.features(),
            ears: Listener::new(&scene),
            dye: Dye::default(),
            moments: Moments::default(),
            highlights: Highlights::of(&scene),
            stream: SnapshotStream::default(),
            particles: Particles::new(scene.world.recipes.clone(), scene.world.particles_max),
            told: None,
            room: RoomView::new(scene, seat),
            picture: RoomPicture::default(),
            applied: None,
            waiting: VecDeque::new(),
            news: VecDeque::new(),
            names: vec![None; SEATS_MAX],
        }
    }

    /// Creates a replica that records no highlights.
    pub fn without_highlights(scene: Arc<Scene>, seat: Seat) -> Replica {
        Replica { highlights: None, ..Replica::new(scene, seat) }
    }

    /// Creates a replica without particles, for use where the game's own particles are drawn.
    pub fn without_particles(scene: Arc<Scene>, seat: Seat) -> Replica {
        let none = Particles::new(scene.world.recipes.clone(), 0);
        Replica { particles: none, ..Replica::without_highlights(scene, seat) }
    }

    /// Prepares for snapshots from another socket, which start with a keyframe.
    pub fn begin_stream(&mut self) {
        self.stream = SnapshotStream::default();
    }

    /// Decodes and stores a snapshot. Returns its timing and the number of emitters that it starts.
    pub fn hear(&mut self, coded: &[u8]) -> Result<(Arrival, usize), DecodeError> {
        let before = self.stream.newest().map(Arc::clone);
        let Decoded { events, unchanged_until, particles } = self.stream.decode(coded)?;
        let newest = self.stream.newest().map(Arc::clone).expect("a snapshot was decoded");
        if !particles.is_empty() {
            self.told = Some((newest.tick, self.read_particles(&particles)?));
        }
        // Nothing changed in the omitted snapshots, so motion must not be interpolated across them.
        let still = before.as_ref().zip(unchanged_until);
        if let Some((before, tick)) = still {
            self.file(Snapshot { tick, ..Snapshot::clone(before) }, Vec::new());
        }
        let known = unchanged_until.or(before.map(|before| before.tick));
        let arrival = Arrival {
            tick: newest.tick,
            first: known.map_or(newest.tick, |known| (known + 1).min(newest.tick)),
            ticks_until_next: self.stream.ticks_until_next(),
        };
        let starts = |timed: &&TimedEvent| {
            matches!(timed.event, Event::EmitterStarted(_) | Event::ScheduledEmitterStarted { .. })
        };
        let emitters = events.iter().filter(starts).count();
        self.file(newest, events);
        Ok((arrival, emitters))
    }

    fn read_particles(&self, told: &[u8]) -> Result<Particles, DecodeError> {
        let told = Particles::decode(
            self.room.scene.world.recipes.clone(),
            self.room.scene.world.particles_max,
            told,
        );
        told.map_err(|error| DecodeError::OutOfRange { field: error.field })
    }

    /// Stores a snapshot and the events since the previous one.
    pub fn file(&mut self, snapshot: impl Into<Arc<Snapshot>>, events: Vec<TimedEvent>) {
        let snapshot = snapshot.into();
        for player in &snapshot.players {
            let Some(known) = self.names.get_mut(usize::from(player.seat.0)) else { continue };
            let before = known.replace(player.appearance.clone());
            let before = before.filter(|before| before.name != player.appearance.name);
            let Some(before) = before else { continue };
            // Somebody else may have taken the seat.
            let joins = |timed: &TimedEvent| timed.event == Event::Joined(player.seat);
            let was_here = self
                .room
                .newest()
                .is_some_and(|newest| newest.players.iter().any(|known| known.seat == player.seat));
            if was_here && !events.iter().any(joins) {
                self.tell(News::Renamed(before, player.appearance.clone()));
            }
        }
        if let Some(highlights) = &mut self.highlights {
            highlights.note(&snapshot, &events);
        }
        self.waiting.extend(events);
        self.room.timeline.file(snapshot);
    }

    /// Moves the display to fractional `tick`, playing the events and particles of each tick passed, then samples
    /// bodies and flashes.
    pub fn advance(&mut self, tick: f64, eye: Eye) {
        let Some(newest) = self.room.newest().map(|s| s.tick) else { return };
        let until = (tick.max(0.0) as u32).min(newest);
        let told = self.told.as_ref().map(|told| told.0).filter(|&told| told <= until);
        let first = || told.unwrap_or(until).saturating_sub(1);
        let from = self.applied.unwrap_or_else(first);
        for next in from.max(until.saturating_sub(CATCH_UP_TICKS_MAX)) + 1..=until {
            self.play_tick(next);
        }
        let is_first = self.applied.is_none();
        let known_ticks = if is_first { KNOWN_TICKS } else { 0.0 };
        self.applied = Some(from.max(until));
        self.room.sample(tick);
        self.ears.hear_samples(&self.room, self.moments.race.as_ref(), tick, is_first);
        if let Some(sound) = self.moments.observe(&self.room, tick) {
            self.ears.push(tick, Cue::of_room(sound));
        }
        self.room.note_births(tick - known_ticks);
        self.present(tick, eye);
        self.room.timeline.forget_before(tick - 1.0);
    }

    /// Moves the display to fractional `tick` without playing events or particles.
    pub fn show(&mut self, tick: f64, eye: Eye) {
        self.room.sample(tick);
        self.present(tick, eye);
    }

    fn present(&mut self, tick: f64, eye: Eye) {
        self.room.display = tick;
        self.room.led_from = None;
        self.picture.lay_out(&self.room, eye);
        self.dye.lay_out(&self.room, &mut self.picture.drawn);
        self.moments.lay_out(&self.room, &mut self.picture.drawn);
    }

    /// Plays events first, then particles, in the order of the server's tick. At a whole tick the samples are
    /// bit-identical to the positions in its snapshot.
    fn play_tick(&mut self, tick: u32) {
        while let Some(timed) = self.waiting.pop_front_if(|timed| timed.tick <= tick) {
            self.play_event(timed);
        }
        if let Some((told, particles)) = self.told.take_if(|told| told.0 <= tick) {
            self.particles = particles;
            if told == tick {
                return;
            }
        }
        self.room.sample(f64::from(tick));
        let samples = &self.room.samples;
        let obstacles = match self.particles.is_empty() {
            true => Vec::new(),
            false => obstacles(&self.room.scene, samples),
        };
        let quantum = self.room.scene.world.quantum;
        self.particles.step(&obstacles, |id| {
            let place = samples.binary_search_by_key(&id.index, |s| s.id.index).ok()?;
            let body = &samples[place];
            (body.id == id).then(|| on_grid(body.center, quantum))
        });
    }

    fn play_event(&mut self, timed: TimedEvent) {
        match timed.event {
            Event::EmitterStarted(emitter) => {
                self.dye.emit(timed.tick, emitter);
                self.start(emitter);
            }
            Event::ScheduledEmitterStarted { index, seed } => {
                if let Some(emitter) = self.room.scene.emitter(index, seed) {
                    self.start(emitter);
                }
            }
            Event::Impact { a, b, point, speed } => {
                let body = if self.room.is_hero(b) && !self.room.is_hero(a) { b } else { a };
                self.picture.flash(timed.tick, EffectKind::Spark, point, None, speed, Some(body));
                self.ears.hear_impact(&self.room, timed.tick, [a, b], point, speed);
            }
            Event::PackHit { owner, victim, hero, point } => {
                let by = owner.and_then(|seat| self.name(seat));
                let color = by.as_ref().map(|n| n.color);
                let flash = f32::from(u8::from(self.dye.flashes(timed.tick)));
                self.picture.flash(timed.tick, EffectKind::Splash, point, color, flash, Some(hero));
                if let Some(color) = color {
                    self.dye.burst(&self.room, timed.tick, hero, point, color);
                }
                let burst = Cue { at: Some(point), ..Cue::of_room(Sound::Burst) };
                self.ears.push(f64::from(timed.tick), burst);
                self.moments.note_burst(&self.room, f64::from(timed.tick), owner, victim, point);
                // Hits between other players are visible, but too frequent to report as text.
                let is_own = owner == Some(self.room.seat) || victim == Some(self.room.seat);
                if let Some(by) = by.filter(|_| is_own || self.room.scene.rules.round.is_none()) {
                    let whom = victim.and_then(|seat| self.name(seat));
                    self.tell(News::Hit(by, whom));
                }
            }
            Event::BodyLeft { kind, body, point } => {
                let owner = self.room.owner(body).and_then(|seat| self.name(seat));
                let color = owner.as_ref().map(|n| n.color);
                self.picture.flash(timed.tick, EffectKind::Gone, point, color, 0.0, Some(body));
                if let (Kind::Hero, Some(name)) = (kind, owner) {
                    self.tell(News::Fell(name));
                }
            }
            Event::Said { rule, it, by } => self.say(timed.tick, rule, it, by),
            Event::Joined(seat) => {
                if let Some(name) = self.name(seat).filter(|_| seat != self.room.seat) {
                    self.tell(News::Joined(name));
                }
            }
            Event::Left(seat) => self.tell_left(seat),
        }
    }

    fn tell_left(&mut self, seat: Seat) {
        let is_removed = self.room.removed.extract_if(.., |one| *one == seat).count() > 0;
        if let Some(name) = self.name(seat) {
            self.tell(if is_removed { News::Removed(name) } else { News::Left(name) });
        }
    }

    /// Reports a rule's message, unless it names an unknown player.
    fn say(&mut self, tick: u32, rule: u8, it: Option<Seat>, by: Option<Seat>) {
        let Some(rule) = self.room.scene.rules.rules.get(usize::from(rule)) else { return };
        let Some(line) = rule.effects.say.clone() else { return };
        if let Some(seat) = it.filter(|_| rule.effects.score > 0) {
            let own = self.room.round().map(|round| round.side_of(seat));
            let is_own_goal = match (rule.to, own) {
                (To::Team(team), Some(Side::Team(own))) => team != own,
                _ => false,
            };
            self.moments.note_line(f64::from(tick), seat, is_own_goal);
            if let Some(name) = self.name(seat).filter(|_| is_own_goal) {
                return self.tell(News::OwnGoal(name));
            }
        }
        let name = |whose| match whose {
            None => Some(None),
            Some(Whose::It) => self.name(it?).map(Some),
            Some(Whose::By) => self.name(by?).map(Some),
        };
        if let (Some(first), Some(last)) = (name(line.first), name(line.last)) {
            self.tell(News::Said(first, line.text, last));
        }
    }

    /// Starts an emitter. The room reports only emitters for which it had capacity, and the replica has the same
    /// capacity.
    fn start(&mut self, emitter: EmitterDef) {
        if usize::from(emitter.recipe) < self.room.scene.world.recipes.len() {
            self.particles.start(emitter);
        }
    }

    fn tell(&mut self, news: News) {
        if self.news.len() == NEWS_MAX {
            self.news.pop_front();
        }
        self.news.push_back(news);
    }

    /// The appearance of a current or former player, in the team's colour.
    fn name(&self, seat: Seat) -> Option<Appearance> {
        let name = self.names.get(usize::from(seat.0)).cloned().flatten()?;
        Some(Appearance { color: self.room.team_color(seat).unwrap_or(name.color), ..name })
    }

    /// Bodies at the displayed moment, in index order.
    pub fn bodies(&self) -> &[FrameBody] {
        &self.picture.drawn.bodies
    }

    /// Particles as of the last whole tick.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// Seconds since the tick of the particles, at most one tick.
    pub fn particle_lead(&self) -> f32 {
        let ticks = self.applied.map_or(0.0, |tick| self.room.display - f64::from(tick));
        ticks.clamp(0.0, 1.0) as f32 / TICKS_PER_SECOND as f32
    }

    /// The player's hero as displayed.
    pub fn own_hero(&self) -> Option<&FrameBody> {
        let hero = self.room.own()?.hero?;
        self.picture.drawn.bodies.iter().find(|b| b.id == hero)
    }

    /// Shows the player's hero at its predicted position instead of its position in the snapshots.
    pub fn lead(&mut self, own: Predicted) {
        let Some(place) = self.room.samples.iter().position(|sample| sample.id == own.id) else {
            return;
        };
        let Predicted { center, velocity, .. } = own;
        self.room.led_from =
            Some((self.room.samples[place].center, self.room.samples[place].velocity));
        let (sample, body) = (&mut self.room.samples[place], &mut self.picture.drawn.bodies[place]);
        (sample.center, sample.velocity) = (center, velocity);
        (body.center, body.velocity) = (center, velocity);
    }

    /// Centre and velocity of the player's hero at the displayed moment according to the snapshots, even if it is shown
    /// elsewhere.
    pub fn own_hero_as_told(&self) -> Option<(Vec2, Vec2)> {
        self.room.led_from.or_else(|| self.own_hero().map(|hero| (hero.center, hero.velocity)))
    }

    /// The centre of a hero's upper edge at the displayed moment.
    pub fn top_of_hero(&self, player: &PlayerState) -> Option<Vec2> {
        let hero = player.hero.and_then(|id| self.bodies().iter().find(|body| body.id == id))?;
        Some(hero.center + Vec2::new(0.0, hero.shape.half_extent().y))
    }

    /// The next queued cue.
    pub fn next_cue(&mut self) -> Option<Cue> {
        self.ears.pop(self.room.display)
    }
}

/// The bodies that push particles away, in index order and at the positions that clients see.
fn obstacles(scene: &Scene, samples: &[Sample]) -> Vec<Obstacle> {
    samples
        .iter()
        .filter(|s| scene.world.meets_particles >> s.group & 1 == 1)
        .map(|s| {
            Obstacle::new(s.shape, quantise(s.center, scene.world.quantum), scene.world.quantum)
        })
        .collect()
}

/// Rounds a point to the quantum. Centres taken from a snapshot are unchanged.
fn on_grid(point: Vec2, quantum: f32) -> Vec2 {
    dequantise(quantise(point, quantum), quantum)
}

#[cfg(test)]
mod tests;
