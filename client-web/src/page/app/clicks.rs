//! What the buttons of the page and of its cards do.

use super::{Activity, App};
use crate::input::action::Action;
use crate::net::api;
use crate::page::choices::Choice;
use crate::page::dialogs::Question;
use crate::page::event::{Address, Effect};
use crate::page::game::GameScreen;
use crate::page::game::status::State;
use crate::page::strings::{self, CardAction};
use crate::replay::player::ReplayPlayer;
use jostle_game::{Buttons, Seat};

impl App {
    /// Does what was clicked says (`data-action` in `index.html`).
    pub(super) fn click(&mut self, action: &str, value: &str) {
        match action {
            "leave" => self.go_home(),
            "go" => self.go(&format!("/{value}")),
            "watch" => self.watch_room(value),
            "copy" => self.ctx.request(Effect::CopyAddress),
            "qr-code" => self.show_code(),
            "help" => self.toggle_help(),
            "settings" => self.toggle_settings(),
            "wheel" => self.toggle_wheel(),
            "emote" => value.parse().into_iter().for_each(|emote| self.emote(emote)),
            "full-screen" => self.toggle_full_screen(),
            "choose-key" => self.ask_choice(Action::of_id(value).map(Choice::Key)),
            "choose-button" => self.ask_choice(Action::of_id(value).map(Choice::Button)),
            "reset-hands" => self.reset_hands(),
            "network" => self.toggle_network(),
            "sound" => {
                self.panels.sound = !self.panels.sound;
                self.panels.network = false;
            }
            "open-file" => self.ctx.request(Effect::ChooseFile),
            "close-room" => {
                self.release_input();
                self.dialogs.question = Some(Question::CloseRoom);
            }
            "kick" => self.ask_to_kick(value),
            "confirm" => match self.dialogs.question.take() {
                Some(Question::Kick(seat, _)) => self.with_game(|game, ctx| game.kick(ctx, seat)),
                Some(Question::CloseRoom) => self.with_game(|game, ctx| game.close_room(ctx)),
                None => {}
            },
            "cancel" => self.dialogs.question = None,
            "again" => self.go_on(),
            "clip" => self.with_game(GameScreen::keep_clip),
            "highlights" => self.with_game(GameScreen::toggle_highlights),
            "switch-team" => {
                self.press(Buttons::TEAM, true);
                self.press(Buttons::TEAM, false);
            }
            "notice" => self.act(self.notice().map(|card| card.action)),
            "notice-other" => {
                let other = self.notice().and_then(|card| card.other);
                self.act(other.map(|(_, action)| action));
            }
            "play-pause" => self.with_replay(ReplayPlayer::toggle),
            "step" => self.with_replay(|player| player.step_by(value.parse().unwrap_or(0))),
            "follow" => {
                let seat = value.parse().ok().map(Seat);
                self.with_game(|game, _| game.follow_player(seat));
                self.with_replay(|player| seat.into_iter().for_each(|s| player.toggle_follow(s)));
            }
            _ => _ = self.click_editor(action, value),
        }
    }

    /// Does what the button of a card says.
    fn act(&mut self, action: Option<CardAction>) {
        match action {
            Some(CardAction::Lobby) => self.go_home(),
            Some(CardAction::Play) => self.go(&format!("/{}", api::FIRST_SCENE)),
            Some(CardAction::Watch) => {
                if let Some(code) = self.game().map(|game| game.code.clone()) {
                    self.watch_room(&code);
                }
            }
            Some(CardAction::Reload) => self.ctx.request(Effect::Reload),
            Some(CardAction::File) => self.ctx.request(Effect::ChooseFile),
            Some(CardAction::Stay) => self.dialogs.card = None,
            Some(CardAction::Edit) => self.edit_linked(),
            Some(CardAction::Draft) => self.take_other_draft(),
            Some(CardAction::Unplay) => self.toggle_edit(),
            Some(CardAction::PlayHeavy) => self.play_heavy(),
            Some(CardAction::Resume) => match &mut self.activity {
                Activity::Game(game) => game.status.stalled_ms = None,
                Activity::Replay(replay) => replay.stalled_ms = None,
                _ => {}
            },
            Some(CardAction::Refetch) => self.route(self.address.clone()),
            Some(CardAction::Again) => self.with_game(|game, ctx| {
                if game.status.state == State::Refused { game.connect(ctx) } else { game.hurry() }
            }),
            None => {}
        }
    }

    fn ask_to_kick(&mut self, seat: &str) {
        self.release_input();
        let Some(replica) = self.replica() else { return };
        let player = replica.players().iter().find(|player| player.seat.0.to_string() == seat);
        let question = player.map(|p| Question::Kick(p.seat, p.appearance.clone()));
        self.dialogs.question = question;
    }

    /// Shows the link of what is on as a QR code.
    fn show_code(&mut self) {
        self.release_input();
        let Address { path, query, hash } = &self.address;
        let link = self.edited_link().unwrap_or_else(|| format!("{path}{query}{hash}"));
        self.dialogs.card = Some(strings::link_code(format!("{}{link}", self.origin)));
    }
}
