//! Everything that a seat in a room brings, and that the next welcome replaces.

use crate::input::keys::Controls;
use crate::input::sender::InputSender;
use crate::net::clock::{Clock, TICK_MS};
use crate::view::camera::{Camera, Target};
use crate::view::frame::View;
use crate::world::predict::Predictor;
use crate::world::replica::{Eye, Replica};
use jostle_game::scene::Camera as CameraRule;
use jostle_game::{Input, Tools};
use jostle_sim::Vec2;

/// A seat in a room: the copy of the room, its time, and the inputs on their way.
pub struct Membership {
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

impl Membership {
    pub fn new(replica: Replica, copy: u32, welcomed_tick: u32) -> Membership {
        Membership {
            replica,
            copy,
            clock: Clock::default(),
            sender: InputSender::default(),
            predictor: None,
            sent_view: None,
            welcomed_tick,
        }
    }

    /// Switches prediction on or off.
    pub fn set_prediction(&mut self, on: bool) {
        if on == self.predictor.is_some() {
            return;
        }
        let replica = &self.replica;
        self.predictor = if on { Predictor::new(&replica.scene, replica.seat) } else { None };
    }

    /// Low bits of the newest tick of which a snapshot was read.
    pub fn ack_tick(&self) -> u16 {
        self.replica.newest().map_or(self.welcomed_tick, |newest| newest.tick) as u16
    }

    /// The next input to send, if one is due.
    pub fn next_input(&mut self, now_ms: f64) -> Option<(u32, Input)> {
        let moment = self.next_moment(now_ms);
        let (seq, input) = self.sender.due(now_ms, moment)?;
        if let (Some(predictor), Some(tick)) = (&mut self.predictor, self.clock.server_tick(now_ms))
        {
            predictor.sent(seq, input, tick, now_ms);
        }
        Some((seq, input))
    }

    /// An input sent now is played in the first tick after this moment; without prediction its phase
    /// is a guess.
    fn next_moment(&mut self, now_ms: f64) -> f64 {
        let tick = self.clock.server_tick(now_ms).unwrap_or(now_ms / TICK_MS);
        let Some(predictor) = &self.predictor else { return tick };
        self.sender.book_until(predictor.booked());
        predictor.moment_at(tick, now_ms)
    }

    /// Moves the display, and the predicted hero with it, to `now_ms`.
    pub fn move_display(&mut self, now_ms: f64, eye: Eye) {
        if let Some(tick) = self.clock.display(now_ms) {
            self.replica.advance(tick, eye);
        }
        let Some(predictor) = &mut self.predictor else { return };
        let Some(tick) = self.clock.server_tick(now_ms) else { return };
        let replica = &self.replica;
        if let Some(own) = predictor.advance(tick, now_ms, |id| replica.place(id)) {
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
    /// When that was.
    pub framed_ms: f64,
    /// The player switched outlines away from the scene's own choice.
    pub bounds_toggled: bool,
}

impl GameView {
    /// The view before the first frame.
    pub const UNSEEN: View = View { center: Vec2::ZERO, height: 1.0, pixels: [1, 1] };

    /// A view that nothing was drawn in.
    pub fn new(now_ms: f64) -> GameView {
        GameView { camera: None, view: GameView::UNSEEN, framed_ms: now_ms, bounds_toggled: false }
    }

    /// Whether outlines are drawn: always where bodies are selected by them, else on demand.
    pub fn bounds(&self, replica: Option<&Replica>) -> bool {
        let own = replica.is_some_and(|replica| replica.scene.tools.contains(Tools::SELECT));
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
                let scene = &replica.scene;
                *camera = Some(Camera::new(scene.camera, scene.size));
            }
        }
    }

    /// Moves the camera.
    pub fn aim(&mut self, replica: Option<&Replica>, canvas: Target) {
        let Some(camera) = &mut self.camera else { return };
        let hero = replica.and_then(|replica| match replica.scene.camera {
            // No more than what is around the server's hero is sent.
            CameraRule::Follow { .. } => replica.own_hero_as_told(),
            CameraRule::Fit => replica.own_hero().map(|hero| (hero.center, hero.velocity)),
        });
        self.view = camera.view(Target { hero, ..canvas });
    }
}
