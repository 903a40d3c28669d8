//! Converts a [`Frame`] to vertices. This is pure code that needs no GPU, used both by the page and for rendered
//! pictures.
//!
//! The list is in drawing order: zones, slabs, shadows, bodies with faces and effects; then all particles; then
//! overlays (outlines, the veil shown when the connection is lost).

mod bodies;
mod effects;
mod faces;
mod light;
mod moments;
pub(crate) mod motion;
mod outline;
mod scenery;
mod signs;
mod sketch;
pub mod sprite;
mod stage;
pub mod vertex;

pub use light::{LIGHT_CELLS, LightField};
pub use vertex::{Globals, ParticleVertex, SolidKind, SolidVertex};

use crate::view::frame::Frame;
use crate::view::palette::{self, INK};
use jostle_sim::Vec2;
use motion::{BodySprings, Pose};
use stage::{DrawStage, Quads};
use vertex::rgba;

/// Maximum number of particles drawn per frame; further ones are omitted.
pub const PARTICLES_MAX: usize = 65_536;

/// With reduced motion, one in this many particles is drawn, at this share of its brightness.
const CALM_STEP: usize = 4;
const CALM_SHARE: f32 = 0.5;

/// Everything the renderer needs for one frame. It is kept between frames to reuse its memory and, for squash and
/// stretch, to remember how bodies moved.
#[derive(Default)]
pub struct DrawList {
    pub globals: Globals,
    quads: Quads,
    /// Index of the first vertex in [`DrawList::solids`] that is drawn over the particles.
    pub overlay_start: usize,
    /// Particles, four vertices each.
    pub particles: Vec<ParticleVertex>,
    /// The light emitted by glowing objects.
    pub light: LightField,
    motion: BodySprings,
    /// The number of the replica for which motion was tracked.
    copy: u32,
    posed: Vec<(u32, Pose)>,
}

impl DrawList {
    pub fn new() -> DrawList {
        DrawList::default()
    }

    /// Replaces the contents with those of `frame`.
    pub fn fill(&mut self, frame: &Frame) {
        let half = frame.view.half();
        self.quads.begin(frame.view.center, half, frame.view.unit_per_pixel());
        self.light.begin(frame.view.center, half);
        if self.copy != frame.copy {
            self.copy = frame.copy;
            self.motion = BodySprings::default();
        }
        self.motion.begin(frame.time, frame.calm);

        let mut stage = DrawStage { quads: &mut self.quads, light: &mut self.light, frame };
        sketch::fill_under(&mut stage);
        scenery::zones(&mut stage);
        scenery::marks(&mut stage);
        scenery::sling(&mut stage);
        bodies::fill(&mut stage, &mut self.motion, &mut self.posed);
        effects::fill(&mut stage);
        self.fill_particles(frame);

        self.overlay_start = self.quads.vertices.len();
        moments::fill(&mut DrawStage { quads: &mut self.quads, light: &mut self.light, frame });
        if frame.bounds {
            outline::fill(&mut DrawStage { quads: &mut self.quads, light: &mut self.light, frame });
        }
        sketch::fill_over(&mut DrawStage { quads: &mut self.quads, light: &mut self.light, frame });
        if frame.dimmed {
            let veil = rgba(INK[0], 0.62);
            self.quads.push(SolidVertex::new(SolidKind::Box, frame.view.center, half, veil));
        }
        self.light.finish();
        self.globals = globals(frame, half, &self.light);
    }

    fn fill_particles(&mut self, frame: &Frame) {
        let Frame { particles, particle_lead: lead_s, calm, .. } = *frame;
        let dyes = &frame.room.dyes;
        self.particles.clear();
        if particles.is_empty() {
            return;
        }
        let velocities = particles.velocities();
        let (step, share) = if calm { (CALM_STEP, CALM_SHARE) } else { (1, 1.0) };
        for (index, &position) in particles.positions().iter().enumerate().step_by(step) {
            let look = particles.appearance(index);
            let [r, g, b, _] = look.color.map(|part| part * share);
            let dye = dyes.binary_search_by_key(&particles.seeds()[index], |dye| dye.0).ok();
            let tint = dye.map_or([r, g, b], |dye| dyed(r.max(g).max(b), dyes[dye].1));
            self.push_particle(position + velocities[index] * lead_s, look.size, tint);
        }
    }

    /// Adds one particle: centre and width in world units, and a tint whose factors may exceed 1.
    fn push_particle(&mut self, center: Vec2, size: f32, tint: [f32; 3]) {
        let hidden = !self.quads.sees(center, Vec2::splat(0.5 * size));
        if hidden || self.particles.len() >= PARTICLES_MAX * 4 {
            return;
        }
        // A flame particle is about 5.5 units wide at birth (A3.18).
        // The light of a fire is warmer than its gas, so some of the red is added as orange.
        let warm = [tint[0], tint[1] + 0.22 * tint[0], tint[2]];
        self.light.add(center, warm, size * size * (1.0 / 30.0));
        let vertex = ParticleVertex { center: center.into(), size, tint };
        self.particles.extend_from_slice(&[vertex; 4]);
    }

    /// Solid quads, four vertices each.
    pub fn solids(&self) -> &[SolidVertex] {
        &self.quads.vertices
    }
}

/// The tint of a particle of dye that is as bright as this.
fn dyed(bright: f32, color: u8) -> [f32; 3] {
    palette::player(color).map(|part| f32::from(part) / 255.0 * bright)
}

fn globals(frame: &Frame, half: Vec2, light: &LightField) -> Globals {
    let look = frame.style();
    let [red, green, blue] = look.lines;
    Globals {
        center: frame.view.center.into(),
        half: half.into(),
        world: frame.world_size.into(),
        pixels: frame.view.pixels.map(|p| p as f32),
        light_low: light.low.into(),
        light_size: [light.size(); 2],
        unit_per_pixel: frame.view.unit_per_pixel(),
        light_on: f32::from(u8::from(light.lit)),
        dusk: look.dusk,
        cover: look.cover,
        ground: look.ground.map(|color| rgba(color, 1.0).map(|part| f32::from(part) / 255.0)),
        lines: [red, green, blue, look.rim],
        hills: look.hills,
        stripes: look.stripes,
    }
}

#[cfg(test)]
mod tests;
