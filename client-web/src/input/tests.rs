use super::*;
use crate::clock::TICK_MS;

const VIEW: View = View { center: Vec2::new(100.0, 50.0), height: 100.0, pixels: [2000, 1000] };

fn sent(outflow: &mut Outflow, now_ms: f64) -> Vec<(u32, Input)> {
    std::iter::from_fn(|| outflow.due(now_ms, now_ms / TICK_MS)).collect()
}

fn pressed(buttons: Buttons) -> Input {
    Input { buttons, pointer: None }
}

#[test]
fn keys_to_steer_are_found_by_place_and_released_one_by_one() {
    let mut controls = Controls::default();
    assert!(controls.key("KeyW", "w", true));
    assert!(controls.key("ArrowUp", "ArrowUp", true));
    assert!(!controls.key("KeyQ", "q", true));
    controls.key("KeyW", "w", false);
    assert_eq!(controls.buttons(), Buttons::UP, "the arrow still holds it");
    controls.key("ArrowUp", "ArrowUp", false);
    assert_eq!(controls.buttons(), Buttons::default());
}

#[test]
fn letters_on_the_caps_are_true_on_other_keyboards() {
    assert_eq!(meaning("KeyY", "z"), Some(Buttons::MAKE), "German Z");
    assert_eq!(meaning("Semicolon", "m"), Some(Buttons::PICK_MINION), "French M");
    assert_eq!(meaning("KeyW", "z"), Some(Buttons::UP), "French Z steers");
    assert_eq!(meaning("KeyZ", "w"), Some(Buttons::MAKE), "and its W makes");
    assert_eq!(meaning("KeyC", "\u{441}"), Some(Buttons::AGITATE), "Cyrillic has no C");
    assert_eq!(meaning("KeyV", "V"), Some(Buttons::CLEAR), "Caps Lock");
    assert_eq!(meaning("KeyQ", "a"), None, "French A is not where the hand steers");
}

#[test]
fn a_key_releases_what_it_pressed_though_its_letter_changed() {
    let mut controls = Controls::default();
    controls.key("KeyY", "z", true);
    controls.key("KeyY", "y", true);
    assert_eq!(controls.buttons(), Buttons::MAKE);
    assert!(controls.key("KeyY", "y", false));
    assert_eq!(controls.buttons(), Buttons::default());
    assert!(!controls.key("KeyY", "z", false), "it is up already");
}

#[test]
fn every_button_has_a_key_or_the_pointer() {
    let places = PLACES.iter().map(|(_, button)| button.0);
    let letters = LETTERS.iter().map(|(.., button)| button.0);
    let keys = places.chain(letters).fold(Buttons::FIRE.0, |all, button| all | button);
    assert_eq!(Buttons(keys), Buttons::ALL);
}

#[test]
fn release_lets_go_of_keys_pointer_buttons_and_stick() {
    let mut controls = Controls::default();
    controls.key("KeyD", "d", true);
    controls.press(Buttons::FIRE, true);
    controls.steer(Buttons::UP);
    controls.release();
    assert_eq!(controls.buttons(), Buttons::default());
}

#[test]
fn the_stick_replaces_its_directions_and_nothing_else() {
    let mut controls = Controls::default();
    controls.press(Buttons::FIRE, true);
    controls.steer(Buttons(Buttons::UP.0 | Buttons::LEFT.0));
    controls.steer(Buttons::RIGHT);
    assert_eq!(controls.buttons(), Buttons(Buttons::FIRE.0 | Buttons::RIGHT.0));
}

#[test]
fn the_pointer_is_in_world_units() {
    let mut controls = Controls::default();
    controls.point(Some(Vec2::new(1000.0, 500.0)));
    assert_eq!(controls.pointer(&VIEW), Some(Vec2::new(100.0, 50.0)));
    controls.point(Some(Vec2::new(0.0, 0.0)));
    assert_eq!(controls.pointer(&VIEW), Some(Vec2::new(0.0, 100.0)));
    controls.point(None);
    assert_eq!(controls.input(&VIEW).pointer, None);
}

#[test]
fn a_change_leaves_at_once_and_only_once() {
    let mut outflow = Outflow::default();
    outflow.note(pressed(Buttons::UP));
    assert_eq!(sent(&mut outflow, 1000.0), [(1, pressed(Buttons::UP))]);
    outflow.note(pressed(Buttons::UP));
    assert!(sent(&mut outflow, 1010.0).is_empty());
}

#[test]
fn a_tap_within_a_tick_is_not_lost() {
    let mut outflow = Outflow::default();
    outflow.note(pressed(Buttons::FIRE));
    outflow.note(pressed(Buttons::default()));
    let buttons: Vec<_> = sent(&mut outflow, 5.0).iter().map(|(_, i)| i.buttons).collect();
    assert_eq!(buttons, [Buttons::FIRE, Buttons::default()]);
}

#[test]
fn moves_are_merged_and_the_rate_is_bounded() {
    let mut outflow = Outflow::default();
    let mut count = 0;
    for ms in 0..1000 {
        let pointer = Some(Vec2::new(ms as f32, 0.0));
        outflow.note(Input { buttons: Buttons::default(), pointer });
        count += sent(&mut outflow, f64::from(ms)).len();
    }
    assert!((55..=64).contains(&count), "{count} inputs in a second");
}

#[test]
fn what_can_wait_leaves_once_a_tick_and_a_key_does_not_wait() {
    let mut outflow = Outflow::default();
    let moved = |x: f32, buttons| Input { buttons, pointer: Some(Vec2::new(x, 0.0)) };
    let none = Buttons::default();
    let mut at = |input: Input, moment: f64| {
        outflow.note(input);
        outflow.due(moment * TICK_MS, moment).map(|(_, input)| input)
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

/// Frames in which something left that a screen of 60 Hz shows in a second, always at one phase.
fn frames_that_sent(phase: f64, mut intent: impl FnMut(u32) -> Input) -> Vec<u32> {
    let mut outflow = Outflow::default();
    let frames = (0..60).filter(|&frame| {
        outflow.note(intent(frame));
        let moment = 600.0 + f64::from(frame) + phase;
        outflow.due(moment * TICK_MS, moment).is_some()
    });
    frames.collect()
}

#[test]
fn what_can_wait_leaves_soon_whatever_phase_the_frames_keep() {
    for (phase, every_max) in [(0.1, 2), (0.6, 1)] {
        let moves = frames_that_sent(phase, |frame| {
            let pointer = Some(Vec2::new(frame as f32, 0.0));
            Input { buttons: Buttons::default(), pointer }
        });
        let repeats = frames_that_sent(phase, |_| pressed(Buttons::LEFT));
        let longest = |sent: &[u32]| sent.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert_eq!(longest(&moves), Some(every_max), "moves at phase {phase}");
        assert_eq!(longest(&repeats), Some(5), "repeats at phase {phase}");
    }
}

#[test]
fn nothing_booked_keeps_a_held_key_silent() {
    let mut outflow = Outflow::default();
    outflow.note(pressed(Buttons::LEFT));
    let mut count = 0;
    for ms in 0..1000 {
        // The server never says that it played anything.
        outflow.book_until(50);
        count += sent(&mut outflow, f64::from(ms) / 2.0).len();
    }
    assert!((3..=5).contains(&count), "{count} inputs in half a second");
}

#[test]
fn what_is_held_is_repeated() {
    let mut outflow = Outflow::default();
    outflow.note(pressed(Buttons::LEFT));
    let count: usize = (0..1000).map(|ms| sent(&mut outflow, f64::from(ms)).len()).sum();
    assert!((11..=14).contains(&count), "{count} inputs in a second");
}
