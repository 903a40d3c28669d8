//! Records over HTTP: `POST /api/records` with a replay, the lists of best runs, and the replay files.

use super::body::ResponseBody;
use super::read;
use super::response::{Answer, busy, failed, json, not_found};
use crate::limits;
use crate::ops::refusal_log::Foreign;
use crate::runs::{self, BestRuns, Record};
use crate::state::ServerState;
use hyper::body::Incoming;
use hyper::header::{self, HeaderValue};
use hyper::{Request, Response, StatusCode};
use jostle_game::Scene;
use jostle_protocol::web::{RecordCard, RecordTable, Records, SubmittedRun};
use jostle_room::Measure;
use std::net::IpAddr;
use std::sync::Arc;
use tracing::error;

/// Error on a server that does not keep runs.
const OFF: &str = "this server keeps no records; its host can have it keep them with --state DIR or --replays DIR";
/// Error for a network whose runs are already being verified, or when too many runs are waiting.
const BUSY: &str = "other runs are being checked at the moment; try again in some seconds";

/// The best run for each scene, or all best runs for `?scene=NAME`.
pub fn list(query: Option<&str>, kept: Option<&runs::Records>) -> Answer {
    let wanted = query.and_then(|query| query.strip_prefix("scene="));
    let tables = kept.map_or_else(Vec::new, runs::Records::tables);
    let is_wanted = |(scene, ..): &&(Arc<Scene>, Measure, BestRuns)| {
        wanted.is_none_or(|name| scene.name == name)
    };
    let shown = if wanted.is_some() { limits::RECORDS_MAX } else { 1 };
    let table = |(scene, measure, runs): &(Arc<Scene>, Measure, BestRuns)| {
        let records = runs.list().iter().take(shown).map(card).collect();
        let (scene, measure) = (scene.name.clone(), measure.name().to_owned());
        RecordTable { scene, measure, records }
    };
    let scenes: Vec<RecordTable> = tables.iter().filter(is_wanted).map(table).collect();
    if wanted.is_some() && kept.is_some() && scenes.is_empty() {
        return failed(StatusCode::NOT_FOUND, "runs of no such scene are compared here");
    }
    json(StatusCode::OK, &Records { kept: kept.is_some(), scenes })
}

fn card(record: &Record) -> RecordCard {
    let Record { name, run, unix_s, bytes, displaced_s: _ } = record;
    let (seat, look) = &run.players[0];
    RecordCard {
        name: name.clone(),
        ticks: run.ticks(),
        points: run.points,
        begin: run.begin,
        seat: seat.0,
        players: run.players.iter().map(|(_, look)| look.name.to_string()).collect(),
        color: look.color,
        unix_s: *unix_s,
        bytes: *bytes,
    }
}

/// Verifies the replay in the body by playing it, and enters its best run.
pub async fn submit(request: Request<Incoming>, address: IpAddr, state: &ServerState) -> Answer {
    let Some(records) = &state.records else {
        state.refused("records_off", address, "a run");
        return failed(StatusCode::FORBIDDEN, OFF);
    };
    // The body is read before a place in the queue is taken, so that a client that sends nothing holds no place.
    let bytes = match read::long_body(request, limits::RUN_BYTES_MAX, address, state).await {
        Ok(bytes) => bytes.to_vec(),
        Err(error) => return error.answer(limits::RUN_BYTES_MAX),
    };
    match records.submit(bytes, address).await {
        Ok(Some(Ok(entered))) => {
            let status = entered.rank.map_or(StatusCode::OK, |_| StatusCode::CREATED);
            let (name, rank) = (entered.name.clone(), entered.rank.map(|rank| rank as u32));
            let (ticks, points) = (entered.run.ticks(), entered.run.points);
            json(status, &SubmittedRun { name, rank, ticks, points })
        }
        Ok(Some(Err(reason))) => {
            let reason = reason.to_string();
            state.refused("run", address, Foreign(reason.as_bytes()));
            failed(StatusCode::UNPROCESSABLE_ENTITY, &reason)
        }
        Ok(None) => {
            state.refused("runs_busy", address, "a run");
            busy(BUSY)
        }
        Err(error) => {
            error!(%error, "a run could not be checked");
            failed(StatusCode::INTERNAL_SERVER_ERROR, "the run could not be checked or kept")
        }
    }
}

pub async fn file(file: &str, address: IpAddr, state: &ServerState) -> Answer {
    let name = file.strip_suffix(".jostle");
    let (Some(records), Some(name)) = (&state.records, name) else { return not_found() };
    let readable = match records.read(name, address) {
        Ok(Some(readable)) => readable,
        Ok(None) => return not_found(),
        Err(_busy) => {
            state.refused("replays_busy", address, Foreign(name.as_bytes()));
            let text = "too many replays are being downloaded; try again later";
            return failed(StatusCode::SERVICE_UNAVAILABLE, text);
        }
    };
    match ResponseBody::open(readable).await {
        Ok(body) => {
            let mut answer = Response::new(body);
            let bytes = HeaderValue::from_static("application/octet-stream");
            answer.headers_mut().insert(header::CONTENT_TYPE, bytes);
            answer
        }
        Err(error) => {
            state.refused("unreadable_replay", address, format_args!("{name}: {error}"));
            not_found()
        }
    }
}
