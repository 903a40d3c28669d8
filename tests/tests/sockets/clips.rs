//! Tests of clips from a server, which are the last 20 seconds as a listed or unlisted replay.

use crate::client::Client;
use crate::hosts::open;
use crate::http::get;
use crate::replays::{Dir, play, recording, verify};
use crate::server::Server;
use jostle_protocol::replay::{Ending, Replay};
use jostle_protocol::{ClientMessage, ClipRefusal, ServerMessage};
use std::sync::Arc;

/// Requests a clip and returns its name or the reason for the refusal.
async fn clip(client: &mut Client) -> Result<String, ClipRefusal> {
    client.send(&ClientMessage::Clip).await;
    loop {
        if let ServerMessage::Clip { kept } = client.message().await {
            return kept;
        }
    }
}

/// Downloads a clip and reads it as a replay.
async fn fetch(server: &Server, name: &str) -> Arc<Replay> {
    let file = get(server.address, &format!("/replays/{name}.jostle")).await;
    assert_eq!(file.status, 200);
    let replay = Arc::new(Replay::read(file.body).expect("a replay"));
    assert_eq!(replay.ending(), Ending::Whole);
    verify(&replay).await;
    replay
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_clip_is_kept_and_the_game_goes_on() {
    let dir = Dir::new("clip");
    let server = recording(dir.settings()).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    play(&mut ann, &mut bob, 120).await;
    let name = clip(&mut ann).await.expect("a clip");
    let replay = fetch(&server, &name).await;
    assert!(replay.last_tick() >= 120 && replay.last_tick() - replay.first_tick() <= 1200);
    assert_eq!(clip(&mut ann).await, Err(ClipRefusal::TooMany), "too soon");
    assert!(clip(&mut bob).await.is_ok(), "each player has a share");
    let list = get(server.address, "/api/replays").await;
    assert!(String::from_utf8(list.body).expect("text").contains(&name));
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_clip_of_a_private_room_is_found_by_its_name_only() {
    let dir = Dir::new("private-clip");
    let server = recording(dir.settings()).await;
    let (code, key) = open(server.address, r#"{"scene":"arena","private":true}"#).await;
    let mut host = Client::host(server.address, &code, "Host", key).await;
    host.plays(30).await;
    let name = clip(&mut host).await.expect("a clip");
    let clip = fetch(&server, &name).await;
    assert!(clip.last_tick() >= 30);
    assert!(!name.contains(&code) && !clip.start().room.contains(&code), "it lets nobody in");
    let list = get(server.address, "/api/replays").await;
    assert!(!String::from_utf8(list.body).expect("text").contains(&name));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_without_replays_keeps_no_clips() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    assert_eq!(clip(&mut ann).await, Err(ClipRefusal::Off));
    ann.keeps_playing().await;
}
