//! What the page says: names for strangers, tools and their keys, and one sentence and one button
//! for every way in which a session can end.

use jostle_protocol::Refusal;
use jostle_sim::{Buttons, Kind, Scene, TICKS_PER_SECOND, Tools};

const ADJECTIVES: [&str; 16] = [
    "Brave", "Bouncy", "Calm", "Clever", "Dizzy", "Fuzzy", "Gentle", "Happy", "Jolly", "Lucky",
    "Mellow", "Nimble", "Quick", "Sunny", "Swift", "Wobbly",
];
const ANIMALS: [&str; 16] = [
    "Badger", "Beaver", "Crab", "Ferret", "Fox", "Gecko", "Heron", "Koala", "Lemur", "Lynx",
    "Mole", "Newt", "Otter", "Owl", "Panda", "Puffin",
];

/// A friendly name for somebody who gave none.
pub fn friendly_name(random: u32) -> String {
    let adjective = ADJECTIVES[random as usize % ADJECTIVES.len()];
    let animal = ANIMALS[(random >> 8) as usize % ANIMALS.len()];
    format!("{adjective} {animal}")
}

/// A key cap at the bottom of the game.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cap {
    /// What is printed on it.
    pub key: &'static str,
    /// What it does here; nothing where the next cap says it for both.
    pub does: &'static str,
    /// The buttons that light it.
    pub buttons: Buttons,
    /// On a touch screen it is armed first and then used where the world is touched.
    pub aimed: bool,
}

const fn cap(key: &'static str, does: &'static str, buttons: Buttons, aimed: bool) -> Cap {
    Cap { key, does, buttons, aimed }
}

/// The caps of a scene, in reading order.
pub fn caps(scene: &Scene) -> Vec<Cap> {
    let table = [
        (Tools::STEER, cap("W", "", Buttons::UP, false)),
        (Tools::STEER, cap("A", "", Buttons::LEFT, false)),
        (Tools::STEER, cap("S", "", Buttons::DOWN, false)),
        (Tools::STEER, cap("D", "move", Buttons::RIGHT, false)),
        (Tools::LAUNCH, cap("Click", "throw dye", Buttons::FIRE, true)),
        (Tools::DUMB, cap("Z", "drop minions", Buttons::MAKE, true)),
        (Tools::SPRAY, cap("Z", "spray sparks", Buttons::MAKE, true)),
        (Tools::HOLD, cap("X", "grab", Buttons::HOLD, true)),
        (Tools::AGITATE, cap("C", "shake", Buttons::AGITATE, false)),
        (Tools::CLEAR, cap("V", "clear", Buttons::CLEAR, false)),
        (Tools::SELECT, cap("Drag", "move it", Buttons::FIRE, true)),
        (Tools::SELECT, cap("H", "hero", Buttons::PICK_HERO, false)),
        (Tools::SELECT, cap("M", "minion", Buttons::PICK_MINION, false)),
        (Tools::SELECT, cap("P", "platform", Buttons::PICK_PLATFORM, false)),
    ];
    table.into_iter().filter(|(tool, _)| scene.tools.contains(*tool)).map(|(_, cap)| cap).collect()
}

/// What must be known to read a scene's picture, in one line; most scenes explain themselves.
pub fn hint(scene: &Scene, by_touch: bool) -> Option<&'static str> {
    let text = match by_touch {
        false => "H, M, P pick a body; what it touches turns red.",
        true => "Pick a body by its button; what it touches turns red.",
    };
    scene.tools.contains(Tools::SELECT).then_some(text)
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

/// What the button of a notice does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Back to the lobby.
    Lobby,
    /// Connects again.
    Again,
    /// Loads the page again.
    Reload,
    /// Into the arena.
    Arena,
    /// Takes the card away.
    Stay,
    /// Asks for a replay file.
    File,
    /// Asks the server again.
    Refetch,
}

/// What happened and what to do, for a card in the middle of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Notice {
    /// Two or three words.
    pub title: &'static str,
    /// One sentence.
    pub text: &'static str,
    /// On the button.
    pub button: &'static str,
    /// What the button does.
    pub way: Way,
    /// A second button, less inviting, and what it does.
    pub other: Option<(&'static str, Way)>,
    /// Goes away by itself; the button need not have the focus.
    pub passing: bool,
}

const fn notice(title: &'static str, text: &'static str, button: &'static str, way: Way) -> Notice {
    Notice { title, text, button, way, other: None, passing: false }
}

const fn notice_elsewhere(title: &'static str, text: &'static str) -> Notice {
    let other = Some(("All rooms", Way::Lobby));
    Notice { other, ..notice(title, text, "Play in the arena", Way::Arena) }
}

/// The browser cannot draw the game.
pub const NO_WEBGL2: Notice = notice(
    "No WebGL 2",
    "This browser cannot draw the game: turn on hardware acceleration or try another browser.",
    "Try again",
    Way::Reload,
);
/// The scene named in the address of a demo does not exist.
pub const NO_SUCH_SCENE: Notice = notice(
    "No such scene",
    "This demo names a scene that does not exist.",
    "See the scenes",
    Way::Lobby,
);
/// A mistake of ours ended the page's program.
pub const CRASHED: Notice = notice(
    "Something broke",
    "A mistake in the game stopped it here: load the page again to go on.",
    "Load again",
    Way::Reload,
);
/// The browser took the drawing context and did not give it back.
pub const GRAPHICS_LOST: Notice = notice(
    "Picture lost",
    "The browser stopped drawing the game: load the page again if it does not come back.",
    "Load again",
    Way::Reload,
);
/// The room of somebody who was in it is gone: the server was restarted, or they were away for long.
pub const ROOM_GONE: Notice =
    notice_elsewhere("Room closed", "This room closed while you were away.");
/// The socket was lost.
pub const RECONNECTING: Notice = Notice {
    passing: true,
    ..notice(
        "Connection lost",
        "Trying to get back in; your seat is kept for you for 45 seconds.",
        "Try now",
        Way::Again,
    )
};
/// The server closed; whoever restarts it wants it back soon.
pub const RESTARTING: Notice = Notice {
    passing: true,
    ..notice(
        "Server closed",
        "It should be back soon: this page tries again until it is.",
        "Try now",
        Way::Again,
    )
};

/// The host closed the room.
pub const CLOSED_BY_YOU: Notice = notice(
    "Room closed",
    "Everybody has left it, and its link leads nowhere now.",
    "See the rooms",
    Way::Lobby,
);

/// What the button beside a player does, around the name.
pub const KICK: [&str; 2] = ["Have ", " leave"];
/// Whether somebody is to leave, around the name.
pub const ASK_KICK: [&str; 2] = ["Have ", " leave?"];
/// What that means.
pub const ABOUT_KICK: &str =
    "They lose their seat, and nobody new comes in from their address for five minutes.";
/// The button that does it.
pub const DO_KICK: &str = "Have them leave";
/// Whether the room is to be closed.
pub const ASK_CLOSE: &str = "Close this room?";
/// What that means.
pub const ABOUT_CLOSE: &str = "Everybody has to leave it, you too, and its link ends.";
/// The button that does it.
pub const DO_CLOSE: &str = "Close the room";
/// The server did not do what only a host may ask for, and of nobody who is one.
pub const DENIED: &str = "Only the host of this room may do that, and not to a host.";

/// A replay is on its way.
pub const FETCHING: Notice = Notice {
    passing: true,
    ..notice("Fetching", "Getting the replay from the server.", "Back to the lobby", Way::Lobby)
};
/// The replay named in the address does not exist.
pub const NO_SUCH_REPLAY: Notice = Notice {
    other: Some(("Open a file", Way::File)),
    ..notice(
        "No such replay",
        "The server keeps no replay of this name: it was removed to make room, or the link is not whole.",
        "See all replays",
        Way::Lobby,
    )
};
/// The server gave no replay, for now.
pub const REPLAY_REFUSED: Notice = Notice {
    other: Some(("All rooms", Way::Lobby)),
    ..notice(
        "No answer",
        "The server did not hand the replay out: check the connection, or wait a little and try again.",
        "Try again",
        Way::Refetch,
    )
};
/// A replay is shorter than it was.
pub const REPLAY_CUT: Notice = notice("Cut short", "", "Watch what is there", Way::Stay);

/// The card for a file that cannot be watched, while nothing or another one is being watched.
pub fn bad_replay(title: &'static str, text: &'static str, watching: bool) -> Notice {
    let other = if watching { ("Watch on", Way::Stay) } else { ("All rooms", Way::Lobby) };
    Notice { other: Some(other), ..notice(title, text, "Open another file", Way::File) }
}

/// What a cut replay still has.
pub fn cut_at(ticks: u32) -> String {
    match ticks {
        0 => "Nothing but the start of this replay can be read: get the file again from where it came from.".into(),
        _ => format!(
            "The end of this replay is missing or damaged. Its first {} are as they were.",
            span(ticks)
        ),
    }
}

/// Minutes and seconds of so many ticks, with tenths if wanted.
pub fn clock(ticks: f64, tenths: bool) -> String {
    let seconds = ticks / f64::from(TICKS_PER_SECOND);
    let (minutes, seconds) = ((seconds / 60.0).floor(), seconds % 60.0);
    match tenths {
        true => format!("{minutes:.0}:{:04.1}", (seconds * 10.0).floor() / 10.0),
        false => format!("{minutes:.0}:{:02.0}", seconds.floor()),
    }
}

/// So many ticks as one would say it.
fn span(ticks: u32) -> String {
    match ticks / TICKS_PER_SECOND {
        0 => "moments".into(),
        1 => "second".into(),
        seconds if seconds < 120 => format!("{seconds} seconds"),
        seconds => format!("{} minutes", seconds / 60),
    }
}

/// How long ago something was.
pub fn ago(seconds: f64) -> String {
    let (count, unit) = match seconds {
        s if s < 60.0 => return "just now".into(),
        s if s < 3600.0 => (s / 60.0, "minute"),
        s if s < 86_400.0 => (s / 3600.0, "hour"),
        s => (s / 86_400.0, "day"),
    };
    let count = count.floor();
    let plural = if count == 1.0 { "" } else { "s" };
    format!("{count} {unit}{plural} ago")
}

/// A length in bytes.
pub fn size(bytes: u64) -> String {
    match bytes {
        0..1000 => format!("{bytes} B"),
        1000..1_000_000 => format!("{} kB", bytes / 1000),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

/// Keys of somebody who watches a replay, and what they do.
pub const REPLAY_KEYS: [(&str, &str); 10] = [
    ("Space", "play, pause"),
    (", .", "one tick back, one on"),
    ("\u{2190} \u{2192}", "a second back, a second on"),
    ("Home End", "to the start, to the end"),
    ("\u{2191} \u{2193}", "faster, slower"),
    ("1 to 9", "follow a player; again for the whole world"),
    ("0", "the whole world"),
    ("F2", "bounds of all bodies"),
    ("?", "this help"),
    ("Drop", "a .jostle file to watch it"),
];

/// The card while a seat is asked for, after so many attempts that failed.
pub fn connecting(attempts: u32) -> Notice {
    let text = match attempts {
        0..=1 => "Asking for a seat in the room.",
        _ => "The server does not answer yet: trying again until it does.",
    };
    Notice { passing: true, ..notice("Joining", text, "Back to the lobby", Way::Lobby) }
}

/// The card for a session that was refused or ended; `None` if that passes by itself, and the page
/// is to try again until it does.
pub fn refused(refusal: Refusal) -> Option<Notice> {
    use Way::{Again, Lobby, Reload};
    let (title, button, way) = match refusal {
        Refusal::Version => ("Old version", "Load again", Reload),
        Refusal::RoomFull => ("Room full", "Find another room", Lobby),
        Refusal::NoSuchRoom => {
            return Some(notice_elsewhere("No such room", refusal.message()));
        }
        Refusal::ServerFull => ("Server full", "See the rooms", Lobby),
        Refusal::TooManySockets => ("Too many here", "Try again", Again),
        Refusal::Flood => ("Slow down", "Join again", Again),
        Refusal::Silent => ("Are you there?", "Join again", Again),
        Refusal::Replaced => ("Playing elsewhere", "Play here", Again),
        Refusal::Closing | Refusal::BadToken => return None,
        Refusal::Kicked => ("Asked to leave", "See the rooms", Lobby),
        Refusal::RoomClosed => ("Room closed", "See the rooms", Lobby),
        Refusal::RoomFailed => ("Room broken", "Go to the lobby", Lobby),
        Refusal::BadHello | Refusal::BadMessage => ("Misunderstood", "Load again", Reload),
    };
    Some(notice(title, refusal.message(), button, way))
}

/// The refusal that a close code stands for, if its message was lost.
pub fn refusal_of_close(code: u16) -> Option<Refusal> {
    let several = [1001, 1008];
    Refusal::ALL.into_iter().find(|r| r.close_code() == code && !several.contains(&code))
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_protocol::Appearance;

    #[test]
    fn friendly_names_are_valid_names() {
        for random in 0..=0xFFFF {
            let name = friendly_name(random);
            assert_eq!(Appearance::new(&name, 0).map(|a| a.name), Ok(name));
        }
    }

    #[test]
    fn only_what_passes_by_itself_is_waited_for() {
        for refusal in Refusal::ALL {
            let stops = refused(refusal).is_some_and(|notice| !notice.passing);
            let passes = [Refusal::Closing, Refusal::BadToken].contains(&refusal);
            assert_eq!(stops, !passes, "{refusal:?}");
        }
    }

    #[test]
    fn who_finds_no_room_is_shown_others() {
        for notice in [refused(Refusal::NoSuchRoom).expect("an end"), ROOM_GONE] {
            assert_eq!(notice.way, Way::Arena);
            assert_eq!(notice.other.map(|(_, way)| way), Some(Way::Lobby));
        }
    }

    #[test]
    fn a_hint_names_the_keys_that_the_scene_has() {
        for scene in Scene::built_in() {
            let keys: Vec<&str> = caps(&scene).iter().map(|cap| cap.key).collect();
            let picks = ["H", "M", "P"].iter().all(|key| keys.contains(key));
            for by_touch in [false, true] {
                assert_eq!(hint(&scene, by_touch).is_some(), picks, "{}", scene.name);
            }
        }
    }

    #[test]
    fn times_and_sizes_are_said_as_people_do() {
        assert_eq!(clock(0.0, false), "0:00");
        assert_eq!(clock(59.99 * 60.0, false), "0:59");
        assert_eq!(clock(59.99 * 60.0, true), "0:59.9");
        assert_eq!(clock(738.0, true), "0:12.3");
        assert_eq!(clock(3600.0 * 75.0, false), "75:00");
        assert_eq!(
            [ago(-3.0), ago(119.0), ago(7200.0), ago(9e5)],
            ["just now", "1 minute ago", "2 hours ago", "10 days ago"]
        );
        assert_eq!([size(12), size(12_345), size(1_234_567)], ["12 B", "12 kB", "1.2 MB"]);
        assert!(cut_at(600).ends_with("Its first 10 seconds are as they were."));
    }

    #[test]
    fn close_codes_that_name_one_refusal_are_understood() {
        assert_eq!(refusal_of_close(4001), Some(Refusal::RoomFull));
        assert_eq!(refusal_of_close(1006), None);
        assert_eq!(refusal_of_close(1001), None, "browsers say so too when the page goes");
    }
}
