//! The players' tools. To add a tool, list it here and implement it in `game/src/tools.rs`. The page shows its key
//! hint (`client-web/src/page/tools.rs`), bots choose it (`cli/src/bot_input.rs`), and `docs/scenes.md` lists it. If
//! it has its own button, add that to `Buttons`, to the page's keys and to `docs/protocol.md`.

/// Tools that players have in a scene, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Tools(pub u16);

impl Tools {
    /// WASD steers the player's own hero.
    pub const STEER: Tools = Tools(1 << 0);
    /// A click launches a dye pack at the pointer.
    pub const LAUNCH: Tools = Tools(1 << 1);
    /// Z drops a marble at the pointer, one per tick.
    pub const MARBLE: Tools = Tools(1 << 2);
    /// Z sprays particles at the pointer, one per tick.
    pub const SPRAY: Tools = Tools(1 << 3);
    /// X holds the marble or block under the pointer.
    pub const HOLD: Tools = Tools(1 << 4);
    /// C shakes all marbles.
    pub const AGITATE: Tools = Tools(1 << 5);
    /// V removes all marbles.
    pub const CLEAR: Tools = Tools(1 << 6);
    /// Pressing the pointer selects a body, and dragging moves it; H, M and P select the hero, minion and platform.
    pub const SELECT: Tools = Tools(1 << 7);

    /// Dragging pulls the ball of the sling.
    pub const SLING: Tools = Tools(1 << 8);

    /// All tools with their names in scene files.
    pub const NAMES: [(&str, Tools); 9] = [
        ("steer", Tools::STEER),
        ("launch", Tools::LAUNCH),
        ("dumb", Tools::MARBLE),
        ("spray", Tools::SPRAY),
        ("hold", Tools::HOLD),
        ("agitate", Tools::AGITATE),
        ("clear", Tools::CLEAR),
        ("select", Tools::SELECT),
        ("sling", Tools::SLING),
    ];

    /// Returns whether all of `other` are allowed.
    pub fn contains(self, other: Tools) -> bool {
        self.0 & other.0 == other.0
    }
}
