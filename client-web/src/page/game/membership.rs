//! Everything that a seat in a room brings. The next welcome replaces it, or goes on with it on another socket.

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

/// Ticks that may be missing between two sockets of the same seat. Over a longer gap, which the display would jump
/// across anyway, the picture starts over.
const GAP_TICKS_MAX: u32 = 30;

/// A seat in a room: the copy of the room, its time, and the inputs on their way.
pub struct RoomMembership {
    /// The copy of the room.
    pub replica: Replica,
    /// Number of the copy: drawing carries nothing over from one to the next.
    pub copy: u32,
    /// Time as the snapshots tell it.
    pub clock: Clock,
    /// Inputs on their way to the server.
    pub sender: InputSender,
    /// Shows the own hero ahead of the server, where the player steers one and wants that.
    pub predictor: Option<Predictor>,
    /// Width and height of the view that the room knows.
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

    /// Whether a welcome to a seat goes on with this one in the same scene: not after a long gap, and not if the room
    /// is older there than what was shown.
    pub fn continues(&self, seat: Seat, welcomed_tick: u32) -> bool {
        let newest = self.replica.room.newest().map_or(0, |newest| newest.tick);
        seat == self.replica.room.seat
            && welcomed_tick.checked_sub(newest).is_some_and(|gap| gap <= GAP_TICKS_MAX)
    }

    /// Goes on with the same seat on another socket. What only the socket's two ends know starts over: the stream of
    /// snapshots, the numbers of inputs, the view, and the time that messages take. The world stays, with what was
    /// not shown of it yet, and so do the measured jitter and lead.
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

    /// Low bits of the newest tick of which a snapshot was read on this socket; before the first, of the welcome's.
    pub fn ack_tick(&self) -> u16 {
        let newest = self.replica.room.newest().map_or(0, |newest| newest.tick);
        newest.max(self.welcomed_tick) as u16
    }

    /// The next input to send, if one is due; none before the first snapshot on this socket, which tells the time.
    pub fn next_input(&mut self, now_ms: f64) -> Option<(u32, Input)> {
        let tick = self.clock.server_tick(now_ms)?;
        let Some(predictor) = &mut self.predictor else { return self.sender.due(now_ms, tick) };
        self.sender.book_until(predictor.booked());
        // It is played in the first tick after this moment.
        let (seq, input) = self.sender.due(now_ms, predictor.moment_at(tick, now_ms))?;
        predictor.sent(seq, input, tick, now_ms);
        Some((seq, input))
    }

    /// Moves the display, and the predicted hero with it, to `now_ms`.
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

/// The camera of a game and what it shows.
pub struct GameView {
    /// The camera, once the scene is known.
    pub camera: Option<Camera>,
    /// The view of the last frame.
    pub view: View,
    pub framed_ms: f64,
    /// Whether the camera of a spectator is that of a hero; `None` before it was chosen.
    pub follows: Option<bool>,
    /// The player switched outlines away from the scene's own choice.
    pub bounds_toggled: bool,
}

impl GameView {
    /// A view that nothing was drawn in.
    pub fn new(now_ms: f64) -> GameView {
        GameView {
            camera: None,
            view: View::UNSEEN,
            framed_ms: now_ms,
            follows: None,
            bounds_toggled: false,
        }
    }

    /// Whether outlines are drawn: always where bodies are selected by them, else on demand.
    pub fn bounds(&self, replica: Option<&Replica>) -> bool {
        let own = replica.is_some_and(|replica| replica.room.scene.tools.contains(Tools::SELECT));
        own != self.bounds_toggled
    }

    /// The player's part in a frame.
    pub fn eye(&self, controls: &Controls, replica: Option<&Replica>) -> Eye {
        Eye { pointer: controls.pointer(&self.view), bounds: self.bounds(replica) }
    }

    /// Takes the camera of a new welcome.
    pub fn adopt(&mut self, replica: &Replica, same_scene: bool) {
        match &mut self.camera {
            // The view stays, for the pointer's sake, and jumps with the first snapshot.
            Some(camera) if same_scene => camera.cut(),
            camera => {
                let scene = &replica.room.scene;
                *camera = Some(Camera::new(scene.camera, scene.size));
                self.follows = None;
            }
        }
    }

    /// The next picture shows another moment: the camera jumps.
    pub fn cut(&mut self) {
        if let Some(camera) = &mut self.camera {
            camera.cut();
        }
    }

    /// Moves the camera. That of a spectator shows the whole, or the hero who is `followed`.
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
            // No more than what is around the server's hero is sent.
            CameraRule::Follow { .. } => replica.own_hero_as_told(),
            CameraRule::Fit | CameraRule::Whole => {
                replica.own_hero().map(|hero| (hero.center, hero.velocity))
            }
        });
        self.view = camera.view(Target { hero, ..canvas });
    }
}
