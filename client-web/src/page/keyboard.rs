//! Keys: the ones that belong to the world, to the page, and to a replay.

use crate::input::keys::meaning;
use crate::page::app::{Activity, App};
use crate::page::event::{Effect, Focus, Key, ReplayCommand};
use crate::page::layers::Layer;
use crate::page::replay_screen::ReplayScreen;
use jostle_sim::TICKS_PER_SECOND;

/// An arrow key skips this many ticks.
const SKIP_TICKS: i64 = TICKS_PER_SECOND as i64;

/// Something that a key does to the page.
#[derive(Clone, Copy)]
enum Command {
    Bounds,
    Figures,
    Network,
    Help,
    Cancel,
}

impl App {
    pub(super) fn key_down(&mut self, key: &Key) {
        match &self.activity {
            Activity::Game(_) => self.game_key_down(key),
            Activity::Replay(ReplayScreen::On(_)) => self.replay_key_down(key),
            Activity::Lobby | Activity::Replay(_) => {}
        }
    }

    pub(super) fn key_up(&mut self, key: &Key) {
        self.with_game(|game, ctx| {
            game.controls.key(&key.code, &key.letter, false);
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
        if let Some(command) = self.command_of(key) {
            self.ctx.request(Effect::PreventDefault);
            if !key.repeat {
                self.command(command);
            }
            return;
        }
        let presses_button =
            key.focus == Focus::Button && matches!(key.code.as_str(), "Space" | "Enter");
        if !presses_button && self.top() == Layer::Page && self.world_key_down(key) {
            self.ctx.request(Effect::PreventDefault);
        }
    }

    /// Presses what a key means to the world; `false` if that is nothing.
    fn world_key_down(&mut self, key: &Key) -> bool {
        let known = meaning(&key.code, &key.letter).is_some();
        if known && !key.repeat {
            self.with_game(|game, ctx| {
                game.controls.key(&key.code, &key.letter, true);
                game.send_due(ctx);
            });
        }
        known
    }

    fn command_of(&self, key: &Key) -> Option<Command> {
        match (key.code.as_str(), key.letter.as_str(), self.top()) {
            ("F2", ..) => Some(Command::Bounds),
            ("F3", ..) => Some(Command::Figures),
            ("F4", ..) => Some(Command::Network),
            (_, "?", _) | ("Escape", _, Layer::Help) => Some(Command::Help),
            ("Escape", _, Layer::Ask) => Some(Command::Cancel),
            _ => None,
        }
    }

    fn command(&mut self, command: Command) {
        match command {
            Command::Bounds => self.with_game(|game, _| game.toggle_bounds()),
            Command::Figures => self.panels.figures = !self.panels.figures,
            Command::Network => self.panels.network = !self.panels.network,
            Command::Help => self.toggle_help(),
            Command::Cancel => self.dialogs.question = None,
        }
    }

    fn replay_key_down(&mut self, key: &Key) {
        let top = self.top();
        match (key.code.as_str(), key.letter.as_str()) {
            ("F2", _) if !key.repeat => self.command_replay(ReplayCommand::ToggleBounds),
            (_, "?") if !key.repeat => self.toggle_help(),
            ("Escape", _) if top == Layer::Help => self.toggle_help(),
            _ if key.modified || top != Layer::Page || is_used_by_focus(key) => return,
            (_, " ") if key.repeat => {}
            (_, letter) => match replay_command(letter) {
                Some(command) => self.command_replay(command),
                None => return,
            },
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

fn replay_command(letter: &str) -> Option<ReplayCommand> {
    Some(match letter {
        " " => ReplayCommand::Toggle,
        "," => ReplayCommand::Step(-1),
        "." => ReplayCommand::Step(1),
        "ArrowLeft" => ReplayCommand::Skip(-SKIP_TICKS),
        "ArrowRight" => ReplayCommand::Skip(SKIP_TICKS),
        "ArrowUp" => ReplayCommand::Faster,
        "ArrowDown" => ReplayCommand::Slower,
        "Home" => ReplayCommand::Start,
        "End" => ReplayCommand::End,
        "0" => ReplayCommand::FollowNone,
        digit => ReplayCommand::FollowNth(digit.parse::<usize>().ok()?.checked_sub(1)?),
    })
}
