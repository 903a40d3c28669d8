//! Keys: the ones that belong to the page, and to a replay.

use crate::page::app::App;
use crate::page::dialogs::Layer;
use crate::page::event::{Effect, Focus, Key};
use crate::page::page_action::KeyUse;
use crate::page::screen::Screen;
use crate::replay::player::ReplayPlayer;

impl App {
    pub(super) fn key_down(&mut self, key: &Key) {
        if key.code == "Escape" && self.notice().is_some_and(|card| card.code.is_some()) {
            self.visit.dialogs.card = None;
            return self.ctx.request(Effect::PreventDefault);
        }
        self.settings.note_cap(key);
        if self.top() == Layer::Settings {
            if self.settings.key_down(&mut self.ctx, key) {
                return self.ctx.request(Effect::PreventDefault);
            }
            if key.code == "Escape" {
                self.toggle_settings();
                return self.ctx.request(Effect::PreventDefault);
            }
        }
        let top = self.top();
        match &mut self.screen {
            Screen::Game(game) => {
                let used = game.key_down(&mut self.ctx, &self.settings.keys, top, key);
                if used != KeyUse::Unused {
                    self.ctx.request(Effect::PreventDefault);
                }
                if let KeyUse::Action(action) = used {
                    self.click(action, "");
                }
            }
            Screen::Replay(_) => self.replay_key_down(key),
            Screen::Edit(_) => self.editor_key_down(key),
            _ => {}
        }
    }

    fn replay_key_down(&mut self, key: &Key) {
        let top = self.top();
        match (key.code.as_str(), key.letter.as_str()) {
            ("F2", _) if !key.repeat => self.screen.with_replay(ReplayPlayer::toggle_bounds),
            (_, "?") if !key.repeat => self.toggle_help(),
            ("Escape", _) if top == Layer::Help => self.toggle_help(),
            _ if key.modified || top != Layer::Page || is_used_by_focus(key) => return,
            (_, " ") if key.repeat => {}
            (_, "m" | "M") => {
                if !key.repeat {
                    self.sound.toggle_mute(&mut self.ctx);
                }
            }
            (_, letter) => {
                if !self.screen.control_replay(letter) {
                    return;
                }
            }
        }
        self.ctx.request(Effect::PreventDefault);
    }
}

/// Whether the element with the focus has a use for a key.
fn is_used_by_focus(key: &Key) -> bool {
    let letter = key.letter.as_str();
    match key.focus {
        Focus::Button => matches!(letter, " " | "Enter"),
        Focus::Field => {
            let moves = letter.starts_with("Arrow") || letter.starts_with("Page");
            moves || matches!(letter, "Home" | "End")
        }
        Focus::Elsewhere => false,
    }
}
