use super::*;
use crate::host::outbox::NextToSend;
use crate::limits::uplink::Uplink;
use jostle_game::{Event, Scene};
use jostle_protocol::{Appearance, ServerMessage, SnapshotStream};

/// Takes the waiting snapshots, and records the ticks in which a player joined or left.
fn listen(outbox: &Outbox, stream: &mut SnapshotStream, events: &mut Vec<u32>) {
    while let NextToSend::Message(bytes) = outbox.take() {
        let message = ServerMessage::decode(&bytes).expect("a message");
        let ServerMessage::Snapshot(coded) = message else { panic!("{message:?}") };
        let heard = stream.decode(&coded).expect("a snapshot");
        let who = |event| matches!(event, Event::Joined(_) | Event::Left(_));
        events.extend(heard.events.iter().filter(|timed| who(timed.event)).map(|timed| timed.tick));
    }
}

#[test]
fn a_keyframe_for_late_acknowledgements_waits_for_the_budget() {
    // Plays until the rate falls. The budget is used up just before tick `used_up_at`.
    let falls = |used_up_at: u32| {
        let scene = Arc::new(Scene::built_in().swap_remove(0));
        let mut room = Room::new("late", scene, 1);
        let (outbox, now) = (Arc::new(Outbox::default()), Instant::now());
        let address = [10, 0, 0, 1].into();
        let uplink = Uplink::new(1000, now);
        let (other, allowance) =
            (uplink.open(address, false, false, now), uplink.open(address, false, false, now));
        let mut feed =
            Delivery::new(None, Arc::clone(&outbox), allowance, ParticlePermits::default(), 0);
        for tick in 1..=400 {
            room.tick();
            if tick == used_up_at {
                other.charge(usize::MAX / 2, now);
            }
            feed.lag.acked(tick.min(5) as u16, tick);
            let sent = feed.feed(&mut room, u32::MAX, now, &Metrics::default());
            if feed.rate != Rate::Full {
                return (tick, sent);
            }
            while let NextToSend::Message(_) = outbox.take() {}
        }
        panic!("it never falls");
    };
    let (tick, sent) = falls(u32::MAX);
    assert!(sent, "the budget is there");
    assert_eq!(falls(tick), (tick, false));
}

#[test]
fn a_lower_rate_repeats_no_event() {
    let whole = |scene: &Scene| scene.camera.sees_all();
    let scene = Scene::built_in().into_iter().find(|scene| whole(scene) && scene.players_max > 1);
    let scene = Arc::new(scene.expect("a shipped scene"));
    for stuck in 5..17 {
        let mut room = Room::new("slow", Arc::clone(&scene), 1);
        let look = || Appearance { name: "Ann".into(), color: 0 };
        let seat = room.join(look(), None).expect("a seat").claim.seat;
        // Subscribes to the lower rates in advance; otherwise their channels would begin with the newest tick.
        Rate::ALL.into_iter().for_each(|rate| drop(room.subscribe(rate)));
        let outbox = Arc::new(Outbox::default());
        let now = Instant::now();
        let allowance = Uplink::new(1, now).open([10, 0, 0, 1].into(), false, false, now);
        let mut feed = Delivery::new(
            Some(seat),
            Arc::clone(&outbox),
            allowance,
            ParticlePermits::default(),
            0,
        );
        let (mut stream, mut events) = (SnapshotStream::default(), Vec::new());
        let mut other = None;
        for tick in 1..=400 {
            // Ensures that something happens in every tick.
            match other.take() {
                Some(seat) => room.leave(seat),
                None => other = Some(room.join(look(), None).expect("a seat").claim.seat),
            }
            room.tick();
            feed.lag.acked(tick.min(stuck) as u16, tick);
            feed.feed(&mut room, u32::MAX, now, &Metrics::default());
            listen(&outbox, &mut stream, &mut events);
        }
        assert_eq!(feed.rate, Rate::Twelfth);
        assert!(events.is_sorted_by(|a, b| a < b), "stuck at {stuck}: {events:?}");
    }
}

#[test]
fn of_a_crowd_that_reads_nothing_few_are_sent_particles() {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
    let mut room = Room::new("crowd", Arc::new(scene.expect("a scene")), 1);
    let look = Appearance::new("Ann", 0).expect("a name");
    let seat = room.join(look, None).expect("a seat").claim.seat;
    let now = Instant::now();
    let uplink = Uplink::new(1000, now);
    (0..60).for_each(|_| room.tick());
    let permits = ParticlePermits::default();
    let newcomer = |room: &mut Room, seat: Option<Seat>| {
        let allowance = uplink.open([10, 0, 0, 1].into(), false, false, now);
        let outbox = Arc::new(Outbox::default());
        let mut feed = Delivery::new(seat, Arc::clone(&outbox), allowance, permits.clone(), 60);
        feed.feed(room, u32::MAX, now, &Metrics::default());
        outbox
    };
    let bytes = |outbox: &Outbox| match outbox.take() {
        NextToSend::Message(message) => message.len(),
        other => panic!("{other:?} instead of a keyframe"),
    };
    let alive = room.game().world().particles().len();
    let crowd: Vec<_> =
        (0..WAITING_PARTICLES_MAX / alive).map(|_| newcomer(&mut room, None)).collect();
    let late = [None, Some(seat)].map(|seat| bytes(&newcomer(&mut room, seat)));
    let first = bytes(&crowd[0]);
    assert!(late.iter().all(|&bytes| bytes < first / 2), "{late:?} beside {first}");
    // The keyframe was handed to a socket, which may have sent only part of it.
    assert!(bytes(&newcomer(&mut room, None)) < first / 2);
    // When the socket asks for more, it has sent the whole keyframe.
    assert_eq!(crowd[0].take(), NextToSend::Nothing);
    assert_eq!(bytes(&newcomer(&mut room, None)), first);
    assert!(crowd[1..].iter().all(|outbox| bytes(outbox) == first));
}

/// Simulates a client that is sent each of these ticks and acknowledges it `behind` ticks later.
fn plays(lag: &mut AckLag, ticks: std::ops::Range<u32>, behind: impl Fn(u32) -> u32) {
    for tick in ticks {
        lag.sent(tick);
        lag.acked(tick.saturating_sub(behind(tick)) as u16, tick);
    }
}

#[test]
fn a_long_round_trip_and_a_stall_are_no_lag_and_growth_is() {
    let mut lag = AckLag::new(0);
    plays(&mut lag, 1..600, |_| 24);
    // Every so often there is a stall of half a second.
    plays(&mut lag, 600..1200, |tick| 24 + (30 - tick as i32 % 150).max(0) as u32);
    assert!(!lag.lags(1200) && lag.ticks() == 24);
    plays(&mut lag, 1200..1200 + LAGGING_TICKS, |_| 25 + LAG_GROWTH_TICKS);
    assert!(!lag.lags(1199 + LAGGING_TICKS));
    plays(&mut lag, 1200 + LAGGING_TICKS..1300 + LAGGING_TICKS, |_| 25 + LAG_GROWTH_TICKS);
    assert!(lag.lags(1300 + LAGGING_TICKS));
    lag.restart(1300 + LAGGING_TICKS);
    assert!(!lag.lags(1301 + LAGGING_TICKS), "it has time to catch up");
    plays(&mut lag, 1400 + LAGGING_TICKS..1402 + LAGGING_TICKS, |_| 26);
    assert!(!lag.lags(u32::MAX));
}

#[test]
fn a_longer_round_trip_is_accepted_in_the_end_up_to_a_limit() {
    let mut lag = AckLag::new(0);
    plays(&mut lag, 1..100, |_| 5);
    plays(&mut lag, 100..100 + 2 * LAG_WINDOW_TICKS, |_| 6 + LAG_GROWTH_TICKS);
    assert!(!lag.lags(100 + 2 * LAG_WINDOW_TICKS));
    plays(&mut lag, 10_000..20_000, |_| LAG_TICKS_MAX + 1);
    assert!(lag.lags(20_000));
}

#[test]
fn a_client_is_silent_if_it_acknowledges_nothing_that_it_is_sent() {
    let mut lag = AckLag::new(70_000);
    assert!(!lag.is_silent(90_000, 1200), "nothing moved, nothing was sent");
    lag.sent(90_000);
    assert!(!lag.is_silent(91_199, 1200) && lag.is_silent(91_200, 1200));
    // An outdated acknowledgement does not count; these low bits belong to a tick from long ago.
    lag.acked(70_000u32 as u16, 91_200);
    assert!(lag.is_silent(91_200, 1200));
    lag.acked(90_000u32 as u16, 91_200);
    assert!(!lag.is_silent(95_000, 1200));
    lag.sent(95_000);
    lag.acked(96_000u32 as u16, 95_001);
    assert_eq!((lag.ticks(), lag.is_silent(99_999, 1200)), (0, false), "the future");
}

#[test]
fn a_restart_with_an_older_keyframe_is_no_lag() {
    let mut lag = AckLag::new(0);
    plays(&mut lag, 1..100, |_| 0);
    lag.sent(90);
    for low in [99, 90] {
        lag.acked(low, 120);
        assert_eq!((lag.ticks(), lag.is_silent(9000, 1200)), (0, false));
    }
    lag.sent(121);
    lag.acked(90, 125);
    assert_eq!(lag.ticks(), 31);
}
