//! Tests of what players ask of their room: kicks, new looks, the list of bots, joins and emotes.

use super::*;

#[test]
fn a_host_kicks_players_but_no_host() {
    let (ends, _outside) = room("hosts", Duration::MAX);
    let mut open = open(&ends).open;
    let people = [Some(1), Some(1), None].map(|hosted| {
        let (join, inbox, outbox) = join();
        open.seat(Join { hosted, ..join }, &mut None, Instant::now());
        (inbox, outbox)
    });
    open.room.tick();
    people.iter().for_each(|(_, outbox)| drop(control_messages(outbox)));
    for seat in [0, 1, 2] {
        people[0].0.try_send(Some(ClientMessage::Kick { seat: Seat(seat) })).expect("a place");
    }
    open.empty_inboxes();
    assert_eq!(control_messages(&people[0].1), [ServerMessage::Denied, ServerMessage::Denied]);
    assert_eq!((open.room.players(), open.sessions.members.len()), (2, 2));
    assert_eq!(end_of(&people[2].1), Refusal::Kicked);
    assert!(open.kick(Seat(1), KickScope::Player), "operators may");
    assert_eq!(end_of(&people[1].1), Refusal::Kicked);
}

#[test]
fn a_player_changes_name_and_colour_but_not_all_the_time() {
    let (ends, _outside) = room("looks", Duration::MAX);
    let mut open = open(&ends).open;
    let people = [(); 2].map(|()| {
        let (join, inbox, outbox) = join();
        open.seat(join, &mut None, Instant::now());
        (inbox, outbox)
    });
    let looks = |open: &OpenRoom| {
        let players = open.room.snapshot().players.iter();
        players.map(|p| (p.appearance.name.to_string(), p.appearance.color)).collect::<Vec<_>>()
    };
    let ask = |open: &mut OpenRoom, name: &str, color| {
        let appearance = Appearance { name: name.into(), color };
        let asked = people[1].0.try_send(Some(ClientMessage::Look { appearance }));
        asked.expect("a place");
        open.empty_inboxes();
        open.room.tick();
        looks(open).swap_remove(1)
    };
    open.room.tick();
    assert_eq!(looks(&open), [("Ann".into(), 0), ("Ann 2".into(), 1)]);
    assert_eq!(ask(&mut open, "Bob", 5), ("Bob".into(), 5));
    assert_eq!(ask(&mut open, "Cid", 6), ("Bob".into(), 5), "too soon");
    for _ in 0..LOOK_TICKS {
        open.room.tick();
    }
    // Neither the colour nor a name that looks the same can be taken from another player.
    assert_eq!(ask(&mut open, "\u{410}nn", 0), ("Ann 2".into(), 1));
    open.kick(Seat(1), KickScope::Player);
    assert_eq!(end_of(&people[1].1), Refusal::Kicked);
    let address = IpAddr::from([127, 0, 0, 1]);
    assert!(open.admission.is_shut(address, "Ann", None, 200), "under the last name asked for");
}

#[test]
fn bots_are_told_to_those_who_ask_when_they_change() {
    let (mut ends, _outside) = room("bots", Duration::MAX);
    let splash = Scene::built_in().into_iter().find(|scene| scene.name == "splash");
    let splash = Arc::new(splash.expect("a shipped scene"));
    ends.info = Arc::new(RoomInfo::new("bots", 1, false, None, &splash));
    let mut open = open(&ends).open;
    let people = [Some(1), None].map(|hosted| {
        let (join, inbox, outbox) = join();
        open.seat(Join { hosted, ..join }, &mut None, Instant::now());
        (inbox, outbox)
    });
    let mut play = |asks: &[ClientMessage]| {
        for message in asks {
            people[0].0.try_send(Some(message.clone())).expect("a place");
        }
        open.empty_inboxes();
        open.room.tick();
        open.feed(Instant::now());
        let told = |outbox: &Outbox| {
            let messages = control_messages(outbox).into_iter();
            let bots = messages.filter_map(|message| match message {
                ServerMessage::Bots { seats } => Some(seats.len()),
                _ => None,
            });
            bots.collect::<Vec<_>>()
        };
        assert!(told(&people[1].1).is_empty(), "who did not ask");
        told(&people[0].1)
    };
    assert!(play(&[]).is_empty());
    assert_eq!(play(&[ClientMessage::FollowBots, ClientMessage::FollowBots]), [2]);
    assert!(play(&[]).is_empty());
    assert_eq!(play(&[ClientMessage::Kick { seat: Seat(3) }]), [1]);
}

#[test]
fn joins_beyond_the_limit_of_a_tick_are_answered_in_the_next() {
    let (ends, _outside) = room("queue", Duration::MAX);
    let mut open = open(&ends).open;
    let (joins, receiver) = sync_channel(limits::JOINS_WAITING_MAX);
    let waiting: Vec<_> = (0..JOINS_PER_WAKEUP + 1)
        .map(|_| {
            let (join, inbox, outbox) = join();
            joins.send(join).expect("a place");
            (inbox, outbox)
        })
        .collect();
    let last = &waiting[JOINS_PER_WAKEUP].1;
    let (now, clock, mut entrance) = (Instant::now(), TestClock::new(), Entrance::new(&receiver));
    for (players, answers) in [(JOINS_PER_WAKEUP, 0), (JOINS_PER_WAKEUP + 1, 1)] {
        assert_eq!(entrance.before(&Wakeup { now, clock: &clock }, &mut open), Ok(true));
        assert_eq!((open.room.players(), control_messages(last).len()), (players, answers));
    }
}

#[test]
fn all_see_an_emote_and_the_next_of_its_player_two_seconds_later() {
    let (ends, _outside) = room("emotes", Duration::MAX);
    let mut open = open(&ends).open;
    let people = [(); 2].map(|()| {
        let (join, inbox, outbox) = join();
        open.seat(join, &mut None, Instant::now());
        (inbox, outbox)
    });
    people.iter().for_each(|(_, outbox)| drop(control_messages(outbox)));
    for tick in 0..=EMOTE_TICKS {
        people[1]
            .0
            .try_send(Some(ClientMessage::Emote { emote: (tick % 8) as u8 }))
            .expect("a place");
        open.empty_inboxes();
        open.room.tick();
    }
    let shown = [0, EMOTE_TICKS % 8];
    let shown = shown.map(|emote| ServerMessage::Emote { seat: Seat(1), emote: emote as u8 });
    for (_, outbox) in &people {
        assert_eq!(control_messages(outbox), shown);
    }
}
