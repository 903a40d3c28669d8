//! Links that are cut, silent or slow, and tokens presented over them, in rows 1 to 4, 7, 8, 19 and 20 of
//! docs/faults.md.

use super::stage::{Stage, Ticket};
use crate::client::Client;
use crate::faults::frames::{WHOLE, frame, input, write};
use crate::faults::links::far_away;
use crate::slow_reader::connect_small;
use jostle_game::Buttons;
use jostle_protocol::{Refusal, VERSION};
use std::time::Duration;
use tokio::io::AsyncReadExt;
use tokio::time::{Instant, sleep, timeout, timeout_at};

const ROOM: &str = "pile";
/// The scene that fills every buffer.
const RESTLESS: &str = "restless";
const LOST: &str = "jostle_leaves_total{how=\"lost\"}";

/// Row 1: a client is killed in the middle of a frame.
pub async fn killed_inside_a_frame(stage: &Stage) {
    let mut guest = stage.join(ROOM, "Killed").await;
    let whole = frame(WHOLE, &input(guest.seq + 1));
    write(&mut guest, &whole[..whole.len() / 2]).await;
    let ticket = Ticket::of(&guest);
    let mut witness = stage.join(ROOM, "Witness").await;
    // Unread data makes the kernel reset the connection.
    drop(guest);
    until_lost(&mut witness, ticket.seat).await;
    stage.counts(LOST, 1);
    let back = stage.resume(ROOM, ticket).await;
    stage.leave(witness).await;
    stage.leave(back).await;
}

/// Row 2: a client vanishes without closing its socket.
pub async fn half_open(stage: &Stage) {
    let guest = stage.join(ROOM, "Gone").await;
    let mut witness = stage.join(ROOM, "Witness").await;
    // The socket is not read, so no pings are answered, and it is never closed from this end.
    until_lost(&mut witness, guest.seat).await;
    stage.refuses("silent");
    let back = stage.resume(ROOM, Ticket::of(&guest)).await;
    stage.leave(back).await;
    stage.leave(witness).await;
}

/// Waits until another player sees that a player's socket was closed.
async fn until_lost(witness: &mut Client, seat: u16) {
    witness
        .until("the end of a slow socket", |snapshot| {
            snapshot.players.iter().any(|player| player.seat.0 == seat && !player.connected)
        })
        .await;
}

/// Row 3: a client stops reading.
pub async fn stops_reading(stage: &Stage) {
    let mut witness = stage.join(RESTLESS, "Witness").await;
    let mut stuck = connect_small(stage.address).await;
    stuck.enter("Stuck", None).await;
    stuck.play_one_input().await;
    until_lost(&mut witness, stuck.seat).await;
    stage.refuses("silent");
    stage.counts(LOST, 1);
    stage.counts("jostle_sockets_late_total", 1);
    let mut back = stage.resume(RESTLESS, Ticket::of(&stuck)).await;
    assert!(back.newest.tick >= witness.newest.tick, "the newest state");
    back.keeps_playing().await;
    stage.leave(back).await;
    stage.leave(witness).await;
}

/// Row 4: a client reads a few bytes per second.
pub async fn reads_byte_by_byte(stage: &Stage) {
    let mut witness = stage.join(RESTLESS, "Witness").await;
    let mut slow = connect_small(stage.address).await;
    slow.enter("Slow", None).await;
    slow.play_one_input().await;
    let ticket = Ticket::of(&slow);
    let mut byte = [0];
    let seat = slow.seat;
    let drip = async {
        while slow.socket.get_mut().read_exact(&mut byte).await.is_ok() {
            sleep(Duration::from_millis(100)).await;
        }
        std::future::pending::<()>().await
    };
    tokio::select! {
        () = drip => {}
        () = until_lost(&mut witness, seat) => {}
    }
    stage.refuses("silent");
    let back = stage.resume(RESTLESS, ticket).await;
    stage.leave(back).await;
    stage.leave(witness).await;
}

/// Row 7: a round trip of 200 to 400 ms, with stalls.
pub async fn far_link(stage: &Stage) {
    let address = far_away(stage.address).await;
    let mut far = Client::join(address, ROOM, "Far").await;
    stage.counts("jostle_joins_total{how=\"new\"}", 1);
    let until = Instant::now() + Duration::from_secs(6);
    while Instant::now() < until {
        far.input(Buttons::RIGHT, None).await;
        let _ = timeout(Duration::from_millis(16), far.snapshot()).await;
    }
    far.keeps_playing().await;
    assert!(far.player().connected);
    stage.leave(far).await;
}

/// Row 8: a tab in the background. Like a page, it reads from its socket and occasionally sends something. When it
/// returns, it has the newest state and keeps playing.
pub async fn background_tab(stage: &Stage) {
    let mut tab = stage.join(ROOM, "Tab").await;
    let before = tab.snapshots;
    let until = Instant::now() + stage.background;
    while Instant::now() < until {
        tab.input(Buttons::default(), None).await;
        let second = Instant::now() + Duration::from_secs(1);
        while timeout_at(second, tab.snapshot()).await.is_ok() {}
    }
    assert!(tab.snapshots > before, "it was sent snapshots meanwhile");
    let now = tab.tick().await;
    tab.until("the newest state", |snapshot| snapshot.tick >= now).await;
    tab.keeps_playing().await;
    stage.leave(tab).await;
}

/// Row 19: used and forged tokens.
pub async fn invalid_tokens(stage: &Stage) {
    let guest = stage.join(ROOM, "Owner").await;
    let used = guest.token;
    let back = stage.resume(ROOM, Ticket::of(&guest)).await;
    let mut forged = back.token;
    forged.0[0] ^= 1;
    for token in [used, forged] {
        let mut eve = Client::connect(stage.address, ROOM).await;
        eve.hello(VERSION, "Eve", Some(token)).await;
        eve.is_refused(Refusal::BadToken).await;
        stage.refuses("bad_token");
    }
    stage.leave(back).await;
}

/// Row 20: two sockets with one token. In the end, one of them has the seat.
pub async fn two_sockets_with_one_token(stage: &Stage) {
    let mut first = stage.join(ROOM, "Twice").await;
    let second = stage.resume(ROOM, Ticket::of(&first)).await;
    first.is_refused(Refusal::Replaced).await;
    stage.refuses("replaced");
    let mut third = Client::connect(stage.address, ROOM).await;
    third.hello(VERSION, "Thrice", Some(first.token)).await;
    third.is_refused(Refusal::BadToken).await;
    stage.refuses("bad_token");
    stage.leave(second).await;
}
