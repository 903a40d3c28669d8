//! Names of replays: `<scene>-<room code>-<UTC yyyymmdd-hhmmss>`. They sort by time within a room and cannot escape
//! their directory. Clips' names end in `-clip` or `-unlisted`.

use jostle_protocol::limits::REPLAY_NAME_BYTES_MAX;
use time::OffsetDateTime;

/// Maximum number of files whose names differ only by a number.
const REPLAY_NAMESAKES_MAX: u32 = 1000;

pub const ENDING: &str = ".jostle";
/// Ending of clips' names, before any number.
pub const CLIP_ENDING: &str = "-clip";
/// Ending of the names of clips from private rooms, which are never listed.
pub const UNLISTED_ENDING: &str = "-unlisted";

/// The name of a replay, without a number.
pub fn name(scene: &str, room: &str, unix_s: u64) -> String {
    format!("{}-{}-{}", word(scene), word(room), utc(unix_s))
}

/// The name itself, followed by numbered variants.
pub fn numbered(name: &str) -> impl Iterator<Item = String> + '_ {
    let others = (2..=REPLAY_NAMESAKES_MAX).map(move |number| format!("{name}-{number}"));
    std::iter::once(name.to_owned()).chain(others)
}

/// Returns whether this is the name of a clip from a private room. Recordings' names end in a time.
pub fn is_unlisted(name: &str) -> bool {
    has_ending(name, UNLISTED_ENDING)
}

/// Returns whether this is the name of a clip from any room.
pub fn is_clip(name: &str) -> bool {
    is_unlisted(name) || has_ending(name, CLIP_ENDING)
}

/// Returns whether a name has this ending, ignoring any number after it.
fn has_ending(name: &str, ending: &str) -> bool {
    let plain = name.trim_end_matches(|char: char| char.is_ascii_digit());
    name.ends_with(ending) || plain.trim_end_matches('-').ends_with(ending)
}

/// Returns whether this could be the name of a replay.
pub fn is_name(text: &str) -> bool {
    (1..=REPLAY_NAME_BYTES_MAX).contains(&text.len()) && text.bytes().all(is_allowed)
}

fn is_allowed(byte: u8) -> bool {
    byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-'
}

/// Replaces everything except lower-case letters, digits and dashes with dashes.
fn word(text: &str) -> String {
    let allowed = |char: char| u8::try_from(char).is_ok_and(is_allowed);
    text.to_lowercase().chars().map(|char| if allowed(char) { char } else { '-' }).collect()
}

/// Seconds since 1970 as `yyyymmdd-hhmmss`.
fn utc(unix_s: u64) -> String {
    let [year, month, day, hour, minute, second] = calendar(unix_s);
    format!("{year:04}{month:02}{day:02}-{hour:02}{minute:02}{second:02}")
}

/// Year, month, day, hour, minute and second of a time in seconds since 1970, UTC. Times after the year 9999 are
/// clamped to its last second, so that printed times keep the same length.
pub fn calendar(unix_s: u64) -> [i32; 6] {
    let unix_s = unix_s.min(253_402_300_799) as i64;
    let time = OffsetDateTime::from_unix_timestamp(unix_s).expect("a second before the year 10000");
    let [month, day, hour, minute, second] =
        [u8::from(time.month()), time.day(), time.hour(), time.minute(), time.second()]
            .map(i32::from);
    [time.year(), month, day, hour, minute, second]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_dates() {
        for (unix_s, text) in [
            (0, "19700101-000000"),
            (951_782_399, "20000228-235959"),
            (951_782_400, "20000229-000000"),
            (1_078_099_199, "20040229-235959"),
            (1_735_689_599, "20241231-235959"),
            (1_735_689_600, "20250101-000000"),
            (4_107_542_400, "21000301-000000"),
            (u64::MAX, "99991231-235959"),
        ] {
            assert_eq!(utc(unix_s), text);
        }
    }

    #[test]
    fn names_hold_nothing_but_letters_digits_and_dashes() {
        assert_eq!(name("arena", "k7f3q2", 0), "arena-k7f3q2-19700101-000000");
        for scene in ["My Scene", "../../etc/passwd", "ünïcode", "a.b", "", &"x".repeat(32)] {
            let name = name(scene, &"r".repeat(32), 7);
            assert!(is_name(&name), "{name}");
            assert!(numbered(&name).all(|name| is_name(&name)));
        }
        for text in ["", "a/b", "a.b", "..", "A", "a b", "%61", "é", &"a".repeat(97)] {
            assert!(!is_name(text), "{text}");
        }
    }

    #[test]
    fn clips_are_known_by_their_names_and_so_are_those_of_private_rooms() {
        for (scene, room) in [("arena", "k7f3q2"), ("unlisted", "unlisted"), ("a", "clip")] {
            let plain = name(scene, room, 7);
            assert!(numbered(&plain).all(|name| !is_clip(&name)));
            assert!(numbered(&(plain.clone() + CLIP_ENDING)).all(|name| is_clip(&name)));
            assert!(numbered(&(plain.clone() + CLIP_ENDING)).all(|name| !is_unlisted(&name)));
            let unlisted = plain + UNLISTED_ENDING;
            assert!(numbered(&unlisted).all(|name| is_unlisted(&name) && is_clip(&name)));
        }
        let longest = name(&"s".repeat(32), &"r".repeat(32), 7) + UNLISTED_ENDING;
        assert!(numbered(&longest).all(|name| is_name(&name)));
    }

    #[test]
    fn numbers_follow_the_plain_name() {
        let names: Vec<_> = numbered("a").take(3).collect();
        assert_eq!(names, ["a", "a-2", "a-3"]);
        assert_eq!(numbered("a").count(), REPLAY_NAMESAKES_MAX as usize);
    }
}
