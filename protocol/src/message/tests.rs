use super::*;
use crate::limits::{EMOTES, NODES_MAX, POINTER_MAX, TOKEN_BYTES, VIEW_MAX};
use jostle_game::{Buttons, SEATS_MAX};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn config(cases: u32) -> ProptestConfig {
    let mut config = ProptestConfig::with_cases(cases);
    config.rng_seed = RngSeed::Fixed(0x4a4f_5354);
    config.failure_persistence = None;
    config
}

fn appearances() -> impl Strategy<Value = Appearance> {
    let made = (any::<String>(), 0..crate::limits::COLORS);
    let cleaned = made.prop_filter_map("name", |(name, color)| {
        let name: String = name.chars().take(20).collect();
        Appearance::new(&name, color).ok()
    });
    let letters = ("[a-zäß日🙂 ]{1,15}x", 0..crate::limits::COLORS);
    prop_oneof![cleaned, letters.prop_map(|(name, color)| Appearance::new(&name, color).unwrap())]
}

fn inputs() -> impl Strategy<Value = Input> {
    let axis = || -POINTER_MAX..=POINTER_MAX;
    let pointer = proptest::option::of((axis(), axis()));
    (0..=Buttons::ALL.0, pointer).prop_map(|(buttons, pointer)| {
        Input::new(Buttons(buttons), pointer.map(|(x, y)| Vec2::new(x, y)))
    })
}

fn tokens() -> impl Strategy<Value = Token> {
    let bytes = proptest::collection::vec(any::<u8>(), TOKEN_BYTES);
    bytes.prop_map(|bytes| Token(bytes.try_into().expect("that many")))
}

fn client_messages() -> impl Strategy<Value = ClientMessage> {
    let token = || proptest::option::of(tokens());
    let roles = || proptest::sample::select(vec![Role::Player, Role::Spectator]);
    let hello = (appearances(), token(), token(), roles()).prop_map(
        |(appearance, token, host_key, role)| ClientMessage::Hello {
            version: VERSION,
            appearance,
            token,
            host_key,
            role,
        },
    );
    let input = (any::<u32>(), any::<u16>(), inputs())
        .prop_map(|(seq, ack_tick, input)| ClientMessage::Input { seq, ack_tick, input });
    let ping = any::<u32>().prop_map(|stamp| ClientMessage::Ping { stamp });
    let side = || f32::MIN_POSITIVE..=VIEW_MAX;
    let view = (side(), side()).prop_map(|(x, y)| ClientMessage::View { size: Vec2::new(x, y) });
    let kick = (0..SEATS_MAX).prop_map(|seat| ClientMessage::Kick { seat: Seat(seat as u16) });
    let network = (0..SEATS_MAX).prop_map(|seat| Seat(seat as u16));
    let network = network.prop_map(|seat| ClientMessage::KickNetwork { seat });
    let emote = (0..EMOTES).prop_map(|emote| ClientMessage::Emote { emote });
    let look = appearances().prop_map(|appearance| ClientMessage::Look { appearance });
    let plain = [ClientMessage::CloseRoom, ClientMessage::Clip, ClientMessage::FollowBots];
    let plain = proptest::sample::select(plain.to_vec());
    prop_oneof![hello, input, ping, view, kick, network, emote, look, plain]
}

fn origins() -> impl Strategy<Value = String> {
    "https?://[a-z0-9.-]{1,40}(:[0-9]{1,5})?"
}

fn server_messages() -> impl Strategy<Value = ServerMessage> {
    let texts = ("[a-z0-9-]{0,32}", "[a-z-]{0,32}", any::<String>());
    let seat = || (0..SEATS_MAX as u16).prop_map(Seat);
    let held = (seat(), any::<bool>(), tokens());
    let held = held.prop_map(|(seat, host, token)| WelcomeSeat { seat, host, token });
    let welcome = (proptest::option::of(held), any::<u32>(), texts).prop_map(
        |(seat, tick, (room, scene_name, scene))| ServerMessage::Welcome {
            seat,
            tick,
            room,
            scene_name,
            scene,
        },
    );
    let refusals = proptest::sample::select(ClipRefusal::ALL.to_vec()).prop_map(Err);
    let kept = prop_oneof!["[a-z0-9-]{0,96}".prop_map(Ok), refusals];
    prop_oneof![
        welcome,
        proptest::sample::select(&Refusal::ALL[..])
            .prop_map(|refusal| ServerMessage::Refused { refusal }),
        any::<(u8, bool)>()
            .prop_map(|(seconds, keeps_room)| ServerMessage::Draining { seconds, keeps_room }),
        (any::<u32>(), any::<u32>()).prop_map(|(stamp, tick)| ServerMessage::Pong { stamp, tick }),
        Just(ServerMessage::Denied),
        origins().prop_map(|url| ServerMessage::Moved { url }),
        proptest::collection::vec(origins(), 0..=NODES_MAX)
            .prop_map(|urls| ServerMessage::Nodes { urls }),
        (seat(), 0..EMOTES).prop_map(|(seat, emote)| ServerMessage::Emote { seat, emote }),
        kept.prop_map(|kept| ServerMessage::Clip { kept }),
        proptest::collection::btree_set(0..SEATS_MAX as u16, 0..20).prop_map(|seats| {
            ServerMessage::Bots { seats: seats.into_iter().map(Seat).collect() }
        }),
        any::<Vec<u8>>().prop_map(|mut bytes| {
            bytes.insert(0, 0x80 | bytes.len() as u8);
            ServerMessage::Snapshot(bytes)
        }),
    ]
}

proptest! {
    #![proptest_config(config(2_000))]

    #[test]
    fn client_messages_round_trip(message in client_messages()) {
        let bytes = message.encode();
        prop_assert!(bytes.len() <= CLIENT_MESSAGE_BYTES_MAX);
        prop_assert_eq!(ClientMessage::decode(&bytes), Ok(message));
    }

    #[test]
    fn server_messages_round_trip(message in server_messages()) {
        prop_assert_eq!(ServerMessage::decode(&message.encode()), Ok(message));
    }

    #[test]
    fn every_cut_is_refused(message in client_messages()) {
        let bytes = message.encode();
        for end in 0..bytes.len() {
            let found = ClientMessage::decode(&bytes[..end]);
            prop_assert!(matches!(found, Err(DecodeError::Truncated { .. })), "{found:?}");
        }
    }

    #[test]
    fn one_byte_more_is_refused(message in client_messages(), more in any::<u8>()) {
        let mut bytes = message.encode();
        bytes.push(more);
        prop_assert_eq!(ClientMessage::decode(&bytes), Err(DecodeError::Trailing { count: 1 }));
    }
}

/// Whether an accepted message encodes to the bytes from which it was decoded. There are two exceptions: pointers are
/// rounded, and a hello with a different version keeps only its version.
fn has_one_form(message: &ClientMessage, bytes: &[u8]) -> bool {
    match message {
        ClientMessage::Hello { version, .. } if *version != VERSION => true,
        ClientMessage::Input { .. } => {
            ClientMessage::decode(&message.encode()).as_ref() == Ok(message)
        }
        _ => message.encode() == bytes,
    }
}

proptest! {
    #![proptest_config(config(50_000))]

    #[test]
    fn any_bytes_are_safe(bytes in proptest::collection::vec(any::<u8>(), 0..48), kind in 0u8..12) {
        let bytes = [&[kind][..], &bytes].concat();
        if let Ok(message) = ClientMessage::decode(&bytes) {
            prop_assert!(has_one_form(&message, &bytes));
        }
        if let Ok(message) = ServerMessage::decode(&bytes) {
            prop_assert_eq!(message.encode(), bytes);
        }
    }

    #[test]
    fn flipped_bits_are_safe(
        client in client_messages(),
        server in server_messages(),
        flips in proptest::collection::vec(any::<prop::sample::Index>(), 1..4),
    ) {
        let (mut client, mut server) = (client.encode(), server.encode());
        for flip in &flips {
            let bit = flip.index(client.len() * 8);
            client[bit / 8] ^= 1 << (bit % 8);
            let bit = flip.index(server.len() * 8);
            server[bit / 8] ^= 1 << (bit % 8);
        }
        if let Ok(message) = ClientMessage::decode(&client) {
            prop_assert!(has_one_form(&message, &client));
        }
        if let Ok(message) = ServerMessage::decode(&server) {
            prop_assert_eq!(message.encode(), server);
        }
    }
}

/// The bytes 1, 2, 3 and so on.
fn counted() -> Token {
    Token(std::array::from_fn(|place| place as u8 + 1))
}

fn hello(version: u16) -> ClientMessage {
    let appearance = Appearance::new("Ann", 3).unwrap();
    let (token, role) = (Some(counted()), Role::Player);
    ClientMessage::Hello { version, appearance, token, host_key: None, role }
}

#[test]
fn client_messages_have_the_documented_bytes() {
    let bytes = [&[0, 5, 0, 3, b'A', b'n', b'n', 3, 1][..], &counted().0, &[0, 0]];
    assert_eq!(hello(VERSION).encode(), bytes.concat());
    let watches = ClientMessage::Hello {
        version: VERSION,
        appearance: Appearance::new("Bo", 0).unwrap(),
        token: None,
        host_key: None,
        role: Role::Spectator,
    };
    assert_eq!(watches.encode(), [0, 5, 0, 2, b'B', b'o', 0, 0, 0, 1]);

    let input = Input::new(Buttons(0x90), Some(Vec2::new(1.0, -2.5)));
    let bytes = [1, 0xac, 2, 0x34, 0x12, 0x90, 1, 1, 0, 0, 0x80, 0x3f, 0, 0, 0x20, 0xc0];
    assert_eq!(ClientMessage::Input { seq: 300, ack_tick: 0x1234, input }.encode(), bytes);
    let rest = ClientMessage::Input { seq: 1, ack_tick: 2, input: Input::default() };
    assert_eq!(rest.encode(), [1, 1, 2, 0, 0, 0]);

    assert_eq!(ClientMessage::Ping { stamp: 0x0403_0201 }.encode(), [2, 1, 2, 3, 4]);
    let view = ClientMessage::View { size: Vec2::new(1.0, 2.0) };
    assert_eq!(view.encode(), [3, 0, 0, 0x80, 0x3f, 0, 0, 0, 0x40]);
    assert_eq!(ClientMessage::Kick { seat: Seat(9) }.encode(), [4, 9]);
    assert_eq!(ClientMessage::CloseRoom.encode(), [5]);
    assert_eq!(ClientMessage::Clip.encode(), [6]);
    assert_eq!(ClientMessage::Emote { emote: 7 }.encode(), [7, 7]);
    let appearance = Appearance::new("Bo", 4).unwrap();
    assert_eq!(ClientMessage::Look { appearance }.encode(), [8, 2, b'B', b'o', 4]);
    assert_eq!(ClientMessage::KickNetwork { seat: Seat(9) }.encode(), [9, 9]);
    assert_eq!(ClientMessage::FollowBots.encode(), [10]);
}

#[test]
fn server_messages_have_the_documented_bytes() {
    let welcome = ServerMessage::Welcome {
        seat: Some(WelcomeSeat { seat: Seat(2), host: true, token: counted() }),
        tick: 200,
        room: "oak".to_owned(),
        scene_name: "arena".to_owned(),
        scene: "x = 1".to_owned(),
    };
    let texts = [&b"oak"[..], b"\x05arena", b"\x05x = 1"].concat();
    let bytes = [&[0, 1, 2, 1][..], &counted().0, &[0xc8, 1, 3], &texts];
    assert_eq!(welcome.encode(), bytes.concat());
    let watching = ServerMessage::Welcome {
        seat: None,
        tick: 200,
        room: "oak".to_owned(),
        scene_name: "arena".to_owned(),
        scene: "x = 1".to_owned(),
    };
    assert_eq!(watching.encode(), [&[0, 0, 0xc8, 1, 3][..], &texts].concat());
    let refused = ServerMessage::Refused { refusal: Refusal::Closing };
    assert_eq!(refused.encode(), [1, 10]);
    let draining = ServerMessage::Draining { seconds: 5, keeps_room: true };
    assert_eq!(draining.encode(), [2, 5, 1]);
    assert_eq!(ServerMessage::Pong { stamp: 7, tick: 128 }.encode(), [3, 7, 0, 0, 0, 0x80, 1]);
    assert_eq!(ServerMessage::Denied.encode(), [4]);
    let moved = ServerMessage::Moved { url: "http://b:81".to_owned() };
    assert_eq!(moved.encode(), *b"\x05\x0bhttp://b:81");
    let urls = vec!["https://a".to_owned(), "http://b:81".to_owned()];
    assert_eq!(ServerMessage::Nodes { urls }.encode(), *b"\x06\x02\x09https://a\x0bhttp://b:81");
    assert_eq!(ServerMessage::Emote { seat: Seat(3), emote: 5 }.encode(), [7, 3, 5]);
    let kept = Ok("arena-oak-20260101-120000-clip".to_owned());
    assert_eq!(ServerMessage::Clip { kept }.encode(), *b"\x08\0\x1earena-oak-20260101-120000-clip");
    let kept = Err(ClipRefusal::TooMany);
    assert_eq!(ServerMessage::Clip { kept }.encode(), [8, 2]);
    let bots = ServerMessage::Bots { seats: vec![Seat(1), Seat(200)] };
    assert_eq!(bots.encode(), [9, 2, 1, 200, 1]);
    assert!(ServerMessage::decode(&[9, 2, 3, 3]).is_err(), "not in order");
    assert_eq!(ServerMessage::Snapshot(vec![0x89, 8]).encode(), [0x89, 8]);
}

#[test]
fn a_hello_of_another_version_is_decoded_up_to_the_version() {
    let mut bytes = hello(VERSION).encode();
    bytes[1] = 1;
    // The other fields do not matter.
    bytes.truncate(5);
    let found = ClientMessage::decode(&bytes);
    assert!(matches!(found, Ok(ClientMessage::Hello { version: 1, token: None, .. })), "{found:?}");
}

#[test]
fn fields_out_of_range_are_named() {
    let refused = |bytes: &[u8], field| {
        assert_eq!(ClientMessage::decode(bytes), Err(DecodeError::OutOfRange { field }));
    };
    refused(&[11], "kind");
    refused(&[0, 5, 0, 1, b' ', 0, 0], "name");
    refused(&[0, 5, 0, 2, b' ', b'A', 0, 0], "name");
    refused(&[0, 5, 0, 1, b'A', 8, 0], "color");
    refused(&[0, 5, 0, 1, b'A', 0, 2], "token");
    refused(&[0, 5, 0, 1, b'A', 0, 0, 2], "host_key");
    refused(&[0, 5, 0, 1, b'A', 0, 0, 0, 2], "role");
    refused(&[0, 5, 0, 65], "name");
    refused(&[1, 1, 0, 0, 0x80, 0x80, 1, 0], "buttons");
    refused(&[1, 1, 0, 0, 0, 1, 0, 0, 0xc0, 0x7f, 0, 0, 0, 0], "pointer");
    refused(&[1, 1, 0, 0, 0, 1, 0, 0, 0, 0x4a, 0, 0, 0, 0], "pointer");
    refused(&[1, 0x80, 0, 0, 0, 0, 0], "seq");
    refused(&[4, 0x80, 4], "seat");
    refused(&[7, 8], "emote");
    refused(&[3, 0, 0, 0, 0, 0, 0, 0, 0x40], "size");
    refused(&[3, 0, 0, 0, 0x40, 0, 0, 0x80, 0xbf], "size");
    refused(&[3, 0, 0, 0, 0x40, 1, 0, 0x80, 0x49], "size");
    let refused = |bytes: &[u8], field| {
        assert_eq!(ServerMessage::decode(bytes), Err(DecodeError::OutOfRange { field }));
    };
    refused(&[1, 20], "refusal");
    refused(&[0, 1, 0x80, 4], "seat");
    refused(&[7, 3, 8], "emote");
    refused(&[8, 4], "kept");
    refused(b"\x05\x06ws://b", "origin");
    refused(b"\x05\x09http://b/", "origin");
    refused(b"\x06\x02\x08http://b\x07http://", "origin");
    refused(&[6, 9], "urls");
    refused(&[10], "kind");
}

#[test]
fn messages_that_are_too_long_are_refused() {
    let bytes_max = CLIENT_MESSAGE_BYTES_MAX;
    let found = ClientMessage::decode(&vec![0; bytes_max + 1]);
    assert_eq!(found, Err(DecodeError::TooLong { bytes: bytes_max + 1, bytes_max }));
    let bytes_max = SERVER_MESSAGE_BYTES_MAX;
    let found = ServerMessage::decode(&vec![0x80; bytes_max + 1]);
    assert_eq!(found, Err(DecodeError::TooLong { bytes: bytes_max + 1, bytes_max }));
    assert!(ServerMessage::decode(&vec![0x80; bytes_max]).is_ok());
}
