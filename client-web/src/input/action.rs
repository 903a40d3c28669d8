//! Everything that a key or a gamepad button can do, and the default keys and buttons.

use jostle_game::Buttons;

/// An action bound to a key or a gamepad button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    Up,
    Left,
    Down,
    Right,
    Fire,
    Make,
    Hold,
    Agitate,
    Clear,
    Hero,
    Minion,
    Platform,
    Team,
    /// Opens the emote wheel.
    Emote,
    /// Requests the next round.
    Again,
    Mute,
    FullScreen,
    /// Switches between playing and editing a scene.
    Edit,
    /// Saves the last few seconds as a replay.
    Clip,
}

impl Action {
    /// All actions, in the order of the settings.
    pub const ALL: [Action; 19] = [
        Action::Up,
        Action::Left,
        Action::Down,
        Action::Right,
        Action::Fire,
        Action::Make,
        Action::Hold,
        Action::Agitate,
        Action::Clear,
        Action::Hero,
        Action::Minion,
        Action::Platform,
        Action::Team,
        Action::Emote,
        Action::Again,
        Action::Mute,
        Action::FullScreen,
        Action::Edit,
        Action::Clip,
    ];

    /// The name under which the action's key or button is stored.
    pub fn id(self) -> &'static str {
        const IDS: [&str; 19] = [
            "up", "left", "down", "right", "fire", "make", "hold", "agitate", "clear", "hero",
            "minion", "platform", "team", "emote", "again", "mute", "full", "edit", "clip",
        ];
        IDS[self as usize]
    }

    pub fn of_id(id: &str) -> Option<Action> {
        Action::ALL.into_iter().find(|action| action.id() == id)
    }

    /// The game buttons that the action presses; none if the action concerns only the page.
    pub fn buttons(self) -> Buttons {
        match self {
            Action::Up => Buttons::UP,
            Action::Left => Buttons::LEFT,
            Action::Down => Buttons::DOWN,
            Action::Right => Buttons::RIGHT,
            Action::Fire => Buttons::FIRE,
            Action::Make => Buttons::MAKE,
            Action::Hold => Buttons::HOLD,
            Action::Agitate => Buttons::AGITATE,
            Action::Clear => Buttons::CLEAR,
            Action::Hero => Buttons::PICK_HERO,
            Action::Minion => Buttons::PICK_MINION,
            Action::Platform => Buttons::PICK_PLATFORM,
            Action::Team => Buttons::TEAM,
            Action::Emote
            | Action::Again
            | Action::Mute
            | Action::FullScreen
            | Action::Edit
            | Action::Clip => Buttons::default(),
        }
    }

    /// The action that presses a game button.
    pub fn that_presses(buttons: Buttons) -> Option<Action> {
        Action::ALL.into_iter().find(|action| action.buttons() == buttons && buttons.0 != 0)
    }
}

/// Default keys by position (`KeyboardEvent.code`), the same on every layout.
pub const PLACES: [(&str, Action); 10] = [
    ("KeyW", Action::Up),
    ("ArrowUp", Action::Up),
    ("Space", Action::Up),
    ("KeyA", Action::Left),
    ("ArrowLeft", Action::Left),
    ("KeyS", Action::Down),
    ("ArrowDown", Action::Down),
    ("KeyD", Action::Right),
    ("ArrowRight", Action::Right),
    ("Enter", Action::Again),
];
/// Default keys by letter (`KeyboardEvent.key`), as the page shows them. Each has a fallback position from the US
/// layout, for keyboards without that letter.
pub const LETTERS: [(&str, &str, Action); 13] = [
    ("z", "KeyZ", Action::Make),
    ("x", "KeyX", Action::Hold),
    ("c", "KeyC", Action::Agitate),
    ("v", "KeyV", Action::Clear),
    ("h", "KeyH", Action::Hero),
    ("m", "KeyM", Action::Minion),
    ("p", "KeyP", Action::Platform),
    ("t", "KeyT", Action::Team),
    ("g", "KeyG", Action::Emote),
    ("m", "KeyM", Action::Mute),
    ("f", "KeyF", Action::FullScreen),
    ("e", "KeyE", Action::Edit),
    ("k", "KeyK", Action::Clip),
];
/// Default buttons of a gamepad in the standard mapping.
pub const PAD: [(u8, Action); 10] = [
    (0, Action::Up),
    (1, Action::Hold),
    (2, Action::Make),
    (3, Action::Agitate),
    (4, Action::Emote),
    (5, Action::Clear),
    (6, Action::Team),
    (7, Action::Fire),
    (8, Action::Mute),
    (9, Action::Again),
];

/// The default actions of a key, given its position and letter. Steering positions take precedence over letters: on a
/// French keyboard, Z is in the position of W and steers up, while the key labelled W triggers `Make`.
pub fn usual(place: &str, letter: &str) -> Vec<Action> {
    // Without NumLock, the number pad has arrows.
    let place = if place.starts_with("Numpad") && letter.len() > 1 { letter } else { place };
    let letter = letter.to_lowercase();
    let steers = PLACES.iter().filter(|(code, _)| *code == place).map(|(_, action)| *action);
    let named = LETTERS.iter().filter(|(key, ..)| *key == letter).map(|(.., action)| *action);
    let instead = LETTERS.iter().filter(|(_, code, _)| *code == place).map(|(.., a)| *a);
    let [steers, named, instead]: [Vec<Action>; 3] =
        [steers.collect(), named.collect(), instead.collect()];
    [steers, named, instead].into_iter().find(|found| !found.is_empty()).unwrap_or_default()
}
