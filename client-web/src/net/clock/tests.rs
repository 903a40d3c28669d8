use super::*;
use crate::net::simulated_link::{NetworkConditions, SimulatedLink};

/// A message from a room in which something moves.
fn busy(first: u32, tick: u32) -> Arrival {
    Arrival { tick, first, ticks_until_next: 1 }
}

/// Plays `ticks` ticks whose snapshots are late by `late_ms(tick)`, with one frame per tick. Returns the displayed
/// ticks.
fn play(clock: &mut Clock, ticks: std::ops::Range<u32>, late_ms: impl Fn(u32) -> f64) -> Vec<f64> {
    let mut arrivals: Vec<(f64, u32)> =
        ticks.clone().map(|t| (f64::from(t) * TICK_MS + late_ms(t), t)).collect();
    // Sockets preserve order, so no message overtakes another.
    for i in 1..arrivals.len() {
        arrivals[i].0 = arrivals[i].0.max(arrivals[i - 1].0);
    }
    let mut next = 0;
    let mut shown = Vec::new();
    for frame in ticks {
        let now = f64::from(frame) * TICK_MS + 3.0;
        while next < arrivals.len() && arrivals[next].0 <= now {
            let tick = arrivals[next].1;
            clock.arrived(busy(tick, tick), arrivals[next].0);
            next += 1;
        }
        shown.extend(clock.display(now));
    }
    shown
}

#[test]
fn smooth_arrivals_are_shown_one_tick_late() {
    let mut clock = Clock::default();
    let shown = play(&mut clock, 0..600, |_| 0.0);
    let server = 599.0 + 3.0 / TICK_MS;
    assert!((server - shown[599] - DELAY_TICKS_MIN).abs() < 0.01, "shown {}", shown[599]);
    assert!((clock.delay_ticks() - DELAY_TICKS_MIN).abs() < 1e-9);
}

#[test]
fn another_way_of_the_snapshots_neither_stops_nor_hurries_the_display() {
    let mut clock = Clock::default();
    let shown = play(&mut clock, 0..600, |t| f64::from(t % 7) * 4.0);
    let delay = clock.delay_ticks();
    // The room paused for 300 ms, and everything takes 80 ms longer from here on.
    let away_ms = 599.0 * TICK_MS + 300.0;
    clock.restart(away_ms);
    assert_eq!(clock.display(away_ms), None, "it waits");
    let first_ms = away_ms + 80.0;
    let mut before = shown[599];
    for tick in 600..900 {
        let now_ms = first_ms + f64::from(tick - 600) * TICK_MS;
        clock.arrived(busy(tick, tick), now_ms);
        let next = clock.display(now_ms).expect("snapshots came");
        // The first frame also covers the 80 ms of waiting.
        let most = if tick == 600 { 5.6 } else { 1.16 };
        assert!((0.84..most).contains(&(next - before)), "{} ticks at {tick}", next - before);
        before = next;
    }
    assert!(clock.delay_ticks() <= delay, "the move is no jitter: {}", clock.delay_ticks());
    assert!((899.0 - before - clock.delay_ticks()).abs() < 0.5, "{before}");
}

#[test]
fn the_display_advances_at_the_rate_of_time() {
    let mut clock = Clock::default();
    let shown = play(&mut clock, 0..600, |t| f64::from(t % 7));
    for pair in shown[60..].windows(2) {
        let step = pair[1] - pair[0];
        assert!((0.84..1.16).contains(&step), "step of {step} ticks");
    }
}

#[test]
fn delay_grows_until_late_snapshots_are_in_time_and_then_shrinks() {
    let mut clock = Clock::default();
    let late = |t: u32| if t % 10 == 9 { 100.0 } else { 0.0 };
    play(&mut clock, 0..600, late);
    assert!(clock.delay_ticks() > 6.0, "delay {}", clock.delay_ticks());
    play(&mut clock, 600..720, |_| 0.0);
    assert!(clock.delay_ticks() > 3.0, "forgotten too soon: {}", clock.delay_ticks());
    play(&mut clock, 720..2400, |_| 0.0);
    assert!(clock.delay_ticks() < 1.1, "delay {}", clock.delay_ticks());
}

#[test]
fn skipped_ticks_count_as_late() {
    let mut clock = Clock::default();
    for tick in (6..600).step_by(6) {
        clock.arrived(busy(tick - 5, tick), f64::from(tick) * TICK_MS);
    }
    assert!(clock.delay_ticks() > 5.0, "delay {}", clock.delay_ticks());
}

#[test]
fn time_goes_on_while_nothing_moves() {
    let mut clock = Clock::default();
    let mut shown = 0.0;
    for tick in 0..1300 {
        let now = f64::from(tick) * TICK_MS;
        if tick % 13 == 0 {
            clock.arrived(Arrival { tick, first: tick, ticks_until_next: 13 }, now);
        }
        let display = clock.display(now).expect("there were snapshots");
        assert!(tick < 60 || (display - shown - 1.0).abs() < 0.2, "from {shown} to {display}");
        shown = display;
    }
    assert!((clock.delay_ticks() - DELAY_TICKS_MIN).abs() < 1e-9);
}

#[test]
fn display_stops_soon_after_snapshots_stop() {
    let mut clock = Clock::default();
    play(&mut clock, 0..120, |_| 0.0);
    for frame in 0..300 {
        let now = f64::from(120 + frame) * TICK_MS;
        let shown = clock.display(now).expect("there were snapshots");
        assert!(shown <= 119.0 + AHEAD_TICKS_MAX);
    }
}

#[test]
fn display_jumps_after_a_long_absence() {
    let mut clock = Clock::default();
    play(&mut clock, 0..120, |_| 0.0);
    for tick in 120..2000 {
        clock.arrived(busy(tick, tick), f64::from(tick) * TICK_MS);
    }
    let shown = clock.display(2000.0 * TICK_MS).expect("there were snapshots");
    assert!(shown > 1990.0, "shown {shown}");
}

#[test]
fn nothing_is_shown_before_the_first_snapshot() {
    assert_eq!(Clock::default().display(100.0), None);
}

/// Plays every `every`th snapshot over a simulated network with one frame per tick. Returns how many frames of the
/// second half ran past the newest known tick, and the mean delay.
fn play_over(lag: NetworkConditions, every: u32, seed: u64) -> (usize, f64) {
    let mut clock = Clock::default();
    let mut lane = SimulatedLink::new(seed);
    let mut waiting = VecDeque::new();
    let (mut unknown, mut delays, mut known) = (0, 0.0, 0);
    for tick in 1..=3600 {
        let now = f64::from(tick) * TICK_MS;
        if tick % every == 0 {
            waiting.push_back((lane.arrival_ms(&lag, now), tick));
        }
        // Frames come at a different phase of the tick from snapshots.
        let frame_ms = now + 7.0;
        while let Some((at, tick)) = waiting.pop_front_if(|(at, _)| *at <= frame_ms) {
            clock.arrived(Arrival { tick, first: tick - every + 1, ticks_until_next: every }, at);
            known = tick;
        }
        let Some(shown) = clock.display(frame_ms) else { continue };
        if tick > 1800 {
            unknown += usize::from(shown > f64::from(known));
            delays += clock.delay_ticks() / 1800.0;
        }
    }
    (unknown, delays)
}

#[test]
fn the_delay_is_as_long_as_the_network_needs() {
    let jitter = NetworkConditions { trip_ms: 150.0, jitter_ms: 60.0, stalls: false };
    for seed in 1..=8 {
        for every in [1, 3, 12] {
            // One tick, plus the ticks that each message skips.
            let least = f64::from(every);
            let (unknown, delay) = play_over(NetworkConditions::OFF, every, seed);
            assert_eq!(unknown, 0, "quiet, {every}");
            assert!((delay - least).abs() < 0.05, "quiet, {every}: {delay} ticks");
            // Transit times vary by 60 ms, or 3.6 ticks.
            let (unknown, delay) = play_over(jitter, every, seed);
            assert!(unknown < 40, "jitter, {every}: {unknown} of 1800 frames");
            assert!((least + 1.5..least + 3.8).contains(&delay), "jitter, {every}: {delay} ticks");
        }
    }
}

#[test]
fn after_a_stall_the_delay_is_long_and_falls() {
    for seed in 1..=8 {
        let stalls = NetworkConditions { trip_ms: 20.0, jitter_ms: 0.0, stalls: true };
        let (unknown, delay) = play_over(stalls, 1, seed);
        let (_, quiet) = play_over(NetworkConditions { stalls: false, ..stalls }, 1, seed);
        assert!((quiet - 1.0).abs() < 0.05, "quiet: {quiet} ticks");
        assert!((4.0..DELAY_TICKS_MAX).contains(&delay), "{delay} ticks");
        // Stalls of 200 to 600 ms take up a tenth of the time; fewer frames than that may be affected.
        assert!(unknown < 300, "{unknown} of 1800 frames");
    }
}

#[test]
fn a_clock_that_is_set_back_or_ahead_is_followed() {
    for jump_ms in [-3_600_000.0, -500.0, 700.0, 3_600_000.0] {
        let mut clock = Clock::default();
        play(&mut clock, 0..600, |_| 0.0);
        for tick in 600..1200 {
            let now = f64::from(tick) * TICK_MS + jump_ms;
            clock.arrived(busy(tick, tick), now);
            let shown = clock.display(now).expect("there were snapshots");
            assert!(shown <= f64::from(tick) + AHEAD_TICKS_MAX, "{jump_ms}: {shown} at {tick}");
        }
        let shown = clock.display(1199.0 * TICK_MS + jump_ms).expect("there were snapshots");
        let late = 1199.0 - shown;
        assert!((0.5..6.0).contains(&late), "{jump_ms}: {late} ticks late");
    }
}
