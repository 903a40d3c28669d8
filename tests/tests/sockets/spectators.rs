//! Checks that spectators can watch a full room, are counted separately, and cannot affect the game.

use crate::client::Client;
use crate::hosts::open;
use crate::http::get;
use crate::server::Server;
use jostle_game::{Buttons, Input, Seat};
use jostle_protocol::{Appearance, ClientMessage, Role, ServerMessage, Token, VERSION};
use std::net::SocketAddr;

/// A scene with one seat and a hero that moves freely.
const DUEL: &str = "title = \"Duel\"\nsize = [40, 30]\ngroups = [\"a\"]\n[limits]\nplayers = 1\n";

/// Connects a spectator and waits for its first snapshot.
async fn watch(server: SocketAddr, room: &str, host_key: Option<Token>) -> Client {
    let mut client = Client::connect(server, room).await;
    let appearance = Appearance { name: "Eye".into(), color: 1 };
    let role = Role::Spectator;
    let hello = ClientMessage::Hello { version: VERSION, appearance, token: None, host_key, role };
    client.send(&hello).await;
    let welcome = client.message().await;
    assert!(matches!(welcome, ServerMessage::Welcome { seat: None, .. }), "{welcome:?}");
    client.snapshot().await;
    client
}

/// A room's entry in the server's list.
async fn listed(server: &Server, room: &str) -> [u64; 3] {
    let list = get(server.address, "/api/rooms").await.json();
    let rooms = list["rooms"].as_array().expect("a list");
    let entry = rooms.iter().find(|entry| entry["code"] == room).expect("the room");
    ["players", "connected", "spectators"].map(|field| entry[field].as_u64().expect("a number"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_room_admits_spectators_who_count_apart() {
    let server = Server::start_with_scene("duel", DUEL).await;
    let mut ann = Client::join(server.address, "duel", "Ann").await;
    let mut eye = watch(server.address, "duel", None).await;
    let ticks = eye.newest.tick + 60;
    eye.until("a second of play", |snapshot| snapshot.tick >= ticks).await;
    assert_eq!(eye.newest.players.len(), 1);
    assert_eq!(listed(&server, "duel").await, [1, 1, 1]);
    server.counts("jostle_joins_total{how=\"spectator\"}", 1).await;
    drop(eye);
    server.counts("jostle_leaves_total{how=\"spectator\"}", 1).await;
    ann.keeps_playing().await;
    assert_eq!(listed(&server, "duel").await, [1, 1, 0]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_spectator_can_do_nothing_even_with_the_key_of_the_host() {
    let server = Server::start().await;
    let (code, key) = open(server.address, r#"{"scene":"arena"}"#).await;
    let mut ann = Client::join(server.address, &code, "Ann").await;
    let mut eye = watch(server.address, &code, Some(key)).await;
    let input = Input::new(Buttons::RIGHT, None);
    for message in [
        ClientMessage::Input { seq: 1, ack_tick: eye.newest.tick as u16, input },
        ClientMessage::Kick { seat: Seat(ann.seat) },
        ClientMessage::CloseRoom,
        ClientMessage::Clip,
        ClientMessage::Emote { emote: 2 },
    ] {
        eye.send(&message).await;
    }
    server.counts("jostle_messages_ignored_total{kind=\"spectator\"}", 5).await;
    let pong = eye.tick().await;
    assert!(pong > 0, "it may ask for the time");
    let ticks = eye.newest.tick + 30;
    eye.until("some play", |snapshot| snapshot.tick >= ticks).await;
    let names = eye.newest.players.iter().filter(|player| &*player.appearance.name == "Eye");
    assert_eq!(names.count(), 0);
    ann.keeps_playing().await;
}
