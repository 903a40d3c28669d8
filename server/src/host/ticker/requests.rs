//! The messages of players to their room. Inputs and views are applied immediately; requests that others notice wait
//! until all inboxes are empty.

use super::open_room::OpenRoom;
use crate::host::admission::KickScope;
use crate::host::outbox::Outbox;
use crate::host::sessions::ConnectedMember;
use crate::ops::metrics::Metrics;
use bytes::Bytes;
use jostle_game::Seat;
use jostle_protocol::{Appearance, ClientMessage, ClipRefusal, ServerMessage};
use jostle_room::Room;
use std::sync::Arc;
use std::sync::mpsc::TryRecvError;
use std::time::Instant;
use tracing::info;

/// Requests that others notice.
#[derive(Default)]
struct PlayerRequests {
    kicks: Vec<(Seat, KickScope, Arc<Outbox>)>,
    looks: Vec<(Seat, Appearance)>,
    emotes: Vec<(Seat, u8)>,
    clips: Vec<(Seat, Arc<Outbox>)>,
    closes: bool,
    /// Whether a host has left.
    abandons: bool,
}

impl PlayerRequests {
    fn take(
        &mut self,
        message: ClientMessage,
        member: &mut ConnectedMember,
        room: &mut Room,
        metrics: &Metrics,
    ) {
        let outbox = &member.feed.outbox;
        match message {
            ClientMessage::Input { seq, ack_tick, input } => {
                member.feed.lag.acked(ack_tick, room.game().tick_count());
                if !room.input(member.seat, seq, input) {
                    metrics.inputs_ignored.inc();
                }
            }
            ClientMessage::View { size } => room.view(member.seat, size),
            ClientMessage::Kick { seat } if member.host => {
                self.kicks.push((seat, KickScope::Player, Arc::clone(outbox)));
            }
            ClientMessage::KickNetwork { seat } if member.host => {
                self.kicks.push((seat, KickScope::Network, Arc::clone(outbox)));
            }
            ClientMessage::CloseRoom if member.host => self.closes = true,
            ClientMessage::Kick { .. }
            | ClientMessage::KickNetwork { .. }
            | ClientMessage::CloseRoom => {
                outbox.control(ServerMessage::Denied.encode());
            }
            ClientMessage::Look { appearance } => self.looks.push((member.seat, appearance)),
            ClientMessage::FollowBots => member.feed.follow_bots(room),
            ClientMessage::Emote { emote } => self.emotes.push((member.seat, emote)),
            ClientMessage::Clip => self.clips.push((member.seat, Arc::clone(outbox))),
            // The session itself answers pings and refuses a second hello.
            ClientMessage::Ping { .. } | ClientMessage::Hello { .. } => {}
        }
    }
}

impl OpenRoom {
    /// Moves the sessions' messages into the room. This terminates, because the inboxes are bounded.
    pub fn empty_inboxes(&mut self) {
        let mut requests = PlayerRequests::default();
        let OpenRoom { host, info, room, sessions, .. } = self;
        sessions.members.retain_mut(|member| {
            let seat = member.seat.0;
            loop {
                match member.inbox.try_recv() {
                    Ok(Some(message)) => requests.take(message, member, room, &host.metrics),
                    Ok(None) => {
                        info!(room = %info.code, seat, "player left");
                        host.metrics.left("left");
                        room.leave(member.seat);
                        requests.abandons |= member.host;
                        return false;
                    }
                    Err(TryRecvError::Empty) => return true,
                    Err(TryRecvError::Disconnected) => {
                        info!(room = %info.code, seat, "player lost");
                        host.metrics.left("lost");
                        room.disconnect(member.seat);
                        return false;
                    }
                }
            }
        });
        self.grant(requests);
        self.sessions.spectators.empty_inboxes(&self.room, &self.host.metrics);
    }

    fn grant(&mut self, requests: PlayerRequests) {
        let PlayerRequests { kicks, looks, emotes, clips, closes, abandons } = requests;
        for (seat, scope, outbox) in kicks {
            if self.sessions.members.iter().any(|member| member.seat == seat && member.host) {
                outbox.control(ServerMessage::Denied.encode());
            } else {
                self.kick(seat, scope);
            }
        }
        for (seat, wanted) in looks {
            self.change_look(seat, wanted);
        }
        for (seat, emote) in emotes {
            self.show(seat, emote);
        }
        for (seat, outbox) in clips {
            self.keep_clip(seat, outbox);
        }
        self.closed |= closes;
        self.abandoned |= abandons;
    }

    /// Gives a player another name and colour, unless the last change was a moment ago.
    fn change_look(&mut self, seat: Seat, wanted: Appearance) {
        if !self.looks.admit(seat, self.room.game().tick_count()) {
            return self.host.metrics.ignored("look");
        }
        let appearance = self.unmistakable(wanted, Some(seat));
        self.admission.renamed(seat, &appearance.name);
        self.room.change_look(seat, &appearance);
    }

    /// Shows an emote to all clients, unless there have been too many.
    fn show(&mut self, seat: Seat, emote: u8) {
        if !self.emotes.admit(seat, self.room.game().tick_count()) {
            return self.host.metrics.ignored("emote");
        }
        let message = Bytes::from(ServerMessage::Emote { seat, emote }.encode());
        for outbox in self.sessions.outboxes() {
            outbox.aside(message.clone());
        }
    }

    /// Saves the last few seconds for a player, who gets an answer once that is done.
    fn keep_clip(&mut self, seat: Seat, outbox: Arc<Outbox>) {
        let answer = move |kept| {
            outbox.control(ServerMessage::Clip { kept }.encode());
        };
        let Some(recording) = &self.host.logs.recording else {
            return answer(Err(ClipRefusal::Off));
        };
        let asked_by = self.admission.address(seat);
        let admitted = |address| recording.admit_clip(address, Instant::now());
        let tick = self.room.game().tick_count();
        // The address is checked first, so that a refusal because of the address does not count against the seat.
        if !asked_by.is_none_or(admitted) || !self.clips.admit(seat, tick) {
            return answer(Err(ClipRefusal::TooMany));
        }
        match self.room.clip(recording.unix_s()) {
            Some(records) => recording.keep_clip(records, !self.info.private, asked_by, answer),
            None => answer(Err(ClipRefusal::Off)),
        }
    }
}
