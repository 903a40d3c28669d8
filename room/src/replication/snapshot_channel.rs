//! A delta stream of snapshots, shared by all subscribers at the same rate. Each message is encoded once for all of
//! them. Only subscribers whose keyframe is one of the last three messages get a different encoding, which they share.

use super::buffer_pool::BufferPool;
use bytes::Bytes;
use jostle_game::Seat;
use jostle_protocol::limits::{EVENTS_MAX, QUIET_MESSAGES_MAX};
use jostle_protocol::{Snapshot, SnapshotStream, TimedEvent};
use jostle_sim::Particles;
use std::collections::VecDeque;
use std::sync::Arc;

/// Emitters and particles at the end of a tick.
#[derive(Clone, Copy, Debug)]
pub struct LiveParticles<'a> {
    pub tick: u32,
    pub particles: &'a Particles,
}

/// The messages at one rate.
#[derive(Clone, Debug)]
pub struct SnapshotChannel {
    rate: Rate,
    stream: SnapshotStream,
    /// Subscribers with a recent keyframe, oldest keyframe first.
    recent_joiners: VecDeque<RecentJoiners>,
    count: u64,
    /// Events since the newest message.
    events: Vec<TimedEvent>,
    /// Whether a player's input has changed since the newest message.
    acts: bool,
    /// This tick's message, if one is due.
    message: Option<Bytes>,
    /// An unused snapshot, kept to reuse its memory.
    spare: Arc<Snapshot>,
}

/// Subscribers that started from the same keyframe.
#[derive(Clone, Debug)]
struct RecentJoiners {
    since: u64,
    stream: SnapshotStream,
    keyframe: Bytes,
    /// The keyframe with live particles, if any subscriber has needed it.
    keyframe_with_particles: Option<Bytes>,
    message: Option<Bytes>,
}

impl SnapshotChannel {
    /// Creates a channel that starts with this snapshot.
    pub fn new(rate: Rate, first: &Arc<Snapshot>) -> SnapshotChannel {
        let mut stream = SnapshotStream::new(rate.every());
        stream.encode(first, &[]);
        SnapshotChannel {
            rate,
            stream,
            recent_joiners: VecDeque::new(),
            count: 0,
            events: Vec::new(),
            acts: false,
            message: None,
            spare: Arc::clone(first),
        }
    }

    /// The rate of messages.
    pub fn rate(&self) -> Rate {
        self.rate
    }

    /// Notes whether a player's input changes in the next tick. Such a tick is not quiet even if nothing moves, because
    /// the player's page measures by it when its inputs are played.
    pub fn note(&mut self, acts: bool) {
        self.acts |= acts;
    }

    /// Adds the next tick, and encodes its snapshot if that is due and something has changed. While there are live
    /// particles, every tick at this rate is sent, because clients simulate the particles tick by tick.
    pub fn push(
        &mut self,
        snapshot: &Arc<Snapshot>,
        events: &[TimedEvent],
        particles: &Particles,
        buffers: &mut BufferPool,
    ) {
        if self.is_due(snapshot.tick, events.iter().copied()) && !self.is_quiet(snapshot, particles)
        {
            self.send(snapshot, particles, buffers);
        }
    }

    /// Adds the next tick, for a snapshot that depends on the last one sent. If the tick is due, `see` receives that
    /// last snapshot and writes the next one into the memory of an older one.
    pub fn push_seen(
        &mut self,
        tick: u32,
        events: impl Iterator<Item = TimedEvent>,
        particles: &Particles,
        buffers: &mut BufferPool,
        see: impl FnOnce(&Snapshot, &mut Snapshot),
    ) {
        if !self.is_due(tick, events) {
            return;
        }
        let before = Arc::clone(self.newest());
        if Arc::get_mut(&mut self.spare).is_none() {
            self.spare = Arc::default();
        }
        see(&before, Arc::get_mut(&mut self.spare).expect("the stream does not hold it"));
        if !self.is_quiet(&self.spare, particles) {
            let next = std::mem::replace(&mut self.spare, before);
            self.send(&next, particles, buffers);
        }
    }

    /// Collects the next tick's events, and returns true if a message is due at this rate.
    fn is_due(&mut self, tick: u32, events: impl Iterator<Item = TimedEvent>) -> bool {
        self.message = None;
        self.recent_joiners.iter_mut().for_each(|joiners| joiners.message = None);
        self.events.extend(events);
        tick.is_multiple_of(self.rate.every().into())
    }

    /// Returns true if the next snapshot can be omitted.
    fn is_quiet(&self, next: &Snapshot, particles: &Particles) -> bool {
        let ticks_max = QUIET_MESSAGES_MAX * u32::from(self.rate.every());
        let happens = self.acts || particles.is_active() || !self.events.is_empty();
        let quiet = !happens && self.stream.is_quiet(next);
        quiet && next.tick - self.newest().tick <= ticks_max
    }

    fn newest(&self) -> &Arc<Snapshot> {
        self.stream.newest().expect("a channel begins with a snapshot")
    }

    fn send(&mut self, snapshot: &Arc<Snapshot>, particles: &Particles, buffers: &mut BufferPool) {
        self.acts = false;
        if self.events.len() > EVENTS_MAX {
            self.restart(snapshot, particles);
        } else {
            self.count += 1;
            self.message = Some(buffers.encode(&mut self.stream, snapshot, &self.events));
            let oldest = self.count.saturating_sub(u64::from(SnapshotStream::KEYFRAME_AGE));
            self.recent_joiners.retain(|joiners| joiners.since >= oldest);
            for joiners in &mut self.recent_joiners {
                let message = buffers.encode(&mut joiners.stream, snapshot, &self.events);
                joiners.message = Some(message);
            }
        }
        self.events.clear();
    }

    /// Sends a keyframe to all subscribers, because there were more events than fit into one message. The events are
    /// dropped. At the full rate, live particles are sent instead; at lower rates, particles are only decoration and
    /// may differ.
    fn restart(&mut self, snapshot: &Arc<Snapshot>, particles: &Particles) {
        let is_exact = self.rate == Rate::Full && particles.is_active();
        let particles = if is_exact { particles.encode() } else { Vec::new() };
        self.message = Some(self.stream.keyframe(snapshot, &[], &particles).into());
        self.count += u64::from(SnapshotStream::KEYFRAME_AGE) + 1;
        self.recent_joiners.clear();
    }

    /// Subscribes a client, starting with the snapshot of the newest message, which may be older than the newest tick.
    /// The keyframe contains the live particles only if they belong to the snapshot's tick.
    pub fn subscribe(&mut self, live: Option<LiveParticles>) -> (Subscriber, Bytes) {
        let newest = self.newest().tick;
        let subscriber =
            Subscriber { rate: self.rate, keyframe_tick: newest, since: self.count, seat: None };
        if self.recent_joiners.back().is_none_or(|joiners| joiners.since != self.count) {
            let (stream, keyframe) = self.stream.branch(&[]);
            self.recent_joiners.push_back(RecentJoiners {
                since: self.count,
                stream,
                keyframe: keyframe.into(),
                keyframe_with_particles: None,
                message: None,
            });
        }
        let joiners = self.recent_joiners.back_mut().expect("there is one of this count");
        let keyframe = match live.filter(|live| live.tick == newest && live.particles.is_active()) {
            Some(LiveParticles { particles, .. }) => joiners
                .keyframe_with_particles
                .get_or_insert_with(|| self.stream.branch(&particles.encode()).1.into()),
            None => &joiners.keyframe,
        };
        (subscriber, keyframe.clone())
    }

    /// This tick's message for a subscriber, if any. The subscriber must have received all messages since its keyframe.
    pub fn message(&self, subscriber: &Subscriber) -> Option<&Bytes> {
        let age = self.count.checked_sub(subscriber.since)?;
        if age > u64::from(SnapshotStream::KEYFRAME_AGE) {
            return self.message.as_ref();
        }
        let mut joiners = self.recent_joiners.iter();
        joiners.find(|joiners| joiners.since == subscriber.since)?.message.as_ref()
    }
}

/// The rate at which a client gets snapshots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rate {
    /// Every tick.
    #[default]
    Full,
    /// Every third tick.
    Third,
    /// Every twelfth tick.
    Twelfth,
}

impl Rate {
    /// All rates, highest first.
    pub const ALL: [Rate; 3] = [Rate::Full, Rate::Third, Rate::Twelfth];

    /// Number of ticks between messages.
    pub fn every(self) -> u8 {
        match self {
            Rate::Full => 1,
            Rate::Third => 3,
            Rate::Twelfth => 12,
        }
    }

    /// The next lower rate, for a client that is falling behind. For the lowest rate, returns the same rate.
    pub fn lower(self) -> Rate {
        match self {
            Rate::Full => Rate::Third,
            Rate::Third | Rate::Twelfth => Rate::Twelfth,
        }
    }

    /// The next higher rate, for a client that has caught up. For the highest rate, returns the same rate.
    pub fn higher(self) -> Rate {
        match self {
            Rate::Full | Rate::Third => Rate::Full,
            Rate::Twelfth => Rate::Third,
        }
    }
}

/// A client's subscription to a snapshot channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subscriber {
    /// The rate of messages.
    pub rate: Rate,
    /// Tick of the subscription's keyframe.
    pub keyframe_tick: u32,
    /// Number of messages sent on the channel before the keyframe.
    pub(super) since: u64,
    /// The player to whom this interest area belongs; `None` for the whole world.
    pub(super) seat: Option<Seat>,
}

impl Subscriber {
    /// Assigns the subscription to this player's interest area.
    pub(super) fn of(self, seat: Seat) -> Subscriber {
        Subscriber { seat: Some(seat), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_game::{Event, Kind};
    use jostle_protocol::{Appearance, PlayerState, ServerMessage};
    use jostle_sim::{BodyId, EmitterDef, Recipe, Shape, Source, Vec2};

    /// A client subscribed to a channel.
    struct Client {
        subscriber: Subscriber,
        stream: SnapshotStream,
        events: Vec<u32>,
        messages: u32,
    }

    impl Client {
        fn subscribe(channel: &mut SnapshotChannel) -> Client {
            let (subscriber, keyframe) = channel.subscribe(None);
            let mut client = Client {
                subscriber,
                stream: SnapshotStream::default(),
                events: Vec::new(),
                messages: 0,
            };
            client.decode(&keyframe);
            client
        }

        fn decode(&mut self, bytes: &[u8]) {
            let message = ServerMessage::decode(bytes).unwrap();
            let ServerMessage::Snapshot(coded) = message else { panic!("{message:?}") };
            let decoded = self.stream.decode(&coded).unwrap();
            self.events.extend(decoded.events.iter().map(|event| event.tick));
            self.messages += 1;
        }

        /// Decodes this tick's message, and returns true if there was one.
        fn receive(&mut self, channel: &SnapshotChannel) -> bool {
            let message = channel.message(&self.subscriber).cloned();
            message.iter().for_each(|bytes| self.decode(bytes));
            message.is_some()
        }
    }

    /// A body that moves in bursts and rests for two out of every three seconds.
    fn snapshot(tick: u32) -> Arc<Snapshot> {
        let (second, part) = (tick / 60, tick % 60);
        let at = 60 * (second / 3) + if second.is_multiple_of(3) { part } else { 60 };
        let body = jostle_protocol::SnapshotBody {
            id: BodyId { index: 0, generation: 0 },
            kind: Kind::Block,
            owner: None,
            group: 0,
            shape: Shape::circle(1.0),
            quanta: [at as i32 * at as i32, 7],
        };
        Arc::new(Snapshot { tick, bodies: vec![body], ..Snapshot::default() })
    }

    fn event(tick: u32) -> TimedEvent {
        TimedEvent { tick, event: Event::Joined(Seat(0)) }
    }

    fn still() -> Particles {
        Particles::default()
    }

    fn flying() -> Particles {
        let mut particles = Particles::new(vec![Recipe::default()], 10);
        let source = Source::Point(Vec2::ZERO);
        particles.start(EmitterDef { recipe: 0, count: 3, seed: 1, source });
        particles
    }

    #[test]
    fn clients_of_every_rate_see_the_snapshots_of_their_rate_whenever_they_subscribe() {
        for rate in Rate::ALL {
            let mut channel = SnapshotChannel::new(rate, &snapshot(0));
            let mut clients: Vec<Client> = Vec::new();
            for tick in 1..=660 {
                let events: Vec<_> = (tick % 31 == 0).then(|| event(tick)).into_iter().collect();
                channel.push(&snapshot(tick), &events, &still(), &mut BufferPool::default());
                for client in &mut clients {
                    if client.receive(&channel) {
                        assert_eq!(client.stream.newest(), Some(&snapshot(tick)));
                    }
                }
                if tick % 7 == 3 {
                    clients.push(Client::subscribe(&mut channel));
                }
            }
            assert!(channel.recent_joiners.len() <= SnapshotStream::KEYFRAME_AGE as usize + 1);
            for client in clients {
                let held = client.stream.newest().unwrap();
                assert_eq!(held.bodies, snapshot(660).bodies, "{rate:?}");
                assert!(client.events.is_sorted_by(|a, b| a < b), "each event once");
            }
        }
    }

    #[test]
    fn subscribers_share_the_same_bytes_a_few_messages_after_their_keyframe() {
        let mut channel = SnapshotChannel::new(Rate::Full, &snapshot(0));
        let mut early = Client::subscribe(&mut channel);
        channel.push(&snapshot(1), &[], &still(), &mut BufferPool::default());
        early.receive(&channel);
        let mut late = Client::subscribe(&mut channel);
        for tick in 2..8 {
            channel.push(&snapshot(tick), &[], &still(), &mut BufferPool::default());
            let place = |client: &Client| channel.message(&client.subscriber).unwrap().as_ptr();
            let shared = place(&early) == place(&late);
            assert_eq!(shared, tick > 4, "{tick}");
            early.receive(&channel);
            late.receive(&channel);
        }
    }

    #[test]
    fn quiet_ticks_are_not_sent_except_for_a_heartbeat() {
        let mut channel = SnapshotChannel::new(Rate::Full, &snapshot(60));
        let mut client = Client::subscribe(&mut channel);
        for tick in 61..=180 {
            channel.push(&snapshot(tick), &[], &still(), &mut BufferPool::default());
            client.receive(&channel);
        }
        assert_eq!(client.messages, 1 + 120 / (QUIET_MESSAGES_MAX + 1));
        channel.push(&snapshot(180), &[], &flying(), &mut BufferPool::default());
        assert!(client.receive(&channel), "ticks with live particles are sent");
    }

    #[test]
    fn repeated_inputs_leave_a_tick_quiet_and_changed_ones_do_not() {
        let at = |tick, input_seq| {
            let mut snapshot = Snapshot::clone(&snapshot(tick));
            snapshot.players.push(PlayerState {
                seat: Seat(0),
                appearance: Appearance { name: "Ada".into(), color: 1 },
                connected: true,
                input_seq,
                hero: None,
                selected: None,
                held: None,
                score: 0,
                pointer: None,
            });
            Arc::new(snapshot)
        };
        let mut channel = SnapshotChannel::new(Rate::Full, &at(60, 0));
        let mut client = Client::subscribe(&mut channel);
        for tick in 61..=70 {
            channel.push(&at(tick, tick), &[], &still(), &mut BufferPool::default());
            client.receive(&channel);
        }
        let before = client.messages;
        channel.push(&at(71, 71), &[], &still(), &mut BufferPool::default());
        assert!(!client.receive(&channel), "a repeat");
        channel.note(true);
        channel.push(&at(72, 72), &[], &still(), &mut BufferPool::default());
        assert!(client.receive(&channel), "a press");
        let held = client.stream.newest().unwrap();
        assert_eq!((client.messages, held.players[0].input_seq), (before + 1, 72));
        channel.push(&at(73, 73), &[], &still(), &mut BufferPool::default());
        assert!(!client.receive(&channel), "a repeat after it");
    }

    #[test]
    fn new_subscribers_share_a_keyframe_with_live_particles() {
        let mut channel = SnapshotChannel::new(Rate::Full, &snapshot(0));
        channel.push(&snapshot(1), &[], &flying(), &mut BufferPool::default());
        let particles = flying();
        let subscribe = |channel: &mut SnapshotChannel, tick| {
            channel.subscribe(Some(LiveParticles { tick, particles: &particles })).1
        };
        let keyframe = subscribe(&mut channel, 1);
        assert_eq!(keyframe.as_ptr(), subscribe(&mut channel, 1).as_ptr());
        let mut stream = SnapshotStream::default();
        assert_eq!(stream.decode(&keyframe).unwrap().particles, particles.encode());
        let plain = channel.subscribe(None).1;
        assert_eq!(Snapshot::section_names(&plain).unwrap(), ["births", "keyframe"]);
        assert_eq!(subscribe(&mut channel, 2), plain, "particles of another tick are left out");
        assert_eq!(channel.recent_joiners.len(), 1, "they share the messages that follow");
    }

    #[test]
    fn more_events_than_a_message_may_hold_make_a_keyframe_for_all() {
        let mut channel = SnapshotChannel::new(Rate::Full, &snapshot(0));
        let mut client = Client::subscribe(&mut channel);
        channel.push(
            &snapshot(1),
            &vec![event(1); EVENTS_MAX],
            &still(),
            &mut BufferPool::default(),
        );
        assert!(client.receive(&channel));
        let mut late = Client::subscribe(&mut channel);
        channel.push(
            &snapshot(2),
            &vec![event(2); EVENTS_MAX + 1],
            &still(),
            &mut BufferPool::default(),
        );
        assert!(client.receive(&channel) && late.receive(&channel));
        channel.push(&snapshot(3), &[event(3)], &still(), &mut BufferPool::default());
        assert!(client.receive(&channel) && late.receive(&channel));
        assert_eq!(client.events.len(), EVENTS_MAX + 1);
        assert_eq!(late.events, [3]);
    }

    #[test]
    fn a_keyframe_for_all_holds_live_particles_at_the_full_rate_alone() {
        for rate in Rate::ALL {
            let mut channel = SnapshotChannel::new(rate, &snapshot(0));
            let mut client = Client::subscribe(&mut channel);
            let events = vec![event(12); EVENTS_MAX + 1];
            channel.push(&snapshot(12), &events, &flying(), &mut BufferPool::default());
            let bytes = channel.message(&client.subscriber).expect("a keyframe").clone();
            let decoded = client.stream.decode(&bytes).unwrap().particles;
            let full = if rate == Rate::Full { flying().encode() } else { Vec::new() };
            assert_eq!(decoded, full, "{rate:?}");
        }
    }
}
