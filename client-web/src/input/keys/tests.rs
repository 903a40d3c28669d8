use super::*;
use crate::input::action::Action;
use crate::input::bindings::Bindings;

const VIEW: View = View { center: Vec2::new(100.0, 50.0), height: 100.0, pixels: [2000, 1000] };

#[test]
fn steering_keys_are_released_one_by_one() {
    let mut controls = Controls::default();
    controls.key_down("KeyW", Buttons::UP);
    controls.key_down("ArrowUp", Buttons::UP);
    assert!(controls.key_up("KeyW"));
    assert_eq!(controls.buttons(), Buttons::UP, "the arrow still holds it");
    controls.key_up("ArrowUp");
    assert_eq!(controls.buttons(), Buttons::default());
}

#[test]
fn letters_on_the_caps_match_other_keyboard_layouts() {
    let meaning = |place, letter| Bindings::default().buttons(place, letter);
    assert_eq!(meaning("KeyY", "z"), Buttons::MAKE, "German Z");
    assert_eq!(meaning("Semicolon", "m"), Buttons::PICK_MINION, "French M");
    assert_eq!(meaning("KeyW", "z"), Buttons::UP, "French Z steers");
    assert_eq!(meaning("KeyZ", "w"), Buttons::MAKE, "and its W makes");
    assert_eq!(meaning("KeyC", "\u{441}"), Buttons::AGITATE, "Cyrillic has no C");
    assert_eq!(meaning("KeyV", "V"), Buttons::CLEAR, "Caps Lock");
    assert_eq!(meaning("KeyQ", "a"), Buttons::default(), "French A is not where the hand steers");
}

#[test]
fn keys_without_a_position_and_the_number_pad_steer_by_their_letter() {
    let meaning = |code: &str, letter| {
        Bindings::default().buttons(&place_of(code.to_owned(), letter), letter)
    };
    for code in ["", "Unidentified"] {
        for (letter, expected) in [
            ("w", Buttons::UP),
            ("A", Buttons::LEFT),
            ("ArrowRight", Buttons::RIGHT),
            (" ", Buttons::UP),
            ("z", Buttons::MAKE),
            ("Unidentified", Buttons::default()),
        ] {
            assert_eq!(meaning(code, letter), expected, "{code} {letter}");
        }
        let place = |letter| place_of(code.to_owned(), letter);
        assert_eq!([place("Escape"), place("F3"), place("7")], ["Escape", "F3", "Digit7"]);
        assert_eq!(place("d"), place("D"), "a key goes up with or without Shift");
    }
    assert_eq!(meaning("Numpad4", "ArrowLeft"), Buttons::LEFT, "without NumLock");
    assert_eq!(meaning("Numpad4", "4"), Buttons::default());
    assert_eq!(Bindings::default().actions("NumpadEnter", "Enter"), [Action::Again]);
}

#[test]
fn a_key_releases_what_it_pressed_though_its_meaning_changed() {
    let mut controls = Controls::default();
    controls.key_down("KeyY", Buttons::MAKE);
    controls.key_down("KeyY", Buttons::HOLD);
    assert_eq!(controls.buttons(), Buttons::MAKE);
    assert!(controls.key_up("KeyY"));
    assert_eq!(controls.buttons(), Buttons::default());
    assert!(!controls.key_up("KeyY"), "it is up already");
}

#[test]
fn every_button_has_a_key_or_the_pointer() {
    let bindings = Bindings::default();
    let keyed = Action::ALL.into_iter().filter(|action| bindings.place(*action).is_some());
    let keys = keyed.fold(Buttons::FIRE.0, |all, action| all | action.buttons().0);
    assert_eq!(Buttons(keys | Buttons::AGAIN.0), Buttons::ALL, "the page itself holds that one");
}

#[test]
fn release_clears_keys_pointer_buttons_and_stick() {
    let mut controls = Controls::default();
    controls.key_down("KeyD", Buttons::RIGHT);
    controls.pad = Buttons::LEFT;
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
    controls.point(Some(Vec2::new(0.5, 0.5)));
    assert_eq!(controls.pointer(&VIEW), Some(Vec2::new(100.0, 50.0)));
    controls.point(Some(Vec2::new(0.0, 0.0)));
    assert_eq!(controls.pointer(&VIEW), Some(Vec2::new(0.0, 100.0)));
    controls.point(None);
    assert_eq!(controls.input(&VIEW).pointer(), None);
}

#[test]
fn a_still_pointer_stays_where_it_is_when_the_canvas_gets_fewer_pixels() {
    let mut controls = Controls::default();
    controls.point(Some(Vec2::new(0.75, 0.25)));
    let before = controls.pointer(&VIEW);
    assert_eq!(before, Some(Vec2::new(150.0, 75.0)));
    assert_eq!(controls.pointer(&View { pixels: [1000, 500], ..VIEW }), before);
}
