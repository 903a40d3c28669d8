//! Messages between a game and its room. The room sends the welcome, snapshots and a few others; the game sends inputs,
//! the view size and pings.

use super::GameScreen;
use super::connection::{Link, State};
use super::membership::RoomMembership;
use crate::net::meter::Traffic;
use crate::net::report::SocketEvent;
use crate::page::context::Context;
use crate::page::event::Effect;
use crate::page::storage::Secret;
use crate::page::strings;
use crate::view::frame::View;
use crate::world::replica::Replica;
use jostle_game::{Buttons, Input, RoundPhase, Scene, Seat};
use jostle_protocol::limits::VIEW_MAX;
use jostle_protocol::{ClientMessage, DecodeError, Refusal, ServerMessage, Snapshot};
use jostle_sim::Vec2;
use std::sync::Arc;

/// Time without a frame after which the page counts as hidden and messages advance the display instead, milliseconds.
const UNSEEN_MS: f64 = 500.0;
/// The seat of a spectator, which no player has.
const NO_PLAYER: Seat = Seat(u16::MAX);

impl GameScreen {
    /// Handles an event from a session's socket.
    pub(super) fn on_socket(&mut self, ctx: &mut Context, session: u32, event: SocketEvent) {
        if !self.connection.is_open(session) {
            return;
        }
        match event {
            SocketEvent::Opened => self.connection.hello(ctx),
            SocketEvent::Message(bytes) => {
                self.receive(ctx, &bytes);
                self.keep_up_unseen(ctx);
            }
            SocketEvent::Closed { code } => self.connection.closed(ctx, code),
        }
    }

    /// Browsers stop the frames of a hidden page, but not its messages. The messages keep the replica up to date and
    /// the pings going, so that returning to the page is quick.
    fn keep_up_unseen(&mut self, ctx: &mut Context) {
        if ctx.now_ms - self.view.framed_ms < UNSEEN_MS {
            return;
        }
        self.send_due(ctx);
        self.move_display(ctx.now_ms);
    }

    pub(super) fn receive_in_page(&mut self, ctx: &mut Context) {
        let Link::InPage(room) = &mut self.connection.link else { return };
        for bytes in room.take() {
            self.receive(ctx, &bytes);
        }
    }

    fn receive(&mut self, ctx: &mut Context, bytes: &[u8]) {
        let now_ms = ctx.now_ms;
        if let Link::Server(socket) = &mut self.connection.link {
            socket.heard_ms = now_ms;
        }
        let message = ServerMessage::decode(bytes);
        self.connection.meter.carried(now_ms, traffic_of(&message), bytes.len());
        match message {
            Ok(ServerMessage::Snapshot(coded)) => self.file(ctx, &coded),
            Ok(ServerMessage::Welcome { seat, tick, scene_name, scene, .. }) => {
                match Scene::parse(&format!("{scene_name}.toml"), &scene) {
                    Ok(scene) => {
                        if let Some(own) = seat.filter(|_| !self.is_in_page()) {
                            ctx.storage.set_secret(
                                Secret::Seat,
                                &self.connection.code,
                                Some(own.token),
                            );
                        }
                        self.connection.status.host = seat.is_some_and(|own| own.host);
                        let seat = seat.map_or(NO_PLAYER, |own| own.seat);
                        let replica = Replica::new(Arc::new(scene), seat);
                        self.welcome(ctx, replica, tick);
                        self.connection.send(ctx, &ClientMessage::FollowBots);
                    }
                    Err(error) => {
                        ctx.request(Effect::Warn(format!("the server's scene: {error}")));
                        self.connection.end(ctx, Refusal::Version);
                    }
                }
            }
            Ok(ServerMessage::Refused { refusal }) => self.connection.end(ctx, refusal),
            Ok(ServerMessage::Draining { seconds, keeps_room }) => {
                self.connection.status.is_kept = keeps_room;
                self.connection.status.closing_ms = Some(now_ms + f64::from(seconds) * 1000.0);
            }
            Ok(ServerMessage::Pong { stamp, .. }) => {
                self.connection.meter.ponged(f64::from(stamp), now_ms.floor());
            }
            Ok(ServerMessage::Moved { url }) => self.connection.follow(ctx, url),
            Ok(ServerMessage::Nodes { urls }) => {
                if let Link::Server(socket) = &mut self.connection.link {
                    socket.servers.told(urls);
                }
            }
            Ok(ServerMessage::Emote { seat, emote }) => self.emotes.show(now_ms, seat, emote),
            Ok(ServerMessage::Clip { kept }) => {
                self.connection.status.clip = Some((now_ms, kept.map_err(strings::no_clip)));
            }
            Ok(ServerMessage::Bots { seats }) => {
                self.membership.iter_mut().for_each(|own| own.replica.room.bots.clone_from(&seats));
            }
            Ok(ServerMessage::Denied) => self.connection.status.denied_ms = Some(now_ms),
            Err(error) => self.connection.misunderstood(ctx, &error),
        }
    }

    fn welcome(&mut self, ctx: &mut Context, replica: Replica, tick: u32) {
        if let Link::Server(socket) = &mut self.connection.link {
            socket.unproven_ms = Some(ctx.now_ms);
            socket.servers.welcomed();
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
        self.connection.status.closing_ms = None;
        self.connection.status.restarting = false;
        self.connection.status.is_kept = false;
        self.connection.status.joined_ms.get_or_insert(ctx.now_ms);
        self.connection.status.state = State::Playing;
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
                self.connection
                    .meter
                    .snapshot(&Snapshot::section_names(coded).unwrap_or_default(), emitters);
                let round = replica.room.round();
                if round.is_none_or(|round| round.phase != RoundPhase::Over) {
                    self.input.controls.press(Buttons::AGAIN, false);
                }
                self.connection.prove(ctx.now_ms);
            }
            Err(error) => self.connection.misunderstood(ctx, &error),
        }
    }

    /// Sends everything that is due, such as inputs, the view size or a ping.
    pub fn send_due(&mut self, ctx: &mut Context) {
        if self.connection.status.state != State::Playing {
            return;
        }
        // A spectator sends empty inputs, only to acknowledge snapshots.
        let input = match self.watches() {
            true => Input::default(),
            false => self.input.controls.input(self.view()),
        };
        if let Some(membership) = &mut self.membership {
            membership.sender.note(input);
            while let Some((seq, input)) = membership.next_input(ctx.now_ms) {
                let ack_tick = membership.ack_tick();
                self.connection.send(ctx, &ClientMessage::Input { seq, ack_tick, input });
            }
        }
        let pings = self.connection.is_ping_due(ctx.now_ms);
        if pings || self.membership.as_ref().is_some_and(|m| m.sent_view.is_none()) {
            self.send_view(ctx);
        }
        if pings {
            self.connection.ping(ctx);
        }
    }

    /// Reports the visible part of the world if it depends on the screen.
    fn send_view(&mut self, ctx: &mut Context) {
        let view = *self.view();
        let Some(membership) = &mut self.membership else { return };
        let follows = !membership.replica.room.scene.camera.sees_all();
        if !follows || view.pixels == View::UNSEEN.pixels {
            return;
        }
        let [width, height] = view.pixels.map(|pixels| pixels as f32);
        let size = Vec2::new(width, height) * view.unit_per_pixel();
        let size = size.min(Vec2::splat(VIEW_MAX));
        if membership.sent_view != Some(size) {
            membership.sent_view = Some(size);
            self.connection.send(ctx, &ClientMessage::View { size });
        }
    }
}

fn traffic_of(message: &Result<ServerMessage, DecodeError>) -> Traffic {
    let Ok(ServerMessage::Snapshot(coded)) = message else { return Traffic::Answer };
    let sections = Snapshot::section_names(coded).unwrap_or_default();
    if sections.contains(&"keyframe") { Traffic::Keyframe } else { Traffic::Snapshot }
}
