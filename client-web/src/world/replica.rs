//! The client's copy of a room: snapshots by tick, the particles that it simulates itself from emitter
//! events, flashes, news, and from all of these the contents of a frame.

mod dress;
mod ears;
pub mod highlights;
mod marks;
mod own_hero;
mod sling;
mod sounding;
mod zones;

use crate::net::clock::Arrival;
use crate::net::timeline::{Sample, Timeline};
use crate::sound::cue::{Cue, Sound};
use crate::view::frame::{
    Effect, EffectKind, FrameBody, FrameLamp, FrameMark, FrameSling, FrameZone,
};
use ears::Ears;
use highlights::Highlights;
use jostle_game::scene::Whose;
use jostle_game::{Event, Kind, RoundInfo, SEATS_MAX, Scene, Seat, Tools};
use jostle_protocol::{
    Appearance, DecodeError, Decoded, PlayerState, Snapshot, SnapshotStream, TimedEvent,
};
use jostle_sim::particles::{Obstacle, dequantise, quantise};
use jostle_sim::short_sort::sort_few;
use jostle_sim::{BodyId, EmitterDef, Features, Particles, TICKS_PER_SECOND, Vec2};
use std::collections::VecDeque;
use std::sync::Arc;

/// Ticks that are caught up at once after an absence; particles of longer ago are gone anyway.
const CATCH_UP_TICKS_MAX: u32 = 600;
/// Ticks for which a flash is shown.
const EFFECT_TICKS: f64 = TICKS_PER_SECOND as f64;
/// Bodies that are in a copy from its beginning were there before it: they count as so old, ticks.
const KNOWN_TICKS: f64 = 60.0 * TICKS_PER_SECOND as f64;
/// Flashes at a time; the oldest go first.
const EFFECTS_MAX: usize = 256;
/// Unread news; the oldest go first.
const NEWS_MAX: usize = 32;

/// Something that happened, worth a line.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    Joined(Appearance),
    Left(Appearance),
    /// One player's pack burst on another's hero, or on a hero without a player.
    Hit(Appearance, Option<Appearance>),
    /// A player's hero left the world.
    Fell(Appearance),
    /// A rule of the scene says this between the names of two players.
    Said(Option<Appearance>, String, Option<Appearance>),
    /// The own player looks like this, because somebody has the colour with this number.
    Recolored(Appearance, u8),
}

/// The player's part in a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Eye {
    /// Own pointer in world units.
    pub pointer: Option<Vec2>,
    /// The bounds view is on.
    pub bounds: bool,
}

#[derive(Clone, Copy, Debug)]
struct Flash {
    tick: u32,
    effect: Effect,
}

/// A copy of a room.
pub struct Replica {
    /// The scene that is played.
    pub scene: Arc<Scene>,
    /// Features of the scene, of which the page draws some.
    pub features: Features,
    pub seat: Seat,
    stream: SnapshotStream,
    timeline: Timeline,
    particles: Particles,
    /// Particles of a keyframe whose tick was not shown yet.
    told: Option<(u32, Particles)>,
    /// The last tick whose events and particles were played.
    applied: Option<u32>,
    waiting: VecDeque<TimedEvent>,
    flashes: VecDeque<Flash>,
    /// Unread news, the oldest first.
    pub news: VecDeque<News>,
    names: Vec<Option<Appearance>>,
    /// For each slot the generation in it and the tick at which it was born, as far as is known.
    births: Vec<(u32, f64)>,
    /// Bodies of the displayed moment with their owners, in index order.
    pub samples: Vec<Sample>,
    bodies: Vec<FrameBody>,
    /// Zones of the displayed moment.
    pub zones: Vec<FrameZone>,
    /// Marks that are to be seen at the displayed moment.
    pub marks: Vec<FrameMark>,
    /// Lamps of the displayed moment.
    pub lamps: Vec<FrameLamp>,
    /// The sling of the displayed moment.
    pub sling: Option<FrameSling>,
    /// Flashes of the last second.
    pub effects: Vec<Effect>,
    /// The fractional tick on display.
    pub display: f64,
    /// Centre and velocity of the own hero in the samples before it was shown elsewhere.
    led_from: Option<(Vec2, Vec2)>,
    ears: Ears,
    /// In a game of rounds.
    pub highlights: Option<Highlights>,
}

impl Replica {
    /// An empty copy of a room that plays `scene`.
    pub fn new(scene: Arc<Scene>, seat: Seat) -> Replica {
        Replica {
            features: scene.features(),
            ears: Ears::new(&scene),
            highlights: Highlights::of(&scene),
            stream: SnapshotStream::default(),
            timeline: Timeline::new(scene.world.quantum, scene.world.speed_max),
            particles: Particles::new(scene.world.recipes.clone(), scene.world.particles_max),
            told: None,
            scene,
            seat,
            applied: None,
            waiting: VecDeque::new(),
            flashes: VecDeque::new(),
            news: VecDeque::new(),
            names: vec![None; SEATS_MAX],
            births: Vec::new(),
            samples: Vec::new(),
            bodies: Vec::new(),
            zones: Vec::new(),
            marks: Vec::new(),
            lamps: Vec::new(),
            sling: None,
            effects: Vec::new(),
            display: 0.0,
            led_from: None,
        }
    }

    /// A copy that keeps no highlights.
    pub fn without_highlights(scene: Arc<Scene>, seat: Seat) -> Replica {
        Replica { highlights: None, ..Replica::new(scene, seat) }
    }

    /// A copy that grows no particles of its own: they are drawn from the game itself.
    pub fn without_particles(scene: Arc<Scene>, seat: Seat) -> Replica {
        let none = Particles::new(scene.world.recipes.clone(), 0);
        Replica { particles: none, ..Replica::without_highlights(scene, seat) }
    }

    /// The newest snapshot.
    pub fn newest(&self) -> Option<&Snapshot> {
        self.timeline.newest()
    }

    /// The newest two snapshots that are filed, the newest first.
    pub fn newest_two(&self) -> (Option<&Snapshot>, Option<&Snapshot>) {
        self.timeline.newest_two()
    }

    /// Snapshots come from another socket from now on, which begins with a keyframe.
    pub fn begin_stream(&mut self) {
        self.stream = SnapshotStream::default();
    }

    /// Reads a coded snapshot and files it: what it says about time, and how many emitters it starts.
    pub fn hear(&mut self, coded: &[u8]) -> Result<(Arrival, usize), DecodeError> {
        let before = self.stream.newest().map(Arc::clone);
        let Decoded { events, unchanged_until, particles } = self.stream.decode(coded)?;
        let newest = self.stream.newest().map(Arc::clone).expect("a snapshot was decoded");
        if !particles.is_empty() {
            self.told = Some((newest.tick, self.read_particles(&particles)?));
        }
        // Nothing changed in the omitted snapshots: nothing glides into the next one.
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
            self.scene.world.recipes.clone(),
            self.scene.world.particles_max,
            told,
        );
        told.map_err(|error| DecodeError::OutOfRange { field: error.field })
    }

    /// Files a snapshot and the events that led to it.
    pub fn file(&mut self, snapshot: impl Into<Arc<Snapshot>>, events: Vec<TimedEvent>) {
        let snapshot = snapshot.into();
        for player in &snapshot.players {
            if let Some(name) = self.names.get_mut(usize::from(player.seat.0)) {
                *name = Some(player.appearance.clone());
            }
        }
        if let Some(highlights) = &mut self.highlights {
            highlights.note(&snapshot, &events);
        }
        self.waiting.extend(events);
        self.timeline.file(snapshot);
    }

    /// Moves the display to fractional `tick`: plays the events and particles of each tick that
    /// passes, then samples bodies and flashes.
    pub fn advance(&mut self, tick: f64, eye: Eye) {
        let Some(newest) = self.newest().map(|s| s.tick) else { return };
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
        self.timeline.sample(tick, &mut self.samples);
        self.hear_samples(tick, is_first);
        for sample in &self.samples {
            note_birth(&mut self.births, sample.id, tick - known_ticks);
        }
        self.present(tick, eye);
        self.timeline.forget_before(tick - 1.0);
    }

    /// Moves the display to fractional `tick` without playing anything.
    pub fn show(&mut self, tick: f64, eye: Eye) {
        self.timeline.sample(tick, &mut self.samples);
        self.present(tick, eye);
    }

    /// Displayed position of a body.
    pub fn place(&self, id: BodyId) -> Option<Vec2> {
        self.sampled(id).map(|sample| sample.center)
    }

    fn present(&mut self, tick: f64, eye: Eye) {
        self.display = tick;
        self.led_from = None;
        self.dress(eye);
        self.lay_out_zones();
        self.lay_out_marks();
        self.lay_out_sling();
        self.collect_effects();
    }

    /// Events first, then particles: the order of the server's tick. At a whole tick the samples are the
    /// places of its snapshot, to the last bit.
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
        self.timeline.sample(f64::from(tick), &mut self.samples);
        let samples = &self.samples;
        let obstacles = match self.particles.is_empty() {
            true => Vec::new(),
            false => obstacles(&self.scene, samples),
        };
        let quantum = self.scene.world.quantum;
        self.particles.step(&obstacles, |id| {
            let place = samples.binary_search_by_key(&id.index, |s| s.id.index).ok()?;
            let body = &samples[place];
            (body.id == id).then(|| on_grid(body.center, quantum))
        });
    }

    fn play_event(&mut self, timed: TimedEvent) {
        match timed.event {
            Event::EmitterStarted(emitter) => self.start(emitter),
            Event::ScheduledEmitterStarted { index, seed } => {
                if let Some(emitter) = self.scene.emitter(index, seed) {
                    self.start(emitter);
                }
            }
            Event::Impact { a, b, point, speed } => {
                let body = if self.is_hero(b) && !self.is_hero(a) { b } else { a };
                self.flash(timed.tick, EffectKind::Spark, point, None, speed, Some(body));
                self.hear_impact(timed.tick, [a, b], point, speed);
            }
            Event::PackHit { owner, victim, hero, point } => {
                let by = owner.and_then(|seat| self.name(seat));
                let color = by.as_ref().map(|n| n.color);
                self.flash(timed.tick, EffectKind::Splash, point, color, 0.0, Some(hero));
                let burst = Cue { at: Some(point), ..Cue::of_room(Sound::Burst) };
                self.ears.push(f64::from(timed.tick), burst);
                // What others do to each other is seen, and too much to be read.
                let is_own = owner == Some(self.seat) || victim == Some(self.seat);
                if let Some(by) = by.filter(|_| is_own || self.scene.rules.round.is_none()) {
                    let whom = victim.and_then(|seat| self.name(seat));
                    self.tell(News::Hit(by, whom));
                }
            }
            Event::BodyLeft { kind, body, point } => {
                let owner = self.owner(body).and_then(|seat| self.name(seat));
                let color = owner.as_ref().map(|n| n.color);
                self.flash(timed.tick, EffectKind::Gone, point, color, 0.0, Some(body));
                if let (Kind::Hero, Some(name)) = (kind, owner) {
                    self.tell(News::Fell(name));
                }
            }
            Event::Said { rule, it, by } => self.say(rule, it, by),
            Event::Joined(seat) => {
                if let Some(name) = self.name(seat).filter(|_| seat != self.seat) {
                    self.tell(News::Joined(name));
                }
            }
            Event::Left(seat) => {
                if let Some(name) = self.name(seat) {
                    self.tell(News::Left(name));
                }
            }
        }
    }

    /// A rule says its line, unless a player whom it names is not known.
    fn say(&mut self, rule: u8, it: Option<Seat>, by: Option<Seat>) {
        let rule = self.scene.rules.rules.get(usize::from(rule));
        let Some(line) = rule.and_then(|rule| rule.effects.say.clone()) else { return };
        let name = |whose| match whose {
            None => Some(None),
            Some(Whose::It) => self.name(it?).map(Some),
            Some(Whose::By) => self.name(by?).map(Some),
        };
        if let (Some(first), Some(last)) = (name(line.first), name(line.last)) {
            self.tell(News::Said(first, line.text, last));
        }
    }

    /// The room reports only those that found a place, and this copy has as many.
    fn start(&mut self, emitter: EmitterDef) {
        if usize::from(emitter.recipe) < self.scene.world.recipes.len() {
            self.particles.start(emitter);
        }
    }

    fn flash(
        &mut self,
        tick: u32,
        kind: EffectKind,
        point: Vec2,
        color: Option<u8>,
        strength: f32,
        body: Option<BodyId>,
    ) {
        if self.flashes.len() == EFFECTS_MAX {
            self.flashes.pop_front();
        }
        let effect = Effect { kind, point, age: 0.0, color, strength, body };
        self.flashes.push_back(Flash { tick, effect });
    }

    fn tell(&mut self, news: News) {
        if self.news.len() == NEWS_MAX {
            self.news.pop_front();
        }
        self.news.push_back(news);
    }

    /// Name of a player who is here or was, in the colour of the team.
    fn name(&self, seat: Seat) -> Option<Appearance> {
        let name = self.names.get(usize::from(seat.0)).cloned().flatten()?;
        Some(Appearance { color: self.team_color(seat).unwrap_or(name.color), ..name })
    }

    /// The sample of a body at the last sampled moment.
    fn sampled(&self, id: BodyId) -> Option<&Sample> {
        let place = self.samples.binary_search_by_key(&id.index, |s| s.id.index).ok()?;
        Some(&self.samples[place]).filter(|s| s.id == id)
    }

    fn is_hero(&self, id: BodyId) -> bool {
        self.sampled(id).is_some_and(|s| s.kind == Kind::Hero)
    }

    fn owner(&self, id: BodyId) -> Option<Seat> {
        self.sampled(id).and_then(|s| s.owner)
    }

    fn collect_effects(&mut self) {
        while self
            .flashes
            .front()
            .is_some_and(|flash| self.display - f64::from(flash.tick) > EFFECT_TICKS)
        {
            self.flashes.pop_front();
        }
        self.effects.clear();
        self.effects.extend(self.flashes.iter().map(|flash| {
            let ticks = (self.display - f64::from(flash.tick)).max(0.0);
            Effect { age: (ticks / f64::from(TICKS_PER_SECOND)) as f32, ..flash.effect }
        }));
    }

    /// Bodies of the displayed moment, in index order.
    pub fn bodies(&self) -> &[FrameBody] {
        &self.bodies
    }

    /// Particles as of the last whole tick.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// Seconds since the tick that the particles are at, at most one tick.
    pub fn particle_lead(&self) -> f32 {
        let ticks = self.applied.map_or(0.0, |tick| self.display - f64::from(tick));
        ticks.clamp(0.0, 1.0) as f32 / TICKS_PER_SECOND as f32
    }

    /// Players of the displayed moment in seat order.
    pub fn players(&self) -> &[PlayerState] {
        self.timeline.at_or_before(self.display).map_or(&[], |s| &s.players)
    }

    /// The same players by their scores, the best first.
    pub fn ranking(&self) -> Vec<&PlayerState> {
        let mut order: Vec<_> = self.players().iter().collect();
        sort_few(&mut order, |one, other| one.score > other.score);
        order
    }

    /// What the displayed snapshot says of the round, in a game.
    pub fn round(&self) -> Option<&RoundInfo> {
        self.timeline.at_or_before(self.display)?.round.as_ref()
    }

    /// The colour of a player: the team's, in a game of teams.
    pub fn color_of(&self, player: &PlayerState) -> u8 {
        self.team_color(player.seat).unwrap_or(player.appearance.color)
    }

    fn team_color(&self, seat: Seat) -> Option<u8> {
        let team = self.round().and_then(|round| round.player(seat)?.team)?;
        Some(self.scene.rules.teams.get(usize::from(team))?.color)
    }

    /// The own player, once it is in a displayed snapshot.
    pub fn own(&self) -> Option<&PlayerState> {
        self.players().iter().find(|p| p.seat == self.seat)
    }

    /// The own hero on display.
    pub fn own_hero(&self) -> Option<&FrameBody> {
        let hero = self.own()?.hero?;
        self.bodies.iter().find(|b| b.id == hero)
    }

    /// Kind of the body that the own player selected, in scenes of selecting.
    pub fn selected_kind(&self) -> Option<Kind> {
        let selecting = self.scene.tools.contains(Tools::SELECT);
        let id = self.own()?.selected.filter(|_| selecting)?;
        self.sampled(id).map(|sample| sample.kind)
    }
}

/// Notes when a body was born unless that is known; a new generation in a slot starts over.
fn note_birth(births: &mut Vec<(u32, f64)>, id: BodyId, tick: f64) {
    let slot = id.index as usize;
    if births.len() <= slot {
        births.resize(slot + 1, (u32::MAX, 0.0));
    }
    if births[slot].0 != id.generation {
        births[slot] = (id.generation, tick);
    }
}

/// Seconds from a body's birth, as far as it is known, to the tick on display.
fn age(births: &[(u32, f64)], id: BodyId, display: f64) -> f32 {
    let birth = births.get(id.index as usize).filter(|birth| birth.0 == id.generation);
    let born = birth.map_or(display - KNOWN_TICKS, |birth| birth.1);
    ((display - born).max(0.0) / f64::from(TICKS_PER_SECOND)) as f32
}

/// Bodies that particles are pushed out of, in index order and where clients see them.
fn obstacles(scene: &Scene, samples: &[Sample]) -> Vec<Obstacle> {
    samples
        .iter()
        .filter(|s| scene.world.meets_particles >> s.group & 1 == 1)
        .map(|s| {
            Obstacle::new(s.shape, quantise(s.center, scene.world.quantum), scene.world.quantum)
        })
        .collect()
}

/// A point rounded to the quantum. Centres that come from a snapshot stay as they are.
fn on_grid(point: Vec2, quantum: f32) -> Vec2 {
    dequantise(quantise(point, quantum), quantum)
}

#[cfg(test)]
mod tests;
