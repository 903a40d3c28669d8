//! The contents of a drawn frame: plain data that the app fills from snapshots and the renderer reads.

use super::style::Style;
use jostle_game::Kind;
use jostle_game::scene::Theme;
use jostle_sim::{BodyId, Particles, Shape, Vec2};

/// The state of a body at the sampled moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameBody {
    pub id: BodyId,
    pub kind: Kind,
    /// Palette index of the owning player, for heroes and packs.
    pub color: Option<u8>,
    pub shape: Shape,
    /// Interpolated centre, world units.
    pub center: Vec2,
    /// Velocity between the two snapshots, units/s.
    pub velocity: Vec2,
    /// Seconds since the body was first drawn.
    pub age: f32,
    /// The point at which its eyes look, world units; heroes only.
    pub gaze: Option<Vec2>,
    /// Whether it overlaps another body now; its outline is then red.
    pub touching: bool,
    /// Whether a filled outline replaces its drawing, as for the selected body in the bounds scene.
    pub hidden: bool,
    /// Whether it is held, or is under the pointer and can be dragged.
    pub hot: bool,
    /// Whether a hit has cracked it.
    pub cracked: bool,
    /// Palette index of the ring around an important object of the game, such as a ball, a robot or a pot.
    pub ring: Option<u8>,
    /// The share by which the body is flattened. If `None`, this is derived from its motion between frames.
    pub squash: Option<f32>,
}

/// The form in which a zone is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ZoneSign {
    #[default]
    Area,
    /// It reaches beyond the edge of the world.
    Goal,
    /// It is so thin that it can only be crossed.
    Gate,
    /// It follows a body.
    Flag,
}

/// A zone of a game.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameZone {
    /// Index into the scene's zones.
    pub index: u8,
    pub shape: Shape,
    /// Centre, world units.
    pub center: Vec2,
    pub sign: ZoneSign,
    /// Palette index of the holder, or of the zone itself.
    pub color: Option<u8>,
    /// Whether the zone is active.
    pub on: bool,
    /// Palette index of the player or team capturing the zone, and the progress, 0..=1.
    pub taken: Option<(u8, f32)>,
}

/// The label of a zone.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoneLabel {
    pub text: String,
    /// Centre of the zone, world units.
    pub center: Vec2,
    /// Half extent of the zone, world units.
    pub half: Vec2,
    pub color: Option<u8>,
}

/// A mark on the wall, made of dots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMark {
    /// The centre, world units.
    pub center: Vec2,
    /// The number of dots, 1 to 6.
    pub dots: u8,
    /// Width and height, world units.
    pub size: f32,
    /// The brightness, 0..=1.
    pub light: f32,
}

/// A body that illuminates marks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameLamp {
    /// The centre, world units.
    pub center: Vec2,
    /// The reach of its light, world units.
    pub reach: f32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FrameSling {
    /// The starting position of the ball, world units.
    pub start: Vec2,
    /// The ball, while it is in the sling.
    pub ball: Option<Vec2>,
    pub shots: u8,
    /// The predicted path of the ball, as dots.
    pub path: Vec<Vec2>,
}

/// An effect that flares up and fades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    pub kind: EffectKind,
    /// The position, world units.
    pub point: Vec2,
    /// Seconds since the effect began.
    pub age: f32,
    /// Palette index of the player who caused it.
    pub color: Option<u8>,
    /// Strength: closing speed in units/s for sparks, and 1 or 0 for splashes with or without a flash.
    pub strength: f32,
    pub body: Option<BodyId>,
}

/// Kinds of [`Effect`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffectKind {
    Spark,
    /// A pack burst on a hero.
    Splash,
    /// A body left the world.
    Gone,
}

/// A stain of dye on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameStain {
    pub body: BodyId,
    /// The position on the body, as a share of its half extent, -1..=1.
    pub at: Vec2,
    /// Half extent, world units.
    pub half: Vec2,
    /// Palette index of the thrower.
    pub color: u8,
    /// How much of the stain has not faded yet, 0..=1.
    pub left: f32,
}

/// Points that fly up from where they were won.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FramePoints {
    /// Where they were won, world units.
    pub at: Vec2,
    pub points: i32,
    /// Palette index of the side that won them.
    pub color: u8,
    /// Seconds since they were won.
    pub age: f32,
}

/// Confetti that falls through the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameConfetti {
    /// Palette index of the winner.
    pub color: u8,
    /// Seconds since it was thrown.
    pub age: f32,
}

/// The editor's overlay above and below a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sketch {
    /// Distance between grid lines, world units.
    pub grid: f32,
    /// Width of a CSS pixel, world units.
    pub pixel: f32,
    /// The strokes in drawing order.
    pub strokes: Vec<Stroke>,
}

/// A stroke in the editor's overlay. Points are in world units; widths follow from [`Sketch::pixel`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stroke {
    /// The outline of a piece.
    Outline {
        shape: Shape,
        center: Vec2,
        /// The style of the outline.
        tone: Tone,
    },
    /// A line between two points.
    Line([Vec2; 2], Tone),
    /// A handle. A square one resizes a piece, and a round one is a point of a path.
    Handle { at: Vec2, round: bool },
    /// The symbol for an emitter.
    Flame(Vec2),
    /// The symbol for a launcher.
    Target(Vec2),
    /// A spawn point, with half the size of a hero.
    Spawn(Vec2, Vec2),
}

/// The style of an editor stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// A piece that the game draws faintly or not at all.
    Quiet,
    Chosen,
    /// A line to which something is aligned.
    Guide,
}

/// The part of the world that the camera shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The world point at the centre of the canvas.
    pub center: Vec2,
    /// The height of the view, world units.
    pub height: f32,
    /// Canvas size in device pixels.
    pub pixels: [u32; 2],
}

impl View {
    /// The view before the first frame.
    pub const UNSEEN: View = View { center: Vec2::ZERO, height: 1.0, pixels: [1, 1] };

    /// Half its width and height, world units.
    pub fn half(&self) -> Vec2 {
        let aspect = self.pixels[0] as f32 / self.pixels[1].max(1) as f32;
        Vec2::new(aspect, 1.0) * (0.5 * self.height)
    }

    /// World units per device pixel.
    pub fn unit_per_pixel(&self) -> f32 {
        self.height / self.pixels[1] as f32
    }

    /// The world point under a device pixel (y down, origin top left).
    pub fn to_world(&self, pixel: Vec2) -> Vec2 {
        let size = Vec2::new(self.pixels[0] as f32, self.pixels[1] as f32);
        let from_middle = Vec2::new(pixel.x - size.x * 0.5, size.y * 0.5 - pixel.y);
        self.center + from_middle * self.unit_per_pixel()
    }

    /// The device pixel (y down, origin top left) of a world point.
    pub fn to_pixel(&self, point: Vec2) -> Vec2 {
        let size = Vec2::new(self.pixels[0] as f32, self.pixels[1] as f32);
        let offset = (point - self.center) / self.unit_per_pixel();
        Vec2::new(size.x * 0.5 + offset.x, size.y * 0.5 - offset.y)
    }
}

/// The part of a frame that shows a room.
#[derive(Debug, Default)]
pub struct FrameRoom {
    /// The theme of the scene.
    pub theme: Theme,
    /// Bodies in index order.
    pub bodies: Vec<FrameBody>,
    /// Zones, drawn below everything else.
    pub zones: Vec<FrameZone>,
    /// The visible marks on the wall.
    pub marks: Vec<FrameMark>,
    /// The lamps that illuminate marks.
    pub lamps: Vec<FrameLamp>,
    /// The sling, if the scene has one.
    pub sling: Option<FrameSling>,
    /// Flashes from the last second.
    pub effects: Vec<Effect>,
    /// Stains of dye on bodies.
    pub stains: Vec<FrameStain>,
    /// The seeds of particles of dye with their throwers' palette indices, in order of the seeds.
    pub dyes: Vec<(u32, u8)>,
    /// Points that were just scored.
    pub points: Vec<FramePoints>,
    /// The leader's hero, which wears a crown.
    pub crown: Option<BodyId>,
    /// The confetti after a round.
    pub confetti: Option<FrameConfetti>,
}

/// Everything that a frame shows.
pub struct Frame<'a> {
    pub view: View,
    /// The world's upper right corner; the lower left one is (0, 0).
    pub world_size: Vec2,
    pub room: &'a FrameRoom,
    /// Particles as of the most recently applied tick.
    pub particles: &'a Particles,
    /// Seconds since that tick, at most 1/60 in either direction, for drawing particles at their current positions.
    pub particle_lead: f32,
    /// Seconds since the page started drawing; drives only blinking and bobbing.
    pub time: f32,
    /// Whether outlines, centre marks and contacts are drawn (F2).
    pub bounds: bool,
    /// Whether motion is reduced: no bobbing, flashes or sparks, and few, dim particles.
    pub calm: bool,
    /// The number of the replica. Each connection gets a new one, and motion is not carried over between them.
    pub copy: u32,
    /// Whether the world is dimmed because the connection is lost.
    pub dimmed: bool,
    pub sketch: Option<&'a Sketch>,
    /// The ghost of a recorded run, drawn translucent.
    pub ghost: Option<&'a FrameBody>,
}

impl Frame<'_> {
    /// How the frame is drawn. The outlines of the bounds view need a dark ground.
    pub fn style(&self) -> &'static Style {
        Style::of(if self.bounds { Theme::Ink } else { self.room.theme })
    }
}
