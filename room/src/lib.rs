//! A Room: one Game and its members, without sockets, files or time. Bytes and ticks in, bytes out.

pub mod camera;
pub mod divergence;
mod feed;
mod input_queue;
mod member;
pub mod playback;
mod press;
mod recorder;
mod sight;

use bytes::Bytes;
use feed::{Feed, Flying};
use jostle_protocol::limits::ROOM_CODE_BYTES_MAX;
use jostle_protocol::replay::{self, Record};
use jostle_protocol::{Appearance, Refusal, ServerMessage, Snapshot, TimedEvent, Token};
use jostle_sim::{Event, Game, Input, Scene, Seat, Vec2};
use member::{Member, Members};
use std::sync::Arc;

pub use feed::{Rate, Reader};
pub use input_queue::{INPUTS_WAITING_GOAL, LONG_QUEUE_TICKS, SEQ_AHEAD_MAX};
pub use playback::{Playback, PlaybackError, Played};
pub use press::Press;
pub use recorder::{BLOCK_TICKS, KEYFRAME_TICKS_MIN, Recorder};
pub use sight::{Sight, view_of};

/// Ticks for which a seat is held after its socket is lost.
pub const SEAT_HELD_TICKS: u32 = 45 * 60;
/// Inputs that may wait for a player; the oldest are dropped past it.
pub const INPUTS_QUEUED_MAX: usize = 8;
/// Ticks for which the last input is repeated when none arrives; then the player stops steering.
pub const SILENCE_TICKS: u32 = 15;
/// How often what a page shows may become wider or narrower.
pub const VIEW_EVERY_TICKS: u32 = 60;

/// One game and its members.
pub struct Room {
    code: String,
    seed: u64,
    game: Game,
    members: Members,
    /// Of the newest claim; no two of a room have the same.
    serial: u64,
    /// Joins, leaves and looks since the last tick, at most three a seat.
    changes: Vec<Change>,
    /// Of the newest tick.
    inputs: Vec<(Seat, Input)>,
    newest: Arc<Snapshot>,
    /// The one before, whose memory is used again.
    before: Arc<Snapshot>,
    /// What happened in the newest tick.
    events: Vec<TimedEvent>,
    press: Press,
    /// By rate; those that nobody ever asked for are not made.
    feeds: [Option<Feed>; Rate::ALL.len()],
    /// By seat; of those who see a part of the world.
    sights: Vec<Option<Sight>>,
    recorder: Option<Recorder>,
}

/// A join, a leave or a new look that waits for the next tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    Join(Seat),
    Leave(Seat),
    Look(Seat),
}

/// What gives a seat back: whoever took the seat was given it, sealed by the caller in a token, for
/// a room knows no secrets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// The seat.
    pub seat: Seat,
    /// No two claims of a room have the same.
    pub serial: u64,
}

/// What a player gets on joining; [`Room::welcome`] says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Welcome {
    /// Gives the seat back later.
    pub claim: Claim,
    /// Whether an earlier seat was resumed. If a socket was still attached to it, that one is
    /// replaced: the caller closes it, and does not report it as lost.
    pub resumed: bool,
}

impl Room {
    /// An empty room at tick 0. `code` is the word in its link. Panics if it is longer than
    /// `ROOM_CODE_BYTES_MAX`.
    pub fn new(code: &str, scene: Arc<Scene>, seed: u64) -> Room {
        assert!(code.len() <= ROOM_CODE_BYTES_MAX, "room code {code:?} is too long");
        let members = Members::new(usize::from(scene.players_max));
        let sights = vec![None; usize::from(scene.players_max)];
        let game = Game::new(scene, seed);
        let newest = Arc::new(Snapshot::capture(&game, Vec::new()));
        Room {
            code: code.to_owned(),
            seed,
            game,
            members,
            serial: 0,
            changes: Vec::new(),
            inputs: Vec::new(),
            before: Arc::clone(&newest),
            newest,
            events: Vec::new(),
            press: Press::default(),
            feeds: [const { None }; Rate::ALL.len()],
            sights,
            recorder: None,
        }
    }

    /// Takes the lowest free seat, or the claimed one; effective with the next tick. A claim is good
    /// once, and once more while nothing shows that the claim it was exchanged for arrived: the welcome
    /// may have been lost. Any other is refused as [`Refusal::BadToken`].
    pub fn join(
        &mut self,
        appearance: Appearance,
        claim: Option<Claim>,
    ) -> Result<Welcome, Refusal> {
        let seat = match claim {
            Some(claim) if self.is_good(claim) => claim.seat,
            Some(_) => return Err(Refusal::BadToken),
            None => self.members.free_seat().ok_or(Refusal::RoomFull)?,
        };
        let appearance = self.members.distinct(&appearance, Some(seat));
        self.serial += 1;
        match (claim, self.members.at_mut(seat)) {
            (Some(claim), Some(member)) => {
                member.resume(appearance, claim.serial, self.serial);
                if !self.changes.contains(&Change::Look(seat)) {
                    self.changes.push(Change::Look(seat));
                }
            }
            _ => {
                self.members.put(seat, Member::new(appearance, self.serial));
                self.changes.push(Change::Join(seat));
            }
        }
        let claim_next = Claim { seat, serial: self.serial };
        Ok(Welcome { claim: claim_next, resumed: claim.is_some() })
    }

    fn is_good(&self, claim: Claim) -> bool {
        self.members.at(claim.seat).is_some_and(|member| member.answers_to(claim.serial))
    }

    /// Coded [`ServerMessage::Welcome`], which a player who joined is to be sent first. `token` seals
    /// the claim that the player was given.
    pub fn welcome(&self, seat: Seat, token: Token, host: bool) -> Vec<u8> {
        let scene = self.game.scene();
        let welcome = ServerMessage::Welcome {
            seat: seat.0,
            host,
            token,
            tick: self.game.tick_count() + 1,
            room: self.code.clone(),
            scene_name: scene.name.clone(),
            scene: scene.source.clone(),
        };
        welcome.encode()
    }

    /// The seat's socket is gone; the seat is held for [`SEAT_HELD_TICKS`], its hero at rest. Of somebody
    /// who never sent an input it is free at once. Nothing happens if the seat is free.
    pub fn disconnect(&mut self, seat: Seat) {
        let tick = self.game.tick_count();
        if self.members.at(seat).is_some_and(|member| !member.played) {
            return self.leave(seat);
        }
        if let Some(member) = self.members.at_mut(seat) {
            member.lost_tick.get_or_insert(tick);
            member.inputs.rest();
            self.sights[usize::from(seat.0)] = None;
        }
    }

    /// The player left for good; effective with the next tick. Nothing happens if the seat is free.
    pub fn leave(&mut self, seat: Seat) {
        if !self.members.remove(seat) {
            return;
        }
        self.sights[usize::from(seat.0)] = None;
        self.changes.retain(|&change| change != Change::Look(seat));
        // Who leaves before the tick of joining was never there.
        match self.changes.iter().position(|&change| change == Change::Join(seat)) {
            Some(place) => drop(self.changes.remove(place)),
            None => self.changes.push(Change::Leave(seat)),
        }
    }

    /// Queues an input, and returns whether it did: old, repeated and far-future sequence numbers
    /// are dropped, and so is everything for a seat without a socket.
    pub fn input(&mut self, seat: Seat, seq: u32, input: Input) -> bool {
        let member = self.members.at_mut(seat).filter(|member| member.lost_tick.is_none());
        member.is_some_and(|member| {
            member.serial_before = None;
            member.played = true;
            member.inputs.push(seq, input)
        })
    }

    /// Plays one tick: joins and leaves, one input per player in seat order, the game, a snapshot.
    pub fn tick(&mut self) {
        self.free_abandoned_seats();
        let changes = self.apply_changes();
        self.inputs.clear();
        let members = self.members.iter_mut();
        self.inputs
            .extend(members.filter_map(|(seat, member)| Some((seat, member.inputs.take()?))));
        self.game.tick(&self.inputs);
        if let Some(recorder) = &mut self.recorder {
            recorder.tick(changes, &self.inputs, &self.game, || self.members.appearances());
        }
        self.capture();
        self.feed();
    }

    /// Takes the newest snapshot, in the memory of the one before the last unless a feed still
    /// holds that.
    fn capture(&mut self) {
        let mut next = std::mem::replace(&mut self.before, Arc::clone(&self.newest));
        if Arc::get_mut(&mut next).is_none() {
            next = Arc::default();
        }
        let snapshot = Arc::get_mut(&mut next).expect("nobody else holds it");
        let mut count = 0;
        for player in self.game.players() {
            let Some(member) = self.members.at(player.seat) else { continue };
            match snapshot.players.get_mut(count) {
                Some(state) => member.update(&player, state),
                None => snapshot.players.push(member.state(&player)),
            }
            count += 1;
        }
        snapshot.players.truncate(count);
        snapshot.recapture(&self.game);
        self.newest = next;
    }

    /// Codes the newest snapshot for each rate.
    fn feed(&mut self) {
        let tick = self.newest.tick;
        let timed = |&event: &Event| TimedEvent { tick, event };
        self.events.clear();
        self.events.extend(self.game.events().iter().map(timed));
        for feed in self.feeds.iter_mut().flatten() {
            let particles = self.game.world().particles();
            feed.push(&self.newest, &self.events, particles, &mut self.press);
        }
        if tick.is_multiple_of(VIEW_EVERY_TICKS) {
            self.resize_sights();
        }
        for sight in self.sights.iter_mut().flatten() {
            let particles = self.game.world().particles();
            sight.push(&self.newest, &self.events, particles, &mut self.press);
        }
    }

    /// Has players come and go; what was done, for the recorder.
    fn apply_changes(&mut self) -> Vec<replay::Change> {
        let look = |members: &Members, seat| {
            let member = members.at(seat).expect("who joins or comes back has the seat");
            member.appearance.clone()
        };
        let changes = self.changes.drain(..).map(|change| match change {
            Change::Join(seat) => {
                self.game.join(seat);
                replay::Change::Join(seat, look(&self.members, seat))
            }
            Change::Leave(seat) => {
                self.game.leave(seat);
                replay::Change::Leave(seat)
            }
            Change::Look(seat) => replay::Change::Look(seat, look(&self.members, seat)),
        });
        changes.collect()
    }

    /// Records from here on. `program` is the version that plays, `unix_s` the time, 0 if unknown.
    pub fn record(&mut self, program: &str, unix_s: u64) {
        let scene = self.game.scene();
        let start = replay::Start {
            program: program.to_owned(),
            unix_s,
            room: self.code.clone(),
            scene_name: scene.name.clone(),
            scene: scene.source.clone(),
            seed: self.seed,
            first_tick: self.game.tick_count(),
        };
        // Who joins with the next tick is recorded with it.
        let joins = |seat| self.changes.contains(&Change::Join(seat));
        let mut members = self.members.appearances();
        members.retain(|&(seat, _)| !joins(seat));
        self.recorder = Some(Recorder::new(start, &self.game, members));
    }

    /// The records that are ready, in order; empty where nothing is recorded.
    pub fn take_records(&mut self) -> Vec<Record> {
        self.recorder.as_mut().map(Recorder::take).unwrap_or_default()
    }

    /// Ends the recording; its last records.
    pub fn stop_recording(&mut self) -> Vec<Record> {
        let recorder = self.recorder.take();
        recorder.map(|recorder| recorder.finish(&self.game)).unwrap_or_default()
    }

    /// Ends the recording of a game that failed inside a tick: what was played until then.
    pub fn break_off_recording(&mut self) -> Vec<Record> {
        self.recorder.take().map(Recorder::break_off).unwrap_or_default()
    }

    fn free_abandoned_seats(&mut self) {
        let tick = self.game.tick_count();
        let is_over = |member: &Member| {
            member.lost_tick.is_some_and(|lost_tick| tick - lost_tick >= SEAT_HELD_TICKS)
        };
        let abandoned: Vec<_> = self
            .members
            .iter()
            .filter(|(_, member)| is_over(member))
            .map(|(seat, _)| seat)
            .collect();
        abandoned.into_iter().for_each(|seat| self.leave(seat));
    }

    /// A client begins to read snapshots of the whole world: its place, and the coded keyframe to be
    /// sent first. After every tick from the next on [`Room::message`] has what it is sent. At the full
    /// rate it is told all that flies, and has the particles of the game from here on.
    pub fn begin(&mut self, rate: Rate) -> (Reader, Bytes) {
        self.begin_with(rate, true)
    }

    /// `fresh`: it knows of no particles.
    fn begin_with(&mut self, rate: Rate, fresh: bool) -> (Reader, Bytes) {
        let flying = flying(&self.game).filter(|_| fresh);
        let feed = &mut self.feeds[rate as usize];
        feed.get_or_insert_with(|| Feed::new(rate, &self.newest)).begin(flying)
    }

    /// The same for a player's client, which in a world larger than its view is sent what the camera
    /// can see. A reader that the player had before ends with this. Only the first of a socket is told
    /// what flies, even if its link is so slow that the keyframe is dropped before it is sent: who begins
    /// again was too slow, or was not any more, and mostly has most of it.
    pub fn begin_at(&mut self, seat: Seat, rate: Rate) -> (Reader, Bytes) {
        let scene = self.game.scene();
        let member = self.members.at_mut(seat);
        let fresh = member.map(|member| !std::mem::replace(&mut member.began, true));
        let fresh = fresh.unwrap_or_default();
        let member = self.members.at(seat);
        let view = member.and_then(|member| view_of(scene, member.view));
        let before = self.sights.get_mut(usize::from(seat.0)).and_then(Option::take);
        let Some(view) = view else { return self.begin_with(rate, fresh) };
        let flying = flying(&self.game).filter(|_| fresh);
        let (sight, reader, keyframe) =
            Sight::begin(before, seat, rate, scene, view, &self.newest, flying);
        self.sights[usize::from(seat.0)] = Some(sight);
        (reader, keyframe)
    }

    /// A player's page shows this much of the world, width and height in world units. The first word of
    /// a player holds at once, later ones from the next of the ticks that are [`VIEW_EVERY_TICKS`] apart:
    /// whoever comes into sight is told in full. Nothing happens if the seat is free.
    pub fn view(&mut self, seat: Seat, size: Vec2) {
        let Some(member) = self.members.at_mut(seat) else { return };
        let first = member.view.replace(size).is_none();
        let Some(sight) = &mut self.sights[usize::from(seat.0)] else { return };
        if first {
            sight.resize(self.game.scene(), size);
        }
    }

    /// Has the sights be as wide as their pages said last.
    fn resize_sights(&mut self) {
        for (sight, seat) in self.sights.iter_mut().zip(0..) {
            let told = self.members.at(Seat(seat)).and_then(|member| member.view);
            if let (Some(sight), Some(size)) = (sight, told) {
                sight.resize(self.game.scene(), size);
            }
        }
    }

    /// The coded snapshot that a client is sent after this tick; `None` between the ticks of its
    /// rate, and while nothing moves. Coded once, then shared. A client that misses one has to begin
    /// again.
    pub fn message(&self, reader: &Reader) -> Option<&Bytes> {
        match reader.seat {
            None => self.feeds[reader.rate as usize].as_ref()?.message(reader),
            Some(seat) => self.sights[usize::from(seat.0)].as_ref()?.message(reader),
        }
    }

    /// The newest snapshot: what is coded.
    pub fn snapshot(&self) -> &Snapshot {
        &self.newest
    }

    /// The word in the room's link.
    pub fn code(&self) -> &str {
        &self.code
    }

    /// What is played here.
    pub fn scene(&self) -> &Arc<Scene> {
        self.game.scene()
    }

    /// The game.
    pub fn game(&self) -> &Game {
        &self.game
    }

    /// Seats taken, held ones included; 0 is a room that nobody misses.
    pub fn players(&self) -> usize {
        self.members.iter().count()
    }

    /// Seats that are held for lost players, those first who were lost first.
    pub fn held(&self) -> Vec<Seat> {
        let lost = self.members.iter().filter_map(|(seat, member)| Some((member.lost_tick?, seat)));
        let mut held: Vec<_> = lost.collect();
        held.sort_unstable();
        held.into_iter().map(|(_, seat)| seat).collect()
    }

    /// Seats with a socket.
    pub fn connected(&self) -> usize {
        self.members.iter().filter(|(_, member)| member.lost_tick.is_none()).count()
    }
}

fn flying(game: &Game) -> Option<Flying<'_>> {
    Some(Flying { tick: game.tick_count(), particles: game.world().particles() })
}

#[cfg(test)]
mod tests;
