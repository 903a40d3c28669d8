//! The state of sound: how loud it is, whether there is some, and captions.

use crate::page::captions::Captions;
use crate::page::storage::Storage;
use crate::sound::cue::Cue;
use crate::sound::mixer::{Ear, Mixer, Voice};

/// Volume of the first visit, percent.
const VOLUME: u8 = 40;

pub struct SoundDesk {
    pub volume: u8,
    pub muted: bool,
    pub captioned: bool,
    /// The browser has no sound for pages.
    pub missing: bool,
    pub captions: Captions,
    pub mixer: Mixer,
    /// The page is hidden.
    pub hidden: bool,
    /// The player made sound before, which a click allowed.
    pub allowed: bool,
    /// It is to sound now.
    pub awake: bool,
}

/// A click or key, after which browsers allow sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gesture {
    None,
    /// It leads from the lobby into a game.
    IntoGame,
    /// Any other. In the lobby it makes no sound.
    Other,
}

impl SoundDesk {
    /// As it was left at the last visit.
    pub fn new(storage: &Storage) -> SoundDesk {
        let mut desk = SoundDesk {
            volume: VOLUME,
            muted: false,
            captioned: false,
            missing: false,
            captions: Captions::default(),
            mixer: Mixer::default(),
            hidden: false,
            allowed: false,
            awake: false,
        };
        desk.recall(storage);
        desk
    }

    /// Takes what is kept.
    pub fn recall(&mut self, storage: &Storage) {
        let (volume, muted, captioned) = storage.sound();
        self.volume = volume.filter(|volume| *volume <= 100).unwrap_or(self.volume);
        (self.muted, self.captioned) = (muted, captioned);
    }

    /// Amplitude of the volume. Loudness is heard in ratios, so that an even scale needs the square.
    pub fn gain(&self) -> f32 {
        let share = f32::from(self.volume) / 100.0;
        share * share
    }

    /// Whether anything is to be heard, as far as the player decides it.
    pub fn is_on(&self) -> bool {
        !self.muted && self.volume > 0 && !self.missing
    }

    /// The voices of a frame. Their captions are kept.
    pub fn mix(&mut self, now_ms: f64, cues: Vec<Cue>, ear: &Ear) -> Vec<Voice> {
        cues.into_iter().for_each(|cue| self.mixer.hear(cue));
        let voices = self.mixer.frame(now_ms / 1000.0, ear);
        if self.captioned {
            self.captions.note(now_ms, &voices);
        }
        voices
    }
}
