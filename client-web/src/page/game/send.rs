//! Messages to the room: hello, inputs, the size of the view, pings, and what a host may ask for.

use super::GameScreen;
use super::link::Link;
use super::status::State;
use crate::net::meter::Traffic;
use crate::page::context::Context;
use crate::page::event::Effect;
use crate::page::storage::Secret;
use crate::page::strings;
use crate::view::frame::View;
use jostle_game::{Input, Seat};
use jostle_protocol::limits::VIEW_MAX;
use jostle_protocol::{ClientMessage, ClipRefusal, VERSION};
use jostle_sim::Vec2;

/// Milliseconds between two pings.
const PING_MS: f64 = 1000.0;

impl GameScreen {
    pub(super) fn hello(&mut self, ctx: &mut Context) {
        let mut secrets = (None, None);
        if let Link::Server(connection) = &mut self.link {
            connection.heard_ms = ctx.now_ms;
        }
        if !self.is_in_page() && !self.watches() {
            secrets = (
                ctx.storage.secret(Secret::Seat, &self.code),
                ctx.storage.secret(Secret::Host, &self.code),
            );
        }
        let (token, host_key) = secrets;
        let appearance = self.appearance.clone();
        let (version, role) = (VERSION, self.role);
        self.send(ctx, &ClientMessage::Hello { version, appearance, token, host_key, role });
    }

    /// Removes a player from the room, which only its host may.
    pub fn kick(&mut self, ctx: &mut Context, seat: Seat) {
        self.send(ctx, &ClientMessage::Kick { seat });
    }

    /// Shows an emote to everyone.
    pub fn emote(&mut self, ctx: &mut Context, emote: u8) {
        self.send(ctx, &ClientMessage::Emote { emote });
    }

    /// Closes the room, which only its host may.
    pub fn close_room(&mut self, ctx: &mut Context) {
        self.status.closes = true;
        self.send(ctx, &ClientMessage::CloseRoom);
    }

    /// Has the last seconds kept: by the server, or as a file if the room is in the page.
    pub fn keep_clip(&mut self, ctx: &mut Context) {
        match &self.link {
            Link::Server(_) if self.status.state != State::Playing => {}
            Link::Server(_) if self.watches() => {
                self.status.clip = Some((ctx.now_ms, Err(strings::CLIP_OF_SPECTATOR)));
            }
            Link::Server(_) => self.send(ctx, &ClientMessage::Clip),
            Link::InPage(room) => {
                let file = room.clip();
                let failed = strings::no_clip(ClipRefusal::Failed);
                let kept = file.as_ref().map(|_| String::new()).ok_or(failed);
                self.status.clip = Some((ctx.now_ms, kept));
                ctx.effects.extend(file.map(Effect::SaveClip));
            }
        }
    }

    fn send(&mut self, ctx: &mut Context, message: &ClientMessage) {
        let bytes = message.encode();
        let traffic = match message {
            ClientMessage::Input { .. } => Traffic::Input,
            _ => Traffic::Question,
        };
        self.meter.carried(ctx.now_ms, traffic, bytes.len());
        match &mut self.link {
            Link::Server(connection) if connection.open => ctx.request(Effect::Send(bytes)),
            Link::Server(_) => {}
            Link::InPage(room) => room.receive(&bytes),
        }
    }

    /// Sends everything that is due: inputs, the size of the view, a ping.
    pub fn send_due(&mut self, ctx: &mut Context) {
        if self.status.state != State::Playing {
            return;
        }
        // A spectator only acknowledges.
        let input = match self.watches() {
            true => Input::default(),
            false => self.controls.input(self.view()),
        };
        if let Some(membership) = &mut self.membership {
            membership.sender.note(input);
        }
        while let Some(message) = self.next_input(ctx.now_ms) {
            self.send(ctx, &message);
        }
        let pings = ctx.now_ms - self.pinged_ms >= PING_MS;
        if pings || self.membership.as_ref().is_some_and(|m| m.sent_view.is_none()) {
            self.send_view(ctx);
        }
        if pings {
            self.pinged_ms = ctx.now_ms;
            self.send(ctx, &ClientMessage::Ping { stamp: ctx.now_ms as u32 });
        }
    }

    fn next_input(&mut self, now_ms: f64) -> Option<ClientMessage> {
        let membership = self.membership.as_mut()?;
        let ack_tick = membership.ack_tick();
        let (seq, input) = membership.next_input(now_ms)?;
        Some(ClientMessage::Input { seq, ack_tick, input })
    }

    /// Says how much of the world is shown, if that depends on the screen.
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
            self.send(ctx, &ClientMessage::View { size });
        }
    }
}
