//! What a game hears: the welcome, snapshots, and the server's few other words.

use super::link::Link;
use super::{COPIES, Play, State};
use crate::camera::Camera;
use crate::clock::Clock;
use crate::input::Outflow;
use crate::meter::Traffic;
use crate::page::{dom, profile};
use crate::replica::Replica;
use jostle_protocol::{DecodeError, Refusal, ServerMessage, Snapshot, Token};
use jostle_sim::{Scene, Seat};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A connection whose snapshots were read for so long after the welcome is good, milliseconds:
/// the next loss is answered at once. One that fails sooner is retried ever more slowly.
const PROVEN_MS: f64 = 5000.0;

impl Play {
    pub(super) fn receive(&mut self, bytes: &[u8], now_ms: f64) {
        self.heard_ms = now_ms;
        let message = ServerMessage::decode(bytes);
        self.meter.carried(now_ms, traffic_of(&message), bytes.len());
        match message {
            Ok(ServerMessage::Snapshot(coded)) => self.file(&coded, now_ms),
            Ok(ServerMessage::Welcome { seat, host, token, tick, room, scene_name, scene }) => {
                match Scene::parse(&format!("{scene_name}.toml"), &scene) {
                    Ok(scene) => {
                        self.welcomed_tick = tick;
                        self.host = host;
                        self.welcome(Arc::new(scene), Seat(seat), token, room);
                    }
                    Err(error) => {
                        dom::warn(&format!("the server's scene: {error}"));
                        self.end(Refusal::Version);
                    }
                }
            }
            Ok(ServerMessage::Refused { refusal }) => self.end(refusal),
            Ok(ServerMessage::Draining { seconds }) => {
                self.closing_ms = Some(now_ms + f64::from(seconds) * 1000.0);
            }
            Ok(ServerMessage::Pong { stamp, .. }) => {
                self.meter.ponged(f64::from(stamp), now_ms.floor());
            }
            Ok(ServerMessage::Denied) => self.denied = true,
            Err(error) => self.misunderstood(&error.to_string()),
        }
    }

    fn welcome(&mut self, scene: Arc<Scene>, seat: Seat, token: Token, room: String) {
        if !self.is_demo() {
            profile::set_seat_token(&self.code, Some(token));
        }
        self.unproven_ms = Some(dom::now_ms());
        let world = scene.size;
        let same = self.replica.as_ref().is_some_and(|old| old.scene.source == scene.source);
        match &mut self.camera {
            // The view stays, for the pointer's sake, and jumps with the first snapshot.
            Some(camera) if same => camera.cut(),
            camera => *camera = Some(Camera::new(scene.camera, world)),
        }
        self.replica = Some(Replica::new(scene, seat, room));
        self.predictor = None;
        self.set_prediction(profile::predicts());
        self.copy = COPIES.fetch_add(1, Ordering::Relaxed) + 1;
        self.clock = Clock::default();
        self.outflow = Outflow::default();
        self.told_view = None;
        self.closing_ms = None;
        self.restarting = false;
        self.joined_ms.get_or_insert(dom::now_ms());
        self.state = State::Playing;
    }

    fn file(&mut self, coded: &[u8], now_ms: f64) {
        let Some(replica) = &mut self.replica else { return };
        match replica.hear(coded) {
            Ok((arrival, emitters)) => {
                self.clock.arrived(arrival, now_ms);
                if let (Some(predictor), (Some(newest), before)) =
                    (&mut self.predictor, replica.newest_two())
                {
                    predictor.heard(newest, before);
                }
                self.meter.snapshot(&Snapshot::section_names(coded).unwrap_or_default(), emitters);
                self.prove(now_ms);
            }
            Err(error) => self.misunderstood(&error.to_string()),
        }
    }

    /// A snapshot was read: after some time of that the connection is good.
    pub(super) fn prove(&mut self, now_ms: f64) {
        let proven = self.unproven_ms.take_if(|since| now_ms - *since >= PROVEN_MS).is_some();
        if let Link::Server { backoff, .. } = &mut self.link
            && proven
        {
            backoff.reset();
        }
    }

    /// What cannot be read cannot be built upon: a new socket gets a keyframe.
    fn misunderstood(&mut self, why: &str) {
        dom::warn(&format!("a message of the server cannot be read: {why}"));
        self.drop_socket();
    }
}

fn traffic_of(message: &Result<ServerMessage, DecodeError>) -> Traffic {
    let Ok(ServerMessage::Snapshot(coded)) = message else { return Traffic::Answer };
    let sections = Snapshot::section_names(coded).unwrap_or_default();
    if sections.contains(&"keyframe") { Traffic::Keyframe } else { Traffic::Snapshot }
}
