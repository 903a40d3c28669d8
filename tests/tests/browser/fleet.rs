//! A page whose room moves from server to server.

use crate::games::{Games, Seen, number, percentiles};
use crate::trouble::network_noise;
use anyhow::Result;
use jostle_tests::runner::{Stage, is_long};
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::sync::Arc;
use std::time::Duration;

/// A script for the page that records the longest time during which the displayed tick did not change.
const WATCH: &str = r#"(() => {
    const watch = window.watch = {still_ms: 0};
    let tick = null, since = performance.now();
    const look = () => {
        const now = performance.now();
        const shown = JSON.parse(window.jostle.state()).tick;
        if (shown !== tick) [tick, since] = [shown, now];
        watch.still_ms = Math.max(watch.still_ms, now - since);
        requestAnimationFrame(look);
    };
    look();
    return true;
})()"#;

/// Number of times the room moves; `JOSTLE_FLEET_TIMES` can request more.
const MOVES: usize = 2;

/// Plays on a page in one room of a fleet in which all rooms have players. Nodes drain, and before a release one is
/// killed.
pub async fn a_page_follows_its_room_to_another_server(stage: Arc<Stage>) -> Result<()> {
    let mut games = Games::start(|cluster, _| cluster.url()).await;
    let room = games.rooms[0].clone();
    let another = games.nodes[1].address;
    let tab = stage.visit_link(&format!("http://{another}/{room}"), Screen::SMALL).await?;
    let before = tab.until("a hero of one's own", State::plays).await?;
    tab.eval::<bool>(WATCH).await?;
    let loaded: f64 = tab.eval("performance.timeOrigin").await?;
    for _ in 0..number("JOSTLE_FLEET_TIMES", MOVES) {
        take_away(&mut games, &room, "TERM", &tab, &before).await?;
    }
    let still = stood_still(&tab).await?;
    stage.note(format!("nodes drained: the picture stood still for {still:?} at most"));
    // The other nodes wait 20 s for the lease to expire; the fleet tests cover this in every run without a browser.
    if is_long() {
        take_away(&mut games, &room, "KILL", &tab, &before).await?;
        let still = stood_still(&tab).await?;
        stage.note(format!("a node killed: the picture stood still for {still:?}"));
    }
    assert_eq!(tab.eval::<f64>("performance.timeOrigin").await?, loaded, "no reload");
    let seen = games.end().await;
    let ([p50, p99, max], lost) = (percentiles(&seen.gaps()), seen.lost_ticks_max());
    let Seen { players, nodes, rooms, cluster, dir } = seen;
    let counts = [players.len(), rooms.len(), nodes.len()];
    stage.note(format!(
        "{counts:?} players, rooms and nodes: without snapshots for {p50:?}, {p99:?}, {max:?}; {lost} ticks lost"
    ));
    drop((nodes, cluster, dir));
    tab.ignore_errors(network_noise);
    stage.clear().await
}

/// Stops the node that plays the page's room, waits until everyone is playing elsewhere, and restarts the node.
async fn take_away(
    games: &mut Games,
    room: &str,
    signal: &str,
    tab: &Tab,
    before: &State,
) -> Result<()> {
    let at = games.places()[room];
    let node = games.nodes.iter().position(|node| node.address == at).expect("a node");
    games.nodes[node].signal(signal);
    games.nodes[node].ended().await;
    games.leave(at).await;
    games.all_play().await;
    let after = tab.ticks(120).await?;
    assert_eq!(after.seat, before.seat);
    assert_eq!(after.state, "playing");
    games.nodes[node].start().await;
    Ok(())
}

/// The longest time during which the page's picture did not change.
async fn stood_still(tab: &Tab) -> Result<Duration> {
    let still_ms: f64 = tab.eval("window.watch.still_ms").await?;
    Ok(Duration::from_millis(still_ms as u64))
}
