//! Tests of hosts and the people in their rooms: removing players, new names and colours, and the next room.

use super::*;
use crate::page::panels::{dialogs, players};
use crate::page::storage::Secret;
use crate::world::replica::News;
use jostle_protocol::{Refusal, Token};

#[test]
fn a_host_confirms_before_a_player_is_removed() {
    let mut browser = Browser::playing();
    let seat = browser.app.screen.replica().expect("a room").room.seat;
    browser.say(clicked("kick", &seat.0.to_string()));
    assert_eq!(browser.app.top(), Layer::Ask);
    browser.click("cancel");
    assert!(browser.app.top() == Layer::Page && !kicked(&browser));
    browser.say(clicked("kick", &seat.0.to_string()));
    browser.click("confirm");
    assert!(browser.app.top() == Layer::Page && kicked(&browser));
    browser.say(clicked("kick", "99"));
    assert_eq!(browser.app.top(), Layer::Page, "no such player");
    browser.say(clicked("kick", &seat.0.to_string()));
    browser.click("ask-network");
    browser.click("confirm");
    assert_eq!(browser.sent.last(), Some(&ClientMessage::KickNetwork { seat }));
}

#[test]
fn a_bot_is_removed_without_a_question() {
    let mut browser = Browser::playing();
    let seat = browser.app.screen.replica().expect("a room").room.seat;
    assert!(browser.sent.contains(&ClientMessage::FollowBots));
    browser.server_says(&ServerMessage::Bots { seats: vec![seat] });
    browser.say(clicked("kick", &seat.0.to_string()));
    assert!(browser.app.top() == Layer::Page && kicked(&browser));
    let list = players::view(&browser.app);
    let last = list.items_of("#players").and_then(|items| items.last()?.text_of(""));
    assert_eq!(last, Some("0 players, 1 bot"));
}

fn kicked(browser: &Browser) -> bool {
    browser.sent.iter().any(|message| matches!(message, ClientMessage::Kick { .. }))
}

#[test]
fn a_player_changes_name_and_colour_in_the_room() {
    let mut browser = Browser::playing();
    let asked = |browser: &Browser| {
        let looks = browser.sent.iter().filter_map(|message| match message {
            ClientMessage::Look { appearance } => Some(appearance.name.to_string()),
            _ => None,
        });
        looks.collect::<Vec<_>>()
    };
    let own = players::view(&browser.app);
    assert_eq!(own.items_of("#players").map(|items| items[0].name), Some("own-item"));
    browser.click("rename");
    assert_eq!(dialogs::view(&browser.app).focus, Some("#own-name"));
    browser.say(Event::LookChosen("Bob".into(), 5));
    // The room would drop changes that follow too soon, so only the last one is sent later.
    browser.say(Event::LookChosen("Ci".into(), 5));
    browser.say(Event::LookChosen("Cid".into(), 6));
    assert_eq!(asked(&browser), ["Bob"]);
    browser.wait(3000);
    assert_eq!(asked(&browser), ["Bob", "Cid"]);
    let look = browser.app.screen.replica().and_then(|replica| replica.room.own_look().cloned());
    assert_eq!(look, Appearance::new("Cid", 6).ok());
    assert_eq!(browser.app.visit.own_color, 6);
    let renamed = |(_, news): &(usize, News)| matches!(news, News::Renamed(before, _) if &*before.name == "Ann");
    assert!(browser.app.visit.news.lines.iter().any(renamed));
    assert_eq!(browser.stored("jostle.name").as_deref(), Some("Cid"));
    browser.say(Event::LookChosen("  ".into(), 6));
    assert!(!browser.app.settings.note.is_empty(), "says what is wrong");
    // The next hello has the new name.
    browser.socket(SocketEvent::Closed { code: 1006 });
    browser.wait(600);
    browser.accept("arena");
    let hello = browser.sent.iter().rev().find_map(|message| match message {
        ClientMessage::Hello { appearance, .. } => Some(appearance.name.to_string()),
        _ => None,
    });
    assert_eq!(hello.as_deref(), Some("Cid"));
}

#[test]
fn a_host_who_closes_the_room_sees_a_notice_of_their_own() {
    let mut browser = Browser::playing();
    browser.click("close-room");
    browser.press("Escape", "Escape");
    assert_eq!(browser.app.top(), Layer::Page);
    browser.click("close-room");
    browser.click("confirm");
    assert!(browser.sent.iter().any(|message| matches!(message, ClientMessage::CloseRoom)));
    let done = browser.server_says(&ServerMessage::Refused { refusal: Refusal::RoomClosed });
    assert!(has(&done, "jostle.host.arena"), "{done:?}");
    let text = browser.app.notice().map(|card| card.text);
    assert_eq!(text, Some(strings::CLOSED_BY_YOU.text));
}

#[test]
fn the_players_of_a_closed_room_can_follow_its_host() {
    let key = Token([9; limits::TOKEN_BYTES]);
    let close = |browser: &mut Browser| {
        browser.app.ctx.storage.set_secret(Secret::Host, "arena", Some(key));
        browser.app.ctx.storage.set_secret(Secret::Seat, "arena", Some(key));
        browser.server_says(&ServerMessage::Refused { refusal: Refusal::RoomClosed });
    };
    let mut host = Browser::playing();
    host.click("close-room");
    host.click("confirm");
    close(&mut host);
    host.wait(4000);
    host.click("notice");
    let asked = host.say(Event::SceneClicked("pile".into(), form("Ann")));
    assert!(has(&asked, &format!("after: Some({:?})", key.text())), "{asked:?}");
    let next = Request::Next(key.text());
    assert!(!host.effects.contains(&Effect::Request(next.clone())), "the host knows");

    let mut guest = Browser::playing();
    close(&mut guest);
    guest.wait(4000);
    assert!(guest.effects.contains(&Effect::Request(next.clone())));
    guest.say(Event::Answered(next.clone(), Some("{}".into())));
    assert_eq!(guest.title(), "Room closed");
    guest.say(Event::Answered(next, Some(r#"{"code":"oak"}"#.into())));
    assert_eq!(guest.title(), strings::NEXT_ROOM.title);
    let entered = guest.click("notice");
    assert!(has(&entered, "Connect { path: \"/oak\""), "{entered:?}");
}
