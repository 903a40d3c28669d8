//! Reasons for refusals, as values of a label. All of them are exported from the start, because a rate cannot see the
//! first event of a series that begins with that event.

use jostle_protocol::Refusal;

/// Reasons other than those for refusing sessions, which [`of`] names.
const OF_REQUESTS: [&str; 29] = [
    "bad_host",
    "bad_request",
    "bad_tls",
    "banned",
    "bodies_busy",
    "cannot_accept",
    "connects_too_fast",
    "doubled_header",
    "foreign_page",
    "guest_scene",
    "guest_scenes_off",
    "guest_trials_busy",
    "idle_connection",
    "no_room_created",
    "no_upgrade",
    "ops_busy",
    "ops_unauthorized",
    "records_off",
    "replays_busy",
    "requests_too_fast",
    "run",
    "runs_busy",
    "slow_request",
    "slow_tls",
    "stalled_response",
    "too_many_connections",
    "too_many_responses",
    "unreadable_forwarded_for",
    "unreadable_replay",
];

pub fn all() -> impl Iterator<Item = &'static str> {
    OF_REQUESTS.into_iter().chain(Refusal::ALL.into_iter().map(of))
}

/// The name of a session refusal, in snake case.
pub fn of(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::Version => "version",
        Refusal::RoomFull => "room_full",
        Refusal::NoSuchRoom => "no_such_room",
        Refusal::ServerFull => "server_full",
        Refusal::BadHello => "bad_hello",
        Refusal::BadMessage => "bad_message",
        Refusal::Flood => "flood",
        Refusal::TooManySockets => "too_many_sockets",
        Refusal::Silent => "silent",
        Refusal::Replaced => "replaced",
        Refusal::Closing => "closing",
        Refusal::RoomFailed => "room_failed",
        Refusal::BadToken => "bad_token",
        Refusal::Kicked => "kicked",
        Refusal::RoomClosed => "room_closed",
        Refusal::GaveWay => "gave_way",
        Refusal::Moved => "moved",
        Refusal::Moving => "moving",
        Refusal::TooCostly => "too_costly",
        Refusal::TooManySpectators => "too_many_spectators",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn each_reason_is_named_once() {
        let names: BTreeSet<_> = all().collect();
        assert_eq!(names.len(), OF_REQUESTS.len() + Refusal::ALL.len());
    }
}
