//! The best run of a scene, under its card.

use crate::net::api;
use crate::page::best_runs::Records;
use crate::page::dom::list::Item;
use crate::page::panels::round::is_raced;
use crate::page::strings;

/// Adds the best run of a scene to its card. One without heroes has no ghosts.
pub fn on_card(item: Item, records: &Records, scene: &str, heroes: bool) -> Item {
    let best = records.best(scene);
    let text = best.map_or_else(String::new, |(table, run)| strings::best_run(table, run));
    let item =
        item.with(".best", "hidden", best.is_none().then(String::new)).text(".best span", text);
    let race =
        best.filter(|(table, _)| is_raced(table, heroes)).map(|(_, run)| api::race(run, scene));
    item.with(".watch", "href", best.map(|(_, run)| api::watch(run)))
        .with(".race", "hidden", race.is_none().then(String::new))
        .with(".race", "href", race)
}
