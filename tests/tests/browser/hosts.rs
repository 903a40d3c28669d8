//! Hosts of rooms: a room may be private, and its host can remove players and close it. Removed players are notified
//! and cannot return.

use crate::trouble::{assert_notice, network_noise};
use anyhow::{Result, ensure};
use jostle_protocol::{ClientMessage, Refusal};
use jostle_tests::runner::Stage;
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::sync::Arc;

/// Makes the page's sockets accessible, so that tests can send messages that the page itself never would.
const SOCKETS: &str = "(() => { const Open = WebSocket; window.sockets = []; \
    window.WebSocket = class extends Open { constructor(...given) { super(...given); \
    window.sockets.push(this); } }; })()";

/// Opens a public room and returns its code.
const OPEN_PUBLIC: &str = "fetch('/api/rooms', {method: 'POST', \
    headers: {'content-type': 'application/json'}, body: JSON.stringify({scene: 'impulse'})})\
    .then(answer => answer.json()).then(room => room.code)";

pub async fn a_host_opens_a_private_room_and_removes_a_player(stage: Arc<Stage>) -> Result<()> {
    let ada = open_private_room(&stage).await?;
    let link = ada.link().await?;
    let code = link.rsplit('/').next().unwrap_or_default().to_owned();
    ada.until_true("!document.querySelector('#close-room').hidden").await?;
    ada.until_true("!document.querySelector('#players .leave')").await?;

    // The room is listed neither in the server's response nor in a guest's lobby.
    let public: String = ada.eval(OPEN_PUBLIC).await?;
    let rooms: String = ada.eval("fetch('/api/rooms').then(answer => answer.text())").await?;
    ensure!(rooms.contains(&public) && !rooms.contains(&code), "only {public}: {rooms}");
    let bob = stage.visit_changed(SOCKETS, "/").await?;
    bob.until_true("document.querySelectorAll('#room-list a').length > 0").await?;
    let listed = format!("document.querySelector('#room-list').innerText.includes('{code}')");
    ensure!(!bob.eval::<bool>(&listed).await?, "{code} is in the lobby");

    bob.fill("#name", "Bob").await?;
    bob.go(&link).await?;
    bob.until("two players", |s| s.plays() && s.connected() == 2).await?;
    guests_are_denied(&bob).await?;

    remove_player(&ada, "Bob").await?;
    bob.until("a refusal", |s| s.state == "refused").await?;
    assert_notice(&bob, Refusal::Kicked.message()).await?;
    bob.keep("host-kicked").await?;
    bob.until_true("document.querySelector('#notice-other').hidden").await?;
    // By the secret of the lost seat, the room recognises who was removed.
    bob.until_true(&format!("sessionStorage.getItem('jostle.seat.{code}') !== null")).await?;
    ada.until("a room without Bob", |s| s.players.len() == 1).await?;
    ada.until_true("!document.querySelector('#players .leave')").await?;

    // The page does not return to the room by itself or through the link.
    let sockets: u32 = bob.eval("sockets.length").await?;
    ada.ticks(60).await?;
    assert_eq!(bob.eval::<u32>("sockets.length").await?, sockets, "it tries again");
    bob.go(&link).await?;
    bob.until("a refusal", |s| s.state == "refused").await?;
    assert_notice(&bob, Refusal::Kicked.message()).await?;
    bob.click_on("#notice-button").await?;
    bob.until("the lobby", |s| s.state == "lobby").await?;
    assert_eq!(ada.state().await?.players.len(), 1);
    Ok(())
}

pub async fn a_host_closes_the_room(stage: Arc<Stage>) -> Result<()> {
    let ada = open_private_room(&stage).await?;
    let link = ada.link().await?;
    let bob = stage.visit_link(&link, Screen::SMALL).await?;
    bob.until("two players", |s| s.plays() && s.connected() == 2).await?;

    // After a reload, the host is still the host.
    ada.go(&link).await?;
    ada.until("a hero of one's own", State::plays).await?;
    ada.until_true("document.querySelector('#players .leave')").await?;
    ada.click_on("#close-room").await?;
    ada.keep("host-close").await?;
    ada.key_down("Escape").await?;
    ada.key_up("Escape").await?;
    ada.until_true("document.querySelector('#ask').hidden").await?;
    ada.click_on("#close-room").await?;
    ada.click_on("#ask-yes").await?;
    for (tab, text) in [(&ada, "Everyone has been sent out"), (&bob, Refusal::RoomClosed.message())]
    {
        tab.until("a refusal", |s| s.state == "refused").await?;
        assert_notice(tab, text).await?;
    }
    bob.keep("host-closed").await?;
    ada.until_true("Object.keys(sessionStorage).every(key => !/^jostle.(seat|host)/.test(key))")
        .await?;
    ada.click_on("#notice-button").await?;
    ada.until("the lobby", |s| s.state == "lobby").await?;
    bob.go(&link).await?;
    bob.until("a refusal", |s| s.state == "refused").await?;
    assert_notice(&bob, Refusal::NoSuchRoom.message()).await?;
    bob.ignore_errors(network_noise);
    Ok(())
}

/// Opens a private room using the keyboard, as one would with a screen reader.
async fn open_private_room(stage: &Stage) -> Result<Tab> {
    let ada = stage.visit("/", Screen::LAPTOP).await?;
    ada.until("the lobby", |s| s.state == "lobby").await?;
    ada.until_true("document.querySelector('#scenes [data-value=arena]')").await?;
    ada.fill("#name", "Ada").await?;
    let button = "document.querySelector('#scenes .private[data-value=arena]')";
    ada.eval::<bool>(&format!("({button}.focus(), true)")).await?;
    ada.keep("host-lobby").await?;
    ada.press("Enter").await?;
    ada.until("a hero of one's own", State::plays).await?;
    Ok(ada)
}

/// Checks that guests can use neither the host's buttons nor its messages: requests are denied with a one-line notice.
async fn guests_are_denied(guest: &Tab) -> Result<()> {
    guest.until_true("document.querySelectorAll('#players li').length === 2").await?;
    guest.until_true("document.querySelector('#close-room').hidden").await?;
    guest.until_true("!document.querySelector('#players .leave')").await?;
    let close = ClientMessage::CloseRoom.encode();
    guest.eval::<bool>(&format!("(sockets.at(-1).send(new Uint8Array({close:?})), true)")).await?;
    guest.until_true("document.querySelector('#told').innerText.includes('Only the host')").await?;
    assert!(guest.state().await?.plays(), "and plays on");
    guest.keep("host-denied").await
}

/// Presses the button next to a player twice, to cancel the first time and to confirm the second.
async fn remove_player(host: &Tab, name: &str) -> Result<()> {
    let button = format!("#players [aria-label='Remove {name}']");
    host.until_true(&format!("document.querySelector(\"{button}\")")).await?;
    host.keep("host-list").await?;
    host.click_on(&button).await?;
    host.until_true("document.activeElement.id === 'ask-no'").await?;
    host.keep("host-ask").await?;
    host.click_on("#ask-no").await?;
    let state = host.ticks(30).await?;
    assert_eq!(state.connected(), 2, "nothing happens until it is confirmed");
    host.click_on(&button).await?;
    host.click_on("#ask-yes").await
}
