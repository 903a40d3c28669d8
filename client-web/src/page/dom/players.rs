//! The list of players: in the order of their scores, the own one, or the one that a spectator follows,
//! always in it. A host has a button beside each other player that removes them; for a spectator each entry is a button
//! that follows them.

use crate::language::fill;
use crate::page::dom::list::Item;
use crate::world::replica::Replica;
use jostle_game::Seat;
use jostle_protocol::{Appearance, PlayerState};

/// Players in the list; the rest is counted. A host has to reach all of them.
const LISTED_MAX: usize = 10;

/// Who looks at the list.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Reader {
    Player,
    Host,
    /// A spectator, and the player whom they follow.
    Spectator(Option<Seat>),
}

pub fn entries(replica: &Replica, reader: Reader) -> Vec<Item> {
    let mut order = replica.ranking();
    let most = if reader == Reader::Host { order.len() } else { LISTED_MAX };
    let more = order.len().saturating_sub(most);
    let kept = match reader {
        Reader::Spectator(Some(followed)) => followed,
        _ => replica.seat,
    };
    let kept = order.iter().position(|player| player.seat == kept).unwrap_or(0);
    if kept >= most && more > 0 {
        order.swap(kept, most - 1);
    }
    order.truncate(most);
    let entries = order.into_iter().map(|player| entry(replica, player, reader));
    let more = (more > 0).then(|| {
        Item::new("more-item", "")
            .text("", fill("and {count} more", &[("count", &more.to_string())]))
    });
    entries.chain(more).collect()
}

fn entry(replica: &Replica, player: &PlayerState, reader: Reader) -> Item {
    let own = player.seat == replica.seat;
    let color = replica.color_of(player);
    let team = replica.round().and_then(|round| round.player(player.seat)?.team);
    let class = match (own, player.connected) {
        (true, _) => "own",
        (false, true) => "",
        (false, false) => "away",
    };
    let template = match reader {
        Reader::Host if !own => "guest-item",
        Reader::Spectator(_) => "watched-item",
        _ => "player-item",
    };
    let item = Item::new(template, player.seat.0)
        .with("", "class", class.to_owned())
        .with("", "--color", color_var(color))
        .with("i", "data-emblem", team.map(|team| team.to_string()))
        .text("bdi", &*player.appearance.name)
        // The score of a team stands on the board.
        .text(".score", team.map_or_else(|| player.score.to_string(), |_| String::new()));
    let item = match reader {
        Reader::Host if !own => {
            let label = fill("Remove {player}", &[("player", &*player.appearance.name)]);
            item.with("button", "aria-label", label.clone()).with("button", "title", label)
        }
        Reader::Spectator(followed) => {
            let pressed = (followed == Some(player.seat)).to_string();
            item.with("button", "aria-pressed", pressed)
        }
        _ => return item,
    };
    item.with("button", "data-value", player.seat.0.to_string())
}

/// The CSS value of a player colour.
pub fn color_of(appearance: &Appearance) -> String {
    color_var(appearance.color)
}

/// The CSS value of a colour of the players' palette.
pub fn color_var(color: u8) -> String {
    format!("var(--player-{color})")
}
