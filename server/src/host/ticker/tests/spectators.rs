//! What spectators may do, and the limits on them.

use super::*;

/// Plays a room with one player for some ticks, with or without spectators who send every kind of message. Returns the
/// state hash of each tick, and the metrics.
fn hashes(watched: bool) -> (Vec<u64>, String) {
    let (ends, _outside) = room("watched", Duration::MAX);
    let mut open = open(&ends).open;
    let (player, inbox, _outbox) = join();
    open.seat(player, &mut None, Instant::now());
    let spectators: Vec<_> = (0..if watched { 3 } else { 0 })
        .map(|_| {
            let (join, inbox, outbox) = join();
            open.seat(Join { role: Role::Spectator, ..join }, &mut None, Instant::now());
            (inbox, outbox)
        })
        .collect();
    let hashes = (1..=200u32).map(|seq| {
        let input = |buttons| {
            let input = jostle_game::Input::new(buttons, None);
            Some(ClientMessage::Input { seq, ack_tick: 0, input })
        };
        inbox.try_send(input(jostle_game::Buttons((seq / 20) as u16 % 32))).expect("a place");
        for (spectator, _) in &spectators {
            for message in [
                input(jostle_game::Buttons::ALL),
                Some(ClientMessage::View { size: jostle_sim::Vec2::splat(40.0) }),
                Some(ClientMessage::Kick { seat: Seat(0) }),
                Some(ClientMessage::CloseRoom),
                Some(ClientMessage::Clip),
                Some(ClientMessage::Emote { emote: 1 }),
            ] {
                spectator.try_send(message).expect("a place");
            }
        }
        open.empty_inboxes();
        open.room.tick();
        open.feed(Instant::now());
        open.room.game().hash()
    });
    let hashes = hashes.collect();
    assert!(!open.closed && open.room.players() == 1);
    for (_, outbox) in &spectators {
        assert!(outbox.end_reason().is_none());
    }
    (hashes, open.host.metrics.text(Default::default()))
}

#[test]
fn a_spectator_changes_nothing() {
    let (watched, metrics) = hashes(true);
    assert_eq!(watched, hashes(false).0);
    // All six kinds of message except the view.
    let ignored = "jostle_messages_ignored_total{kind=\"spectator\"} 3000";
    assert!(metrics.contains(ignored), "{metrics}");
}

#[test]
fn a_room_has_a_limit_of_spectators_and_of_each_network() {
    let (ends, _outside) = room("crowd", Duration::MAX);
    let mut open = open(&ends).open;
    let mut kept = Vec::new();
    let mut watch = |host: [u8; 4]| {
        let (join, inbox, outbox) = join();
        let join = Join { role: Role::Spectator, address: IpAddr::from(host), ..join };
        open.seat(join, &mut None, Instant::now());
        kept.push((inbox, Arc::clone(&outbox)));
        outbox.end_reason()
    };
    for _ in 0..limits::SPECTATORS_MAX / 2 {
        assert_eq!(watch([127, 0, 0, 1]), None);
    }
    assert_eq!(watch([127, 0, 0, 1]), Some(Refusal::TooManySpectators));
    let admitted = (0..=255).filter(|&net| watch([10, net, 0, 1]).is_none()).count();
    assert_eq!(admitted, limits::SPECTATORS_MAX / 2);
    assert_eq!(open.sessions.spectators.len(), limits::SPECTATORS_MAX);
}
