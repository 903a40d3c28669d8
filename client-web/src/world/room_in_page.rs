//! A room inside the page, for playing alone and for demos. It exchanges the same bytes as a server, so everything
//! above the socket is the same code as online. A scripted demo always produces the same picture.

use crate::net::api::query_value;
use jostle_game::{Buttons, Input, Scene, Seat, Tools};
use jostle_protocol::limits::TOKEN_BYTES;
use jostle_protocol::replay::{Replay, header};
use jostle_protocol::{Appearance, ClientMessage, ServerMessage, Token, WelcomeSeat};
use jostle_room::log::{CLIP_TICKS, cut};
use jostle_room::run::RUN_TICKS_MAX;
use jostle_room::{Claim, Measure, Rate, Room, Subscriber, Welcome};
use jostle_sim::{TICKS_PER_SECOND, Vec2};
use std::sync::Arc;

/// Maximum number of ticks caught up at once if the page is late; the rest are skipped, as on the server.
const CATCH_UP_TICKS_MAX: f64 = 5.0;
/// Time limit for the ticks of a frame, milliseconds. The remaining ticks are left to the next frame, so that the page
/// stays responsive.
const FRAME_MS: f64 = 100.0;
/// Duration of a tick, milliseconds.
const TICK_MS: f64 = 1000.0 / TICKS_PER_SECOND as f64;

/// A demo requested by the address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DemoRequest {
    /// The name of a built-in scene.
    pub scene: String,
    /// Seed of the game.
    pub seed: u64,
    /// Plays this many scripted ticks, then freezes.
    pub ticks: Option<u32>,
    /// The number of scripted players besides the page's own.
    pub bots: u8,
    /// Whether the HUD is shown over a frozen picture.
    pub hud: bool,
}

impl DemoRequest {
    /// Parses a query string; `None` if it requests no demo.
    pub fn parse(query: &str) -> Option<DemoRequest> {
        let value = |name: &str| query_value(query, name);
        Some(DemoRequest {
            scene: value("demo")?.to_owned(),
            seed: value("seed").and_then(|v| v.parse().ok()).unwrap_or(1),
            ticks: value("ticks").and_then(|v| v.parse().ok()),
            bots: value("bots").and_then(|v| v.parse().ok()).unwrap_or(0),
            hud: value("hud") == Some("1"),
        })
    }
}

/// A room in the page and its only real player.
pub struct RoomInPage {
    room: Room,
    scene: Arc<Scene>,
    own: Option<Claim>,
    bots: Vec<Seat>,
    scripted: bool,
    reader: Option<Subscriber>,
    outbox: Vec<Vec<u8>>,
    /// The revision of the room's members at which the page was told the bots; `None` if it did not ask.
    told_members: Option<u64>,
    started_ms: Option<f64>,
    played: f64,
    tick: u32,
    /// The records of the game so far, if it may count as a run.
    recorded: Option<Vec<u8>>,
}

impl RoomInPage {
    /// Creates a room at tick 0. With `scripted`, the inputs of the page's player come from the script too.
    pub fn new(scene: Arc<Scene>, seed: u64, bots: u8, scripted: bool) -> RoomInPage {
        let room = Room::new("demo", Arc::clone(&scene), seed);
        let mut demo = RoomInPage { scripted, ..RoomInPage::around(room, Arc::clone(&scene)) };
        const COLORS: u16 = jostle_protocol::limits::COLORS as u16;
        let bots = u16::from(bots).min(scene.players_max.saturating_sub(1));
        let names = ["Ada", "Grace", "Alan", "Edsger", "Barbara", "Donald", "Niklaus", "Radia"];
        let seats = (0..bots).filter_map(|i| {
            let name = names[usize::from(i) % names.len()].to_owned();
            let appearance = Appearance { name: name.into(), color: ((i + 1) % COLORS) as u8 };
            demo.room.join(appearance, None).ok().map(|welcome| welcome.claim.seat)
        });
        demo.bots = seats.collect();
        demo
    }

    /// Creates a room at tick 0 for one player with this many of the server's bots.
    pub fn alone(scene: Arc<Scene>, seed: u64, bots: u16) -> RoomInPage {
        let mut room = Room::filled("alone", Arc::clone(&scene), seed, bots.saturating_add(1));
        room.keep_clips(env!("CARGO_PKG_VERSION"));
        let recorded = Measure::of(&scene).map(|_| header());
        if recorded.is_some() {
            // The time is recorded as unknown, because the server's clock is more reliable.
            room.record(env!("CARGO_PKG_VERSION"), 0);
        }
        RoomInPage { recorded, ..RoomInPage::around(room, scene) }
    }

    fn around(room: Room, scene: Arc<Scene>) -> RoomInPage {
        RoomInPage {
            room,
            scene,
            own: None,
            bots: Vec::new(),
            scripted: false,
            reader: None,
            outbox: Vec::new(),
            told_members: None,
            started_ms: None,
            played: 0.0,
            tick: 0,
            recorded: None,
        }
    }

    /// Handles a message from the page as the server would.
    pub fn receive(&mut self, bytes: &[u8]) {
        match ClientMessage::decode(bytes) {
            Ok(ClientMessage::Hello { appearance, .. }) => {
                // A further hello means that the same player reconnects.
                match self.room.join(appearance, self.own) {
                    Ok(Welcome { claim, .. }) => {
                        (self.own, self.reader) = (Some(claim), None);
                        // A real token is not needed, since the room ends with its page and has only one player.
                        let token = Token([0; TOKEN_BYTES]);
                        let seat = WelcomeSeat { seat: claim.seat, host: false, token };
                        self.outbox.push(self.room.welcome(Some(seat)));
                    }
                    Err(refusal) => self.outbox.push(ServerMessage::Refused { refusal }.encode()),
                }
            }
            Ok(ClientMessage::Input { seq, input, .. }) => {
                if let Some(seat) = self.seat().filter(|_| !self.scripted) {
                    self.room.input(seat, seq, input);
                }
            }
            Ok(ClientMessage::Ping { stamp }) => {
                self.outbox.push(ServerMessage::Pong { stamp, tick: self.tick }.encode());
            }
            Ok(ClientMessage::Look { appearance }) => {
                self.seat().into_iter().for_each(|seat| self.room.change_look(seat, &appearance));
            }
            Ok(ClientMessage::FollowBots) => self.tell_bots(),
            Ok(ClientMessage::View { size }) => {
                self.seat().into_iter().for_each(|seat| self.room.view(seat, size));
            }
            Ok(ClientMessage::Emote { emote }) => {
                let shown = self.seat().map(|seat| ServerMessage::Emote { seat, emote }.encode());
                self.outbox.extend(shown);
            }
            // The other messages need a server, and the page sends none that are invalid.
            _ => {}
        }
    }

    /// Plays the ticks due at `now_ms`; returns the time spent, milliseconds.
    pub fn advance(&mut self, now_ms: f64, clock: fn() -> f64) -> f64 {
        let began_ms = clock();
        let started = *self.started_ms.get_or_insert(now_ms);
        let due = (now_ms - started) / TICK_MS;
        self.played = self.played.max(due - CATCH_UP_TICKS_MAX);
        while self.played + 1.0 <= due {
            self.played += 1.0;
            self.tick();
            if clock() - began_ms > FRAME_MS {
                break;
            }
        }
        clock() - began_ms
    }

    /// Plays one tick and puts its snapshot into the outbox.
    pub fn tick(&mut self) {
        let own = self.seat().filter(|_| self.scripted);
        for seat in own.into_iter().chain(self.bots.iter().copied()) {
            let input = scripted_input(&self.scene, seat, self.tick);
            self.room.input(seat, self.tick + 1, input);
        }
        self.room.tick();
        self.tick = self.room.game().tick_count();
        self.keep_records();
        if self.told_members.is_some_and(|told| told != self.room.members_revision()) {
            self.tell_bots();
        }
        if let Some(seat) = self.seat() {
            let message = match &self.reader {
                Some(reader) => self.room.message(reader).cloned(),
                None => {
                    let (reader, keyframe) = self.room.subscribe_view(seat, Rate::Full);
                    self.reader = Some(reader);
                    Some(keyframe)
                }
            };
            self.outbox.extend(message.map(|bytes| bytes.to_vec()));
        }
    }

    fn tell_bots(&mut self) {
        self.told_members = Some(self.room.members_revision());
        self.outbox.push(ServerMessage::Bots { seats: self.room.bot_seats() }.encode());
    }

    /// Stores new records, unless the game is already longer than the longest allowed run.
    fn keep_records(&mut self) {
        let records = self.room.take_records();
        if self.tick > RUN_TICKS_MAX {
            self.room.stop_recording();
            self.recorded = None;
        }
        let Some(recorded) = &mut self.recorded else { return };
        records.iter().for_each(|record| recorded.extend(record.seal()));
    }

    /// The replay of the game so far. `None` if the game is too long for a run or the scene has no records.
    pub fn run(&self) -> Option<Vec<u8>> {
        let mut bytes = self.recorded.clone()?;
        self.room.recording_end().iter().for_each(|record| bytes.extend(record.seal()));
        Some(bytes)
    }

    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Number of ticks played so far.
    pub fn tick_count(&self) -> u32 {
        self.tick
    }

    fn seat(&self) -> Option<Seat> {
        self.own.map(|claim| claim.seat)
    }

    /// A hash of the room's whole state.
    pub fn state_hash(&self) -> u64 {
        self.room.game().hash()
    }

    /// The last few seconds as a replay file.
    pub fn clip(&self) -> Option<Vec<u8>> {
        let records = self.room.clip(0)?;
        let bytes =
            header().into_iter().chain(records.iter().flat_map(|record| record.seal())).collect();
        cut(Replay::read(bytes).ok()?, self.tick.saturating_sub(CLIP_TICKS), self.tick).ok()
    }

    /// Takes the messages for the page.
    pub fn take(&mut self) -> Vec<Vec<u8>> {
        std::mem::take(&mut self.outbox)
    }
}

/// The input of a scripted player at this tick. The player runs back and forth, hops, and occasionally uses each of the
/// scene's tools at positions that wander across the world. Every seat acts differently.
pub fn scripted_input(scene: &Scene, seat: Seat, tick: u32) -> Input {
    let phase = tick + u32::from(seat.0) * 37;
    let mut bits = 0;
    let mut hold = |tool: Tools, button: Buttons, on: bool| {
        if on && scene.tools.contains(tool) {
            bits |= button.0;
        }
    };
    hold(Tools::STEER, Buttons::RIGHT, phase % 160 < 70);
    hold(Tools::STEER, Buttons::LEFT, (80..150).contains(&(phase % 160)));
    hold(Tools::STEER, Buttons::UP, phase % 53 < 14);
    hold(Tools::LAUNCH, Buttons::FIRE, phase % 45 == 20);
    hold(Tools::MARBLE, Buttons::MAKE, phase.is_multiple_of(12) && phase % 400 < 240);
    hold(Tools::SPRAY, Buttons::MAKE, phase % 200 < 120);
    hold(Tools::AGITATE, Buttons::AGITATE, phase % 500 == 499);
    hold(Tools::SELECT, Buttons::FIRE, phase % 120 < 90);
    hold(Tools::SELECT, Buttons::PICK_MINION, phase % 240 == 100);
    hold(Tools::SELECT, Buttons::PICK_HERO, phase % 240 == 220);
    Input::new(Buttons(bits), Some(wander(scene.size, phase)))
}

/// A position that crosses the world on two zigzags with different periods.
fn wander(size: Vec2, phase: u32) -> Vec2 {
    let zigzag = |period: u32| {
        let at = phase % (2 * period);
        at.min(2 * period - at) as f32 / period as f32
    };
    size * Vec2::new(0.1 + 0.8 * zigzag(230), 0.35 + 0.5 * zigzag(97))
}

#[cfg(test)]
mod tests;
