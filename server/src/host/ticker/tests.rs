use super::*;
use crate::fleet::lease::Lease;
use crate::host::admission::KickScope;
use crate::host::delivery::{Delivery, ParticlePermits};
use crate::host::inbox::{Inbox, InboxSender, inbox};
use crate::host::outbox::{NextToSend, Outbox};
use crate::host::peer_nodes::PeerNodes;
use crate::host::room_handle::RoomHandle;
use crate::host::rooms::Rooms;
use crate::host::seat_rates::{EMOTE_TICKS, LOOK_TICKS};
use crate::host::sessions::ConnectedMember;
use crate::host::successors::Successors;
use crate::host::token_signer::TokenSigner;
use crate::limits::uplink::Uplink;
use crate::limits::{self, Timeouts};
use crate::log::{Logs, Seal};
use bytes::Bytes;
use ipnet::IpNet;
use jostle_game::{Scene, Seat};
use jostle_protocol::limits::ROOM_CODE_BYTES_MAX;
use jostle_protocol::{Appearance, ClientMessage, Role, ServerMessage};
use services::JOINS_PER_WAKEUP;
use std::cell::Cell;
use std::net::IpAddr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::task::{Wake, Waker};
use std::time::Instant;
use tokio::sync::watch;

mod given_up;
mod requests;
mod spectators;
mod uplink;

/// Incarnation of the node that holds rooms in the fleet.
const INCARNATION: u64 = 7;
const HOUR: Duration = Duration::from_secs(3600);

/// The parts of a room that surround its thread.
struct Outside {
    rooms: Rooms,
    phase: watch::Sender<Phase>,
    joins: SyncSender<Join>,
}

fn room(code: &str, empty_grace: Duration) -> (Ends, Outside) {
    let (phase, followed) = watch::channel(Phase::Running);
    let host = || {
        Arc::new(Host {
            waits: Timeouts { room_empty: empty_grace, ..Timeouts::default() },
            phase: followed.clone(),
            logs: Logs::default(),
            neighbours: PeerNodes::default(),
            send_queues: vec![Arc::default()],
            address_spectators_max: limits::SPECTATORS_MAX / 2,
            uplink: Uplink::new(limits::UPLINK_MEGABITS, Instant::now()),
            metrics: Arc::default(),
            successors: Successors::default(),
            signer: TokenSigner::new(&[7; 32]),
            open: Mutex::default(),
        })
    };
    let rooms = Rooms::new(&Scene::built_in(), host(), false, 64);
    let (joins, receiver) = sync_channel(4);
    let (_commands, commands) = sync_channel(1);
    let info = RoomInfo::new(code, 1, false, None, &Arc::new(Scene::built_in().swap_remove(0)));
    let info = Arc::new(info);
    let ends = Ends { host: host(), info, joins: receiver, commands, lease: None, shared: None };
    (ends, Outside { rooms, phase, joins })
}

fn open(ends: &Ends) -> Ticker<'_> {
    Ticker::open(ends, RoomOrigin::New(1), &TestClock::new()).expect("it opens")
}

fn join() -> (Join, InboxSender<Option<ClientMessage>>, Arc<Outbox>) {
    let (sender, inbox) = inbox(limits::INBOX_MAX);
    let outbox = Arc::new(Outbox::default());
    let join = Join {
        role: Role::Player,
        appearance: Appearance { name: "Ann".into(), color: 0 },
        claim: None,
        hosted: None,
        address: IpAddr::from([127, 0, 0, 1]),
        inbox,
        outbox: Arc::clone(&outbox),
    };
    (join, sender, outbox)
}

fn member(seat: Seat, inbox: Inbox<Option<ClientMessage>>, outbox: Arc<Outbox>) -> ConnectedMember {
    let uplink = Uplink::new(limits::UPLINK_MEGABITS, Instant::now());
    let allowance = uplink.open(IpAddr::from([127, 0, 0, 1]), false, false, Instant::now());
    let feed = Delivery::new(Some(seat), outbox, allowance, ParticlePermits::default(), 0);
    ConnectedMember { seat, host: false, inbox, feed }
}

fn end_of(outbox: &Outbox) -> Refusal {
    outbox.end_reason().expect("the session ended")
}

/// Runs a room on a clock that sleeps instantly. Returns its log's seal.
fn seal_of(mut ends: Ends) -> Option<Seal> {
    let shared = Arc::new(SharedLog::default());
    ends.shared = Some(Arc::clone(&shared));
    run(&ends, RoomOrigin::New(1), &mut TestClock::new());
    shared.lock().seal.clone()
}

#[test]
fn a_room_seals_its_log_at_its_end_and_gives_a_state_up_that_makes_it_fail() {
    let (ends, _outside) = room("over", Duration::from_secs(1));
    assert_eq!(seal_of(ends), Some(Seal::Remove));
    // This code makes the room panic before it has played, as faulty records would.
    let (fails, _outside) = room(&"x".repeat(ROOM_CODE_BYTES_MAX + 1), Duration::MAX);
    assert_eq!(seal_of(fails), Some(Seal::Leave));
}

/// A clock that sleeps instantly.
struct TestClock {
    now: Instant,
    sleeps: u32,
    /// Processor time of the whole process between sleeps.
    cost: Duration,
    /// Processor time between readings, and the number of readings so far.
    tick_cost: Duration,
    looks: Cell<u32>,
    /// Lengthens the sleep with this number.
    stall: Option<(u32, Duration)>,
    /// Closes the server during the sleep with this number.
    closes: Option<(u32, watch::Sender<Phase>)>,
    /// Lets a session join during the sleep with this number.
    comes: Option<(u32, SyncSender<Join>, Join)>,
    /// Panics during the sleep with this number, as a bug in a game would.
    fails: Option<u32>,
    /// Renews a lease for an hour during the sleep with this number.
    renews: Option<(u32, Arc<Lease>)>,
    /// Gives up the room during the sleep with this number.
    gives_up: Option<(u32, Arc<RoomInfo>)>,
}

impl TestClock {
    fn new() -> TestClock {
        TestClock {
            now: Instant::now(),
            sleeps: 0,
            cost: Duration::ZERO,
            tick_cost: Duration::ZERO,
            looks: Cell::new(0),
            stall: None,
            comes: None,
            fails: None,
            closes: None,
            renews: None,
            gives_up: None,
        }
    }
}

impl TickClock for TestClock {
    fn now(&self) -> Instant {
        self.now
    }

    fn sleep_until(&mut self, at: Instant) -> Option<Duration> {
        self.sleeps += 1;
        self.now = self.now.max(at);
        if let Some((_, stall)) = self.stall.take_if(|(sleep, _)| *sleep == self.sleeps) {
            self.now += stall;
        }
        if let Some((_, phase)) = self.closes.take_if(|(sleep, _)| *sleep == self.sleeps) {
            phase.send_replace(Phase::Closing);
        }
        if let Some((_, joins, join)) = self.comes.take_if(|(sleep, ..)| *sleep == self.sleeps) {
            joins.send(join).expect("a place");
        }
        assert_ne!(self.fails, Some(self.sleeps), "as it was told");
        if let Some((_, lease)) = self.renews.take_if(|(sleep, _)| *sleep == self.sleeps) {
            lease.set(INCARNATION, HOUR);
        }
        if let Some((_, info)) = self.gives_up.take_if(|(sleep, _)| *sleep == self.sleeps) {
            info.given_up.cancel();
        }
        Some(Duration::ZERO)
    }

    fn worked(&self) -> Duration {
        self.looks.set(self.looks.get() + 1);
        self.cost * self.sleeps + self.tick_cost * self.looks.get()
    }
}

/// Plays a room to its end. Returns the number of ticks played, and the reason for the end.
fn play(ends: &Ends, clock: &mut TestClock) -> (u32, RoomEnd) {
    let mut ticker = Ticker::open(ends, RoomOrigin::New(1), clock).expect("it opens");
    let Err(end) = ticker.play(clock);
    (ticker.open.room.game().tick_count(), end)
}

#[test]
fn an_empty_room_stands_still_and_ends_after_its_time() {
    let (ends, _outside) = room("empty", Duration::from_secs(45));
    let mut clock = TestClock::new();
    let began = clock.now;
    assert_eq!(play(&ends, &mut clock), (60, RoomEnd::Empty), "it plays for a second");
    let late = clock.now - began - Duration::from_secs(45);
    assert!(late < RESTING_LOOK, "late by {late:?}");
    assert!(clock.sleeps < 1000, "{} sleeps", clock.sleeps);
    assert_eq!(ends.host.metrics.ticks.missed.get(), 0);
}

#[test]
fn a_room_that_stands_still_goes_on_when_somebody_comes() {
    let (ends, outside) = room("rests", Duration::MAX);
    let (join, _inbox, outbox) = join();
    let comes = Some((200, outside.joins, join));
    let mut clock = TestClock { comes, closes: Some((300, outside.phase)), ..TestClock::new() };
    let (ticks, end) = play(&ends, &mut clock);
    // At the last wakeup, the server is closing.
    assert_eq!((ticks, end), (60 + 99, RoomEnd::Closing));
    assert_eq!(ends.host.metrics.ticks.missed.get(), 0);
    assert_eq!(outbox.end_reason(), None);
}

#[test]
fn a_guests_room_without_a_seat_ends_after_seconds_and_keeps_the_seats_of_lost_players() {
    let lasts = |comes: bool| {
        let (mut ends, outside) = room("guests", Duration::from_secs(120));
        Arc::get_mut(&mut ends.info).expect("not shared yet").guest = true;
        let (join, inbox, _outbox) = join();
        if comes {
            outside.joins.send(join).expect("a place");
        }
        // The socket is lost after one input.
        let input = jostle_game::Input::default();
        inbox.try_send(Some(ClientMessage::Input { seq: 1, ack_tick: 0, input })).expect("a place");
        drop(inbox);
        let mut clock = TestClock::new();
        let began = clock.now;
        assert_eq!(play(&ends, &mut clock).1, RoomEnd::Empty);
        clock.now - began
    };
    assert!(lasts(false) - Timeouts::USUAL.guest_room_empty < RESTING_LOOK);
    assert!(lasts(true) > Duration::from_secs(44), "as long as a seat is held");
}

#[test]
fn a_room_that_stood_still_waits_for_its_players_as_long_as_any_other() {
    let (mut ends, outside) = room("still", Duration::from_secs(45));
    let (join, _inbox, outbox) = join();
    outside.joins.send(join).expect("a place");
    let began = Instant::now();
    let lease = Arc::new(Lease::new(began));
    lease.set(INCARNATION, Duration::from_secs(15));
    ends.lease = Some(RoomLease::new(Arc::clone(&lease), INCARNATION));
    // The room is paused from the 15th second until the 300th.
    let renews = Some((300 * 60, lease));
    let mut clock = TestClock { now: began, renews, ..TestClock::new() };
    let (_, end) = play(&ends, &mut clock);
    assert_eq!((end_of(&outbox), end), (Refusal::Moving, RoomEnd::Empty));
    let late = (clock.now - began).abs_diff(Duration::from_secs(300 + 45));
    assert!(late < RESTING_LOOK, "off by {late:?}");
}

#[test]
fn a_guests_room_that_takes_more_than_its_share_for_long_is_closed_and_says_so() {
    let play_guest = |guest: bool, cost_us: u64| {
        let (mut ends, outside) = room("dear", Duration::from_secs(60));
        Arc::get_mut(&mut ends.info).expect("not shared yet").guest = guest;
        let (join, _inbox, outbox) = join();
        outside.joins.send(join).expect("a place");
        let closes = Some((3000, outside.phase));
        let cost = Duration::from_micros(cost_us);
        let mut clock = TestClock { cost, closes, ..TestClock::new() };
        let (_, end) = play(&ends, &mut clock);
        (end, clock.sleeps, outbox)
    };
    assert_eq!(play_guest(false, 16_000).0, RoomEnd::Closing, "a room of the server's own scenes");
    assert_eq!(play_guest(true, 2_000).0, RoomEnd::Closing, "within the share");
    let (end, ticks, _outbox) = play_guest(true, 16_000);
    assert_eq!(end, RoomEnd::TooCostly);
    assert!((300..420).contains(&ticks), "closed after {ticks} ticks");

    let (mut ends, outside) = room("dear", Duration::from_secs(60));
    Arc::get_mut(&mut ends.info).expect("not shared yet").guest = true;
    let (join, _inbox, outbox) = join();
    outside.joins.send(join).expect("a place");
    let mut clock = TestClock { cost: Duration::from_millis(100), ..TestClock::new() };
    run(&ends, RoomOrigin::New(1), &mut clock);
    assert_eq!(end_of(&outbox), Refusal::TooCostly);
}

#[test]
fn a_guests_room_is_closed_after_the_first_tick_that_takes_too_long() {
    let play_guest = |tick_cost_ms, stall_s| {
        let (mut ends, outside) = room("dear", Duration::from_secs(60));
        Arc::get_mut(&mut ends.info).expect("not shared yet").guest = true;
        let (join, _inbox, _outbox) = join();
        outside.joins.send(join).expect("a place");
        let tick_cost = Duration::from_millis(tick_cost_ms);
        let stall = Some((1, Duration::from_secs(stall_s)));
        play(&ends, &mut TestClock { tick_cost, stall, ..TestClock::new() })
    };
    // The stall makes five ticks due at the same time.
    assert_eq!(play_guest(101, 1), (1, RoomEnd::TooCostly));
    // The share is checked after each wakeup too: five seconds are enough for about 25 wakeups.
    let (ticks, end) = play_guest(99, 1);
    assert_eq!(end, RoomEnd::TooCostly);
    assert!((20..40).contains(&ticks), "{ticks} ticks");
}

#[test]
fn a_tick_over_the_budget_of_a_step_closes_a_room_before_it_is_sent() {
    let (mut ends, outside) = room("heap", Duration::from_secs(60));
    let text = "title = \"Heap\"\nsize = [100, 100]\ngroups = [\"block\"]\npairs = [[\"block\", \"block\"]]\n\
                [[layouts]]\nkind = \"block\"\ncount = 200\nradius = 10\narea = [[49, 49], [51, 51]]\n\
                exact = true\ngrid = [20, 10]\n";
    let mut scene = Scene::parse("guest.toml", text).expect("a scene");
    scene.world.budget = limits::GUEST_STEP;
    let info = Arc::get_mut(&mut ends.info).expect("not shared yet");
    (info.guest, info.scene) = (true, Arc::new(scene));
    let (join, _inbox, outbox) = join();
    outside.joins.send(join).expect("a place");
    assert_eq!(seal_of(ends), Some(Seal::Remove));
    assert_eq!(end_of(&outbox), Refusal::TooCostly);
}

#[test]
fn a_room_ends_when_its_host_leaves_it_empty() {
    let cases = [(true, false, 1, RoomEnd::Empty), (false, false, 60, RoomEnd::Empty)];
    for (is_host, with_another, ticks, expected) in
        cases.into_iter().chain([(true, true, 200, RoomEnd::Closing)])
    {
        let (ends, outside) = room("left", Duration::from_secs(1));
        let (mut host, inbox, _outbox) = join();
        host.hosted = is_host.then_some(1);
        outside.joins.send(host).expect("a place");
        inbox.try_send(None).expect("a place");
        let (other, _other_inbox, _other_outbox) = join();
        if with_another {
            outside.joins.send(other).expect("a place");
        }
        let mut clock = TestClock { closes: Some((200, outside.phase)), ..TestClock::new() };
        let (played, end) = play(&ends, &mut clock);
        assert_eq!(end, expected, "host {is_host}, another {with_another}");
        assert!(played.abs_diff(ticks) <= 1, "{played} ticks instead of {ticks}");
    }
}

#[test]
fn a_closing_server_ends_a_room_with_players() {
    let (ends, outside) = room("closing", Duration::ZERO);
    let (join, _inbox, _outbox) = join();
    outside.joins.send(join).expect("a place");
    let mut clock = TestClock { closes: Some((100, outside.phase)), ..TestClock::new() };
    assert_eq!(play(&ends, &mut clock), (99, RoomEnd::Closing));
}

#[test]
fn a_dropped_server_ends_a_room_with_players() {
    let (ends, outside) = room("dropped", Duration::MAX);
    let (join, _inbox, _outbox) = join();
    outside.joins.send(join).expect("a place");
    drop(outside.phase);
    assert_eq!(play(&ends, &mut TestClock::new()), (0, RoomEnd::Closing));
}

#[test]
fn ticks_of_a_long_stall_are_missed_and_the_next_ones_are_on_time() {
    let (ends, outside) = room("stalled", Duration::MAX);
    let metrics = Arc::clone(&ends.host.metrics);
    let (join, _inbox, _outbox) = join();
    outside.joins.send(join).expect("a place");
    let stall = Some((61, Duration::from_secs(2)));
    let mut clock = TestClock { stall, closes: Some((200, outside.phase)), ..TestClock::new() };
    let began = clock.now;
    let (ticks, end) = play(&ends, &mut clock);
    // At the last wakeup the server is closing, so nothing is played.
    let due = (clock.now - began).as_secs_f64() * 60.0 - 1.0;
    assert_eq!((end, metrics.ticks.played.get()), (RoomEnd::Closing, u64::from(ticks)));
    assert_eq!(metrics.ticks.missed.get(), 120 + 1 - u64::from(limits::CATCH_UP_TICKS_MAX));
    assert_eq!(u64::from(ticks) + metrics.ticks.missed.get(), due.round() as u64);
    assert_eq!(ticks, 60 + limits::CATCH_UP_TICKS_MAX + (199 - 61));
}

#[tokio::test(start_paused = true)]
async fn a_command_that_is_insisted_on_waits_for_a_place_in_the_queue() {
    let (ends, outside) = room("full", Duration::MAX);
    let mut open = open(&ends).open;
    let (commands, receiver) = sync_channel(1);
    let (now, clock) = (Instant::now(), TestClock::new());
    let mut obey = || Commands::new(&receiver).before(&Wakeup { now, clock: &clock }, &mut open);
    let network = IpNet::from(IpAddr::from([127, 0, 0, 1]));
    commands.send(AdminCommand::Evict(network)).expect("a place");
    let (info, joins) = (Arc::clone(&ends.info), outside.joins.clone());
    let thread = std::thread::spawn(|| {});
    let handle = RoomHandle { info, joins, commands, lease: None, shared: None, thread };
    ends.host.lock().insert("full".into(), handle);

    let rooms = Rooms::new(&[], Arc::clone(&ends.host), true, 64);
    let insists = tokio::spawn(async move {
        rooms.insist("full", AdminCommand::Leave(None)).await;
        rooms.insist("another", AdminCommand::Leave(None)).await;
    });
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert!(!insists.is_finished(), "a full queue");
    assert_eq!(obey(), Ok(true));
    insists.await.expect("no panic");
    assert_eq!(obey(), Err(RoomEnd::Elsewhere));
}

#[test]
fn a_failed_room_ends_its_sessions_and_no_other_room_notices() {
    let (ends, outside) = room("fails", Duration::MAX);
    let (seated, _inbox, seated_outbox) = join();
    outside.joins.send(seated).expect("a place");
    let (waiting, _other_inbox, waiting_outbox) = join();
    let comes = Some((2, outside.joins, waiting));
    let (other, other_inbox, other_outbox) = join();
    outside.rooms.join("arena", other).expect("another room");

    let metrics = Arc::clone(&ends.host.metrics);
    let mut clock = TestClock { comes, fails: Some(2), ..TestClock::new() };
    run(&ends, RoomOrigin::New(1), &mut clock);
    assert_eq!(metrics.rooms_failed.get(), 1);
    assert_eq!(end_of(&seated_outbox), Refusal::RoomFailed);
    assert_eq!(end_of(&waiting_outbox), Refusal::RoomFailed);

    let [welcome, keyframe, delta] = [(); 3].map(|()| message(&other_outbox));
    assert!([welcome, keyframe, delta].iter().all(|message| !message.is_empty()));
    drop(other_inbox);
    outside.phase.send_replace(Phase::Closing);
    outside.rooms.wait();
}

/// Waits for the next message from a room that plays on another thread.
fn message(outbox: &Outbox) -> Bytes {
    loop {
        match outbox.take() {
            NextToSend::Message(bytes) => return bytes,
            NextToSend::Nothing => std::thread::sleep(Duration::from_millis(1)),
            NextToSend::End(refusal) => panic!("{refusal:?}"),
        }
    }
}

/// An outbox's control messages.
fn control_messages(outbox: &Outbox) -> Vec<ServerMessage> {
    outbox.keyframe(Bytes::new(), None);
    let all = std::iter::repeat_with(|| message(outbox));
    let before = all.take_while(|bytes| !bytes.is_empty());
    before.map(|bytes| ServerMessage::decode(&bytes).expect("a message")).collect()
}

#[test]
fn a_room_that_fails_while_it_feeds_wakes_those_fed_before() {
    struct Woken(AtomicBool);
    impl Wake for Woken {
        fn wake(self: Arc<Self>) {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    let (ends, _outside) = room("fed", Duration::MAX);
    let (join, _inbox, outbox) = join();
    let woken = Arc::new(Woken(AtomicBool::new(false)));
    outbox.register(&Waker::from(Arc::clone(&woken)));
    let mut ticker = open(&ends);
    ticker.open.sessions.members.push(member(Seat(0), join.inbox, Arc::clone(&outbox)));
    outbox.send_soon();
    end_all_sessions(&ends, Some(&mut ticker), Refusal::RoomFailed);
    assert!(woken.0.load(Ordering::Relaxed));
}
