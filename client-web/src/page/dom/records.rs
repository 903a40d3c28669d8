//! The best runs: under a scene's card, and on the result of a round that is played alone.

use crate::language::say;
use crate::net::api;
use crate::page::app::App;
use crate::page::best_runs::Records;
use crate::page::dom;
use crate::page::dom::list::Item;
use crate::page::strings;
use jostle_protocol::web::RecordTable;

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

fn is_raced(table: &RecordTable, heroes: bool) -> bool {
    heroes && api::is_timed(table)
}

/// Shows the best run, and what came of the own one.
pub fn show_result(app: &App) {
    let said = Some(&*app.records.said).filter(|said| !said.is_empty());
    dom::text_or_hide("result-said", said.map(say));
    let scene = app.ranked_scene();
    let best = scene.and_then(|scene| app.records.best(scene));
    dom::show("result-best", best.is_some());
    let (Some(scene), Some((table, run))) = (scene, best) else { return };
    dom::text("best-run", &strings::best_run(table, run));
    let link = |id: &str, address: Option<String>| {
        dom::show(id, address.is_some());
        dom::set(&dom::html(id), "href", address.as_deref());
    };
    let heroes = app.replica().is_some_and(|replica| replica.scene.hero.is_some());
    link("best-watch", Some(api::watch(run)));
    link("best-race", is_raced(table, heroes).then(|| api::race(run, scene)));
}
