use super::*;

#[test]
fn a_chosen_key_takes_the_place_of_the_usual_ones() {
    let mut bindings = Bindings::default();
    assert_eq!(bindings.assign(Action::Up, "KeyI", "i"), None, "the key was free");
    assert_eq!(bindings.buttons("KeyI", "i"), Buttons::UP);
    for place in ["KeyW", "ArrowUp", "Space"] {
        assert_eq!(bindings.buttons(place, ""), Buttons::default(), "{place}");
    }
    assert_eq!(bindings.buttons("KeyA", "a"), Buttons::LEFT, "the others stay");
}

#[test]
fn a_key_that_another_action_needs_is_swapped() {
    let mut bindings = Bindings::default();
    assert_eq!(bindings.assign(Action::Hold, "KeyC", "c"), Some(Action::Agitate));
    assert_eq!(bindings.buttons("KeyC", "c"), Buttons::HOLD);
    assert_eq!(bindings.buttons("KeyX", "x"), Buttons::AGITATE);
    assert_eq!(bindings.assign(Action::Agitate, "KeyC", "c"), Some(Action::Hold));
    assert_eq!(bindings.buttons("KeyC", "c"), Buttons::AGITATE, "and back");
    assert_eq!(bindings.buttons("KeyX", "x"), Buttons::HOLD);
}

#[test]
fn an_action_with_further_keys_only_loses_one() {
    let mut bindings = Bindings::default();
    assert_eq!(bindings.assign(Action::Hold, "Space", " "), None);
    assert_eq!(bindings.buttons("Space", " "), Buttons::HOLD);
    assert_eq!(bindings.buttons("KeyW", "w"), Buttons::UP);
    assert_eq!(bindings.buttons("KeyX", "x"), Buttons::default());
}

#[test]
fn both_actions_of_one_key_are_moved() {
    let mut bindings = Bindings::default();
    bindings.assign(Action::Team, "KeyM", "m");
    assert_eq!(bindings.actions("KeyT", "t"), [Action::Minion, Action::Mute]);
    bindings.assign(Action::Fire, "KeyT", "t");
    assert_eq!(bindings.place(Action::Mute), None, "to throw had no key to give");
}

/// Whatever the player chooses, no key gets two actions that it did not have by default.
#[test]
fn no_choice_makes_a_key_ambiguous() {
    let codes = ["KeyW", "KeyZ", "KeyM", "Space", "KeyI", "Enter", "KeyT", "KeyA"];
    let mut bindings = Bindings::default();
    for step in 0..600_usize {
        let action = Action::ALL[(step * 7 + step / 18) % Action::ALL.len()];
        let code = codes[(step * 5 + step / 7) % codes.len()];
        bindings.assign(action, code, "");
        assert_eq!(bindings.actions(code, ""), [action], "{action:?} on {code}, step {step}");
        assert_eq!(bindings.place(action), Some(code));
        for code in codes {
            let actions = bindings.actions(code, "");
            let pair = [Action::Minion, Action::Mute];
            let shared = actions.len() < 2 || actions.iter().all(|action| pair.contains(action));
            assert!(shared, "{code}: {actions:?}, step {step}");
        }
    }
}

#[test]
fn choices_are_remembered() {
    let mut bindings = Bindings::default();
    bindings.assign(Action::Fire, "KeyT", "t");
    bindings.assign(Action::Up, "BracketLeft", "[");
    assert_eq!(Bindings::parse(&bindings.text()), bindings);
    assert_eq!(Bindings::parse("nonsense,what=KeyA,up=KeyI").text(), "up=KeyI");
    assert_eq!(Bindings::parse(""), Bindings::default());
}

#[test]
fn caps_read_as_on_the_real_keyboard() {
    let bindings = Bindings::default();
    let cap = |layout: &KeyboardLayout, action| layout.cap(&bindings, action).expect("a key");
    let unknown = KeyboardLayout::default();
    assert_eq!([Action::Up, Action::Make].map(|action| cap(&unknown, action)), ["W", "Z"]);
    let mut french = KeyboardLayout::default();
    for (place, letter) in [("KeyW", "z"), ("KeyA", "q"), ("KeyZ", "w"), ("KeyQ", "a")] {
        french.note(place, letter);
    }
    let caps = [Action::Up, Action::Left, Action::Make].map(|action| cap(&french, action));
    assert_eq!(caps, ["Z", "Q", "W"]);
    let mut german = KeyboardLayout::default();
    german.note("KeyY", "z");
    german.note("KeyZ", "y");
    assert_eq!(cap(&german, Action::Make), "Z");
    let mut russian = KeyboardLayout::default();
    russian.note("KeyC", "\u{441}");
    assert_eq!(cap(&russian, Action::Agitate), "\u{421}");
    let mut own = Bindings::default();
    own.assign(Action::Hold, "Semicolon", "\u{f6}");
    german.note("Semicolon", "\u{f6}");
    assert_eq!(german.cap(&own, Action::Hold).as_deref(), Some("\u{d6}"));
    assert_eq!(german.cap(&own, Action::Fire), None);
    assert_eq!(unknown.label("Comma"), "Comma", "a place has a name at least");
}
