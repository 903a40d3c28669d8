//! The list of players: in the order of their scores, the own one always in it. A host has a button
//! beside each other player that removes them.

use crate::language::fill;
use crate::page::dom::list::Item;
use crate::world::replica::Replica;
use jostle_protocol::{Appearance, PlayerState};

/// Players in the list; the rest is counted. A host has to reach all of them.
const LISTED_MAX: usize = 10;

pub fn entries(replica: &Replica, host: bool) -> Vec<Item> {
    let mut order: Vec<&PlayerState> = replica.players().iter().collect();
    order.sort_by_key(|player| (std::cmp::Reverse(player.score), player.seat));
    let most = if host { order.len() } else { LISTED_MAX };
    let more = order.len().saturating_sub(most);
    let own = order.iter().position(|player| player.seat == replica.seat).unwrap_or(0);
    if own >= most && more > 0 {
        order.swap(own, most - 1);
    }
    order.truncate(most);
    let entries = order.into_iter().map(|player| entry(replica, player, host));
    let more = (more > 0).then(|| {
        Item::new("more-item", "")
            .text("", fill("and {count} more", &[("count", &more.to_string())]))
    });
    entries.chain(more).collect()
}

fn entry(replica: &Replica, player: &PlayerState, host: bool) -> Item {
    let own = player.seat == replica.seat;
    let color = replica.color_of(player);
    let team = replica.round().and_then(|round| round.player(player.seat)?.team);
    let class = match (own, player.connected) {
        (true, _) => "own",
        (false, true) => "",
        (false, false) => "away",
    };
    let template = if host && !own { "guest-item" } else { "player-item" };
    let item = Item::new(template, player.seat.0)
        .with("", "class", class.to_owned())
        .with("", "--color", color_var(color))
        .with("i", "data-emblem", team.map(|team| team.to_string()))
        .text("bdi", &*player.appearance.name)
        // The score of a team stands on the board.
        .text(".score", team.map_or_else(|| player.score.to_string(), |_| String::new()));
    if template == "player-item" {
        // Of use to a spectator.
        return item.with("", "data-action", "follow".to_owned()).with(
            "",
            "data-value",
            player.seat.0.to_string(),
        );
    }
    let label = fill("Remove {player}", &[("player", &*player.appearance.name)]);
    item.with("button", "data-value", player.seat.0.to_string())
        .with("button", "aria-label", label.clone())
        .with("button", "title", label)
}

/// The CSS value of a player colour.
pub fn color_of(appearance: &Appearance) -> String {
    color_var(appearance.color)
}

/// The CSS value of a colour of the players' palette.
pub fn color_var(color: u8) -> String {
    format!("var(--player-{color})")
}
