//! Properties of a room and the actions of several clients.

use crate::part;
use jostle_game::{Scene, Seat};
use jostle_protocol::limits::TOKEN_BYTES;
use jostle_protocol::{ClientMessage, Role, ServerMessage, SnapshotStream, Token, WelcomeSeat};
use jostle_room::{Claim, Rate, Room, Subscriber};
use std::sync::{Arc, OnceLock};

const TICKS_MAX: u32 = 40;

/// Parts are messages from clients; the low six bits of the kind are the seat. If bit 6 is set, the client disconnects,
/// or leaves for good if the part is empty; if bit 7 is set, a tick is played first. Every client must end up with the
/// state that the room shows.
pub fn room(bytes: &[u8]) {
    let mut room = Room::new("fuzz", Arc::clone(scene()), 3);
    let mut clients: Vec<Client> = Vec::new();
    let (mut rest, mut ticks) = (bytes, 0);
    while let Some((kind, message)) = part(&mut rest) {
        if kind & 0x80 != 0 && ticks < TICKS_MAX {
            ticks += 1;
            room.tick();
            clients.iter_mut().for_each(|client| client.listen(&room));
        }
        let seat = Seat(u16::from(kind & 0x3f));
        if kind & 0x40 != 0 {
            if message.is_empty() {
                room.leave(seat);
            } else {
                room.disconnect(seat);
            }
        } else {
            say(message, seat, &mut room, &mut clients);
        }
    }
    room.tick();
    clients.iter_mut().for_each(|client| client.listen(&room));
    assert!(room.connected() <= room.players());
    assert!(room.players() <= usize::from(scene().players_max));
}

fn scene() -> &'static Arc<Scene> {
    static SCENE: OnceLock<Arc<Scene>> = OnceLock::new();
    let arena = || Scene::built_in().into_iter().find(|scene| scene.name == "arena");
    SCENE.get_or_init(|| Arc::new(arena().expect("a built-in scene")))
}

fn say(message: &[u8], seat: Seat, room: &mut Room, clients: &mut Vec<Client>) {
    match ClientMessage::decode(message) {
        // The room does not know spectators, because they only read.
        Ok(ClientMessage::Hello { role: Role::Spectator, .. }) => {
            clients.push(Client::begin(room, Rate::ALL[clients.len() % Rate::ALL.len()]));
        }
        Ok(ClientMessage::Hello { appearance, token, .. }) => {
            // Unsigned tokens start with the seat and the serial number.
            let claim = token.map(|Token([seat, serial, ..])| Claim {
                seat: Seat(seat.into()),
                serial: u64::from(serial),
            });
            if let Ok(joined) = room.join(appearance, claim) {
                let fresh = Token([7; TOKEN_BYTES]);
                let seat = WelcomeSeat { seat: joined.claim.seat, host: false, token: fresh };
                let welcome = room.welcome(Some(seat));
                let welcome = ServerMessage::decode(&welcome).expect("a readable welcome");
                assert!(
                    matches!(welcome, ServerMessage::Welcome { seat: Some(own), .. } if own == seat)
                );
                assert_eq!(joined.resumed, claim.is_some());
                clients.push(Client::begin(room, Rate::ALL[clients.len() % Rate::ALL.len()]));
            }
        }
        Ok(ClientMessage::Input { seq, input, .. }) => {
            room.input(seat, seq, input);
        }
        Ok(ClientMessage::View { size }) => room.view(seat, size),
        Ok(_) | Err(_) => {}
    }
}

/// A client that reads every snapshot.
struct Client {
    reader: Subscriber,
    stream: SnapshotStream,
}

impl Client {
    fn begin(room: &mut Room, rate: Rate) -> Client {
        let (reader, keyframe) = room.subscribe(rate);
        let mut stream = SnapshotStream::default();
        stream.decode(&keyframe).expect("a readable keyframe");
        Client { reader, stream }
    }

    fn listen(&mut self, room: &Room) {
        if let Some(message) = room.message(&self.reader) {
            self.stream.decode(message).expect("a readable snapshot");
            let newest = self.stream.newest().expect("a snapshot was read");
            assert_eq!(&**newest, room.snapshot(), "both ends hold the same");
        }
    }
}
