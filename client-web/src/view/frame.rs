//! The contents of one drawn frame: plain data, filled by the app from snapshots, read by the renderer.

use jostle_game::Kind;
use jostle_sim::{BodyId, Particles, Shape, Vec2};

/// A body at the sampled moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameBody {
    pub id: BodyId,
    pub kind: Kind,
    /// Palette index of its player, for heroes and packs.
    pub color: Option<u8>,
    pub shape: Shape,
    /// Interpolated centre, world units.
    pub center: Vec2,
    /// Velocity between the two snapshots, units/s.
    pub velocity: Vec2,
    /// Seconds since it was first drawn.
    pub age: f32,
    /// Point that its eyes look at, world units; heroes only.
    pub gaze: Option<Vec2>,
    /// Overlaps another body now (bounds are red then).
    pub touching: bool,
    /// Its picture is hidden, its bounds are filled (the selected body of the bounds scene).
    pub hidden: bool,
    /// Under the pointer and can be dragged, or is held.
    pub hot: bool,
    /// A blow has cracked it.
    pub cracked: bool,
    /// Palette index of the ring around what a game is about: a ball, a robot, a pot.
    pub ring: Option<u8>,
    /// By what share it is flatter than its outline, or `None` to have the drawing find that out
    /// from how it moves from frame to frame.
    pub squash: Option<f32>,
}

/// A zone of a game.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameZone {
    /// Index into the scene's zones.
    pub index: u8,
    pub shape: Shape,
    /// Centre, world units.
    pub center: Vec2,
    /// Palette index of who holds it, or of the zone itself.
    pub color: Option<u8>,
    /// Whether it is on.
    pub on: bool,
    /// Palette index of who is taking it, and how much of the time for that has passed, 0..=1.
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

/// Dots on the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMark {
    /// Its centre, world units.
    pub center: Vec2,
    /// How many, 1 to 6.
    pub dots: u8,
    /// Width and height, world units.
    pub size: f32,
    /// How well it is lit, 0..=1.
    pub light: f32,
}

/// A body that shines on marks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameLamp {
    /// Its centre, world units.
    pub center: Vec2,
    /// How far it shines, world units.
    pub reach: f32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FrameSling {
    /// Where its ball starts, world units.
    pub start: Vec2,
    /// The ball, while it is in the sling.
    pub ball: Option<Vec2>,
    pub shots: u8,
    /// The way that the ball would take, dot by dot.
    pub path: Vec<Vec2>,
}

/// Something that flares up and fades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    pub kind: EffectKind,
    /// Its position, world units.
    pub point: Vec2,
    /// Seconds since it happened.
    pub age: f32,
    /// Palette index of the player behind it.
    pub color: Option<u8>,
    /// Strength: closing speed in units/s for sparks.
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

/// The editor's drawing over and under a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sketch {
    /// Distance between lines of the grid, world units.
    pub grid: f32,
    /// Width of a CSS pixel, world units.
    pub pixel: f32,
    /// In drawing order.
    pub strokes: Vec<Stroke>,
}

/// A mark of the editor. Points are in world units, widths follow from [`Sketch::pixel`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stroke {
    /// The outline of a piece.
    Outline {
        shape: Shape,
        center: Vec2,
        /// How it is drawn.
        tone: Tone,
    },
    /// A line between two points.
    Line([Vec2; 2], Tone),
    /// A part to take hold of: a square one sizes, a round one is a point of a path.
    Handle { at: Vec2, round: bool },
    /// The sign of an emitter.
    Flame(Vec2),
    /// The sign of a launcher.
    Target(Vec2),
    /// A place where heroes appear, with half their extent.
    Spawn(Vec2, Vec2),
}

/// How a mark of the editor is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// A piece that the game draws faintly, or not at all.
    Quiet,
    Chosen,
    /// A line that something is aligned to.
    Guide,
}

/// The part of the world that the camera shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// World point in the middle of the canvas.
    pub center: Vec2,
    /// World units from the bottom to the top of the canvas.
    pub height: f32,
    /// Canvas size in device pixels.
    pub pixels: [u32; 2],
}

impl View {
    /// The view before the first frame.
    pub const UNSEEN: View = View { center: Vec2::ZERO, height: 1.0, pixels: [1, 1] };

    /// World units a device pixel.
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
    /// Bodies in index order.
    pub bodies: Vec<FrameBody>,
    /// Zones, drawn below everything else.
    pub zones: Vec<FrameZone>,
    /// Marks on the wall that are to be seen.
    pub marks: Vec<FrameMark>,
    /// Lamps that shine on some.
    pub lamps: Vec<FrameLamp>,
    /// The sling, where there is one.
    pub sling: Option<FrameSling>,
    /// Flashes of the last second.
    pub effects: Vec<Effect>,
}

/// Everything that one frame shows.
pub struct Frame<'a> {
    pub view: View,
    /// The world spans (0, 0) to this.
    pub world_size: Vec2,
    pub room: &'a FrameRoom,
    /// Particles as of the last applied tick.
    pub particles: &'a Particles,
    /// Seconds since that tick, at most 1/60 either way, to draw particles where they are by now.
    pub particle_lead: f32,
    /// Seconds since the page began to draw; drives blinking and bobbing only.
    pub time: f32,
    /// Draw bounds, centre marks and contacts (F2).
    pub bounds: bool,
    /// Nothing bobs, flashes or sparks, and particles are few and dim.
    pub calm: bool,
    /// Number of the copy of the room; each connection gets a new one, and nothing that moved in
    /// the last moves on.
    pub copy: u32,
    /// The world is dimmed while the connection is lost.
    pub dimmed: bool,
    pub sketch: Option<&'a Sketch>,
    /// The hero of a run that goes along, drawn through.
    pub ghost: Option<&'a FrameBody>,
}
