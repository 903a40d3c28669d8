//! Tests of opened rooms: their links, their hosts, and the actions reserved for hosts.

use crate::client::Client;
use crate::http::{get, post};
use crate::server::Server;
use jostle_game::Seat;
use jostle_protocol::{ClientMessage, Refusal, ServerMessage, Token, VERSION};
use jostle_server::limits::PRIVATE_CODE_CHARS;
use std::net::SocketAddr;

/// Opens a room; returns its code and host key.
pub async fn open(server: SocketAddr, body: &str) -> (String, Token) {
    let created = post(server, "/api/rooms", body).await;
    assert_eq!(created.status, 201);
    let created = created.json();
    let text = |field: &str| created[field].as_str().expect("a text").to_owned();
    (text("code"), Token::parse(&text("host_key")).expect("a key"))
}

/// Reads until the server responds that the action is reserved for hosts.
async fn is_denied(client: &mut Client) {
    while !matches!(client.message().await, ServerMessage::Denied) {}
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_private_room_is_unlisted_and_open_to_everyone_with_the_link() {
    let server = Server::start().await;
    let (code, key) = open(server.address, r#"{"scene":"arena","private":true}"#).await;
    assert_eq!(code.len(), PRIVATE_CODE_CHARS);
    let mut host = Client::host(server.address, &code, "Host", key).await;
    let mut guest = Client::join(server.address, &code, "Guest").await;
    assert!(host.host && !guest.host);
    let list = get(server.address, "/api/rooms").await;
    assert!(!String::from_utf8(list.body).expect("text").contains(&code));
    assert_eq!(get(server.address, &format!("/{code}")).await.status, 200);
    let (open_code, _) = open(server.address, r#"{"scene":"arena"}"#).await;
    let list = get(server.address, "/api/rooms").await;
    assert!(String::from_utf8(list.body).expect("text").contains(&open_code));
    host.keeps_playing().await;
    guest.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_kicked_player_cannot_return_at_once() {
    let server = Server::start().await;
    let (code, key) = open(server.address, r#"{"scene":"arena","private":true}"#).await;
    let mut host = Client::host(server.address, &code, "Host", key).await;
    let mut guest = Client::join(server.address, &code, "Guest").await;
    guest.play_one_input().await;
    // Neither an empty seat nor the host can be kicked; only the latter attempt gets a response.
    host.send(&ClientMessage::Kick { seat: Seat(60) }).await;
    host.send(&ClientMessage::Kick { seat: Seat(host.seat) }).await;
    is_denied(&mut host).await;
    host.send(&ClientMessage::Kick { seat: Seat(guest.seat) }).await;
    guest.is_refused(Refusal::Kicked).await;
    host.until("an empty seat", |snapshot| snapshot.players.len() == 1).await;
    server.counts("jostle_leaves_total{how=\"kicked\"}", 1).await;

    let mut again = Client::connect(server.address, &code).await;
    again.hello(VERSION, "Guest", Some(guest.token)).await;
    again.is_refused(Refusal::Kicked).await;
    let mut again = Client::connect(server.address, &code).await;
    again.hello(VERSION, "Guest", None).await;
    again.is_refused(Refusal::Kicked).await;
    server.counts("jostle_refusals_total{reason=\"kicked\"}", 3).await;
    // Others from this address may still join, until the host shuts out the network.
    let mut other = Client::join(server.address, &code, "Other").await;
    host.send(&ClientMessage::KickNetwork { seat: Seat(other.seat) }).await;
    other.is_refused(Refusal::Kicked).await;
    let mut again = Client::connect(server.address, &code).await;
    again.hello(VERSION, "Third", None).await;
    again.is_refused(Refusal::Kicked).await;
    // Other rooms still admit this address, and this room still admits its host from there.
    let mut elsewhere = Client::join(server.address, "arena", "Guest").await;
    let mut second = Client::host(server.address, &code, "Host", key).await;
    elsewhere.keeps_playing().await;
    second.keeps_playing().await;
    host.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_host_closes_the_room_for_everyone() {
    let server = Server::start().await;
    let (code, key) = open(server.address, r#"{"scene":"arena"}"#).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut host = Client::host(server.address, &code, "Host", key).await;
    let mut guest = Client::join(server.address, &code, "Guest").await;
    host.send(&ClientMessage::CloseRoom).await;
    host.is_refused(Refusal::RoomClosed).await;
    guest.is_refused(Refusal::RoomClosed).await;
    let mut late = Client::connect(server.address, &code).await;
    late.is_refused(Refusal::NoSuchRoom).await;
    ann.keeps_playing().await;
    // The next room of the host is told to those who were in the closed one.
    let next = async |token: Token| {
        let body = format!(r#"{{"token":"{}"}}"#, token.text());
        post(server.address, "/api/next", &body).await.json()["code"].as_str().map(str::to_owned)
    };
    assert_eq!(next(guest.token).await, None);
    let after = format!(r#"{{"scene":"pile","private":true,"after":"{}"}}"#, key.text());
    let (code, _) = open(server.address, &after).await;
    assert_eq!(next(guest.token).await, Some(code));
    assert_eq!(next(ann.token).await, None, "of another room");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn only_the_host_may_kick_or_close() {
    let server = Server::start().await;
    let (code, key) = open(server.address, r#"{"scene":"arena"}"#).await;
    let (other_code, other_key) = open(server.address, r#"{"scene":"arena"}"#).await;
    let mut forged = key;
    forged.0[20] ^= 1;
    let mut ann = Client::join(server.address, &code, "Ann").await;
    // The key of another room, a forged key, and a seat's token instead of a key.
    let mut eves = Vec::new();
    for key in [other_key, forged, ann.token] {
        eves.push(Client::host(server.address, &code, "Eve", key).await);
    }
    for eve in &mut eves {
        assert!(!eve.host);
        for message in [ClientMessage::Kick { seat: Seat(ann.seat) }, ClientMessage::CloseRoom] {
            eve.send(&message).await;
            is_denied(eve).await;
        }
    }
    ann.keeps_playing().await;
    assert_eq!(ann.newest.players.len(), 4);
    assert_eq!(get(server.address, &format!("/{other_code}")).await.status, 200);
}
