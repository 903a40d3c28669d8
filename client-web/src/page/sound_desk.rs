//! Sound: its volume, its captions, and when it plays, which is after the first click or key press, in games and
//! replays, while the page is visible.

use crate::page::captions::Captions;
use crate::page::context::Context;
use crate::page::event::{Effect, Event, PointerChange};
use crate::page::page_action::PageAction;
use crate::page::storage::{self, Storage};
use crate::sound::cue::Cue;
use crate::sound::mixer::{Ear, Mixer, Voice};
use crate::sound::task::{SoundEvent, SoundTask};
use crate::view::frame::View;

/// Default volume, percent.
const VOLUME: u8 = 40;

pub struct SoundDesk {
    pub volume: u8,
    pub muted: bool,
    pub captioned: bool,
    /// Whether the browser does not support sound.
    pub missing: bool,
    pub captions: Captions,
    pub mixer: Mixer,
    /// Whether the page is hidden.
    pub hidden: bool,
    /// Whether a click or key press has already allowed sound on this page.
    pub allowed: bool,
    /// Whether sound should play now.
    pub awake: bool,
}

/// A click or key press, after which browsers allow sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gesture {
    None,
    /// A gesture that leads from the lobby into a game.
    IntoGame,
    /// Any other gesture. In the lobby it makes no sound.
    Other,
}

impl Gesture {
    /// Whether an event counts as a user gesture, which browsers require before sound.
    pub fn of(event: &Event) -> Gesture {
        let is_one = match event {
            Event::PlayClicked(_) | Event::SceneClicked(..) => return Gesture::IntoGame,
            Event::Clicked(PageAction::Go, _) => return Gesture::IntoGame,
            Event::Clicked(..) | Event::KeyDown(_) | Event::ToolPressed(..) => true,
            // Browsers count the end of a touch as a gesture, not its beginning.
            Event::Pointer(pointer) => {
                matches!(pointer.change, PointerChange::Down | PointerChange::Up)
            }
            Event::Sound(SoundEvent::VolumeChosen(_) | SoundEvent::MuteChosen(_)) => true,
            _ => false,
        };
        if is_one { Gesture::Other } else { Gesture::None }
    }
}

impl SoundDesk {
    /// The settings from the previous visit.
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

    /// Applies the stored values.
    pub fn recall(&mut self, storage: &Storage) {
        let (volume, muted, captioned) = storage.sound();
        self.volume = volume.filter(|volume| *volume <= 100).unwrap_or(self.volume);
        (self.muted, self.captioned) = (muted, captioned);
    }

    /// The gain for the chosen volume. Loudness is perceived in ratios, so the linear scale is squared.
    pub fn gain(&self) -> f32 {
        let share = f32::from(self.volume) / 100.0;
        share * share
    }

    /// Whether the player's settings allow sound.
    pub fn is_on(&self) -> bool {
        !self.muted && self.volume > 0 && !self.missing
    }

    /// The voices of a frame, for which captions are recorded.
    pub fn mix(&mut self, now_ms: f64, cues: Vec<Cue>, ear: &Ear) -> Vec<Voice> {
        cues.into_iter().for_each(|cue| self.mixer.hear(cue));
        let voices = self.mixer.frame(now_ms / 1000.0, ear);
        if self.captioned {
            self.captions.note(now_ms, &voices);
        }
        voices
    }

    pub fn update(&mut self, ctx: &mut Context, event: SoundEvent) {
        let storage = &mut ctx.storage;
        match event {
            SoundEvent::VolumeChosen(volume) => {
                self.volume = volume.min(100);
                self.muted = false;
                storage.keep(storage::VOLUME, &self.volume.to_string());
                storage.keep_flag(storage::MUTED, false);
            }
            SoundEvent::MuteChosen(muted) => {
                self.muted = muted;
                storage.keep_flag(storage::MUTED, muted);
            }
            SoundEvent::CaptionsChosen(on) => {
                self.captioned = on;
                self.captions = Captions::default();
                storage.keep_flag(storage::CAPTIONS, on);
            }
            SoundEvent::Hidden(hidden) => return self.hidden = hidden,
            SoundEvent::Missing => return self.missing = true,
            SoundEvent::Blocked => return (self.allowed, self.awake) = (false, false),
        }
        self.set_gain(ctx);
    }

    /// Applies the chosen volume.
    pub fn set_gain(&self, ctx: &mut Context) {
        if self.awake && self.is_on() {
            ctx.request(Effect::Sound(SoundTask::Gain(self.gain())));
        }
    }

    pub fn toggle_mute(&mut self, ctx: &mut Context) {
        self.update(ctx, SoundEvent::MuteChosen(!self.muted));
    }

    /// Starts or stops the sound player as the current screen requires.
    pub fn settle(&mut self, ctx: &mut Context, has_sound: bool, gesture: Gesture) {
        let may_sound = has_sound || gesture == Gesture::IntoGame;
        let wanted = may_sound && self.is_on() && !self.hidden;
        if wanted == self.awake {
            return;
        }
        if wanted && (gesture != Gesture::None || self.allowed) {
            (self.allowed, self.awake) = (true, true);
            ctx.request(Effect::Sound(SoundTask::Wake(self.gain())));
        } else if !wanted {
            self.awake = false;
            ctx.request(Effect::Sound(SoundTask::Rest));
        }
    }

    /// Plays the sound cues reported since the previous frame.
    pub fn play(&mut self, ctx: &mut Context, cues: Vec<Cue>, view: &View) {
        let voices = self.mix(ctx.now_ms, cues, &Ear::of(view));
        if self.awake && !voices.is_empty() {
            ctx.request(Effect::Sound(SoundTask::Start(voices)));
        }
    }

    /// Discards the sounds of the previous screen.
    pub fn end(&mut self) {
        self.mixer = Mixer::default();
        self.captions = Captions::default();
    }
}
