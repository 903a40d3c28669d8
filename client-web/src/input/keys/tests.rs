use super::*;

const VIEW: View = View { center: Vec2::new(100.0, 50.0), height: 100.0, pixels: [2000, 1000] };

#[test]
fn steering_keys_are_found_by_position_and_released_one_by_one() {
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
fn letters_on_the_caps_match_other_keyboard_layouts() {
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
    assert_eq!(Buttons(keys | Buttons::AGAIN.0), Buttons::ALL, "the page itself holds that one");
}

#[test]
fn release_clears_keys_pointer_buttons_and_stick() {
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
    controls.point(Some(Vec2::new(0.5, 0.5)));
    assert_eq!(controls.pointer(&VIEW), Some(Vec2::new(100.0, 50.0)));
    controls.point(Some(Vec2::new(0.0, 0.0)));
    assert_eq!(controls.pointer(&VIEW), Some(Vec2::new(0.0, 100.0)));
    controls.point(None);
    assert_eq!(controls.input(&VIEW).pointer, None);
}

#[test]
fn a_still_pointer_stays_where_it_is_when_the_canvas_gets_fewer_pixels() {
    let mut controls = Controls::default();
    controls.point(Some(Vec2::new(0.75, 0.25)));
    let before = controls.pointer(&VIEW);
    assert_eq!(before, Some(Vec2::new(150.0, 75.0)));
    assert_eq!(controls.pointer(&View { pixels: [1000, 500], ..VIEW }), before);
}
