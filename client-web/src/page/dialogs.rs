//! The cards over the page: help, settings, a question, a notice. The one on top must be answered first: everything below
//! it is inert, so that neither Tab nor a click nor a screen reader gets there.

pub use crate::page::strings::Card;
use jostle_game::Seat;
use jostle_protocol::{Appearance, PlayerState};

/// Layers, from the bottom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    Page,
    Help,
    /// Keys, gamepad, language.
    Settings,
    /// A question before something is done.
    Ask,
    Notice,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    pub help: bool,
    pub settings: bool,
    /// A question is open.
    pub ask: bool,
    /// A notice is open that does not go away by itself; one that does leaves the page alone.
    pub notice: bool,
}

impl Layers {
    /// The layer that takes keys and clicks.
    pub fn top(self) -> Layer {
        match self {
            Layers { notice: true, .. } => Layer::Notice,
            Layers { ask: true, .. } => Layer::Ask,
            Layers { settings: true, .. } => Layer::Settings,
            Layers { help: true, .. } => Layer::Help,
            _ => Layer::Page,
        }
    }

    /// Whether a layer is out of reach. A notice that goes away by itself is, under the help.
    pub fn is_inert(self, layer: Layer) -> bool {
        let top = self.top();
        top != layer && !(top == Layer::Page && layer == Layer::Notice)
    }
}

/// A question to a host before something that cannot be undone.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Remove this player? The seat alone could be another player's by the time of the answer.
    Kick(Seat, Appearance),
    CloseRoom,
}

impl Question {
    /// Asks whether the player of a seat, as a button names it, is to leave.
    pub fn kick(players: &[PlayerState], seat: &str) -> Option<Question> {
        let player = players.iter().find(|player| player.seat.0.to_string() == seat);
        player.map(|player| Question::Kick(player.seat, player.appearance.clone()))
    }
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

    pub fn show(&mut self, card: Card) {
        self.card = Some(card);
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

#[cfg(test)]
mod tests {
    use super::*;
    use Layer::{Ask, Help, Notice, Page};

    #[test]
    fn only_the_topmost_card_can_be_reached() {
        let reached = |help, ask, notice| {
            let layers = Layers { help, settings: false, ask, notice };
            let reach = |layer: &Layer| !layers.is_inert(*layer);
            (layers.top(), [Page, Help, Ask, Notice].into_iter().filter(reach).collect::<Vec<_>>())
        };
        assert_eq!(reached(true, false, false), (Help, vec![Help]));
        assert_eq!(reached(false, true, false), (Ask, vec![Ask]));
        assert_eq!(reached(false, false, true), (Notice, vec![Notice]));
        assert_eq!(reached(true, true, true), (Notice, vec![Notice]));
        let passing = reached(false, false, false);
        assert_eq!(passing, (Page, vec![Page, Notice]), "it goes away by itself");
    }
}
