//! When there is sound: from a click or key on, in games and replays, while the page is seen.

use crate::page::captions::Captions;
use crate::page::context::Context;
use crate::page::event::{Effect, Event, PointerChange};
use crate::page::page_action::PageAction;
use crate::page::sound_desk::{Gesture, SoundDesk};
use crate::page::storage;
use crate::sound::cue::Cue;
use crate::sound::mixer::{Ear, Mixer};
use crate::sound::task::{SoundEvent, SoundTask};
use crate::view::frame::View;

impl Gesture {
    /// How an event counts for a browser that waits for one.
    pub fn of(event: &Event) -> Gesture {
        let is_one = match event {
            Event::PlayClicked(_) | Event::SceneClicked(..) => return Gesture::IntoGame,
            Event::Clicked(PageAction::Go, _) => return Gesture::IntoGame,
            Event::Clicked(..) | Event::KeyDown(_) | Event::ToolPressed(..) => true,
            // Browsers count the end of a touch, not its beginning.
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

    /// Plays as loudly as is chosen.
    pub fn set_gain(&self, ctx: &mut Context) {
        if self.awake && self.is_on() {
            ctx.request(Effect::Sound(SoundTask::Gain(self.gain())));
        }
    }

    pub fn toggle_mute(&mut self, ctx: &mut Context) {
        self.update(ctx, SoundEvent::MuteChosen(!self.muted));
    }

    /// Wakes the player, or lets it rest, as the present screen asks for.
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

    /// Plays what was heard since the last frame.
    pub fn play(&mut self, ctx: &mut Context, cues: Vec<Cue>, view: &View) {
        let voices = self.mix(ctx.now_ms, cues, &Ear::of(view));
        if self.awake && !voices.is_empty() {
            ctx.request(Effect::Sound(SoundTask::Start(voices)));
        }
    }

    /// Forgets the sounds of the last screen.
    pub fn end(&mut self) {
        self.mixer = Mixer::default();
        self.captions = Captions::default();
    }
}
