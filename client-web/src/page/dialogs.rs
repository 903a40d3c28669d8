//! The cards over the page: help, settings, questions and notices. The one on top must be answered first: everything
//! below it is inert, so that neither Tab nor a click nor a screen reader can reach it.

pub use crate::page::strings::Card;
use jostle_game::Seat;
use jostle_protocol::{Appearance, PlayerState};

/// Layers, from bottom to top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    Page,
    Help,
    /// The settings dialog: keys, gamepad, language.
    Settings,
    /// A question to confirm an action.
    Ask,
    Notice,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    pub help: bool,
    pub settings: bool,
    /// Whether a question is open.
    pub ask: bool,
    /// Whether a notice that does not close by itself is open. A notice that closes by itself leaves the page usable.
    pub notice: bool,
}

impl Layers {
    /// The layer that receives keys and clicks.
    pub fn top(self) -> Layer {
        match self {
            Layers { notice: true, .. } => Layer::Notice,
            Layers { ask: true, .. } => Layer::Ask,
            Layers { settings: true, .. } => Layer::Settings,
            Layers { help: true, .. } => Layer::Help,
            _ => Layer::Page,
        }
    }

    /// Whether a layer is inert. A notice that closes by itself is inert only under another dialog.
    pub fn is_inert(self, layer: Layer) -> bool {
        let top = self.top();
        top != layer && !(top == Layer::Page && layer == Layer::Notice)
    }
}

/// A question that the host must answer before an action that cannot be undone.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Remove this player?
    Kick {
        seat: Seat,
        /// Identifies the player, since the seat may belong to someone else by the time of the answer.
        who: Appearance,
        /// Whether nobody new may join from the player's network either.
        network: bool,
    },
    CloseRoom,
}

impl Question {
    /// Asks whether to remove the player in this seat, given as text by a button.
    pub fn kick(players: &[PlayerState], seat: &str) -> Option<Question> {
        let player = players.iter().find(|player| player.seat.0.to_string() == seat);
        player.map(|player| {
            let (seat, who) = (player.seat, player.appearance.clone());
            Question::Kick { seat, who, network: false }
        })
    }
}

/// The dialogs that were opened explicitly. Notices about the state of the page are not stored here, since they follow
/// from that state.
#[derive(Debug, Default)]
pub struct Dialogs {
    pub help: bool,
    pub settings: bool,
    /// Whether the settings were opened to change the name.
    pub renames: bool,
    pub question: Option<Question>,
    /// A notice about a replay or a demo.
    pub card: Option<Card>,
}

impl Dialogs {
    /// The open layers, including the notice on display.
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

    /// Opens or closes the help. It cannot be opened over a dialog that waits for an answer.
    pub fn toggle_help(&mut self, top: Layer) {
        match top {
            Layer::Page => self.help = true,
            Layer::Help => self.help = false,
            Layer::Settings | Layer::Ask | Layer::Notice => {}
        }
    }

    /// Opens or closes the settings, possibly with the focus on the player's name.
    pub fn toggle_settings(&mut self, top: Layer, renames: bool) {
        self.renames = renames;
        match top {
            Layer::Page | Layer::Help => self.settings = true,
            Layer::Settings => self.settings = false,
            Layer::Ask | Layer::Notice => {}
        }
    }

    /// Withdraws a question about a player who has left.
    pub fn withdraw_moot(&mut self, players: &[PlayerState]) {
        self.question.take_if(|question| match question {
            Question::Kick { seat, who, .. } => {
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
