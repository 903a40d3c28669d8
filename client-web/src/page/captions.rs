//! Captions: a word or two for each sound, for players who cannot hear it. Their rate is limited so that a pile of
//! marbles does not drown out the rest.

use crate::page::strings;
use crate::sound::mixer::Voice;
use std::collections::VecDeque;

/// Maximum number of captions shown at once; the oldest are removed first.
const LINES_MAX: usize = 3;
/// How long a caption is shown, milliseconds.
const SHOWN_MS: f64 = 1800.0;
/// Minimum time before the same words are repeated, milliseconds.
const REPEAT_MS: f64 = 1200.0;
/// Minimum time between captions, except for sounds that concern the whole room, milliseconds.
const APART_MS: f64 = 350.0;
/// Minimum gain of impact sounds that get a caption.
const GAIN_MIN: f32 = 0.12;
/// Minimum pan of sounds whose caption names a side.
const SIDE_PAN: f32 = 0.3;

#[derive(Debug, Default)]
pub struct Captions {
    /// The captions on display, oldest first, numbered from 1.
    pub lines: VecDeque<Caption>,
    count: usize,
    newest_ms: Option<f64>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Caption {
    pub number: usize,
    pub text: String,
    since_ms: f64,
}

impl Captions {
    /// Adds captions for voices that start now, and removes expired ones.
    pub fn note(&mut self, now_ms: f64, voices: &[Voice]) {
        self.lines.retain(|line| now_ms - line.since_ms < SHOWN_MS);
        for voice in voices {
            let is_of_room = voice.sound.rank() == 2;
            let is_soon = self.newest_ms.is_some_and(|newest| now_ms - newest < APART_MS);
            let is_soft = voice.sound.rank() == 0 && voice.gain < GAIN_MIN;
            if is_soft || is_soon && !is_of_room {
                continue;
            }
            self.add(now_ms, caption(voice));
        }
    }

    fn add(&mut self, now_ms: f64, text: String) {
        let is_repeated = |line: &Caption| line.text == text && now_ms - line.since_ms < REPEAT_MS;
        if self.lines.iter().any(is_repeated) {
            return;
        }
        if self.lines.len() == LINES_MAX {
            self.lines.pop_front();
        }
        self.count += 1;
        self.newest_ms = Some(now_ms);
        self.lines.push_back(Caption { number: self.count, text, since_ms: now_ms });
    }
}

fn caption(voice: &Voice) -> String {
    let word = strings::caption(voice.sound, voice.pitch);
    match voice.pan {
        pan if pan < -SIDE_PAN => format!("{word} (left)"),
        pan if pan > SIDE_PAN => format!("{word} (right)"),
        _ => word.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sound::cue::Sound;

    fn voice(sound: Sound, pan: f32) -> Voice {
        Voice { slot: 0, sound, pitch: 1.0, stretch: 1.0, gain: 0.5, pan }
    }

    fn texts(captions: &Captions) -> Vec<&str> {
        captions.lines.iter().map(|line| &*line.text).collect()
    }

    #[test]
    fn captions_name_the_side_and_go_after_a_while() {
        let mut captions = Captions::default();
        captions.note(0.0, &[voice(Sound::Burst, -0.7)]);
        captions.note(500.0, &[voice(Sound::Goal, 0.0)]);
        assert_eq!(texts(&captions), ["splash (left)", "goal"]);
        captions.note(1800.0, &[]);
        assert_eq!(texts(&captions), ["goal"]);
    }

    #[test]
    fn many_sounds_have_few_captions_but_a_goal_always_has_one() {
        let mut captions = Captions::default();
        let sounds = [Sound::Wood, Sound::Rubber, Sound::Glass, Sound::Spawn];
        let mut shown = 0;
        for frame in 0..120 {
            let before = captions.count;
            let pan = f32::from(i16::from(frame % 3 == 0));
            captions.note(f64::from(frame) * 1000.0 / 60.0, &sounds.map(|sound| voice(sound, pan)));
            shown += captions.count - before;
            assert!(captions.lines.len() <= LINES_MAX);
        }
        assert!((3..=6).contains(&shown), "{shown} in two seconds");
        captions.note(2000.0, &[voice(Sound::Goal, 0.0)]);
        assert_eq!(texts(&captions).last(), Some(&"goal"));
    }

    #[test]
    fn soft_strikes_have_no_caption() {
        let mut captions = Captions::default();
        captions.note(0.0, &[Voice { gain: 0.1, ..voice(Sound::Wood, 0.0) }]);
        assert!(captions.lines.is_empty());
    }
}
