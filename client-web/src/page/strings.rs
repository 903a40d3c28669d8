//! The page's texts in English. Every literal in this file is shown to the user and must be translated in each language
//! file (`web/de.txt`); a test lists missing translations.

mod scenes;

pub use crate::page::card::{Card, CardAction};
pub use scenes::*;

use crate::input::action::Action;
use crate::language::{fill, say};
use crate::net::api::is_timed;
use crate::page::card::{card, card_or, passing};
use crate::replay::error::ReplayLoadError;
use crate::sound::cue::Sound;
use jostle_protocol::replay::ReplayError;
use jostle_protocol::web::{Posted, RecordCard, RecordTable};
use jostle_protocol::{BAD_MESSAGE_CODES, ClipRefusal, Refusal};
use jostle_sim::TICKS_PER_SECOND;

const fn elsewhere(title: &'static str, text: &'static str) -> Card {
    card_or(card(title, text, "Play", CardAction::Play), "All rooms", CardAction::Lobby)
}

/// Shown while the lists of the lobby cannot be refreshed.
pub const UNANSWERED: &str = "Can't reach the server; this list may be out of date.";

/// Shown while a room is being opened.
pub const STARTING: &str = "Starting a room\u{2026}";

/// Shown if the list of scenes cannot be loaded on a page without a server.
pub const NO_SCENES: &str = "Can't load the scenes. Check your connection; we'll keep trying.";

/// Shown when the server did not answer a request for a room.
pub const SILENCE: &str = "Can't reach the server. Check your connection.";

/// Shown when the browser cannot draw the game.
pub const NO_WEBGL2: Card = card(
    "No WebGL 2",
    "This browser can't draw the game. Turn on hardware acceleration, or try another browser.",
    "Try again",
    CardAction::Reload,
);
/// Shown when the scene of a demo does not exist or could not be fetched.
pub const NO_SCENE: Card = card_or(
    card(
        "Couldn't load the scene",
        "Check the link and your connection, then try again.",
        "Try again",
        CardAction::Reload,
    ),
    "Browse scenes",
    CardAction::Lobby,
);
/// Shown when the program crashed because of a bug.
pub const CRASHED: Card = card(
    "Something broke",
    "The game hit a bug and stopped. Reload the page to continue.",
    "Reload",
    CardAction::Reload,
);
/// Shown when the browser took the drawing context away and has not restored it.
pub const GRAPHICS_LOST: Card = card(
    "Graphics lost",
    "Your browser stopped drawing the game. Reload if it doesn't come back.",
    "Reload",
    CardAction::Reload,
);
/// Shown when the player's room no longer exists, because the server restarted or the player was away too long.
pub const ROOM_GONE: Card = elsewhere("Room closed", "The room closed while you were away.");
/// Shown while the page reconnects after losing the socket.
pub const RECONNECTING: Card = passing(card(
    "Connection lost",
    "Reconnecting. We'll hold your spot for 45 seconds.",
    "Try now",
    CardAction::Again,
));
/// Shown when the server shut down, most likely to be restarted.
pub const RESTARTING: Card = passing(card(
    "Server restarting",
    "It should be back soon; we'll reconnect automatically.",
    "Try now",
    CardAction::Again,
));
/// Shown when the server is restarting and the room will continue.
pub const BACK_SOON: Card = passing(card(
    "Back in a moment",
    "The server is restarting. The game goes on where it was, and we hold your spot.",
    "Try now",
    CardAction::Again,
));
/// Shown after the player, as host, closed the room.
pub const CLOSED_BY_YOU: Card = card(
    "Room closed",
    "Everyone has been sent out, and the link no longer works. Open another room, and they can follow you.",
    "See the rooms",
    CardAction::Lobby,
);
/// Shown when the host who closed the room has opened another one.
pub const NEXT_ROOM: Card = card_or(
    card("On we go", "The host has opened another room.", "Join in", CardAction::Follow),
    "See the rooms",
    CardAction::Lobby,
);
/// Shown while a replay is being fetched.
pub const FETCHING: Card = passing(card(
    "Loading the replay",
    "Fetching the file.",
    "Back to the lobby",
    CardAction::Lobby,
));
/// The card shown while a replay is being read. `progress` is the fraction read so far, 0..=1.
pub fn reading(progress: f64) -> Card {
    Card { detail: percent((progress * 100.0) as u8), ..READING }
}
const READING: Card = passing(card(
    "Loading the replay",
    "Checking that it is whole.",
    "Back to the lobby",
    CardAction::Lobby,
));
/// Shown when the replay named in the address does not exist.
pub const NO_SUCH_REPLAY: Card = card_or(
    card(
        "Replay not found",
        "There is no replay at this address. It may have been deleted to save space, or the link is incomplete.",
        "Back to the lobby",
        CardAction::Lobby,
    ),
    "Open a file",
    CardAction::File,
);
/// Shown when the server refused to send the replay, possibly only for now.
pub const REPLAY_REFUSED: Card = card_or(
    card(
        "Couldn't load the replay",
        "Check your connection, or try again in a moment.",
        "Try again",
        CardAction::Refetch,
    ),
    "Back to the lobby",
    CardAction::Lobby,
);

/// The card for a file that cannot be watched. `watching` says whether something else is on display.
pub fn bad_replay(error: &ReplayLoadError, watching: bool) -> Card {
    let (label, action) = match watching {
        true => ("Keep watching", CardAction::Stay),
        false => ("Back to the lobby", CardAction::Lobby),
    };
    let (title, text) = error.title_and_advice();
    let card = card(title, text, "Open another file", CardAction::File);
    Card { detail: error.to_string(), ..card_or(card, label, action) }
}

/// The number of bots in a game played alone, in words.
pub fn bots(count: u32) -> String {
    match count {
        0 => String::new(),
        1 => say("with 1 bot").to_owned(),
        many => fill("with {count} bots", &[("count", &many.to_string())]),
    }
}

/// The number of people and bots in a room, of which there is at least one each.
pub fn people_and_bots(people: usize, bots: usize) -> String {
    let people = match people {
        1 => say("1 player").to_owned(),
        many => fill("{count} players", &[("count", &many.to_string())]),
    };
    let bots = match bots {
        1 => say("1 bot").to_owned(),
        many => fill("{count} bots", &[("count", &many.to_string())]),
    };
    people + ", " + &bots
}

/// Shown in a room at the end of a round that would count if it were played alone.
pub const COUNTS_ALONE: &str = "Records count when you play alone.";
/// Shown when the player's run has been submitted.
pub const RUN_CHECKED: &str = "The server is checking your run\u{2026}";
/// Shown when the game is too long for its run to be stored.
pub const RUN_TOO_LONG: &str =
    "This game is older than half an hour: load the page again to set records.";
/// Shown when the ghost's replay could not be fetched or does not belong to the scene.
pub const NO_GHOST: Card = card(
    "No ghost",
    "The record couldn't be loaded, or it is of another version of this scene.",
    "Race alone",
    CardAction::Stay,
);

/// A number of points.
pub fn points(count: i32) -> String {
    match count {
        1 => say("1 point").to_owned(),
        _ => fill("{count} points", &[("count", &count.to_string())]),
    }
}

/// The result of a run.
pub fn result(table: &RecordTable, run: &RecordCard) -> String {
    match is_timed(table) {
        true => clock(f64::from(run.ticks), true),
        false => points(run.points),
    }
}

/// The best run of a scene.
pub fn best_run(table: &RecordTable, run: &RecordCard) -> String {
    let result = result(table, run);
    let name = run.players.first().map_or("", String::as_str);
    match run.players.len() {
        0 | 1 => fill("Best: {result} by {name}", &[("result", &result), ("name", name)]),
        many => {
            let more = (many - 1).to_string();
            fill(
                "Best: {result} by {name} and {count} more",
                &[("result", &result), ("name", name), ("count", &more)],
            )
        }
    }
}

/// The server's answer about the player's run, as a sentence.
pub fn run_said(answer: Option<&Posted>) -> String {
    match answer {
        Some(Posted { rank: Some(1), .. }) => "A new record! The server has checked it.".into(),
        Some(Posted { rank: Some(rank), .. }) => {
            fill("Your run is number {rank} here.", &[("rank", &rank.to_string())])
        }
        Some(Posted { error: Some(error), .. }) => {
            fill("Your run was not kept: {error}.", &[("error", error)])
        }
        Some(_) => "Your run is not among the best yet.".into(),
        None => "Can't reach the server, so your run was not kept.".into(),
    }
}

/// The card for a truncated replay with this many ticks left.
pub fn cut_replay(ticks: u32, error: &ReplayError) -> Card {
    let text = match ticks {
        0 => {
            say("Only the first frame of this replay can be read. Try downloading the file again.")
                .to_owned()
        }
        _ => fill(
            "The end of this replay is missing or damaged. The first {time} intact.",
            &[("time", &span(ticks))],
        ),
    };
    let card = card("Incomplete replay", "", "Watch what's left", CardAction::Stay);
    Card { text: text.into(), detail: error.to_string(), ..card }
}

/// Formats ticks as minutes and seconds, optionally with tenths.
pub fn clock(ticks: f64, tenths: bool) -> String {
    let seconds = ticks / f64::from(TICKS_PER_SECOND);
    let (minutes, seconds) = ((seconds / 60.0).floor(), seconds % 60.0);
    match tenths {
        true => format!("{minutes:.0}:{:04.1}", (seconds * 10.0).floor() / 10.0),
        false => format!("{minutes:.0}:{:02.0}", seconds.floor()),
    }
}

/// Formats a difference in ticks as seconds with a sign.
pub fn difference(ticks: i64) -> String {
    let sign = if ticks < 0 { "\u{2212}" } else { "+" };
    let seconds = ticks.unsigned_abs() as f64 / f64::from(TICKS_PER_SECOND);
    format!("{sign}{seconds:.1} s")
}

/// A duration in words, including the verb.
fn span(ticks: u32) -> String {
    match ticks / TICKS_PER_SECOND {
        0 => say("moments are").to_owned(),
        1 => say("second is").to_owned(),
        seconds if seconds < 120 => fill("{count} seconds are", &[("count", &seconds.to_string())]),
        seconds => fill("{count} minutes are", &[("count", &(seconds / 60).to_string())]),
    }
}

/// Shown when a language file could not be fetched.
pub const NO_LANGUAGE: &str = "Can't load the language. Check your connection.";
/// Shown after keys and buttons were reset to their defaults.
pub const RESET: &str = "All keys and buttons are as they were at first.";
/// Shown when the pressed key cannot be assigned.
pub const TAKEN_KEY: &str = "{key} belongs to the page. Press another key, or Escape to cancel.";

/// The name of an action in the settings.
pub fn action(action: Action) -> &'static str {
    say(match action {
        Action::Up => "Up, jump",
        Action::Left => "Left",
        Action::Down => "Down",
        Action::Right => "Right",
        Action::Fire => "Throw, pull",
        Action::Make => "Drop marbles, spray sparks",
        Action::Hold => "Grab",
        Action::Agitate => "Shake",
        Action::Clear => "Clear",
        Action::Hero => "Choose the hero",
        Action::Minion => "Choose the minion",
        Action::Platform => "Choose the platform",
        Action::Team => "Change the team",
        Action::Emote => "Emotes",
        Action::Again => "Play again",
        Action::Mute => "Sound off / on",
        Action::FullScreen => "Full screen",
        Action::Edit => "Play / edit the scene",
        Action::Clip => "Keep the last 20 seconds",
    })
}

/// The emotes, clockwise from the top of their wheel.
pub const EMOTES: [&str; jostle_protocol::limits::EMOTES as usize] =
    ["Hello", "Haha", "Love it", "Well done", "Wow", "What?", "Oh no", "Grr"];

/// The name of an emote.
pub fn emote(emote: u8) -> &'static str {
    say(EMOTES.get(usize::from(emote)).copied().unwrap_or_default())
}

/// The name of a gamepad button, as labelled on the most common gamepads.
pub fn pad_button(button: u8) -> &'static str {
    const NAMES: [&str; 10] = ["A", "B", "X", "Y", "LB", "RB", "LT", "RT", "Back", "Start"];
    NAMES.get(usize::from(button)).copied().unwrap_or("\u{2013}")
}

pub fn press_key(asked: Action) -> String {
    fill(
        "Press the key for \u{201c}{action}\u{201d}, or Escape to cancel.",
        &[("action", action(asked))],
    )
}

pub fn press_button(asked: Action) -> String {
    let sentence =
        "Press the button for \u{201c}{action}\u{201d} on the gamepad, or Escape to cancel.";
    fill(say(sentence), &[("action", action(asked))])
}

/// Reports the key or button assigned to an action.
pub fn now_does(key: &str, chosen: Action) -> String {
    fill("{key}: {action}.", &[("key", key), ("action", action(chosen))])
}

/// Reports that an action moved to another key or button.
pub fn swapped(moved: Action, key: &str) -> String {
    fill(" {action} is now on {key}.", &[("action", action(moved)), ("key", key)])
}

/// Shown in the sound panel.
pub const NO_SOUND: &str = "This browser can't play sound here. Captions still work.";

/// The label of the speaker button for screen readers.
pub fn speaker(on: bool, volume: u8) -> String {
    match on {
        true => fill("Sound, volume {volume} %", &[("volume", &volume.to_string())]),
        false => say("Sound, off").to_owned(),
    }
}

pub fn percent(share: u8) -> String {
    format!("{share} %")
}

/// The caption of a sound at this multiple of its default pitch.
pub fn caption(sound: Sound, pitch: f32) -> &'static str {
    say(match sound {
        Sound::Wood | Sound::Rubber if pitch < 0.75 => "thump",
        Sound::Wood => "knock",
        Sound::Rubber => "thud",
        Sound::Glass => "click",
        Sound::Throw => "whoosh",
        Sound::Burst => "splash",
        Sound::Spawn => "pop",
        Sound::Break => "crash",
        Sound::Goal => "goal",
        Sound::Out => "out",
        Sound::Lead => "new leader",
        Sound::Count | Sound::Late => "countdown",
        Sound::Go => "go",
        Sound::Won => "fanfare",
        Sound::Lost => "falling notes",
    })
}

/// How long ago something happened, in words.
pub fn ago(seconds: f64) -> String {
    let (count, one, many) = match seconds {
        s if s < 60.0 => return say("just now").to_owned(),
        s if s < 3600.0 => (s / 60.0, "1 minute ago", "{count} minutes ago"),
        s if s < 86_400.0 => (s / 3600.0, "1 hour ago", "{count} hours ago"),
        s => (s / 86_400.0, "1 day ago", "{count} days ago"),
    };
    match count.floor() {
        1.0 => say(one).to_owned(),
        count => fill(many, &[("count", &count.to_string())]),
    }
}

pub fn size(bytes: u64) -> String {
    match bytes {
        0..1000 => format!("{bytes} B"),
        1000..1_000_000 => fill("{count} kB", &[("count", &(bytes / 1000).to_string())]),
        _ => fill("{count} MB", &[("count", &format!("{:.1}", bytes as f64 / 1e6))]),
    }
}

/// Shown while the server answers requests, but no socket opens.
pub const NO_SOCKET: Card = passing(card(
    "Joining",
    "The server answers, but no game connection opens, neither a WebSocket nor one over HTTP. Switch \
     off the private relay, VPN or proxy for this site, or ask its operator to pass on WebSocket \
     upgrades. Still trying.",
    "Back to the lobby",
    CardAction::Lobby,
));

/// Shown when a connection over HTTP has opened because no WebSocket does.
pub const OVER_HTTP: &str = "WebSockets are blocked here, so the game goes over HTTP. If it feels slow, switch off the \
     private relay, VPN or proxy for this site.";

/// The card shown while joining, depending on the number of attempts so far.
pub fn connecting(attempts: u32) -> Card {
    let text = match attempts {
        0..=1 => "Joining the room\u{2026}",
        _ => "No answer from the server yet. Still trying.",
    };
    passing(card("Joining", text, "Back to the lobby", CardAction::Lobby))
}

/// The card for a session that was refused or ended; `None` if the cause is temporary and the page should keep
/// retrying.
pub fn refused(refusal: Refusal) -> Option<Card> {
    use CardAction::{Again, Lobby, Reload};
    let (title, button, action) = match refusal {
        Refusal::Version => ("Update needed", "Reload", Reload),
        Refusal::RoomFull => {
            let full = card("Room full", refusal.message(), "Find another room", Lobby);
            return Some(card_or(full, "Watch", CardAction::Watch));
        }
        Refusal::NoSuchRoom => return Some(elsewhere("No such room", refusal.message())),
        Refusal::ServerFull => ("Server full", "See the rooms", Lobby),
        Refusal::TooManySockets => ("Too many connections", "Try again", Again),
        Refusal::Flood => ("Slow down", "Rejoin", Again),
        Refusal::Silent => ("Are you there?", "Rejoin", Again),
        Refusal::Replaced => ("Playing in another tab", "Play here", Again),
        Refusal::BadHello
        | Refusal::BadToken
        | Refusal::Closing
        | Refusal::Moved
        | Refusal::Moving => return None,
        Refusal::Kicked => ("You were removed", "See the rooms", Lobby),
        Refusal::RoomClosed | Refusal::TooCostly => ("Room closed", "See the rooms", Lobby),
        Refusal::TooManySpectators => ("Too many are watching", "Find another room", Lobby),
        Refusal::GaveWay => ("Your spot is taken", "Rejoin", Again),
        Refusal::RoomFailed => ("Room crashed", "Go to the lobby", Lobby),
        Refusal::BadMessage => ("Something went wrong", "Reload", Reload),
    };
    Some(card(title, refusal.message(), button, action))
}

/// Reports that a clip was stored under a name, or saved as a file.
pub fn clip(name: &str) -> &'static str {
    if name.is_empty() { "Clip saved as a file." } else { "Clip kept." }
}

/// Explains why there is no clip.
pub fn no_clip(refusal: ClipRefusal) -> &'static str {
    match refusal {
        ClipRefusal::Off => "This server keeps no clips.",
        ClipRefusal::TooMany => "That was too soon after the last clip.",
        ClipRefusal::Failed => "The clip couldn't be kept.",
    }
}

pub const CLIP_OF_SPECTATOR: &str = "Only players can keep clips.";

/// The number of spectators in a room, for the lobby.
pub fn watching(spectators: u32) -> String {
    match spectators {
        0 => String::new(),
        count => fill(", {count} watching", &[("count", &count.to_string())]),
    }
}

/// The refusal for a close code, used if the refusal's message was lost.
pub fn refusal_of_close(code: u16) -> Option<Refusal> {
    match code {
        // Several refusals share these codes.
        1001 | 1008 => None,
        // These conditions resolve themselves.
        4010 | 4011 => None,
        code if BAD_MESSAGE_CODES.contains(&code) => Some(Refusal::BadMessage),
        code => Refusal::ALL.into_iter().find(|refusal| refusal.close_code() == code),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_protocol::replay::Problem;

    #[test]
    fn only_refusals_that_pass_by_themselves_have_no_notice() {
        for refusal in Refusal::ALL {
            let stops = refused(refusal).is_some_and(|notice| !notice.passing);
            let passes = matches!(
                refusal,
                Refusal::BadHello
                    | Refusal::BadToken
                    | Refusal::Closing
                    | Refusal::Moved
                    | Refusal::Moving
            );
            assert_eq!(stops, !passes, "{refusal:?}");
        }
    }

    #[test]
    fn a_player_without_a_room_is_offered_others() {
        for notice in [refused(Refusal::NoSuchRoom).expect("an end"), ROOM_GONE] {
            assert_eq!(notice.action, CardAction::Play);
            assert_eq!(notice.other.map(|(_, action)| action), Some(CardAction::Lobby));
        }
    }

    #[test]
    fn times_and_sizes_read_naturally() {
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
        let error = ReplayError { offset: 9, problem: Problem::CutOff };
        let cut = |ticks| cut_replay(ticks, &error).text;
        assert!(cut(600).ends_with("The first 10 seconds are intact."));
        assert!(cut(60).ends_with("The first second is intact."));
    }

    #[test]
    fn close_codes_that_name_one_refusal_are_understood() {
        assert_eq!(refusal_of_close(4001), Some(Refusal::RoomFull));
        assert_eq!(refusal_of_close(1006), None);
        assert_eq!(refusal_of_close(1001), None, "browsers say so too when the page goes");
    }
}
