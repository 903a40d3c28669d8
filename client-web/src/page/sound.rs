//! When there is sound: from a click or key on, in games and replays, while the page is seen.

use crate::page::app::{Activity, App};
use crate::page::captions::Captions;
use crate::page::event::{Effect, Event, PointerChange};
use crate::page::page_action::PageAction;
use crate::page::sound_desk::Gesture;
use crate::page::storage;
use crate::sound::mixer::{Ear, Mixer};
use crate::sound::task::{SoundEvent, SoundTask};

impl App {
    pub(super) fn on_sound(&mut self, event: SoundEvent) {
        let (desk, storage) = (&mut self.sound, &mut self.ctx.storage);
        match event {
            SoundEvent::VolumeChosen(volume) => {
                desk.volume = volume.min(100);
                desk.muted = false;
                storage.keep(storage::VOLUME, &desk.volume.to_string());
                storage.keep_flag(storage::MUTED, false);
            }
            SoundEvent::MuteChosen(muted) => {
                desk.muted = muted;
                storage.keep_flag(storage::MUTED, muted);
            }
            SoundEvent::CaptionsChosen(on) => {
                desk.captioned = on;
                desk.captions = Captions::default();
                storage.keep_flag(storage::CAPTIONS, on);
            }
            SoundEvent::Hidden(hidden) => {
                desk.hidden = hidden;
                return self.release_input();
            }
            SoundEvent::Missing => {
                desk.missing = true;
                return;
            }
            SoundEvent::Blocked => {
                (desk.allowed, desk.awake) = (false, false);
                return;
            }
        }
        self.set_gain();
    }

    /// Plays as loudly as is chosen.
    pub(super) fn set_gain(&mut self) {
        if self.sound.awake && self.sound.is_on() {
            self.ctx.request(Effect::Sound(SoundTask::Gain(self.sound.gain())));
        }
    }

    pub(super) fn toggle_mute(&mut self) {
        self.on_sound(SoundEvent::MuteChosen(!self.sound.muted));
    }

    /// How an event counts for a browser that waits for one, see [`Gesture`].
    pub(super) fn gesture(&self, event: &Event) -> Gesture {
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

    fn has_sound(&self) -> bool {
        matches!(self.activity, Activity::Game(_) | Activity::Replay(_))
    }

    /// Wakes the player, or lets it rest, as the present state asks for.
    pub(super) fn settle_sound(&mut self, gesture: Gesture) {
        let may_sound = self.has_sound() || gesture == Gesture::IntoGame;
        let desk = &mut self.sound;
        let wanted = may_sound && desk.is_on() && !desk.hidden;
        if wanted == desk.awake {
            return;
        }
        if wanted && (gesture != Gesture::None || desk.allowed) {
            (desk.allowed, desk.awake) = (true, true);
            self.ctx.request(Effect::Sound(SoundTask::Wake(self.sound.gain())));
        } else if !wanted {
            desk.awake = false;
            self.ctx.request(Effect::Sound(SoundTask::Rest));
        }
    }

    /// Mixes what was heard since the last frame.
    pub(super) fn mix(&mut self) {
        let (cues, view) = match &mut self.activity {
            Activity::Game(game) if !game.is_frozen() => (game.take_cues(), *game.view()),
            Activity::Replay(replay) => (replay.take_cues(), replay.view),
            _ => return,
        };
        let voices = self.sound.mix(self.ctx.now_ms, cues, &Ear::of(&view));
        if self.sound.awake && !voices.is_empty() {
            self.ctx.request(Effect::Sound(SoundTask::Start(voices)));
        }
    }

    /// Forgets the sounds of the last screen.
    pub(super) fn end_sound(&mut self) {
        self.sound.mixer = Mixer::default();
        self.sound.captions = Captions::default();
        self.panels.sound = false;
    }
}
