//! A page whose room moves from server to server.

use crate::node::{Dir, Node};
use crate::trouble::network_noise;
use anyhow::Result;
use jostle_tests::nats::Cluster;
use jostle_tests::runner::Stage;
use jostle_tests::state::State;
use jostle_tests::tab::Screen;
use std::sync::Arc;
use std::time::Duration;

/// In the page: the longest time in which the displayed tick stood still.
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

/// Moves of the room.
const MOVES: usize = 2;

pub async fn a_page_follows_its_room_to_another_server(stage: Arc<Stage>) -> Result<()> {
    let cluster = Cluster::start(1).await?;
    let dir = Dir::new();
    let [mut a, mut b] =
        ["node-a", "node-b"].map(|name| Node::with_replicas(&dir, name, &cluster.url(), 1));
    a.start().await;
    b.start().await;
    let tab = stage.visit_link(&format!("http://{}/arena", a.address), Screen::SMALL).await?;
    let before = tab.until("a hero of one's own", State::plays).await?;
    tab.eval::<bool>(WATCH).await?;
    let loaded: f64 = tab.eval("performance.timeOrigin").await?;
    for _ in 0..MOVES {
        // The standing room is at the node with more to spare, whichever that is.
        let played = "INFO the room is played here";
        let (from, to) = match a.count(played) > a.count("reason=Parted") {
            true => (&mut a, &b),
            false => (&mut b, &a),
        };
        let times = to.count(played) + 1;
        from.signal("TERM");
        from.ended().await;
        to.says(played, times).await;
        let after = tab.ticks(120).await?;
        assert_eq!(after.seat, before.seat);
        assert_eq!(after.state, "playing");
        from.start().await;
    }
    assert_eq!(tab.eval::<f64>("performance.timeOrigin").await?, loaded, "no reload");
    let still_ms: f64 = tab.eval("window.watch.still_ms").await?;
    println!("the picture stood still for {:?} at most", Duration::from_millis(still_ms as u64));
    tab.ignore_errors(network_noise);
    stage.clear().await
}
