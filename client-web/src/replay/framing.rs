//! The camera of a replay, and the frame that it shows.

use super::player::ReplayPlayer;
use crate::view::camera::{Camera, Target, watching_camera};
use crate::view::frame::{Frame, View};
use jostle_sim::{TICKS_PER_SECOND, Vec2};

impl ReplayPlayer {
    /// A camera for the whole world, or for the hero that is followed, if there is one now.
    pub fn camera(&self) -> Camera {
        let scene = self.scene();
        watching_camera(scene, self.followed_hero().is_some())
    }

    /// The view in which a camera comes to rest while the film stands still. `bottom` are pixels
    /// that something else covers: what is to be seen is above them.
    pub fn still_view(&self, pixels: [u32; 2], bottom: u32) -> View {
        self.view(&mut self.camera(), pixels, bottom, 0.0)
    }

    /// The view of a camera of this replay, this many seconds after its last one.
    pub fn view(&self, camera: &mut Camera, pixels: [u32; 2], bottom: u32, elapsed_s: f32) -> View {
        let [width, height] = pixels;
        let free = height - bottom.min(height / 2);
        let hero = self.followed_hero();
        let above =
            camera.view(Target { pixels: [width, free], hero, top: 0, bottom: 0, elapsed_s });
        let unit = above.unit_per_pixel();
        let down = Vec2::new(0.0, 0.5 * unit * (height - free) as f32);
        View { center: above.center - down, height: unit * height as f32, pixels }
    }

    /// The frame that a camera shows now.
    pub fn frame(&self, view: View) -> Frame<'_> {
        Frame {
            view,
            world_size: self.scene().size,
            bodies: self.bodies(),
            zones: &self.replica().zones,
            marks: &self.replica().marks,
            lamps: &self.replica().lamps,
            sling: self.replica().sling.as_ref(),
            particles: self.particles(),
            particle_lead: self.rebuilt().map_or(self.particle_lead(), |r| r.particle_lead),
            effects: &self.replica().effects,
            time: (self.playhead / f64::from(TICKS_PER_SECOND)) as f32,
            bounds: self.bounds(),
            calm: false,
            copy: self.jumps,
            dimmed: false,
            sketch: None,
            ghost: None,
        }
    }
}
