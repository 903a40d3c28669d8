use crate::limits::{BODIES_MAX, EVENTS_MAX, QUANTA_MAX, SERVER_MESSAGE_BYTES_MAX};
use crate::{
    Appearance, DecodeError, Decoded, PlayerState, Snapshot, SnapshotBody, SnapshotStream,
    TimedEvent,
};
use jostle_game::{
    Event, Kind, OrderProgress, RoundInfo, RoundPhase, RoundPlayer, SEATS_MAX, Seat, Side,
    SideInfo, SlingInfo, Taking,
};
use jostle_sim::Rng;
use jostle_sim::{BodyId, EmitterDef, Shape, Source, Vec2};
use std::sync::Arc;

fn body(index: u32, x: i32) -> SnapshotBody {
    SnapshotBody {
        id: BodyId { index, generation: 0 },
        kind: Kind::Block,
        owner: None,
        group: 3,
        shape: Shape::circle(1.5),
        quanta: [x, 0],
    }
}

fn player(seat: u16, name: &str) -> PlayerState {
    PlayerState {
        seat: Seat(seat),
        appearance: Appearance::new(name, (seat % 8) as u8).unwrap(),
        connected: true,
        input_seq: 0,
        hero: None,
        selected: None,
        held: None,
        score: 0,
        pointer: None,
    }
}

/// Both ends of a stream.
#[derive(Clone, Default)]
struct Link {
    sender: SnapshotStream,
    reader: SnapshotStream,
}

impl Link {
    /// A stream with this snapshot at both ends.
    fn holding(snapshot: &Snapshot) -> Link {
        let mut link = Link::default();
        link.send(snapshot, &[]);
        link
    }

    /// Sends a snapshot, compares the decoded one with it, and returns the bytes.
    fn send(&mut self, snapshot: &Snapshot, events: &[TimedEvent]) -> Vec<u8> {
        let bytes = self.sender.encode(&Arc::new(snapshot.clone()), events);
        assert_eq!(self.reader.decode(&bytes).unwrap().events, events);
        assert_eq!(&**self.reader.newest().unwrap(), snapshot);
        assert_eq!(self.reader.bodies, self.sender.bodies);
        assert_eq!(self.reader.pointers, self.sender.pointers);
        bytes
    }
}

fn keyframe(snapshot: &Snapshot) -> Vec<u8> {
    Link::default().send(snapshot, &[])
}

fn decode(bytes: &[u8], base: Option<&Snapshot>) -> Result<Decoded, DecodeError> {
    base.map_or_else(Link::default, Link::holding).reader.decode(bytes)
}

// A world that changes at random.

fn random_id(rng: &mut Rng) -> BodyId {
    BodyId { index: rng.below(BODIES_MAX as u32), generation: rng.next_u32() >> rng.below(32) }
}

fn random_quanta(rng: &mut Rng) -> [i32; 2] {
    let range = QUANTA_MAX >> rng.below(20);
    [0; 2].map(|_| rng.below(2 * range as u32 + 1) as i32 - range)
}

fn random_point(rng: &mut Rng) -> Vec2 {
    Vec2::new(rng.range(-100.0, 100.0), rng.range(-100.0, 100.0))
}

fn random_body(rng: &mut Rng, index: u32) -> SnapshotBody {
    SnapshotBody {
        id: BodyId { index, generation: rng.below(3) },
        kind: Kind::ALL[rng.below(7) as usize],
        group: rng.below(32) as u8,
        owner: (rng.below(4) == 0).then(|| Seat(rng.below(SEATS_MAX as u32) as u16)),
        shape: match rng.below(2) {
            0 => Shape::circle(rng.range(0.1, 9.0)),
            _ => Shape::rect(rng.range(0.1, 9.0), rng.range(0.1, 9.0)),
        },
        quanta: random_quanta(rng),
    }
}

fn random_event(rng: &mut Rng) -> Event {
    let seat = Seat(rng.below(SEATS_MAX as u32) as u16);
    let point = random_point(rng);
    match rng.below(8) {
        0 => {
            let (a, b) = (random_id(rng), random_id(rng));
            Event::Impact { a, b, point, speed: rng.range(0.0, 90.0) }
        }
        1 => {
            let victim = (rng.below(2) == 0).then_some(Seat(0));
            Event::PackHit { owner: Some(seat), victim, hero: random_id(rng), point }
        }
        7 => Event::Said { rule: 3, it: Some(seat), by: (rng.below(2) == 0).then_some(Seat(0)) },
        2 => Event::BodyLeft { kind: Kind::Marble, body: random_id(rng), point },
        3 => {
            let source = match rng.below(2) {
                0 => Source::Point(point),
                _ => Source::Body(random_id(rng)),
            };
            let count = rng.below(1 << 16) as u16;
            Event::EmitterStarted(EmitterDef { recipe: 3, count, seed: rng.next_u32(), source })
        }
        4 => Event::Joined(seat),
        5 => Event::ScheduledEmitterStarted { index: rng.next_u32() as u8, seed: rng.next_u32() },
        _ => Event::Left(seat),
    }
}

fn change_player(rng: &mut Rng, player: &mut PlayerState) {
    player.input_seq = player.input_seq.wrapping_add(1);
    match rng.below(12) {
        0 => player.input_seq = rng.next_u32(),
        1 => player.appearance.color = rng.below(8) as u8,
        2 => player.connected = !player.connected,
        3 => player.hero = (rng.below(2) == 0).then(|| random_id(rng)),
        4 => player.selected = (rng.below(2) == 0).then(|| random_id(rng)),
        5 => player.held = (rng.below(2) == 0).then(|| random_id(rng)),
        6 => player.score = rng.below(1 << 16) as u16,
        7 => player.pointer = (rng.below(4) > 0).then(|| random_quanta(rng)),
        8 => player.input_seq = player.input_seq.wrapping_sub(1),
        _ => {}
    }
}

/// The snapshot `ticks` later, in which some bodies and players have disappeared, changed or appeared.
fn advance(rng: &mut Rng, snapshot: &Snapshot, ticks: u32) -> Snapshot {
    let mut next = snapshot.clone();
    next.tick += ticks;
    next.bodies.retain(|_| rng.below(20) > 0);
    for body in &mut next.bodies {
        body.quanta = match rng.below(9) {
            0 => random_quanta(rng),
            1 | 2 => body.quanta.map(|axis| (axis + 3).clamp(-QUANTA_MAX, QUANTA_MAX)),
            _ => body.quanta,
        };
    }
    for _ in 0..rng.below(4) {
        let index = rng.below(60);
        next.bodies.retain(|body| body.id.index != index);
        next.bodies.push(random_body(rng, index));
    }
    next.bodies.sort_by_key(|body| body.id.index);
    next.players.retain(|_| rng.below(30) > 0);
    next.players.iter_mut().for_each(|player| change_player(rng, player));
    let seat = rng.below(12) as u16;
    if rng.below(10) == 0 && next.players.iter().all(|player| player.seat.0 != seat) {
        next.players.push(player(seat, "Ørsted 🙂"));
        next.players.sort_by_key(|player| player.seat);
    }
    if rng.below(4) == 0 {
        next.round = (rng.below(8) > 0).then(|| random_round(rng));
    }
    next
}

fn random_round(rng: &mut Rng) -> RoundInfo {
    let side_info = |rng: &mut Rng| SideInfo {
        score: rng.below(2_000_001) as i32 - 1_000_000,
        lives: rng.below(4) as i32,
        is_in: rng.below(2) == 0,
    };
    let teams: Vec<SideInfo> = (0..rng.below(9)).map(|_| side_info(rng)).collect();
    let team_count = teams.len() as u32;
    let mut players = Vec::new();
    for seat in 0..SEATS_MAX as u16 {
        if rng.below(40) > 0 {
            continue;
        }
        let team = (team_count > 0).then(|| rng.below(team_count.max(1)) as u8);
        let side = side_info(rng);
        let (is_stunned, goes_on) = (rng.below(2) == 0, rng.below(2) == 0);
        players.push(RoundPlayer { seat: Seat(seat), team, side, is_stunned, goes_on });
    }
    let some_side = |rng: &mut Rng| match rng.below(2) {
        0 if team_count > 0 => Side::Team(rng.below(team_count) as u8),
        _ => Side::Player(Seat(rng.below(SEATS_MAX as u32) as u16)),
    };
    let takings = (0..rng.below(3)).map(|zone| {
        let (side, since) = (some_side(rng), rng.next_u32());
        Taking { zone: zone as u8, side, since }
    });
    let takings = takings.collect();
    let orders = (0..rng.below(3)).map(|signal| {
        let side = (rng.below(2) == 0).then(|| some_side(rng));
        OrderProgress { signal: signal as u8, side, steps: rng.next_u32() as u8 }
    });
    let orders = orders.collect();
    RoundInfo {
        takings,
        orders,
        resting: u64::from(rng.below(2) * rng.next_u32()) << rng.below(30),
        phase: RoundPhase::ALL[rng.below(4) as usize],
        since: rng.next_u32(),
        winners: (0..rng.below(5)).map(|_| some_side(rng)).collect(),
        holders: (0..rng.below(64)).map(|_| (rng.below(2) == 0).then(|| some_side(rng))).collect(),
        zones: u64::from(rng.next_u32()) << 32 | u64::from(rng.next_u32()),
        sling: (rng.below(2) == 0)
            .then(|| SlingInfo { shots: rng.next_u32() as u8, is_flying: rng.below(2) == 0 }),
        cracked: (0..40).filter(|_| rng.below(8) == 0).collect(),
        teams,
        players,
    }
}

fn random_events(rng: &mut Rng, after: u32, tick: u32) -> Vec<TimedEvent> {
    let mut ticks: Vec<_> =
        (0..rng.below(4)).map(|_| after + 1 + rng.below(tick - after)).collect();
    ticks.sort_unstable();
    ticks.into_iter().map(|tick| TimedEvent { tick, event: random_event(rng) }).collect()
}

#[test]
fn every_snapshot_arrives_with_the_events_since_the_last() {
    let mut rng = Rng::new(1, 0);
    let mut truth = Snapshot { tick: 7, ..Snapshot::default() };
    let mut link = Link::holding(&truth);
    for _ in 0..2000 {
        let ticks = 1 + rng.below(3) * rng.below(85);
        let next = advance(&mut rng, &truth, ticks);
        let events = random_events(&mut rng, truth.tick, next.tick);
        link.send(&next, &events);
        truth = next;
    }
}

#[test]
fn a_reader_is_given_the_tick_until_which_nothing_changed() {
    let (mut sender, mut reader) = (SnapshotStream::new(3), SnapshotStream::default());
    let mut unchanged_until = |tick: u32, x: i32| {
        let next = Snapshot { tick, bodies: vec![body(0, x)], ..Snapshot::default() };
        reader.decode(&sender.encode(&Arc::new(next), &[])).unwrap().unchanged_until
    };
    assert_eq!(unchanged_until(30, 0), None);
    assert_eq!(unchanged_until(33, 5), None);
    assert_eq!(unchanged_until(45, 9), Some(42));
    assert_eq!(unchanged_until(48, 9), None);
}

#[test]
fn a_late_reader_shares_the_bytes_after_three_messages() {
    let mut rng = Rng::new(2, 0);
    let mut truth = Snapshot { tick: 7, ..Snapshot::default() };
    let mut link = Link::holding(&truth);
    for _ in 0..300 {
        truth = advance(&mut rng, &truth, 1);
        link.send(&truth, &[]);
        let mut late = Link::holding(&truth);
        let mut shared = link.clone();
        for age in 1..8 {
            truth = advance(&mut rng, &truth, 1);
            let (own, all) = (late.send(&truth, &[]), shared.send(&truth, &[]));
            assert!(
                age <= SnapshotStream::KEYFRAME_AGE || own == all,
                "{age} messages after a keyframe"
            );
        }
        link = shared;
    }
}

#[test]
fn a_body_that_changed_more_than_its_position_counts_as_another() {
    let base = Snapshot { tick: 1, bodies: vec![body(3, 0), body(4, 0)], ..Snapshot::default() };
    let same = base.bodies[0];
    let others = [
        SnapshotBody { id: BodyId { index: 3, generation: 1 }, ..same },
        SnapshotBody { kind: Kind::Pack, ..same },
        SnapshotBody { owner: Some(Seat(0)), ..same },
        SnapshotBody { group: 4, ..same },
        SnapshotBody { shape: Shape::circle(2.0), ..same },
        SnapshotBody { quanta: [0, 1], ..same },
        SnapshotBody { quanta: [1, 0], ..same },
    ];
    for other in others {
        let next = Snapshot { tick: 2, bodies: vec![other, base.bodies[1]], ..base.clone() };
        Link::holding(&base).send(&next, &[]);
    }
}

#[test]
fn steady_motion_costs_a_bit_and_rest_costs_nothing() {
    let at = |tick: u32, x: i32| Snapshot {
        tick,
        bodies: (0..800).map(|index| body(index, if index < 400 { x } else { 0 })).collect(),
        players: Vec::new(),
        round: None,
    };
    let mut link = Link::holding(&at(0, 0));
    for tick in 1..4 {
        link.send(&at(tick, 7 * tick as i32), &[]);
    }
    // All points are at their expected positions, so the moves section is omitted.
    assert_eq!(link.send(&at(4, 28), &[]), [0x80, 4]);
    // One point is not: there are 400 bits for the moving points, one bit for the count of zero woken points, and the
    // difference.
    let mut next = at(5, 35);
    next.bodies[9].quanta[0] += 1;
    assert!(link.send(&next, &[]).len() <= 2 + 51);
}

#[test]
fn a_stream_is_quiet_only_after_several_still_snapshots() {
    let mut link = Link::holding(&small());
    let mut next = small();
    assert!(link.sender.is_quiet(&Snapshot { tick: 301, ..small() }));
    next.bodies[0].quanta[0] += 1;
    assert!(!link.sender.is_quiet(&next));
    for age in 0..4 {
        next.tick += 1;
        link.send(&next, &[]);
        assert_eq!(link.sender.is_quiet(&next), age == 3, "{age}");
    }
}

#[test]
fn the_fullest_snapshot_fits_a_message() {
    let mut rng = Rng::new(3, 0);
    let far = |index| SnapshotBody {
        id: BodyId { index, generation: u32::MAX },
        owner: Some(Seat(SEATS_MAX as u16 - 1)),
        shape: Shape::rect(3.3, 4.4),
        quanta: [-QUANTA_MAX, QUANTA_MAX],
        ..body(index, 0)
    };
    let base = Snapshot {
        tick: 1,
        bodies: (0..BODIES_MAX as u32).map(|index| body(index, QUANTA_MAX)).collect(),
        ..Snapshot::default()
    };
    let full = Snapshot {
        tick: 200,
        bodies: (0..BODIES_MAX as u32).map(far).collect(),
        players: (0..SEATS_MAX as u16).map(|seat| player(seat, &"🙂".repeat(16))).collect(),
        round: Some(random_round(&mut rng)),
    };
    let events: Vec<_> =
        (0..EVENTS_MAX).map(|_| TimedEvent { tick: 200, event: random_event(&mut rng) }).collect();
    assert!(Link::holding(&base).send(&full, &events).len() < SERVER_MESSAGE_BYTES_MAX);
    assert!(keyframe(&full).len() < SERVER_MESSAGE_BYTES_MAX);
}

// Bytes as documented.

fn small() -> Snapshot {
    let hero = SnapshotBody {
        id: BodyId { index: 2, generation: 1 },
        kind: Kind::Hero,
        owner: Some(Seat(1)),
        group: 0,
        shape: Shape::rect(2.0, 4.0),
        quanta: [-1, 64],
    };
    let players = vec![PlayerState { hero: Some(hero.id), ..player(1, "Ann") }];
    Snapshot { tick: 300, bodies: vec![body(0, 5), hero], players, round: None }
}

#[test]
fn a_keyframe_has_the_documented_bytes() {
    let head = [0b1100_1100, 0xac, 2, 1];
    let block = [0, 0, 6, 3, 0, 0, 0xc0, 0x3f, 10, 0];
    let hero = [1, 1, 0b1_1000, 0, 1, 0, 0, 0x80, 0x3f, 0, 0, 0, 0x40, 1, 0x80, 1];
    let ann = [1, 3, b'A', b'n', b'n', 1, 1, 1, 2, 1, 0, 0, 0, 0, 0];
    let bytes = [&head[..], &[2], &block, &hero, &[4, 1], &ann].concat();
    assert_eq!(keyframe(&small()), bytes);
    assert_eq!(Snapshot::section_names(&bytes).unwrap(), ["births", "players", "keyframe"]);
}

#[test]
fn a_delta_has_the_documented_bytes() {
    let mut link = Link::holding(&small());
    let mut next = small();
    next.tick = 302;
    next.bodies[1].quanta = [-3, 65];
    next.players[0].input_seq = 2;
    next.players[0].score = 1;
    let events = [TimedEvent { tick: 301, event: Event::Joined(Seat(1)) }];
    let head = [0b1011_1010, 46];
    // From the lowest bit: one of two points woke, 1 0 0; after one, 1 0; -2 as 3, 0 1 1; 1 as 2, 0 0 1.
    let moves = [0b1100_1001, 0b100];
    let players = [2, 1, 0b10_0000, 1, 1];
    let joined = [1, 1, 4, 1];
    let bytes = [&head[..], &moves, &players, &joined].concat();
    assert_eq!(link.send(&next, &events), bytes);
    let names = Snapshot::section_names(&bytes).unwrap();
    assert_eq!(names, ["moves", "players", "inputs", "events"]);
    assert!(Snapshot::section_names(&[]).is_err());
}

#[test]
fn a_tick_without_change_costs_its_head_and_a_bit_a_player() {
    let mut rng = Rng::new(4, 0);
    let bodies = (0..900).map(|index| random_body(&mut rng, index)).collect();
    let players = (0..8).map(|seat| player(seat, "Ann")).collect();
    let mut truth = Snapshot { tick: 100, bodies, players, round: None };
    let mut link = Link::holding(&truth);
    truth.tick = 101;
    truth.players.iter_mut().for_each(|player| player.input_seq += 1);
    assert_eq!(link.send(&truth, &[]), [0b1001_0000, 101, 0xff]);
    truth.tick = 102;
    assert_eq!(link.send(&truth, &[]), [0b1000_0000, 102]);
}

#[test]
fn an_event_of_200_particles_costs_few_bytes() {
    let emitter = EmitterDef { recipe: 0, count: 200, seed: 9, source: Source::Point(Vec2::ONE) };
    let base = Snapshot { tick: 1, ..Snapshot::default() };
    let next = Snapshot { tick: 2, ..Snapshot::default() };
    let event = TimedEvent { tick: 2, event: Event::EmitterStarted(emitter) };
    let bytes = |events: &[TimedEvent]| Link::holding(&base).send(&next, events).len();
    assert_eq!(bytes(&[event]) - bytes(&[]), 19);
    let repeated =
        TimedEvent { tick: 2, event: Event::ScheduledEmitterStarted { index: 200, seed: 9 } };
    assert_eq!(bytes(&[repeated]) - bytes(&[]), 8, "the scene knows the rest");
    assert_eq!(bytes(&[repeated; 2]) - bytes(&[]), 15);
}

// Bytes that are refused.

#[test]
fn a_delta_needs_a_keyframe_before() {
    let mut link = Link::holding(&small());
    let delta = link.send(&Snapshot { tick: 301, ..small() }, &[]);
    assert_eq!(SnapshotStream::default().decode(&delta), Err(DecodeError::NoBaseline));
    // A keyframe needs no baseline, and replaces the previous one.
    let mut moved = small();
    moved.bodies[1].quanta = [9, 9];
    link.sender = SnapshotStream::default();
    link.send(&moved, &[]);
    assert!(link.sender.is_quiet(&moved) && link.reader.is_quiet(&moved));
}

#[test]
fn a_refused_message_leaves_the_stream_unchanged() {
    let mut link = Link::holding(&small());
    let mut next = Snapshot { tick: 301, ..small() };
    next.bodies[0].quanta[1] = 70;
    let bytes = link.clone().send(&next, &[]);
    assert!(link.reader.decode(&bytes[..bytes.len() - 1]).is_err());
    assert!(link.reader.decode(&[&bytes[..], &[0]].concat()).is_err());
    link.send(&next, &[]);
}

#[test]
fn fields_out_of_range_are_named() {
    let base = small();
    let delta = |sections: u8, rest: &[u8], field| {
        let bytes = [&[0x80 | sections, 45], rest].concat();
        let refused = Err(DecodeError::OutOfRange { field });
        assert_eq!(decode(&bytes, Some(&base)), refused, "{bytes:?}");
    };
    delta(0x41, &[], "sections");
    delta(1, &[0], "deaths");
    delta(1, &[3, 0, 0, 0], "deaths");
    delta(1, &[1, 2, 0], "death");
    // The cases are, in order: no woken points, three of two, one of two after a gap of two, and a displacement of
    // zero.
    delta(2, &[0], "moves");
    delta(2, &[0b0_0011], "woken");
    delta(2, &[0b01_1001], "woken");
    delta(2, &[0b0001, 0], "move");
    delta(4, &[1, 0, 0, 6, 0, 0, 0, 0xc0, 0x3f, 10, 0], "birth");
    delta(4, &[1, 1, 0, 7, 0, 0, 0, 0xc0, 0x3f, 10, 0], "body kind");
    delta(4, &[1, 1, 0, 0x26, 0, 0, 0, 0xc0, 0x3f, 10, 0], "body tag");
    delta(4, &[1, 1, 0, 6, 0, 0, 0, 0, 0, 10, 0], "body size");
    delta(4, &[1, 1, 0, 6, 0, 0, 0, 0xc0, 0xbf, 10, 0], "body size");
    delta(4, &[1, 1, 0, 6, 0, 0, 0, 0xc0, 0x7f, 10, 0], "body size");
    delta(4, &[1, 1, 0, 6, 32, 0, 0, 0xc0, 0x3f, 10, 0], "group");
    delta(8, &[0], "players");
    delta(8, &[16], "players");
    delta(8, &[8, 1, 0x80], "phase of the round");
    delta(8, &[8, 1, 8, 0, 0, 0, 0, 0, 0, 0], "phase of the round");
    delta(8, &[8, 1, 2, 0, 0, 1, 0, 4, 0, 0], "team");
    delta(8, &[8, 1, 2, 0, 0, 0, 1, 3], "side");
    delta(8, &[1, 0], "players gone");
    delta(8, &[1, 2], "players gone");
    delta(8, &[2, 0], "players changed");
    delta(8, &[2, 1, 0], "player fields");
    delta(8, &[4, 1, 1, 1, b'A', 0, 1, 0, 0, 0, 0, 0, 0], "seat");
    delta(8, &[4, 1, 0x80, 4, 1, b'A', 0, 1, 0, 0, 0, 0, 0, 0], "seat");
    delta(16, &[0], "inputs advanced");
    delta(16, &[2], "inputs advanced");
    delta(32, &[0], "events");
    delta(32, &[1, 0, 4, 1], "event tick");
    delta(32, &[1, 2, 4, 1], "event tick");
    delta(32, &[1, 1, 9, 1], "event kind");
    let kind = Err(DecodeError::OutOfRange { field: "sections" });
    assert_eq!(decode(&[4, 45], Some(&base)), kind);
    let trailing = decode(&[0x80, 45, 0], Some(&base));
    assert_eq!(trailing, Err(DecodeError::Trailing { count: 1 }));
}

#[test]
fn a_giant_count_is_refused_before_anything_is_allocated() {
    for (section, rest, field) in
        [(4, &[60, 0, 0][..], "births"), (8, &[4, 60, 0, 0], "players"), (32, &[60, 0], "events")]
    {
        let found = decode(&[&[0xc0 | section, 1, 1], rest].concat(), None);
        assert_eq!(found, Err(DecodeError::Truncated { field }));
    }
    let found = decode(&[0xc4, 1, 1, 0xff, 0xff, 0xff, 0xff, 0x0f], None);
    assert_eq!(found, Err(DecodeError::OutOfRange { field: "births" }));
    let long = vec![0xc0; SERVER_MESSAGE_BYTES_MAX + 1];
    assert!(matches!(decode(&long, None), Err(DecodeError::TooLong { .. })));
}

/// Asserts that an accepted snapshot could have been sent.
fn assert_sound(snapshot: &Snapshot, events: &[TimedEvent], base: &Snapshot, bytes: &[u8]) {
    assert!(snapshot.bodies.is_sorted_by(|a, b| a.id.index < b.id.index));
    assert!(snapshot.bodies.len() <= BODIES_MAX && events.len() <= EVENTS_MAX);
    assert!(snapshot.players.is_sorted_by(|a, b| a.seat < b.seat));
    let inside = |quanta: [i32; 2]| quanta.iter().all(|axis| axis.abs() <= QUANTA_MAX);
    assert!(snapshot.bodies.iter().all(|body| inside(body.quanta)));
    // Memory use is bounded by the number of bytes received.
    assert!(snapshot.bodies.capacity() <= base.bodies.len() + bytes.len());
    assert!(events.iter().all(|event| event.tick <= snapshot.tick));
    keyframe(snapshot);
}

#[test]
fn damaged_bytes_never_panic() {
    let mut rng = Rng::new(5, 0);
    let mut base = Snapshot { tick: 40, ..Snapshot::default() };
    let mut link = Link::holding(&base);
    let mut accepted = 0;
    for _ in 0..400 {
        let next = advance(&mut rng, &base, 1);
        let events = random_events(&mut rng, base.tick, next.tick);
        let reader = link.reader.clone();
        let delta = link.send(&next, &events);
        let keyframe = keyframe(&next);
        for _ in 0..250 {
            let mut bytes = if rng.below(4) == 0 { keyframe.clone() } else { delta.clone() };
            break_bytes(&mut rng, &mut bytes);
            let mut reader = reader.clone();
            if let Ok(Decoded { events, .. }) = reader.decode(&bytes) {
                accepted += 1;
                assert_sound(reader.newest().unwrap(), &events, &base, &bytes);
            }
        }
        base = next;
    }
    assert!(accepted > 1_000, "only {accepted} broken messages reached the end of the decoder");
}

fn break_bytes(rng: &mut Rng, bytes: &mut Vec<u8>) {
    let place = rng.below(bytes.len() as u32) as usize;
    match rng.below(8) {
        0 => bytes.truncate(place),
        1 => bytes.insert(place, rng.next_u32() as u8),
        2 => drop(bytes.remove(place)),
        3 => bytes[place..].iter_mut().for_each(|byte| *byte = rng.next_u32() as u8),
        4 => bytes[place] = 0xff,
        _ => bytes[place] ^= 1 << rng.below(8),
    }
}
