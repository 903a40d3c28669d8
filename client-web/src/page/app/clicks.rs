//! Handles the buttons and keys of the page and its cards, and gamepad buttons.

use super::App;
use crate::input::action::Action;
use crate::input::pad::PadState;
use crate::net::api;
use crate::page::dialogs::{Layer, Question};
use crate::page::event::{Address, Effect, Key};
use crate::page::game::GameScreen;
use crate::page::game::connection::State;
use crate::page::page_action::{KeyUse, PageAction};
use crate::page::screen::Screen;
use crate::page::strings::{self, CardAction};

/// The query of an address that opens a room as a spectator.
const WATCH: &str = "?watch=1";
/// The gamepad actions to which the page reacts.
const ON_PAD: [(Action, PageAction); 4] = [
    (Action::Mute, PageAction::Mute),
    (Action::FullScreen, PageAction::FullScreen),
    (Action::Clip, PageAction::Clip),
    (Action::Again, PageAction::Again),
];

impl App {
    /// Performs the action of a clicked element.
    pub(super) fn click(&mut self, action: PageAction, value: &str) {
        if action.shows_card() {
            self.screen.release_input(&mut self.ctx);
        }
        match action {
            PageAction::Leave => self.act(Some(CardAction::Lobby)),
            PageAction::Go => self.go(format!("/{value}"), ""),
            PageAction::Watch => self.go(format!("/{value}"), WATCH),
            PageAction::Copy => self.ctx.request(Effect::CopyAddress),
            PageAction::QrCode => self.show_code(),
            PageAction::Help => self.visit.dialogs.toggle_help(self.top()),
            PageAction::Settings => self.toggle_settings(false),
            PageAction::Rename => self.toggle_settings(true),
            PageAction::Wheel => {
                let may_open = self.top() == Layer::Page;
                if let Screen::Game(game) = &mut self.screen {
                    game.input.toggle_wheel(may_open);
                }
            }
            PageAction::ChooseKey
            | PageAction::ChooseButton
            | PageAction::FullScreen
            | PageAction::ResetHands => self.settings.click(&mut self.ctx, action, value),
            PageAction::Clean => self.panels.clean = !self.panels.clean,
            PageAction::Figures => self.panels.figures = !self.panels.figures,
            PageAction::Network => self.panels.toggle_network(),
            PageAction::Sound => self.panels.toggle_sound(),
            PageAction::Mute => self.sound.toggle_mute(&mut self.ctx),
            PageAction::OpenFile => self.ctx.request(Effect::ChooseFile),
            PageAction::CloseRoom => self.visit.dialogs.question = Some(Question::CloseRoom),
            PageAction::Kick => self.kick(value),
            PageAction::AskNetwork => {
                if let Some(Question::Kick { network, .. }) = &mut self.visit.dialogs.question {
                    *network = !*network;
                }
            }
            PageAction::Confirm => {
                let question = self.visit.dialogs.question.take();
                if let (Some(question), Screen::Game(game)) = (question, &mut self.screen) {
                    game.carry_out(&mut self.ctx, &question);
                }
            }
            PageAction::Cancel => self.visit.dialogs.question = None,
            PageAction::Notice => self.act(self.notice().map(|card| card.action)),
            PageAction::NoticeOther => self.act(self.notice().and_then(|card| Some(card.other?.1))),
            PageAction::Records => self.records.toggle(&mut self.ctx, value),
            PageAction::EditScene => self.go_to_hash(format!("#edit={value}")),
            PageAction::EditNewScene => self.go_to_hash("#edit".to_owned()),
            PageAction::EditToggle => self.toggle_edit(),
            _ => self.screen.click(&mut self.ctx, action, value),
        }
    }

    /// Performs the action of a card's button.
    fn act(&mut self, action: Option<CardAction>) {
        match action {
            Some(CardAction::Lobby) => self.go(self.ctx.site.home().to_owned(), ""),
            Some(CardAction::Play) => self.go(format!("/{}", api::FIRST_SCENE), ""),
            Some(CardAction::Follow) => {
                let next = self.screen.game().and_then(|game| game.connection.status.next.clone());
                self.enter(next);
            }
            Some(CardAction::Watch) => {
                if let Some(game) = self.screen.game() {
                    self.go(format!("/{}", game.connection.code), WATCH);
                }
            }
            Some(CardAction::Reload) => self.ctx.request(Effect::Reload),
            Some(CardAction::File) => self.ctx.request(Effect::ChooseFile),
            Some(CardAction::Stay) => self.visit.dialogs.card = None,
            Some(CardAction::Edit) => self.edit_linked(),
            Some(CardAction::Draft) => {
                if let Screen::Edit(screen) = &mut self.screen {
                    screen.take_other_draft(&self.ctx.storage);
                }
            }
            Some(CardAction::Unplay) => self.toggle_edit(),
            Some(CardAction::PlayHeavy) => self.play_heavy(),
            Some(CardAction::Resume) => self.screen.resume(),
            Some(CardAction::Refetch) => self.route(self.ctx.site.address.clone()),
            Some(CardAction::Again) => {
                if let Screen::Game(game) = &mut self.screen {
                    match game.connection.status.state {
                        State::Refused => game.connection.connect(&mut self.ctx),
                        _ => game.connection.hurry(),
                    }
                }
            }
            None => {}
        }
    }

    /// Asks whether to remove the player in this seat. A bot is removed at once.
    fn kick(&mut self, seat: &str) {
        let Screen::Game(game) = &mut self.screen else { return };
        let Some(room) = game.replica().map(|replica| &replica.room) else { return };
        match Question::kick(room.players(), seat) {
            Some(Question::Kick { seat, .. }) if room.is_bot(seat) => {
                game.remove(&mut self.ctx, seat, false);
            }
            question => self.visit.dialogs.question = question,
        }
    }

    fn toggle_settings(&mut self, renames: bool) {
        if let Screen::Game(game) = &mut self.screen {
            game.input.wheel = None;
        }
        self.settings.choice = None;
        self.settings.note.clear();
        let top = self.top();
        self.visit.dialogs.toggle_settings(top, renames);
    }

    /// Shows the current link as a QR code.
    fn show_code(&mut self) {
        let site = &self.ctx.site;
        let Address { path, query, hash } = &site.address;
        let link = match self.screen.edited() {
            Some(screen) => site.scene_link(screen.editor.text()),
            None => format!("{path}{query}{hash}"),
        };
        self.visit.dialogs.show(strings::link_code(&format!("{}{link}", site.origin)));
    }

    pub(super) fn key_down(&mut self, key: &Key) {
        let is_escape = key.code == "Escape";
        if is_escape && self.notice().is_some_and(|card| card.code.is_some()) {
            self.visit.dialogs.card = None;
            return self.ctx.request(Effect::PreventDefault);
        }
        self.settings.note_cap(key);
        let used = match self.top() {
            Layer::Settings if self.settings.key_down(&mut self.ctx, key) => KeyUse::Used,
            Layer::Settings if is_escape => KeyUse::Action(PageAction::Settings),
            top => self.screen.key_down(&mut self.ctx, &self.settings.keys, top, key),
        };
        if used != KeyUse::Unused {
            self.ctx.request(Effect::PreventDefault);
        }
        if let KeyUse::Action(action) = used {
            self.click(action, "");
        }
    }

    pub(super) fn play_by_pad(&mut self, state: &PadState) {
        let (input, before) = self.settings.read_pad(state);
        let is_free = self.top() == Layer::Page;
        if let Screen::Game(game) = &mut self.screen {
            game.play_by_pad(&mut self.ctx, &input, before, is_free);
        }
        if !is_free {
            return;
        }
        let pressed = input.actions & !before;
        for (action, does) in ON_PAD {
            let is_over = self.screen.game().is_some_and(GameScreen::is_round_over);
            if pressed >> action as u32 & 1 == 1 && (action != Action::Again || is_over) {
                self.click(does, "");
            }
        }
    }
}
