//! What the buttons of the page and of its cards do.

use super::App;
use crate::input::action::Action;
use crate::input::pad::PadState;
use crate::net::api;
use crate::page::dialogs::Layer;
use crate::page::dialogs::Question;
use crate::page::event::{Address, Effect};
use crate::page::game::GameScreen;
use crate::page::game::connection::State;
use crate::page::page_action::PageAction;
use crate::page::screen::Screen;
use crate::page::settings::Choice;
use crate::page::strings::{self, CardAction};

/// The table of the gamepad's buttons that mean something to the page.
const ON_PAD: [(Action, PageAction); 4] = [
    (Action::Mute, PageAction::Mute),
    (Action::FullScreen, PageAction::FullScreen),
    (Action::Clip, PageAction::Clip),
    (Action::Again, PageAction::Again),
];

impl App {
    /// Does what was clicked says.
    pub(in crate::page) fn click(&mut self, action: PageAction, value: &str) {
        match action {
            PageAction::Leave => self.go_home(),
            PageAction::Go => self.go(&format!("/{value}")),
            PageAction::Watch => self.watch_room(value),
            PageAction::Copy => self.ctx.request(Effect::CopyAddress),
            PageAction::QrCode => self.show_code(),
            PageAction::Help => self.toggle_help(),
            PageAction::Settings => self.toggle_settings(),
            PageAction::Wheel => {
                let may_open = self.top() == Layer::Page;
                if let Screen::Game(game) = &mut self.screen {
                    game.input.toggle_wheel(may_open);
                }
            }
            PageAction::FullScreen => self.settings.toggle_full_screen(&mut self.ctx),
            PageAction::ChooseKey => {
                self.settings.ask_choice(Action::of_id(value).map(Choice::Key))
            }
            PageAction::ChooseButton => {
                self.settings.ask_choice(Action::of_id(value).map(Choice::Button))
            }
            PageAction::ResetHands => self.settings.reset_hands(&mut self.ctx),
            PageAction::Clean => self.panels.clean = !self.panels.clean,
            PageAction::Figures => self.panels.figures = !self.panels.figures,
            PageAction::Mute => self.sound.toggle_mute(&mut self.ctx),
            PageAction::Network => self.toggle_network(),
            PageAction::Sound => {
                self.panels.sound = !self.panels.sound;
                self.panels.network = false;
            }
            PageAction::OpenFile => self.ctx.request(Effect::ChooseFile),
            PageAction::CloseRoom => {
                self.screen.release_input(&mut self.ctx);
                self.visit.dialogs.question = Some(Question::CloseRoom);
            }
            PageAction::Kick => self.ask_to_kick(value),
            PageAction::Confirm => {
                if let Some(question) = self.visit.dialogs.question.take() {
                    self.screen.with_game(&mut self.ctx, |game, ctx| {
                        game.connection.carry_out(ctx, &question);
                    });
                }
            }
            PageAction::Cancel => self.visit.dialogs.question = None,
            PageAction::Notice => self.act(self.notice().map(|card| card.action)),
            PageAction::NoticeOther => {
                let other = self.notice().and_then(|card| card.other);
                self.act(other.map(|(_, action)| action));
            }
            PageAction::Again
            | PageAction::Bounds
            | PageAction::Clip
            | PageAction::Emote
            | PageAction::Highlights
            | PageAction::SwitchTeam
            | PageAction::PlayPause
            | PageAction::Step
            | PageAction::Follow => self.screen.click(&mut self.ctx, action, value),
            _ => self.click_editor(action, value),
        }
    }

    /// Does what the button of a card says.
    fn act(&mut self, action: Option<CardAction>) {
        match action {
            Some(CardAction::Lobby) => self.go_home(),
            Some(CardAction::Play) => self.go(&format!("/{}", api::FIRST_SCENE)),
            Some(CardAction::Watch) => {
                if let Some(code) = self.screen.game().map(|game| game.connection.code.clone()) {
                    self.watch_room(&code);
                }
            }
            Some(CardAction::Reload) => self.ctx.request(Effect::Reload),
            Some(CardAction::File) => self.ctx.request(Effect::ChooseFile),
            Some(CardAction::Stay) => self.visit.dialogs.card = None,
            Some(CardAction::Edit) => self.edit_linked(),
            Some(CardAction::Draft) => self.take_other_draft(),
            Some(CardAction::Unplay) => self.toggle_edit(),
            Some(CardAction::PlayHeavy) => self.play_heavy(),
            Some(CardAction::Resume) => self.screen.resume(),
            Some(CardAction::Refetch) => self.route(self.ctx.site.address.clone()),
            Some(CardAction::Again) => {
                self.screen.with_game(&mut self.ctx, |game, ctx| {
                    match game.connection.status.state {
                        State::Refused => game.connection.connect(ctx),
                        _ => game.connection.hurry(),
                    }
                })
            }
            None => {}
        }
    }

    fn ask_to_kick(&mut self, seat: &str) {
        self.screen.release_input(&mut self.ctx);
        let Some(replica) = self.screen.replica() else { return };
        let player = replica.room.players().iter().find(|player| player.seat.0.to_string() == seat);
        let question = player.map(|p| Question::Kick(p.seat, p.appearance.clone()));
        self.visit.dialogs.question = question;
    }

    /// Shows the link of what is on as a QR code.
    fn show_code(&mut self) {
        self.screen.release_input(&mut self.ctx);
        let Address { path, query, hash } = &self.ctx.site.address;
        let link = self.edited_link().unwrap_or_else(|| format!("{path}{query}{hash}"));
        self.visit.dialogs.card =
            Some(strings::link_code(&format!("{}{link}", self.ctx.site.origin)));
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
