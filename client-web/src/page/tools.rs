//! The tools of a scene as shown on the page: key caps, and touch buttons.

use crate::input::action::Action;
use crate::input::touch::Fingers;
use jostle_game::{Buttons, Kind, Scene, Tools};

/// A key cap shown at the bottom of the game.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cap {
    /// The label of the key.
    pub key: &'static str,
    /// The action of the key in this scene; empty if the next cap describes both keys.
    pub does: &'static str,
    pub buttons: Buttons,
    /// Whether the tool is first armed on a touch screen and then used where the world is touched.
    pub aimed: bool,
}

const fn cap(key: &'static str, does: &'static str, buttons: Buttons, aimed: bool) -> Cap {
    Cap { key, does, buttons, aimed }
}

/// Help for the page's fixed keys.
pub const PAGE_HELP: [(&str, &str); 4] =
    [("?", "this help"), ("F2", "collision outlines"), ("F3", "stats"), ("F4", "network details")];
/// Help for the keys that steer besides the chosen ones.
pub const STEER_HELP: (&str, &str) = ("\u{2190} \u{2191} \u{2193} \u{2192} Space", "steer, too");
/// Help for someone who watches a room.
pub const WATCH_HELP: [(&str, &str); 3] = [
    ("1 to 9", "follow a player; press again to stop"),
    ("0", "the whole world"),
    ("H", "hide all but the game"),
];
/// Help for the page's configurable keys. The mute key is omitted in scenes that use it.
pub const CHOSEN_HELP: [(Action, &str); 4] = [
    (Action::Mute, "sound off / on"),
    (Action::Emote, "emotes"),
    (Action::FullScreen, "full screen"),
    (Action::Clip, "keep the last 20 seconds"),
];
pub const REPLAY_HELP: [(&str, &str); 12] = [
    ("Space", "play, pause"),
    (", .", "step back / forward one tick"),
    ("\u{2190} \u{2192}", "skip back / forward one second"),
    ("Home End", "jump to start / end"),
    ("G", "next goal; with Shift the one before"),
    ("\u{2191} \u{2193}", "faster, slower"),
    ("1 to 9", "follow a player; press again to stop"),
    ("0", "the whole world"),
    ("M", "sound off / on"),
    ("F2", "collision outlines"),
    ("?", "this help"),
    ("Drop a .jostle file", "watch it"),
];

/// The caps for the steering keys, which depend on how heroes move.
fn steering(scene: &Scene) -> Vec<Cap> {
    let Some(hero) = scene.hero.as_ref().filter(|_| scene.tools.contains(Tools::STEER)) else {
        return Vec::new();
    };
    let key = |key, does, buttons| cap(key, does, buttons, false);
    if hero.walk.is_some() {
        return vec![
            key("W", "jump", Buttons::UP),
            key("A", "", Buttons::LEFT),
            key("D", "run", Buttons::RIGHT),
        ];
    }
    let has_lanes = hero.lane.is_some() || scene.rules.teams.iter().any(|team| team.lane.is_some());
    let falls = scene.world.gravity.y * hero.body.gravity_scale < 0.0;
    let does = match (has_lanes, falls) {
        (true, _) => "move along your side",
        (false, true) => "fly",
        (false, false) => "move",
    };
    vec![
        key("W", "", Buttons::UP),
        key("A", "", Buttons::LEFT),
        key("S", "", Buttons::DOWN),
        key("D", does, Buttons::RIGHT),
    ]
}

/// The caps of a scene, in reading order.
pub fn caps(scene: &Scene) -> Vec<Cap> {
    let table = [
        (Tools::LAUNCH, cap("Click", "throw dye", Buttons::FIRE, true)),
        (Tools::MARBLE, cap("Z", "drop marbles", Buttons::MAKE, true)),
        (Tools::SPRAY, cap("Z", "spray sparks", Buttons::MAKE, true)),
        (Tools::HOLD, cap("X", "grab", Buttons::HOLD, true)),
        (Tools::AGITATE, cap("C", "shake", Buttons::AGITATE, false)),
        (Tools::CLEAR, cap("V", "clear", Buttons::CLEAR, false)),
        (Tools::SLING, cap("Drag", "pull the ball, let go", Buttons::FIRE, true)),
        (Tools::SELECT, cap("Drag", "move the shape", Buttons::FIRE, true)),
        (Tools::SELECT, cap("H", "hero", Buttons::PICK_HERO, false)),
        (Tools::SELECT, cap("M", "minion", Buttons::PICK_MINION, false)),
        (Tools::SELECT, cap("P", "platform", Buttons::PICK_PLATFORM, false)),
    ];
    let tools = table.into_iter().filter(|(tool, _)| scene.tools.contains(*tool));
    steering(scene).into_iter().chain(tools.map(|(_, cap)| cap)).collect()
}

/// A line that explains the scene; most scenes need none. On touch screens it mentions no keys.
pub fn hint(scene: &Scene, by_touch: bool) -> Option<&'static str> {
    let has = |tool| scene.tools.contains(tool);
    match by_touch {
        _ if !by_touch && !has(Tools::SELECT) => None,
        false => Some(
            "Drag a shape, or choose one with {hero}, {minion} or {platform}. Whatever it touches turns red.",
        ),
        true if has(Tools::SELECT) => {
            Some("Drag a shape, or choose one with a button. Whatever it touches turns red.")
        }
        true if has(Tools::SLING) => Some("Pull the ball back, then let go."),
        true if has(Tools::LAUNCH) => Some("Tap to throw dye packs."),
        true => None,
    }
}

/// The kind of body that a button selects.
pub fn picks(buttons: Buttons) -> Option<Kind> {
    match buttons {
        Buttons::PICK_HERO => Some(Kind::Hero),
        Buttons::PICK_MINION => Some(Kind::Minion),
        Buttons::PICK_PLATFORM => Some(Kind::Platform),
        _ => None,
    }
}

/// The caps in a scene that become touch buttons: all except the directions.
pub fn touch_tools(scene: &Scene) -> Vec<Cap> {
    let directions = [Buttons::UP, Buttons::LEFT, Buttons::DOWN, Buttons::RIGHT];
    caps(scene).into_iter().filter(|cap| !directions.contains(&cap.buttons)).collect()
}

/// Help for touch screens: each gesture and its effect in a scene.
pub fn touch_help(scene: &Scene) -> impl Iterator<Item = (&'static str, &'static str)> {
    let aimed: Vec<Cap> = touch_tools(scene).into_iter().filter(|cap| cap.aimed).collect();
    let steers = scene.tools.contains(Tools::STEER).then_some(("Drag on the left", "move"));
    let uses = match aimed[..] {
        [] => None,
        [Cap { key: "Drag", does, .. }] => Some(("Drag", does)),
        [only] => Some(("Tap", only.does)),
        _ => Some(("Tap", "use the selected tool")),
    };
    steers.into_iter().chain(uses)
}

/// The touch state for a scene, with a stick if something can be steered and with the first aimed tool armed.
pub fn fingers(scene: &Scene) -> Fingers {
    let armed = touch_tools(scene).into_iter().find(|cap| cap.aimed);
    let armed = armed.map_or(Buttons::default(), |cap| cap.buttons);
    Fingers::new(scene.tools.contains(Tools::STEER), armed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touch_help_says_what_a_tap_does() {
        let help = |name: &str| -> Vec<(&str, &str)> {
            let scene = Scene::built_in().into_iter().find(|scene| scene.name == name);
            touch_help(&scene.expect("a shipped scene")).collect()
        };
        assert_eq!(help("race"), [("Drag on the left", "move")]);
        assert_eq!(help("splash"), [("Drag on the left", "move"), ("Tap", "throw dye")]);
        assert_eq!(help("slingshot"), [("Drag", "pull the ball, let go")]);
        assert_eq!(help("arena")[1], ("Tap", "use the selected tool"));
    }

    #[test]
    fn a_hint_names_the_keys_that_the_scene_has() {
        for scene in Scene::built_in() {
            let keys: Vec<&str> = caps(&scene).iter().map(|cap| cap.key).collect();
            let picks = ["H", "M", "P"].iter().all(|key| keys.contains(key));
            assert_eq!(hint(&scene, false).is_some(), picks, "{}", scene.name);
            let aims = [Tools::SELECT, Tools::SLING, Tools::LAUNCH];
            let aims = aims.iter().any(|tool| scene.tools.contains(*tool));
            assert_eq!(hint(&scene, true).is_some(), aims, "{}", scene.name);
        }
    }
}
