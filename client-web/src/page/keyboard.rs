//! Keys: the ones that belong to the world, to the page, and to a replay.

use crate::input::action::Action;
use crate::page::app::App;
use crate::page::dialogs::Layer;
use crate::page::event::{Effect, Focus, Key};
use crate::page::game::GameScreen;
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
        match &self.screen {
            Screen::Game(_) => self.game_key_down(key),
            Screen::Replay(_) => self.replay_key_down(key),
            Screen::Edit(_) => self.editor_key_down(key),
            _ => {}
        }
    }

    pub(super) fn key_up(&mut self, key: &Key) {
        let picked = self.visit.wheel_key_up(&key.code);
        picked.into_iter().for_each(|emote| self.emote(emote));
        self.screen.with_game(&mut self.ctx, |game, ctx| {
            game.controls.key_up(&key.code);
            game.send_due(ctx);
        });
    }

    fn game_key_down(&mut self, key: &Key) {
        // No field of the page has a use for function keys.
        let is_function = matches!(key.code.as_str(), "F2" | "F3" | "F4");
        if key.focus == Focus::Field && !is_function {
            return;
        }
        // With these held, the system takes keys whose release never comes.
        if key.modified {
            return self.release_input();
        }
        let used = self.visit.wheel_key_down(key);
        if self.use_wheel(used) {
            return self.ctx.request(Effect::PreventDefault);
        }
        let opens = self.settings.keys.actions(&key.code, &key.letter).contains(&Action::Emote);
        if opens && self.top() == Layer::Page {
            if !key.repeat {
                self.toggle_wheel();
                self.visit.wheel.iter_mut().for_each(|wheel| wheel.key = Some(key.code.clone()));
            }
            return self.ctx.request(Effect::PreventDefault);
        }
        if let Some(command) = self.command_of(key) {
            self.ctx.request(Effect::PreventDefault);
            if !key.repeat {
                command(self);
            }
            return;
        }
        let presses_button =
            key.focus == Focus::Button && matches!(key.code.as_str(), "Space" | "Enter");
        if !presses_button && self.top() == Layer::Page && self.world_key_down(key) {
            self.ctx.request(Effect::PreventDefault);
        }
    }

    /// Presses what a key means to the world; `false` if that is nothing. A spectator follows a player with a digit, in
    /// the order of the list.
    fn world_key_down(&mut self, key: &Key) -> bool {
        if self.screen.game().is_some_and(GameScreen::watches) {
            let Ok(number) = key.letter.parse::<usize>() else { return false };
            let ranking =
                self.screen.replica().map_or(Vec::new(), |replica| replica.room.ranking());
            let seat = number.checked_sub(1).and_then(|index| ranking.get(index));
            let seat = seat.map(|player| player.seat);
            if !key.repeat {
                self.screen.with_game(&mut self.ctx, |game, _| game.follow_player(seat));
            }
            return true;
        }
        let buttons = self.settings.keys.buttons(&key.code, &key.letter);
        let known = buttons.0 != 0;
        if known && !key.repeat {
            self.screen.with_game(&mut self.ctx, |game, ctx| {
                game.controls.key_down(&key.code, buttons);
                game.send_due(ctx);
            });
        }
        known
    }

    /// Command of a key to the page itself.
    fn command_of(&self, key: &Key) -> Option<fn(&mut App)> {
        let actions = self.settings.keys.actions(&key.code, &key.letter);
        let is_for = |action| self.top() == Layer::Page && actions.contains(&action);
        match (key.code.as_str(), key.letter.as_str(), self.top()) {
            _ if is_for(Action::Again)
                && key.focus != Focus::Button
                && self.screen.is_round_over() =>
            {
                Some(App::go_on)
            }
            _ if is_for(Action::Edit) && self.screen.game().is_some_and(GameScreen::is_in_page) => {
                Some(App::toggle_edit)
            }
            _ if is_for(Action::Clip) => Some(|app| {
                app.screen.with_game(&mut app.ctx, |game, ctx| game.connection.keep_clip(ctx))
            }),
            (_, "h" | "H", Layer::Page) if self.screen.game().is_some_and(GameScreen::watches) => {
                Some(|app| app.panels.clean = !app.panels.clean)
            }
            ("Escape", _, Layer::Page)
                if self.screen.game().is_some_and(|game| game.showing.is_some()) =>
            {
                Some(|app| app.screen.with_game(&mut app.ctx, GameScreen::toggle_highlights))
            }
            _ if is_for(Action::FullScreen) => {
                Some(|app| app.settings.toggle_full_screen(&mut app.ctx))
            }
            _ if is_for(Action::Mute) && self.screen.may_mute() => {
                Some(|app| app.sound.toggle_mute(&mut app.ctx))
            }
            ("F2", ..) => {
                Some(|app| app.screen.with_game(&mut app.ctx, |game, _| game.toggle_bounds()))
            }
            ("F3", ..) => Some(|app| app.panels.figures = !app.panels.figures),
            ("F4", ..) => Some(App::toggle_network),
            (_, "?", _) | ("Escape", _, Layer::Help) => Some(App::toggle_help),
            ("Escape", _, Layer::Ask) => Some(|app| app.visit.dialogs.question = None),
            _ => None,
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
