//! What a game says: hello, inputs, how much of the world is shown, pings.

use super::link::Link;
use super::{Play, State, UNSEEN};
use crate::clock::TICK_MS;
use crate::meter::Traffic;
use crate::page::{dom, profile};
use jostle_protocol::limits::VIEW_MAX;
use jostle_protocol::{ClientMessage, VERSION};
use jostle_sim::scene::Camera as CameraRule;
use jostle_sim::{Seat, Vec2};

/// Milliseconds between two pings.
const PING_MS: f64 = 1000.0;

impl Play {
    pub(super) fn hello(&mut self) {
        let appearance = self.appearance.clone();
        let token = profile::seat_token(&self.code).filter(|_| !self.is_demo());
        let host_key = profile::host_key(&self.code).filter(|_| !self.is_demo());
        self.heard_ms = dom::now_ms();
        let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key };
        self.send(&hello);
    }

    /// Has a player leave the room, which only its host may.
    pub fn kick(&mut self, seat: Seat) {
        self.send(&ClientMessage::Kick { seat });
    }

    /// Closes the room, which only its host may.
    pub fn close_room(&mut self) {
        self.closes = true;
        self.send(&ClientMessage::CloseRoom);
    }

    pub(super) fn send(&mut self, message: &ClientMessage) {
        let bytes = message.encode();
        let traffic = match message {
            ClientMessage::Input { .. } => Traffic::Input,
            _ => Traffic::Question,
        };
        self.meter.carried(dom::now_ms(), traffic, bytes.len());
        match &mut self.link {
            Link::Server { socket, .. } => {
                if let Some(socket) = socket {
                    socket.send(&bytes);
                }
            }
            Link::Demo(demo) => demo.receive(&bytes),
        }
    }

    /// Sends what is due: an input, a ping.
    pub fn speak(&mut self, now_ms: f64) {
        if self.state != State::Playing {
            return;
        }
        self.outflow.note(self.controls.input(&self.view));
        let moment = self.next_moment(now_ms);
        while let Some((seq, input)) = self.outflow.due(now_ms, moment) {
            let heard = self.heard();
            self.send(&ClientMessage::Input { seq, heard, input });
            if let (Some(predictor), Some(tick)) =
                (&mut self.predictor, self.clock.server_tick(now_ms))
            {
                predictor.sent(seq, input, tick, now_ms);
            }
        }
        let pings = now_ms - self.pinged_ms >= PING_MS;
        if pings || self.told_view.is_none() {
            self.tell_view();
        }
        if pings {
            self.pinged_ms = now_ms;
            self.send(&ClientMessage::Ping { stamp: now_ms as u32 });
        }
    }

    /// Low bits of the newest tick of which a snapshot was read.
    fn heard(&self) -> u16 {
        let newest = self.replica.as_ref().and_then(|replica| replica.newest());
        newest.map_or(self.welcomed_tick, |newest| newest.tick) as u16
    }

    /// In the tick after this moment an input of now is played; without a prediction its phase is
    /// a guess.
    fn next_moment(&mut self, now_ms: f64) -> f64 {
        let tick = self.clock.server_tick(now_ms).unwrap_or(now_ms / TICK_MS);
        let Some(predictor) = &self.predictor else { return tick };
        self.outflow.book_until(predictor.booked());
        predictor.moment_at(tick, now_ms)
    }

    /// The room is told how much of the world is shown, if that depends on the screen.
    fn tell_view(&mut self) {
        let scene = self.replica.as_ref().map(|replica| &replica.scene);
        let follows = scene.is_some_and(|scene| matches!(scene.camera, CameraRule::Follow { .. }));
        if !follows || self.view.pixels == UNSEEN.pixels {
            return;
        }
        let [width, height] = self.view.pixels.map(|pixels| pixels as f32);
        let size = Vec2::new(width, height) * self.view.unit_per_pixel();
        let size = size.min(Vec2::splat(VIEW_MAX));
        if self.told_view != Some(size) {
            self.told_view = Some(size);
            self.send(&ClientMessage::View { size });
        }
    }
}
