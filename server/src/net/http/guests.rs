//! Rooms with guests' scenes, created by a `POST /api/guest-rooms` request that contains the text of a scene file.

use super::api::{self, no_room};
use super::read::{self, ReadError};
use super::response::{Answer, busy, failed, json};
use crate::guests::{self, GuestScenes};
use crate::host::rooms::{CreateError, Created};
use crate::limits;
use crate::ops::refusal_log::Foreign;
use crate::state::ServerState;
use hyper::body::Incoming;
use hyper::{Request, StatusCode};
use jostle_game::Scene;
use jostle_game::scene::SceneError;
use jostle_protocol::web::Posted;
use std::net::IpAddr;
use std::sync::Arc;
use tracing::error;

/// Error on a server that does not allow guests' scenes.
const OFF: &str =
    "this server plays no scenes of guests; its host can allow them with --guest-scenes private";
/// Error on a server that does not list such rooms.
const UNLISTED: &str = "this server does not list rooms with scenes of guests; its host can allow it with --guest-scenes all";
/// Error for a network whose scenes are already being tried, or when too many scenes are waiting.
const BUSY: &str = "other scenes are being tried at the moment; try again in some seconds";

/// Opens a room with the scene in the body, and answers as for any other new room. With `?listed=true` the room is
/// public, if the server allows that.
pub async fn create_room(
    request: Request<Incoming>,
    address: IpAddr,
    state: &ServerState,
) -> Answer {
    let listed = request.uri().query().is_some_and(|query| query == "listed=true");
    let refusal = match state.config.guest_scenes {
        GuestScenes::Off => Some(OFF),
        GuestScenes::Private if listed => Some(UNLISTED),
        GuestScenes::Private | GuestScenes::All => None,
    };
    if let Some(text) = refusal {
        state.refused("guest_scenes_off", address, "a scene");
        return failed(StatusCode::FORBIDDEN, text);
    }
    let text = match read::long_body(request, limits::GUEST_SCENE_BYTES_MAX, address, state).await {
        Ok(text) => text.to_vec(),
        Err(ReadError::TooLong) => {
            let found = format!("more than {} bytes", limits::GUEST_SCENE_BYTES_MAX);
            return scene_refused(&guests::too_long(found), address, state);
        }
        Err(error) => return error.answer(limits::GUEST_SCENE_BYTES_MAX),
    };
    match try_out(text, address, state).await {
        Ok(scene) => match open(&scene, !listed, address, state).await {
            Ok(room) => api::created(&room),
            Err(error) => no_room(&error, address, state),
        },
        Err(answer) => answer,
    }
}

/// Waits for a turn, then tries a scene.
async fn try_out(
    text: Vec<u8>,
    address: IpAddr,
    state: &ServerState,
) -> Result<Arc<Scene>, Answer> {
    // This is checked before the trial, which would otherwise be wasted, and again afterwards.
    api::check_guest(address, state).map_err(|error| no_room(&error, address, state))?;
    match guests::try_out(text, state.config.waits, address, &state.trials).await {
        Ok(Some(Ok(scene))) => Ok(scene),
        Ok(Some(Err(error))) => Err(scene_refused(&error, address, state)),
        Ok(None) => {
            state.refused("guest_trials_busy", address, "a scene");
            Err(busy(BUSY))
        }
        Err(error) => {
            error!(%error, "a guest's scene could not be tried");
            Err(failed(StatusCode::INTERNAL_SERVER_ERROR, "the scene could not be tried"))
        }
    }
}

async fn open(
    scene: &Arc<Scene>,
    private: bool,
    creator: IpAddr,
    state: &ServerState,
) -> Result<Created, CreateError> {
    match &state.fleet {
        None => state.rooms.create_guest(scene, private, creator),
        Some(fleet) => api::create_guest_in_fleet(scene, private, creator, fleet, state).await,
    }
}

/// The error from `jostle scene check` as a sentence, along with its parts for an editor.
fn scene_refused(error: &SceneError, address: IpAddr, state: &ServerState) -> Answer {
    let sentence = error.to_string();
    state.refused("guest_scene", address, Foreign(sentence.as_bytes()));
    let refusal = Posted {
        error: Some(sentence),
        line: Some(error.line),
        field: Some(error.field.clone()),
        found: Some(error.found.clone()),
        allowed: Some(error.allowed.clone()),
        ..Posted::default()
    };
    json(StatusCode::UNPROCESSABLE_ENTITY, &refusal)
}
