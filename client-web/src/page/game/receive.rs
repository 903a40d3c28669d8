//! Messages from the room: the welcome, snapshots, and a few more.

use super::GameScreen;
use super::link::Link;
use super::membership::RoomMembership;
use super::status::State;
use crate::net::meter::Traffic;
use crate::page::context::Context;
use crate::page::event::Effect;
use crate::page::storage::Secret;
use crate::page::strings;
use crate::world::replica::Replica;
use jostle_game::{Buttons, RoundPhase, Scene, Seat};
use jostle_protocol::{DecodeError, Refusal, ServerMessage, Snapshot};
use std::sync::Arc;

/// Time after the welcome for which snapshots must be read before the connection counts as good,
/// milliseconds. A good one is retried at once after its next loss, one that fails sooner ever
/// more slowly.
const PROVEN_MS: f64 = 5000.0;

/// A seat without a player: that of a spectator.
const NO_PLAYER: Seat = Seat(u16::MAX);

impl GameScreen {
    pub(super) fn receive(&mut self, ctx: &mut Context, bytes: &[u8]) {
        let now_ms = ctx.now_ms;
        if let Link::Server(connection) = &mut self.link {
            connection.heard_ms = now_ms;
        }
        let message = ServerMessage::decode(bytes);
        self.meter.carried(now_ms, traffic_of(&message), bytes.len());
        match message {
            Ok(ServerMessage::Snapshot(coded)) => self.file(ctx, &coded),
            Ok(ServerMessage::Welcome { seat, tick, scene_name, scene, .. }) => {
                match Scene::parse(&format!("{scene_name}.toml"), &scene) {
                    Ok(scene) => {
                        if let Some(own) = seat.filter(|_| !self.is_in_page()) {
                            ctx.storage.set_secret(Secret::Seat, &self.code, Some(own.token));
                        }
                        self.status.host = seat.is_some_and(|own| own.host);
                        let seat = seat.map_or(NO_PLAYER, |own| own.seat);
                        let replica = Replica::new(Arc::new(scene), seat);
                        self.welcome(ctx, replica, tick);
                    }
                    Err(error) => {
                        ctx.request(Effect::Warn(format!("the server's scene: {error}")));
                        self.end(ctx, Refusal::Version);
                    }
                }
            }
            Ok(ServerMessage::Refused { refusal }) => self.end(ctx, refusal),
            Ok(ServerMessage::Draining { seconds, keeps_room }) => {
                self.status.is_kept = keeps_room;
                self.status.closing_ms = Some(now_ms + f64::from(seconds) * 1000.0);
            }
            Ok(ServerMessage::Pong { stamp, .. }) => {
                self.meter.ponged(f64::from(stamp), now_ms.floor());
            }
            Ok(ServerMessage::Moved { url }) => self.follow(ctx, url),
            Ok(ServerMessage::Nodes { urls }) => {
                if let Link::Server(connection) = &mut self.link {
                    connection.servers.told(urls);
                }
            }
            Ok(ServerMessage::Emote { seat, emote }) => self.emotes.show(now_ms, seat, emote),
            Ok(ServerMessage::Clip { kept }) => {
                self.status.clip = Some((now_ms, kept.map_err(strings::no_clip)));
            }
            Ok(ServerMessage::Denied) => self.status.denied_ms = Some(now_ms),
            Err(error) => self.misunderstood(ctx, &error),
        }
    }

    fn welcome(&mut self, ctx: &mut Context, replica: Replica, tick: u32) {
        if let Link::Server(connection) = &mut self.link {
            connection.unproven_ms = Some(ctx.now_ms);
            connection.servers.welcomed();
        }
        let same =
            self.replica().is_some_and(|old| old.room.scene.source == replica.room.scene.source);
        match &mut self.membership {
            Some(membership) if same && membership.continues(replica.room.seat, tick) => {
                membership.go_on(tick, ctx.now_ms);
            }
            _ => {
                self.view.adopt(&replica, same);
                self.membership = Some(RoomMembership::new(replica, ctx.next_number(), tick));
                self.set_prediction(ctx.predicts);
            }
        }
        self.status.closing_ms = None;
        self.status.restarting = false;
        self.status.is_kept = false;
        self.status.joined_ms.get_or_insert(ctx.now_ms);
        self.status.state = State::Playing;
    }

    fn file(&mut self, ctx: &mut Context, coded: &[u8]) {
        let Some(membership) = &mut self.membership else { return };
        let RoomMembership { replica, clock, predictor, .. } = membership;
        match replica.hear(coded) {
            Ok((arrival, emitters)) => {
                clock.arrived(arrival, ctx.now_ms);
                if let (Some(predictor), (Some(newest), before)) =
                    (predictor, replica.room.newest_two())
                {
                    predictor.heard(newest, before);
                }
                self.meter.snapshot(&Snapshot::section_names(coded).unwrap_or_default(), emitters);
                let round = replica.room.round();
                if round.is_none_or(|round| round.phase != RoundPhase::Over) {
                    self.controls.press(Buttons::AGAIN, false);
                }
                self.prove(ctx.now_ms);
            }
            Err(error) => self.misunderstood(ctx, &error),
        }
    }

    /// A snapshot was read: after some time of that the connection is good.
    fn prove(&mut self, now_ms: f64) {
        let Link::Server(connection) = &mut self.link else { return };
        if connection.unproven_ms.take_if(|since| now_ms - *since >= PROVEN_MS).is_some() {
            connection.backoff.reset();
        }
    }

    /// Nothing can be built on an unreadable message: a new socket starts with a keyframe.
    fn misunderstood(&mut self, ctx: &mut Context, why: &DecodeError) {
        ctx.request(Effect::Warn(format!("a message of the server cannot be read: {why}")));
        self.drop_socket(ctx);
    }
}

fn traffic_of(message: &Result<ServerMessage, DecodeError>) -> Traffic {
    let Ok(ServerMessage::Snapshot(coded)) = message else { return Traffic::Answer };
    let sections = Snapshot::section_names(coded).unwrap_or_default();
    if sections.contains(&"keyframe") { Traffic::Keyframe } else { Traffic::Snapshot }
}
