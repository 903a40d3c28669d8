//! The JSON API, which lists scenes and rooms and creates rooms.

use super::read;
use super::response::{Answer, failed, json};
use crate::fleet::directory::{Located, PlaceError};
use crate::fleet::entry::{RoomCounts, RoomFacts};
use crate::fleet::handle::Fleet;
use crate::host::confusables::guests_title;
use crate::host::random;
use crate::host::room_handle::RoomInfo;
use crate::host::room_shares::RoomShares;
use crate::host::rooms::{CreateError, Created};
use crate::host::token_signer::SeatClaim;
use crate::limits;
use crate::limits::networks::network;
use crate::net::assets;
use crate::ops::refusal_log::Foreign;
use crate::state::ServerState;
use hyper::body::Incoming;
use hyper::{Request, StatusCode};
use jostle_game::Scene;
use jostle_protocol::Token;
use jostle_protocol::web::{Posted, ROOMS_LISTED_MAX, RoomCard, Rooms, SceneCard, Scenes};
use percent_encoding::percent_decode_str;
use serde::Deserialize;
use std::cmp::Reverse;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// The answer to `GET /api/scenes`.
pub fn scenes(state: &ServerState) -> Scenes {
    let card = |scene: &Arc<Scene>| {
        let picture = format!("pictures/{}.webp", scene.name);
        let picture = assets::find(state.config.files, &picture);
        let picture = picture.map(|file| assets::address(state.config.files, file));
        state.config.gallery.adopt(SceneCard::of(scene, picture))
    };
    let guest_scenes = Some(state.config.guest_scenes.name());
    Scenes { scenes: state.rooms.scenes().iter().map(card).collect(), guest_scenes }
}

/// The answer to `GET /api/rooms`: the public rooms, or those that match `?find=TEXT`.
pub fn rooms(query: Option<&str>, state: &ServerState) -> Rooms {
    let card = |info: &Arc<RoomInfo>| {
        let own = state.rooms.scenes().iter().map(|scene| scene.title.as_str());
        let title = match info.guest {
            true => guests_title(&info.scene.title, own),
            false => info.scene.title.clone(),
        };
        RoomCard {
            code: info.code.clone(),
            scene: info.scene.name.clone(),
            title,
            players: info.players.load(Ordering::Relaxed) as u32,
            connected: info.connected.load(Ordering::Relaxed) as u32,
            spectators: info.spectators.load(Ordering::Relaxed) as u32,
            players_max: u32::from(info.scene.players_max),
        }
    };
    let open = state.rooms.list();
    let here = open.iter().filter(|info| !info.private).map(card);
    let found = query.and_then(|query| query.strip_prefix("find="));
    let found = found.map(|text| percent_decode_str(text).decode_utf8_lossy().to_lowercase());
    let is_found = |room: &RoomCard| {
        let texts = [&room.code, &room.title];
        found.as_ref().is_none_or(|found| texts.iter().any(|t| t.to_lowercase().contains(found)))
    };
    listed(here.chain(rooms_elsewhere(state)).filter(is_found).collect())
}

/// Reduces a long list to the liveliest rooms, sorted by code, because that order is more stable.
fn listed(mut rooms: Vec<RoomCard>) -> Rooms {
    let total = rooms.len() as u32;
    if rooms.len() > ROOMS_LISTED_MAX {
        rooms.sort_by_key(|room| Reverse(room.connected));
        rooms.truncate(ROOMS_LISTED_MAX);
        rooms.sort_by(|a, b| a.code.cmp(&b.code));
    }
    Rooms { rooms, total }
}

/// The public rooms that other nodes in the fleet play.
fn rooms_elsewhere(state: &ServerState) -> Vec<RoomCard> {
    let Some(fleet) = &state.fleet else { return Vec::new() };
    let card = |(counts, facts): (&RoomCounts, &RoomFacts)| {
        // Only its own node knows the title of a guest's scene.
        let scene = state.rooms.scene(&facts.scene).filter(|_| !facts.guest)?;
        Some(RoomCard {
            code: counts.code.clone(),
            scene: scene.name.clone(),
            title: scene.title.clone(),
            players: counts.players as u32,
            connected: counts.connected as u32,
            spectators: counts.spectators as u32,
            players_max: u32::from(scene.players_max),
        })
    };
    fleet.ask(|directory| directory.listed_elsewhere().filter_map(card).collect())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Create {
    scene: String,
    /// Whether the room is unlisted.
    #[serde(default)]
    private: bool,
    /// Key of the room that the host closed before; its players are led to the new one.
    after: Option<String>,
}

/// A question for the room that the host of a closed room has opened since.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Next {
    /// The player's token in the closed room.
    token: String,
}

/// Creates a room and answers with its code and host key.
pub async fn create_room(
    request: Request<Incoming>,
    address: IpAddr,
    state: &ServerState,
) -> Answer {
    let body = match read::body(request, limits::HTTP_BODY_BYTES_MAX, &state.host).await {
        Ok(body) => body,
        Err(error) => return error.answer(limits::HTTP_BODY_BYTES_MAX),
    };
    let create: Create = match serde_json::from_slice(&body) {
        Ok(create) => create,
        Err(error) => {
            let text = format!(
                "the body must be {{\"scene\":\"NAME\"}}, with \"private\":true for a private room: {error}"
            );
            return failed(StatusCode::BAD_REQUEST, &text);
        }
    };
    let created = match &state.fleet {
        None => state.rooms.create(&create.scene, create.private, address),
        Some(fleet) => create_in_fleet(&create, address, fleet, state).await,
    };
    match created {
        Ok(room) => {
            let key = create.after.as_deref().and_then(Token::parse);
            let closed = key.and_then(|key| state.host.signer.hosted(&key));
            if let Some(number) = closed {
                state.host.successors.lead(number, &room.code, Instant::now());
            }
            self::created(&room)
        }
        Err(error) => no_room(&error, address, state),
    }
}

/// Answers with the code of the room that the host of a closed room has opened since, if there is one and the player was
/// in the closed room.
pub async fn next_room(request: Request<Incoming>, state: &ServerState) -> Answer {
    let body = match read::body(request, limits::HTTP_BODY_BYTES_MAX, &state.host).await {
        Ok(body) => body,
        Err(error) => return error.answer(limits::HTTP_BODY_BYTES_MAX),
    };
    let Ok(Next { token }) = serde_json::from_slice(&body) else {
        return failed(StatusCode::BAD_REQUEST, "the body must be {\"token\":\"DIGITS\"}");
    };
    let claim = Token::parse(&token).and_then(|token| state.host.signer.seat_claim(&token));
    let code = claim.and_then(|SeatClaim { room, claim }| {
        state.host.successors.next(room, claim.serial, Instant::now())
    });
    json(StatusCode::OK, &Posted { code, ..Posted::default() })
}

/// The response when a new room has been opened.
pub fn created(room: &Created) -> Answer {
    let (code, host_key) = (Some(room.code.clone()), Some(room.host_key.text()));
    json(StatusCode::CREATED, &Posted { code, host_key, ..Posted::default() })
}

/// The response when no room could be opened.
pub fn no_room(error: &CreateError, address: IpAddr, state: &ServerState) -> Answer {
    state.refused("no_room_created", address, Foreign(error.to_string().as_bytes()));
    failed(refused_status(error), &error.to_string())
}

/// Checks that this address may open one more room with a guest's scene.
pub fn check_guest(creator: IpAddr, state: &ServerState) -> Result<(), CreateError> {
    state.rooms.check_guest(creator)?;
    state
        .fleet
        .as_ref()
        .map_or(Ok(()), |fleet| check_fleet_shares(state.rooms.max(), creator, fleet))
}

/// Places a room on this node, because no other node has the scene.
pub async fn create_guest_in_fleet(
    scene: &Arc<Scene>,
    private: bool,
    creator: IpAddr,
    fleet: &Fleet,
    state: &ServerState,
) -> Result<Created, CreateError> {
    check_guest(creator, state)?;
    let code = state.rooms.free_code(private, |code| state.knows_room(code));
    let (scene_name, creator) = (scene.name.clone(), network(creator));
    let facts = RoomFacts {
        scene: scene_name,
        number: random(),
        private,
        creator: Some(creator),
        guest: true,
    };
    let host_key = state.host.signer.host_key(facts.number);
    state.rooms.expect_guest(&code, scene, creator);
    let placed = fleet.place_here(&code, facts).await;
    let created = placed_at(placed, Created { code: code.clone(), host_key });
    if created.is_err() {
        state.rooms.forget_guest(&code);
    }
    created
}

/// Places a room on the node with the most spare processor time. Clients that ask for the room here are sent there.
async fn create_in_fleet(
    create: &Create,
    creator: IpAddr,
    fleet: &Fleet,
    state: &ServerState,
) -> Result<Created, CreateError> {
    if state.rooms.scene(&create.scene).is_none() {
        return Err(CreateError::NoSuchScene(create.scene.clone()));
    }
    check_fleet_shares(state.rooms.max(), creator, fleet)?;
    let code = state.rooms.free_code(create.private, |code| state.knows_room(code));
    let facts = RoomFacts {
        scene: create.scene.clone(),
        number: random(),
        private: create.private,
        creator: Some(network(creator)),
        guest: false,
    };
    let host_key = state.host.signer.host_key(facts.number);
    placed_at(fleet.place(&code, facts).await, Created { code, host_key })
}

/// Checks that a creator's networks may have one more room in the fleet. All nodes are assumed to allow as many rooms
/// as this one.
fn check_fleet_shares(rooms_max: usize, creator: IpAddr, fleet: &Fleet) -> Result<(), CreateError> {
    fleet.ask(|directory| {
        let creators: Vec<_> =
            directory.rooms().filter_map(|(_, entry)| entry.room.creator).collect();
        let shares = RoomShares::of_rooms(rooms_max * directory.nodes().max(1));
        Ok(shares.check(creators.iter().copied(), creator)?)
    })
}

fn placed_at(
    placed: Result<Located, PlaceError>,
    created: Created,
) -> Result<Created, CreateError> {
    match placed {
        Ok(Located::Here | Located::At(_) | Located::Soon) => Ok(created),
        Ok(Located::Lost | Located::Unknown) => Err(CreateError::NotNow),
        Err(PlaceError::Full) => Err(CreateError::FleetFull),
        Err(PlaceError::Taken | PlaceError::NotNow) => Err(CreateError::NotNow),
    }
}

fn refused_status(error: &CreateError) -> StatusCode {
    match error {
        CreateError::NoSuchScene(_) => StatusCode::NOT_FOUND,
        CreateError::TooManyOfAddress(_) | CreateError::TooManyGuestsOfAddress => {
            StatusCode::TOO_MANY_REQUESTS
        }
        CreateError::TooMany(_)
        | CreateError::TooManyGuests
        | CreateError::NotNow
        | CreateError::FleetFull => StatusCode::SERVICE_UNAVAILABLE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_rooms_the_liveliest_are_listed_and_all_are_counted() {
        let room = |number: u32| RoomCard {
            code: format!("room-{number:04}"),
            scene: "arena".to_owned(),
            title: "Arena".to_owned(),
            players: 8,
            connected: number % 8,
            spectators: 0,
            players_max: 8,
        };
        let few = listed((0..100).map(room).collect());
        assert_eq!((few.rooms.len(), few.total), (100, 100));
        let Rooms { rooms, total } = listed((0..1000).map(room).collect());
        assert_eq!((rooms.len(), total), (ROOMS_LISTED_MAX, 1000));
        assert!(rooms.iter().all(|room| room.connected == 7));
        assert!(rooms.is_sorted_by(|a, b| a.code < b.code));
    }
}
