//! Emotes: the wheel for choosing them, and the ones on display.

use jostle_game::Seat;
use jostle_protocol::limits::EMOTES;
use jostle_sim::Vec2;

/// How long an emote is shown, milliseconds.
pub const SHOWN_MS: f64 = 3000.0;

/// An emote over a hero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownEmote {
    pub seat: Seat,
    /// Below [`EMOTES`].
    pub emote: u8,
    pub since_ms: f64,
}

/// The emotes on display, at most one per seat.
#[derive(Debug, Default)]
pub struct ShownEmotes(Vec<ShownEmote>);

impl ShownEmotes {
    /// Shows a player's emote, replacing an earlier one.
    pub fn show(&mut self, now_ms: f64, seat: Seat, emote: u8) {
        self.0.retain(|shown| shown.seat != seat);
        self.0.push(ShownEmote { seat, emote, since_ms: now_ms });
    }

    /// The emotes currently on display, newest last.
    pub fn at(&self, now_ms: f64) -> impl Iterator<Item = &ShownEmote> {
        self.0.iter().filter(move |shown| now_ms - shown.since_ms < SHOWN_MS)
    }
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wheel {
    /// The emote at which the pointer or the stick points.
    pub picked: Option<u8>,
    /// The code of the key that is held to open the wheel, if any; `pad` is set if a gamepad button is held instead.
    pub key: Option<String>,
    pub pad: bool,
}

/// The emote in this direction from the centre, y down. The first is at the top and the others follow clockwise. `None`
/// within the radius `middle`.
pub fn sector(offset: Vec2, middle: f32) -> Option<u8> {
    if offset.length() <= middle {
        return None;
    }
    let turns = offset.x.atan2(-offset.y) / std::f32::consts::TAU;
    Some((turns * f32::from(EMOTES)).round().rem_euclid(f32::from(EMOTES)) as u8 % EMOTES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wheel_begins_at_the_top_and_goes_clockwise() {
        let picked = |x, y| sector(Vec2::new(x, y), 10.0);
        assert_eq!(picked(0.0, -50.0), Some(0));
        assert_eq!(picked(40.0, -40.0), Some(1));
        assert_eq!(picked(50.0, 1.0), Some(2));
        assert_eq!(picked(0.0, 50.0), Some(4));
        assert_eq!(picked(-50.0, 0.0), Some(6));
        assert_eq!(picked(-30.0, -30.0), Some(7));
        assert_eq!(picked(-1.0, -50.0), Some(0), "the seam is within the first");
        assert_eq!(picked(7.0, 7.0), None);
    }

    #[test]
    fn an_emote_is_shown_for_three_seconds_or_until_the_next() {
        let mut shown = ShownEmotes::default();
        shown.show(0.0, Seat(1), 3);
        shown.show(500.0, Seat(2), 4);
        shown.show(1000.0, Seat(1), 5);
        let at = |now_ms| shown.at(now_ms).map(|s| (s.seat.0, s.emote)).collect::<Vec<_>>();
        assert_eq!(at(1000.0), [(2, 4), (1, 5)]);
        assert_eq!(at(3600.0), [(1, 5)]);
        assert_eq!(at(4000.0), []);
    }
}
