//! A game and its members: joins and leaves, inputs, `tick`, and the snapshots to send.

use crate::bots::Bots;
use crate::log::{self, GameLog};
use crate::members::{Claim, Member, Members, PendingChange, SavedMembers, Welcome};
use crate::playback::Moment;
use crate::replication::{InterestArea, LiveParticles, Rate, Replication, Subscriber, view_of};
use bytes::Bytes;
use jostle_game::{Game, Input, Scene, Seat};
use jostle_protocol::limits::ROOM_CODE_BYTES_MAX;
use jostle_protocol::replay::{self, Record};
use jostle_protocol::{Appearance, Refusal, ServerMessage, Snapshot, WelcomeSeat};
use jostle_sim::Vec2;
use std::sync::Arc;

/// Minimum number of ticks between changes to the size of an interest area.
pub const VIEW_EVERY_TICKS: u32 = 60;

/// A game and its members.
pub struct Room {
    code: String,
    seed: u64,
    game: Game,
    members: Members,
    /// The newest tick's inputs.
    inputs: Vec<(Seat, Input)>,
    newest: Arc<Snapshot>,
    /// The previous snapshot, kept to reuse its memory.
    spare: Arc<Snapshot>,
    replication: Replication,
    /// The game's log, if it has a reader.
    log: Option<GameLog>,
}

impl Room {
    /// Creates an empty room at tick 0. `code` is the word in the room's link. Panics if the code is longer than
    /// `ROOM_CODE_BYTES_MAX`.
    pub fn new(code: &str, scene: Arc<Scene>, seed: u64) -> Room {
        assert!(code.len() <= ROOM_CODE_BYTES_MAX, "room code {code:?} is too long");
        Room::of(code, Game::new(scene, seed), seed)
    }

    /// Like [`Room::new`], but bots fill the room until `fill` seats are taken, instead of the number in the scene
    /// file. A scene without heroes has no bots.
    pub fn filled(code: &str, scene: Arc<Scene>, seed: u64, fill: u16) -> Room {
        let mut room = Room::new(code, scene, seed);
        room.members.bots = Bots::filling(&room.game, seed, usize::from(fill));
        room
    }

    /// Creates a room around a game, with no members yet.
    fn of(code: &str, game: Game, seed: u64) -> Room {
        let members = Members::new(game.scene().players_max, Bots::of(&game, seed));
        let newest = Arc::new(Snapshot::capture(&game, Vec::new()));
        Room {
            code: code.to_owned(),
            seed,
            game,
            members,
            inputs: Vec::new(),
            spare: Arc::clone(&newest),
            newest,
            replication: Replication::default(),
            log: None,
        }
    }

    /// Restores a room from the newest moment of its recording and the seats saved with it. All sockets are gone, so
    /// every seat is held from now on. Players missing from `saved` leave in the next tick. Claims that were given out
    /// in a moment that was lost must not be given out again; see [`Room::begin_epoch`].
    pub fn restore(code: &str, seed: u64, moment: Moment, saved: &SavedMembers) -> Room {
        let Moment { game, mut members } = moment;
        let tick = game.tick_count();
        let seats: Vec<Seat> = game.players().map(|player| player.seat).collect();
        let mut room = Room::of(code, game, seed);
        if let Some(bots) = &mut room.members.bots {
            bots.set_fill(saved.bots);
        }
        for seat in seats {
            let known = saved.seats.iter().find(|saved| saved.seat == seat.0);
            let bots =
                room.members.bots.as_mut().filter(|_| known.is_some_and(|saved| saved.is_bot));
            let is_bot = bots.map(|bots| bots.add(seat)).is_some();
            let known = known.filter(|saved| is_bot || !saved.is_bot);
            let Some((saved, appearance)) = known.zip(members.remove(&seat.0)) else {
                room.members.changes.push(PendingChange::Leave(seat));
                room.members.revision += 1;
                continue;
            };
            let member = Member {
                serial_before: saved.serial_before,
                joined_tick: saved.joined_tick,
                lost_tick: (!is_bot).then(|| saved.lost_tick.unwrap_or(tick).min(tick)),
                played: true,
                intent: (Input::default(), tick),
                ..Member::new(appearance, saved.serial)
            };
            room.members.seats.insert(seat, member);
        }
        room.capture();
        room
    }

    /// Increases whenever the result of [`Room::saved_members`] changes.
    pub fn members_revision(&self) -> u64 {
        self.members.revision
    }

    /// Who holds which seat now.
    pub fn saved_members(&self) -> SavedMembers {
        self.members.saved()
    }

    /// Starts the claims' serial numbers at a random number, so that none of them equals a number given out by an
    /// earlier process.
    pub fn begin_epoch(&mut self, epoch: u32) {
        self.members.serial = u64::from(epoch) << 32;
    }

    /// Takes the lowest free seat, or the claimed one, from the next tick on. Bots make way.
    ///
    /// A claim may be used once. Because the welcome may have been lost, it may be used again until an input proves
    /// that the client has received its new claim. Any other claim is refused as [`Refusal::BadToken`].
    pub fn join(
        &mut self,
        appearance: Appearance,
        claim: Option<Claim>,
    ) -> Result<Welcome, Refusal> {
        self.members.join(appearance, claim, &self.game)
    }

    /// Encodes the [`ServerMessage::Welcome`], which is the first message to a client. The token for a player's seat
    /// seals the player's claim; a spectator has no seat.
    pub fn welcome(&self, seat: Option<WelcomeSeat>) -> Vec<u8> {
        let scene = self.game.scene();
        let welcome = ServerMessage::Welcome {
            seat,
            tick: self.game.tick_count() + 1,
            room: self.code.clone(),
            scene_name: scene.name.clone(),
            scene: scene.source.clone(),
        };
        welcome.encode()
    }

    /// Detaches a seat's socket. The seat is held for [`crate::SEAT_HELD_TICKS`] with its hero at rest, or freed
    /// immediately if its player has never sent an input. Does nothing if the seat is free.
    pub fn disconnect(&mut self, seat: Seat) {
        self.members.disconnect(seat, self.game.tick_count());
        self.replication.areas.remove(&seat);
    }

    /// Removes a player permanently, from the next tick on. Does nothing if the seat is free or taken by a bot, since
    /// bots leave when people come.
    pub fn leave(&mut self, seat: Seat) {
        self.members.leave(seat);
        self.replication.areas.remove(&seat);
    }

    /// Changes a player's name and colour from the next tick on; the room makes them distinct, as for a join. Does
    /// nothing if the seat is free or a bot's.
    pub fn change_look(&mut self, seat: Seat, wanted: &Appearance) {
        self.members.change_look(seat, wanted);
    }

    /// Permanently removes a bot, so that no other bot takes its place. Returns whether this seat had a bot.
    pub fn dismiss_bot(&mut self, seat: Seat) -> bool {
        self.members.dismiss_bot(seat)
    }

    /// Queues an input, and returns whether it was accepted. Inputs with old, repeated or far-future sequence numbers
    /// are dropped, and so are all inputs for a seat without a socket.
    pub fn input(&mut self, seat: Seat, seq: u32, input: Input) -> bool {
        self.members.input(seat, seq, input, self.game.tick_count())
    }

    /// Plays one tick, with one input per player in seat order, and encodes its snapshot. A tick that exceeds the
    /// budget for a guest's scene ([`Game::is_over_budget`]) is neither recorded nor sent; the room cannot continue
    /// after it.
    pub fn tick(&mut self) {
        let abandoned = self.members.abandoned(self.game.tick_count());
        abandoned.into_iter().for_each(|seat| self.leave(seat));
        self.members.seat_bots(&self.game);
        let changes = self.apply_changes();
        self.take_inputs();
        self.game.tick(&self.inputs);
        if self.game.is_over_budget() {
            return;
        }
        self.record_tick(changes);
        self.capture();
        self.resize_areas();
        let acts = self.members.seats.values().any(|member| member.inputs.has_changed());
        self.replication.push(&self.game, &self.newest, acts);
    }

    /// Applies joins and leaves to the game, and returns them for the log.
    fn apply_changes(&mut self) -> Vec<replay::Change> {
        let Members { seats, changes, .. } = &mut self.members;
        let look = |seat| {
            let member = seats.get(&seat).expect("a player who joins or comes back has the seat");
            member.appearance.clone()
        };
        let changes = changes.drain(..).map(|change| match change {
            PendingChange::Join(seat) => {
                self.game.join(seat);
                replay::Change::Join(seat, look(seat))
            }
            PendingChange::Leave(seat) => {
                self.game.leave(seat);
                replay::Change::Leave(seat)
            }
            PendingChange::Look(seat) => replay::Change::Look(seat, look(seat)),
        });
        changes.collect()
    }

    fn take_inputs(&mut self) {
        let Members { bots, seats, .. } = &mut self.members;
        if let Some(bots) = bots {
            let tick = self.game.tick_count();
            bots.survey(&self.game, |seat| seats.get(&seat).map(|member| member.activity(tick)));
            bots.play(&self.game, |seat, input| {
                if let Some(member) = seats.get_mut(&seat) {
                    member.inputs.push_next(input);
                }
            });
        }
        self.inputs.clear();
        let members = self.members.seats.iter_mut();
        self.inputs
            .extend(members.filter_map(|(&seat, member)| Some((seat, member.inputs.take()?))));
    }

    fn record_tick(&mut self, changes: Vec<replay::Change>) {
        let Room { game, inputs, members, log, .. } = self;
        if let Some(log) = log {
            log.tick(changes, inputs, game, || members.appearances());
        }
    }

    /// Captures the newest snapshot, reusing the memory of the snapshot before the previous one unless a channel still
    /// holds it.
    fn capture(&mut self) {
        std::mem::swap(&mut self.newest, &mut self.spare);
        if Arc::get_mut(&mut self.newest).is_none() {
            self.newest = Arc::default();
        }
        let snapshot = Arc::get_mut(&mut self.newest).expect("no channel holds it");
        let members = &self.members;
        let shown = self
            .game
            .players()
            .filter_map(|player| Some(members.seats.get(&player.seat)?.state(&player)));
        snapshot.players.clear();
        snapshot.players.extend(shown);
        snapshot.recapture(&self.game);
    }

    /// Adapts interest areas to the view sizes that players' pages last reported.
    fn resize_areas(&mut self) {
        if !self.game.tick_count().is_multiple_of(VIEW_EVERY_TICKS) {
            return;
        }
        for (&seat, member) in &self.members.seats {
            if let Some(size) = member.view {
                self.replication.resize(seat, self.game.scene(), size);
            }
        }
    }

    /// Starts a log of the last few seconds of the game, for [`Room::clip`]. `program` is the version that plays the
    /// game.
    pub fn keep_clips(&mut self, program: &str) {
        self.begin_log(program, true);
    }

    fn begin_log(&mut self, program: &str, keeps_clips: bool) {
        let scene = self.game.scene();
        let start = replay::Start {
            program: program.to_owned(),
            unix_s: 0,
            room: self.code.clone(),
            scene_name: scene.name.clone(),
            scene: scene.source.clone(),
            seed: self.seed,
            first_tick: 0,
        };
        self.log = Some(GameLog::new(start, keeps_clips, &self.game, self.members.looks()));
    }

    /// The log, if one is kept.
    pub fn log(&self) -> Option<&GameLog> {
        self.log.as_ref()
    }

    /// Ends the log's current block, so that all ticks are available to readers.
    pub fn flush_log(&mut self) {
        self.log.iter_mut().for_each(GameLog::flush);
    }

    /// Appends the host's notes about the last tick to the log.
    pub fn log_notes(&mut self, notes: Record) {
        self.log.iter_mut().for_each(|log| log.append(notes.clone()));
    }

    /// Appends the whole state to the log.
    pub fn log_keyframe(&mut self) {
        let looks = self.members.looks();
        self.log.iter_mut().for_each(|log| log.keyframe(&self.game, looks.clone()));
    }

    /// Appends the end of the game, or of the part that replays may contain, to the log.
    pub fn end_log(&mut self) {
        self.log.iter_mut().for_each(|log| log.append(log::end(&self.game)));
    }

    /// The last few seconds as a replay's records. The replay ends now and begins up to half a minute before the clip;
    /// [`log::cut`] shortens it. `None` if no clips are kept.
    pub fn clip(&self, unix_s: u64) -> Option<Vec<Arc<Record>>> {
        self.log.as_ref()?.clip(unix_s, &self.game)
    }

    /// Starts a replay in memory. `program` is the version that plays the game, and `unix_s` is the time, or 0 if
    /// unknown.
    pub fn record(&mut self, program: &str, unix_s: u64) {
        if self.log.is_none() {
            self.begin_log(program, false);
        }
        let looks = self.members.looks();
        self.log.iter_mut().for_each(|log| log.record(unix_s, &self.game, looks.clone()));
    }

    /// Takes the finished records from the replay in memory, in order. Returns none if there is no replay.
    pub fn take_records(&mut self) -> Vec<Record> {
        self.log.as_mut().map(GameLog::take_records).unwrap_or_default()
    }

    /// The final records of the replay in memory, as if it ended now. The replay continues.
    pub fn recording_end(&self) -> Vec<Record> {
        self.log.as_ref().map(|log| log.recording_end(&self.game)).unwrap_or_default()
    }

    /// Ends the replay in memory, and returns its final records.
    pub fn stop_recording(&mut self) -> Vec<Record> {
        let last = self.recording_end();
        self.log.iter_mut().for_each(GameLog::stop_recording);
        last
    }

    /// Subscribes a client to snapshots of the whole world. Returns the subscription and the encoded keyframe to send
    /// first; later messages come from [`Room::message`] after each tick. At the full rate, the keyframe contains all
    /// live particles, and the client simulates them from there.
    pub fn subscribe(&mut self, rate: Rate) -> (Subscriber, Bytes) {
        self.replication.subscribe(rate, &self.newest, Some(live_particles(&self.game)))
    }

    /// Like [`Room::subscribe`], for a client that already has the live particles.
    pub fn subscribe_again(&mut self, rate: Rate) -> (Subscriber, Bytes) {
        self.replication.subscribe(rate, &self.newest, None)
    }

    /// Subscribes a player's client. If the world is larger than the client's view, it receives the part that the
    /// camera can see. This ends the player's earlier subscription to an interest area.
    pub fn subscribe_view(&mut self, seat: Seat, rate: Rate) -> (Subscriber, Bytes) {
        self.subscribe_seat(seat, rate, true)
    }

    /// Like [`Room::subscribe_view`], for a client that has already been sent the live particles. They may have been
    /// dropped on a slow link, but a client that subscribes again has most of them.
    pub fn subscribe_view_again(&mut self, seat: Seat, rate: Rate) -> (Subscriber, Bytes) {
        self.subscribe_seat(seat, rate, false)
    }

    fn subscribe_seat(
        &mut self,
        seat: Seat,
        rate: Rate,
        with_particles: bool,
    ) -> (Subscriber, Bytes) {
        let scene = self.game.scene();
        let view = self.members.seats.get(&seat).and_then(|member| view_of(scene, member.view));
        let live = with_particles.then(|| live_particles(&self.game));
        match view {
            None => {
                self.replication.areas.remove(&seat);
                self.replication.subscribe(rate, &self.newest, live)
            }
            Some(view) => {
                let areas = &mut self.replication.areas;
                let (area, subscriber, keyframe) = InterestArea::subscribe(
                    areas.remove(&seat),
                    seat,
                    rate,
                    scene,
                    view,
                    &self.newest,
                    live,
                );
                areas.insert(seat, area);
                (subscriber, keyframe)
            }
        }
    }

    /// Sets the size of a player's view, in world units. The first size takes effect immediately and later ones at the
    /// next multiple of [`VIEW_EVERY_TICKS`], because every body that enters the area is sent in full. Does nothing if
    /// the seat is free.
    pub fn view(&mut self, seat: Seat, size: Vec2) {
        let Some(member) = self.members.seats.get_mut(&seat) else { return };
        if member.view.replace(size).is_none() {
            self.replication.resize(seat, self.game.scene(), size);
        }
    }

    /// The encoded snapshot for a client after this tick; `None` between the ticks of its rate, and while nothing
    /// moves. A client that misses one has to subscribe again.
    pub fn message(&self, subscriber: &Subscriber) -> Option<&Bytes> {
        self.replication.message(subscriber)
    }

    /// The newest snapshot, before encoding.
    pub fn snapshot(&self) -> &Snapshot {
        &self.newest
    }

    /// The word in the room's link.
    pub fn code(&self) -> &str {
        &self.code
    }

    /// The scene being played.
    pub fn scene(&self) -> &Arc<Scene> {
        self.game.scene()
    }

    /// The game being played.
    pub fn game(&self) -> &Game {
        &self.game
    }

    /// Number of seats that people have taken, including held ones.
    pub fn players(&self) -> usize {
        self.members.people()
    }

    /// Number of seats that bots fill until people come.
    pub fn bots(&self) -> usize {
        self.members.bots.as_ref().map_or(0, Bots::count)
    }

    /// The bots' seats, in increasing order. They change only together with [`Room::members_revision`].
    pub fn bot_seats(&self) -> Vec<Seat> {
        self.members.bots.iter().flat_map(Bots::seats).collect()
    }

    /// Serial numbers of the claims to a seat that are still good: the newest, and the one before it until the next input.
    pub fn claims(&self, seat: Seat) -> [Option<u64>; 2] {
        let member = self.members.seats.get(&seat);
        [member.map(|member| member.serial), member.and_then(|member| member.serial_before)]
    }

    /// Seats held for disconnected players, longest absence first.
    pub fn held(&self) -> Vec<Seat> {
        let lost =
            self.members.seats.iter().filter_map(|(&seat, member)| Some((member.lost_tick?, seat)));
        let keys = lost.map(|(tick, seat)| u64::from(tick) << 16 | u64::from(seat.0));
        let mut held: Vec<u64> = keys.collect();
        held.sort_unstable();
        held.into_iter().map(|key| Seat(key as u16)).collect()
    }

    /// Ticks since a player last pressed, released or moved anything; `None` if the seat is free or a bot's.
    pub fn idle_ticks(&self, seat: Seat) -> Option<u32> {
        let member = self.members.seats.get(&seat).filter(|_| !self.members.is_bot(seat))?;
        Some(self.game.tick_count().saturating_sub(member.intent.1))
    }

    /// Tick after which a player took the seat; `None` if the seat is free or a bot's.
    pub fn joined_tick(&self, seat: Seat) -> Option<u32> {
        let member = self.members.seats.get(&seat).filter(|_| !self.members.is_bot(seat))?;
        Some(member.joined_tick)
    }

    /// Number of seats with a socket.
    pub fn connected(&self) -> usize {
        let members = self.members.seats.values();
        members.filter(|member| member.lost_tick.is_none()).count() - self.bots()
    }
}

fn live_particles(game: &Game) -> LiveParticles<'_> {
    LiveParticles { tick: game.tick_count(), particles: game.world().particles() }
}

#[cfg(test)]
mod tests;
