//! The list of players, ordered by score. It always includes the player, or the one that a spectator follows. The
//! player's own entry is a button that changes the name; for a host, each other player has a button that removes them;
//! for a spectator, each entry is a button that follows the player.

use crate::language::{fill, say};
use crate::page::app::App;
use crate::page::strings;
use crate::page::view::{View, word};
use crate::world::replica::Replica;
use jostle_game::Seat;
use jostle_protocol::{Appearance, PlayerState};

/// Maximum number of players in the list; the rest are only counted. For a host the list is complete.
const LISTED_MAX: usize = 10;

/// The role of the viewer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Viewer {
    Player,
    Host,
    /// A spectator, with the player whom they follow.
    Spectator(Option<Seat>),
}

pub fn view(app: &App) -> View {
    let game = app.screen.game();
    let viewer = match game {
        Some(game) if game.watches() => Viewer::Spectator(game.followed.seat),
        Some(game) if game.connection.status.host => Viewer::Host,
        _ => Viewer::Player,
    };
    let class = if game.is_some_and(|game| game.connection.status.host) {
        "players host"
    } else {
        "players"
    };
    let entries = game.and_then(|game| game.replica()).map(|replica| entries(replica, viewer));
    View::panel("players")
        .with("#players", "class", class)
        .list("#players", entries.unwrap_or_default())
}

fn entries(replica: &Replica, viewer: Viewer) -> Vec<View> {
    let mut order = replica.room.ranking();
    let most = if viewer == Viewer::Host { order.len() } else { LISTED_MAX };
    let more = order.len().saturating_sub(most);
    let kept = match viewer {
        Viewer::Spectator(Some(followed)) => followed,
        _ => replica.room.seat,
    };
    let kept = order.iter().position(|player| player.seat == kept).unwrap_or(0);
    if kept >= most && more > 0 {
        order.swap(kept, most - 1);
    }
    order.truncate(most);
    let entries = order.into_iter().map(|player| entry(replica, player, viewer));
    let more = (more > 0).then(|| {
        View::item("more-item", "")
            .text("", fill("and {count} more", &[("count", &more.to_string())]))
    });
    let bots = replica.room.players().iter().filter(|player| replica.room.is_bot(player.seat));
    let bots = bots.count();
    let count = (bots > 0).then(|| {
        let people = replica.room.players().len() - bots;
        View::item("more-item", "people").text("", strings::people_and_bots(people, bots))
    });
    entries.chain(more).chain(count).collect()
}

fn entry(replica: &Replica, player: &PlayerState, viewer: Viewer) -> View {
    let own = player.seat == replica.room.seat;
    let team = replica.room.round().and_then(|round| round.player(player.seat)?.team);
    let class = match (own, player.connected) {
        (true, _) => "own",
        (false, true) => "",
        (false, false) => "away",
    };
    let template = match viewer {
        Viewer::Host if !own => "guest-item",
        Viewer::Spectator(_) => "watched-item",
        _ if own => "own-item",
        _ => "player-item",
    };
    let item = View::item(template, player.seat.0)
        .with("", "class", class)
        .yes("", "data-bot", replica.room.is_bot(player.seat))
        .style("", "--color", color_var(replica.room.color_of(player)))
        .with_or_without("i", "data-emblem", team.map(|team| team.to_string()))
        .text("bdi", player.appearance.name.to_string())
        // A team's score is on the scoreboard.
        .text(".score", team.map_or_else(|| player.score.to_string(), |_| String::new()));
    let item = match viewer {
        Viewer::Host if !own => {
            let label = fill("Remove {player}", &[("player", &*player.appearance.name)]);
            item.with("button", "aria-label", label.clone()).with("button", "title", label)
        }
        _ if own => {
            let label = say("Change your name or colour");
            return item.with("button", "aria-label", label).with("button", "title", label);
        }
        Viewer::Spectator(followed) => {
            item.with("button", "aria-pressed", word(followed == Some(player.seat)))
        }
        _ => return item,
    };
    item.with("button", "data-value", player.seat.0.to_string())
}

/// The CSS value of a player colour.
pub fn color_of(appearance: &Appearance) -> String {
    color_var(appearance.color)
}

/// The CSS value of a colour from the players' palette.
pub fn color_var(color: u8) -> String {
    format!("var(--player-{color})")
}
