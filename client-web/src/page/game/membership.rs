//! The state that comes with a seat in a room. The next welcome replaces it, or continues it on another socket.

use crate::input::keys::Controls;
use crate::input::sender::InputSender;
use crate::net::clock::Clock;
use crate::view::camera::{Camera, Target, watching_camera};
use crate::view::frame::View;
use crate::world::predict::Predictor;
use crate::world::replica::{Eye, Replica};
use jostle_game::scene::Camera as CameraRule;
use jostle_game::{Input, Seat, Tools};
use jostle_sim::Vec2;

/// Maximum gap in ticks between two sockets for the same seat. After a longer gap, across which the display would jump
/// anyway, the state is rebuilt.
const GAP_TICKS_MAX: u32 = 30;

/// A seat in a room: the room's replica, its clock, and outgoing inputs.
pub struct RoomMembership {
    /// The replica of the room.
    pub replica: Replica,
    /// The number of the replica. Rendering keeps no state across replicas.
    pub copy: u32,
    /// The clock derived from snapshots.
    pub clock: Clock,
    pub sender: InputSender,
    /// Predicts the player's hero ahead of the server, if the player steers one and prediction is on.
    pub predictor: Option<Predictor>,
    /// The view size last sent to the room.
    pub sent_view: Option<Vec2>,
    pub welcomed_tick: u32,
}

impl RoomMembership {
    pub fn new(replica: Replica, copy: u32, welcomed_tick: u32) -> RoomMembership {
        RoomMembership {
            replica,
            copy,
            clock: Clock::default(),
            sender: InputSender::default(),
            predictor: None,
            sent_view: None,
            welcomed_tick,
        }
    }

    /// Whether a welcome continues this seat in the same scene. It does not after a long gap, or if the room on the new
    /// socket is older than the displayed state.
    pub fn continues(&self, seat: Seat, welcomed_tick: u32) -> bool {
        let newest = self.replica.room.newest().map_or(0, |newest| newest.tick);
        seat == self.replica.room.seat
            && welcomed_tick.checked_sub(newest).is_some_and(|gap| gap <= GAP_TICKS_MAX)
    }

    /// Continues the same seat on another socket. State shared by the two ends of a socket is reset: the snapshot
    /// stream, input sequence numbers, the view, and the measured transit times. The world is kept, including what has
    /// not been displayed yet, as are the measured jitter and lead.
    pub fn go_on(&mut self, welcomed_tick: u32, now_ms: f64) {
        self.replica.begin_stream();
        self.clock.restart(now_ms);
        self.sender = InputSender::default();
        if let Some(predictor) = &mut self.predictor {
            predictor.restart(now_ms);
        }
        self.sent_view = None;
        self.welcomed_tick = welcomed_tick;
    }

    /// Switches prediction on or off.
    pub fn set_prediction(&mut self, on: bool) {
        if on == self.predictor.is_some() {
            return;
        }
        let replica = &self.replica;
        self.predictor =
            if on { Predictor::new(&replica.room.scene, replica.room.seat) } else { None };
    }

    /// The low bits of the newest tick received on this socket; before the first snapshot, of the welcome's tick.
    pub fn ack_tick(&self) -> u16 {
        let newest = self.replica.room.newest().map_or(0, |newest| newest.tick);
        newest.max(self.welcomed_tick) as u16
    }

    /// The next input to send, if one is due. `None` before the first snapshot on this socket, which sets the clock.
    pub fn next_input(&mut self, now_ms: f64) -> Option<(u32, Input)> {
        let tick = self.clock.server_tick(now_ms)?;
        let Some(predictor) = &mut self.predictor else { return self.sender.due(now_ms, tick) };
        self.sender.book_until(predictor.booked());
        // The input is played in the first tick after this moment.
        let (seq, input) = self.sender.due(now_ms, predictor.moment_at(tick, now_ms))?;
        predictor.sent(seq, input, tick, now_ms);
        Some((seq, input))
    }

    /// Advances the display and the predicted hero to `now_ms`.
    pub fn move_display(&mut self, now_ms: f64, eye: Eye) {
        if let Some(tick) = self.clock.display(now_ms) {
            self.replica.advance(tick, eye);
        }
        let Some(predictor) = &mut self.predictor else { return };
        let Some(tick) = self.clock.server_tick(now_ms) else { return };
        let replica = &self.replica;
        if let Some(own) = predictor.advance(tick, now_ms, |id| replica.room.place(id)) {
            self.replica.lead(own);
        }
    }
}

/// The camera of a game and its view.
pub struct GameView {
    /// The camera, once the scene is known.
    pub camera: Option<Camera>,
    /// The view of the most recent frame.
    pub view: View,
    pub framed_ms: f64,
    /// Whether a spectator's camera follows a hero; `None` until that is decided.
    pub follows: Option<bool>,
    /// Whether the player toggled outlines from the scene's default.
    pub bounds_toggled: bool,
}

impl GameView {
    /// A view before the first frame.
    pub fn new(now_ms: f64) -> GameView {
        GameView {
            camera: None,
            view: View::UNSEEN,
            framed_ms: now_ms,
            follows: None,
            bounds_toggled: false,
        }
    }

    /// Whether outlines are drawn. They are on by default in scenes in which the player selects bodies.
    pub fn bounds(&self, replica: Option<&Replica>) -> bool {
        let own = replica.is_some_and(|replica| replica.room.scene.tools.contains(Tools::SELECT));
        own != self.bounds_toggled
    }

    /// The player-dependent inputs to a frame.
    pub fn eye(&self, controls: &Controls, replica: Option<&Replica>) -> Eye {
        Eye { pointer: controls.pointer(&self.view), bounds: self.bounds(replica) }
    }

    /// Sets up the camera for a new welcome.
    pub fn adopt(&mut self, replica: &Replica, same_scene: bool) {
        match &mut self.camera {
            // The view is kept, so that the pointer's world position is defined, and jumps with the first snapshot.
            Some(camera) if same_scene => camera.cut(),
            camera => {
                let scene = &replica.room.scene;
                *camera = Some(Camera::new(scene.camera, scene.size));
                self.follows = None;
            }
        }
    }

    /// Makes the camera jump, because the next picture shows a different moment.
    pub fn cut(&mut self) {
        if let Some(camera) = &mut self.camera {
            camera.cut();
        }
    }

    /// Moves the camera. A spectator's camera shows the whole scene, or the `followed` hero.
    pub fn aim(
        &mut self,
        replica: Option<&Replica>,
        followed: Option<Option<(Vec2, Vec2)>>,
        canvas: Target,
    ) {
        if let (Some(hero), Some(replica)) = (followed, replica) {
            if self.follows != Some(hero.is_some()) {
                self.follows = Some(hero.is_some());
                self.camera = Some(watching_camera(&replica.room.scene, hero.is_some()));
            }
            if let Some(camera) = &mut self.camera {
                self.view = camera.view(Target { hero, ..canvas });
            }
            return;
        }
        let Some(camera) = &mut self.camera else { return };
        let hero = replica.and_then(|replica| match replica.room.scene.camera {
            // The server sends only the surroundings of the hero's authoritative position.
            CameraRule::Follow { .. } => replica.own_hero_as_told(),
            CameraRule::Fit | CameraRule::Whole => {
                replica.own_hero().map(|hero| (hero.center, hero.velocity))
            }
        });
        self.view = camera.view(Target { hero, ..canvas });
    }
}
