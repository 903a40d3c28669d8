//! Keys of the page; those of a screen are in its own table.

use crate::page::app::App;
use crate::page::dialogs::Layer;
use crate::page::event::{Effect, Key};
use crate::page::page_action::KeyUse;
use crate::page::screen::Screen;

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
        let used = match &mut self.screen {
            Screen::Game(game) => game.key_down(&mut self.ctx, &self.settings.keys, top, key),
            Screen::Replay(replay) => replay.key_down(top, key),
            Screen::Edit(_) => return self.editor_key_down(key),
            _ => KeyUse::Unused,
        };
        if used != KeyUse::Unused {
            self.ctx.request(Effect::PreventDefault);
        }
        if let KeyUse::Action(action) = used {
            self.click(action, "");
        }
    }
}
