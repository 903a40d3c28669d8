//! The cards over the page: help, a question, a notice.

use crate::page::layers::{Layer, Layers};
pub use crate::page::strings::Card;
use jostle_game::Seat;
use jostle_protocol::{Appearance, PlayerState};

/// A question to a host before something that cannot be undone.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Remove this player? The seat alone could be another player's by the time of the answer.
    Kick(Seat, Appearance),
    CloseRoom,
}

/// The cards that are open because someone opened them. Notices about the state of the page are not
/// kept here: they follow from that state.
#[derive(Debug, Default)]
pub struct Dialogs {
    pub help: bool,
    pub settings: bool,
    pub question: Option<Question>,
    /// A notice about a replay or a demo.
    pub card: Option<Card>,
}

impl Dialogs {
    /// The open layers, together with the notice that is shown.
    pub fn layers(&self, notice: Option<&Card>) -> Layers {
        Layers {
            help: self.help,
            settings: self.settings,
            ask: self.question.is_some(),
            notice: notice.is_some_and(|card| !card.passing),
        }
    }

    /// Opens the help, or closes it. Under a card that waits for an answer there is none.
    pub fn toggle_help(&mut self, top: Layer) {
        match top {
            Layer::Page => self.help = true,
            Layer::Help => self.help = false,
            Layer::Settings | Layer::Ask | Layer::Notice => {}
        }
    }

    /// Opens the settings, or closes them.
    pub fn toggle_settings(&mut self, top: Layer) {
        match top {
            Layer::Page | Layer::Help => self.settings = true,
            Layer::Settings => self.settings = false,
            Layer::Ask | Layer::Notice => {}
        }
    }

    /// Withdraws a question about a player after they left.
    pub fn withdraw_moot(&mut self, players: &[PlayerState]) {
        self.question.take_if(|question| match question {
            Question::Kick(seat, who) => {
                !players.iter().any(|player| player.seat == *seat && player.appearance == *who)
            }
            Question::CloseRoom => false,
        });
    }
}
