use super::*;
use crate::net::clock::TICK_MS;
use jostle_sim::Vec2;

fn sent(sender: &mut InputSender, now_ms: f64) -> Vec<(u32, Input)> {
    std::iter::from_fn(|| sender.due(now_ms, now_ms / TICK_MS)).collect()
}

fn pressed(buttons: Buttons) -> Input {
    Input::new(buttons, None)
}

#[test]
fn a_change_is_sent_at_once_and_only_once() {
    let mut sender = InputSender::default();
    sender.note(pressed(Buttons::UP));
    assert_eq!(sent(&mut sender, 1000.0), [(1, pressed(Buttons::UP))]);
    sender.note(pressed(Buttons::UP));
    assert!(sent(&mut sender, 1010.0).is_empty());
}

#[test]
fn a_tap_within_a_tick_is_not_lost() {
    let mut sender = InputSender::default();
    sender.note(pressed(Buttons::FIRE));
    sender.note(pressed(Buttons::default()));
    let buttons: Vec<_> = sent(&mut sender, 5.0).iter().map(|(_, i)| i.buttons()).collect();
    assert_eq!(buttons, [Buttons::FIRE, Buttons::default()]);
}

#[test]
fn a_press_that_waits_keeps_its_place_when_the_pointer_moves_on() {
    let mut sender = InputSender::default();
    let moved = |x: f32, buttons| Input::new(buttons, Some(Vec2::new(x, 0.0)));
    for buttons in [Buttons::PICK_HERO, Buttons::default(), Buttons::PICK_HERO] {
        sender.note(moved(0.0, buttons));
    }
    assert_eq!(sent(&mut sender, 1000.0).len(), BURST as usize, "no more may leave at once");
    let press = moved(1.0, Buttons::FIRE);
    sender.note(press);
    let moves = [moved(50.0, Buttons::FIRE), moved(80.0, Buttons::FIRE)];
    for later in moves {
        sender.note(later);
        assert!(sent(&mut sender, 1000.0).is_empty());
    }
    assert_eq!(sent(&mut sender, 1020.0), [(4, press)]);
    assert_eq!(sent(&mut sender, 1060.0), [(5, moves[1])], "only moves are merged");
}

#[test]
fn the_last_move_of_a_drag_is_played_before_the_button_goes_up() {
    let mut sender = InputSender::default();
    let moved = |x: f32, buttons| Input::new(buttons, Some(Vec2::new(x, 0.0)));
    let none = Buttons::default();
    sender.note(moved(0.0, Buttons::FIRE));
    assert_eq!(sender.due(1000.0, 60.0), Some((1, moved(0.0, Buttons::FIRE))));
    // The page draws so slowly that nothing is sent before the release.
    let drag = [moved(40.0, Buttons::FIRE), moved(80.0, Buttons::FIRE), moved(80.0, none)];
    drag.into_iter().for_each(|input| sender.note(input));
    let left = sent(&mut sender, 1100.0);
    assert_eq!(left, [(2, drag[1]), (3, drag[2])]);
    // Releasing a key does not require the preceding move to be sent.
    sender.note(moved(90.0, Buttons::RIGHT));
    assert_eq!(sent(&mut sender, 1200.0).len(), 1);
    sender.note(moved(95.0, Buttons::RIGHT));
    sender.note(moved(95.0, none));
    assert_eq!(sent(&mut sender, 1300.0), [(5, moved(95.0, none))]);
}

#[test]
fn moves_are_merged_and_the_rate_is_bounded() {
    let mut sender = InputSender::default();
    let mut count = 0;
    for ms in 0..1000 {
        let pointer = Some(Vec2::new(ms as f32, 0.0));
        sender.note(Input::new(Buttons::default(), pointer));
        count += sent(&mut sender, f64::from(ms)).len();
    }
    assert!((55..=64).contains(&count), "{count} inputs in a second");
}

#[test]
fn mouse_moves_are_sent_once_a_tick_and_keys_at_once() {
    let mut sender = InputSender::default();
    let moved = |x: f32, buttons| Input::new(buttons, Some(Vec2::new(x, 0.0)));
    let none = Buttons::default();
    let mut at = |input: Input, moment: f64| {
        sender.note(input);
        sender.due(moment * TICK_MS, moment).map(|(_, input)| input)
    };
    assert!(at(moved(0.0, none), 60.5).is_some());
    assert_eq!(at(moved(1.0, none), 60.9), None, "something is played in that tick already");
    assert_eq!(at(moved(2.0, none), 61.1), None, "it might still meet the tick before");
    assert_eq!(at(moved(3.0, none), 61.3), Some(moved(3.0, none)));
    assert_eq!(at(moved(4.0, none), 61.4), None);
    let key = moved(5.0, Buttons::RIGHT);
    assert_eq!(at(key, 61.5), Some(key), "the move before it is out of date");
    assert_eq!(at(moved(6.0, Buttons::RIGHT), 62.5), None, "the key is played in that tick");
    assert!(at(moved(7.0, Buttons::RIGHT), 63.5).is_some());
}

/// The frames in which an input was sent, during one second at 60 Hz and a constant phase.
fn frames_that_sent(phase: f64, mut intent: impl FnMut(u32) -> Input) -> Vec<u32> {
    let mut sender = InputSender::default();
    let frames = (0..60).filter(|&frame| {
        sender.note(intent(frame));
        let moment = 600.0 + f64::from(frame) + phase;
        sender.due(moment * TICK_MS, moment).is_some()
    });
    frames.collect()
}

#[test]
fn mouse_moves_are_sent_soon_at_any_phase_of_the_frames() {
    for (phase, every_max) in [(0.1, 2), (0.6, 1)] {
        let moves = frames_that_sent(phase, |frame| {
            let pointer = Some(Vec2::new(frame as f32, 0.0));
            Input::new(Buttons::default(), pointer)
        });
        let repeats = frames_that_sent(phase, |_| pressed(Buttons::LEFT));
        let longest = |sent: &[u32]| sent.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert_eq!(longest(&moves), Some(every_max), "moves at phase {phase}");
        assert_eq!(longest(&repeats), Some(5), "repeats at phase {phase}");
    }
}

#[test]
fn a_held_key_is_repeated_though_the_server_is_booked() {
    let mut sender = InputSender::default();
    sender.note(pressed(Buttons::LEFT));
    let mut count = 0;
    for ms in 0..1000 {
        // The server never confirms that it played anything.
        sender.book_until(50);
        count += sent(&mut sender, f64::from(ms) / 2.0).len();
    }
    assert!((3..=5).contains(&count), "{count} inputs in half a second");
}

#[test]
fn a_held_key_is_repeated() {
    let mut sender = InputSender::default();
    sender.note(pressed(Buttons::LEFT));
    let count: usize = (0..1000).map(|ms| sent(&mut sender, f64::from(ms)).len()).sum();
    assert!((11..=14).contains(&count), "{count} inputs in a second");
}

#[test]
fn an_idle_player_repeats_less_often_but_a_held_key_does_not() {
    let count = |input: Input| {
        let mut sender = InputSender::default();
        sender.note(input);
        let mut sent_in = |from_ms: u32| {
            let frames = (from_ms..from_ms + 2000).step_by(10);
            frames.map(|now_ms| sent(&mut sender, now_ms.into()).len()).sum::<usize>()
        };
        [sent_in(1000), sent_in(5000)]
    };
    let [first, later] = count(pressed(Buttons::default()));
    assert!((23..=26).contains(&first) && later == 8, "{first} and {later}");
    let [first, later] = count(pressed(Buttons::LEFT));
    assert!((23..=26).contains(&first) && (23..=26).contains(&later), "{first} and {later}");
}
