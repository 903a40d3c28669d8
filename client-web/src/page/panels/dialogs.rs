//! The dialogs over the page. While one must be answered, it has the focus and the rest of the page is inert;
//! afterwards the focus returns to the element that had it before.

use crate::language::{around, say};
use crate::page::app::App;
use crate::page::card::{Card, CardAction};
use crate::page::dialogs::Layer;
use crate::page::dialogs::Question;
use crate::page::view::{Set, View, word};

/// The parts of the page with their layers.
const PARTS: [(&str, Layer); 7] = [
    ("#lobby", Layer::Page),
    ("#game", Layer::Page),
    ("#editor", Layer::Page),
    ("#help", Layer::Help),
    ("#settings", Layer::Settings),
    ("#ask", Layer::Ask),
    ("#notice", Layer::Notice),
];

pub fn view(app: &App) -> View {
    let mut card = app.notice();
    // The lobby is not a part of what a frame shows.
    let leads_out = |action| action == CardAction::Lobby && app.ctx.site.is_framed;
    if let Some(card) = &mut card {
        card.other.take_if(|(_, action)| leads_out(*action));
    }
    let is_answered = card.as_ref().is_none_or(|card| !leads_out(card.action));
    let layers = app.visit.dialogs.layers(card.as_ref());
    let view = View::panel("dialogs")
        .show("#notice", card.is_some())
        .show("#notice-button", is_answered)
        .show("#ask", layers.ask);
    let mut view = PARTS
        .into_iter()
        .fold(view, |view, (at, layer)| view.flag(at, "inert", layers.is_inert(layer)));
    view.focus = match layers.top() {
        Layer::Page => None,
        Layer::Help => Some("#help-close"),
        Layer::Settings if app.visit.dialogs.renames => Some("#own-name"),
        Layer::Settings => Some("#language"),
        Layer::Ask => Some("#ask-no"),
        Layer::Notice => Some("#notice-button"),
    };
    let view = match &app.visit.dialogs.question {
        Some(question) => ask(view, question),
        None => view,
    };
    match &card {
        Some(card) => notice(view, card),
        None => view,
    }
}

/// Adds a card's texts to a view.
pub fn notice(view: View, card: &Card) -> View {
    let modal = word(!card.passing);
    let detail = Some(card.detail.clone()).filter(|detail| !detail.is_empty());
    let code = card.code.as_ref().filter(|code| !code.path.is_empty());
    let view = view
        .with("#notice", "aria-modal", modal)
        .text("#notice-title", say(card.title))
        .text("#notice-text", say(&card.text).to_owned())
        .text_or_hide("#notice-detail", detail)
        .text("#notice-button", say(card.button))
        .text_or_hide("#notice-other", card.other.map(|(label, _)| say(label)))
        .show("#notice-code", code.is_some());
    let Some(code) = code else { return view };
    view.with("#notice-code svg", "viewBox", format!("0 0 {0} {0}", code.side)).with(
        "#notice-code path",
        "d",
        code.path.clone(),
    )
}

fn ask(view: View, question: &Question) -> View {
    let (before, after) = around("Remove {player}?");
    let network = match question {
        Question::Kick { network, .. } => Some(*network),
        Question::CloseRoom => None,
    };
    let ([before, name, after], text, yes) = match question {
        Question::Kick { who, .. } => (
            [before, &*who.name, after],
            say("They'll be removed, and can come back in five minutes."),
            say("Remove"),
        ),
        Question::CloseRoom => (
            [say("Close this room?"), "", ""],
            say("Everyone, including you, will be sent out, and the link will stop working."),
            say("Close room"),
        ),
    };
    view.text("#ask-before", before.to_owned())
        .text("#ask-name", name.to_owned())
        .text("#ask-after", after.to_owned())
        .text("#ask-text", text)
        .show("#ask-network", network.is_some())
        .set("#ask-network input", Set::Checked(network == Some(true)))
        .text("#ask-yes", yes)
}
