//! What the clients of one rate are sent. A message is coded once and shared by all of them; those
//! who began with a keyframe within the last three messages share another with each other.

use crate::press::Press;
use bytes::Bytes;
use jostle_protocol::limits::{EVENTS_MAX, QUIET_MESSAGES_MAX};
use jostle_protocol::{Snapshot, Stream, TimedEvent};
use jostle_sim::{Particles, Seat};
use std::collections::VecDeque;
use std::sync::Arc;

/// How often a client is sent a snapshot.
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
    /// All of them.
    pub const ALL: [Rate; 3] = [Rate::Full, Rate::Third, Rate::Twelfth];

    /// Ticks from one message to the next.
    pub fn every(self) -> u8 {
        match self {
            Rate::Full => 1,
            Rate::Third => 3,
            Rate::Twelfth => 12,
        }
    }

    /// The next lower one, for a client that cannot follow; the lowest stays.
    pub fn lower(self) -> Rate {
        match self {
            Rate::Full => Rate::Third,
            Rate::Third | Rate::Twelfth => Rate::Twelfth,
        }
    }

    /// The next higher one, for a client that could follow it; the highest stays.
    pub fn higher(self) -> Rate {
        match self {
            Rate::Full | Rate::Third => Rate::Full,
            Rate::Twelfth => Rate::Third,
        }
    }
}

/// A client's place in its feed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reader {
    /// How often it is sent something.
    pub rate: Rate,
    /// Tick of its keyframe.
    pub began: u32,
    /// Messages of the feed before its keyframe.
    since: u64,
    /// Whose camera it sees with; the whole world if nobody's.
    pub(crate) seat: Option<Seat>,
}

impl Reader {
    /// Who sees with this player's camera.
    pub(crate) fn of(self, seat: Seat) -> Reader {
        Reader { seat: Some(seat), ..self }
    }
}

/// The particles and emitters at the end of a tick.
#[derive(Clone, Copy, Debug)]
pub struct Flying<'a> {
    /// The tick.
    pub tick: u32,
    /// What flies and runs.
    pub particles: &'a Particles,
}

/// The messages of one rate.
#[derive(Clone, Debug)]
pub struct Feed {
    rate: Rate,
    stream: Stream,
    /// Ends of those who began lately, the oldest first.
    young: VecDeque<Young>,
    /// Messages so far.
    count: u64,
    /// What happened since the newest message.
    events: Vec<TimedEvent>,
    /// The message of this tick, if there is one.
    message: Option<Bytes>,
    /// The message before's snapshot where it was made for this feed: its memory is used again.
    spare: Arc<Snapshot>,
}

/// Clients that began with the same keyframe.
#[derive(Clone, Debug)]
struct Young {
    since: u64,
    stream: Stream,
    keyframe: Bytes,
    /// The keyframe with particles, if anybody asked for it.
    flying: Option<Bytes>,
    message: Option<Bytes>,
}

impl Feed {
    /// A feed that begins with this snapshot.
    pub fn new(rate: Rate, first: &Arc<Snapshot>) -> Feed {
        let mut stream = Stream::new(rate.every());
        stream.encode(first, &[]);
        Feed {
            rate,
            stream,
            young: VecDeque::new(),
            count: 0,
            events: Vec::new(),
            message: None,
            spare: Arc::clone(first),
        }
    }

    /// How often it has a message.
    pub fn rate(&self) -> Rate {
        self.rate
    }

    /// The next tick, and the particles at its end: while some fly, clients need to know of every tick.
    pub fn push(
        &mut self,
        snapshot: &Arc<Snapshot>,
        events: &[TimedEvent],
        particles: &Particles,
        press: &mut Press,
    ) {
        if self.is_due(snapshot.tick, events.iter().copied()) && !self.is_quiet(snapshot, particles)
        {
            self.send(snapshot, particles, press);
        }
    }

    /// The same, where the snapshot is made only if it is due, and depends on the newest message's:
    /// `see` is given that one, and makes the next in the memory of an older one.
    pub fn push_seen(
        &mut self,
        tick: u32,
        events: impl Iterator<Item = TimedEvent>,
        particles: &Particles,
        press: &mut Press,
        see: impl FnOnce(&Snapshot, &mut Snapshot),
    ) {
        if !self.is_due(tick, events) {
            return;
        }
        let before = Arc::clone(self.newest());
        if Arc::get_mut(&mut self.spare).is_none() {
            self.spare = Arc::default();
        }
        see(&before, Arc::get_mut(&mut self.spare).expect("nobody else holds it"));
        if !self.is_quiet(&self.spare, particles) {
            let next = std::mem::replace(&mut self.spare, before);
            self.send(&next, particles, press);
        }
    }

    /// Takes what happened in the next tick; whether that is one of this rate.
    fn is_due(&mut self, tick: u32, events: impl Iterator<Item = TimedEvent>) -> bool {
        self.message = None;
        self.young.iter_mut().for_each(|young| young.message = None);
        self.events.extend(events);
        tick.is_multiple_of(self.rate.every().into())
    }

    /// Whether the next snapshot need not be sent.
    fn is_quiet(&self, next: &Snapshot, particles: &Particles) -> bool {
        let ticks_max = QUIET_MESSAGES_MAX * u32::from(self.rate.every());
        let quiet = !particles.stirs() && self.events.is_empty() && self.stream.is_quiet(next);
        quiet && next.tick - self.newest().tick <= ticks_max
    }

    fn newest(&self) -> &Arc<Snapshot> {
        self.stream.newest().expect("a feed begins with a snapshot")
    }

    fn send(&mut self, snapshot: &Arc<Snapshot>, particles: &Particles, press: &mut Press) {
        if self.events.len() > EVENTS_MAX {
            self.events.clear();
            self.restart(snapshot, particles);
            return;
        }
        self.count += 1;
        self.message = Some(press.message(&mut self.stream, snapshot, &self.events));
        let oldest = self.count.saturating_sub(u64::from(Stream::KEYFRAME_AGE));
        self.young.retain(|young| young.since >= oldest);
        for young in &mut self.young {
            young.message = Some(press.message(&mut young.stream, snapshot, &self.events));
        }
        self.events.clear();
    }

    /// More happened than one message may tell: a keyframe for all, which tells nothing of it but what
    /// flies since, and that only to those who have the very particles: at lower rates they are decoration.
    fn restart(&mut self, snapshot: &Arc<Snapshot>, particles: &Particles) {
        let tells = self.rate == Rate::Full && particles.stirs();
        let told = if tells { particles.tell() } else { Vec::new() };
        self.message = Some(self.stream.keyframe(snapshot, &[], &told).into());
        self.count += u64::from(Stream::KEYFRAME_AGE) + 1;
        self.young.clear();
    }

    /// A client begins with the newest message's snapshot, which may be older than the newest tick. It
    /// is told what flies if that is known of the very tick of the snapshot.
    pub fn begin(&mut self, flying: Option<Flying>) -> (Reader, Bytes) {
        let newest = self.newest().tick;
        let reader = Reader { rate: self.rate, began: newest, since: self.count, seat: None };
        let flying = flying.filter(|flying| flying.tick == newest && flying.particles.stirs());
        if self.young.back().is_none_or(|young| young.since != self.count) {
            let (stream, keyframe) = self.stream.branch(&[]);
            let (since, keyframe) = (self.count, keyframe.into());
            self.young.push_back(Young { since, stream, keyframe, flying: None, message: None });
        }
        let young = self.young.back_mut().expect("one was just put there");
        let keyframe = match flying {
            Some(Flying { particles, .. }) => {
                young.flying.get_or_insert_with(|| self.stream.branch(&particles.tell()).1.into())
            }
            None => &young.keyframe,
        };
        (reader, keyframe.clone())
    }

    /// What a client is sent in this tick, if anything. It must have been given all messages since
    /// it began.
    pub fn message(&self, reader: &Reader) -> Option<&Bytes> {
        let age = self.count.checked_sub(reader.since)?;
        if age > u64::from(Stream::KEYFRAME_AGE) {
            return self.message.as_ref();
        }
        let young = self.young.iter().find(|young| young.since == reader.since)?;
        young.message.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_protocol::ServerMessage;
    use jostle_sim::{BodyId, EmitterDef, Event, Kind, Recipe, Seat, Shape, Source, Vec2};

    /// A client at the end of a feed.
    struct Client {
        reader: Reader,
        stream: Stream,
        events: Vec<u32>,
        messages: u32,
    }

    impl Client {
        fn begin(feed: &mut Feed) -> Client {
            let (reader, keyframe) = feed.begin(None);
            let mut client =
                Client { reader, stream: Stream::default(), events: Vec::new(), messages: 0 };
            client.hear(&keyframe);
            client
        }

        fn hear(&mut self, bytes: &[u8]) {
            let message = ServerMessage::decode(bytes).unwrap();
            let ServerMessage::Snapshot(coded) = message else { panic!("{message:?}") };
            let heard = self.stream.decode(&coded).unwrap();
            self.events.extend(heard.events.iter().map(|event| event.tick));
            self.messages += 1;
        }

        /// Takes the tick's message; whether there was one.
        fn listen(&mut self, feed: &Feed) -> bool {
            let message = feed.message(&self.reader).cloned();
            message.iter().for_each(|bytes| self.hear(bytes));
            message.is_some()
        }
    }

    /// Something that moves in bursts: it rests in two of three seconds.
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
        Arc::new(Snapshot { tick, bodies: vec![body], players: Vec::new() })
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
    fn clients_of_every_rate_see_what_they_should_whenever_they_came() {
        for rate in Rate::ALL {
            let mut feed = Feed::new(rate, &snapshot(0));
            let mut clients: Vec<Client> = Vec::new();
            for tick in 1..=660 {
                let events: Vec<_> = (tick % 31 == 0).then(|| event(tick)).into_iter().collect();
                feed.push(&snapshot(tick), &events, &still(), &mut Press::default());
                for client in &mut clients {
                    if client.listen(&feed) {
                        assert_eq!(client.stream.newest(), Some(&snapshot(tick)));
                    }
                }
                if tick % 7 == 3 {
                    clients.push(Client::begin(&mut feed));
                }
            }
            assert!(feed.young.len() <= Stream::KEYFRAME_AGE as usize + 1);
            for client in clients {
                let held = client.stream.newest().unwrap();
                assert_eq!(held.bodies, snapshot(660).bodies, "{rate:?}");
                assert!(client.events.is_sorted_by(|a, b| a < b), "each event once");
            }
        }
    }

    #[test]
    fn old_clients_share_the_very_bytes() {
        let mut feed = Feed::new(Rate::Full, &snapshot(0));
        let mut early = Client::begin(&mut feed);
        feed.push(&snapshot(1), &[], &still(), &mut Press::default());
        early.listen(&feed);
        let mut late = Client::begin(&mut feed);
        for tick in 2..8 {
            feed.push(&snapshot(tick), &[], &still(), &mut Press::default());
            let place = |client: &Client| feed.message(&client.reader).unwrap().as_ptr();
            let shared = place(&early) == place(&late);
            assert_eq!(shared, tick > 4, "{tick}");
            early.listen(&feed);
            late.listen(&feed);
        }
    }

    #[test]
    fn quiet_ticks_are_not_sent_but_for_a_sign_of_life() {
        let mut feed = Feed::new(Rate::Full, &snapshot(60));
        let mut client = Client::begin(&mut feed);
        for tick in 61..=180 {
            feed.push(&snapshot(tick), &[], &still(), &mut Press::default());
            client.listen(&feed);
        }
        assert_eq!(client.messages, 1 + 120 / (QUIET_MESSAGES_MAX + 1));
        feed.push(&snapshot(180), &[], &flying(), &mut Press::default());
        assert!(client.listen(&feed), "what stirs is sent");
    }

    #[test]
    fn who_begins_is_told_what_flies_in_bytes_that_all_of_them_share() {
        let mut feed = Feed::new(Rate::Full, &snapshot(0));
        feed.push(&snapshot(1), &[], &flying(), &mut Press::default());
        let particles = flying();
        let begin =
            |feed: &mut Feed, tick| feed.begin(Some(Flying { tick, particles: &particles })).1;
        let told = begin(&mut feed, 1);
        assert_eq!(told.as_ptr(), begin(&mut feed, 1).as_ptr());
        let mut stream = Stream::default();
        assert_eq!(stream.decode(&told).unwrap().particles, particles.tell());
        let plain = feed.begin(None).1;
        assert_eq!(Snapshot::section_names(&plain).unwrap(), ["births", "keyframe"]);
        assert_eq!(begin(&mut feed, 2), plain, "known of another tick");
        assert_eq!(feed.young.len(), 1, "they share what follows");
    }

    #[test]
    fn more_events_than_a_message_may_hold_make_a_keyframe_for_all() {
        let mut feed = Feed::new(Rate::Full, &snapshot(0));
        let mut client = Client::begin(&mut feed);
        feed.push(&snapshot(1), &vec![event(1); EVENTS_MAX], &still(), &mut Press::default());
        assert!(client.listen(&feed));
        let mut young = Client::begin(&mut feed);
        feed.push(&snapshot(2), &vec![event(2); EVENTS_MAX + 1], &still(), &mut Press::default());
        assert!(client.listen(&feed) && young.listen(&feed));
        feed.push(&snapshot(3), &[event(3)], &still(), &mut Press::default());
        assert!(client.listen(&feed) && young.listen(&feed));
        assert_eq!(client.events.len(), EVENTS_MAX + 1);
        assert_eq!(young.events, [3]);
    }

    #[test]
    fn a_keyframe_for_all_tells_what_flies_at_the_full_rate_alone() {
        for rate in Rate::ALL {
            let mut feed = Feed::new(rate, &snapshot(0));
            let mut client = Client::begin(&mut feed);
            let events = vec![event(12); EVENTS_MAX + 1];
            feed.push(&snapshot(12), &events, &flying(), &mut Press::default());
            let bytes = feed.message(&client.reader).expect("a keyframe").clone();
            let told = client.stream.decode(&bytes).unwrap().particles;
            let full = if rate == Rate::Full { flying().tell() } else { Vec::new() };
            assert_eq!(told, full, "{rate:?}");
        }
    }
}
